"""Benchmarks of estimators: what the source sends, and what a designer knows of it when he sets an estimator.

``source``, ``estimator``: parameters of the parts in these slots; an estimator without one of them stays as it is.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Matrix = Sequence[Sequence[float]]
SIGMA = 1.643e-3  # noise of a reading, from the drift table of Xia 2008 [DRIFT-ARIMA310]
SIGMA2_AR3 = 3.3697e-6  # innovation variance of its AR(3)
R_LEVEL = 2.70e-6
AR3 = [-0.7466, -0.5044, -0.2538, 0.0, 0.0]


@dataclass(frozen=True)
class Benchmark:
    """Ts: sampling period, s.  skip: readings left out at the start; least: that must be left (of a sine: ten periods).
    source, estimator: parameters.
    """

    title: str
    Ts: float
    samples: int
    skip: int
    least: int
    source: Mapping[str, Any]
    estimator: Mapping[str, Any]


def linear(A: Matrix, W: Matrix, R: float) -> dict[str, float]:
    """Return the model of estimator_lti and estimator_coloured: state (value ...), one reading with white noise."""
    n = len(A)
    elements = {"n": n, "m": 1, "V[1,1]": R, "psi[1,1]": 0.0}
    for i, j in itertools.product(range(max(n, 2)), repeat=2):  # two states are the default of these parts
        inside = i < n and j < n
        at = f"[{i + 1},{j + 1}]"
        elements |= {f"A{at}": A[i][j] if inside else 0.0, f"W{at}": W[i][j] if inside else 0.0}
        if i == j:
            elements[f"P0{at}"] = 1.0 if inside else 0.0
    return elements


def sloped(q: float) -> dict[str, float]:
    """Return value and slope, the slope driven by white noise of density q."""
    T = 1e-3
    W = [[q * T**3 / 3.0, q * T**2 / 2.0], [q * T**2 / 2.0, q * T]]
    return linear([[1.0, T], [0.0, 1.0]], W, SIGMA**2)


QUIET = {"amplitude": 0.0, "p": 0, "w": 0.0, "walk": 0.0, "white": 0.0}
SINE = {**QUIET, "amplitude": 0.01, "frequency": 1.0, "white": SIGMA}

BENCHMARKS = {
    "sine": Benchmark(
        "sine of 1 Hz and 0.01 under white noise of 1.643e-3, 1 kHz [BENCH-DYN-SINE]",
        1e-3, 60000, 3000, 10000, SINE,
        {"R": SIGMA**2, "R0": SIGMA**2, "sigma": SIGMA, **sloped(0.5)},
    ),
    "change": Benchmark(
        "the same, the noise three times as large from 30 s on [EST-SAGE-HUSA]",
        1e-3, 60000, 33000, 10000, {**SINE, "change_time": 30.0, "change_factor": 3.0},
        {"R": SIGMA**2, "R0": SIGMA**2, "sigma": SIGMA, "q": 2.0, **sloped(2.0)},
    ),
    "level": Benchmark(
        "random walk under white noise, q/r = 1e-3, r = 2.70e-6 [BENCH-DRIFT-LL]",
        5.0, 17158, 500, 2000, {**QUIET, "walk": math.sqrt(1e-3 * R_LEVEL), "white": math.sqrt(R_LEVEL)},
        {"R": R_LEVEL, "R0": R_LEVEL, "sigma": math.sqrt(R_LEVEL), "q": 0.0, "P0_slope": 0.0,
         "walk": 1e-3 * R_LEVEL / 5.0, **linear([[1.0]], [[1e-3 * R_LEVEL]], R_LEVEL)},
    ),
    "ar3": Benchmark(
        "AR(3) of Xia 2008 with its sign put right, readings of R = Q = 3.3697e-6 [BENCH-DRIFT-AR3]",
        5.0, 17158, 500, 2000,
        {**QUIET, "p": 3, "phi": AR3, "w": math.sqrt(SIGMA2_AR3), "white": math.sqrt(SIGMA2_AR3)},
        {"p": 3, "Q": SIGMA2_AR3, "R": SIGMA2_AR3, "R0": SIGMA2_AR3, "sigma": math.sqrt(SIGMA2_AR3),
         **linear([AR3[:3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
                  [[SIGMA2_AR3, 0.0, 0.0], [0.0] * 3, [0.0] * 3], SIGMA2_AR3)},
    ),
}  # fmt: skip
