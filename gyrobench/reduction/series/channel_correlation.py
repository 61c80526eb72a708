"""Correlation of the noise of two channels over averaging times, with intervals.  [DRIFT-CHANNELS]

    z_k = X_k / sqrt(S_X(f_k)),  X the cosine transform (type 2) of a channel without its straight line
    r(octave) = sum z_k w_k / sqrt(sum z_k^2 sum w_k^2)   over its n ordinates,   atanh r ± q / sqrt(n/c - 2)

The ordinates of a stationary process, and of a random walk, are uncorrelated and, whitened by the spectrum, of one
variance, so that those of an octave are n pairs of a bivariate normal distribution with known mean: Fisher's
transform.  An octave from f to 2 f tells of the averaging time at which its middle has most weight in the Allan
variance, tau = 0.371/(sqrt(2) f).  [Fisher 1915; own derivation]

Where the level of the noise changes in both at a time, fewer samples tell: c = <p_z p_w>/(<p_z> <p_w>), p the powers of
the whitened channels in BLOCKS parts of the record; 1 of a level that stays.

Not modelled: a delay between the channels beyond a sample (the correlation is that of the part in phase); a level that
changes faster than a part of the record.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import fft, special

from gyrobench.arrays import Array

FEWEST = 24  # ordinates of an octave
PEAK = 0.371  # f tau at which sin^4(pi f tau)/(pi f tau)^2 is largest
LEVEL = 0.05
BLOCKS = 32
DENSE = 4000  # frequencies at which a spectrum is computed


@dataclass(frozen=True)
class Correlated:
    """Correlation of two channels at one averaging time, s: value, 95 % interval of all octaves of the pair together,
    probability of a true zero, and that of one as large among all pairs and octaves."""

    tau: float
    value: float
    low: float
    high: float
    p: float
    p_all: float


def whitened(x: Array, step: float, spectrum: Callable[[Array], Array]) -> Array:
    """Return the whitened cosine ordinates 1 ... n-1 of a channel (n,) sampled every ``step`` s, of unit variance.

    spectrum: two-sided density over frequencies in Hz.
    """
    n = x.size
    t = (np.arange(n) - 0.5 * (n - 1)) / n
    y = x - x.mean()
    y = y - t * (float(t @ y) / float(t @ t))
    X = fft.dct(y, norm="ortho", overwrite_x=True)[1:]
    k = np.arange(1.0, n)
    few = k if n < DENSE else np.unique(np.rint(np.geomspace(1.0, n - 1.0, DENSE)))
    S = spectrum(few / (2.0 * n * step))
    return np.asarray(X * np.exp(-0.5 * np.interp(np.log(k), np.log(few), np.log(S / step))))


def octaves(n: int) -> list[slice]:
    """Return the ordinates 1 ... n-1 (from 0) of each octave, the fastest first."""
    out, high = [], n - 1
    while (low := high // 2) >= FEWEST:
        out.append(slice(low, high))
        high = low
    return out


def averaging_time(octave: slice, n: int, step: float) -> float:
    """Return the averaging time, s, of which an octave of the ordinates of n samples tells."""
    f = float(octave.stop) / (2.0 * n * step)
    return PEAK * math.sqrt(2.0) / f


def correlate(channels: Sequence[Array], step: float) -> dict[tuple[int, int], list[Correlated]]:
    """Return the correlations of each pair of whitened channels (n - 1,), an octave each, the shortest time first."""
    n = channels[0].size + 1
    bands = octaves(n)
    pairs = list(combinations(range(len(channels)), 2))
    count = max(len(pairs) * len(bands), 1)
    q = float(special.ndtri(1.0 - 0.5 * LEVEL / max(len(bands), 1)))
    out: dict[tuple[int, int], list[Correlated]] = {pair: [] for pair in pairs}
    powers = np.stack([_powers(c) for c in channels])
    shared = np.maximum((powers @ powers.T) / powers.shape[1], 1.0)
    for band in bands:
        of = np.stack([c[band] for c in channels])
        moments = of @ of.T
        for i, j in pairs:
            spread = 1.0 / math.sqrt(max((band.stop - band.start) / float(shared[i, j]) - 2.0, 1.0))
            norm = math.sqrt(moments[i, i] * moments[j, j])
            r = float(np.clip(moments[i, j] / norm, -1.0 + 1e-12, 1.0 - 1e-12)) if norm > 0.0 else 0.0
            z = math.atanh(r)
            p = 2.0 * float(special.ndtr(-abs(z) / spread))
            out[i, j].append(Correlated(averaging_time(band, n, step), r, math.tanh(z - q * spread),
                                        math.tanh(z + q * spread), p, min(1.0, count * p)))  # fmt: skip
    return out


def _powers(z: Array) -> Array:
    """Return the powers of a whitened channel (n - 1,) in parts of the record, of mean 1."""
    x = fft.idct(np.concatenate([[0.0], z]), norm="ortho", overwrite_x=True)
    power = np.array([float(part @ part) / part.size for part in np.array_split(x, BLOCKS)])
    return np.asarray(power / power.mean())
