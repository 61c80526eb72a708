"""What makes a fixed-position test impossible.  [TEST-FIXED, INPUT-LIMITS]"""

from __future__ import annotations

import math
from typing import Any

from gyrobench.attitudes import parse

STEP_MAX = 5e-3  # s


def options(system: Any) -> list[str]:
    """What is wrong with the options of the system."""
    found = []
    try:
        parse(system["attitude"], system["latitude"])
    except ValueError as error:
        found.append(str(error))
    found += scale_factor(system["k"]) if system["k"] else []
    if system["gravity"]:
        found += site(system["latitude"], system["gravity"])
    if system.step > STEP_MAX:
        found.append(
            f"step = {system.step:g} s: the rebalance loop exchanges once a step and needs at most {STEP_MAX:g} s"
        )
    return found


def scale_factor(k: float) -> list[str]:
    if math.isfinite(k) and k > 0.0:
        return []
    return [
        f"scale factor k = {k:g} rad/s/A: a finite number above 0 is expected (positive current, positive precession)"
    ]


def site(latitude: float, gravity: float) -> list[str]:
    found = []
    if not abs(latitude) <= math.pi / 2:
        found.append(f"latitude {math.degrees(latitude):.6g}° lies outside −90..90°")
    if not 9.7 <= gravity <= 9.9:
        found.append(f"gravity {gravity:.6g} m/s² lies outside 9.7..9.9 m/s²")
    return found
