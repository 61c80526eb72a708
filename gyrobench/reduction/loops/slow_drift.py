"""What the slow random drift of a simulated gyro adds to its drift over a record, and no record of its length can tell.

Mean over T of a Gauss-Markov process: rms sqrt(v(T/tau)), v of gyrobench.reduction.estimation.noise; flicker is twelve
of them; a random walk that began t_0 before has K sqrt(t_0 + T/3).  [DRIFT-RANDOM-CLASSES]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.component.blocks.random_drift import INNER, OUTER, RATIO, RELAXATIONS
from gyrobench.reduction.estimation.noise import mean_variance


def slow_drift(p: Mapping[str, Any], gyro: str, channel: str, t: Array) -> float:
    """Return the standard deviation, rad/s, of the mean of a gyro's slow drift over a record, from its constant drift.

    p: parameters of the run; those that a gyro does not have are 0.  channel: "_x" or "_y", "" of a gyro with one.
    t: times of the record, s after the start of the run.
    """
    start, time = float(t[0]), float(t[-1] - t[0])

    def size(name: str, default: float = 0.0) -> float:
        return float(p.get(f"{gyro}.{name}", default) or default)

    def mean(rms: float, tau: float) -> float:
        return rms**2 * float(mean_variance(np.array(time / tau))) if rms > 0.0 else 0.0

    longest = size("flicker_tau", 1e5)
    shares = [OUTER if j in (0, RELAXATIONS - 1) else INNER for j in range(RELAXATIONS)]
    flicker = [mean(s * size(f"flicker{channel}"), longest / RATIO**j) for j, s in enumerate(shares)]
    markov = mean(size(f"markov{channel}"), size("markov_tau", 300.0))
    walk = size(f"walk{channel}") ** 2 * (start + time / 3.0)
    return math.sqrt(size(f"turn_on{channel}") ** 2 + markov + sum(flicker) + walk)
