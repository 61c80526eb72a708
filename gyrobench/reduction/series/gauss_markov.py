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
from functools import cached_property
from typing import Any

import numpy as np
from scipy import fft, optimize, signal
from scipy.linalg import lapack

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import noise
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.checks import checked, checked_step

GAIN = 3.0  # of log likelihood against white noise, for two more parameters
SHORTEST, LONGEST = 0.2, 10.0  # correlation time sought: of samples, of the record
WHITE = (-9.0, 12.0)  # ln of the variance of the white part over that of the process
FEWEST = 50
LONG, PART = 20_000, 20  # from so many samples on the filter's steady state is used, if it is steady after a 20th


@dataclass(frozen=True)
class GaussMarkovEstimate:
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
        n = self.n
        m = settling(phi, s) if n >= LONG else 0
        m = m if 0 < PART * m <= n else n
        sums, state = self.exact(phi, s, m)
        if m < n:
            sums = sums + self.steady(phi, s, m, *state)
        log, square, cross, ones = sums.tolist()
        rest = square - cross * cross / ones
        return -0.5 * (log + math.log(ones) + (n - 1) * math.log(rest)), rest / (n - 1)

    def exact(self, phi: float, s: float, m: int) -> tuple[Array, Array]:
        """Return ln|V|, y' V^-1 y, 1' V^-1 y, 1' V^-1 1 of the first m values, and the values of the process that y and
        a record of ones make expect at the last of them."""
        # V = T^-1 + s with the tridiagonal T of the process alone: V^-1 = T (1 + s T)^-1, |V| = |1 + s T|/|T|
        q, both = 1.0 - phi * phi, self.both[:m]
        diagonal = np.full(m, (1.0 + phi * phi) / q)
        diagonal[[0, -1]] = 1.0 / q
        d, e, _ = lapack.dpttrf(1.0 + s * diagonal, np.full(m - 1, -s * phi / q))
        z, _ = lapack.dpttrs(d, e, both)
        turned = diagonal[:, None] * z
        turned[1:] -= phi / q * z[:-1]
        turned[:-1] -= phi / q * z[1:]
        (square, cross), (_, ones) = both.T @ turned
        log = float(np.log(d).sum()) + (m - 1) * math.log(q)
        return np.array([log, square, cross, ones]), both[-1] - s * turned[-1]

    def steady(self, phi: float, s: float, m: int, last: float, one: float) -> Array:
        """Return what the values from m on add to the sums of :meth:`exact`: the steady Kalman filter's innovations v
        of variance F, |V| = product of F, y' V^-1 y = sum of v^2/F.  last, one: the values expected at m - 1.

            v_k = y_k + (r - phi) w_(k-1),   w_k = r w_(k-1) + y_k,   r = phi s/F

        r^2m is below the rounding: 2m values on, w is that of a filter at rest before the record, of which the sums
        A_j of y_k y_(k+j) give all squares: y_k w_(k-1) has the sum G = A_1 + r A_2 + r^2 A_3 + ..., w^2 the sum W with
        (1 - r^2) W = A_0 + 2 r G - r^2 w_(n-1)^2.  So n is in the time of the sums A_j alone.
        """
        n, y, far = self.n, self.y, 3 * m
        F = steady_variance(phi, s) + s
        r = phi * s / F
        powers = r ** np.arange(2 * m)
        limit = (1.0 - phi) / (1.0 - r)  # of the innovations of ones
        v = signal.lfilter([1.0, -phi], [1.0, -r], y[m:far], zi=[-phi * last])[0]
        v1 = limit + (1.0 - phi * one - limit) * powers
        rested = signal.lfilter([1.0, -phi], [1.0, -r], y[:far])
        A, w = self.lagged, float(powers @ y[: n - 1 - 2 * m : -1])  # w_(n-1)
        G = float(powers @ A[1 : 2 * m + 1])
        W = (A[0] + 2.0 * r * G - r * r * w * w) / (1.0 - r * r)
        squares = A[0] + 2.0 * (r - phi) * G + (r - phi) ** 2 * (W - w * w) - float(rested @ rested)
        total = (1.0 - phi) * (self.sums[3] - r * w) / (1.0 - r) + phi * w - float(rested.sum())
        added = float(v @ v) + squares, float(v1 @ v) + limit * total, float(v1 @ v1) + (n - far) * limit**2
        return np.array([(n - m) * math.log(F), *(x / F for x in added)])

    @cached_property
    def lagged(self) -> Array:
        """Sums of y_k y_(k+j), j = 0 to a tenth of n."""
        transform = fft.rfft(self.y, fft.next_fast_len(self.n + self.n // 10 + 1, real=True))
        return np.asarray(fft.irfft(np.abs(transform) ** 2)[: self.n // 10 + 1])

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


def steady_variance(phi: float, s: float) -> float:
    """Return the limit P of the variance of the predicted process, white noise of variance s over it; nan: none.

    P^2 - q (1 - s) P - q s = 0, q = 1 - phi^2.
    """
    q = 1.0 - phi * phi
    half = 0.5 * q * (1.0 - s)
    square = half * half + q * s
    if square <= 0.0:
        return math.nan
    return half + math.sqrt(square) if half > 0.0 else q * s / (math.sqrt(square) - half)


def settling(phi: float, s: float) -> int:
    """Return the values after which the filter of process and white noise is steady to rounding; 0: not found so.

    Its variance comes near the limit P as r^2k, r = phi s/(P + s).
    """
    r = abs(phi * s / (steady_variance(phi, s) + s)) if s else 0.0
    return 0 if not r < 1.0 else 2 if r < 1e-9 else 2 + math.ceil(math.log(1e-18) / (2.0 * math.log(r)))


def gauss_markov(x: Any, dt: float, white: bool = True, means: bool = False) -> GaussMarkovEstimate:
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
    return GaussMarkovEstimate(
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


def check_length(found: GaussMarkovEstimate) -> str | None:
    """Return what a record of this length cannot say of the correlation time, or None."""
    times = found.n * found.dt / found.tau
    if not found.determined:
        return "no correlated part beside white noise: a correlation time is not determined"
    if math.isinf(found.high) or times < 20.0:
        return f"the record has {plain(times, 3)} correlation times; 20 are needed for more than an order of magnitude"
    return None
