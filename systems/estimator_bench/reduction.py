"""Reduction of the estimator bench: the measures of gyrobench.reduction.loops.estimator_result over the record, and
its picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.estimation.fit_result import plus_minus
from gyrobench.reduction.loops import estimator_result
from gyrobench.reduction.loops.estimator_result import Measures, Signals
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import LoopResult, Response, Specification

from .benchmarks import BENCHMARKS

SHOWN, COMPARED = 1000, 1000  # intervals of the whole time, and readings of the close-up


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """The result of a record; raises ReductionError where it cannot be reduced."""
    run = record.run
    known = BENCHMARKS.get(str(run.options.get("benchmark")))
    if known is None:
        raise ReductionError(f"the record does not say which benchmark it is of: one of {', '.join(BENCHMARKS)}")
    options, p = run.options, run.parameters
    skip = int(options["skip"]) if options.get("skip", -1) >= 0 else known.skip
    s = signals(record.channels, skip, known.Ts)
    sine = float(p.get("source.amplitude", 0.0)) != 0.0
    random = any(float(p.get(f"source.{n}", 0.0)) != 0.0 for n in ("p", "walk", "markov"))
    frequency = float(p["source.frequency"]) if sine and not random else None
    m = estimator_result.measure(s, frequency, true_variance(p, s.time))
    name = run.parts["estimator"].name if "estimator" in run.parts else ""
    return run_metadata.finish(_result(m, s, known.title, name, specification or {}), record)


def signals(channels: Mapping[str, Array], skip: int, Ts: float) -> Signals:
    """The channels without the row at t = 0 and the first ``skip`` readings.  Raises ReductionError."""
    needed = ("time", "source.z", "source.truth", "estimator.estimate")
    missing = [n for n in needed if n not in channels]
    if missing:
        raise ReductionError([f"channel {n} is missing" for n in missing])
    rows = np.flatnonzero(np.asarray(channels["time"]) > 0.5 * Ts)[skip:]
    if rows.size == 0:
        raise ReductionError(f"the record ends before the {skip} readings that are left out at the start are over")

    series = {n: np.asarray(values, dtype=float)[rows] for n, values in channels.items()}
    of = series.get
    latency = float(series["estimator.latency"][-1]) if "estimator.latency" in series else None
    return Signals(
        series["time"], series["source.z"], series["estimator.estimate"], series["source.truth"],
        latency, of("estimator.variance"), of("estimator.innovation"),
        of("estimator.nis"), of("estimator.R_hat"),
    )  # fmt: skip


def true_variance(p: Mapping[str, Any], time: Array) -> float | None:
    """Variance of a reading as the source had it; None where it changes inside the record or is not known."""
    if "source.white" not in p:
        return None
    after = float(p.get("source.change_time", math.inf))
    factor = float(p.get("source.change_factor", 1.0))
    if factor != 1.0 and time[0] < after < time[-1]:
        return None
    return (float(p["source.white"]) * (factor if time[0] >= after else 1.0)) ** 2


def _result(m: Measures, s: Signals, title: str, name: str, limits: Specification) -> LoopResult:
    for c in m.coefficients:
        c.limit = limits.get(c.name)
        c.verdict = uncertainty.assess_conformity(c.estimate, c.k * c.u, c.limit)
    error, re_raw = m.named(estimator_result.RANKED), m.named("error re raw")
    gain, noise, delay = (m.named(n) for n in ("gain", "noise re raw", "delay"))
    return LoopResult(
        system="estimator_bench",
        title="Bench of estimators",
        method="Estimate against the known truth: error, delay, noise reduction with gain and phase, consistency",
        sources=[
            "BENCH-DYN-SINE, BENCH-DRIFT-LL, BENCH-DRIFT-AR3; Xia 2008, sections 3.4.5, 4.4.2",
            "EST-KF-AR, EST-SAGE-HUSA, EST-WAVELET-ONLINE; Xia 2008, sections 4.2, 4.3, corrected by EX14, EX19-EX23",
        ],
        equation='z = x + v, quad e = hat(x) - x, quad "NEES" = e^2\\/P, quad "NIS" = y^2\\/S',
        conventions=[
            f"Truth and readings: {title}.",
            "Error: estimate less the truth of the same instant. Late error: less the truth one latency ago, where the "
            "estimator states a latency.",
            "dB: 20 log10 of the ratio of rms values; below 0 is better than the reading itself.",
            "Noise reduction is what is left beside the truth as it comes through; it means nothing without the gain.",
        ],
        coefficients=m.coefficients,
        dof=float(s.time.size),
        tests=m.tests,
        residual_std=float(np.sqrt(np.mean(m.error**2))),
        residual_unit="1",
        acf=m.acf,
        warnings=m.warnings,
        summary=[
            f"{name or 'The estimator'}: rms error {plus_minus(error).replace(' 1 ', ' ')} against the truth of the "
            f"same instant, {re_raw.estimate:+.1f} dB against the readings themselves.",
            f"Noise {noise.estimate:+.1f} dB, and what that costs: gain {plus_minus(gain).replace(' 1 ', ' ')}"
            + "".join(f", phase {plus_minus(c)}" for c in m.coefficients if c.name == "phase")
            + f", delay {plus_minus(delay)}.",
            " ".join(f"{t.name}: {t.finding}." for t in m.tests)
            or "The estimator states no variance: it cannot be asked whether it is consistent.",
        ],
        decision_rule=uncertainty.DECISION_RULE,
        verdict=uncertainty.worst_verdict(c.verdict for c in m.coefficients),
        instrument=name,
        ranked_by=estimator_result.RANKED,
        responses=[last_second(s), *errors_and_innovations(s)],
    )


def last_second(s: Signals) -> Response:
    """The estimate over the last readings with the truth; a comparison draws those of all runs in one figure."""
    last = slice(-COMPARED, None)
    t, truth = s.time[last].tolist(), s.truth[last].tolist()
    return Response(
        "estimate", "step", "The last 1000 readings: estimate (points) and truth (line). What lies between them is the "
        "error that ranks; a shift along the time axis is the delay.", t, "time", "s", s.estimate[last].tolist(),
        "estimate", "1", curves=[{"label": "truth", "x": t, "y": truth, "phase": []}],
    )  # fmt: skip


def over_the_run(name: str, caption: str, time: Array, y: Array, sigma: Array | None) -> Response:
    """A figure of the whole time: y and, where it is stated, twice its standard deviation.

    Of each of SHOWN intervals the least and the largest y are drawn, and the mean of the standard deviation.
    """
    parts = np.array_split(np.arange(y.size), min(SHOWN, y.size))
    ends = np.unique([k for part in parts for k in (part[np.argmin(y[part])], part[np.argmax(y[part])])])
    curves = [{"label": name, "x": time[ends].tolist(), "y": y[ends].tolist(), "phase": []}]
    if sigma is not None:
        middle = [float(time[part].mean()) for part in parts]
        bound = np.array([float(np.sqrt(np.mean(sigma[part] ** 2))) for part in parts])
        caption += " Lines beside it: twice the standard deviation that the estimator states, 95 % if it is right."
        curves += [
            {"label": f"{sign}2σ stated", "x": middle, "y": (factor * bound).tolist(), "phase": []}
            for sign, factor in (("+", 2.0), ("−", -2.0))
        ]
    return Response(name, "time", caption, time[ends].tolist(), "time", "s", y[ends].tolist(), name, "1", curves=curves)


def errors_and_innovations(s: Signals) -> list[Response]:
    """Error of the estimate and innovations over the whole time that is evaluated."""
    skipped = "The readings left out at the start are not shown."
    sigma = np.sqrt(s.variance) if s.variance is not None and np.all(s.variance > 0.0) else None
    caption = f"Error: estimate less truth of the same instant, the whole time. {skipped}"
    figures = [over_the_run("error", caption, s.time, s.estimate - s.truth, sigma)]
    if s.innovation is not None and np.any(s.innovation != 0.0):
        made = s.innovation != 0.0  # a reading that is not used leaves none
        known = s.nis is not None and bool(np.all(s.nis[made] > 0.0))
        stated = np.abs(s.innovation[made]) / np.sqrt(s.nis[made]) if known and s.nis is not None else None
        caption = f"Innovation: reading less its prediction by the filter, the whole time. {skipped}"
        figures.append(over_the_run("innovation", caption, s.time[made], s.innovation[made], stated))
    return figures
