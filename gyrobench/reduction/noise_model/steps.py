"""Steps of the level of a stretch: the likelihood ratio of one at every sample, under a noise of known spectrum.

In the cosine transform a step at s has the ordinates -sqrt(2/n) sin(omega_k s)/(2 sin(omega_k/2)); with b(s) the sum of
P x over the samples from s on, its size is b/d and the ratio b^2/d, d(s) = sum of sin^2(omega_k s)/(2 n sin^2 S_k).
The level itself is free.  [DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import fft

from gyrobench.arrays import Array

EDGE = 3  # samples from an end of a stretch, within which a step is not told from wild samples


@dataclass(frozen=True)
class LevelStep:
    """A step of the level between two samples; at: index of the first sample after it."""

    at: int
    size: float
    u: float


def step_ratios(x: Array, S: Array) -> tuple[Array, Array, Array]:
    """Return likelihood ratio, size and standard deviation (n,) of a step at each sample of x (n,); S (n,): spectrum at
    omega = pi k/n, S[0] is not used.
    """
    n = x.size
    precision = 1.0 / S
    precision[0] = 0.0
    y = fft.idct(fft.dct(x, norm="ortho") * precision, norm="ortho")
    b = -np.concatenate([[0.0], np.cumsum(y)[:-1]])
    half = 0.5 * math.pi * np.arange(1, n) / n
    a = np.zeros(n)
    a[1:] = precision[1:] / (4.0 * np.sin(half) ** 2)
    # sum of a_k cos(2 pi k s/n)
    d = (a.sum() - np.real(np.fft.fft(a))) / n
    d[:EDGE] = d[n - EDGE :] = np.inf
    d[0] = np.inf
    d = np.maximum(d, 1e-300)
    return b * b / d, b / d, 1.0 / np.sqrt(d)


def largest_step(x: Array, S: Array) -> tuple[LevelStep, float]:
    """Return the step of the largest likelihood ratio, and that ratio."""
    ratio, size, sd = step_ratios(x, S)
    k = int(np.argmax(ratio))
    return LevelStep(k, float(size[k]), float(sd[k])), float(ratio[k])


def without(x: Array, step: LevelStep) -> Array:
    """Return a stretch without a step; its mean level stays."""
    n = x.size
    out = x.copy()
    out[step.at :] -= step.size * step.at / n
    out[: step.at] += step.size * (n - step.at) / n
    return out
