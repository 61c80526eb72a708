"""Errors of the scale of an angle reader by harmonics: the columns of their fit, and those of a simulated one.

The error of a reader is the sum of a_k cos(k theta) + b_k sin(k theta) over its orders k, theta the table angle.
[ANGLE-INDUCTOSYN]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench.arrays import Array


def waves(orders: Sequence[int], angle: Array) -> Array:
    """Return the columns cos k a, sin k a (n, 2 m) of each order k at the angles a (n,), rad."""
    columns = [f(k * angle) for k in orders for f in (np.cos, np.sin)]
    return np.column_stack(columns) if columns else np.zeros((angle.size, 0))


def truth(parameters: Mapping[str, Any], slot: str) -> dict[int, tuple[float, float]]:
    """Return order -> (a, b), rad, of a simulated inductosyn in a slot; empty for another part."""
    try:
        at = {n: float(parameters[f"{slot}.{n}"]) for n in ("pole_pairs", "head")}
        e = {n: float(parameters[f"{slot}.encoder_{n}"]) for n in
             ("eccentricity", "tilt", "pitch", "interpolation", "d0", "de", "e3", "e5", "pitch_order")}  # fmt: skip
        phase = {n: float(parameters[f"{slot}.encoder_{n}_phase"]) for n in
                 ("eccentricity", "tilt", "pitch", "interpolation")}  # fmt: skip
    except KeyError:
        return {}
    p, head = round(at["pole_pairs"]), at["head"]
    found: dict[int, tuple[float, float]] = {}

    def add(order: int, cosine: float, sine: float) -> None:  # of the angle of the scale, theta + head
        c, s = math.cos(order * head), math.sin(order * head)
        a, b = found.get(order, (0.0, 0.0))
        found[order] = (a + cosine * c + sine * s, b + sine * c - cosine * s)

    for name, order in (("eccentricity", 1), ("tilt", 2), ("pitch", round(e["pitch_order"])), ("interpolation", p)):
        add(order, e[name] * math.sin(phase[name]), e[name] * math.cos(phase[name]))
    add(2 * p, -0.5 * e["d0"] / p, 0.5 * e["de"] / p)
    add(4 * p, 0.0, (e["e5"] - e["e3"]) / p)
    return found
