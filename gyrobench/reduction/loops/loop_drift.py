"""Drift of a signal at rest: its rate, its noise, and what both are uncertain by."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import noise_mixture_fit, residual_series
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import AllanDeviation


# ------------------------------------------------------------------------------------------- drift
@dataclass(frozen=True)
class Drift:
    """Drift of an angle: mean rate with its standard uncertainty, Allan deviation of the rate, random walk.

    walk: angle random walk and its standard uncertainty, rad/sqrt(s), at the end of the first stretch in which the
    Allan deviation falls with slope -1/2 (to 0.1): there the loop's own lag matters least.  None: no such stretch.
    """

    rate: float
    u: float
    allan: AllanDeviation | None
    walk: tuple[float, float] | None


def drift(t: Array, angle: Array, blocks: int = 30) -> Drift:
    """Return the drift of an angle (rad) in a hold phase.

    The rate is the mean of the rates of ``blocks`` equal parts (10 where there are few samples) under the noise model
    that they give: white, Gauss-Markov or both, with errors of the readings that neighbours share (noise_mixture_fit).
    u is the half width of its 95 % interval over 1.96: parts do not know their noise better than 30 numbers can, and
    drift slower than a part is allowed for.  Not in it: drift slower than half the phase.  Raises ReductionError for
    fewer than 4 samples a block.
    """
    blocks = blocks if t.size >= 4 * blocks else 10
    if t.size < 4 * blocks:
        raise ReductionError(f"a drift of {blocks} blocks needs {4 * blocks} samples, there are {t.size}")
    edges = np.linspace(0, t.size - 1, blocks + 1).astype(int)
    rates, start, end = np.diff(angle[edges]) / np.diff(t[edges]), t[edges[:-1]], t[edges[1:]]
    est = noise_mixture_fit.fit(np.ones((blocks, 1)), rates, ["drift"], start, end, readings=True)
    mean, u = float(est.beta[0]), float(est.half_width[0]) / NORMAL
    dt = float(t[1] - t[0])
    allan = residual_series.allan([(dt, np.diff(angle) / dt)])
    walk = None
    falls = [abs(s.slope + 0.5) < 0.1 for s in allan.slopes] if allan is not None else []
    if allan is not None and True in falls:
        first = falls.index(True)
        last = falls.index(False, first) if False in falls[first:] else len(falls)
        tau, dev, low, high = (x[last] for x in (allan.tau, allan.dev, allan.lo, allan.hi))
        walk = (dev * math.sqrt(tau), (high - low) / (2.0 * NORMAL) * math.sqrt(tau))
    return Drift(mean, u, allan, walk)
