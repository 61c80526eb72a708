"""Exact plans: which candidates are visited, in which order, how long each, so that what is wanted is reached soonest.

The shares of the approximate design are rounded to whole visits for several numbers of visits, ordered by short moves
in rounds, and improved by exchange: a visit is replaced, removed, moved, made longer or shorter, a stretch is reversed.
Each plan is judged by generalized least squares with its real times: under correlated noise gaps, order and length
count.  Not global: the bound of the approximate design says how much a better plan could save at most.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.design.approximate_design import ApproximateDesign, approximate_design, evaluate
from gyrobench.design.predicted_uncertainty import effective
from gyrobench.design.visit_protocol import DataNoise, VisitProtocol

LONGEST = 1e7  # s, beyond which a wanted uncertainty is not reached
EXCHANGES = 400  # plans tried of each number of visits
ROUNDS = 3  # of replacing each visit
FAINT = 1e-4  # of the noise over the shortest dwell: white noise that sets no least time
FEW = 30  # visits up to which each is replaced by the best candidate; shares of more are rounded well


@dataclass(frozen=True)
class Want:
    """Standard uncertainty wanted of a value of a channel, SI.  inflation: what the reduction makes of the least u;
    type_b: what it adds to it.
    """

    channel: int
    row: int  # of the channel's map
    u: float
    inflation: float = 1.0
    type_b: float = 0.0

    @property
    def rest(self) -> float:
        """Return the least u of type A that is enough; not above 0 where type B alone is more than is wanted."""
        return math.sqrt(max(self.u**2 - self.type_b**2, 0.0)) / self.inflation


@dataclass(frozen=True)
class Search:
    """Protocol, wants and criterion.  instruments: noise of each channel, of one instrument or several of a population,
    for the worst of which the plan is made.  asked: number of wants that criterion A is the mean of; the others only
    keep the rest of the unknowns within bounds.
    """

    protocol: VisitProtocol
    wants: tuple[Want, ...]
    instruments: tuple[tuple[DataNoise, ...], ...]
    criterion: str = "minimax"
    asked: int = 1
    _maps: dict[int, Array] = field(default_factory=dict)

    def wanted(self, channel: int) -> Array:
        """Return the rows (k, p) of a channel's wanted values, over the u that is enough."""
        if channel not in self._maps:
            rows = [self.protocol.channels[channel].map[w.row] / w.rest for w in self.wants if w.channel == channel]
            p = self.protocol.channels[channel].rows.shape[1]
            self._maps[channel] = np.array(rows).reshape(len(rows), p)
        return self._maps[channel]

    def _white(self, noises: Sequence[DataNoise], dwell: float | None) -> tuple[Array, Array]:
        """Return information (m, p, p) of a second at each candidate under white noise, and the wanted rows (q, p)."""
        total = sum(c.rows.shape[1] for c in self.protocol.channels)
        M, wanted, at = np.zeros((len(self.protocol.labels), total, total)), [], 0
        for k, c in enumerate(self.protocol.channels):
            own = slice(at, at + c.rows.shape[1])
            density = effective(noises[k], self.protocol.least if dwell is None else dwell)
            if dwell is None:  # drift without white noise sets no least time: as good as none, though not none
                density = max(noises[k].white, FAINT * density)
            M[:, own, own] = np.einsum("mi,mj->mij", c.rows, c.rows) / density**2
            rows = np.zeros((len(self.wanted(k)), total))
            rows[:, own] = self.wanted(k)
            wanted.append(rows)
            at = own.stop
        return M, np.vstack(wanted)

    def approximate(self, noises: Sequence[DataNoise], dwell: float | None = None) -> ApproximateDesign:
        """Return the best shares of the time under white noise: of the white part, or of all noise over a dwell (s)."""
        return approximate_design(*self._white(noises, dwell), self.criterion)

    def value_of(self, shares: Array) -> float:
        """Return the criterion of shares (m,) of one second under the white part of the noise.

        Raises SingularDesignError.
        """
        phi, _, v = evaluate(*self._white(self.instruments[0], None), shares, self.criterion)
        return float(v.max()) if self.criterion == "minimax" else phi

    def merit(self, places: Sequence[int], dwells: Array) -> float:
        """Return what is to be at most 1: the criterion of (u/wanted)^2, of the worst instrument; inf where a wanted
        value is not determined.
        """
        t0, t1 = self.protocol.times(places, dwells)
        index = np.asarray(places)
        return max(self._merit(index, t0, t1, noises) for noises in self.instruments)

    def _merit(self, index: NDArray[np.int_], t0: Array, t1: Array, noises: Sequence[DataNoise]) -> float:
        squares: list[float] = []
        logdet, count = 0.0, 0
        for k, c in enumerate(self.protocol.channels):
            wanted = self.wanted(k)
            if not len(wanted):
                continue
            repeat = np.broadcast_to(c.repeat, (len(c.rows),))[index]
            X = c.rows[index]
            if noises[k].markov > 0.0:
                L = np.linalg.cholesky(noises[k].covariance(t0, t1, repeat))
                Z = np.linalg.solve(L, X)
            else:
                Z = X / np.sqrt(noises[k].white ** 2 / (t1 - t0) + repeat**2)[:, None]
            M = Z.T @ Z
            size = np.sqrt(np.maximum(np.diag(M), 1e-300))
            values, vectors = np.linalg.eigh(M / np.outer(size, size))
            if values[0] < 1e-10 * values[-1]:
                return math.inf
            V = (wanted / size) @ (vectors / values) @ ((wanted / size) @ vectors).T
            squares += np.diag(V).tolist()
            logdet += float(np.linalg.slogdet(V)[1])
            count += len(V)
        if self.criterion == "minimax":
            return max(squares)
        return sum(squares) / self.asked if self.criterion == "A" else math.exp(logdet / count)

    def duration(self, places: Sequence[int], dwells: Array) -> float:
        return float(self.protocol.times(places, dwells)[1][-1])


