"""Composite drift of a record in one attitude: systematic and random part, correlation.  [TEST-COMPOSITE]

    mean = sum d_i / n     sigma = sqrt( sum_{i=1..n} (d_i - mean)^2 / (n - 1) )            (E45: sum to n)
    C(q) = 1/(n - q) sum_{i=1..n-q} (d_i - mean)(d_{i+q} - mean),   correlation C(q)/C(0)   (E46: less the mean)

d_i are drift rates over windows of the same length dT, Earth rate removed; what repeats with the table angle must be
removed by the caller.  sigma depends on dT.  Lags to n/4.  [Hu 1981, eq. 3-91..3-93]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Table

LEAST = 10  # windows


@dataclass(frozen=True)
class Composite:
    """SI.  correlation[q] at the lag q dT, q = 0..n/4; time: first lag with a correlation below 1/e, None where there
    is none up to n/4.
    """

    n: int
    dT: float
    mean: float
    sigma: float
    correlation: Array
    time: float | None


def problems(d: Array, t_start: Array, t_end: Array, earth: float = 0.0) -> list[str]:
    """Return why there are no composite statistics, as sentences.  earth: Earth rate along the input axis, rad/s."""
    sentences = []
    if d.size < LEAST:
        sentences.append(f"{d.size} windows: at least {LEAST} are needed")
        return sentences
    if not np.all(np.isfinite(d)):
        return ["a drift rate is not a finite number"]
    length = t_end - t_start
    if np.ptp(length) > 0.01 * np.median(length) or np.any(np.abs(t_start[1:] - t_end[:-1]) > 0.01 * length[1:]):
        sentences.append("windows of different length or with gaps: σ and correlation need one ΔT")
    if np.ptp(d) <= 1e-12 * float(np.max(np.abs(d))):
        sentences.append(
            "the drift rate is constant and has no correlation: not measured data, or too coarse a resolution"
        )
    if abs(earth) > 1e-7 and abs(float(np.mean(d)) + earth) < 0.2 * abs(earth):
        sentences.append(
            f"the mean {plain(np.degrees(float(np.mean(d))) * 3600.0, 4)} °/h is the table rate against the Earth: add "
            f"the Earth rate along the input axis, {plain(np.degrees(earth) * 3600.0, 4)} °/h"
        )
    return sentences


def composite(d: Array, t_start: Array, t_end: Array, earth: float = 0.0) -> Composite:
    """Return the statistics of the drift rates ``d`` (n,), rad/s.  Raises ReductionError with :func:`problems`."""
    if reasons := problems(d, t_start, t_end, earth):
        raise ReductionError(reasons)
    n, dT = d.size, round(float(np.median(t_end - t_start)), 9)
    mean = float(np.mean(d))
    random = d - mean
    c = np.array([float(random[: n - q] @ random[q:]) / (n - q) for q in range(n // 4 + 1)])
    rho = c / c[0]
    below = np.flatnonzero(rho < math.exp(-1.0))
    sigma = math.sqrt(float(random @ random) / (n - 1))
    return Composite(n, dT, mean, sigma, rho, float(below[0]) * dT if below.size else None)


def tables(statistics: Mapping[str, Composite | str], scale: float, unit: str) -> list[Table]:
    """Return the tables of drift rates (a sentence for a series that has none) and of their correlations."""
    rows: list[list[Any]] = []
    for label, c in statistics.items():
        if isinstance(c, str):
            rows.append([label, "", "", "", "", c])
        else:
            time = c.time if c.time is not None else f"> {(c.correlation.size - 1) * c.dT:g}"
            rows.append([label, c.n, c.dT, c.mean / scale, c.sigma / scale, time])
    dTs = sorted({c.dT for c in statistics.values() if not isinstance(c, str)})
    caption = "Mean: systematic drift rate, can be compensated; σ: random drift rate in windows of " + (
        ", ".join(f"{t:g} s" for t in dTs) or "no length"
    )
    head = ["series", "windows", "ΔT / s", f"mean / ({unit})", f"σ / ({unit})", "correlation time (1/e) / s"]
    out = [Table("systematic_and_random_drift_rate", "Systematic and random drift rate", caption, head, rows)]
    complete = {n: c for n, c in statistics.items() if not isinstance(c, str)}
    if complete:
        lags = _shown(max(c.correlation.size for c in complete.values()))
        body = [
            [q, *(float(c.correlation[q]) if q < c.correlation.size else "" for c in complete.values())] for q in lags
        ]
        head = ["lag / ΔT", *complete]
        if len(complete) > 4:  # a page holds few columns: the series go down, the first lags across
            across = lags[:8]
            body = [
                [n, *(float(c.correlation[q]) if q < c.correlation.size else "" for q in across)]
                for n, c in complete.items()
            ]
            head = ["series, at lag / ΔT =", *(str(q) for q in across)]
        caption = "Autocovariance divided by its value at lag 0, for lags up to a quarter of the windows"
        out.append(
            Table(
                "autocorrelation_of_the_random_drift", "Autocorrelation of the random drift rate", caption, head, body
            )
        )
    return out


def _shown(n: int, most: int = 25) -> Sequence[int]:
    return sorted({*range(min(n, 11)), *np.unique(np.linspace(0, n - 1, most).round().astype(int)).tolist()})
