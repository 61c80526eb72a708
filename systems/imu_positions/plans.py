"""Plans of the test: positions one by one, then turns in both senses about the axes of the case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from gyrobench.system.plan import Phase, Plan
from gyrobench.system.visits import Visit, nearest_turn

from . import geometry
from .geometry import TURN

INDEX_RATE, ACCELERATION = 0.5, 0.5  # rad/s, rad/s2
MOVE = 5.0  # s that a move takes in the mean
#: a plan for temperatures that change: short, many times
CYCLES = {"positions": 6, "cycles": 6, "dwell": 40.0, "windows": 2, "turns": 2, "settle": 2.0}
CASE = "case"
FACES = {CASE: ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))}
#: axis of the case -> axis of the table that turns it, and the inner angle at which it does
TURNS = {"x": ("outer", 0.0), "y": ("inner", 0.0), "z": ("outer", TURN / 4.0)}


@dataclass(frozen=True)
class Times:
    """settle, dwell: s of a position.  windows: averages of it.  rate: rad/s.  turns: in each sense; 0: none."""

    settle: float
    dwell: float
    windows: int
    rate: float
    turns: int
    axes: str = "xyz"

    @property
    def rates(self) -> bool:
        return self.rate > 0.0 and self.turns > 0


def move_time(angle: float) -> float:
    """Return the time of a move by this angle (rad), s."""
    return angle / INDEX_RATE + INDEX_RATE / ACCELERATION if angle > 0.0 else 0.0


def positions(count: int, dwell: float) -> list[Visit]:
    """Return the positions of the standard plan, angles in rad."""
    return [Visit(place, dwell) for place in geometry.places(count)]


def plan(visits: Sequence[Visit], times: Times, cycles: int = 1) -> Plan:
    """Return the phases: each axis of the table goes the shorter way; turns begin at a position of their own."""
    phases: list[Phase] = []
    at = (0.0, 0.0)
    for _ in range(cycles):
        for v in visits:
            at = tuple(nearest_turn(a, b, TURN) for a, b in zip(v.place, at, strict=True))  # type: ignore[assignment]
            phases.append(_rest(_name(v.place), at, v.dwell, times))
        if times.rates:
            at = (nearest_turn(0.0, at[0], TURN), nearest_turn(0.0, at[1], TURN))
            for axis in times.axes:
                phases += _turning(axis, at, times)
    return Plan(phases, FACES)


def chamber(planned: Plan, cold: float, hot: float) -> dict[str, object]:
    """Return the program of a chamber that is at both temperatures (K) within the time of a plan, and back at 0: ramps
    of one rate, a tenth of the time at either of them.
    """
    time = sum(p.duration() + MOVE for p in planned.phases)
    rate = (hot + (hot - cold) - cold) / (0.7 * time) or 1.0
    targets = [hot, cold, 0.0, *[0.0] * 13]
    return {
        "chamber.segments?": 3, "chamber.targets": targets, "chamber.ramps": [rate] * 16,
        "chamber.soaks": [0.1 * time] * 16,
    }  # fmt: skip


def _name(place: Sequence[float]) -> str:
    return ", ".join(f"{math.degrees(a) + 0.0:.6g}°" for a in place)


def _rest(label: str, at: tuple[float, float], dwell: float, t: Times) -> Phase:
    window = dwell / t.windows
    return Phase(label, "index", CASE, at[0], settle=t.settle, dwell=dwell, window=window, target_y=at[1])


def _turning(axis: str, at: tuple[float, float], t: Times) -> list[Phase]:
    """Return a rest, then turns in both senses: after them the axis stands where it began, but for a little."""
    of, inner = TURNS[axis]
    out = [_rest(f"before {axis}", (at[0], at[1] + inner), t.dwell, t)]
    one = TURN / t.rate
    for sign, word in ((1.0, "+"), (-1.0, "−")):
        target = (sign * t.rate, 0.0) if of == "outer" else (0.0, sign * t.rate)
        label = f"{word}{axis} {math.degrees(t.rate):.4g}°/s"
        out.append(
            Phase(label, "rate", CASE, target[0], settle=t.settle, dwell=one * t.turns, window=one, target_y=target[1])
        )
    return out
