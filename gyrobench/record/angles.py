"""Angles of a drift record: steps of a cumulative one, and the question whether it is the angle of each sample."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.drift_columns import OF_EACH, Signal
from gyrobench.units import DPH

JUMP = 100.0  # spreads of the increments of an angle
ROUNDING = 8.0 * float(np.finfo(float).eps)  # of an angle: its differences differ by so much where they are the same
TURNS = (2.0 * math.pi,)
WRAPS = tuple(2.0**k for k in (8, 12, 14, 16, 18, 20, 24, 32))  # of counts
SLOW = 1.0 * DPH  # of any gyro that neither Earth nor bias turns
SCATTER = 50.0  # variance of the angle over that of its steps: 0.5 of white noise, n/6 of a random walk of n steps


@dataclass
class CumulativeAngle:
    """Differences of a cumulative angle over blocks, and whether it grows as a sum of rates does.

    first: time, s, and angle, rad, of the first sample; sums: of 1, t, x, t t, t x, x x from there on.
    """

    signal: Signal
    last: float = math.nan
    usual: float = 0.0
    spread: float = 0.0
    resets: int = 0
    wraps: int = 0
    first: tuple[float, float] | None = None
    sums: Array = field(default_factory=lambda: np.zeros(6))

    def increments(self, value: Array, follows: NDArray[np.bool_]) -> Array:
        """Return the increments up to each sample, NaN where the sample before is missing or a reset lies between."""
        d = np.diff(np.concatenate([[self.last], value]))
        d[~follows] = np.nan
        self.last = float(value[-1])
        there = d[np.isfinite(d)]
        if not self.spread and there.size > 8:
            self.usual = float(np.median(there))
            off = np.abs(there - self.usual)
            self.spread = 1.4826 * float(np.median(off))
            rounding = ROUNDING * float(np.max(np.abs(value)))
            if self.spread <= rounding:  # most increments are the same number of counts
                self.spread = float(np.min(off[off > rounding])) if np.any(off > rounding) else 0.0
        if not self.spread:
            return d
        jumped = np.flatnonzero(np.abs(d - self.usual) > JUMP * self.spread)
        counts = self.signal.unit in ("", "1")
        periods = tuple(w * abs(self.signal.factor) for w in WRAPS) if counts else TURNS
        for k in jumped.tolist():
            right = [d[k] - s * p for p in periods for s in (1.0, -1.0)]
            best = min(right, key=lambda v: abs(v - self.usual))
            if abs(best - self.usual) <= JUMP * self.spread:
                d[k], self.wraps = best, self.wraps + 1
            else:
                d[k], self.resets = np.nan, self.resets + 1
        return d

    def follow(self, t: Array, value: Array) -> None:
        """Take times, s, and angles in the unit of the file, for question."""
        x = value * self.signal.factor
        self.first = self.first or (float(t[0]), float(x[0]))
        t, x = t - self.first[0], x - self.first[1]
        self.sums += [t.size, t.sum(), x.sum(), t @ t, t @ x, x @ x]

    def question(self) -> str:
        """Return the question whether this is the angle of each sample; "" where it grows as a cumulative one does."""
        n, st, sx, stt, stx, sxx = self.sums
        t2, tx, x2 = stt / n - (st / n) ** 2, stx / n - st * sx / n**2, sxx / n - (sx / n) ** 2
        if OF_EACH.fullmatch(self.signal.name):
            why = "called as the angle of each sample"
        elif t2 and x2 <= SCATTER * self.spread**2 and abs(tx) < SLOW * t2:
            why = f"an angle that grows by {tx / t2 / DPH:.2g} deg/h (the Earth turns at 15): that of each sample?"
        else:
            return ""
        return f"column '{self.signal.name}': {why}; state '# counts = increments', or '# counts = cumulative'"
