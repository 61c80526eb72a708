"""The price of effort: of what a controller does better than wanted, half is given away for less noise at the motor.

    minimize  rms of |G / (1 + L)| up to half the frequency of the steps      worst over the spread
    subject to  worst ln ratio >= KEPT times that of the best controller

A wish alone that more gain serves (a bandwidth) would else be answered by all the gain that the structure has.  What is
wanted stays fulfilled.  Noise of the signal is taken for white: V/rad times rad.  Source: Skogestad 2005, 2.4.5 and 9.3
(size of K S).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.tuning.controller_search import TuningProblem, descend
from gyrobench.tuning.structures import Controller
from gyrobench.tuning.wishes import JITTER

KEPT = 0.5  # of ln ratio
SURPLUS = 0.02  # ln ratio: less of it is not given away
PRICE = 30.0  # of ln ratio that is missing, in ln rms
SIZES = (0.25, 0.1, 0.05)  # of the first simplex, share of the box
SIMPLEX = 200  # evaluations of one
WORTH = 1.1  # times less noise: for less the best controller stays


@dataclass(frozen=True)
class Quieting:
    """ratio: worst of got to wanted of the best controller; less: its noise at the motor over that of this one."""

    x: Array
    ratio: float
    less: float


def effort(problem: TuningProblem, controller: Controller) -> float:
    """Return the rms of |G / (1 + L)| over frequency, the largest of the spread."""
    response = problem.plants[0].controller_response(controller, problem.f)
    found = 0.0
    for loop in problem.loops(response):
        density = np.abs(response / (1.0 + loop)) ** 2
        found = max(found, float(np.trapezoid(density, problem.f) / problem.f[-1]))
    return float(np.sqrt(found))


def quieted(problem: TuningProblem, x: Array) -> Quieting | None:
    """Return the controller with less noise, from the best one; None where nothing is to be given away.

    Computed structures have a price of the voltage of their own, and a jitter holds the noise already.
    """
    best = problem.worst(x)
    if best < SURPLUS or problem.structure.computed or any(w.name == JITTER for w in problem.wishes):
        return None
    corners = problem.of(problem.corners)
    loud = effort(problem, problem.controller(x))

    def cost(y: Array) -> float:
        lacking = max(KEPT * best - corners.worst(y), 0.0)
        if lacking > KEPT * best:  # a wish is missed, or the loop is not stable
            return PRICE * lacking
        return PRICE * lacking + float(np.log(effort(corners, problem.controller(y)) / loud))

    now = np.asarray(x, float)
    for size in SIZES:
        now = descend(cost, now, problem.box, size, SIMPLEX)
    problem.evaluations += corners.evaluations
    less = loud / effort(problem, problem.controller(now))
    if less < WORTH or problem.worst(now) < 0.0:
        return None
    return Quieting(now, float(np.exp(best)), less)


def about(found: Quieting | None) -> list[str]:
    """Return what was given away for less noise at the motor."""
    if found is None:
        return []
    return [
        f"the controller with the most reserve meets every wish by a factor of {found.ratio:.3g} and passes "
        f"{found.less:.3g} times as much noise of the sensor to the motor; half of its reserve was given up for quiet: "
        "where it is needed, want more"
    ]