@dataclass(frozen=True)
class ExactPlan:
    """Visits with shares of the dwell (mean 1), mean dwell (s), duration (s), and the criterion that it reaches."""

    places: tuple[int, ...]
    weights: Array
    dwell: float
    duration: float
    merit: float

    @property
    def visits(self) -> list[tuple[int, float]]:
        return [(p, float(d)) for p, d in zip(self.places, self.dwell * self.weights, strict=True)]

    def cost(self, timed: bool) -> float:
        return self.merit if timed else self.duration


def finish(search: Search, places: Sequence[int], weights: Array, time: float | None) -> ExactPlan:
    """Return the plan of these visits that takes ``time``, or that reaches what is wanted soonest; inf where it is
    not to be reached.
    """
    weights = np.asarray(weights, dtype=float)
    weights = weights / weights.mean()
    least = search.protocol.least / float(weights.min())

    def at(dwell: float) -> float:
        return search.merit(places, dwell * weights)

    if time is not None:
        lost = search.duration(places, np.zeros(len(places)))
        dwell = (time - lost) / len(places)
        if dwell < least:
            return ExactPlan(tuple(places), weights, math.nan, math.inf, math.inf)
        return ExactPlan(tuple(places), weights, dwell, time, at(dwell))
    low, high = least, least
    value = at(low)
    if not math.isfinite(value):
        return ExactPlan(tuple(places), weights, math.nan, math.inf, value)
    if value > 1.0:
        while value > 1.0 and high < LONGEST:
            low, high = high, high * max(2.0, 1.2 * value) if value < 50.0 else high * 10.0
            value = at(high)
        if value > 1.0:
            return ExactPlan(tuple(places), weights, math.nan, math.inf, value)
        for _ in range(30):
            middle = math.sqrt(low * high)
            value = at(middle)
            low, high = (middle, high) if value > 1.0 else (low, middle)
            if high < low * 1.0005:
                break
    return with_dwell(search, places, weights, high)


def with_dwell(search: Search, places: Sequence[int], weights: Array, dwell: float) -> ExactPlan:
    """Return the plan of these visits with a mean dwell, s."""
    dwells = dwell * weights
    return ExactPlan(tuple(places), weights, dwell, search.duration(places, dwells), search.merit(places, dwells))


