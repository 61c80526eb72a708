"""Search for the numbers of a structure: the largest worst ratio of got to wanted, over all wishes and the spread.

    maximize  min over wishes i and points k of  ratio_ik(numbers)        all loops stable

A coarse look over the whole box (Sobol), also with notches at the modes and with some factors that do nothing; from
the best, far apart, differential evolution; from its best the simplex method, large and small, and sequential linear
programming of t <= ln ratio_ik, which finds the ridge where several wishes bind at once.  Over a spread the stable
controllers are small islands: one way there leads the best of the nominal plant along as the spread widens from a
point, the other evolves over the corners.  The points of the spread are the corners and some inside; what is worse
between them is added, and the search goes on (scipy; the same each time).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.frequency_response import Complex
from gyrobench.side_by_side import each
from gyrobench.tuning.plant import STICKS, Plant
from gyrobench.tuning.robustness import grid, measured
from gyrobench.tuning.sight_jitter import SightModel, SightWays
from gyrobench.tuning.structures import BLOCKS, Controller, ControllerStructure
from gyrobench.tuning.wishes import JITTER, MARGINS, Wish

LOOK = 512  # controllers of the coarse look
CROWD = 48  # controllers of the differential evolution
APART = 0.1  # of the box, that these are at first
GENERATIONS, WORK = 120, 250  # of it at most; of it times the corners of a spread
SIZES = (0.2, 0.07, 0.2, 0.07)  # of the first simplex of each start, share of the box
WIDER, WIDENED = (0.4, 0.7), 0.1  # shares of the spread on the way to it, and the first simplex at each
SIMPLEX = 150  # evaluations of one
COSTLY, COSTLY_STARTS = 64, 4  # of controllers that are computed: of each simplex, and how many there are
UNSTABLE = -10.0  # ln ratio of an unstable loop, less its growth
ROUNDING = 1e-9  # of a pole on the unit circle: an integrator that the loop does not see
HALF = (0.15, 0.3, 0.5, 0.75, 1.0, 1.35, 1.8, 2.4, 3.2, 4.5, 6.5, 10.0, 16.0, 27.0, 45.0)
ACROSS = np.array([*(-x for x in HALF), 0.0, *HALF])  # of a resonance, in half widths, for its frequencies
SHARP = 1e-5  # damping of the sharpest resonance that the frequencies follow
NEIGHBOURS, RESOLVED = 0.1, 0.01  # modes so near share their frequencies, where they are damped more
GRAZES = 0.9  # of |L| = 1
CAP = np.log(100.0)  # more than that is no better


@dataclass
class TuningProblem:
    """Wishes, and the loops that they are of.  box: decades of crossover, rad/s, and of the structure's numbers."""

    structure: ControllerStructure
    wishes: Sequence[Wish]
    plants: list[Plant]
    box: Array  # (numbers, 2)
    f: Array
    corners: int = 1  # plants at nominal values and at the corners, which come first
    evaluations: int = 0
    sights: list[SightModel] = field(default_factory=list)  # of the plants, for a jitter that is wanted
    _responses: list[Complex] = field(default_factory=list)
    _past: list[Complex] = field(default_factory=list)  # beside the controller
    _ways: list[SightWays] = field(default_factory=list)

    def of(self, count: int) -> TuningProblem:
        """Return the problem with the first plants alone."""
        return replace(
            self,
            plants=self.plants[:count],
            sights=self.sights[:count],
            evaluations=0,
            _responses=[],
            _past=[],
            _ways=[],
        )

    def narrowed(self, share: float) -> TuningProblem:
        """Return the problem with the plants moved to the nominal one, linear in their matrices; share 1: not moved."""
        plants = [self.plants[0].toward(p, share) for p in self.plants]
        return replace(self, plants=plants, evaluations=0, _responses=[], _past=[])

    def add(self, plants: Sequence[Plant], sights: Sequence[SightModel]) -> None:
        """Add points of the spread, with frequencies about their modes."""
        self.plants.extend(plants)
        self.sights.extend(sights)
        self.f = frequencies(self.plants, self.box, self.wishes)
        self._responses, self._past, self._ways = [], [], []

    def controller(self, x: Array) -> Controller:
        """Return the controller of decades x."""
        numbers = [float(v) for v in 10.0**x]
        return self.structure.controller(numbers[0], numbers[1:], self._nominal)

    def _nominal(self, f: float) -> complex:
        return complex(self.plants[0].response(np.array([f]))[0])

    def ratios(self, x: Array) -> Array:
        """Return ln ratio of each loop and wish, (plants, wishes); below UNSTABLE where a loop is not stable."""
        try:
            return self.judged(self.controller(x))
        except ArithmeticError:  # no controller of this structure for these numbers
            self.evaluations += 1
            return np.full((len(self.plants), len(self.wishes)), 100.0 * UNSTABLE)

    def responses(self) -> list[Complex]:
        """Return the responses of the plants over f."""
        while len(self._responses) < len(self.plants):
            plant = self.plants[len(self._responses)]
            self._responses.append(plant.response(self.f))
            self._past.append(plant.past(self.f))
        return self._responses

    def loops(self, response: Complex) -> Complex:
        """Return L of each plant with a controller's response over f."""
        return np.array(self.responses()) * response + np.array(self._past)

    def judged(self, controller: Controller) -> Array:
        """Return ln ratio of each loop and wish; below UNSTABLE where a loop is not stable."""
        self.evaluations += 1
        step = self.plants[0].step
        held = self.plants[0].with_controller(controller)
        shape = len(self.plants), len(self.wishes)
        growth = np.max(np.abs(held.poles(self.plants)), axis=1) - 1.0
        if np.any(growth >= ROUNDING):
            return np.full(shape, UNSTABLE - 1e3 * float(np.maximum(growth, 0.0).sum()))
        while len(self._ways) < min(len(self.sights), len(self.plants)):
            self._ways.append(self.sights[len(self._ways)].at(self.f))
        response = held.response(np.exp(2j * np.pi * self.f * step))
        loops = self.loops(response)
        got = self.measures(self.f, loops, self._ways, response)
        for i, wish in enumerate(self.wishes):
            if wish.name == "phase margin":
                got[:, i] = np.minimum(got[:, i], grazing(loops))
        with np.errstate(divide="ignore"):
            ratio = np.array([[np.log(w.ratio(g)) for w, g in zip(self.wishes, row, strict=True)] for row in got])
        return np.asarray(np.clip(ratio, -9.0, CAP))

    def measures(self, f: Array, loops: Complex, ways: Sequence[SightWays], response: Complex) -> Array:
        """Return the measures (plants, wishes) of loops over f.  response: of the controller.

        Where joints stick, margins alone count: what else is wanted is that of the joints that slip.
        """
        got = measured(self.wishes, f, loops)
        sticks = [STICKS in p.values for p in self.plants]
        for i, wish in enumerate(self.wishes):
            if wish.name == JITTER:
                got[:, i] = [way.rms(response) for way in ways]
            elif wish.name not in MARGINS:
                got[sticks, i] = got[0, i]
        return got

    def worst(self, x: Array) -> float:
        return float(self.ratios(x).min())


