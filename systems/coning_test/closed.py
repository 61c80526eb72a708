"""Drift of a user's attitude under coning in closed form: filter, internal sampling, output rate, scale, misalignment.

    c = w (1 - cos theta)       rate of the gyro on the axis of the cone, to which no turn belongs  [Goodman 1958]
    drift = (kappa cof(M) - M) c e            e: axis of the cone, M = 1 + scale and misalignments of the gyros

kappa is the share of the coning that instrument and user compute, 1 of an exact one.  The rotation phi of one update,
T_u long, follows from increments of a sine and a cosine; that of the next one is the same about axes that have gone on
by w T_u.  N of them are [exp(phi) exp(w T_u e)]^N exp(-N w T_u e): a drift of

    (angle of exp(phi) exp(w T_u e) - w T_u)/T_u          about e, exact for every half-angle

and kappa = 1 + drift/c.  For small half-angles and increments that are integrals it is sin(w T)/(w T), for pairs
of them with 2/3 of their product sin(2 w T)/(2 w T) + 8/3 sin2(w T/2) sin(w T)/(w T).
[TEST-CONING; Bortz 1971, Miller 1983, Savage 1998]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from gyrobench.arrays import Array
from gyrobench.linear.butterworth import butterworth_gain

AXES = "xyz"
FINE = 64  # samples in an interval whose sampling is unknown


@dataclass(frozen=True)
class Chain:
    """interval: time between two increments, s.  step: internal sampling, s; 0: unknown, taken as fine.  bandwidth: of
    the filter, Hz; 0: none.  coning: the increments are rotation vectors.  samples: increments an update, 1 or 2.
    """

    interval: float
    step: float = 0.0
    bandwidth: float = 0.0
    coning: bool = True
    samples: int = 1

    @classmethod
    def of(cls, o: Mapping[str, Any], step: float = 0.0) -> Self:
        """Return the chain that the options of a run state."""
        given = {n: o[n] for n in ("interval", "bandwidth", "coning", "samples")}
        return cls(step=step, **given)

    def kappa(self, f: float, theta: float) -> float:
        """Return the share of the coning at f (Hz, either sense) and half-angle theta (rad) that is computed."""
        w, T = 2.0 * math.pi * abs(f), self.interval
        n = max(1, round(T / self.step)) if self.step else FINE
        h, gain = T / n, abs(butterworth_gain(abs(f), self.bandwidth, self.step))
        psi = w * h * np.arange(-1, n * self.samples + 1)
        xy = gain * math.sin(theta) * np.diff(np.column_stack([np.cos(psi), np.sin(psi)]), axis=0)
        d = np.column_stack([xy, np.full(len(xy), -(1.0 - math.cos(theta)) * w * h)])  # the first: the step before
        phi = self._update([self._increment(d[k * n : (k + 1) * n + 1]) for k in range(self.samples)])
        turn = 0.5 * w * T * self.samples
        half = 0.5 * float(np.linalg.norm(phi))
        sine, cosine = _along(phi, half)
        angle = 2.0 * math.atan2(
            math.hypot(sine[0], sine[1], math.sin(turn) * cosine + math.cos(turn) * sine[2]),
            math.cos(turn) * cosine - math.sin(turn) * sine[2],
        )
        drift = (angle - 2.0 * turn) / (T * self.samples)
        return 1.0 + drift / cone_rate(abs(f), theta)

    def _increment(self, d: Array) -> Array:
        """Return the increment of the unit from those of its steps, d[0]: of the step before."""
        own = d[1:]
        out: Array = own.sum(axis=0)
        if self.coning:
            before = np.vstack([np.zeros(3), np.cumsum(own, axis=0)[:-1]])
            out = out + 0.5 * np.cross(before + d[:-1] / 6.0, own).sum(axis=0)
        return out

    def _update(self, increments: list[Array]) -> Array:
        if self.samples == 1:
            return increments[0]
        one, two = increments
        return np.asarray(one + two + (2.0 / 3.0) * np.cross(one, two))

    def drift(self, f: float, theta: float, axis: int, matrix: Array | None = None) -> Array:
        """Return the drift (3,) of the attitude along the axes of the case, rad/s; matrix: errors of the gyros."""
        M = np.eye(3) + (np.zeros((3, 3)) if matrix is None else matrix)
        cofactor = np.linalg.det(M) * np.linalg.inv(M).T
        return np.asarray(cone_rate(f, theta) * (self.kappa(f, theta) * cofactor - M)[:, axis])


def _along(phi: Array, half: float) -> tuple[Array, float]:
    """Return vector and scalar of the quaternion of a rotation vector of twice the angle half."""
    out: Array = 0.5 * phi * float(np.sinc(half / math.pi))
    return out, math.cos(half)


def cone_rate(f: float, theta: float) -> float:
    """Return w (1 - cos theta), rad/s, with the sense of f."""
    return 2.0 * math.pi * f * (1.0 - math.cos(theta))
