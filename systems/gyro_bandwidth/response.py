"""Figures of a frequency response from its points: gain at low frequency, -3 dB, 90 degrees, delay, equivalent order.

    H(s) = K exp(-s T) / [(1 + s/a) ... (1 + 2 z s/b + (s/b)2) ...]                      0 to 5 poles

by weighted least squares of ln H; the number of poles by the least Bayesian information criterion.  Of a gyro that
holds a sample for the time P it is times sinc(f P) exp(-s P/2), which is known and which no poles are.  The figures are
those of this curve: the first frequency with |H| = K/sqrt(2), the first with arg H = -90 degrees, the delay -d arg H /
d w at frequency zero, the order -2 d ln |H| / d ln f at -3 dB, which is n of a Butterworth low-pass of order n.

The uncertainty is that of the points, widened by sqrt(chi2 / degrees of freedom) where the curve does not fit them, and
what one pole more changes beyond what noise explains.  [TEST-BANDWIDTH; Schwarz 1978]
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from gyrobench.arrays import Array

Complex = NDArray[np.complexfloating[Any, Any]]
POLES = 5
ROOT = math.sqrt(0.5)
DENSE = 2000  # frequencies at which crossings are looked for
LIMIT = 60.0  # of the logarithm of a corner, rad/s
GOOD = 2.0  # chi2 over degrees of freedom below which no other start is tried
WIDE = 1e3  # of the highest frequency: slower and faster poles than this are none


@dataclass(frozen=True)
class GyroResponse:
    """Frequencies f (Hz, rising), natural logarithm of the gain, unwrapped phase (rad), u of both (n,); time for which
    the gyro holds a sample (s).
    """

    f: Array
    gain: Array
    phase: Array
    u: Array
    held: float = 0.0

    @classmethod
    def of(cls, f: Array, value: Complex, u: Array, held: float = 0.0) -> GyroResponse:
        """Return the response of complex points, of samples at their own times where they are held; the phase is
        continuous, that of the lowest within half a turn.
        """
        order = np.argsort(f)
        f, value, u = f[order], value[order], u[order]
        gain, phase = np.vstack([np.log(np.abs(value)), np.unwrap(np.angle(value))]) + hold(f, held)
        return cls(f, gain, phase, u, held)

    def moved(self, change: Complex) -> GyroResponse:
        """Return the response times exp(change), change complex (n,)."""
        return replace(self, gain=self.gain + change.real, phase=self.phase + change.imag)

    @property
    def value(self) -> Complex:
        out: Complex = np.exp(self.gain + 1j * self.phase)
        return out

    def at(self, factor: float) -> GyroResponse:
        """Return the response with all frequencies times a factor."""
        return replace(self, f=self.f * factor, held=self.held / factor)


def hold(f: Array, time: float) -> Array:
    """Return ln |H| and arg H, rows (2, n), of a signal that is held for a time, s, from sample to sample."""
    return np.vstack([np.log(np.abs(np.sinc(f * time))), -np.pi * f * time])


def logarithm(p: Array, f: Array, held: float = 0.0) -> Array:
    """Return ln |H| and arg H, rows (2, n), continuous in f.  p: ln K, T, then of each pair of poles ln b and ln z, and
    ln a of a single one.
    """
    s = 2j * np.pi * f
    gain, phase = np.full(f.size, p[0]), -2.0 * np.pi * f * p[1]
    rest = np.clip(p[2:], -LIMIT, LIMIT)
    for k in range(rest.size // 2):
        x = s / np.exp(rest[2 * k])
        factor = 1.0 + 2.0 * np.exp(rest[2 * k + 1]) * x + x * x
        gain, phase = gain - np.log(np.abs(factor)), phase - np.angle(factor)
    if rest.size % 2:
        factor = 1.0 + s / np.exp(rest[-1])
        gain, phase = gain - np.log(np.abs(factor)), phase - np.angle(factor)
    out: Array = np.vstack([gain, phase]) + hold(f, held)
    return out


Logarithm = Callable[[Array], Array]  # frequencies (n,), Hz -> ln |H| and arg H, rows (2, n), continuous


def read_off(of: Logarithm, highest: float) -> Array:
    """Return K, f3, f90, delay, order of a response; NaN for what it does not reach up to the highest frequency, Hz."""
    tiny = 1e-6 * highest
    at_zero = of(np.array([tiny]))[:, 0]
    grid = np.geomspace(1e-3 * highest, highest, DENSE)
    gain, phase = of(grid)
    f3 = _crossing(of, 0, grid, gain, at_zero[0] + math.log(ROOT))
    f90 = _crossing(of, 1, grid, phase, -0.5 * math.pi)
    order = math.nan
    if math.isfinite(f3):
        near = of(f3 * np.array([1.0 - 1e-4, 1.0 + 1e-4]))[0]
        order = -2.0 * float(near[1] - near[0]) / 2e-4
    return np.array([math.exp(at_zero[0]), f3, f90, -at_zero[1] / (2.0 * math.pi * tiny), order])


def _crossing(of: Logarithm, row: int, grid: Array, y: Array, level: float) -> float:
    below = np.flatnonzero((y[1:] < level) & (y[:-1] >= level))
    if not below.size:
        return math.nan
    k = int(below[0])
    off = lambda f: float(of(np.array([f]))[row, 0]) - level  # noqa: E731
    return float(optimize.brentq(off, grid[k], grid[k + 1], xtol=1e-12, rtol=1e-12))


@dataclass(frozen=True)
class PoleCurve:
    """A fitted response with n poles: parameters p and their covariance, chi2, degrees of freedom, criterion."""

    poles: int
    p: Array
    cov: Array
    chi2: float
    dof: int
    criterion: float
    highest: float  # Hz
    held: float = 0.0  # s

    def at(self, f: Array) -> Array:
        """Return ln |H| and arg H, rows (2, n)."""
        return logarithm(self.p, f, self.held)

    def values(self, p: Array) -> Array:
        """Return K, f3, f90, delay, order of parameters p."""
        return read_off(lambda f: logarithm(p, f, self.held), self.highest)

    def variances(self) -> Array:
        """Return the variances of the values by those of the points, to first order."""
        size = np.maximum(np.abs(self.p), 1.0)
        size[1] = 1.0 / self.highest
        columns = []
        for k in range(self.p.size):
            step = np.zeros(self.p.size)
            step[k] = 1e-5 * size[k]
            columns.append((self.values(self.p + step) - self.values(self.p - step)) / (2.0 * step[k]))
        J = np.column_stack(columns)
        out: Array = np.einsum("ij,jk,ik->i", J, self.cov, J) * max(1.0, self.chi2 / max(self.dof, 1))
        return out


def fitted(r: GyroResponse, poles: int) -> PoleCurve | None:
    """Return the response with so many poles; None where there are too few points for it, or it does not converge."""
    free = poles + 2
    dof = 2 * r.f.size - free
    if dof < 3:
        return None
    f, measured, u = r.f, np.vstack([r.gain, r.phase]), r.u
    low = float(np.mean(r.gain[:3]))
    fallen = np.flatnonzero(r.gain < low + math.log(ROOT))
    corner = math.log(2.0 * math.pi * float(f[fallen[0]] if fallen.size else f[-1]))
    top = float(f[-1])

    def off(x: Array) -> Array:
        p = np.array([x[0], x[1] / top, *x[2:]])
        return ((logarithm(p, f, r.held) - measured) / u).ravel()

    best = None
    for spread in (0.3, -0.3, 1.0):
        start = [low, 0.0]
        for k in range(poles // 2):
            start += [corner + spread * (k + 0.3), math.log(0.7) - 0.5 * k]
        if poles % 2:
            start.append(corner + 2.0 * abs(spread))
        try:
            found = optimize.least_squares(off, start, method="lm", x_scale="jac", max_nfev=40 * (free + 1))
        except (ValueError, np.linalg.LinAlgError):
            continue
        if np.all(np.isfinite(found.x)) and (best is None or found.cost < best.cost):
            best = found
        if best is not None and 2.0 * best.cost < GOOD * dof:
            break
    if best is None or _absent(best.x[2:], top):
        return None
    scale = np.linalg.norm(best.jac, axis=0)
    if not np.all(scale > 0.0) or np.linalg.cond(best.jac / scale) > 1e7:
        return None
    cov = np.linalg.inv((best.jac / scale).T @ (best.jac / scale)) / np.outer(scale, scale)
    units = np.array([1.0, 1.0 / top, *np.ones(poles)])
    chi2 = 2.0 * float(best.cost)
    return PoleCurve(
        poles,
        best.x * units,
        cov * np.outer(units, units),
        chi2,
        dof,
        chi2 + free * math.log(2 * f.size),
        top,
        r.held,
    )


def _absent(rest: Array, top: float) -> bool:
    """Return whether a pole is so far above the frequencies measured that it is none."""
    far = math.log(2.0 * math.pi * top * WIDE)
    corners = [*rest[0 : 2 * (rest.size // 2) : 2], *([rest[-1]] if rest.size % 2 else [])]
    return any(c > far for c in corners)


@dataclass(frozen=True)
class Figures:
    """value, u by noise, u by the shape: (5,) of K, f3 (Hz), f90 (Hz), delay (s), order; the curve they are of."""

    value: Array
    noise: Array
    shape: Array
    curve: PoleCurve

    @property
    def u(self) -> Array:
        out: Array = np.hypot(self.noise, self.shape)
        return out


def curves(r: GyroResponse) -> list[PoleCurve]:
    """Return the curves of 0 to POLES poles that can be fitted, up to two beyond the least criterion."""
    found: list[PoleCurve] = []
    for poles in range(POLES + 1):
        best = min(found, key=lambda c: c.criterion).poles if found else poles
        curve = fitted(r, poles) if poles <= best + 2 else None
        found += [curve] if curve is not None else []
    return found


def figures(r: GyroResponse, choose: Callable[[list[PoleCurve]], PoleCurve] | None = None) -> Figures | None:
    """Return the figures of a response; None where no curve can be fitted.  choose: not the least criterion."""
    every = curves(r)
    if not every:
        return None
    best = choose(every) if choose else min(every, key=lambda c: c.criterion)
    value, variance = best.values(best.p), best.variances()
    more = next((c for c in every if c.poles == best.poles + 1), None)
    shape = np.zeros(value.size)
    if more is not None:
        other, wider = more.values(more.p), more.variances()
        beyond = (other - value) ** 2 - np.maximum(wider - variance, 0.0)
        shape = np.sqrt(np.maximum(np.nan_to_num(beyond), 0.0))
    return Figures(value, np.sqrt(variance), shape, best)
