"""Changes of the level of a stretch that are no noise: steps, and a drift that settles.

Of a step the likelihood ratio at every sample, under a noise of known spectrum.

In the cosine transform a step at s has the ordinates -sqrt(2/n) sin(omega_k s)/(2 sin(omega_k/2)); with b(s) the sum of
P x over the samples from s on, its size is b/d and the ratio b^2/d, d(s) = sum of sin^2(omega_k s)/(2 n sin^2 S_k).
The errors of the end angles, of variance q2, add a rank u to the covariance of each parity: P = D - c D u u' D with
D = diag(1/S), c = 2 q2/(1 + 2 q2 u'D u), u_k = sqrt(2/n) cos(omega_k/2).  The level itself is free.

A drift that settles, A exp(-t/tau) from the beginning of the record on (a warm-up), has its size by generalized least
squares beside level and ramp, with e the ordinates of the exponential and r of the ramp: the ratio is what A takes off
the sum of squares, tau that of the greatest one.  [DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft, optimize

from gyrobench.arrays import Array

SETTLED, SHORTEST_TAU, TAUS = 4.0, 32.0, 24  # tau to the end at least, samples at least, and starts between
MOST, SMALL = 8192, 1e-4  # ordinates, and part of tau, of its derivative
EDGE = 16  # samples from an end of a stretch, within which a step is not told from wild samples or the end itself


@dataclass(frozen=True)
class LevelStep:
    """A step of the level between two samples; at: index of the first sample after it."""

    at: int
    size: float
    u: float

    def curve(self, n: int) -> Array:
        """Return what it adds to a stretch (n,)."""
        return np.where(np.arange(n) >= self.at, self.size, 0.0)


@dataclass(frozen=True)
class Settling:
    """A drift that settles from the first sample of a stretch on: size exp(-t/tau), tau in samples."""

    tau: float
    u_tau: float
    size: float
    u: float

    def curve(self, n: int) -> Array:
        """Return what it adds to a stretch (n,)."""
        return np.asarray(self.size * np.exp(-np.arange(n) / self.tau))


LevelChange = LevelStep | Settling


def step_ratios(x: Array, S: Array, q2: float = 0.0) -> tuple[Array, Array, Array]:
    """Return likelihood ratio, size and standard deviation (n,) of a step at each sample of x (n,); S (n,): spectrum at
    omega = pi k/n, S[0] is not used; q2: variance of the error of an angle.
    """
    n = x.size
    weigh, ends = _precision(S, q2, n)

    def passed(ordinates: Array) -> Array:
        """Return the sums from each sample on of a series of these ordinates."""
        y = fft.idct(ordinates, norm="ortho")
        return -np.concatenate([[0.0], np.cumsum(y)[:-1]])

    b = passed(weigh(fft.dct(x, norm="ortho")))
    half = 0.5 * math.pi * np.arange(1, n) / n
    a = np.zeros(n)
    a[1:] = 1.0 / (4.0 * S[1:] * np.sin(half) ** 2)
    # sum of a_k cos(2 pi k s/n)
    d = (a.sum() - np.real(np.fft.fft(a))) / n
    for share, weighed in ends:
        d = d - share * passed(weighed) ** 2
    d[:EDGE] = d[n - EDGE :] = np.inf
    d[0] = np.inf
    d = np.maximum(d, 1e-300)
    return b * b / d, b / d, 1.0 / np.sqrt(d)


def largest_step(ratio: Array, size: Array, sd: Array) -> tuple[LevelStep, float]:
    """Return the step of the largest likelihood ratio, and that ratio, of what :func:`step_ratios` returns."""
    k = int(np.argmax(ratio))
    return LevelStep(k, float(size[k]), float(sd[k])), float(ratio[k])


def settling(x: Array, S: Array, q2: float = 0.0) -> tuple[Settling, float]:
    """Return the drift that settles of the largest likelihood ratio in a stretch, and that ratio; S, q2: as above.

    Of the first MOST ordinates; the others have nothing of a drift that takes a thousandth of the stretch or more.
    """
    n = x.size
    shortest, longest = max(SHORTEST_TAU, n / 1000.0), n / SETTLED
    if longest < 2.0 * shortest:
        return Settling(longest, math.inf, 0.0, math.inf), 0.0
    c, ramp = (fft.dct(y, norm="ortho")[:MOST] for y in (x, np.arange(n) / n))
    weigh = _precision(S[:MOST], q2, n)[0]
    of_ramp = weigh(ramp)
    k = np.arange(c.size)
    turn = np.exp(1j * math.pi * k / n)

    def beside_ramp(ordinates: Array) -> tuple[Array, Array]:
        """Return what no ramp has of ordinates, and the product of the precision with it."""
        e = ordinates - float(of_ramp @ ordinates) / float(of_ramp @ ramp) * ramp
        return e, weigh(e)

    def curve(tau: float) -> Array:
        """Return the ordinates of exp(-t/tau), a geometric series."""
        sums = (1.0 - math.exp(-n / tau) * np.where(k % 2, -1.0, 1.0)) / (1.0 - math.exp(-1.0 / tau) * turn)
        return math.sqrt(2.0 / n) * np.real(np.sqrt(turn) * sums)

    def ratio(log_tau: float) -> float:
        e, weighed = beside_ramp(curve(math.exp(log_tau)))
        return float(weighed @ c) ** 2 / float(weighed @ e)

    starts = np.linspace(math.log(shortest), math.log(longest), TAUS)
    at = int(np.argmax([ratio(v) for v in starts.tolist()]))
    near = (float(starts[max(at - 1, 0)]), float(starts[min(at + 1, TAUS - 1)]))
    tau = math.exp(optimize.minimize_scalar(lambda v: -ratio(v), bounds=near, method="bounded").x)
    e, weighed = beside_ramp(curve(tau))
    size = float(weighed @ c) / float(weighed @ e)
    slope, of_slope = beside_ramp(
        size * (curve(tau * (1.0 + SMALL)) - curve(tau * (1.0 - SMALL))) / (2.0 * SMALL * tau)
    )
    information = np.array([[weighed @ e, weighed @ slope], [of_slope @ e, of_slope @ slope]])
    u, u_tau = np.sqrt(np.diagonal(np.linalg.inv(information))).tolist()
    return Settling(tau, u_tau, size, u), ratio(math.log(tau))


def _precision(S: Array, q2: float, n: int) -> tuple[Callable[[Array], Array], list[tuple[float, Array]]]:
    """Return the product of the precision with the first ordinates (k,) of n, and of each parity c and D u (k,)."""
    precision = 1.0 / S
    precision[0] = 0.0
    ends = []
    for first in (1, 2) if q2 > 0.0 else ():
        u = np.zeros(S.size)
        u[first::2] = math.sqrt(2.0 / n) * np.cos(0.5 * math.pi * np.arange(first, S.size, 2) / n)
        ends.append((2.0 * q2 / (1.0 + 2.0 * q2 * float(u @ (precision * u))), precision * u))

    def weigh(ordinates: Array) -> Array:
        out = precision * ordinates
        for share, weighed in ends:
            out = out - share * float(weighed @ ordinates) * weighed
        return out

    return weigh, ends


def without(x: Array, changes: Sequence[LevelChange]) -> Array:
    """Return a stretch (n,) without changes of its level; its mean stays."""
    for change in changes:
        curve = change.curve(x.size)
        x = x - (curve - curve.mean())
    return x
