"""Ratios of two signals of one loop, with regions that hold for small signals, too.

a'z / b'z of amplitudes z = (r, u, y) whose noise is complex, circular and correlated: the values g with

    |a'z - g b'z|2 <= q2 var(a'z - g b'z)

are those inside a circle (Fieller), of finite size where |b'z|2 > q2 var(b'z): the denominator must stand above its
noise.  q2 is t2 / 2 with the quantile t of Student's distribution, of as many degrees of freedom as the covariance has:
the circle's extent in any one direction, in gain or in phase, then is the 95 % interval.
Source: Fieller 1954; Pintelon 2012, 2.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from gyrobench.arrays import Array
from gyrobench.identification.line_spectrum import LineAmplitudes
from gyrobench.identification.loop_record import PLANT_INPUT, PLANT_OUTPUT, REFERENCE
from gyrobench.record.frequency_response import Complex

LEVEL = 0.975
#: the signal behind the summing point, of r, u, y: S = x / r
BEHIND = {PLANT_INPUT: (0.0, 1.0, 0.0), REFERENCE: (1.0, 0.0, -1.0), PLANT_OUTPUT: (1.0, 0.0, 1.0)}


@dataclass(frozen=True)
class MeasuredResponse:
    """A frequency response: values, their relative standard uncertainty u (of the gain, and of the phase in rad), and
    the circles that hold 95 % of gain and phase; radius inf: not determined.  dof: real degrees of freedom of u.
    """

    f: Array
    value: Complex
    u: Array
    dof: Array
    center: Complex
    radius: Array

    @property
    def determined(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Return where the gain is told from 0 and from infinity."""
        return np.asarray(np.isfinite(self.radius) & (self.radius < np.abs(self.center)))

    def gain(self) -> tuple[Array, Array]:
        """Return the limits of the gain."""
        return np.maximum(np.abs(self.center) - self.radius, 0.0), np.abs(self.center) + self.radius

    def phase(self) -> tuple[Array, Array]:
        """Return by how much the phase may lie below and above that of the value, rad; pi where it is unknown."""
        with np.errstate(invalid="ignore", divide="ignore"):
            half = np.arcsin(np.minimum(self.radius / np.abs(self.center), 1.0))
        half = np.where(self.determined, half, np.pi)
        moved = np.where(self.determined, np.angle(self.center / np.where(self.value, self.value, 1.0)), 0.0)
        return moved - half, moved + half


def ratio(lines: LineAmplitudes, a: tuple[float, ...], b: tuple[float, ...]) -> MeasuredResponse:
    """Return a'z / b'z with its region."""
    above, below = lines.z @ np.array(a), lines.z @ np.array(b)
    cov = np.einsum("i,nij,kj->nk", np.array(a), lines.cov, np.array([a, b]))
    v_aa, v_ab = np.maximum(cov[:, 0].real, 0.0), cov[:, 1]
    v_bb = np.maximum(np.einsum("i,nij,j->n", np.array(b), lines.cov, np.array(b)).real, 0.0)
    dof = 2.0 * lines.dof
    q2 = stdtrit(dof, LEVEL) ** 2 / 2.0
    with np.errstate(invalid="ignore", divide="ignore"):
        g = above / below
        variance = np.maximum(v_aa - 2.0 * (np.conj(g) * v_ab).real + np.abs(g) ** 2 * v_bb, 0.0)
        u = np.sqrt(variance / 2.0) / np.abs(above)
        left = np.abs(below) ** 2 - q2 * v_bb
        center = (above * np.conj(below) - q2 * v_ab) / left
        square = np.abs(center) ** 2 - (np.abs(above) ** 2 - q2 * v_aa) / left
        radius = np.where(left > 0.0, np.sqrt(np.maximum(square, 0.0)), np.inf)
    return MeasuredResponse(lines.f, g, u, dof, np.where(np.isfinite(center), center, 0.0), radius)


def loop_responses(lines: LineAmplitudes, at: str) -> dict[str, MeasuredResponse]:
    """Return L, S, T, P (the plant, y/u) and "D" = S - 1/2, whose largest size is 1 / disk margin."""
    x = np.array(BEHIND[at])
    r = np.array([1.0, 0.0, 0.0])
    pairs = {"L": (r - x, x), "S": (x, r), "T": (r - x, r), "P": (np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])),
             "D": (x - 0.5 * r, r)}  # fmt: skip
    return {name: ratio(lines, tuple(a), tuple(b)) for name, (a, b) in pairs.items()}
