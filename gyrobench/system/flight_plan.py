"""A flight of a vehicle as a list of legs, for the phases of a loop plan and the rows of the part manoeuvre.

legs = [Leg("roll 90°", 2.5, roll=0.63), Leg("yaw 50°", 5.0, yaw=0.17)]
plan = LoopPlan([*before, *phases(legs)])
parameters(legs, plan.phases)                        # of the manoeuvre in the slot "motion"
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gyrobench.system.loop_plan import LoopPhase

RATES = ("pitch", "roll", "yaw", "frequency")


@dataclass(frozen=True)
class Leg:
    """A time (s) with constant rates about the vehicle's x (right), y (forward) and z (up), rad/s.

    frequency: Hz, 0: none; else the rates are times sin(2 pi frequency s), s since the leg began.  rest: s before it.
    """

    label: str
    time: float
    pitch: float = 0.0
    roll: float = 0.0
    yaw: float = 0.0
    frequency: float = 0.0
    rest: float = 0.0

    @property
    def rate(self) -> float:
        """Size of the rate, rad/s; of a wobble its peak."""
        return float((self.pitch**2 + self.roll**2 + self.yaw**2) ** 0.5)


def phases(legs: Sequence[Leg]) -> list[LoopPhase]:
    """One phase without excitation for each leg."""
    return [LoopPhase(leg.label, settle=leg.rest, dwell=leg.time) for leg in legs]


def parameters(legs: Sequence[Leg], plan: Sequence[LoopPhase]) -> dict[str, float]:
    """The parameters of the manoeuvre in the slot motion: each leg is flown in the phase of a plan that has its label.

    A leg that the plan does not have is not flown: a plan of other phases moves the base in none of them.  They are set
    where the part has them ("?"): another part may move the base.
    """
    flown = {leg.label: leg for leg in legs}
    return {
        f"motion.{name}[{k}]?": float(getattr(flown[phase.label], name))
        for k, phase in enumerate(plan, 1)
        if phase.label in flown
        for name in RATES
    }
