"""Offline wavelet denoising with the wavelets of the source: soft thresholds, level by level.

    sign(d) max(|d| - threshold_j, 0),  threshold_j = sigma_j sqrt(2 ln n)
    sigma_j = median|d_j|/0.6745, a standard deviation

Wavelets: db4, sym4, coif4, bior1.5, haar (PyWavelets).  With a constant truth and white noise the error is sigma
2^(-J/2) whatever the wavelet, and the deepest level looks best; a signal limits it: 1/(2^(J+1) dt) >= 4 f
(:func:`level_for`). Running sigma: the median of a window moves with the record, for noise whose level changes.  It
uses samples on both sides of each value, so it is no filter for a loop: components/estimator_wavelet is, which has the
same wavelets, threshold and least window, without decimation and causal.
[EST-WAVELET; Xia 2008, eq. 4.3.1..4.3.8, table 4.3.2 with EX21..EX23, EX29]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage

from gyrobench.arrays import Array
from gyrobench.reduction.series.checks import SeriesError, checked, checked_step

# those of the part (gyrobench.component.blocks.wavelet_bank), which a reduction does not import; a test compares
WAVELETS = ("haar", "db4", "sym4", "coif4", "bior1.5")
MEDIAN = 0.6745  # of |d| over the standard deviation of a normal variate
WINDOW = 1024  # samples, least of a running sigma
COEFFICIENTS = 31  # least in a running window, on deep levels


@dataclass(frozen=True)
class Denoised:
    """``sigma``, ``threshold``: of levels 1 (finest) to J; with a running sigma their medians."""

    x: Array  # (n,)
    sigma: Array
    threshold: Array
    level: int
    wavelet: str


def highest_level(n: int, wavelet: str) -> int:
    """Return the deepest level of ``n`` samples: (filter length - 1) 2^J <= n."""
    import pywt

    if wavelet not in WAVELETS:
        raise SeriesError(f"wavelet '{wavelet}'; available: {', '.join(WAVELETS)}")
    return int(pywt.dwt_max_level(n, pywt.Wavelet(wavelet).dec_len))


def level_for(signal: float, dt: float) -> int:
    """Return the deepest level J that leaves a signal up to ``signal`` (Hz): 1/(2^(J+1) dt) >= 4 f."""
    dt = checked_step(dt)
    if not (math.isfinite(signal) and signal > 0.0):
        raise SeriesError(f"signal frequency {signal} Hz: it must be finite and positive")
    level = math.floor(math.log2(1.0 / (8.0 * signal * dt)) + 1e-12)
    if level < 1:
        raise SeriesError(f"a signal of {signal:.4g} Hz sampled every {dt:.4g} s leaves no level; sample faster")
    return level


def denoise(x: Any, wavelet: str = "db4", level: int | None = None, window: int | None = None) -> Denoised:
    """Denoise a record (n,) to ``level`` (default: the deepest, right for a constant truth only).

    window: samples of a running sigma, 1024 at least; default: one sigma a level.
    Raises SeriesError for a level or filter longer than the record allows, NaN, an unknown wavelet.
    """
    import pywt

    x = checked(x, 2)
    n, deepest = x.size, highest_level(len(x), wavelet)
    level = deepest if level is None else level
    length = pywt.Wavelet(wavelet).dec_len
    if not 1 <= level <= deepest or n < length * 2**level:
        raise SeriesError(
            f"{wavelet} to level {level} of {n} samples: 1 to {deepest} are possible, and {length} 2^level samples are "
            "needed"
        )
    if window is not None and window < WINDOW:
        raise SeriesError(f"window of {window} samples: at least {WINDOW} are needed for a median")
    approximation, *details = pywt.wavedec(x, wavelet, level=level)
    factor = math.sqrt(2.0 * math.log(n))
    sigma, kept = [], []
    for j, d in zip(range(level, 0, -1), details, strict=True):
        if window is None:
            s: Any = float(np.median(np.abs(d))) / MEDIAN
        else:
            s = ndimage.median_filter(np.abs(d), size=max(window >> j, COEFFICIENTS) | 1, mode="nearest") / MEDIAN
        sigma.append(float(np.median(s)))
        kept.append(np.sign(d) * np.maximum(np.abs(d) - factor * s, 0.0))
    out = pywt.waverec([approximation, *kept], wavelet)[:n]
    values: Array = np.array(sigma[::-1])
    return Denoised(np.asarray(out, dtype=float), values, factor * values, level, wavelet)
