"""Window means of what a gyro on a turning table senses: regressors of the drift model, rates along its axes.

During a window a driven table turns evenly from angle_start to angle_end, one that its gyro holds along a curve through
the readings.  Averages are Gauss-Legendre sums over the time, exact to rounding for windows up to a radian; no harmonic
is damped by the averaging [AVG-SINC] because the regressors are averaged like the data.  Not modelled: change of the
rate of a driven table inside a window.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.legendre import leggauss

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.frames import G0, pole
from gyrobench.reduction.setup.run_metadata import Location

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

NODES, _WEIGHTS = leggauss(12)
_WEIGHTS = _WEIGHTS / 2.0
SMALL = 1e-5  # rad, step of the geometric perturbations (they are linear to 1e-10)


@dataclass(frozen=True)
class Turning:
    """Windows of a record with the mount of each: angles (n,) in rad, times (n,) in s, face (n, 3, 3)."""

    angle_start: Array
    angle_end: Array
    t_start: Array
    t_end: Array
    face: Array

    def nodes(self) -> Array:
        """Angles (n, 12) at which a window is averaged."""
        half = (self.angle_end - self.angle_start) / 2.0
        middle = (self.angle_end + self.angle_start) / 2.0
        return np.asarray(middle[:, None] + half[:, None] * NODES)


def reading_spline(times: Array, readings: Array) -> BSpline:
    """Return the curve through successive readings, of fifth order where there are enough of them."""
    from scipy.interpolate import make_interp_spline  # a fifth of a second, for tables that do not turn evenly

    n = times.size
    return make_interp_spline(times, readings, 5 if n > 5 else 3 if n > 3 else 1)


def held_nodes(angle_start: Array, angle_end: Array, t_start: Array, t_end: Array) -> Array:
    """Angles (n, 12) at the nodes in time of windows of a table that turns as its gyro lets it, not evenly.

    Windows that share their readings follow one curve through them, :func:`reading_spline`; one that stands alone is
    taken as an even turn.
    """
    length = t_end - t_start
    apart = np.abs(t_start[1:] - t_end[:-1]) > 1e-6 * length[1:]
    apart |= np.abs(angle_start[1:] - angle_end[:-1]) > 1e-3 * np.abs(angle_end[1:] - angle_start[1:])
    out: Array = ((angle_end + angle_start)[:, None] + (angle_end - angle_start)[:, None] * NODES) / 2.0
    for rows in np.split(np.arange(length.size), np.flatnonzero(apart) + 1):
        first, last = rows[0], rows[-1]
        if first == last:
            continue
        knots = np.concatenate([t_start[rows], t_end[last : last + 1]]) - t_start[first]
        curve = reading_spline(knots, np.concatenate([angle_start[rows], angle_end[last : last + 1]]))
        middle = (knots[1:] + knots[:-1]) / 2.0
        out[rows] = curve(middle[:, None] + length[rows, None] / 2.0 * NODES)
    return out


@dataclass(frozen=True)
class BelievedGeometry:
    """Errors of the data (n,), per rad, of windows whose geometry is not what the reduction believes.

    base: table axes at angle 0 in (E, N, U).  error: of the data where turning and base are these instead.
    """

    turning: Turning
    base: Array
    error: Callable[[Turning, Array], Array]

    def axis(self, k: int) -> Array:
        """Return the error of a table axis that is turned about the k-th axis of the table."""
        return -self.error(self.turning, self.base @ frames.rotation(self.base[k], SMALL).T) / SMALL

    def mount(self, k: int, sense: float = 1.0) -> Array:
        """Return the error of a gyro that is turned about its k-th axis, in a sense of 1 or -1."""
        turn = frames.rotation(sense * np.eye(3)[k], SMALL)
        return self.error(replace(self.turning, face=turn @ self.turning.face), self.base) / SMALL

    def angles(self, n: int) -> Array:
        """Return the errors (2, n) of an encoder that reads too much by sin n theta, and by cos n theta."""
        errors = []
        for wave in (np.sin, np.cos):
            start, end = (a + SMALL * wave(n * a) for a in (self.turning.angle_start, self.turning.angle_end))
            errors.append(self.error(replace(self.turning, angle_start=start, angle_end=end), self.base) / SMALL)
        return np.array(errors)


def average(values: Array) -> Array:
    """Return the mean over the nodes (axis 1)."""
    out: Array = (
        np.tensordot(values, _WEIGHTS, axes=([1], [0]))
        if values.ndim == 2
        else np.einsum("nk...,k->n...", values, _WEIGHTS)
    )
    return out


def _in_face(vector: Array, turning: Turning) -> Array:
    """Return a vector in table axes at angle 0, (3,) or (n, 12, 3) of each node, in face axes at every node."""
    x, y, z = np.moveaxis(vector, -1, 0)
    a = turning.nodes()
    c, s = np.cos(a), np.sin(a)
    table = np.stack([c * x + s * y, c * y - s * x, np.broadcast_to(z, a.shape)], axis=-1)
    return np.asarray(np.einsum("nij,nkj->nki", turning.face, table))


def regressors(turning: Turning, base: Array, gravity: float, names: tuple[str, ...]) -> Array:
    """Return the window means (n, p) of the drift regressors ``names`` at local gravity ``gravity`` (m/s2)."""
    xyz = _in_face(base @ np.array([0.0, 0.0, -gravity / G0]), turning)
    return average(drift.regressors(xyz, names))


def axis_rate(turning: Turning, base: Array, latitude: float, earth_rate: float, axis: int = 0) -> Array:
    """Return the window means (n,) of the inertial rate along a gyro axis (0 input, 1 output, 2 spin), rad/s: Earth and
    table.
    """
    earth = average(_in_face(base @ (earth_rate * pole(latitude)), turning)[:, :, axis])
    table = (turning.angle_end - turning.angle_start) / (turning.t_end - turning.t_start)
    return np.asarray(earth + turning.face[:, axis, 2] * table)


def wobbles(turning: Turning, base: Array, site: Location, names: tuple[str, ...]) -> list[tuple[Array, Array]]:
    """Return what a table axis that goes round a cone twice a turn does, per rad, at the phases 0 and 90 degrees.

    Rates (n, 3) along the gyro axes that are there beside those of a true axis, and means (n, p) of the regressors of a
    true axis less those that are there.  The cone: q = (cos a, sin a, 0) in table axes at angle 0, a = 2 theta and 2
    theta + 90 degrees, as of the part axis_wobble; the table then sees v - q x v of a vector v, and turns with q'
    besides.
    """
    theta = turning.nodes()
    turn = ((turning.angle_end - turning.angle_start) / (turning.t_end - turning.t_start))[:, None]
    up = base @ np.array([0.0, 0.0, -site.g])
    earth = base @ (site.earth_rate * pole(site.latitude))
    still = drift.regressors(_in_face(up, turning), names)
    found = []
    for a in (2.0 * theta, 2.0 * theta + np.pi / 2.0):
        q = np.stack([np.cos(a), np.sin(a), np.zeros_like(a)], axis=-1)
        going = 2.0 * turn[..., None] * np.stack([-np.sin(a), np.cos(a), np.zeros_like(a)], axis=-1)
        rate = average(_in_face(going - np.cross(q, earth), turning))
        dX = average(still - drift.regressors(_in_face(up - SMALL * np.cross(q, up), turning), names)) / SMALL
        found.append((rate, dX))
    return found
