"""Notes on a tuned loop beside its figures: what a spread does not move, friction, limits, what was lost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.frequency_response import Complex
from gyrobench.system.line_of_sight import LineOfSight
from gyrobench.tuning.controller_search import TuningProblem
from gyrobench.tuning.loop_ports import LoopPorts
from gyrobench.tuning.plant import without_friction
from gyrobench.tuning.proof import Proof, known_limit
from gyrobench.tuning.robustness import crossovers
from gyrobench.tuning.sight_allowance import PEAK
from gyrobench.tuning.sight_jitter import SightWays
from gyrobench.tuning.spread import Range
from gyrobench.tuning.wishes import JITTER, Wish


def idle(problem: TuningProblem, ranges: Sequence[Range]) -> list[str]:
    """Return which parameters of the spread do nothing to the loop by the linear model; none where a jitter counts."""
    found = []
    if not problem.sights:
        corners = problem.responses()[1 : 1 + 2 ** len(ranges)]
        for j, r in enumerate(ranges):
            bit = 1 << (len(ranges) - 1 - j)  # of a corner's number
            if all(np.array_equal(corners[k], corners[k | bit]) for k in range(len(corners)) if not k & bit):
                found.append(f"{r.name} does nothing to the linear loop: its spread changes none of the margins")
    return found


def slips(sources: LineOfSight | None) -> list[str]:
    """Return how dry friction is in the search, where it slips in the ride."""
    if sources is None or not sources.slipping:
        return []
    return [
        "dry friction slips in the ride: margins are searched without it, the jitter with viscous friction that makes "
        "torques as large there; its reversals are in the co-simulation alone"
    ]


def driven(ways: Sequence[SightWays], G: Complex, nominal: Mapping[str, Any], ports: LoopPorts) -> list[str]:
    """Return that what moves the line of sight alone takes the controller's output to its limit, where it does."""
    limit = known_limit(nominal, ports)
    volts = max((w.voltage(G) for w in ways), default=0.0)
    if PEAK * volts < limit:
        return []
    return [
        f"base, target and noise take {volts:.2g} V rms by the linear model, and the limit of {ports.slot} is "
        f"{limit:.3g} V: their peaks are cut, and the jitter is more than the linear model says"
    ]


def of_proofs(proofs: Sequence[Proof]) -> list[str]:
    """Return what the co-simulation met: friction, noise, limits, a lost target."""
    notes = []
    for p in proofs:
        if p.friction and not all(w.agrees for w in p.wishes):
            notes.append(
                f"the friction ({p.friction}) sticks for a part of a test sine and slips in another: the loop at its "
                "amplitude is neither linear model (describing function)"
            )
            break
    if untold := list(dict.fromkeys(w.wish.name for p in proofs for w in p.wishes if not w.told)):
        notes.append(
            f"the co-simulation does not tell {' and '.join(untold)}: the test sines stand too little above what else "
            "moves the loop. Less noise in the parts (gyro, images, base) would tell, or a larger limit, which lets "
            "larger sines through"
        )
    if any(p.limits for p in proofs):
        notes.append("a part was at its limit in the test sines: what was measured there is not linear")
    if lost := max((p.lost for p in proofs), default=0.0):
        notes.append(
            f"the target was lost in {100.0 * lost:.2g} % of the ride: the loop was open then, and the jitter is none "
            "of a tracker that sees; want more bandwidth, or widen the field"
        )
    return notes


def states(sticks: bool, nominal: Mapping[str, Any]) -> list[str]:
    """Return how dry friction is in the search, where margins are judged with joints that stick and that slip."""
    if not sticks:
        return []
    return [
        f"dry friction ({', '.join(without_friction(nominal))}): margins hold for joints that slip and, as elastic "
        "contacts, for joints that stick; every other wish is of joints that slip"
    ]


def slower(wishes: Sequence[Wish], f: Array, L: Complex) -> list[str]:
    """Return that a loop is slower than the jitter that is all it was wanted for.  L: at nominal values over f."""
    lowest = next((w.f for w in wishes if w.name == JITTER), 0.0)
    if not lowest or any(w.name == "bandwidth" or w.f for w in wishes if w.name != JITTER):
        return []
    at = max((c[0] for c in crossovers(f, L)), default=0.0)
    if at >= lowest:
        return []
    where = f"crosses at {at:.2g} Hz" if at else "does not cross |L| = 1"
    return [
        f"the loop {where}, below the {lowest:g} Hz from which the jitter counts: the inertia alone keeps it small, "
        'and nothing wanted holds slower motion or a load; want what else the loop is for, "bandwidth>2Hz"'
    ]
