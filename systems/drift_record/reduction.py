"""Reduction of a drift record: noise model of each column, its coefficients N, B, K, R, Q, and the evidence for it.

The rate without what other columns explain goes to gyrobench.reduction.noise_model: white noise through the filter of
the sensor, angle noise, Gauss-Markov processes, flicker, random walk, ramp; lines, wild samples and steps taken out and
told.  A coefficient is printed where the deviation implied by the whole model is the record's own.  Beside it the
slopes of the Allan deviation, deviations, spectrum, stationarity, distribution and an autoregressive model.
[DRIFT-NOISE-MODEL, DRIFT-ALLAN, DRIFT-STATS-RUNS, DRIFT-PERIODIC, DRIFT-AR-BURG; IEEE 952, annex C; Xia 2008, ch. 3]

Not modelled: drift of the scale factor; temperature that acts with a lag; noise whose level changes (said, not
modelled).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from gyrobench.record.drift_columns import DIRECT
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.noise_model.noise_model import NoiseModel
from gyrobench.reduction.series.channel_correlation import whitened
from gyrobench.reduction.series.checks import block_means
from gyrobench.reduction.series.deviations import Deviation, deviations
from gyrobench.reduction.series.noise_coefficients import Estimate
from gyrobench.reduction.series.noise_coefficients_table import TERMS
from gyrobench.reduction.series.smoothing import smooth_drift
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.toolkit import Record, ReductionError, RunDocument, plain
from gyrobench.result import Coefficient, DriftColumn, DriftRecordResult, Reason, Table
from gyrobench.result_entries import (
    DeviationCurve,
    NoiseModelCurves,
    RateBand,
    RateRecord,
    SampleCorrelation,
    SpectrumBand,
)

from . import description, model_tables, noise_tables, together
from .channels import RecordChannel, analysed
from .preparation import Columns, Prepared, columns_of, prepare, truth_of

__all__ = ["ReductionError", "from_record"]

SHOWN, SHOWN_LAGS = 1500, 40  # intervals of the record, lags that are drawn
LEAST_DEVIATION = "B_min"
RESIDUAL = (
    "The deviations are those of the rate without what lines, steps and other columns explain and without its wild "
    "samples: where these fits have taken slow drift along, they are too small at long averaging times."
)
FIELDS = ("tau", "deviation", "low", "high", "edf", "count", "exponent")
KINDS = {"allan": "Allan", "modified": "modified Allan", "hadamard": "Hadamard"}


@dataclass(frozen=True)
class Analysed:
    """A column with its noise model and deviations, SI."""

    of: Prepared
    deviations: Mapping[str, Deviation]

    @property
    def noise(self) -> NoiseModel:
        return self.of.noise


def from_record(record: Record) -> DriftRecordResult:
    """Return what a record says.  Raises ReductionError where it is too short or cannot be analysed."""
    run = record.run
    columns = columns_of(record)
    names, truth = list(columns.rates), truth_of(record)
    several = len(names) > 1
    channels = analysed(lambda k: channel(names[k], columns, run, truth, several), len(names), columns.time.size)
    reasons, summary = channels[0].reasons, channels[0].summary
    shared = list[Table]()
    if several:
        shared, common, summary = together.tables(channels, columns.step, run)
        reasons = [*common, *together.merged({c.name: c.reasons for c in channels})]
    found = DriftRecordResult(
        method="Noise model of greatest evidence whose deviation is the record's own, deviations, spectrum, models",
        sources=["DRIFT-NOISE-MODEL, DRIFT-ALLAN; IEEE 952, annex C",
                 "DRIFT-STATS-RUNS, DRIFT-PERIODIC, DRIFT-AR-BURG; Xia 2008, ch. 3"],
        equation='S(f) = N^2 abs(H)^2 + sum_i (2 sigma_i^2 tau_i)/(1 + (2 pi f tau_i)^2) + B^2/(2 pi f) + '
        'K^2/(2 pi f)^2 + 4 Q^2/tau_0 sin^2 (pi f tau_0)',
        conventions=[*columns.conventions, *description.conventions()],
        coefficients=[c for a in channels for c in a.coefficients],
        columns=[c.column for c in channels],
    )  # fmt: skip
    stated = not run.measured or "latitude" in (run.series or {}).get("stated", [])
    site = run_metadata.Location.of(run).shown() if stated else {}
    found = replace(found, instrument=run.instrument, site=site, simulated=not run.measured)
    reasons = [*reasons, *description.of_motion(columns), *description.of_rows(run)]
    return replace(found, reasons=reasons, summary=summary, tables=shared)


def _named(term: str, a: Analysed, several: bool) -> str:
    return f"{term} {a.of.name}" if several else term


def _reasons(a: Analysed, run: RunDocument, several: bool) -> list[Reason]:
    """Return what is to be said of a column, and what takes the verdicts of its coefficients away."""
    names = tuple(_named(term, a, several) for term in (*TERMS, LEAST_DEVIATION))
    against = [(id, text, names) for id, text in description.doubts(a.of, run).items()]
    if jumps := noise_tables.jumps_text(a.noise):
        against.append(("drift_record.jumps", jumps, names))
    if curve := noise_tables.curve_text(a.noise):
        against.append(("drift_record.curve", curve, tuple(_named(term, a, several) for term in ("K", "R"))))
    if taken_off := description.taken_off_text(a.of):
        of = tuple(_named(term, a, several) for term in ("B", "K", "R", LEAST_DEVIATION))
        against.append(("drift_record.taken_off", taken_off, of))
    return description.warnings(a.of, run) + [
        Reason(id, text, ("pass", "fail"), of, severity="doubt") for id, text, of in against
    ]


def channel(name: str, columns: Columns, run: RunDocument, truth: Mapping[str, float], several: bool) -> RecordChannel:
    """Return what a column says, and what the findings of several need of it."""
    a = analyse(name, columns, run)
    p, noise, lines = a.of, a.noise, a.of.lines.lines
    length = p.rate.size * p.step
    ordinates = whitened(p.stretch, p.step, noise.spectrum) if several else np.empty(0)
    return RecordChannel(
        name=name, units=p.units, coefficients=_coefficients(a, run, truth, several), reasons=_reasons(a, run, several),
        summary=description.summary(name, noise, p.units, several), column=_column(a, run), first=p.first,
        ordinates=ordinates, lines=lines, resolution=1.0 / (p.stretch.size * p.step), N=noise["N"],
        minimum=noise.minimum, agrees=noise.agrees, inside=min(x.share for x in noise.agreements),
        explained=p.explained, found=description.in_short(p, run), mean=float(np.nanmean(p.rate)),
        u_mean=float(noise.allan(np.array([length]))[0]),
    )  # fmt: skip


def analyse(name: str, columns: Columns, run: RunDocument) -> Analysed:
    """Return a column with its noise model and deviations."""
    series = run.series or {}
    about: Mapping[str, Any] = series["columns"][name] if series else {"kind": "", "white": True}
    points = about["kind"] in DIRECT and series.get("samples") == "points" and series["factor"] == 1
    p = prepare(
        name, columns, bool(run.options.get("remove_lines", True)), not points, about["white"], about.get("alike", 0.0)
    )
    held = deviations(p.clean, p.step, tuple(KINDS))
    every = {
        kind: Deviation("", **{n: np.asarray(d[n]) for n in FIELDS})
        for kind, d in series.get("deviations", {}).get(name, {}).items()
        if columns.moved is None  # they are of every sample
    }
    if every and p.cleaned:  # of the averaging times that the means do not reach, as recorded
        held = {kind: _joined(every[kind], d) for kind, d in held.items()}
    return Analysed(p, held if p.cleaned or not every else every)


def _joined(short: Deviation, long: Deviation) -> Deviation:
    below = short.tau < long.tau[0] * (1.0 - 1e-9)
    return Deviation(long.kind, **{n: np.append(getattr(short, n)[below], getattr(long, n)) for n in FIELDS})


def _coefficients(a: Analysed, run: RunDocument, truth: Mapping[str, float], several: bool) -> list[Coefficient]:
    relative = float(run.options.get("u_scale_factor", 0.0))
    out = [_coefficient(a, term, several, truth.get(term), relative) for term in TERMS]
    units = a.of.units
    least, when = a.noise.minimum.deviation, a.noise.minimum.tau
    meaning = "bias instability as the least Allan deviation"
    if least.determined:
        meaning += f", at {noise_tables.range_text(when)} s"
    else:
        least = replace(least, low=0.0)  # what it falls to later is not in the record
    why = "" if least.determined else "not determined: the deviation still falls at the longest averaging time"
    name = _named(LEAST_DEVIATION, a, several)
    return [*out, _stated(a, name, meaning, units.unit, least, units.si, why, None, relative, not several)]


def _coefficient(a: Analysed, term: str, several: bool, truth: float | None, relative: float) -> Coefficient:
    unit, si, meaning = a.of.units.terms[term]
    e: Estimate = a.noise[term]
    why = "" if e.determined else noise_tables.absent(term, a.noise)
    return _stated(a, _named(term, a, several), meaning, unit, e, si, why, truth, relative, not several)


def _stated(
    a: Analysed, name: str, meaning: str, unit: str, e: Estimate, si: float, why: str, truth: float | None,
    relative: float, bound: bool,
) -> Coefficient:  # fmt: skip
    """Return a coefficient with its interval; without a value where ``why`` says why, or the model is not right.

    bound: the reason states the upper end; of many channels it stands in the table alone.
    """
    value, low, high = e.value / si, e.low / si, e.high / si
    true = None if truth is None else truth / si
    if not a.noise.agrees:
        why, low, high = noise_tables.contradicted(a.noise), math.nan, math.nan
    elif why and bound:
        why = f"{why}; below {plain(max(abs(low), abs(high)))} {unit} (95 %)"
    if why:
        return Coefficient(name, meaning, unit, math.nan, math.nan, NORMAL, (low, high), truth=true, no_value=why)
    u_a = (high - low) / (2.0 * NORMAL)
    u = math.hypot(u_a, relative * value)
    more = NORMAL * (u - u_a)
    return Coefficient(
        name, meaning, unit, value, u, NORMAL, (low - more, high + more), u_a=u_a, truth=true,
        z=None if true is None else (value - true) / u,
    )  # fmt: skip


def _column(a: Analysed, run: RunDocument) -> DriftColumn:
    p, m, si = a.of, a.of.model, a.of.units.si
    longest = max(d.tau[-1] for d in a.deviations.values())
    tau = p.step * np.unique(np.rint(np.geomspace(1.0, longest / p.step, 120)))  # of whole samples
    s, c = m.spectrum, m.correlation
    f = np.geomspace(1.0 / (m.n * m.dt), 0.5 / m.dt, 120)
    dev, density = a.noise.allan(tau) / si, 2.0 * a.noise.spectrum(f) / si**2
    lags = slice(0, SHOWN_LAGS + 1)
    column = DriftColumn(
        name=p.name,
        unit=p.units.unit,
        quantity=p.units.words,
        level_unit=p.units.level,
        record=_envelope(p),
        deviations=[_deviation(kind, d, si) for kind, d in a.deviations.items()],
        model=NoiseModelCurves(tau.tolist(), dev.tolist(), f.tolist(), density.tolist()),
        spectrum=SpectrumBand(s.frequency.tolist(), *((v / si**2).tolist() for v in (s.density, s.low, s.high))),
        correlation=SampleCorrelation(c.lag[lags].tolist(), c.rho[lags].tolist(), c.partial[lags].tolist(), c.bound),
    )
    return replace(
        column,
        tables={
            "acquisition": [description.acquisition(p, run)],
            "regression": description.regression(p),
            "deviations": [noise_tables.bias_instability(a.noise, p.units),
                           noise_tables.agreement(a.noise, p.units),
                           description.slope_readings(a.noise, a.deviations["allan"], p.units)],
            "spectrum": [*description.lines(p), *noise_tables.resonances(a.noise, p.units)],
            "stationarity": [model_tables.stationarity(m, p.units)],
            "model": [*(noise_tables.terms(a.noise, p.units) if a.noise.agrees else []),
                      *noise_tables.gauss_markov(a.noise, p.units), *model_tables.models(m, p.units)],
        },
        texts={
            "acquisition": description.acquisition_texts(p, run),
            "regression": p.inseparable,
            "deviations": [noise_tables.agreement_text(a.noise), *([RESIDUAL] if p.cleaned else []),
                           *([text] if (text := noise_tables.one_curve_text(a.noise)) else [])],
            "spectrum": [*description.line_texts(p), noise_tables.terms_text(a.noise)],
            "model": model_tables.model_texts(m, p.units),
        },
    )  # fmt: skip


def _smoothed(p: Prepared) -> RateBand | None:
    """Gauss-Markov part of the longest stretch with its 95 % band, where Gauss-Markov and white noise describe it."""
    m, drift = p.model, p.model.gauss_markov
    if m.recommended not in ("ARMA(1,1)", "AR(1)") or drift is None or not drift.determined or not drift.density > 0.0:
        return None
    y = block_means(p.stretch, m.factor)
    t = p.time[p.first] + m.model_dt * (np.arange(y.size) + 0.5)
    slope = m.trend.slope * (t - t.mean()) if m.trend is not None and m.detrended else np.zeros(y.size)
    value, sd = smooth_drift(y - slope, m.model_dt, drift)
    every = slice(None, None, max(1, y.size // SHOWN))
    lines = (value + slope + side * NORMAL * sd for side in (-1.0, 0.0, 1.0))
    return RateBand(t[every].tolist(), *((v[every] / p.units.level_si).tolist() for v in lines))


def _deviation(kind: str, d: Deviation, si: float) -> DeviationCurve:
    dev, low, high = ((v / si).tolist() for v in (d.deviation, d.low, d.high))
    return DeviationCurve(KINDS[kind], d.tau.tolist(), dev, low, high, d.edf.tolist())


def _envelope(p: Prepared) -> RateRecord:
    """Least and largest rate of each of SHOWN intervals, and its mean; gaps are left out."""
    edges = np.unique(np.linspace(0, p.rate.size, min(SHOWN, p.rate.size) + 1).astype(int))
    parts = [p.rate[a:b] for a, b in pairwise(edges.tolist())]
    there = [k for k, v in enumerate(parts) if np.isfinite(v).any()]
    middle = 0.5 * (p.time[edges[:-1]] + p.time[edges[1:] - 1] + p.step)
    low, mean, high = (
        [float(f(parts[k])) / p.units.level_si for k in there] for f in (np.nanmin, np.nanmean, np.nanmax)
    )
    return RateRecord(middle[there].tolist(), low, mean, high, _smoothed(p))
