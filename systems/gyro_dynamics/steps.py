"""Time constant from steps of the table: the area between the angle of the table and that of the float.

    integral of (g theta(t) - b(t) + drift of the float) dt = g A tau

over a turn by A with rests before and after it, exactly, whatever the law of the turn and the order of the dynamics:
tau is the coefficient of s in D(s), DYN-TAU.  g and the drift (a line) are those of the two rests, by least squares.
[TEST-GYRO-DYNAMICS; Hu 1981, eq. 2-60]
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array

LEAST = 3  # turns
STILL = 0.02  # of the fastest rate: below it the table rests
TAIL = 0.5  # of a rest after a turn: left to the float


@dataclass(frozen=True)
class TableTurn:
    """A turn of the table with its rests: t (s), theta, b (rad), begin and end of the turn (s)."""

    t: Array
    theta: Array
    b: Array
    begin: float
    end: float

    @property
    def tail(self) -> float:
        """Return the time left to the float before it is taken to be at rest, s."""
        return TAIL * (float(self.t[-1]) - self.end)

    def gain_and_lag(self) -> tuple[float, float] | None:
        """Return g and tau (s); None for a turn without samples in its rests."""
        t, theta, b = self.t, self.theta, self.b
        before, after = t < self.begin, t > self.end + self.tail
        rest = before | after
        if before.sum() < 4 or after.sum() < 4:
            return None
        middle = 0.5 * (self.begin + self.end)
        A = np.column_stack([theta, np.ones(t.size), t - middle])
        g, c0, c1 = np.linalg.lstsq(A[rest], b[rest], rcond=None)[0]
        size = float(theta[after].mean() - theta[before].mean())
        inside = slice(int(np.flatnonzero(before)[-1]), int(np.flatnonzero(after)[0]) + 1)
        left = A[inside] @ np.array([g, c0, c1]) - b[inside]
        return float(g), float(np.trapezoid(left, t[inside]) / (g * size))


@dataclass(frozen=True)
class StepFigures:
    """Mean gain and time constant (s) of n turns with their standard uncertainties; the time constants themselves."""

    gain: float
    u_gain: float
    tau: float
    u_tau: float
    each: Array
    shortest_tail: float

    @property
    def dof(self) -> int:
        return int(self.each.size) - 1

    @property
    def too_short(self) -> bool:
        """Whether the rests leave more than 1e-4 of the float's way: the area is cut off."""
        return self.shortest_tail < 10.0 * abs(self.tau)


def figures_of(turns: list[TableTurn]) -> StepFigures | None:
    """Return the figures of turns; None of fewer than three."""
    pairs = [p for p in (turn.gain_and_lag() for turn in turns) if p is not None]
    if len(pairs) < LEAST:
        return None
    gain, tau = np.array(pairs).T
    root = math.sqrt(len(pairs))
    return StepFigures(
        float(gain.mean()), float(gain.std(ddof=1)) / root, float(tau.mean()), float(tau.std(ddof=1)) / root, tau,
        min(turn.tail for turn in turns),
    )  # fmt: skip


def turns_of(t: Array, theta: Array, b: Array) -> list[TableTurn]:
    """Return the turns of a record over time, each with the second half of the rest before and the rest after it."""
    rate = np.abs(np.gradient(theta, t))
    moving = np.concatenate([[False], rate > STILL * float(rate.max()), [False]])
    edges = np.flatnonzero(np.diff(moving.astype(int)))
    spans = [(int(a) - 1, int(z)) for a, z in zip(edges[::2], edges[1::2], strict=True)]
    found = []
    for k, (a, z) in enumerate(spans):
        first = (spans[k - 1][1] if k else 0) + 1
        last = (spans[k + 1][0] if k + 1 < len(spans) else t.size) - 1
        start = first + (a - first) // 2 if k else first
        if a - start < 4 or last - z < 8:
            continue
        inside = slice(start, last)
        found.append(TableTurn(t[inside], theta[inside], b[inside], float(t[a]), float(t[min(z, t.size - 1)])))
    return found
