"""Harmonics of an angle reader: which orders it has, what they are, which a second head separates.

The error of a reader is the sum of a_k cos(k theta) + b_k sin(k theta) over its orders k, theta the table angle.  A
second reading of the same scale at theta + delta differs by the order k times 2 |sin(k delta / 2)|: an order for which
that is small cannot be told from the error of a reference.  [ANGLE-INDUCTOSYN]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench.reduction.loops.scale_errors import truth, waves

__all__ = ["LEAST", "PITCH_ORDER", "POLE_PAIRS", "meanings", "separation", "truth", "waves"]
LEAST = 0.2  # of 2: below it an order is not separated
PITCH_ORDER, POLE_PAIRS = 12, 360


def meanings(parameters: Mapping[str, Any], slot: str) -> dict[int, str]:
    """Return order -> cause of the reader in a slot; orders that coincide are one."""
    p = int(parameters.get(f"{slot}.pole_pairs", POLE_PAIRS))
    pitch = int(parameters.get(f"{slot}.encoder_pitch_order", PITCH_ORDER))
    named = ((1, "eccentricity"), (2, "tilt"), (pitch, "pitch"), (p, "interpolation"),
             (2 * p, "quadrature and amplitudes of the channels"), (4 * p, "winding harmonics"))  # fmt: skip
    found: dict[int, str] = {}
    for order, cause in named:
        found[order] = f"{found[order]}, {cause}" if order in found else cause
    return found


def separation(order: int, head: float) -> float:
    """Return how much of an order two readings of a scale, ``head`` (rad) apart, differ by: 0 to 2."""
    return 2.0 * abs(math.sin(0.5 * order * head))