def rounded(shares: Array, visits: int, required: Sequence[int] = ()) -> NDArray[np.int_]:
    """Return whole numbers of visits (m,) of this sum, in proportion to the shares [Pukelsheim 1993, ch. 12]."""
    want = shares.copy()
    want[list(required)] = np.maximum(want[list(required)], 1e-6)
    support = np.flatnonzero(want > 0.0)
    if support.size > visits:
        kept = set(np.argsort(-want)[: visits - len(required)].tolist()) | set(required)
        support = np.array(sorted(kept))
    w = want[support] / want[support].sum()
    n = np.maximum(np.ceil((visits - 0.5 * support.size) * w), 1).astype(int)
    while n.sum() > visits:
        n[int(np.argmax((n - 1) / w))] -= 1
    while n.sum() < visits:
        n[int(np.argmin(n / w))] += 1
    out = np.zeros(shares.size, dtype=int)
    out[support] = n
    return out


def in_rounds(search: Search, numbers: NDArray[np.int_]) -> list[int]:
    """Return the visits in rounds, each a walk to the nearest place not yet visited in it."""
    order: list[int] = []
    left = numbers.copy()
    while left.any():
        todo = np.flatnonzero(left).tolist()
        left[todo] -= 1
        while todo:
            before = order[-1] if order else None
            order.append(min(todo, key=lambda j: search.protocol.move(before, j)))
            todo.remove(order[-1])
    return order


def search_plan(search: Search, design: ApproximateDesign, visits: int, time: float | None) -> ExactPlan:
    """Return the best plan found with about this many visits."""
    timed = time is not None
    numbers = rounded(np.where(design.shares > 1e-3, design.shares, 0.0), visits, search.protocol.required)
    places = in_rounds(search, numbers)
    share = np.maximum(design.shares, 1e-3)
    weights = np.array([share[j] / numbers[j] for j in places])
    weights = np.clip(weights / weights.mean(), 0.2, 5.0)
    starts = [(places, weights), (places, np.ones(len(places)))]
    if len(places) <= FEW:
        alike = in_rounds(search, np.bincount(_replaced(search, design, places), minlength=numbers.size))
        starts.append((alike, np.ones(len(alike))))
    best = min((finish(search, p, w, time) for p, w in starts), key=lambda p: p.cost(timed))
    return exchanged(search, design, best, time)


def _tempting(design: ApproximateDesign) -> NDArray[np.int_]:
    """Return the candidates that an exchange may bring in: those with shares and those next to have some."""
    number = max(12, int(np.sum(design.shares > 1e-3)))
    return np.unique([*np.argsort(-design.gradient)[:number], *np.argsort(-design.shares)[:number]])


def _replaced(search: Search, design: ApproximateDesign, places: Sequence[int]) -> list[int]:
    """Return the visits after each in turn was replaced by the best candidate, all of one dwell [Fedorov 1972]."""
    places, tempting, rng = list(places), _tempting(design), np.random.default_rng(0)
    dwells = np.full(len(places), 10.0 * search.protocol.least + search.protocol.settle)
    value = search.merit(places, dwells)
    chances = design.shares[tempting] + 1e-3
    for _ in range(200):
        if math.isfinite(value):
            break
        free = rng.choice(tempting, len(places) - len(search.protocol.required), p=chances / chances.sum())
        places = [*search.protocol.required, *free.tolist()]
        value = search.merit(places, dwells)
    for _ in range(ROUNDS):
        before = value
        for i in range(len(places)):
            if places[i] in search.protocol.required and places.count(places[i]) == 1:
                continue
            for j in tempting.tolist():
                tried = [*places[:i], j, *places[i + 1 :]]
                if (one := search.merit(tried, dwells)) < value * (1.0 - 1e-9):
                    places, value = tried, one
        if not value < before * 0.995:
            break
    return places


