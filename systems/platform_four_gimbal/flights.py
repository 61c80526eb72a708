"""The flights of the four-gimbal platform: where the base begins, its legs, and how the fourth gimbal starts.

Base axes: pitch about x (nose up), roll about y (right side down), yaw about z (to the left).  Turned by 180 deg about
z, the flights of PLATFORM-4GIMBAL (axes forward, left, up) are these.
"""

from __future__ import annotations

from dataclasses import dataclass

from gyrobench.system.flight_plan import Leg
from gyrobench.units import DEG


@dataclass(frozen=True)
class FlightPlan:
    """what: in words; pitch of the base and inner roll of the platform at the start, rad; vertical: at pitch 90 deg."""

    what: str
    legs: tuple[Leg, ...]
    pitch: float = 0.0
    inner: float = 0.0
    vertical: bool = False


def _leg(label: str, time: float, pitch: float = 0.0, roll: float = 0.0, yaw: float = 0.0, **more: float) -> Leg:
    """Return a leg; rates in deg/s."""
    return Leg(label, time, pitch * DEG, roll * DEG, yaw * DEG, **more)


FLIGHTS = {
    "roll_yaw": FlightPlan(
        "roll to 90°, then 50° of yaw: three gimbals lock here",
        (_leg("roll 90°", 2.5, roll=36.0), _leg("yaw 50°", 5.0, yaw=10.0)),
    ),
    "roll": FlightPlan("a full roll", (_leg("roll 360°", 5.0, roll=72.0, yaw=0.5), _leg("rest", 1.0))),
    "loop": FlightPlan(
        "a full loop, through both verticals", (_leg("loop 360°", 5.0, pitch=72.0, yaw=0.5), _leg("rest", 1.0)),
        vertical=True,
    ),
    "crossing": FlightPlan(
        "over the vertical to inverted flight, with 1°/s of roll and yaw",
        (_leg("pitch 180°", 5.0, pitch=36.0, roll=-1.0, yaw=1.0), _leg("inverted", 5.0, roll=-1.0, yaw=1.0)),
        vertical=True,
    ),
    "beyond": FlightPlan(
        "at rest at 120° of pitch, the inner roll begins at 1°", (_leg("rest", 2.0),), -2.1, DEG, vertical=True
    ),
    "wobble": FlightPlan(
        "on the launcher: a wobble of 3°/s in yaw", (_leg("wobble", 10.0, yaw=3.0, frequency=0.3, rest=0.1),),
        90.0 * DEG, vertical=True,
    ),
    "launch": FlightPlan(
        "from the vertical over to level flight, roll 90°, yaw 50°",
        (_leg("pitch over", 5.0, pitch=-18.0, yaw=0.5), _leg("roll 90°", 2.5, roll=-36.0, yaw=0.5),
         _leg("yaw 50°", 2.5, yaw=20.5)),
        90.0 * DEG, vertical=True,
    ),
}  # fmt: skip
