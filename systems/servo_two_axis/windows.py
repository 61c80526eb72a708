"""What a gyro on a two-axis servo table sees, averaged over each window between two readings of both angles.

Between the readings the angles follow a spline of fifth order through all readings of a stretch of windows that follow
one another; rates come from it, so that the mean of x' cos y over a window is what was turned, and neighbouring windows
share a reading.  Averages are Gauss-Legendre sums over 8 nodes in time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.reduction.drift.window_regressors import reading_spline
from gyrobench.reduction.setup.run_metadata import Location

from . import geometry

NODES, WEIGHTS = leggauss(8)
WEIGHTS = WEIGHTS / 2.0
#: value at the middle of a polynomial through the nodes
MIDDLE = np.array([np.prod([-b / (a - b) for b in NODES if b != a]) for a in NODES])
ANGLES = ("outer_start", "outer_end", "inner_start", "inner_end")


@dataclass(frozen=True, eq=False)
class Track:
    """Angles and rates of both axes at the nodes (n, nodes, 2), rad and rad/s, rows X, Y, Z of the mount of each window
    in ENU (n, 3, 3), times (n,) s.  body: gyro axes in those of the plate.  square: the inner axis turned about Z.
    wobble: amplitudes of the outer and the inner axis, twice a turn, and their phase.
    """

    angle: Array
    rate: Array
    base: Array
    t_start: Array
    t_end: Array
    body: Array | None = None
    square: float = 0.0
    wobble: tuple[float, float, float] = (0.0, 0.0, 0.0)
    _seen: dict[Location, tuple[Array, Array]] = field(default_factory=dict, init=False, repr=False)

    def turns(self) -> list[tuple[Array, Array]]:
        """Return, from the mount to the gyro, passive rotations (..., 3, 3) in turn and the rate (..., 3) each adds."""
        x, y = self.angle[..., 0], self.angle[..., 1]
        zero, e = np.zeros_like(x), np.eye(3)
        outer, inner = (self.rate[..., k, None] * e[k] for k in (0, 1))
        steps = [(geometry.attitude(x, zero), outer), (geometry.attitude(zero, y), inner)]
        if self.square:
            steps.insert(1, (frames.passive_z(self.square), np.zeros(3)))
        if any(self.wobble):
            steps.insert(0, self._wobble(0))
            steps.insert(-1, self._wobble(1))
        return steps if self.body is None else [*steps, (self.body, np.zeros(3))]

    def _wobble(self, axis: int) -> tuple[Array, Array]:
        """Return the wobble of the outer (0) or inner (1) axis, to first order: as the part axis_wobble, order 2."""
        size, phase = self.wobble[axis], self.wobble[2]
        a = 2.0 * self.angle[..., axis] + phase
        turned = np.zeros((*a.shape, 3))
        turned[..., (axis + 1) % 3], turned[..., (axis + 2) % 3] = size * np.cos(a), size * np.sin(a)
        rate = np.zeros_like(turned)
        rate[..., (axis + 1) % 3], rate[..., (axis + 2) % 3] = -size * np.sin(a), size * np.cos(a)
        cross = np.cross(turned[..., None, :], np.eye(3))  # rows: turned x e_k, so that [turned x] is its transpose
        return np.eye(3) - np.swapaxes(cross, -1, -2), 2.0 * self.rate[..., axis, None] * rate

    def inertial(self, site: Location) -> Array:
        """Return the means of the inertial rate along the gyro axes (n, 3), rad/s: what the drift is equal to."""
        return self._along(site)[0]

    def _along(self, site: Location) -> tuple[Array, Array]:
        """Return the means of the inertial rate (n, 3) and -f/g0 at the nodes (n, nodes, 3), which both channels ask
        for.
        """
        if site not in self._seen:
            w = (self.base @ frames.earth_rate_local(site.latitude, site.earth_rate))[:, None, :]
            g = (self.base @ np.array([0.0, 0.0, -site.g]))[:, None, :]
            for R, rate in self.turns():
                w = (R @ w[..., None])[..., 0] + rate
                g = (R @ g[..., None])[..., 0]
            self._seen[site] = average(w), g
        return self._seen[site]

    def middle(self) -> tuple[Array, Array, Array, Array]:
        """Return outer and inner angle and their rates at the middle of each window, (n,) each."""
        at = np.concatenate([self.angle, self.rate], axis=2)
        x, y, x_rate, y_rate = np.einsum("nkj,k->jn", at, MIDDLE)
        return x, y, x_rate, y_rate

    def force(self, site: Location) -> Array:
        """Return -f/g0 along the gyro axes at the nodes (n, nodes, 3)."""
        return self._along(site)[1]

    def design(self, site: Location, names: tuple[str, ...]) -> Array:
        """Return the means (n, p) of the regressors ``names`` of a channel."""
        return average(drift.regressors(self.force(site), names))


def average(values: Array) -> Array:
    """Return the mean over the nodes (axis 1)."""
    return np.asarray(np.einsum("nk...,k->n...", values, WEIGHTS))


def stretches(t_start: Array, t_end: Array, phase: NDArray[np.int_]) -> list[NDArray[np.int_]]:
    """Return the indices of windows that follow one another without a gap in the same phase."""
    gap = (np.abs(t_start[1:] - t_end[:-1]) > 1e-6 * (t_end[1:] - t_start[1:])) | (phase[1:] != phase[:-1])
    return np.split(np.arange(phase.size), np.flatnonzero(gap) + 1)


def track(windows: Mapping[str, Array], phase: NDArray[np.int_], base: Array) -> Track:
    """Return the track from the columns ANGLES, t_start, t_end of the rows of held phases (n,)."""
    t0, t1 = windows["t_start"], windows["t_end"]
    n = phase.size
    angle, rate = np.empty((n, NODES.size, 2)), np.empty((n, NODES.size, 2))
    for rows in stretches(t0, t1, phase):
        knots = np.concatenate([t0[rows], t1[rows[-1:]]])
        at = (t0[rows] + t1[rows])[:, None] / 2.0 + (t1[rows] - t0[rows])[:, None] / 2.0 * NODES
        for j, name in enumerate(("outer", "inner")):
            read = np.concatenate([windows[f"{name}_start"][rows], windows[f"{name}_end"][rows[-1:]]])
            spline = reading_spline(knots - knots[0], read)
            angle[rows, :, j], rate[rows, :, j] = spline(at - knots[0]), spline(at - knots[0], 1)
    return Track(angle, rate, base, t0, t1)