def grazing(loops: Complex) -> Array:
    """Return the least phase from -180 degrees, rad, at peaks of |L| from GRAZES to 1, of each loop (plants, f).

    A search that is asked for a phase margin alone holds a resonance just under 1, where no crossover is: any gain
    more, or the noise of a proof, makes one.
    """
    size = np.abs(loops)
    inner = size[:, 1:-1]
    peak = (inner > GRAZES) & (inner < 1.0) & (inner >= size[:, :-2]) & (inner >= size[:, 2:])
    return np.asarray(np.min(np.where(peak, np.abs(np.angle(-loops[:, 1:-1])), np.inf), axis=1, initial=np.inf))


def search(problem: TuningProblem) -> Array:
    """Return the decades of the best controller that was found on two ways.

    What is best at nominal values, led to the spread as that widens from a point; and what evolves over its corners.
    Without a spread two evolutions.
    """
    if problem.structure.computed:
        return _computed(problem)

    def way(k: int) -> tuple[Array, int]:
        nominal, corners = problem.of(1), problem.of(problem.corners)
        if k == 1 and problem.corners > 1:
            return descended(corners, _evolved(problem, corners)), corners.evaluations
        best = descended(nominal, _evolved(problem, nominal, 1 + k))
        if problem.corners == 1:
            return best, nominal.evaluations
        for share in WIDER:
            narrower = corners.narrowed(share)
            best = polished(narrower, best)
            best = max(best, polished(narrower, simplex_from(narrower, best, WIDENED)), key=narrower.worst)
            nominal.evaluations += narrower.evaluations
        return descended(corners, best), nominal.evaluations + corners.evaluations

    found = each(way, 2, long=True)
    problem.evaluations += sum(judged for _, judged in found)
    corners = problem.of(problem.corners)
    return polished(problem, max((x for x, _ in found), key=corners.worst))


