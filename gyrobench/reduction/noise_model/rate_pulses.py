"""Pulses of the rate: the instrument turns by an angle within a short time, which no noise of the rest makes.

Of a rectangle of w samples from s on, of the rate, the ordinate k of the cosine transform is
sqrt(2/n) a_k cos(omega_k (s + w/2)), a_k = sin(omega_k w/2)/sin(omega_k/2).  With b(s) the sum of P x over the window,
its size is b/d and the likelihood ratio b^2/d, d(s) = sum of a_k^2 (1 + cos(omega_k (2 s + w)))/(n S_k), both less what
the end angles, the level and a ramp take of it as of a step (:mod:`steps`).  Left in, a few turns of some seconds are
white noise to the model: an angle random walk that the instrument does not have.  [DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import fft

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.steps import EDGE, precision

WIDTHS = tuple(8 * 2**k for k in range(7))  # samples: a shorter one is a wild sample
MOST = 10  # pulses of a record that are taken out
PART = 20  # of a stretch, at most: a longer one is a change of the level


@dataclass(frozen=True)
class Pulse:
    """A rate of ``size`` over ``width`` samples from the index ``at`` on, beside what it was; u: of the size."""

    at: int
    width: int
    size: float
    u: float

    def curve(self, n: int) -> Array:
        """Return what it adds to a stretch (n,)."""
        t = np.arange(n)
        return np.where((t >= self.at) & (t < self.at + self.width), self.size, 0.0)


def pulse(x: Array, S: Array, q2: float = 0.0) -> tuple[Pulse, float]:
    """Return the pulse of the largest likelihood ratio in a stretch x (n,), and that ratio.

    S (n,): spectrum at omega = pi k/n, S[0] is not used; q2: variance of the error of an angle.
    """
    n, best = x.size, (Pulse(0, 0, 0.0, math.inf), 0.0)
    weigh, ends = precision(S, q2, n)
    c, ramp = (fft.dct(y, norm="ortho") for y in (x, np.arange(n) / n))
    of_ramp = weigh(ramp)
    info = float(ramp @ of_ramp)

    def summed(ordinates: Array) -> Array:
        return np.concatenate([[0.0], np.cumsum(fft.idct(ordinates, norm="ortho"))])

    sums = [summed(weigh(c) - of_ramp * (float(of_ramp @ c) / info)), summed(of_ramp), *(summed(e) for _, e in ends)]
    shares = [1.0 / info, *(share for share, _ in ends)]
    half = 0.5 * math.pi * np.arange(1, n) / n
    for width in (w for w in WIDTHS if w <= n // PART):
        a = np.zeros(n)
        a[1:] = (np.sin(width * half) / np.sin(half)) ** 2 / S[1:]
        b, *others = (s[width:] - s[:-width] for s in sums)
        at = np.arange(b.size)
        d = (a.sum() + np.real(fft.fft(a))[(at + width // 2) % n]) / n
        d = d - sum(share * g * g for share, g in zip(shares, others, strict=True))
        d[:EDGE] = d[-EDGE:] = np.inf
        ratio = b * b / np.maximum(d, 1e-300)
        k = int(np.argmax(ratio))
        if ratio[k] > best[1]:
            best = Pulse(k, width, float(b[k] / d[k]), float(d[k] ** -0.5)), float(ratio[k])
    return best
