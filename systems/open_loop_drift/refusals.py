"""What makes an open-loop test impossible.  [TEST-OPEN, INPUT-LIMITS]"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

ARCMIN = math.pi / 10800.0


def pickoff_range(bracket: float, parameters: Mapping[str, Any]) -> list[str]:
    """Return that a step already leaves the range of the pickoff, where the part says it."""
    reach = case_range(parameters)
    if reach is None or bracket < reach:
        return []
    return [
        f"bracket = {bracket / ARCMIN:.4g}': the pickoff saturates at {reach / ARCMIN:.4g}' of the case; the test is "
        "valid only inside that range"
    ]


def case_range(parameters: Mapping[str, Any]) -> float | None:
    """Return the case angle (rad) about the input axis at which the pickoff saturates: u_max C/(K_sg H); None if
    unknown.
    """
    names = ("gyro.u_max", "gyro.C", "gyro.K_sg", "gyro.H")
    if not all(n in parameters for n in names):
        return None
    u_max, C, K_sg, H = (float(parameters[n]) for n in names)
    return u_max * C / (K_sg * H)
