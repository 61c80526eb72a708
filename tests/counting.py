"""Do 95 % intervals hold the truth 95 times of a hundred?  Bounds from a Monte Carlo, and what they would find out.

Coefficients of one run share its noise, so the runs, not the intervals, are the independent trials: the standard error
is that of the mean over the runs of the part of their intervals that hold the truth.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
SIGMAS = 3.3  # a true 0.95 lies outside once in a thousand
AS_90, AS_99 = 1.645 / 1.960, 2.576 / 1.960  # what makes of a 95 % interval a 90 % or a 99 % one


def bounds(ratio: Array, scale: float = 1.0) -> tuple[float, float]:
    """Where the coverage of intervals ``scale`` times as wide lies; ratio (runs, coefficients): errors over half
    widths, nan where there is none.
    """
    share = np.nanmean(np.where(np.isnan(ratio), np.nan, np.abs(ratio) <= scale), axis=1)
    error = SIGMAS * float(share.std(ddof=1)) / np.sqrt(share.size)
    return float(share.mean()) - error, float(share.mean()) + error


def check(ratio: Array) -> None:
    """The coverage may be 0.95; and runs are enough to tell it from the coverage of 90 % and of 99 % intervals."""
    low, high = bounds(ratio)
    assert low <= 0.95 <= high, f"coverage {low:.3f} .. {high:.3f}"
    assert bounds(ratio, AS_90)[1] < 0.95, "too few runs to find out 0.90"
    assert bounds(ratio, AS_99)[0] > 0.95, "too few runs to find out 0.99"
