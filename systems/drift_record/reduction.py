"""Reduction of a drift record: noise coefficients N, B, K, R, Q of each column, and the evidence for them.

    S(f) = N^2 + B^2/(2 pi f) + K^2/(2 pi f)^2 + 4 Q^2 sin^2(pi f tau)/tau,   two-sided;   rate = ... + R t

estimated by restricted maximum likelihood from the rate without what lines and other columns explain
(gyrobench.reduction.series.noise_coefficients), beside them the slopes of the Allan deviation, deviations, spectrum,
stationarity, distribution and an autoregressive model.
[DRIFT-ALLAN, DRIFT-STATS-RUNS, DRIFT-PERIODIC, DRIFT-AR-BURG; IEEE 952, annex C; Xia 2008, ch. 3]

Not modelled: noise that none of the five terms describes (Gauss-Markov drift of a correlation time within the record):
the test of the model says so; steps of the bias; drift of the scale factor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.checks import block_means
from gyrobench.reduction.series.deviations import Deviation, deviations
from gyrobench.reduction.series.long_record import SHORTEST
from gyrobench.reduction.series.noise_coefficients import Estimate, NoiseCoefficients, fit
from gyrobench.reduction.series.noise_coefficients_table import TERMS
from gyrobench.reduction.series.smoothing import smooth_drift
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Coefficient, DriftColumn, DriftRecordResult, Reason
from gyrobench.units import DPH

from . import description, model_tables
from .preparation import LEAST, WHOLE, Prepared, columns_of, prepare, truth_of

__all__ = ["ReductionError", "from_record"]

SHOWN, SHOWN_LAGS = 1500, 40  # intervals of the record, lags that are drawn
RESIDUAL = (
    "The deviations are those of the rate without what lines and other columns explain: where these fits have taken "
    "slow drift along, the deviations are too small at long averaging times."
)
FIELDS = ("tau", "deviation", "low", "high", "edf", "count", "exponent")
KINDS = {"allan": "Allan", "modified": "modified Allan", "hadamard": "Hadamard"}


@dataclass(frozen=True)
class Analysed:
    """A column with its noise coefficients and deviations, SI."""

    of: Prepared
    noise: NoiseCoefficients
    deviations: Mapping[str, Deviation]


def from_record(record: Record) -> DriftRecordResult:
    """Return what a record says.  Raises ReductionError where it is too short or cannot be analysed."""
    run = record.run
    columns = columns_of(record)
    remove = bool(run.options.get("remove_lines", True))
    analysed = [analyse(prepare(name, columns, remove), run.series) for name in columns.rates]
    several = len(analysed) > 1
    return DriftRecordResult(
        method="Noise coefficients by restricted maximum likelihood, deviations, spectrum, model of the random drift",
        sources=["DRIFT-ALLAN; IEEE 952, annex C", "DRIFT-STATS-RUNS, DRIFT-PERIODIC, DRIFT-AR-BURG; Xia 2008, ch. 3"],
        equation='S(f) = N^2 + B^2/(2 pi f) + K^2/(2 pi f)^2 + 4 Q^2/tau_0 sin^2 (pi f tau_0), quad '
        'sigma_"A"^2 = N^2/tau + (2 ln 2)/pi B^2 + K^2 tau/3 + R^2 tau^2/2 + 3 Q^2/tau^2',
        conventions=[*columns.conventions, *description.conventions(run)],
        coefficients=[c for a in analysed for c in _coefficients(a, run, several)],
        reasons=[r for a in analysed for r in _reasons(a, run, several)],
        summary=[s for a in analysed for s in description.summary(a.of.name, a.noise, several)],
        instrument=run.instrument,
        site={} if run.measured else run_metadata.Site.of(run).shown(),
        simulated=not run.measured,
        columns=[_column(a, run, remove) for a in analysed],
    )  # fmt: skip


def _named(term: str, a: Analysed, several: bool) -> str:
    return f"{term} {a.of.name}" if several else term


def _reasons(a: Analysed, run: RunDocument, several: bool) -> list[Reason]:
    """Return what is to be said of a column, and what takes the verdicts of its coefficients away."""
    of = f"Column {a.of.name}: " if several else ""
    said = [replace(r, text=of + r.text) for r in description.warnings(a.of, a.noise, run)]
    names = tuple(_named(term, a, several) for term in TERMS)
    against = description.doubts(a.of, a.noise, run).items()
    return said + [Reason(id, of + text, ("pass", "fail"), names, severity="doubt") for id, text in against]


def stretches(x: Array, least: int = 2) -> list[Array]:
    """Return the runs of a series without a gap, ``least`` values or more."""
    edges = np.flatnonzero(np.diff(np.isfinite(x).astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    return [x[a:b] for a, b in edges.tolist() if b - a >= least]


def analyse(p: Prepared, series: Mapping[str, Any] | None = None) -> Analysed:
    """Return the noise coefficients and deviations of a column."""
    whole = stretches(p.clean, SHORTEST)
    held_whole = sum(x.size for x in whole) >= WHOLE * np.count_nonzero(np.isfinite(p.clean))
    singles = p.averaged > 1 and (len(whole) > MANY or not held_whole)  # are missing all over
    noise = missing_all_over(p, whole) if singles else fit(whole, p.step)
    held = deviations(p.clean, p.step, tuple(KINDS))
    every = {kind: _read(d) for kind, d in (series or {}).get("deviations", {}).get(p.name, {}).items()}
    if every and p.cleaned:  # of the averaging times that the means do not reach, as recorded
        held = {kind: _joined(every[kind], d) for kind, d in held.items()}
    return Analysed(p, noise, held if p.cleaned or not every else every)


def missing_all_over(p: Prepared, whole: Sequence[Array]) -> NoiseCoefficients:
    """Return the coefficients of a record from which single samples are missing: B, K and R of means over those that
    are there, N and Q of the longest stretches ``whole`` without a gap.

    Means of k samples in place of m hold s2 (1/k - 1/m) of white noise more, s2 the variance of a sample: so much is
    taken off N2 and the lower end of its interval, not off the upper, as little of it is there where samples are not
    independent.  That N is taken where it is the better one.  Errors of angles do not cancel in such means.
    """
    slow = fit([p.stretch], p.stretch_step)
    k = np.isfinite(p.clean[p.first : p.first + p.stretch.size * p.averaged]).reshape(-1, p.averaged).sum(axis=1)
    steps = np.diff(p.clean)
    more = 0.5 * float(np.nanmean(steps**2)) * p.step * (p.averaged * float(np.mean(1.0 / k)) - 1.0)
    value, low = (math.sqrt(max(x * x - more, 0.0)) for x in (slow.N.value, max(slow.N.low, 0.0)))
    N, Q = Estimate(value, low, slow.N.high, low > 0.0), Estimate(0.0, 0.0, slow.Q.high, False)
    if sum(x.size for x in whole) >= LEAST:
        fast = fit(whole, p.step)
        N, Q = min((N, fast.N), key=lambda e: e.high - e.low), fast.Q
    return replace(slow, N=N, Q=Q)


def _read(d: Mapping[str, Any]) -> Deviation:
    return Deviation("", **{n: np.asarray(d[n]) for n in FIELDS})


def _joined(short: Deviation, long: Deviation) -> Deviation:
    below = short.tau < long.tau[0] * (1.0 - 1e-9)
    return Deviation(long.kind, **{n: np.append(getattr(short, n)[below], getattr(long, n)) for n in FIELDS})


MANY = 200  # stretches of a record that are fitted one by one


def _coefficients(a: Analysed, run: RunDocument, several: bool) -> list[Coefficient]:
    truth, relative = truth_of(run), float(run.options.get("u_scale_factor", 0.0))
    return [_coefficient(a, term, _named(term, a, several), truth.get(term), relative) for term in TERMS]


def _coefficient(a: Analysed, term: str, name: str, truth: float | None, relative: float) -> Coefficient:
    unit, si, meaning = TERMS[term]
    e: Estimate = getattr(a.noise, term)
    value, low, high = e.value / si, e.low / si, e.high / si
    true = None if truth is None else truth / si
    if not e.determined:
        below = max(abs(low), abs(high))
        why = f"not determined, below {below:.2g} {unit} (95 %): the record is too short or other noise covers it"
        return Coefficient(name, meaning, unit, math.nan, math.nan, NORMAL, (low, high), truth=true,
                           no_value=why)  # fmt: skip
    if e.just_determined:
        meaning = f"{meaning}; just determined"
    u_a = (high - low) / (2.0 * NORMAL)
    u = math.hypot(u_a, relative * value)
    more = NORMAL * (u - u_a)
    return Coefficient(
        name, meaning, unit, value, u, NORMAL, (low - more, high + more), u_a=u_a, truth=true,
        z=None if true is None else (value - true) / u,
    )  # fmt: skip


def _column(a: Analysed, run: RunDocument, removed: bool) -> DriftColumn:
    p, m = a.of, a.of.model
    tau = np.geomspace(p.step, max(d.tau[-1] for d in a.deviations.values()), 120)
    s, c = m.spectrum, m.correlation
    f = np.geomspace(1.0 / (m.n * m.dt), 0.5 / m.dt, 120)
    density = {n: (v / DPH**2).tolist() for n, v in (("S", s.density), ("low", s.low), ("high", s.high))}
    model = {"f": f.tolist(), "S": (2.0 * a.noise.spectrum(f, m.dt) / DPH**2).tolist()}
    lags = slice(0, SHOWN_LAGS + 1)
    return DriftColumn(
        name=p.name,
        unit="°/h",
        record=_envelope(p) | _smoothed(p),
        deviations=[_deviation(kind, d) for kind, d in a.deviations.items()],
        model={"tau": tau.tolist(), "dev": (a.noise.allan(tau) / DPH).tolist(), **model},
        spectrum={"f": s.frequency.tolist(), **density},
        correlation={"lag": c.lag[lags].tolist(), "rho": c.rho[lags].tolist(), "partial": c.partial[lags].tolist(),
                     "bound": c.bound},
        tables={
            "acquisition": [description.acquisition(p, run)],
            "regression": description.regression(p),
            "deviations": [description.slope_readings(a.noise, a.deviations["allan"])],
            "spectrum": description.lines(p, removed),
            "stationarity": [model_tables.stationarity(m)],
            "model": model_tables.models(m),
        },
        texts={
            "acquisition": description.acquisition_texts(p, run),
            "deviations": [RESIDUAL] if p.cleaned else [],
            "spectrum": [*description.line_texts(p), description.misfit_text(a.noise)],
            "model": model_tables.model_texts(m),
        },
    )  # fmt: skip


def _smoothed(p: Prepared) -> dict[str, Any]:
    """Gauss-Markov part of the longest stretch with its 95 % band, where Gauss-Markov and white noise describe it."""
    m, drift = p.model, p.model.gauss_markov
    if m.recommended not in ("ARMA(1,1)", "AR(1)") or drift is None or not drift.determined or not drift.density > 0.0:
        return {}
    y = block_means(p.stretch, m.factor)
    t = p.time[p.first] + m.model_dt * (np.arange(y.size) + 0.5)
    slope = m.trend.slope * (t - t.mean()) if m.trend is not None and m.detrended else np.zeros(y.size)
    value, sd = smooth_drift(y - slope, m.model_dt, drift)
    every = slice(None, None, max(1, y.size // SHOWN))
    band = {"t": t, "mean": value + slope, "low": value + slope - NORMAL * sd, "high": value + slope + NORMAL * sd}
    return {"smoothed": {n: (v[every] / (1.0 if n == "t" else DPH)).tolist() for n, v in band.items()}}


def _deviation(kind: str, d: Deviation) -> dict[str, Any]:
    scaled = {"dev": d.deviation, "low": d.low, "high": d.high}
    return {"kind": KINDS[kind], "tau": d.tau.tolist(), **{n: (v / DPH).tolist() for n, v in scaled.items()},
            "edf": d.edf.tolist()}  # fmt: skip


def _envelope(p: Prepared) -> dict[str, Any]:
    """Least and largest rate of each of SHOWN intervals, and its mean; gaps are left out."""
    edges = np.unique(np.linspace(0, p.rate.size, min(SHOWN, p.rate.size) + 1).astype(int))
    parts = [p.rate[a:b] for a, b in pairwise(edges.tolist())]
    there = [k for k, v in enumerate(parts) if np.isfinite(v).any()]
    middle = 0.5 * (p.time[edges[:-1]] + p.time[edges[1:] - 1] + p.step)
    low, mean, high = ([float(f(parts[k])) / DPH for k in there] for f in (np.nanmin, np.nanmean, np.nanmax))
    return {"t": middle[there].tolist(), "low": low, "mean": mean, "high": high}