def _evolved(problem: TuningProblem, judge: TuningProblem, seed: int = 1) -> Array:
    """Return the best of an evolution as ``judge`` has it, from the best of a coarse look at nominal values."""
    from scipy.optimize import differential_evolution
    from scipy.stats import qmc

    low, high = problem.box.T
    nominal = problem.of(1)
    cube = qmc.Sobol(len(low), scramble=True, seed=seed).random(LOOK)
    spread = low + cube * (high - low)
    notched = _notched(problem, spread[: LOOK // 2])
    looked = np.vstack([spread, notched, _neutral(problem, notched if len(notched) else spread[: LOOK // 2])])
    worst = np.array([nominal.worst(x) for x in looked])
    first: list[Array] = []
    for k in np.argsort(-worst):
        if all(np.linalg.norm((looked[k] - s) / (high - low)) > APART for s in first):
            first.append(looked[k])
        if len(first) == CROWD:
            break
    generations = min(GENERATIONS, 1 + WORK // problem.corners)
    evolved = differential_evolution(
        lambda x: -judge.worst(x), [*zip(low, high, strict=True)], init=np.array(first), maxiter=generations,
        strategy="currenttobest1bin", mutation=(0.4, 0.9), recombination=0.9, polish=False, tol=0.0, seed=seed,
    )  # fmt: skip
    judge.evaluations += nominal.evaluations
    return np.asarray(evolved.x)


def descended(problem: TuningProblem, x: Array) -> Array:
    """Return the best controller down from one by linear programs and the simplex method in turn."""
    best = polished(problem, x)
    for size in SIZES:
        best = max(best, polished(problem, simplex_from(problem, best, size)), key=problem.worst)
    return best


def _computed(problem: TuningProblem) -> Array:
    """Return the best numbers of a structure whose controllers are computed, which takes time: few are judged."""
    from scipy.stats import qmc

    low, high = problem.box.T
    corners = problem.of(problem.corners)
    spread = low + qmc.Sobol(len(low), scramble=True, seed=1).random(LOOK // 2) * (high - low)
    first = spread[np.argsort([-corners.worst(x) for x in spread])[:COSTLY_STARTS]]

    def end(k: int) -> tuple[Array, int]:
        own = problem.of(problem.corners)
        return simplex_from(own, first[k], 0.15, COSTLY), own.evaluations

    ends = each(end, len(first), long=True)
    best = polished(corners, max((x for x, _ in ends), key=corners.worst), 8)
    problem.evaluations += corners.evaluations + sum(judged for _, judged in ends)
    return best


def simplex_from(problem: TuningProblem, x: Array, size: float, most: int = SIMPLEX) -> Array:
    """Return the best controller of the simplex method from x; as descend."""
    return descend(lambda y: -problem.worst(y), x, problem.box, size, most)


def descend(cost: Callable[[Array], float], x: Array, box: Array, size: float, most: int) -> Array:
    """Return the end of the simplex method from x; size: of the first simplex, share of the box; most: evaluations."""
    from scipy.optimize import minimize

    low, high = box.T

    def refused(x: Array) -> float:
        inside = np.clip(x, low, high)
        return cost(inside) + float(np.sum(np.abs(x - inside)))

    simplex = np.clip(np.vstack([x, x + size * np.diag(high - low)]), low, high)
    for k in range(len(x)):
        if np.allclose(simplex[k + 1], x):
            simplex[k + 1, k] -= size * (high - low)[k]
    found = minimize(
        refused, x, method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": most, "xatol": 1e-3, "fatol": 1e-4},
    )  # fmt: skip
    return np.asarray(np.clip(found.x, low, high), float)


def _places(structure: ControllerStructure) -> list[tuple[str, int]]:
    """Return each factor with the place of its first number in a controller's decades."""
    at = [1 + sum(len(BLOCKS[b].ranges) for b in structure.blocks[:k]) for k in range(len(structure.blocks))]
    return [*zip(structure.blocks, at, strict=True)]


def _neutral(problem: TuningProblem, spread: Array) -> Array:
    """Return controllers some of whose factors do nothing: a structure is never worse than one with less in it."""
    moved = spread.copy()
    rows = np.arange(len(moved))
    for j, (block, at) in enumerate(_places(problem.structure)):
        number, decade = BLOCKS[block].neutral
        moved[(rows >> j) % 2 == 1, at + number] = decade
    return moved


def _notched(problem: TuningProblem, spread: Array) -> Array:
    """Return the controllers with their notches at the modes of the plant, where both are: few of a box have that."""
    modes = problem.plants[0].modes()
    places = [at for block, at in _places(problem.structure) if block == "notch"]
    moved = spread.copy()
    for place, mode in zip(places, modes, strict=False):
        low, high = problem.box[place]
        moved[:, place] = np.clip(np.log10(abs(mode)) - moved[:, 0], low, high)
    return moved if places and modes else moved[:0]


def polished(problem: TuningProblem, x: Array, rounds: int = 40) -> Array:
    """Return a better x near one: trust region steps of linear programs in t <= ln ratio_ik + gradient dx."""
    from scipy.optimize import linprog

    low, high = problem.box.T
    radius, best = 0.05, problem.ratios(x)
    for _ in range(rounds):
        if radius < 2e-4:
            break
        near = best.ravel() < best.min() + 0.5
        slopes = []
        for k in range(len(x)):
            h = 1e-4 if x[k] + 1e-4 <= high[k] else -1e-4
            moved = x.copy()
            moved[k] += h
            slopes.append((problem.ratios(moved).ravel() - best.ravel())[near] / h)
        g = np.array(slopes).T
        if not np.all(np.abs(g) < 1e4):
            break  # at the limit of stability
        bounds = [(max(lo - xi, -radius), min(hi - xi, radius)) for lo, hi, xi in zip(low, high, x, strict=True)]
        answer = linprog(
            [*np.zeros(len(x)), -1.0], A_ub=np.hstack([-g, np.ones((len(g), 1))]), b_ub=best.ravel()[near],
            bounds=[*bounds, (None, None)],
        )  # fmt: skip
        if answer.status != 0:
            break
        tried = x + answer.x[:-1]
        after = problem.ratios(tried)
        if after.min() > best.min() + 1e-6:
            x, best, radius = tried, after, min(2.0 * radius, 0.3)
        else:
            radius *= 0.35
    return x


def box(structure: ControllerStructure, wishes: Sequence[Wish], wanted: float | None, step: float) -> Array:
    """Return the decades of crossover (rad/s) and of the structure's numbers.  wanted: Hz, of the system's design."""
    top = 0.2 / step
    widths = [w.value for w in wishes if w.name == "bandwidth"]
    if widths:
        ends = 0.3 * widths[0], min(20.0 * widths[0], top)
    elif wanted:
        ends = wanted / 30.0, min(30.0 * wanted, top)
    else:
        ends = 1e-5 / step, top
    return np.array([np.log10(2.0 * np.pi * np.array([min(ends[0], 0.5 * ends[1]), ends[1]])), *structure.ranges])


def frequencies(
    plants: Sequence[Plant], decades: Array, wishes: Sequence[Wish], count: int = 400, closed: Sequence[complex] = ()
) -> Array:  # fmt: skip
    """Return the grid for the loops of these plants, closer about modes.  closed: those of the closed loops."""
    apart: list[complex] = []
    for m in sorted([*(m for p in plants for m in p.modes()), *closed], key=abs):
        wide = NEIGHBOURS if not apart or min(damping(m), damping(apart[-1])) > RESOLVED else 0.3 * damping(m)
        if not apart or abs(m) > (1.0 + wide) * abs(apart[-1]):
            apart.append(m)
    low = float(10.0 ** decades[0, 0] / (2.0 * np.pi))
    hertz = [abs(m) / (2.0 * np.pi) for m in apart]
    own = [w.f for w in wishes if w.f]
    found = grid(plants[0].step, min([low, *own]), hertz, count)
    # a resonance that a search pushes under 1 must not rise between two frequencies
    peaks = np.ravel([x * (1.0 + damping(m) * ACROSS) for m, x in zip(apart, hertz, strict=True)])
    return np.unique(np.concatenate([found, peaks[(peaks > found[0]) & (peaks < found[-1])], own]))


def damping(mode: complex) -> float:
    """Return the damping ratio of a pole in the s plane, at least SHARP."""
    return max(-mode.real / abs(mode), SHARP)
