"""A pulse rebalance and a float in closed form: v' = (r - v)/tau, theta' = v, r = (H/C) (w - k i).

H/C = 4/3, tau = 1 ms and full scale 1 deg/s are those of Hu 1981, section 5.5.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from wired import Native

RebalancePwm = partial(Native, "rebalance_pwm")
RebalancePulse = partial(Native, "rebalance_pulse")
DEG = math.pi / 180.0
ARCSEC = DEG / 3600.0
RATIO, TAU, K_SG = 4.0 / 3.0, 1e-3, 10.0
W = DEG  # full scale, rad/s
I = RebalancePwm().I  # noqa: E741
SCALE = W / I  # k, rad/s/A


def loop_gain(hertz: float) -> dict[str, float]:
    """Proportional only, crossover K_v = RATIO k K_p K_sg."""
    return {"K_p": 2.0 * math.pi * hertz / (RATIO * SCALE * K_SG), "K_i": 0.0}


class Loop:
    """The part and the float; the part has the pickoff angle of now, the float the current of the coming step."""

    def __init__(self, rate: float, step: float = 1e-3, kind: Any = RebalancePwm, **parameters: Any) -> None:
        self.part = kind(**{**loop_gain(20.0), **parameters})
        self.part.initialize()
        self.rate, self.step, self.k = rate, step, 0
        self.theta = self.v = 0.0
        self.decay = math.exp(-step / TAU)

    def run(self, time: float, see: Callable[[Any], float] | None = None) -> np.ndarray:
        seen = []
        for _ in range(round(time / self.step)):
            r = RATIO * (self.rate - SCALE * self.part.i)
            self.theta += r * self.step + (self.v - r) * TAU * (1.0 - self.decay)
            self.v = r + (self.v - r) * self.decay
            self.part.u = K_SG * self.theta
            self.part.do_step(self.k * self.step, self.step)
            self.k += 1
            if see:
                seen.append(see(self))
        return np.array(seen)

    def measured(self, time: float) -> float:
        """Mean rate by the counts."""
        before = self.part.n_plus - self.part.n_minus
        self.run(time)
        return W / self.part.f_q * (self.part.n_plus - self.part.n_minus - before) / time
