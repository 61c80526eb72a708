"""Mean acceleration that a strapdown unit's user computes while it sculls: filters, sampling, output rate, lever arms.

    angle about one horizontal axis     theta sin psi,          vibration along the other     a sin(psi + phase)
    accelerometer along the vertical    -theta a cos(phase)/2 - theta^2 g/4,   though nothing rises
    rise of the velocity of the user    share of this that is not taken back                      [TEST-SCULLING]

Steady state: rates and specific forces of the unit's steps are Fourier series in psi, their harmonics pass the filters,
the increments of an update at phases all round the period are turned as the user turns them, and the mean counts.  By
16 phases it is exact to theta^14.  For small angles and without lever arms it is theta a/2 (kappa H - 1), kappa the
share of the coning of the same algorithm (Roscoe 2001), H the real part of the product of the gains.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.spatial.transform import Rotation

from gyrobench.arrays import Array
from gyrobench.linear.butterworth import butterworth_gain

FINE = 64  # samples in an interval whose sampling is unknown
PHASES = 16


@dataclass(frozen=True)
class ScullingMotion:
    """frequency: Hz.  angle: rad, vibration: m/s2, amplitudes.  phase: of the vibration against the angle, rad."""

    frequency: float
    angle: float
    vibration: float
    phase: float = 0.0


@dataclass(frozen=True)
class UnitErrors:
    """Errors of a unit in axes of the table: gyro, acc (3, 3), 1 + scale factors and misalignments; bias (3,) of the
    accelerometers, m/s2, which rocks with the case; levers (3, 3): rows: accelerometers from the axis of the angle, m;
    None: exact.
    """

    gyro: Array | None = None
    acc: Array | None = None
    bias: Array | None = None
    levers: Array | None = None


@dataclass(frozen=True)
class VelocityChain:
    """interval: time between two increments, s.  step: internal sampling, s; 0: unknown, taken as fine.  bandwidth,
    acc_bandwidth: of the filters, Hz; 0: none.  sculling: the increments have it.  samples: increments an update, 1 or
    2.  size: height of the accelerometer of the vibration above that of the vertical, m.  gravity: m/s2.
    """

    interval: float
    step: float = 0.0
    bandwidth: float = 0.0
    acc_bandwidth: float = 0.0
    sculling: bool = True
    samples: int = 1
    size: float = 0.0
    gravity: float = 9.80665

    @classmethod
    def of(cls, o: Mapping[str, Any], gravity: float, step: float = 0.0) -> Self:
        """Return the chain that the options of a run state."""
        names = ("interval", "bandwidth", "acc_bandwidth", "sculling", "samples", "size")
        return cls(step=step, gravity=gravity, **{n: o[n] for n in names})

    def rise(self, m: ScullingMotion, unit: UnitErrors | None = None) -> float:
        """Return the mean vertical acceleration that the user computes, less that at rest, m/s2."""
        unit = unit or UnitErrors(levers=self.size * np.outer([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]))
        gyro, acc = (np.eye(3) if x is None else x for x in (unit.gyro, unit.acc))
        T, w = self.interval, 2.0 * math.pi * m.frequency
        n = max(1, round(T / self.step)) if self.step else FINE
        h = T / n
        angles, forces = self._steps(m, w, h, np.zeros((3, 3)) if unit.levers is None else unit.levers)
        psi = 2.0 * math.pi * np.arange(PHASES) / PHASES
        steps = psi[:, None] + w * h * np.arange(-1, n * self.samples)  # begins; the first: the step before
        harmonics = m.frequency * np.arange(PHASES // 2 + 1)
        turns = _fourier(angles[:, None], [butterworth_gain(f, self.bandwidth, self.step) for f in harmonics])
        d = _series(turns, steps) * gyro[:, 0]
        read = _fourier(forces, [butterworth_gain(f, self.acc_bandwidth, self.step) for f in harmonics])
        bias = np.zeros(3) if unit.bias is None else unit.bias
        e = h * (_series(read, steps) @ acc.T + bias)
        parts = [self._increment(d[:, k * n : (k + 1) * n + 1], e[:, k * n : (k + 1) * n + 1])
                 for k in range(self.samples)]  # fmt: skip
        gained = _update(parts)
        before = np.zeros_like(turns)  # the sum of all steps before
        before[1:] = turns[1:] / (np.exp(1j * w * h * np.arange(1, len(turns))) - 1.0)[:, None]
        start = _series(before, psi)
        rotated = Rotation.from_rotvec(start * gyro[:, 0]).apply(gained)
        return float(rotated[:, 2].mean()) / (T * self.samples) - self.gravity * float(acc[2, 2]) - float(bias[2])

    def _steps(self, m: ScullingMotion, w: float, h: float, levers: Array) -> tuple[Array, Array]:
        """Return angle and mean force (., 3) of steps that begin at phases all round the period."""
        psi = 2.0 * math.pi * np.arange(PHASES) / PHASES
        angle = m.angle * (np.sin(psi + w * h) - np.sin(psi))
        begin, middle, end = (self._force(m, w, psi + x * w * h, levers) for x in (0.0, 0.5, 1.0))
        return angle, (begin + 4.0 * middle + end) / 6.0

    def _force(self, m: ScullingMotion, w: float, psi: Array, levers: Array) -> Array:
        theta, a = m.angle * np.sin(psi), m.vibration * np.sin(psi + m.phase)
        c, s, g = np.cos(theta), np.sin(theta), self.gravity
        out = np.column_stack([np.zeros_like(psi), c * a + s * g, c * g - s * a])
        turning, square = -w * w * theta, (w * m.angle * np.cos(psi)) ** 2
        _, y, z = levers.T
        out[:, 1] += -turning * z[1] - square * y[1]
        out[:, 2] += turning * y[2] - square * z[2]
        return out

    def _increment(self, d: Array, e: Array) -> tuple[Array, Array]:
        """Return angle and velocity increments (., 3) of steps (., n + 1, 3), the first of which is the one before."""
        own, gain = d[:, 1:], e[:, 1:]
        angle, velocity = own.sum(axis=1), gain.sum(axis=1)
        if self.sculling:
            before = [np.cumsum(x, axis=1) - x + y[:, :-1] / 6.0 for x, y in ((own, d), (gain, e))]
            velocity = velocity + 0.5 * (np.cross(before[0], gain) + np.cross(before[1], own)).sum(axis=1)
        return angle, velocity


def _update(parts: list[tuple[Array, Array]]) -> Array:
    """Return the velocity of an update in the axes of its begin (., 3)."""
    angle, v = parts[0]
    if len(parts) == 2:
        (a, v1), (b, v2) = parts
        angle, v = a + b, v1 + v2 + (2.0 / 3.0) * (np.cross(a, v2) + np.cross(v1, b))
    p2 = np.maximum((angle**2).sum(axis=1), 1e-8)[:, None]
    p = np.sqrt(p2)
    once = np.cross(angle, v)
    return np.asarray(v + (1.0 - np.cos(p)) / p2 * once + (1.0 - np.sin(p) / p) / p2 * np.cross(angle, once))


def _fourier(values: Array, gains: list[complex]) -> Array:
    """Return the Fourier coefficients (k, .) of values (PHASES, .), k = 0 ... PHASES/2, times gains."""
    return np.asarray(np.fft.rfft(values, axis=0) / PHASES * np.array(gains)[:, None])


def _series(c: Array, psi: Array) -> Array:
    """Return the real series of coefficients (k, m) at phases (...): (..., m)."""
    k = np.arange(len(c))
    weight = np.where((k == 0) | (k == PHASES // 2), 1.0, 2.0)
    turned = np.exp(1j * np.multiply.outer(psi, k)) * weight
    return np.asarray((turned @ c).real)


def reading(m: ScullingMotion, gravity: float) -> float:
    """Return the mean of the specific force along the vertical axis of the case, less gravity, m/s2."""
    psi = 2.0 * math.pi * np.arange(PHASES) / PHASES
    theta = m.angle * np.sin(psi)
    return float(np.mean(gravity * (np.cos(theta) - 1.0) - np.sin(theta) * m.vibration * np.sin(psi + m.phase)))
