"""What makes an eight-position test impossible: latitude, options, attitudes, record.  [POS8-POLE; INPUT-LIMITS]"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.system.values import InvalidValueError

from . import positions

DEG = math.pi / 180.0
LATITUDE, NEAR = 85.0 * DEG, 80.0 * DEG
ATTITUDE = 1.0 * DEG  # largest error of a position


def latitude(value: float) -> list[str]:
    """Return why there is no scale factor at this latitude (rad); empty when there is."""
    if problems := frames.latitude_problems(value):
        return problems
    if abs(value) > LATITUDE:
        return [
            f"latitude {value / DEG:.4g}°: possible to 85° north or south; the scale factors rest on W cos φ = "
            f"{15.0411 * math.cos(value):.3g} °/h, at the pole k cannot be told from R and u (rank 3 of 4 a channel)"
        ]
    return []


def near_pole(value: float) -> list[str]:
    """Return a warning above 80 degrees."""
    if NEAR < abs(value) <= LATITUDE:
        return [
            f"Latitude {value / DEG:.4g}°: beyond 80° W cos φ is small; the scale factors, and with them all "
            f"coefficients, are {1.0 / math.cos(value):.1f} times less certain than at the equator."
        ]
    return []


def options(system: Any) -> list[str]:
    """Return what is wrong with the options of the system."""
    found = latitude(system["latitude"])
    if system["terms"] not in (4, 6):
        found.append(f"terms = {system['terms']}: no such model; a channel has 4 or 6 unknowns")
    if system["visits"]:
        return found + _visits(system)
    if system["sigma"] and system["cycles"] < 2:
        found.append(
            "cycles = 1: no scatter over cycles can be had from one; take at least 2, or set sigma=false to do without"
        )
    if system["cycles"] * system["readings"] < 2:
        found.append("one reading in each position leaves no noise to estimate: readings or cycles at least 2")
    return found


def _visits(system: Any) -> list[str]:
    """Return what is wrong with the option visits: positions that are missing, or none that is visited twice."""
    try:
        numbers = [int(v.place[0]) for v in system.visits()]
    except InvalidValueError as error:
        return [str(error)]
    if missing := [str(n) for n in positions.ATTITUDES if n not in numbers]:
        return [f"visits: position {', '.join(missing)} is missing: all eight are needed, one for each unknown"]
    if len(numbers) * system["readings"] < 16:
        return [f"visits: {len(numbers) * system['readings']} readings: at least 16 are needed to estimate the noise"]
    if system["sigma"] and len(numbers) == len(positions.ATTITUDES):
        return ["visits: no position is visited twice, so there is no scatter over cycles: set sigma=false"]
    return []


def attitudes(actual: Mapping[int, Array]) -> list[str]:
    """Return positions that are more than a degree off; ``actual``: position -> rows x, y, z in E, N, U."""
    found = []
    for n, matrix in actual.items():
        error = positions.attitude_error(matrix, positions.ATTITUDES[n])
        if error > ATTITUDE:
            found.append(
                f"position {n}: attitude is {error / DEG:.3g}° off (x, y, z should be {_words(n)}); at most 1° is "
                "possible, the formulas know no other attitude"
            )
    return found


def _words(n: int) -> str:
    names = ("E", "N", "U")
    out = []
    for row in positions.ATTITUDES[n]:
        j = int(np.argmax(np.abs(row)))
        out.append(("−" if row[j] < 0.0 else "") + names[j])
    return ", ".join(out)


def record(position: NDArray[np.int_], cycle: NDArray[np.int_], sigma: bool, where: str = "") -> list[str]:
    """Return positions and cycles that a record lacks."""
    found = []
    there = set(position.tolist())
    missing = [n for n in positions.ATTITUDES if n not in there]
    if missing:
        text = ", ".join(map(str, missing))
        found.append(f"{where}position {text} missing in the record: all eight are needed, one for each unknown")
    odd = sorted(there - set(positions.ATTITUDES))
    if odd:
        found.append(f"{where}position {', '.join(map(str, odd))} unknown: positions are 1 to 8")
    count = np.unique(cycle).size
    if sigma and count < 2:
        found.append(f"{where}{count} cycle: no scatter over cycles can be had; take at least 2, or set sigma=false")
    if not found and position.size < 2 * 8:
        found.append(f"{where}{position.size} readings: at least 16 are needed to estimate the noise")
    return found
