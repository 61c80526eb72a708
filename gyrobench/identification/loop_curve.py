"""The sensitivity between and through the measured frequencies, with its uncertainty.

About each frequency f0, over a window of its neighbours, d = f - f0:

    S = b0 + b1 d + b2 d2 + b3 d3                         or
    S = (b0 + b1 d + b2 d2) / (1 + a1 d + a2 d2)          a resonance of the closed loop is a pole of it

by weighted least squares (Levy, Sanathanan, then Gauss-Newton).  L = 1/S - 1 and T = 1 - S are of the same form, so one
curve serves all margins.  The widest window that passes the test of its residuals against the stated noise is found,
the cubic before the fraction; one NARROWER times as far down the list is used, whose bias then is well below its
uncertainty.  Residuals above the stated noise widen the uncertainty (Birge's ratio).  Where no window passes (hardly
any noise, or points too far apart) the least uncertain one is taken, and where its uncertainty is large the loop is not
resolved there.  Source: Pintelon 2012, 7.2 and 9.8 (local models, Sanathanan's iteration); McKelvey 2012 (local
rational models).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import digamma, fdtrc

from gyrobench.arrays import Array
from gyrobench.identification.ratios import MeasuredResponse
from gyrobench.record.frequency_response import Complex

WINDOWS = (41, 29, 21, 15, 11, 8)  # points
NARROWER = 3  # windows than the widest that passes
PASSES = 0.1  # p of the residuals
NEARLY = 0.01  # p of a narrower window than the widest that passes
CERTAIN = 0.03  # of |S|: a resonance that is known to that stands, however much less certain than its neighbours
UNSOUND, NEIGHBOURS = 3.0, 4  # times the median u of so many measured frequencies to either side
MISFIT = 1e-6  # p, below which the best window is no noise
RESOLVED = 0.02  # of |S|, the largest misfit: 0.17 dB, 1.1 degrees
SHARP = 0.1  # of the mean distance of the points: half the width of a resonance that none of them shows
DRAWS = 60
BETWEEN = 8  # frequencies of the curve for each measured one
#: weights of nine points for the value of their parabola in the middle (Savitzky 1964)
PARABOLA = np.array([-21.0, 14.0, 39.0, 54.0, 59.0, 54.0, 39.0, 14.0, -21.0]) / 231.0
ROUNDING = 1e-15
SMALLEST = 1e-9  # of the largest |S|: rounding


@dataclass(frozen=True)
class LoopCurve:
    """S on dense frequencies, Hz, with the standard uncertainty u of each of its parts, and dS/df.

    noise: what S may be off by, in DRAWS draws of the noise of the points, (draws, f): for what is not of first order.

    resolved: False where the points do not tell the curve.
    """

    f: Array
    S: Complex
    u: Array
    slope: Complex
    noise: Complex
    resolved: NDArray[np.bool_]

    @property
    def L(self) -> Complex:
        return np.asarray((1.0 - self.S) / self.S)

    @property
    def u_L(self) -> Array:
        """Return the relative standard uncertainty of L."""
        return np.asarray(self.u / np.maximum(np.abs(self.S * (1.0 - self.S)), 1e-300))

    @property
    def sound(self) -> NDArray[np.bool_]:
        """Return where u is not far above that at the frequencies about it: a pole that the noise has put there."""
        u = self.u.reshape(-1, BETWEEN)
        about = np.pad(np.median(u, axis=1), NEIGHBOURS, mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(about, 2 * NEIGHBOURS + 1)
        usual = (u < UNSOUND * np.median(windows, axis=1)[:, None]).ravel()
        return np.asarray(usual | (self.u < CERTAIN * np.abs(self.S)))

    @property
    def slope_L(self) -> Complex:
        """Return d ln L / df."""
        return np.asarray(-self.slope / (self.S * (1.0 - self.S)))


@dataclass(frozen=True)
class _Models:
    """A model for each measured frequency: coefficients (n, 6) and covariance by a scale, Hz; p of its rest."""

    theta: Complex
    cov: Complex
    scale: Array
    p: Array
    square: Array  # of the residuals over their noise
    draws: Complex  # what theta may be off by, (n, 6, draws)


def loop_curve(s: MeasuredResponse) -> LoopCurve:
    """Return the curve through measured values of S; empty with fewer than the narrowest window."""
    sizes = [n for n in WINDOWS if n <= s.f.size]
    if not sizes:
        none, empty = np.zeros(0), np.zeros(0, complex)
        return LoopCurve(none, empty, none, empty, np.zeros((DRAWS, 0), complex), none > 0.0)
    variance = noise_level(s)
    rng = np.random.default_rng(DRAWS)
    draw = (rng.standard_normal((s.f.size, DRAWS)) + 1j * rng.standard_normal((s.f.size, DRAWS))) * np.sqrt(0.5)
    every: list[_Models] = []  # of each window the cubic and the fraction
    for size in sizes:
        idx = _window(s.f.size, size)
        d = s.f[idx] - s.f[:, None]
        every += [_fits(d, s.value[idx], variance[idx], s.dof[idx], draw[idx], rational) for rational in (False, True)]
    p, rows = np.stack([m.p for m in every]), np.arange(s.f.size)
    widened = np.stack([m.cov[:, 0, 0].real * np.maximum(m.square, 1.0) for m in every])
    use, forced = _chosen(p, widened)
    theta, cov, scale, draws = (
        np.stack([getattr(m, n) for m in every])[use, rows] for n in ("theta", "cov", "scale", "draws")
    )
    wider = np.maximum(np.stack([m.square for m in every])[use, rows], 1.0)
    cov, draws = cov * wider[:, None, None], draws * np.sqrt(wider)[:, None, None]
    u = np.sqrt(np.maximum(cov[:, 0, 0].real, 0.0) / 2.0)
    resolved = ~(forced & (p[use, rows] < MISFIT) & (u > RESOLVED * np.abs(theta[:, 0])))
    return _dense(s.f, theta, cov, scale, draws, resolved)


def _chosen(p: Array, widened: Array) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Return which model is used at each frequency, and where none passes.

    p, widened: (models, n), cubic and fraction in turn; of the residuals, and the variance widened by them.
    """
    passes = p > PASSES
    forced = ~np.any(passes, axis=0)
    window, rational = np.divmod(np.argmax(passes, axis=0), 2)
    use = np.argmin(np.where(np.isfinite(widened), widened, np.inf), axis=0)
    left = ~forced
    for narrower in range(NARROWER, -1, -1):
        model = 2 * np.minimum(window + narrower, p.shape[0] // 2 - 1) + rational
        take = left & (p[model, np.arange(use.size)] > NEARLY)
        use = np.where(take, model, use)
        left &= ~take
    return use, forced


def _window(count: int, size: int) -> NDArray[np.intp]:
    """Return the points of each window: about its own, at the ends beside it."""
    first = np.clip(np.arange(count) - size // 2, 0, count - size)
    return np.asarray(first[:, None] + np.arange(size))


def noise_level(s: MeasuredResponse, kernel: Array = PARABOLA) -> Array:
    """Return the variance of a response: its logarithm on parabolas, less the mean of that of chi-squared.

    kernel: weights of a point and of those beside it.
    """
    half = s.dof / 2.0
    own = 2.0 * (s.u * np.abs(s.value)) ** 2
    least = (SMALLEST * np.abs(s.value).max()) ** 2
    log = np.log(np.maximum(own, least)) - (digamma(half) - np.log(half))
    reach = kernel.size // 2
    if log.size <= reach:
        return np.full(log.size, float(np.exp(log.mean())))
    return np.asarray(np.exp(np.convolve(np.pad(log, reach, mode="reflect"), kernel, "valid")))


def _fits(d: Array, value: Complex, variance: Array, dof: Array, draw: Complex, rational: bool) -> _Models:
    """Return the models of windows: d (n, m), Hz, from the frequency of each."""
    scale = np.abs(d).max(axis=1)
    d = d / scale[:, None]
    w = 1.0 / np.sqrt(variance)
    powers = d[:, :, None] ** np.arange(4 if not rational else 3)
    theta = np.zeros((d.shape[0], 6), complex)  # b0 b1 b2 b3 a1 a2
    use = np.array([0, 1, 2, 4, 5] if rational else [0, 1, 2, 3])
    if not rational:
        jac: Complex = powers.astype(np.complex128)
        theta[:, use] = _solve(jac * w[:, :, None], value * w)
    else:
        under = np.ones_like(value)
        for _ in range(3):
            x = np.concatenate([powers, -value[:, :, None] * powers[:, :, 1:]], axis=2)
            weight = w / np.abs(under)
            theta[:, use] = _solve(x * weight[:, :, None], value * weight)
            under = _under(theta, d)
        for _ in range(3):
            s = _over(theta, d) / under
            jac = _jacobian(s, under, powers)
            theta[:, use] += _solve(jac * w[:, :, None], (value - s) * w)
            under = _under(theta, d)
        jac = _jacobian(_over(theta, d) / under, under, powers)
    rest = np.abs((value - _over(theta, d) / _under(theta, d)) * w) ** 2
    free = d.shape[1] - use.size
    square = np.where(np.isfinite(rest.sum(axis=1)), rest.sum(axis=1), 1e300) / free
    p = fdtrc(2.0 * free, dof.sum(axis=1), square)
    if rational:
        sharp = _sharp(theta, d)
        p, square = np.where(sharp, 0.0, p), np.where(sharp, np.inf, square)
    jac = jac * w[:, :, None]
    cov, draws = np.zeros((d.shape[0], 6, 6), complex), np.zeros((d.shape[0], 6, DRAWS), complex)
    adjoint = np.conj(np.swapaxes(jac, 1, 2))
    inverse = _inverse(adjoint @ jac)
    cov[:, use[:, None], use] = inverse
    draws[:, use] = inverse @ (adjoint @ draw)
    return _Models(theta, cov, scale, p, square, draws)


def _sharp(theta: Complex, d: Array) -> NDArray[np.bool_]:
    """Return which fractions have a pole among their frequencies d (n, m) that is sharper than they can tell."""
    linear, square = theta[:, 4], theta[:, 5]
    root = np.sqrt(linear**2 - 4.0 * square)
    found = np.zeros(linear.size, bool)
    with np.errstate(divide="ignore", invalid="ignore"):
        for below in (linear + root, linear - root):  # of 1 + a1 d + a2 d2: -2/(a1 +- root)
            pole = -2.0 / below
            inside = (pole.real > d[:, 0]) & (pole.real < d[:, -1])
            found |= inside & (np.abs(pole.imag) < SHARP * np.ptp(d, axis=1) / (d.shape[1] - 1))
    return found


def _solve(x: Complex | Array, y: Complex) -> Complex:
    """Return the least-squares solutions (n, k) of x (n, m, k), y (n, m)."""
    adjoint = np.conj(np.swapaxes(x, 1, 2))
    return np.asarray((_inverse(adjoint @ x) @ (adjoint @ y[:, :, None]))[:, :, 0])


def _inverse(square: Complex | Array) -> Complex:
    """Return the inverses of Hermitian matrices (n, k, k), of singular ones something large."""
    size = np.trace(square, axis1=1, axis2=2).real[:, None, None]
    return np.asarray(np.linalg.inv(square + (ROUNDING * size + 1e-300) * np.eye(square.shape[1])))


def _over(theta: Complex, d: Array) -> Complex:
    return np.asarray(np.einsum("nk,nmk->nm", theta[:, :4], d[:, :, None] ** np.arange(4)))


def _under(theta: Complex, d: Array) -> Complex:
    return np.asarray(1.0 + d * (theta[:, 4, None] + d * theta[:, 5, None]))


def _jacobian(s: Complex, under: Complex, powers: Array) -> Complex:
    return np.concatenate([powers, -s[:, :, None] * powers[:, :, 1:]], axis=2) / under[:, :, None]


def _evaluated(theta: Complex, cov: Complex, d: Array) -> tuple[Complex, Array]:
    """Return the derivatives of S by the coefficients at d (n, m), (n, m, 6), and the variance of S there."""
    under = _under(theta, d)
    s, powers = _over(theta, d) / under, d[:, :, None] ** np.arange(4)
    jac = np.concatenate([powers, -s[:, :, None] * powers[:, :, 1:3]], axis=2) / under[:, :, None]
    return jac, np.einsum("nmi,nij,nmj->nm", jac, cov, np.conj(jac)).real


def _dense(
    f: Array, theta: Complex, cov: Complex, scale: Array, draws: Complex, resolved: NDArray[np.bool_]
) -> LoopCurve:
    """Return the curve: each model from half way to the point before it to half way to the next."""
    edges = np.concatenate([f[:1], np.sqrt(f[1:] * f[:-1]), f[-1:]])
    share = (np.arange(BETWEEN) + 0.5) / BETWEEN
    at = edges[:-1, None] + share * np.diff(edges)[:, None]
    d = (at - f[:, None]) / scale[:, None]
    under = _under(theta, d)
    s = _over(theta, d) / under
    jac, variance = _evaluated(theta, cov, d)
    u = np.sqrt(np.maximum(variance, 0.0) / 2.0)
    noise = np.moveaxis(jac @ draws, 2, 0).reshape(DRAWS, -1)
    b, a = theta[:, None, :4], theta[:, None, 4:]
    rise = b[..., 1] + d * (2.0 * b[..., 2] + 3.0 * d * b[..., 3]) - s * (a[..., 0] + 2.0 * d * a[..., 1])
    slope = rise / under / scale[:, None]
    return LoopCurve(at.ravel(), s.ravel(), u.ravel(), slope.ravel(), noise, np.repeat(resolved, BETWEEN))
