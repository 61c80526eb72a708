"""Response of a floated gyro, its loop open, to the angle of its case, and the curve that fits it.

    theta_f/theta_I = g / D(s)                   theta_f/theta_O = -g (a2 tau_0 s3 + tau s) / D(s)
    D(s) = a2 tau_0 s3 + a2 s2 + tau s + 1       a2 = H2/(K_I K_O),  tau_0 = J/C,  tau = tau_0 + H2/(K_I C)

g = H/C about the input axis, 1 about the output axis.  Stiff bearings: D = 1 + tau s, tau = tau_0.  By weighted least
squares of the complex logarithm; of the two forms that of the least Bayesian information criterion.
[TEST-GYRO-DYNAMICS, DYN-IA, DYN-OA, DYN-TAU; Hu 1981, eq. 2-57..2-67; Schwarz 1978]
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
LIMIT = 40.0  # of a logarithm
ROOT = math.sqrt(0.5)
TINY = 1e-12  # least gain
CORNERS = (0.3, 0.5, 0.8, 1.3, 2.2, 4.0)  # f_0 over the highest frequency, first guesses
RATIOS = (0.9, 0.5)  # tau_0 over tau, first guesses
SURE = 0.1  # relative u of tau_0, tau - tau_0 and f_0 beyond which what elasticity gives is not normally distributed


@dataclass(frozen=True)
class AngleResponse:
    """Frequencies (n,), Hz, rising; float over case, complex (n,); relative u (n,); whether about the output axis."""

    f: Array
    value: Complex
    u: Array
    output: bool

    def moved(self, change: Complex | complex) -> AngleResponse:
        """Return the response times exp(change)."""
        return replace(self, value=self.value * np.exp(change))

    def at(self, factor: float) -> AngleResponse:
        """Return the response with all frequencies times a factor."""
        return replace(self, f=self.f * factor)


def response(p: Array, f: Array, output: bool) -> Complex:
    """Return float over case at f (Hz); p: ln g, ln tau (s), and of elastic bearings a2 (s2), a3 = a2 tau_0 (s3)."""
    s = 2j * np.pi * f
    g, tau = np.exp(np.clip(p[:2], -LIMIT, LIMIT))
    a2, a3 = p[2:] if p.size == 4 else (0.0, 0.0)
    D = 1.0 + s * (tau + s * (a2 + s * a3))
    found: Complex = -g * s * (tau + s * s * a3) / D if output else g / D
    return found


@dataclass(frozen=True)
class AngleFit:
    """A fitted curve: p and its covariance, chi2, degrees of freedom, criterion."""

    p: Array
    cov: Array
    chi2: float
    dof: int
    criterion: float

    @property
    def elastic(self) -> bool:
        return self.p.size == 4

    def widened(self) -> Array:
        """Return the covariance, of points that the curve does not fit with their scatter about it."""
        return np.asarray(self.cov * max(1.0, self.chi2 / self.dof))


def fitted(r: AngleResponse, elastic: bool, near: AngleFit | None = None) -> AngleFit | None:
    """Return the curve of stiff or elastic bearings; None where it does not converge or is not determined.

    near: a curve of that form close by, the only first guess then.
    """
    free = 4 if elastic else 2
    dof = 2 * r.f.size - free
    if dof < 3:
        return None
    top = 2.0 * math.pi * float(r.f[-1])
    units = np.array([1.0, 1.0, top**-2, top**-3])[:free]

    def residual(p: Array) -> Array:
        value = response(units * p, r.f, r.output)
        ratio = (
            np.log(np.where(np.abs(value) > TINY, value, TINY) / r.value) / r.u
        )  # about the output axis it has a zero
        return np.asarray(np.concatenate([ratio.real, ratio.imag]))

    starts = [near.p / units] if near else _starts(r, free, top)

    def least(p: Array, most: int) -> Any:
        return optimize.least_squares(residual, p, x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=most)

    if len(starts) > 1:  # a few steps tell which minimum is the lowest
        starts = [min((least(p, 25) for p in starts), key=lambda fit: float(fit.cost)).x]
    best = least(starts[0], 200)
    scale = np.linalg.norm(best.jac, axis=0)
    if not np.all(scale > 0.0) or np.linalg.cond(best.jac / scale) > 1e7:
        return None
    units = units / scale
    cov = np.linalg.inv((best.jac / scale).T @ (best.jac / scale)) * np.outer(units, units)
    chi2 = 2.0 * float(best.cost)
    return AngleFit(best.x * scale * units, cov, chi2, dof, chi2 + free * math.log(2 * r.f.size))


def _starts(r: AngleResponse, free: int, top: float) -> list[Array]:
    """Return first guesses: tau where the phase of 1/(1 + tau s) is -45 degrees, or nearest to it; of elastic bearings
    f_0 below and above the highest frequency (top, rad/s), whose resonance and, about the output axis, zero make minima
    of their own.
    """
    late = np.abs(np.angle(r.value * (1j if r.output else 1.0)))  # -tau s/(1 + tau s) begins at -90 degrees
    k = int(np.argmin(np.abs(late - 0.25 * math.pi)))
    tau = math.tan(min(max(float(late[k]), 1e-3), 1.5)) / (2.0 * math.pi * float(r.f[k]))
    w = 2.0 * math.pi * r.f
    size = np.abs(r.value) / (w * tau if r.output else 1.0) * np.sqrt(1.0 + (w * tau) ** 2)
    low = [math.log(float(np.median(size[: max(3, size.size // 3)]))), math.log(tau)]
    if free == 2:
        return [np.array(low)]
    elastic = [[x**-2, part * tau * top * x**-2] for x in CORNERS for part in RATIOS]
    return [np.array([*low, *rest]) for rest in ([0.0, 0.0], *elastic)]


# ------------------------------------------------------------------------------------------------ figures
def read_off(p: Array, highest: float, H: float, output: bool) -> Array:
    """Return g, tau, tau_0 (s), f_0, f_3dB (Hz), K_I, K_O (N.m/rad); NaN where the curve or H leaves none."""
    out = np.full(7, math.nan)
    g, tau = out[:2] = np.exp(np.clip(p[:2], -LIMIT, LIMIT))
    if p.size == 4 and p[2] > 0.0:
        a2, tau_0 = float(p[2]), float(p[3] / p[2])
        out[2], out[3] = tau_0, 1.0 / (2.0 * math.pi * math.sqrt(a2))
        if H > 0.0 and not output and tau_0 < tau:
            out[5] = H * g / (tau - tau_0)
            out[6] = H * H / (a2 * out[5])
    if not output:
        out[4] = crossing(lambda f: np.abs(response(p, f, False)) / g, highest)
    return out


def crossing(gain: Callable[[Array], Array], highest: float) -> float:
    """Return the first frequency (Hz) up to the highest at which a gain falls to sqrt(1/2); NaN for none."""
    grid = np.geomspace(1e-3 * highest, highest, 600)
    below = np.flatnonzero(gain(grid) < ROOT)
    if not below.size or below[0] == 0:
        return math.nan
    k = int(below[0])
    off = lambda f: float(gain(np.array([f]))[0]) - ROOT  # noqa: E731
    return float(optimize.brentq(off, grid[k - 1], grid[k], xtol=1e-12, rtol=1e-12))


@dataclass(frozen=True)
class DynamicFigures:
    """Figures (7,) as read_off gives them, their u, the curve that they are of."""

    value: Array
    u: Array
    fit: AngleFit

    @property
    def determined(self) -> bool:
        """Whether what only the elasticity gives (tau_0, f_0, stiffnesses) has a value; False of NaN."""
        _, tau, tau_0, f_0, *_ = self.value
        return bool(self.u[2] < SURE * min(tau_0, tau - tau_0) and self.u[3] < SURE * f_0)


def figures(r: AngleResponse, H: float) -> DynamicFigures | None:
    """Return the figures of a response; None where no curve fits."""
    stiff, elastic = (fitted(r, form) for form in (False, True))
    known = [fit for fit in (stiff, elastic) if fit is not None]
    if not known:
        return None
    fit, highest = min(known, key=lambda k: k.criterion), float(r.f[-1])
    value = read_off(fit.p, highest, H, r.output)
    variance = _variances(fit, highest, H, r.output)
    if fit is stiff and elastic is not None:  # an elasticity that noise hides shifts what a stiff curve gives
        other = read_off(elastic.p, highest, H, r.output)
        wider = _variances(elastic, highest, H, r.output)
        beyond = (other - value) ** 2 - np.maximum(wider - variance, 0.0)
        variance = variance + np.maximum(np.nan_to_num(beyond), 0.0)
    return DynamicFigures(value, np.sqrt(variance), fit)


def values_near(r: AngleResponse, H: float, fit: AngleFit) -> Array:
    """Return the figures (7,) of a response close to one with this fit, by the same form; its own where it fails."""
    again = fitted(r, fit.elastic, fit) or fit
    return read_off(again.p, float(r.f[-1]), H, r.output)


def _variances(fit: AngleFit, highest: float, H: float, output: bool) -> Array:
    columns = []
    size = np.sqrt(np.diag(fit.cov))
    for k in range(fit.p.size):
        step = np.zeros(fit.p.size)
        step[k] = 1e-2 * size[k]
        up, down = (read_off(fit.p + sign * step, highest, H, output) for sign in (1.0, -1.0))
        columns.append((up - down) / (2.0 * step[k]))
    J = np.column_stack(columns)
    return np.asarray(np.einsum("ij,jk,ik->i", J, fit.widened(), J))
