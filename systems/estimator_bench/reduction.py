"""Reduction of the estimator bench: the measures of gyrobench.reduction.loops.estimator_result over the record, and
its picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.reduction.loops.estimator_result import RANKED, Signals, measure
from gyrobench.reduction.loops.loop_curves import line, trace
from gyrobench.reduction.loops.loop_toolkit import Account, Array, MeasureReduction, ReductionError, Response, told

from .benchmarks import BENCHMARKS

SHOWN, COMPARED = 1000, 1000  # intervals of the whole time, and readings of the close-up


class Reduction(MeasureReduction):
    """Estimate against the known truth: error, delay, noise reduction with gain and phase, consistency."""

    part = "estimator"
    ranked_by = RANKED

    def measure(self) -> Account:
        options, p = self.run.options, self.run.parameters
        known = BENCHMARKS.get(str(options.get("benchmark")))
        if known is None:
            raise ReductionError(f"the record does not say which benchmark it is of: one of {', '.join(BENCHMARKS)}")
        skip = int(options["skip"]) if options.get("skip", -1) >= 0 else known.skip
        s = signals(self.record.channels, skip, known.Ts)
        sine = float(p.get("source.amplitude", 0.0)) != 0.0
        random = any(float(p.get(f"source.{n}", 0.0)) != 0.0 for n in ("p", "walk", "markov"))
        frequency = float(p["source.frequency"]) if sine and not random else None
        measure(self.found, s, frequency, true_variance(p, s.time))
        self.found.responses += [last_second(s), *errors_and_innovations(s)]
        return Account(
            method="Estimate against the known truth: error, delay, noise reduction with gain and phase, consistency",
            sources=[
                "BENCH-DYN-SINE, BENCH-DRIFT-LL, BENCH-DRIFT-AR3; Xia 2008, sections 3.4.5, 4.4.2",
                "EST-KF-AR, EST-SAGE-HUSA, EST-WAVELET-ONLINE; Xia 2008, sections 4.2, 4.3, corrected by EX14, "
                "EX19-EX23",
            ],
            equation='z = x + v, quad e = hat(x) - x, quad "NEES" = e^2\\/P, quad "NIS" = y^2\\/S',
            conventions=[
                f"Truth and readings: {known.title}.",
                "Error: estimate less the truth of the same instant. Late error: less the truth one latency ago, where "
                "the estimator states a latency.",
                "dB: 20 log10 of the ratio of rms values; below 0 is better than the reading itself.",
                "Noise reduction is what is left beside the truth as it comes through; it means nothing without the "
                "gain.",
            ],
        )

    def summary(self) -> list[str]:
        found = self.found
        re_raw, noise = (found[n].estimate for n in ("error re raw", "noise re raw"))
        phase = ", phase {phase}" if "phase" in found.estimates else ""
        tests = " ".join(f"{t.name}: {t.finding}." for t in found.tests)
        return [
            *told(
                found.coefficients,
                f"{self.name or 'The estimator'}: rms error {{error}} against the truth of the same instant, "
                f"{re_raw:+.1f} dB against the readings themselves.",
                f"Noise {noise:+.1f} dB, and what that costs: gain {{gain}}{phase}, delay {{delay}}.",
            ),
            tests or "The estimator states no variance: it cannot be asked whether it is consistent.",
        ]


def signals(channels: Mapping[str, Array], skip: int, Ts: float) -> Signals:
    """Return the channels without the row at t = 0 and the first ``skip`` readings.  Raises ReductionError."""
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
    """Return the variance of a reading as the source had it; None where it changes in the record or is not known."""
    if "source.white" not in p:
        return None
    after = float(p.get("source.change_time", math.inf))
    factor = float(p.get("source.change_factor", 1.0))
    if factor != 1.0 and time[0] < after < time[-1]:
        return None
    return (float(p["source.white"]) * (factor if time[0] >= after else 1.0)) ** 2


def last_second(s: Signals) -> Response:
    """Return the estimate over the last readings with the truth; a comparison draws those of all runs in one figure."""
    last = slice(-COMPARED, None)
    caption = (
        "The last 1000 readings: estimate (points) and truth (line). What lies between them is the error that ranks; a "
        "shift along the time axis is the delay."
    )
    lines = {"truth": s.truth[last]}
    return trace("estimate", caption, s.time[last], s.estimate[last], "estimate", "1", lines, COMPARED)


def over_the_run(name: str, caption: str, time: Array, y: Array, sigma: Array | None) -> Response:
    """Return a figure of the whole time: y and, where it is stated, twice its standard deviation.

    Of each of SHOWN intervals the least and the largest y are drawn, and the mean of the standard deviation.
    """
    parts = np.array_split(np.arange(y.size), min(SHOWN, y.size))
    ends = np.unique([k for part in parts for k in (part[np.argmin(y[part])], part[np.argmax(y[part])])])
    curves = [line(name, time[ends], y[ends])]
    if sigma is not None:
        middle = np.array([float(time[part].mean()) for part in parts])
        bound = np.array([float(np.sqrt(np.mean(sigma[part] ** 2))) for part in parts])
        caption += " Lines beside it: twice the standard deviation that the estimator states, 95 % if it is right."
        curves += [line(f"{sign}2σ stated", middle, factor * bound) for sign, factor in (("+", 2.0), ("−", -2.0))]
    return Response(name, "time", caption, time[ends].tolist(), "time", "s", y[ends].tolist(), name, "1", curves=curves)


def errors_and_innovations(s: Signals) -> list[Response]:
    """Return the figures of error and innovations over the whole time that is evaluated."""
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
