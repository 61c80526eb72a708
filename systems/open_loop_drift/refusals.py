"""What makes an open-loop test impossible.  [TEST-OPEN, INPUT-LIMITS]"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench.attitudes import parse

ARCMIN = math.pi / 10800.0


def options(system: Any) -> list[str]:
    """What is wrong with the options of the system."""
    found = []
    try:
        parse(system["attitude"], system["latitude"])
    except ValueError as error:
        found.append(str(error))
    if system["gravity"]:
        found += site(system["latitude"], system["gravity"])
    if not system["dwell"] > 4.0 * system.step:
        found.append(f"dwell = {system['dwell']:g} s: a reading needs more than four steps of {system.step:g} s")
    if not system["bracket"] > 0.0:
        found.append("bracket = 0: the gain of the pickoff is found from the steps over and under its null")
    return found


def site(latitude: float, gravity: float) -> list[str]:
    found = []
    if not abs(latitude) <= math.pi / 2:
        found.append(f"latitude {math.degrees(latitude):.6g}° lies outside −90..90°")
    if not 9.7 <= gravity <= 9.9:
        found.append(f"gravity {gravity:.6g} m/s² lies outside 9.7..9.9 m/s²")
    return found


def pickoff_range(bracket: float, parameters: Mapping[str, Any]) -> list[str]:
    """A step that already leaves the range of the pickoff, where the part says it."""
    reach = case_range(parameters)
    if reach is None or bracket < reach:
        return []
    return [
        f"bracket = {bracket / ARCMIN:.4g}': the pickoff saturates at {reach / ARCMIN:.4g}' of the case; the test is "
        "valid only inside that range"
    ]


def case_range(parameters: Mapping[str, Any]) -> float | None:
    """Case angle (rad) about the input axis at which the pickoff saturates: u_max C/(K_sg H); None if unknown."""
    names = ("gyro.u_max", "gyro.C", "gyro.K_sg", "gyro.H")
    if not all(n in parameters for n in names):
        return None
    u_max, C, K_sg, H = (float(parameters[n]) for n in names)
    return u_max * C / (K_sg * H)