def exchanged(search: Search, design: ApproximateDesign, plan: ExactPlan, time: float | None) -> ExactPlan:
    """Return a plan after :data:`EXCHANGES` changes were tried, each kept where it is better."""
    timed, rng = time is not None, np.random.default_rng(len(plan.places))
    tempting = _tempting(design)
    required = set(search.protocol.required)
    for _ in range(EXCHANGES):
        n = len(plan.places)
        places, weights = list(plan.places), plan.weights.copy()
        i, kind = int(rng.integers(n)), int(rng.integers(6))
        fixed = plan.places[i] in required and plan.places.count(plan.places[i]) == 1
        if kind == 0 and not fixed:
            places[i] = int(rng.choice(tempting))
        elif kind == 1 and not fixed and n > 2:
            del places[i]
            weights = np.delete(weights, i)
        elif kind == 2:
            weights[i] *= float(rng.choice([0.7, 1.4]))
        elif kind == 3 and n > 2:
            j = int(rng.integers(n))
            i, j = min(i, j), max(i, j) + 1
            places[i:j] = places[i:j][::-1]
            weights[i:j] = weights[i:j][::-1]
        elif kind == 4 and n > 2:
            j = int(rng.integers(n - 1))
            moved, w = places.pop(i), weights[i]
            places.insert(j, moved)
            weights = np.insert(np.delete(weights, i), j, w)
        elif n < search.protocol.most:
            places.insert(i, int(rng.choice(tempting)))
            weights = np.insert(weights, i, 1.0)
        if weights.max() > 10.0 * weights.min():
            continue
        if np.isfinite(plan.dwell):  # as long as the plan: is it better?  Only then its own time is sought
            dwells = plan.dwell * weights * (plan.weights.sum() / weights.sum())
            spare = plan.duration - search.duration(places, dwells)
            dwells = dwells * (1.0 + spare / dwells.sum())
            if dwells.min() < search.protocol.least or search.merit(places, dwells) >= plan.merit * (1.0 - 1e-6):
                continue
        tried = finish(search, places, weights, time)
        if tried.cost(timed) < plan.cost(timed) * (1.0 - 1e-6):
            plan = tried
    return plan


def shortest_time(search: Search, noises: Sequence[DataNoise]) -> tuple[float, ApproximateDesign]:
    """Return a time (s) below which no plan reaches what is wanted, and its design.  The fewest visits settle in it.

    The noise is taken as its white part and moves as none: both make a plan shorter than it can be.
    """
    design = search.approximate(noises)
    fewest = max(int(np.linalg.matrix_rank(search.wanted(k))) for k in range(len(search.protocol.channels)))
    reading = design.bound / (search.asked if search.criterion == "A" else 1)
    return reading + fewest * search.protocol.settle, design


def book_plan(search: Search, time: float | None) -> ExactPlan:
    """Return the system's own plan, its dwell lengthened or shortened or the plan repeated, whichever is sooner."""
    places = [j for j, _ in search.protocol.book]
    weights = np.array([t for _, t in search.protocol.book])
    repeats = range(1, max(1, search.protocol.most // len(places)) + 1)
    plans = [finish(search, places * k, np.tile(weights, k), time) for k in repeats]
    return min(plans, key=lambda p: p.cost(time is not None))


def numbers_of_visits(search: Search) -> list[int]:
    """Return the numbers of visits that are tried."""
    p = max(c.rows.shape[1] for c in search.protocol.channels)
    least = max(p, len(search.protocol.required))
    tried = {least, least + 2, least + 4, round(1.6 * least) + 2, 2 * least + 2, 3 * least, 5 * least}
    return sorted({min(n, search.protocol.most) for n in tried})


def determined(search: Search, wants: Mapping[str, Want]) -> list[str]:
    """Return the wanted values that no plan of this test determines."""
    lost = []
    for name, w in wants.items():
        rows = search.protocol.channels[w.channel].rows
        c = search.protocol.channels[w.channel].map[w.row]
        scale = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        basis = np.linalg.svd(rows / scale, full_matrices=False)
        kept = basis[2][basis[1] > 1e-9 * basis[1][0]]
        if np.linalg.norm(c / scale - kept.T @ (kept @ (c / scale))) > 1e-6 * np.linalg.norm(c / scale):
            lost.append(name)
    return lost
