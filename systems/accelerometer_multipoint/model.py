"""The polynomial of an accelerometer over the positions of a head: setup, data of each visit, linearized design.

    lambda i/g0 = k0 + k1 X + k2 X2 + k3 X3 + k4 X Y + k5 X Z,       (X, Y, Z) at theta + theta_0, see geometry.py

It is linear in k and nearly so in the theta_0, which Gauss-Newton finds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.frames import G0
from gyrobench.reduction.setup import setups

from . import closed
from .geometry import CROSS, specific_force


@dataclass(frozen=True, kw_only=True)
class MultipointSetup(setups.Setup):
    """scale: lambda, m/s2/A.  mounts: phase -> "a" or "b".  truth: k0 ... k5; zeros: mount -> true theta_0.  quantum:
    resolution of the current reading.  nuisances: positions of the head that come back are weighed.  places_stated:
    their errors are stated, declared absent, or simulated.
    """

    gravity: float
    scale: float
    mounts: Mapping[int, str]
    zeros: Mapping[str, float] | None = None
    quantum: float = 0.0
    nuisances: bool = True
    places_stated: bool = True

    @property
    def gamma(self) -> float:
        return self.gravity / G0


@dataclass(frozen=True)
class Visits:
    """One datum for each visit of a position: mount, angle (rad), times (s), y = lambda i/g0."""

    mount: NDArray[np.str_]
    angle: Array
    t_start: Array
    t_end: Array
    y: Array
    within: float  # standard deviation of the readings of a visit about their mean (y); nan with single readings

    @property
    def mounts(self) -> list[str]:
        return sorted(set(self.mount.tolist()))


def visits(windows: Mapping[str, Array], s: MultipointSetup) -> Visits:
    """Return neighbouring windows of the same phase and angle, averaged by their length."""
    phase = np.asarray(windows["phase"]).astype(int)
    angle, t0, t1, mean = (np.asarray(windows[c], dtype=float) for c in ("angle_start", "t_start", "t_end", "mean"))
    new = np.concatenate([[True], (np.diff(phase) != 0) | (np.abs(np.diff(angle)) > closed.EQUAL)])
    group = np.cumsum(new) - 1
    length = t1 - t0
    total = np.bincount(group, length)
    y = s.scale / G0 * mean
    means = y[new] + np.bincount(group, (y - y[new][group]) * length) / total
    spare = y.size - total.size
    within = math.sqrt(float(np.sum((y - means[group]) ** 2)) / spare) if spare else math.nan
    last = np.concatenate([new[1:], [True]])
    mount = np.array([s.mounts[p] for p in phase[new].tolist()])
    return Visits(mount, angle[new], t0[new], t1[last], means, within)


class Polynomial:
    """Columns of the linearized model at zeros (mount -> theta_0); four: three terms, which stand for combinations."""

    def __init__(self, mounts: Sequence[str], four: bool) -> None:
        self.mounts, self.four = list(mounts), four
        self.terms = (
            ["k0", "k1", "k2"] if four else ["k0", "k1", "k2", "k3", *(CROSS[m] for m in reversed(self.mounts))]
        )
        self.names = [*self.terms, *(f"θ₀ {m}" for m in self.mounts)]

    def columns(self, v: Visits, zeros: Mapping[str, float], gamma: float) -> Array:
        """Return (n, terms): what each k multiplies."""
        X, cross = np.empty_like(v.y), {k: np.zeros_like(v.y) for k in ("k4", "k5")}
        for m in self.mounts:
            mine = v.mount == m
            x, y, z = specific_force(m, v.angle[mine] + zeros[m], gamma)
            X[mine] = x
            cross[CROSS[m]][mine] = x * (z if m == "a" else y)
        every = {"k0": np.ones_like(X), "k1": X, "k2": X**2, "k3": X**3, **cross}
        return np.column_stack([every[k] for k in self.terms])

    def slopes(self, v: Visits, zeros: Mapping[str, float], gamma: float, k: Array) -> Array:
        """Return (n, mounts): change of the data per rad of each theta_0."""
        step = 1e-4
        out = np.zeros((v.y.size, len(self.mounts)))
        high, low = ({m: z + d for m, z in zeros.items()} for d in (step, -step))
        slope = (self.columns(v, high, gamma) - self.columns(v, low, gamma)) @ k / (2.0 * math.sin(step))
        for j, m in enumerate(self.mounts):
            out[:, j] = np.where(v.mount == m, slope, 0.0)
        return out

    def solve(self, v: Visits, gamma: float) -> tuple[dict[str, float], Array]:
        """Return theta_0 of the mounts and k by ordinary least squares; the start is theta_0 from the first
        harmonic.
        """
        zeros = {}
        for m in self.mounts:
            mine = v.mount == m
            ones = np.column_stack([np.ones(mine.sum()), np.cos(v.angle[mine]), np.sin(v.angle[mine])])
            _, a, b = np.linalg.lstsq(ones, v.y[mine], rcond=None)[0]
            zeros[m] = math.atan2(-a, -b)
        k: Array = np.asarray(np.linalg.lstsq(self.columns(v, zeros, gamma), v.y, rcond=None)[0], dtype=float)
        for _ in range(20):
            C = self.columns(v, zeros, gamma)
            D = self.slopes(v, zeros, gamma, k)
            delta = np.linalg.lstsq(np.column_stack([C, D]), v.y, rcond=None)[0]
            k = np.asarray(delta[: C.shape[1]], dtype=float)
            zeros = {m: zeros[m] + float(d) for m, d in zip(self.mounts, delta[C.shape[1] :], strict=True)}
            if np.max(np.abs(delta[C.shape[1] :])) < 1e-14:
                break
        return zeros, k
