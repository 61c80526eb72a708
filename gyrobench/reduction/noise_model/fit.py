"""Noise model of a rate record: terms, coefficients N, B, K, R, Q, Gauss-Markov processes, minimum of the deviation.

    model = fit_noise(rate, tau0)            rate (n,) in any unit, NaN where a sample is missing; tau0 in s
    model.N, .B, .K, .R, .Q                  coefficients with intervals of 95 % and whether the record determines them
    model.processes                          Gauss-Markov processes as a Kalman filter takes them
    model.minimum                            least Allan deviation and where
    model.allan(tau), model.spectrum(f)      what the whole model implies
    model.agreement                          that beside the record's own deviation
    model.over_time                          terms in the quarters of the record
    model.treatment                          wild and missing samples, steps, lines, change of the noise level

The model is the one of greatest evidence whose deviation agrees with the record's own; intervals are of draws from the
posterior of all models worth their weight.  [DRIFT-NOISE-MODEL]
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model import posterior
from gyrobench.reduction.noise_model.agreement import DeviationAgreement
from gyrobench.reduction.noise_model.choice import Judge, deviations_of, filter_probability
from gyrobench.reduction.noise_model.filter_starts import GM
from gyrobench.reduction.noise_model.gap_completion import completed_by
from gyrobench.reduction.noise_model.maximum import Fitted, maximize
from gyrobench.reduction.noise_model.noise_model import (
    ABSENT,
    CALLED,
    Minimum,
    NoiseModel,
    Scale,
    scale_of,
    times,
)
from gyrobench.reduction.noise_model.one_curve import steep_fall, weak_start
from gyrobench.reduction.noise_model.ordinates import Model, Ordinates, allan, joined, size_of, spectrum, split
from gyrobench.reduction.noise_model.posterior import NONE, Cloud, density_of_walk, quantile, resampled, shown, weighted
from gyrobench.reduction.noise_model.processes import LIKELY, process
from gyrobench.reduction.noise_model.rate_pulses import MOST, WIDTHS, Pulse, pulse
from gyrobench.reduction.noise_model.search import ModelSearch, search, search_again
from gyrobench.reduction.noise_model.sensor_filters import DIGITAL, MEANS, Grid
from gyrobench.reduction.noise_model.slow_changes import LevelChange, Settling, Swing, settling, swing
from gyrobench.reduction.noise_model.steps import EDGE, LevelStep, largest_step, step_ratios
from gyrobench.reduction.noise_model.terms import NoiseTerm
from gyrobench.reduction.noise_model.treatment import Placed, Treated, output_step, treat
from gyrobench.reduction.series.noise_coefficients import Estimate

Parts = list[tuple[NoiseTerm, Array]]

WORTH = 0.01  # of the most probable model with a term: weight of one whose upper end counts
SLOWEST = math.log(10.0)  # logarithm of the record over tau of a process that drifts as a walk within it
BARELY = math.log(2.0)  # above the variance that a record just shows: what is below is as good as absent
FAST = ("N", "Q")  # coefficients that a band too weak to be found counts as
CHANGES = {LevelStep: MOST, Pulse: MOST, Settling: 1, Swing: 2}  # at most; so many steps or pulses are noise
RATIO = 8.0  # of the likelihood ratio of a step or a pulse, above 2 log n (widths)
SLOW, SEEN = 24.0, 9.0  # of that of a slow change: some ten of them differ; and before the models are fitted again
LEAK = 10.0  # ordinates of mean power
DENSE = 4000  # frequencies of a spectrum that is interpolated
AVERAGES = 40  # averaging times between which the minimum is sought
SAMPLE = 250  # draws of the ramp and the minimum
NOWHERE = 1.05  # of N squared: white noise that is nowhere less is nowhere seen as low


@dataclass(frozen=True)
class _Fit:
    """A treated record with the models of what is left, their draws, the one that is reported, and the ramp."""

    treated: Treated
    found: ModelSearch
    clouds: list[Cloud]
    at: Fitted
    ramp: Estimate
    agreements: tuple[DeviationAgreement, DeviationAgreement]

    @property
    def agrees(self) -> bool:
        return all(a.holds for a in self.agreements) and self.treated.settled


def fit_noise(
    rate: Array,
    tau0: float,
    means: bool = True,
    remove_lines: bool = True,
    find_wild: bool = True,
    raw: Array | None = None,
    alike: float = 0.0,
    restless: float = 0.0,
) -> NoiseModel:
    """Return the noise model of a rate (n,), NaN where a sample is missing.

    means: a sample is the mean over tau0 (a difference of angles), not the rate at an instant.  raw: the record before
    anything was taken out of it, whose deviation the model is held against; the rate itself unless given.  alike,
    restless: what is known of the record beside the samples, see :class:`Treated`.
    Raises SeriesError for a record that is too short or constant, ValueError for tau0 that is not positive.
    """
    if not tau0 > 0.0:
        raise ValueError(f"tau0 = {tau0} s; it must be positive")
    rate = np.asarray(rate, dtype=float)
    scale = scale_of(rate, tau0, means)
    raw = rate if raw is None else np.asarray(raw, dtype=float)
    rate, raw = (rate - scale.level) / scale.size, raw / scale.size
    rounding = output_step(raw) ** 2 / 12.0
    fitted = _fit(treat(rate, rounding, remove_lines, find_wild), raw, means)
    if not fitted.agrees and not all(x.steady for x in fitted.treated.lines):
        # two lines for one that wanders leave holes in what may be a narrow band of noise
        again = _fit(treat(rate, rounding, remove_lines, find_wild, wandering=False), raw, means)
        fitted = again if again.agrees else fitted
    treated, found, clouds, at, ramp = fitted.treated, fitted.found, fitted.clouds, fitted.at, fitted.ramp
    whole, clean = fitted.agreements
    of = {name: _coefficient(name, at, found, clouds) for name in CALLED} | {"R": ramp}
    return NoiseModel(
        scale=scale,
        shape=joined([*split(at.model, at.p), *found.resonances]),
        coefficients={name: times(e, scale.units[name]) for name, e in of.items()},
        processes=tuple(process(i, at, clouds, scale) for i in range(at.model.count(GM))),
        minimum=_minimum(at, found, clouds, ramp, treated.samples, scale),
        treatment=replace(treated, alike=alike, restless=restless),
        agreements=(whole.scaled(scale.size, tau0), clean.scaled(scale.size, tau0)),
        with_wild={n: v * scale.units[n] for n, v in _with_wild(treated, at, found, means).items()},
        models=len(found.seen),
        chances={"filtered": filter_probability(clouds), "steep": steep_fall(found, at), "weak": weak_start(found, at)},
    )


def _fit(treated: Treated, raw: Array, means: bool) -> _Fit:
    """Return the model of a treated record; raw (n,): as it was, in its unit."""
    treated, found = _without_changes(treated, means)
    clouds = posterior.draw(found)
    beside = posterior.beside_free_bands(clouds, found)
    ramp = _ramp(found, beside)
    judge = Judge(found, deviations_of(raw, treated, ramp.value if ramp.determined else 0.0), treated)
    at = judge.near_the_record(judge.choose(clouds), clouds)
    return _Fit(treated, found, beside, at, ramp, judge.both(allan(at.model, at.p, judge.own.tau, means)))


# ------------------------------------------------------------------ changes of the level
def _without_changes(treated: Treated, means: bool) -> tuple[Treated, ModelSearch]:
    """Return the record without the changes of its level that the likelihood asks for, and the models of the rest.

    A level that jumps more often than steps or pulses can be taken out does so as part of its noise: none is then.
    """
    whole, found = treated, search(treated.ordinates(means))
    while changes := _changes_of(treated, found, means):
        better = treated.without(changes)
        data = better.ordinates(means)
        # what was completed beside the changes, bands too, may not be there without them
        completed = any(s.done.extra is not None for s in treated.stretches)
        if max(len(better.steps), len(better.pulses)) >= MOST:
            return _without_changes(replace(whole, jumps=True), means)
        treated, found = better, search(data) if completed else search_again(data, found)
    return treated, found


def _changes_of(treated: Treated, found: ModelSearch, means: bool) -> list[Placed]:
    """Return the steps and slow changes that the likelihood asks for beside what was taken out, one after the other.

    Candidates are the largest ones under the model, steps also under its fast terms alone, as a step passes for slow
    drift; the models are fitted again without each of them.
    """
    step = 2.0 * math.log(treated.samples) + RATIO
    needed = {LevelStep: step, Pulse: step + 2.0 * math.log(len(WIDTHS)), Settling: SLOW, Swing: SLOW}
    first = needed | {Settling: SEEN, Swing: SEEN}  # before the models are fitted again
    fits, changes = found.ranked[:3], list[Placed]()

    def stretch(i: int, parts: Parts, less: Sequence[Placed]) -> tuple[Array, Array, float]:
        """Return a stretch less changes, completed under a model, with its spectrum and the error of an angle."""
        x, angle = treated.completed(i, less), sum(float(t.angle(p)) for t, p in parts)
        S = _spectrum_of(x.size, parts, means)
        return completed_by(x, treated.stretches[i].gone, S), S, angle

    def under(fits: list[Fitted]) -> Parts:
        at = min(fits, key=lambda f: f.value)
        return [*split(at.model, at.p), *found.resonances]

    def largest(kind: type[LevelChange], of: tuple[Array, Array, float]) -> tuple[LevelChange, float]:
        if kind is LevelStep:
            return largest_step(*step_ratios(*of))
        if kind is Pulse:
            return pulse(*of)
        return settling(*of) if kind is Settling else swing(*of)

    def stands(i: int, change: LevelChange, without: list[Fitted]) -> bool:
        """Return whether the samples that are there show a step under the model without it: ordinates that completed
        samples are in count for less, and so does the jump that a step is for drift without one.
        """
        if not isinstance(change, LevelStep) or not treated.stretches[i].gone.size:
            return True
        near = slice(max(change.at - EDGE, 0), change.at + EDGE + 1)
        return float(step_ratios(*stretch(i, under(without), changes))[0][near].max()) > needed[LevelStep]

    while True:
        at = max(fits, key=lambda f: f.evidence)
        fast = [(t, q) for t, q in split(at.model, at.p) if t.name in ("white", "readout", "quantization")]
        tried: list[tuple[Placed, list[Fitted]]] = []
        taken = Counter(type(c) for c in [*treated.changes, *(c for _, c in changes)])
        for model, p in [(at.model, at.p), *([joined(fast)] if fast and len(fast) < len(at.model) else [])]:
            parts = [*split(model, p), *found.resonances]
            of = [stretch(i, parts, changes) for i in range(len(treated.stretches))]
            longest = max(range(len(of)), key=lambda i: of[i][0].size)
            every = range(len(of))
            places: dict[type[LevelChange], Sequence[int]] = {LevelStep: every}
            if model is at.model:
                places |= {Pulse: every, Settling: [0], Swing: [longest]}
            if treated.jumps:
                places = {kind: where for kind, where in places.items() if kind not in (LevelStep, Pulse)}
            each = [(largest(kind, of[i]), i) for kind in places if taken[kind] < CHANGES[kind] for i in places[kind]]
            groups = ([e for e in each if isinstance(e[0][0], kinds)] for kinds in (LevelStep, Pulse, Settling | Swing))
            for (change, ratio), i in [max(e, key=lambda e: e[0][1]) for e in groups if e]:
                if ratio < first[type(change)]:
                    continue
                data = treated.ordinates(means, less=[*changes, (i, change)])
                data.hold(found.resonances)
                without = [maximize(data, found.prior, f.model, f.p) for f in fits]
                if stands(i, change, without):
                    tried.append(((i, change), without))
        if not tried:
            break
        one, without = min(tried, key=lambda t: min(f.value for f in t[1]))
        if min(f.value for f in fits) - min(f.value for f in without) < needed[type(one[1])]:
            break
        fits, changes = without, [*changes, one]
    # what fast terms alone make of a change knows no drift: each again beside the others, under the model of all
    others = [changes[:k] + changes[k + 1 :] for k in range(len(changes))]
    return [
        (i, largest(type(c), stretch(i, under(fits), less))[0]) for (i, c), less in zip(changes, others, strict=True)
    ]


def _spectrum_of(n: int, parts: Parts, means: bool) -> Array:
    """Return the spectrum (n,) of terms at the ordinates of a stretch, interpolated; 1 for that of the mean."""
    k = np.arange(1.0, n)
    few = k if n < DENSE else np.unique(np.rint(np.geomspace(1.0, n - 1.0, DENSE)))
    grid = Grid(math.pi * few / n, means)
    S = spectrum(*joined(parts), grid)
    for term, p in parts:  # a stretch leaks into the zeros of a mean, and into what a digital low-pass holds back
        if term.filter.startswith((*MEANS, "average", *DIGITAL)):
            own = term.spectrum(p, grid)
            S = np.maximum(S, LEAK * float(np.trapezoid(own, few)) / n**2)
    return np.concatenate([[1.0], np.exp(np.interp(np.log(k), np.log(few), np.log(S)))])


# ------------------------------------------------------------------ figures of the draws
def _figure(name: str, found: ModelSearch) -> Callable[[Model, Array], Array | None]:
    """Return the figure log variance of a coefficient."""
    return density_of_walk(found.prior.longest - SLOWEST) if name == "K" else size_of(CALLED[name])


def _coefficient(name: str, at: Fitted, found: ModelSearch, clouds: Sequence[Cloud]) -> Estimate:
    """Return a coefficient in units of the fit: value of the model that is reported, interval of all draws with it."""
    figure = _figure(name, found)
    values, weights = weighted(clouds, figure)
    if not values.size:
        v0 = found.prior.others[CALLED[name]][0]
        return Estimate(0.0, 0.0, math.exp(0.5 * (v0 + 2.0)), False)
    low, high = (math.exp(0.5 * quantile(values, weights, q)) for q in (0.025, 0.975))
    if name == "N":
        low, high = _beside_any_drift(figure, clouds, low, high)
        high = max(high, _as_seen(found, at))
    least = found.prior.others[CALLED[name]][0] + BARELY
    absent = 1.0 - float(weights.sum()) + float(weights[values < least].sum())
    own = figure(at.model, at.p[None])
    if own is None or not own[0] > NONE or absent > ABSENT or not shown(figure, found):
        # below what any model of weight with the term allows
        having = [(c, v) for c in clouds if (v := figure(c.model, c.p)) is not None]
        most = max(float(c.weight.sum()) for c, _ in having)
        ends = [quantile(v, c.weight, 0.975) for c, v in having if float(c.weight.sum()) > WORTH * most]
        return Estimate(0.0, 0.0, max([high, *(math.exp(0.5 * e) for e in ends)]), False)
    value = math.exp(0.5 * float(own[0]))
    beside = figure(at.model, found.beside_weak_bands(at)[None]) if name in FAST else None
    if beside is not None:
        ratio = math.exp(0.5 * float(beside[0] - own[0]))
        low, high = low * min(ratio, 1.0), high * max(ratio, 1.0)
    return Estimate(value, *about(value, low, high), True)


def about(value: float, low: float, high: float) -> tuple[float, float]:
    """Return the interval of the draws; where the value that is reported lies outside, they lack what makes it so (the
    bands of one model), and the interval reaches as far beyond the value, by a factor, as they lie on this side.
    """
    if value > high:
        return low, value * value / low
    if value < low:
        return value * value / high, high
    return low, high


def _as_seen(found: ModelSearch, at: Fitted) -> float:
    """Return the largest level of the white noise where it is half of the spectrum or more, as N; 0 where it is
    somewhere seen as low as N.

    A filter that rises, under a process that hides all below, has an N that is nowhere seen: it may be the process that
    falls otherwise, as that of bumps does.
    """
    grid = found.data.grid
    white = next((np.asarray(t.spectrum(q, grid)) for t, q in split(at.model, at.p) if t.name == "white"), np.zeros(0))
    seen = white[white > 0.5 * spectrum(at.model, at.p, grid)] if white.size else white
    own = size_of("white")(at.model, at.p[None])
    if own is None or not seen.size or float(np.min(seen)) < NOWHERE * math.exp(float(own[0])):
        return 0.0
    return math.sqrt(float(np.max(seen)))


def _beside_any_drift(
    figure: Callable[[Model, Array], Array | None], clouds: Sequence[Cloud], low: float, high: float
) -> tuple[float, float]:
    """Return the interval of N, wide enough for that of the models with flicker and that of those without: flicker
    reaches to the highest frequencies, Gauss-Markov drift does not, and a short record does not tell them apart.
    """
    total = sum(float(c.weight.sum()) for c in clouds)
    for with_flicker in (True, False):
        some = [c for c in clouds if any(t.name == "flicker" for t in c.model) == with_flicker]
        values, weights = weighted(some, figure)
        if values.size and float(weights.sum()) > LIKELY * total:
            ends = [math.exp(0.5 * quantile(values, weights, q)) for q in (0.025, 0.975)]
            low, high = min(low, ends[0]), max(high, ends[1])
    return low, high


def _ramp(found: ModelSearch, clouds: Sequence[Cloud]) -> Estimate:
    """Return the ramp per sample: its normal distribution for given parameters, over the draws.

    The interval holds that of the models with a random walk too: beside a free ramp, slow drift looks more like one
    that comes back than it is.
    """
    z = np.sqrt(2.0) * np.array([-2.35, -1.33, -0.436, 0.436, 1.33, 2.35])  # nodes and weights of Gauss-Hermite
    share = np.array([0.00453, 0.157067, 0.724629, 0.724629, 0.157067, 0.00453]) / math.sqrt(math.pi)
    walks = [c for c in clouds if any(t.name == "walk" for t in c.model)]
    total = sum(float(c.weight.sum()) for c in walks)
    walks = [replace(c, weight=c.weight / total) for c in walks] if total > 0.0 else []
    ends, value = [], 0.0
    for some in (walks, clouds):
        rows = [(model, *found.data.ramp_of(model, p)) for model, p in resampled(some, SAMPLE)]
        if rows:
            mean, sd = (np.concatenate([row[i] for row in rows]) for i in (1, 2))
            v, w = (mean[:, None] + sd[:, None] * z).ravel(), np.tile(share, mean.size)
            ends += [quantile(v, w, 0.025), quantile(v, w, 0.975)]
            value = float(np.median(mean))
    return Estimate(value, min(ends), max(ends), min(ends) * max(ends) > 0.0)


def _minimum(
    at: Fitted, found: ModelSearch, clouds: Sequence[Cloud], ramp: Estimate, samples: int, scale: Scale
) -> Minimum:
    """Return the least deviation of the model without resonances, up to a quarter of the record, each draw with a ramp
    of its own where one is determined: it may be the ramp that ends the fall.

    What a filter takes of the noise at short averaging times is no minimum: of a deviation that rises from one sample
    on, what follows its first summit counts.
    """
    m = np.unique(np.rint(np.geomspace(1.0, max(samples / 4.0, 2.0), AVERAGES)))
    rows, chance = [], np.random.default_rng(0)
    for model, p in resampled(clouds, SAMPLE):
        mean, sd = found.data.ramp_of(model, p)
        drawn = mean + sd * chance.normal(size=mean.size) if ramp.determined else np.zeros(mean.size)
        rows.append(np.sqrt(allan(model, p, m, scale.means) + 0.5 * (drawn[:, None] * m) ** 2))
    slow = 0.5 * (ramp.value * m) ** 2 if ramp.determined else 0.0
    own = np.sqrt(allan(at.model, at.p[None], m, scale.means)[0] + slow)
    summit = _summit(own)
    m, own, curves = m[summit:], own[summit:], np.concatenate(rows)[:, summit:]
    place = np.argmin(curves, axis=1)
    k = int(np.argmin(own))
    low, high = np.quantile(np.min(curves, axis=1), [0.025, 0.975])
    early, late = np.quantile(m[place], [0.025, 0.975])
    reached = k < m.size - 1 and bool(np.mean(place == m.size - 1) < 0.025)
    least = Estimate(float(own[k]), *about(float(own[k]), float(low), float(high)), reached)
    when = Estimate(float(m[k]), float(min(early, m[k])), float(max(late, m[k])), reached)
    return Minimum(times(least, scale.size), times(when, scale.tau0), reached)


def _summit(deviation: Array) -> int:
    """Return the place of the first summit of a deviation (k,) that rises from its beginning on, 0 without any."""
    falls = np.flatnonzero(np.diff(deviation) < 0.0)
    return int(falls[0]) if falls.size else 0


def _with_wild(treated: Treated, at: Fitted, found: ModelSearch, means: bool) -> dict[str, float]:
    """Return the coefficients of the same model with the wild samples left in; {} without any."""
    if not treated.wild.size:
        return {}
    data: Ordinates = treated.ordinates(means, keep_wild=True)
    data.hold(found.resonances)
    again = maximize(data, found.prior, at.model, at.p)
    out = {}
    for name in CALLED:
        v = _figure(name, found)(again.model, again.p[None])
        if v is not None and v[0] > NONE:
            out[name] = math.exp(0.5 * float(v[0]))
    return out
