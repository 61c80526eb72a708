"""Readings in known motions against what a stated chain of filters and algorithm makes of these."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gyrobench.arrays import Array

SAID, FAR = 0.05, 0.1  # of what an instrument reads: more than scale factors and misalignments make; nothing passes
CLEAR = 4.0  # standard uncertainties
SEVERITY = {False: ((), "warning"), True: (("pass",), "doubt")}  # far -> what a reason blocks, and its severity


def first_departure(y: Array, number: Array, motions: Iterable[tuple[float, float]]) -> tuple[int, float, bool] | None:
    """Return the first motion whose mean, less that at rest, is not the stated one: its number, what was found, and
    whether it is far off; None where there is none.

    y, number (n,): readings, and the motion of each, -1 at rest.  motions: what an instrument reads, what is stated.
    """
    rest = y[number < 0]
    for k, (read, stated) in enumerate(motions):
        here = y[number == k]
        u = float(np.hypot(np.std(rest, ddof=1) / np.sqrt(rest.size), np.std(here, ddof=1) / np.sqrt(here.size)))
        found = float(here.mean() - rest.mean())
        off = abs(found - stated) - CLEAR * u
        if off > SAID * abs(read):
            return k, found, off > FAR * abs(read)
    return None
