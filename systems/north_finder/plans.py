"""Methods of north finding: their positions, how long they take, what they reach, and which is the shortest.

    sigma = N g / (A sqrt(T)),   A = W cos(latitude),   T: time of the readings, N: density of the white rate noise

with g = 1/|sin psi| (two positions), sqrt(2) (four, several, continuous, tilt), 1 (strapdown, two axes at once).  The
rest of the time is spent in moves and settling.  [NORTH-2POS, NORTH-4POS, NORTH-CONT, NORTH-STRAPDOWN]
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from gyrobench import units
from gyrobench.system.plan import Phase

TURN = 2.0 * math.pi
FACE = "head"
ACCELERATION, RATE = 1.0, 1.0  # of the head, rad/s2 and rad/s
GUARD = 6  # samples that a phase takes besides
WINDOWS_A_TURN = 36
MARGIN = math.radians(30.0)  # heading from north or south, nearer than which two positions are not taken
#: method -> part that estimates
PARTS = {
    "two": "northfinder_two_position",
    "null": "northfinder_null_seeking",
    "four": "northfinder_four_position",
    "several": "northfinder_multi_position",
    "continuous": "northfinder_continuous",
    "tilt": "northfinder_tilt",
    "strapdown": "northfinder_strapdown",
    "strapdown two": "northfinder_strapdown",
}
PAIRS = 4  # of positions of the method null; the first one seeks alone
SIDED = ("two", "null")  # methods with two headings, of which the rough one chooses
TURNING = ("continuous", "tilt")


def move_time(angle: float) -> float:
    """Return the time of an index move of the head, s."""
    peak = min(RATE, math.sqrt(abs(angle) * ACCELERATION))
    return abs(angle) / peak + peak / ACCELERATION if angle else 0.0


def targets(method: str, positions: int = 12, back: bool = False) -> list[float]:
    """Return the table angles of the positions, one after the other, clockwise; [] where the head turns.

    back: they are taken forwards and then backwards, 1-2-3-4-4-3-2-1.
    """
    if method == "null":
        there = [0.0, -0.5 * TURN]  # a pair the other way round costs no move, and a linear drift cancels
        return [a for k in range(PAIRS) for a in (there if k % 2 == 0 else there[::-1])]
    n = {"two": 2, "four": 4, "several": positions, "strapdown": 1, "strapdown two": 2}.get(method, 0)
    there = [-TURN * k / n for k in range(n)]
    return there + there[::-1] if back and n > 1 else there


def overhead(method: str, positions: int, back: bool, settle: float, step: float) -> float:
    """Return the part of the total time in which nothing is read, s."""
    at = targets(method, positions, back)
    if not at:
        return settle + RATE / ACCELERATION + GUARD * step
    moves = sum(move_time(b - a) for a, b in zip([0.0, *at[:-1]], at, strict=True))
    if method == "null":
        moves += move_time(0.25 * TURN)  # at most, to the null
    return moves + len(at) * (settle + GUARD * step)


def gain(method: str, rough: float) -> float:
    """Return g of the module's formula for a heading of about ``rough`` (rad)."""
    if method == "two":
        return 1.0 / max(abs(math.sin(rough)), 1e-3)
    if method == "null":
        return math.sqrt(PAIRS / (PAIRS - 1.0))
    return 1.0 if method.startswith("strapdown") else math.sqrt(2.0)


def reached(method: str, density: float, latitude: float, rough: float, reading: float) -> float:
    """Return the standard deviation of the heading after ``reading`` s of readings, rad."""
    return density * gain(method, rough) / (units.EARTH_RATE * math.cos(latitude) * math.sqrt(reading))


def total_time(method: str, sigma: float, density: float, latitude: float, rough: float, lost: float) -> float:
    """Return the total time in which a method reaches sigma, s; lost: that of :func:`overhead`.

    A head that turns makes at least a turn.
    """
    reading = (density * gain(method, rough) / (units.EARTH_RATE * math.cos(latitude) * sigma)) ** 2
    return max(reading, TURN / RATE if method in TURNING else 0.0) + lost


def possible(level: bool, axes: int, rough: float) -> Iterator[str]:
    """Return the methods that fit: a level head or not, gyro axes, a rough heading (two positions).

    Each of them removes the bias of the gyro; strapdown in one position does not.
    """
    near = min(abs(rough), math.pi - abs(rough)) < MARGIN
    if level and not near:
        yield "two"
    if level:
        yield from ("four", "continuous")
    yield "tilt"
    if axes == 2:
        yield "strapdown two"


def shortest(options: Mapping[str, Any], step: float) -> tuple[float, str]:
    """Return the total time (s) and the name of the method that reaches what is wanted soonest."""
    wanted, density, latitude, rough, settle = (
        float(options[n]) for n in ("wanted", "density", "latitude", "rough", "settle")
    )

    def time(method: str) -> float:
        return total_time(method, wanted, density, latitude, rough, overhead(method, 12, False, settle, step))

    best = min(possible(bool(options["level"]), int(options["axes"]), rough), key=time)
    return time(best), best


def phases(
    method: str, time: float, positions: int, back: bool, turns: float, settle: float, windows: int, step: float
) -> list[Phase]:
    """Return the phases of a method in the total ``time`` (s).

    windows: of all positions together.  A head that turns makes ``turns`` turns, or as many as it can; its windows are
    angles.
    """
    reading = time - overhead(method, positions, back, settle, step)
    at = targets(method, positions, back)
    if not at:
        turns = min(turns, max(reading, 1e-3) * RATE / TURN)
        rate = TURN * turns / max(reading, 1e-3)
        window = TURN * turns / max(round(turns * WINDOWS_A_TURN), 1)
        return [Phase("turning", "rate", FACE, -rate, settle=settle, travel=TURN * turns, window=window)]
    dwell, each = max(reading, 1e-3) / len(at), max(round(windows / len(at)), 1)
    return [
        Phase(f"position {k + 1}", "index", FACE, a, settle=settle, dwell=dwell, window=dwell / each)
        for k, a in enumerate(at)
    ]
