"""Steps of the level of a stretch: the likelihood ratio of one at every sample, under a noise of known spectrum.

In the cosine transform a step at s has the ordinates -sqrt(2/n) sin(omega_k s)/(2 sin(omega_k/2)); with b(s) the sum of
P x over the samples from s on, its size is b/d and the ratio b^2/d, d(s) = sum of sin^2(omega_k s)/(2 n sin^2 S_k).
The errors of the end angles, of variance q2, add a rank u to the covariance of each parity: P = D - c D u u' D with
D = diag(1/S), c = 2 q2/(1 + 2 q2 u'D u), u_k = sqrt(2/n) cos(omega_k/2).  The level itself is free, and a ramp: with r
its ordinates and g(s) the sum of P r from s on, b is less by g r'P x/r'P r, d by g^2/r'P r.
[DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import fft

from gyrobench.arrays import Array

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


def step_ratios(x: Array, S: Array, q2: float = 0.0) -> tuple[Array, Array, Array]:
    """Return likelihood ratio, size and standard deviation (n,) of a step at each sample of x (n,) beside a ramp; S
    (n,): spectrum at omega = pi k/n, S[0] is not used; q2: variance of the error of an angle.
    """
    n = x.size
    weigh, ends = precision(S, q2, n)

    def passed(ordinates: Array) -> Array:
        """Return the sums from each sample on of a series of these ordinates."""
        y = fft.idct(ordinates, norm="ortho")
        return -np.concatenate([[0.0], np.cumsum(y)[:-1]])

    c, ramp = (fft.dct(y, norm="ortho") for y in (x, np.arange(n) / n))
    of_ramp = weigh(ramp)
    g, info = passed(of_ramp), float(ramp @ of_ramp)
    b = passed(weigh(c)) - g * float(of_ramp @ c) / info
    half = 0.5 * math.pi * np.arange(1, n) / n
    a = np.zeros(n)
    a[1:] = 1.0 / (4.0 * S[1:] * np.sin(half) ** 2)
    # sum of a_k cos(2 pi k s/n)
    d = (a.sum() - np.real(fft.fft(a))) / n
    for share, weighed in ends:
        d = d - share * passed(weighed) ** 2
    d = d - g * g / info
    d[:EDGE] = d[n - EDGE :] = np.inf
    d[0] = np.inf
    d = np.maximum(d, 1e-300)
    return b * b / d, b / d, 1.0 / np.sqrt(d)


def largest_step(ratio: Array, size: Array, sd: Array) -> tuple[LevelStep, float]:
    """Return the step of the largest likelihood ratio, and that ratio, of what :func:`step_ratios` returns."""
    k = int(np.argmax(ratio))
    return LevelStep(k, float(size[k]), float(sd[k])), float(ratio[k])


def precision(S: Array, q2: float, n: int) -> tuple[Callable[[Array], Array], list[tuple[float, Array]]]:
    """Return the product of the precision with the first ordinates (k,) of n, and of each parity c and D u (k,)."""
    inverse = 1.0 / S
    inverse[0] = 0.0
    ends = []
    for first in (1, 2) if q2 > 0.0 else ():
        u = np.zeros(S.size)
        u[first::2] = math.sqrt(2.0 / n) * np.cos(0.5 * math.pi * np.arange(first, S.size, 2) / n)
        ends.append((2.0 * q2 / (1.0 + 2.0 * q2 * float(u @ (inverse * u))), inverse * u))

    def weigh(ordinates: Array) -> Array:
        out = inverse * ordinates
        for share, weighed in ends:
            out = out - share * float(weighed @ ordinates) * weighed
        return out

    return weigh, ends
