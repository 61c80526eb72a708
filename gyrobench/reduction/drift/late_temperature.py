"""The temperature of an instrument that follows that of a record late, by one time constant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.arrays import Array


def following(windows: Mapping[str, Any], tau: float) -> Array:
    """Return (n,) temperatures in the middle of each reading behind the column ``temperature`` (K or degC) by tau, s.

        x' = (T - x)/tau,   x = T at the first reading

    T is that of a reading while it lasts, and that of the reading before until it begins.  Rows in the order of time.
    """
    T, t0, t1 = (np.asarray(windows[n], dtype=float) for n in ("temperature", "t_start", "t_end"))
    out, x, end, held = np.empty_like(T), float(T[0]), float(t0[0]), float(T[0])
    for j, (now, start, stop) in enumerate(zip(T.tolist(), t0.tolist(), t1.tolist(), strict=True)):
        x = held + (x - held) * math.exp(-max(start - end, 0.0) / tau)
        half = math.exp(-0.5 * (stop - start) / tau)
        out[j] = now + (x - now) * half
        x, end, held = now + (x - now) * half * half, stop, now
    return out
