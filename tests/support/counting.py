"""Do 95 % intervals hold the truth 95 times of a hundred?  Bounds from a Monte Carlo, and what they would find out.

Coefficients of one run share its noise, so the runs, not the intervals, are the independent trials: the standard error
is that of the mean over the runs of the part of their intervals that hold the truth.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
SIGMAS = 2.6  # a true 0.95 lies outside once in a hundred; the draws are fixed, so that no test fails now and then


def bounds(ratio: Array, scale: float = 1.0) -> tuple[float, float]:
    """Where the coverage of intervals ``scale`` times as wide lies; ratio (runs, coefficients): errors over half
    widths, nan where there is none.
    """
    share = np.nanmean(np.where(np.isnan(ratio), np.nan, np.abs(ratio) <= scale), axis=1)
    error = SIGMAS * float(share.std(ddof=1)) / np.sqrt(share.size)
    return float(share.mean()) - error, float(share.mean()) + error


def check(ratio: Array) -> None:
    """The coverage may be 0.95; and the runs are enough to find out a coverage of 0.90 or 0.99: intervals made as
    much narrower or wider as gives these in the same runs are seen not to be of 0.95.
    """
    low, high = bounds(ratio)
    assert low <= 0.95 <= high, f"coverage {low:.3f} .. {high:.3f}"
    narrow, wide = np.nanquantile(np.abs(ratio), (0.90, 0.99))
    assert bounds(ratio, narrow)[1] < 0.95, "too few runs to find out 0.90"
    assert bounds(ratio, wide)[0] > 0.95, "too few runs to find out 0.99"
