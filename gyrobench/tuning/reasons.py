"""Why what is wanted of a loop cannot be had: which wish limits, what each gives alone, what delay and modes cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from gyrobench.arrays import Array
from gyrobench.errors import GyrobenchError
from gyrobench.record.frequency_response import Complex
from gyrobench.reduction.loops.wanted_measure import FACTOR
from gyrobench.side_by_side import each
from gyrobench.tuning.controller_search import TuningProblem, descended, frequencies, polished
from gyrobench.tuning.plant import Plant
from gyrobench.tuning.robustness import crossovers, gain_limits
from gyrobench.tuning.tuned_loop import WishResult
from gyrobench.tuning.wishes import JITTER

BINDS = 0.02  # of the worst ratio: wishes so near to it bind too
FINER = 8  # of the communication step, for what the step costs
SLOWER = 1.5  # decades of the crossover below what all wishes together leave
NEAR = 1.35  # factor of frequency within which a mode limits


class Loop(Protocol):
    """Source of the plants at points of the spread and with another step."""

    step: float

    def plants(self, at: Sequence[Any], step: float | None = None) -> list[Plant]:
        """Return the plants."""


def reasons_of(
    loop: Loop, problem: TuningProblem, x: Array, results: Sequence[WishResult], f: Array, loops: Complex
) -> list[str]:  # fmt: skip
    """Return the sentences, the limiting wishes first."""
    worst = min(r.ratio for r in results)
    binding = [r for r in results if r.ratio <= worst * (1.0 + BINDS)]
    names = " and ".join(r.wish.name for r in binding)
    reached = ", ".join(r.wish.shown(r.worst) for r in binding)
    by_factor = "; gains count as factors" if any(r.wish.unit == FACTOR for r in binding) else ""
    found = [f"{names} bind{'s' if len(binding) == 1 else ''}: the best compromise reaches {100.0 * worst:.3g} % of "
             f"what is wanted of {'it' if len(binding) == 1 else 'each'} ({reached}{by_factor})"]  # fmt: skip
    found += each(lambda k: _alone(problem, x, binding[k]), len(binding[:3]), long=True)
    at = dict(binding[0].at)
    k = next(k for k, p in enumerate(problem.plants) if dict(p.values) == at)
    crossed = max((c[0] for c in crossovers(f, loops[k])), default=None)
    found += _jitter(problem, x, k, [r for r in results if r.wish.name == JITTER])
    found += _bode(f, loops[k], results)
    if crossed is not None:
        found += _delay(loop, at, problem.plants[k], crossed)
        found += _modes(problem.plants[k], f, loops[k], crossed, "notch" in problem.structure.blocks)
    return found


def _alone(problem: TuningProblem, x: Array, result: WishResult) -> str:
    """Return what was found from x on where only this wish, and stability, counts: as slow a loop as it likes."""
    decades = problem.box.copy()
    decades[0, 0] -= SLOWER
    one = replace(problem, wishes=[result.wish], box=decades).of(len(problem.plants))
    one.f = frequencies(one.plants, decades, one.wishes)
    best = max(result.ratio, float(np.exp(one.worst(polished(one, descended(one.of(one.corners), x))))))
    if best > 99.0:
        return f"{result.wish.name} alone: 100 times what is wanted, or more"
    value = result.wish.value * best if result.wish.least else result.wish.value / best
    beyond = "" if best >= 1.0 else f"no {'more' if result.wish.least else 'less'} than "
    return f"{result.wish.name} alone: {beyond}{result.wish.shown(value)} was found"


def _jitter(problem: TuningProblem, x: Array, k: int, wanted: Sequence[WishResult]) -> list[str]:
    """Return what each source makes of the jitter, where one is wanted and not reached."""
    if not any(r.ratio < 1.0 for r in wanted):
        return []
    response = problem.plants[k].controller_response(problem.controller(x), problem.f)
    ways = problem.sights[k].at(problem.f)
    sources, floor = ways.sources(response), ways.floor()
    parts = sorted(((v, n) for n, v in sources.items() if v > 0.0), reverse=True)
    wish = next(r.wish for r in wanted)
    end = ": what is wanted is below it" if floor > wish.value else ""
    return [
        f"the jitter is of {', '.join(f'{n} {1e6 * v:.3g} µrad' for v, n in parts[:3])}",
        f"no linear controller of this loop, of any structure, comes below {1e6 * floor:.3g} µrad with this base and "
        f"this sensor{end}",
    ]


def _bode(f: Array, L: Complex, wanted: Sequence[WishResult]) -> list[str]:
    """Return what a wanted bandwidth takes of ln |S|, and what Bode's integral makes it give back.

    int ln |S| df up to half the frequency of the steps is 0, or more with unstable poles of the open loop, for a loop
    with a delay of a step (Sung 1988).  |S| = f/sqrt(f2 + b2) up to b takes b (pi/4 + ln(2)/2).
    """
    width = next((r.wish.value for r in wanted if r.wish.name == "bandwidth"), 0.0)
    rise = np.maximum(-np.log(np.abs(1.0 + L)), 0.0)
    steps = 0.5 * (rise[1:] + rise[:-1]) * np.diff(f)
    total = float(steps.sum())
    if not width or not total > 0.0:
        return []
    area = width * (0.25 * np.pi + 0.5 * np.log(2.0))
    share = np.cumsum(steps) / total
    low, high = (float(f[1:][np.searchsorted(share, q)]) for q in (0.05, 0.9))
    if not high > 1.05 * low:
        return []
    least = 20.0 / np.log(10.0) * area / (high - low)
    return [
        f"by Bode's integral a bandwidth of {width:.4g} Hz takes {area:.3g} Hz from ln |S|, which comes back above "
        f"0 dB: evenly between {low:.3g} and {high:.3g} Hz, where the best loop gives it back, that is a peak of |S| "
        f"of {least:.2g} dB; the best loop has {20.0 / np.log(10.0) * float(rise.max()):.2g} dB"
    ]


def _delay(loop: Loop, at: Any, plant: Plant, crossed: float) -> list[str]:
    """Return what the communication step and the wires that wait for it cost in phase at the crossover."""
    try:
        finer = loop.plants([at], loop.step / FINER)[0]
    except GyrobenchError:
        return []
    ratio = plant.response(np.array([crossed])) / finer.response(np.array([crossed]))
    cost = -np.degrees(np.angle(ratio[0])) * FINER / (FINER - 1.0)
    if cost < 1.0:
        return []
    return [
        f"at the crossover of {crossed:.3g} Hz the plant has lost {cost:.2g}° to the communication step of "
        f"{loop.step:g} s and the wires that wait for it"
    ]


def _modes(plant: Plant, f: Array, L: Complex, crossed: float, notched: bool) -> list[str]:
    """Return the bending modes at which the loop comes near to its limit; notched: the structure has a notch."""
    at = [x for x, g in gain_limits(f, L) if g > 1.0] + [float(f[np.argmax(np.abs(1.0 / (1.0 + L) - 0.5))])]
    found = []
    for mode in plant.modes():
        hz = abs(mode) / (2.0 * np.pi)
        if any(1.0 / NEAR < hz / x < NEAR for x in at) and hz > 0.5 * crossed:
            damping = -mode.real / abs(mode)
            way = ", with the notch of this structure, too" if notched else ": try a notch there"
            found.append(f"a mode at {hz:.3g} Hz with a damping of {damping:.2g} limits the loop{way}")
    return found[:2]
