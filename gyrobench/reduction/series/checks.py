"""Conditions that every series must meet before anything is computed from it, and block means."""

from __future__ import annotations

from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.errors import GyrobenchError


class SeriesError(GyrobenchError, ValueError):
    """The series or a setting does not allow the analysis; the message says which, and what would do."""


def checked(x: Any, minimum: int = 2, what: str = "series") -> Array:
    """Return ``x`` as a float array (n,).

    Raises SeriesError for another shape, fewer than ``minimum`` values, a non-finite or a constant series.
    """
    out: Array = np.asarray(x, dtype=float)
    if out.ndim != 1:
        raise SeriesError(f"{what}: {out.ndim} dimensions; one is needed")
    if out.size < minimum:
        raise SeriesError(f"{what}: {out.size} values; at least {minimum} are needed")
    low, high = float(out.min()), float(out.max())
    if not (np.isfinite(low) and np.isfinite(high)):
        first = int(np.flatnonzero(~np.isfinite(out))[0])
        raise SeriesError(f"{what}: value {first + 1} is not a finite number; analyse the stretches between gaps")
    if high - low <= 1e-14 * max(abs(low), abs(high)):
        raise SeriesError(f"{what}: all values are equal to 1e-14 of their size; there is nothing to analyse")
    return out


def checked_step(dt: float) -> float:
    """Return the sampling interval, s; raises SeriesError unless it is finite and positive."""
    if not (np.isfinite(dt) and dt > 0.0):
        raise SeriesError(f"sampling interval {dt}: it must be finite and positive")
    return float(dt)


def checked_order(order: int, n: int) -> None:
    """Raise SeriesError unless an autoregression of ``order`` can be fitted to ``n`` values."""
    if order < 1 or 3 * order >= n:
        raise SeriesError(f"autoregression of order {order} on {n} values: 1 to {max((n - 1) // 3, 0)} are possible")


def block_means(x: Array, m: int) -> Array:
    """Return the means of consecutive blocks of ``m`` values; an incomplete last block is left out."""
    k = x.size // m
    return np.asarray(x[: k * m].reshape(k, m).mean(axis=1) if m > 1 else x)
