"""Windows of a phase: two pieces in which the table turns one way, and what noise makes of their double differences.

[MOTOR-TEST; own design]
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.loops.loop_measures import Gate

ANGLE, VOLTAGE, CURRENT = "reader.angle_read", "voltmeter.reading", "ammeter.reading"
PIECE = 0.05  # s, length T
SLOW = 0.05  # rad/s: a window with a slower end may have been at rest, where friction is what the load is


@dataclass(frozen=True)
class Window:
    """Two pieces of a phase, from -T to T: samples in the middle of time, SI.

    phase: number of the phase; place: that of the window's middle in it, in pieces, neighbours overlap by T.  motor,
    hung: demanded and known torque.  angle, rate: at each sample, the rate linear in time.  weight: (T - |t|) times the
    sampling interval.
    """

    phase: int
    place: int
    y: float
    angle: Array
    rate: Array
    turned: float  # <w>, from the angles
    voltage: Array
    current: Array
    weight: Array
    motor: float
    hung: float

    @property
    def sense(self) -> float:
        return float(np.sign(self.rate[0]))

    def integral(self, f: Array | float) -> float:
        return float(np.sum(self.weight * f))


def cut(gate: Gate) -> list[Window]:
    """Return the windows of a phase in which the table turns one way, faster than SLOW."""
    dt = float(gate.t[1] - gate.t[0])
    n = round(PIECE / dt)
    x = gate[ANGLE]
    found = []
    offset = np.arange(-n, n + 1)
    weight = (n - np.abs(offset)) * dt * dt
    for place, middle in enumerate(range(n, x.size - n, n)):
        part = slice(middle - n, middle + n + 1)
        before, after = x[middle] - x[middle - n], x[middle + n] - x[middle]
        ends = (1.5 * before - 0.5 * after) / PIECE, (1.5 * after - 0.5 * before) / PIECE
        if ends[0] * ends[1] <= 0.0 or min(map(abs, ends)) < SLOW:
            continue
        halves = (np.trapezoid(x[s], dx=dt) for s in (slice(middle, middle + n + 1), slice(middle - n, middle + 1)))
        right, left = (float(v) for v in halves)
        torque = [gate.amplitude if gate.kind == "torque" and gate.axis == k else 0.0 for k in (1, 2)]
        found.append(
            Window(gate.row.phase, place, float(after - before), x[part], np.linspace(*ends, offset.size),
                   right - left, gate[VOLTAGE][part], gate[CURRENT][part], weight, *torque)
        )  # fmt: skip
    return found


def bands(windows: Sequence[Window]) -> Array:
    """Return the covariances of y as (2, 3, n), lower bands: random torque (density 1, J = 1) and errors of the angles
    (1 rad), y = e(T) - 2 e(0) + e(-T).  Windows of different phases have nothing in common.
    """
    torque, angle = PIECE**3 / 6.0 * np.array([4.0, 1.0, 0.0, 0.0]), np.array([6.0, -4.0, 1.0, 0.0])
    found = np.zeros((2, 3, len(windows)))
    for d in range(3):
        apart = np.array([min(b.place - a.place, 3) if a.phase == b.phase else 3 for a, b in _pairs(windows, d)], int)
        found[:, d, : apart.size] = torque[apart], angle[apart]
    return found


def meter_bands(windows: Sequence[Window], slope: Array) -> Array:
    """Return the covariance (3, n), lower bands, of <slope e> for errors e of the readings of a meter, of variance 1.

    slope: (n, samples of a window).  Neighbours share the readings of a piece.
    """
    of = slope * windows[0].weight
    m = of.shape[1] // 2
    found = np.zeros((3, len(windows)))
    found[0] = np.sum(of**2, axis=1)
    next_to = np.array([a.phase == b.phase and b.place == a.place + 1 for a, b in _pairs(windows, 1)], bool)
    found[1, :-1] = np.where(next_to, np.sum(of[:-1, m:] * of[1:, : m + 1], axis=1), 0.0)
    return found


def _pairs(windows: Sequence[Window], d: int) -> Iterator[tuple[Window, Window]]:
    return zip(windows[: len(windows) - d], windows[d:], strict=True)


def reading_noise(readings: Sequence[Array]) -> float:
    """Return the standard deviation of the readings of a meter: that of their second differences over sqrt(6)."""
    return math.sqrt(float(np.mean([np.mean(np.diff(r, 2) ** 2) for r in readings])) / 6.0)


def apart(windows: Sequence[Window]) -> list[Window]:
    """Return windows that do not overlap."""
    found: list[Window] = []
    skipped = False
    for w in windows:
        if found and not skipped and found[-1].phase == w.phase:
            skipped = True
            continue
        found.append(w)
        skipped = False
    return found
