"""Correlation time of a drift: Gauss-Markov process, with or without white noise, by restricted maximum likelihood.

    y_k = m + x_k + v_k,   x_{k+1} = exp(-dt/tau) x_k + w_k,   rms x = sigma,   var v = N^2/dt (N two-sided)

The likelihood is exact (tridiagonal factors) and restricted: the mean m is integrated out, which takes away the bias
of phi = exp(-dt/tau) that the mean causes.  The interval of tau is that of the likelihood ratio, 3.84, at the best
share of white noise for every tau: it is unsymmetric, and open above where the record is too short.  Samples are
instants or means over dt, exactly.  Without a correlated part (likelihood gain below 3 against white noise) tau is
not determined.
[RED-ARMA, DRIFT-RANDOM-CLASSES; Hu 1981, eq. 4-102..4-126; restricted likelihood: own derivation]
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import optimize, signal
from scipy.linalg import lapack

from gyrobench.reduction.estimation import noise
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.checks import Array, checked, checked_step

GAIN = 3.0  # of log likelihood against white noise, for two more parameters
SHORTEST, LONGEST = 0.2, 10.0  # correlation time sought: of samples, of the record
WHITE = (-9.0, 12.0)  # ln of the variance of the white part over that of the process
FEWEST = 50
LONG, HEAD = 20_000, 20  # the likelihood is filtered from so many samples on, if the filter is steady after a 20th


@dataclass(frozen=True)
class GaussMarkov:
    """Correlation time with its 95 % interval, and what goes with the best one."""

    tau: float  # s
    low: float  # s; 0: not bounded below
    high: float  # s; infinite: not bounded by this record
    sigma: float  # rms of the process, unit
    density: float  # N of the white part, unit sqrt(s); 0 without
    gain: float  # log likelihood over that of white noise alone
    n: int
    dt: float

    @property
    def determined(self) -> bool:
        return self.gain >= GAIN

    @property
    def phi(self) -> float:
        return math.exp(-self.dt / self.tau)


class _Likelihood:
    """Restricted log likelihood with the scale taken out."""

    def __init__(self, y: Array, white: bool, means: bool = False) -> None:
        self.y, self.n, self.white, self.means = y, y.size, white, means
        self.both = np.asfortranarray(np.column_stack([y, np.ones(y.size)]))
        inner = y[1:-1]
        self.sums = (
            float(y @ y), float(inner @ inner), float(y[1:] @ y[:-1]), float(y.sum()), float(inner.sum()),
            float(y[0] + y[-1]),
        )  # fmt: skip

    def alone(self, phi: float) -> tuple[float, float]:
        """Return the likelihood and the variance of the process without white noise, from six sums."""
        n, (yy, ii, cross, s, si, ends) = self.n, self.sums
        # V^-1 (1 - phi^2) = tridiagonal: 1 at both ends, 1 + phi^2 inside, -phi beside
        quadratic = yy + phi**2 * ii - 2.0 * phi * cross
        with_one = s + phi**2 * si - phi * (2.0 * s - ends)
        ones = n + phi**2 * (n - 2) - 2.0 * phi * (n - 1)
        q = 1.0 - phi * phi
        rest = (quadratic - with_one**2 / ones) / q
        return -0.5 * ((n - 1) * math.log(q) + math.log(ones / q) + (n - 1) * math.log(rest)), rest / (n - 1)

    def mixed(self, phi: float, s: float) -> tuple[float, float]:
        """Return the likelihood and the variance of the process, white noise of variance s over it."""
        n, q = self.n, 1.0 - phi * phi
        if n >= LONG and 0 < HEAD * (head := settling(phi, s)) <= n:
            return self.filtered(phi, s, head)
        # V = T^-1 + s with the tridiagonal T of the process alone: V^-1 = T (1 + s T)^-1, |V| = |1 + s T|/|T|
        diagonal = np.full(n, (1.0 + phi * phi) / q)
        diagonal[[0, -1]] = 1.0 / q
        d, e, _ = lapack.dpttrf(1.0 + s * diagonal, np.full(n - 1, -s * phi / q))
        z, _ = lapack.dpttrs(d, e, self.both)
        turned = diagonal[:, None] * z
        turned[1:] -= phi / q * z[:-1]
        turned[:-1] -= phi / q * z[1:]
        (square, cross), (_, ones) = self.both.T @ turned
        log = float(np.log(d).sum()) + (n - 1) * math.log(q)
        rest = float(square - cross * cross / ones)
        return -0.5 * (log + math.log(float(ones)) + (self.n - 1) * math.log(rest)), rest / (self.n - 1)

    def filtered(self, phi: float, s: float, head: int) -> tuple[float, float]:
        """Return what :meth:`mixed` does, from the innovations v of a Kalman filter of variance F: |V| = product of F,
        y' V^-1 y = sum of v^2/F.

        After ``head`` values F is constant to rounding, the filter a difference equation, and the innovations of the
        record of ones approach their limit as r^k: a tenth of the time of the tridiagonal factors.
        """
        n, y = self.n, self.y
        P, a, a1, log, square, cross, ones = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for reading in y[:head].tolist():
            F = P + s
            K, v, v1 = P / F, reading - a, 1.0 - a1
            log += math.log(F)
            square, cross, ones = square + v * v / F, cross + v * v1 / F, ones + v1 * v1 / F
            a, a1 = phi * (a + K * v), phi * (a1 + K * v1)
            P = phi * phi * P * s / F + 1.0 - phi * phi
        F = P + s
        r = phi * s / F
        # a' = r a + phi K y and v = y - a: v_k = r v_(k-1) + y_k - phi y_(k-1), from v = y - a at k = head
        v = signal.lfilter([1.0, -phi], [1.0, -r], y[head:], zi=[-a])[0]
        limit = (1.0 - phi) / (1.0 - r)
        fading = (1.0 - a1 - limit) * r ** np.arange(min(n - head, 2 * head))  # r^(2 head) is below the rounding
        log += (n - head) * math.log(F)
        square += float(v @ v) / F
        cross += (limit * float(v.sum()) + float(fading @ v[: fading.size])) / F
        ones += ((n - head) * limit**2 + 2.0 * limit * float(fading.sum()) + float(fading @ fading)) / F
        rest = square - cross * cross / ones
        return -0.5 * (log + math.log(ones) + (n - 1) * math.log(rest)), rest / (n - 1)

    def best(self, u: float) -> tuple[float, float, float]:
        """Return the likelihood at the best share of white noise, the variances of process and white; u = ln(tau/dt).

        Means over dt have the covariances sigma^2 v and sigma^2 a^2 phi^(k-1) (gyrobench.reduction.estimation.noise):
        those of instants of variance K = sigma^2 a^2/phi with v phi/a^2 - 1 < 0 of K added at lag 0.
        """
        r = math.exp(-u)
        phi, least, unit = math.exp(-r), 0.0, 1.0
        if self.means:
            a, v = float(noise.mean_gain(np.array(r))), float(noise.mean_variance(np.array(r)))
            least, unit = v * phi / a**2 - 1.0, phi / a**2
            value, variance = self.mixed(phi, least)
        else:
            value, variance = self.alone(phi)
        if not self.white:
            return value, unit * variance, 0.0
        found = optimize.minimize_scalar(
            lambda v: -self.mixed(phi, least + math.exp(v))[0], bounds=WHITE, method="bounded", options={"xatol": 1e-3}
        )
        if -found.fun <= value:
            return value, unit * variance, 0.0
        share = math.exp(found.x)
        variance = self.mixed(phi, least + share)[1]
        return -float(found.fun), unit * variance, share * variance


def settling(phi: float, s: float) -> int:
    """Return the values after which the filter of process and white noise is steady to rounding; 0: not found so.

    Its variance P has the limit P^2 - q (1 - s) P - q s = 0, q = 1 - phi^2; it comes near as r^2k, r = phi s/(P + s).
    """
    q = 1.0 - phi * phi
    half = 0.5 * q * (1.0 - s)
    square = half * half + q * s
    if square <= 0.0:
        return 0
    P = half + math.sqrt(square) if half > 0.0 else q * s / (math.sqrt(square) - half)
    r = abs(phi * s / (P + s))
    return 0 if not r < 1.0 else 2 if r < 1e-9 else 2 + math.ceil(math.log(1e-18) / (2.0 * math.log(r)))


def gauss_markov(x: Any, dt: float, white: bool = True, means: bool = False) -> GaussMarkov:
    """Return the correlation time of ``x`` (n,) sampled every ``dt`` s; trend and lines must be removed before.

    white: the record may hold white noise too; without it and without ``means`` the time does not grow with the length.
    means: samples are means over dt (block means, differences of angles), not instants.
    """
    x, dt = checked(x, FEWEST), checked_step(dt)
    n = x.size
    scale = float(x.std())
    likelihood = _Likelihood((x - x.mean()) / scale, white, means)

    def profile(u: float) -> float:
        return likelihood.best(u)[0]

    low, high = math.log(SHORTEST), math.log(LONGEST * n)
    grid = np.linspace(low, high, max(8, round((high - low) / 0.7)))
    values = [profile(float(u)) for u in grid]
    k = int(np.argmax(values))
    bounds = (float(grid[max(k - 1, 0)]), float(grid[min(k + 1, grid.size - 1)]))
    found = optimize.minimize_scalar(lambda u: -profile(u), bounds=bounds, method="bounded", options={"xatol": 1e-4})
    u, top = (float(found.x), -float(found.fun)) if -found.fun > values[k] else (float(grid[k]), values[k])
    ends = [_crossing(profile, u, top, side) for side in (low, high)]
    value, variance, reading = likelihood.best(u)
    nothing = -0.5 * (math.log(n) + (n - 1) * math.log(float(n)))  # y has unit variance and no mean
    return GaussMarkov(
        dt * math.exp(u), dt * math.exp(ends[0]) if math.isfinite(ends[0]) else 0.0,
        dt * math.exp(ends[1]) if math.isfinite(ends[1]) else math.inf, scale * math.sqrt(variance),
        scale * math.sqrt(reading * dt), value - nothing, n, dt,
    )  # fmt: skip


def _crossing(profile: Callable[[float], float], u: float, top: float, end: float) -> float:
    """Return where the profile has fallen by half of 3.84 between ``u`` and ``end``; infinite where it never does."""
    target = top - NORMAL**2 / 2.0
    step, inside = math.copysign(0.25, end - u), u
    while True:
        outside = inside + step
        if (outside - end) * step >= 0.0:
            outside = end
        if profile(outside) < target:
            return float(optimize.brentq(lambda w: profile(w) - target, inside, outside, xtol=1e-3))
        if outside == end:
            return math.copysign(math.inf, step)
        inside, step = outside, 1.6 * step


def check_length(found: GaussMarkov) -> str | None:
    """Return what a record of this length cannot say of the correlation time, or None."""
    times = found.n * found.dt / found.tau
    if not found.determined:
        return "no correlated part beside white noise: a correlation time is not determined"
    if math.isinf(found.high) or times < 20.0:
        return f"the record has {times:.3g} correlation times; 20 are needed for more than an order of magnitude"
    return None
