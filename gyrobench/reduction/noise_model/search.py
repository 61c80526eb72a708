"""Search of the noise model: the models worth averaging."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.filter_starts import (
    AFTER_FIRST,
    BEHIND,
    FIRST,
    GM,
    SHAPES,
    SIMPLE,
    SLOWEST_POLE,
    STARTS,
    TWICE,
    WHOLE,
    B,
    K,
    N,
    Q,
    W,
    means_beside,
    misnamed,
)
from gyrobench.reduction.noise_model.maximum import Fitted, maximize, nearly_whole
from gyrobench.reduction.noise_model.ordinates import Model, Ordinates, joined, passed, split
from gyrobench.reduction.noise_model.prior import SHORTEST_TAU, Prior
from gyrobench.reduction.noise_model.sensor_filters import ALL, DIGITAL, MEANS, samples_of
from gyrobench.reduction.noise_model.terms import PEAKS, SLOW, NoiseTerm

MOST_MARKOV, MOST_RESONANCES = 3, 24
NEARLY = 6.0  # of the logarithm of the evidence
MOST_VAIN = 6  # places where none is found
HELD_BACK = 0.3  # of the spectrum, just below half the sampling rate: what a low-pass passes there at most
COHERENT = 10.0  # samples: a band that keeps its phase for less may be what the broadband terms lack
WIDTHS = (1, 2, 4, 8, 16, 32)  # bins that a resonance may span
CLEAR = 1e-4  # probability of so large an excess of power anywhere in a record without resonance
WEAK = 2  # bands that may be, though nothing shows them


def canonical(model: Model, p: Array) -> tuple[Model, Array]:
    """Return terms in a fixed order, Gauss-Markov processes by their tau."""
    order = ("white", "readout", "quantization", "gauss_markov", "flicker", "walk", *PEAKS)
    parts = sorted(split(model, p), key=lambda t: (order.index(t[0].name), t[1][1] if t[1].size > 1 else 0.0))
    return tuple(t for t, _ in parts), np.concatenate([q for _, q in parts])


@dataclass
class ModelSearch:
    """Models that were tried, by their terms; resonances are frozen in the spectrum of the data."""

    data: Ordinates
    prior: Prior
    seen: dict[Model, Fitted] = field(default_factory=dict)
    resonances: list[tuple[NoiseTerm, Array]] = field(default_factory=list)

    def fit(self, model: Model, start: Array) -> Fitted:
        """Fit a model from a start and keep the best of its fits."""
        model, start = canonical(model, start)
        found = maximize(self.data, self.prior, model, start)
        if misnamed(found, self.prior):
            found = replace(found, evidence=found.evidence - 100.0)
        if model not in self.seen or found.evidence > self.seen[model].evidence:
            self.seen[model] = found
        return self.seen[model]

    @property
    def best(self) -> Fitted:
        return max(self.seen.values(), key=lambda f: f.evidence)

    @property
    def ranked(self) -> list[Fitted]:
        return sorted(self.seen.values(), key=lambda f: -f.evidence)

    @functools.cached_property
    def holds_back(self) -> bool:
        """Return whether the spectrum is low just below half the sampling rate, as behind a low-pass."""
        level = self.prior.level
        return bool(level[-1] <= HELD_BACK * np.median(level))

    def may_pass_all(self, name: str) -> bool:
        """Return whether it is told from the record whether slow noise has passed a filter too; behind a free shape a
        fast process may be the white noise.
        """
        return self.holds_back and name not in ("none", *DIGITAL) and "shape" not in name

    # ------------------------------------------------------------------ moves
    def excess(self, at: Fitted) -> tuple[Array, Array]:
        """Return the variance of all ordinates by a fit, with the errors of the end angles, and their powers over it
        less their number.
        """
        S, low = self.data.covariance(at.model, at.p[None])
        S = np.concatenate([S[0], np.diagonal(low[0], axis1=-2, axis2=-1).ravel()])
        S = S + 2.0 * float(self.data.angle(at.model, at.p)) * self.data.all_ends**2
        return S, self.data.all_power / S - self.data.all_count

    def starts(self, at: Fitted, term: NoiseTerm) -> list[Array]:
        """Return starts of a term that is added to a model: its size by one step, at the best places of a scan."""
        data = self.data
        S, excess = self.excess(at)
        scan = np.linspace(math.log(SHORTEST_TAU) + 0.1, self.prior.longest, 20)
        found = list[tuple[float, Array]]()
        passes = passed(at.model, at.p, data.grid) if term.name in SLOW else None
        for rest in [np.array([t]) for t in scan] if term == GM else [np.empty(0)]:
            unit = term.unit(rest, data.grid) / S * (1.0 if passes is None else passes)
            info, score = float(data.all_count @ unit**2), float(unit @ excess)
            v = max(score / info, 0.7 * info**-0.5)
            found.append((max(score, 0.0) ** 2 / info, np.array([math.log(v), *rest])))
        stat = np.pad([f[0] for f in found], 1, constant_values=-1.0)
        peaks = np.flatnonzero((stat[1:-1] >= stat[:-2]) & (stat[1:-1] >= stat[2:]))
        return [found[i][1] for i in peaks[np.argsort(-stat[1:-1][peaks])][:2]]

    def neighbours(self, at: Fitted) -> Iterator[tuple[Model, list[Array]]]:
        """Yield models with one term more or less, or another one in place of it."""
        parts = split(at.model, at.p)
        names = [t.name for t in at.model]
        filtered = any(t.filter != "none" for t in at.model)
        white = "white" in names
        for term in (Q, B, K, GM, *([W] if filtered else []), *([] if white else [N])):
            if names.count(term.name) < (MOST_MARKOV if term == GM else 1):
                yield (*at.model, term), [np.concatenate([at.p, s]) for s in self.starts(at, term)]
        for i, (term, q) in enumerate(parts):
            rest = parts[:i] + parts[i + 1 :]
            if not rest or (term.name == "white" and filtered):
                continue
            model, less = joined(rest)
            yield model, [less]
            if term == GM:  # its slow end as a random walk, or flicker
                for other, size in ((K, q[0] + math.log(2.0) - q[1]), (B, q[0])):
                    if other.name not in names:
                        yield (*model, other), [np.append(less, size)]
                if not white and q[1] < SLOWEST_POLE:
                    yield (*model, FIRST), [np.append(less, [q[0] + math.log(2.0) + q[1], q[1]])]
            elif term in (B, K) and names.count(GM.name) < MOST_MARKOV:
                tau = self.prior.longest - 2.0
                slow = np.append(less, [q[0] + (tau - math.log(2.0)) * (term is K), tau])
                yield (*model, GM), [slow]
                if term is B and K not in at.model:  # for what comes back and what does not, one term is likelier alone
                    walk = q[0] + math.log(2.0) - tau
                    halfway = [np.append(less, [q[0], share * tau, walk]) for share in (0.4, 0.7)]
                    yield (*model, GM, K), halfway
                if term is B and filtered and W not in at.model:  # it fills what the filter holds back, too
                    yield (*model, GM, W), [np.append(slow, self.prior.readout)]

    def filters(self, at: Fitted, names: tuple[str, ...]) -> Iterator[tuple[Model, list[Array]]]:
        """Yield models with another filter of the white noise."""
        parts = split(at.model, at.p)
        if parts[0][0].name != "white":
            return
        (term, q), rest = parts[0], parts[1:]
        base = term.filter.removesuffix(ALL)
        every, (first, _, behind) = term.filter[len(base) :], base.partition("+")
        count = samples_of(first) if first.startswith("mean") else round(math.exp(q[1])) if first == "average" else 1

        def with_filter(name: str, p: Array) -> tuple[Model, list[Array]]:
            model, start = joined([(NoiseTerm("white", name), p), *rest])
            return model, [start]

        if self.may_pass_all(base):
            yield with_filter(base if every else base + ALL, q)
        if count > 1:  # of slow noise too, which fills its zeros otherwise
            yield with_filter(f"mean{count}{ALL}", q[:1])
        if first == "average" and (whole := nearly_whole(q[1])):
            yield with_filter("+".join([f"mean{whole}", *([behind] if behind else [])]) + every, np.delete(q, 1))
        if behind:
            yield with_filter(first + every, q[: 1 + (first == "average")])
        for after in BEHIND if (first == "average" or first.startswith(tuple(MEANS))) and not behind else ():
            name = f"{first}+{after}{every}"  # a mean of what has passed a filter already
            for guess in STARTS.get(after, [[0.0] * (NoiseTerm("white", name).size - q.size)]):
                yield with_filter(name, np.concatenate([q, guess]))
        for name in names:
            if name == base or (name == "none" and W in at.model):
                continue
            least = [(W, np.array([self.prior.readout]))]  # shows in a stop band, and in zeros of the fourth order
            others = rest + least if name in DIGITAL + TWICE and W not in at.model else rest
            for end in ("", ALL) if self.may_pass_all(name) else ("",):
                new = NoiseTerm("white", name + end)
                for guess in STARTS.get(name, [[0.0] * (new.size - 1)]):
                    made = joined([(new, np.append(q[0], guess)), *others])
                    yield made[0], [made[1]]

    def climb(self, at: Fitted, names: tuple[str, ...]) -> Fitted:
        """Go to the best neighbour, until there is none."""
        visited = set()
        tried = set()
        while at.model not in visited:
            visited.add(at.model)
            for moves in (self.neighbours(at), self.filters(at, names)):
                for model, starts in moves:
                    for start in starts:
                        key = canonical(model, start)
                        mark = (key[0], tuple(np.round(key[1], 0)))
                        if mark not in tried and (key[0] not in self.seen or len(starts) > 1):
                            tried.add(mark)
                            self.fit(model, start)
            at = self.best
        return at

    def try_digital(self) -> None:
        """Try digital low-passes, where the spectrum falls, and means in place of the best filter; they stay if nearly
        as good.
        """
        before = dict(self.seen)
        fits = [(m, s) for m, starts in self.filters(self.best, DIGITAL + TWICE) for s in starts]
        for model, start in (fits if self.holds_back else []) + means_beside(self.best, self.data, self.prior):
            self.fit(model, start)
        if any(t.filter in DIGITAL + TWICE + WHOLE + AFTER_FIRST for t in self.best.model):
            self.climb(self.best, SIMPLE + DIGITAL)
        else:
            near = self.best.evidence - NEARLY
            self.seen = {m: f for m, f in self.seen.items() if m in before or f.evidence > near}

    def grow_filters(self) -> None:
        """Try slow terms beside a mean over whole samples or a digital low-pass that is nearly as likely as the best
        model, and beside a filter that slow noise passes too: other filters, of more parameters, hide the zeros of a
        mean, and each slow term that passes none fills them, as it fills what a low-pass holds back; one that slow
        noise passes is likely beside the right slow terms alone.
        """
        families: tuple[tuple[Callable[[str], bool], float], ...] = (
            (lambda name: name.startswith(tuple(MEANS)), NEARLY), (lambda name: name in DIGITAL, NEARLY),
            (lambda name: name.endswith(ALL), math.inf),
        )  # fmt: skip
        for belongs, near in families:
            at: Fitted | None = None
            while likely := [f for f in self.seen.values() if any(belongs(t.filter) for t in f.model)
                             and f.evidence > self.best.evidence - near]:  # fmt: skip
                top = max(likely, key=lambda f: f.evidence)
                if at is not None and top.model == at.model:
                    break
                at = top
                for model, start in [(m, s) for m, starts in self.neighbours(at) for s in starts]:
                    if canonical(model, start)[0] not in self.seen:
                        self.fit(model, start)

    # ------------------------------------------------------------------ resonances
    def peak(self, at: Fitted, vain: Sequence[Array] = (), clear: float = CLEAR) -> Array | None:
        """Return the start (3,) of a resonance where the powers stand out of the fit most, None where none is clear;
        vain: where one was sought already; clear: probability of so large an excess anywhere.
        """
        data = self.data
        order = np.argsort(data.grid.omega[: data.b])
        S, _ = self.excess(at)
        omega, count = data.grid.omega[order], data.count[order]
        ratio = data.power[order] / S[order]
        for start in vain:  # its own width about it
            mine = np.abs(omega - math.exp(start[2])) < 2.0 * math.exp(-start[1])
            ratio[mine] = count[mine]
        total, number = (np.concatenate([[0.0], np.cumsum(v)]) for v in (ratio, count))
        best, found = math.log(clear / (len(WIDTHS) * order.size)), None
        for width in WIDTHS:
            m, x = number[width:] - number[:-width], total[width:] - total[:-width]
            z = np.where(x > m, (np.cbrt(x / m) - 1.0 + 2.0 / (9.0 * m)) / np.sqrt(2.0 / (9.0 * m)), 0.0)
            p = special.log_ndtr(-z)
            i = int(np.argmin(p))
            if p[i] < best and omega[i + width - 1] < 1.6 * omega[i]:
                part = slice(i, i + width)
                centre = float(np.average(omega[part], weights=np.maximum(ratio[part], 1e-9)))
                spread = max(0.3 * float(omega[i + width - 1] - omega[i]), 2.0 * math.pi / data.n.max())
                power = float(np.sum((ratio[part] - count[part]) * S[order][part]) / data.samples)
                best, found = float(p[i]), np.array([math.log(max(power, 1e-12)), -math.log(spread), math.log(centre)])
        return found

    def add_resonances(self) -> None:
        """Add resonances while powers stand out of the fit; each is fitted with the broadband terms, then frozen."""
        vain: list[Array] = []
        settled = False  # whether the broadband terms were sought again beside the bands so far
        while len(self.resonances) < MOST_RESONANCES and len(vain) < MOST_VAIN:
            at = self.best
            start = self.peak(at, vain)
            if start is None:
                break
            tried = [self._with(at, NoiseTerm(name), start) for name in PEAKS]
            found = max(tried, key=lambda f: f.evidence)
            if found.p[-2] < math.log(COHERENT) and not settled:
                self.climb(at, SIMPLE)
                settled = True
                continue
            if found.evidence < at.evidence + 2.0:
                vain.append(start)
                continue
            self._freeze(found)
            settled = False
        for _ in range(len(self.resonances)):  # each again, with the others and the broadband terms as they are now
            term, p = self.resonances.pop(0)
            self.data.hold(self.resonances)
            at = self.best
            without = maximize(self.data, self.prior, at.model, at.p)
            # from where it was, and from what stands out without it: it may have stood for two that are narrower
            again = self.peak(without)
            tried = [self._with(at, term, p)]
            if again is not None:
                tried += [self._with(at, NoiseTerm(name), again) for name in PEAKS]
            found = max(tried, key=lambda f: f.evidence)
            if found.evidence > without.evidence:
                self._freeze(found)
            else:
                self.seen = {without.model: without}
        if self.resonances:
            self._match()

    def _match(self) -> None:
        """Give each resonance the power that is there, where it is most of the spectrum: what few ordinates show of its
        shape, the likelihood takes at the price of its power, which the deviation is the sum of.
        """
        S, _ = self.excess(self.best)
        data = self.data
        power, count = data.all_power, data.all_count
        matched = []
        for term, p in self.resonances:
            own = term.spectrum(p, data.grid)
            most = own > 0.5 * S
            expected = float(np.sum((count * own)[most]))
            found = float(np.sum((power - count * (S - own))[most]))
            more = min(max(found / expected, 0.2), 5.0) if expected > 0.0 else 1.0
            matched.append((term, p + math.log(more) * np.array([1.0, 0.0, 0.0])))
        self.resonances = matched
        data.hold(matched)
        at = self.best
        self.seen = {}
        self.fit(at.model, at.p)

    def beside_weak_bands(self, at: Fitted) -> Array:
        """Return the parameters (q,) of a model beside the bands that may be where the powers stand out most, though
        not clearly.
        """
        found, bands = at, list(self.resonances)
        for _ in range(WEAK):
            start = self.peak(found, clear=math.inf)
            if start is None:
                break
            more = max((self._with(found, NoiseTerm(name), start) for name in PEAKS), key=lambda f: f.evidence)
            bands.append((more.model[-1], more.p[-3:]))
            self.data.hold(bands)
            found = replace(more, model=more.model[:-1], p=more.p[:-3])
        self.data.hold(self.resonances)
        return found.p

    def _with(self, at: Fitted, term: NoiseTerm, start: Array) -> Fitted:
        return maximize(self.data, self.prior, (*at.model, term), np.concatenate([at.p, start]))

    def _freeze(self, found: Fitted) -> None:
        """Keep the last term of a fit as it is, forget what was tried without it."""
        term, p = found.model[-1], found.p[-3:]
        self.resonances.append((term, p))
        self.data.hold(self.resonances)
        self.seen = {}
        self.fit(found.model[:-1], found.p[:-3])

    @property
    def whole(self) -> tuple[Model, Array]:
        """Return the best model with its resonances."""
        b = self.best
        return joined([*split(b.model, b.p), *self.resonances])


def search_again(data: Ordinates, before: ModelSearch) -> ModelSearch:
    """Return the models tried for a record that differs little from another one, from the best models of that."""
    data.hold(before.resonances)
    found = ModelSearch(data, Prior(data), resonances=before.resonances)
    for f in before.ranked[:3]:
        found.fit(f.model, f.p)
    found.climb(found.best, SIMPLE + SHAPES)
    found.grow_filters()
    return found


def search(data: Ordinates) -> ModelSearch:
    """Return the models tried for a record."""
    found = ModelSearch(data, Prior(data))
    found.fit((N,), np.array([math.log(float(np.median(found.prior.level)))]))
    found.climb(found.best, SIMPLE)
    found.try_digital()
    found.add_resonances()
    found.climb(found.best, SIMPLE + SHAPES)
    if found.resonances:
        found.add_resonances()
        found.climb(found.best, SIMPLE + SHAPES)
    found.grow_filters()
    return found
