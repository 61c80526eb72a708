"""Harmonic analysis over the table angle by least squares on window-averaged cosines and sines.

    y = A_0 + sum_n ( A_n cos n theta + B_n sin n theta )

The average of cos n theta over a window of width w is cos(n theta_m) sin(n w/2)/(n w/2): with averaged regressors the
damping [AVG-SINC] is divided out, and unequal angle steps do no harm.  For equidistant windows over whole turns it is
the discrete Fourier sum.  [RED-HARMONIC; Hu 1981, eq. 4-12..4-22]
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.regression import Fit, RegressionError, least_squares
from gyrobench.reduction.estimation.sentences import plain


def columns(start: Array, end: Array, orders: Sequence[int]) -> tuple[Array, tuple[str, ...]]:
    """Return window means of cos n theta, sin n theta from ``start`` to ``end`` (rad), with names A0, A1, B1, ..."""
    middle, width = (start + end) / 2.0, end - start
    out, names = [], []
    for n in orders:
        damping = np.sinc(n * width / (2.0 * math.pi))
        out.append(np.cos(n * middle) * damping)
        names.append(f"A{n}")
        if n:
            out.append(np.sin(n * middle) * damping)
            names.append(f"B{n}")
    return np.stack(out, axis=1), tuple(names)


def fit(start: Array, end: Array, y: Array, order: int = 2) -> Fit:
    """Return A_0, A_1, B_1 ... up to ``order`` with their covariance for white noise.

    Raises RegressionError for fewer than 2 order + 2 windows, for windows that do not cover the circle (condition
    above 1e8), and where averaging leaves less than a tenth of a harmonic.
    """
    width = float(np.max(np.abs(end - start)))
    if order and abs(np.sinc(order * width / (2.0 * math.pi))) < 0.1:
        raise RegressionError(
            f"windows of {plain(math.degrees(width), 4)} deg average harmonic {order} away; use windows of at "
            f"most {math.degrees(1.8 * math.pi / order):.0f} deg"
        )
    X, names = columns(start, end, range(order + 1))
    if len(y) < X.shape[1] + 1:
        raise RegressionError(f"{len(y)} windows for {X.shape[1]} amplitudes up to harmonic {order}")
    if np.linalg.cond(X) > 1e8:
        raise RegressionError(f"the windows do not cover the circle well enough for harmonic {order}")
    return least_squares(X, y, names)


def whole_turns(start: Array, end: Array) -> float | None:
    """Return the number of turns the windows of one phase cover without gap, or None unless it is a whole number."""
    turned = float(np.sum(np.abs(end - start))) / (2.0 * math.pi)
    span = abs(float(end[-1] - start[0])) / (2.0 * math.pi)
    whole = round(turned)
    good = whole >= 1 and abs(turned - whole) < 0.01 and abs(span - turned) < 0.01
    return float(whole) if good else None
