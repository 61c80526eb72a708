"""The noise model that is reported: of the likely ones one whose deviation is the record's own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model import posterior
from gyrobench.reduction.noise_model.agreement import DeviationAgreement, compare, squares_of_spectrum, with_spectrum
from gyrobench.reduction.noise_model.maximum import Fitted
from gyrobench.reduction.noise_model.noise_model import ABSENT
from gyrobench.reduction.noise_model.ordinates import allan, filtered, size_of
from gyrobench.reduction.noise_model.posterior import Cloud, quantile, weighted
from gyrobench.reduction.noise_model.search import ModelSearch
from gyrobench.reduction.noise_model.treatment import Treated
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.deviations import Deviation, deviations

SIMPLER = 1.5  # of the logarithm of the evidence: what a term must bring to be in the model that is reported
TRIED_MODELS, TRIED = 12, 200  # maxima and draws of each model that are held against the deviation
WELL = 4.0  # below it: such a draw is as good a model as any
DEEP = 20.0  # below the greatest logarithm of the posterior: such a draw is no model of the record


@dataclass(frozen=True)
class Scaled:
    """Deviations of the record as it was and as it was cleaned, tau in samples, in units of ``size``.

    ramp, removed (k,): Allan variances of the ramp, and of it and what was taken out together.
    """

    own: Deviation
    clean: Deviation
    ramp: Array
    removed: Array


def deviations_of(raw: Array, treated: Treated, ramp: float) -> Scaled:
    """Return the deviations of a record (n,) with its ramp per sample."""
    clean = treated.cleaned()
    removed = raw - clean  # of samples in no stretch it is not known
    for s in treated.stretches:  # of a wild sample what it exceeds its neighbours' word by
        at = s.start + s.done.wild
        removed[at] = raw[at] - s.done.x[s.done.wild]
    off = removed - np.nanmean(removed)
    own = deviations(raw - np.nanmean(raw), 1.0, ("allan",), fine=True)["allan"]
    if not own.tau.size:
        raise SeriesError("missing samples leave no differences that an Allan deviation is made of")
    out = slow = 0.5 * (ramp * own.tau) ** 2
    if float(np.nanmax(np.abs(off))) > 1e-9:
        out = deviations(off + ramp * np.arange(off.size), 1.0, ("allan",), fine=True)["allan"].deviation ** 2
    clear = deviations(clean, 1.0, ("allan",), fine=True)["allan"]
    return Scaled(own, clear, slow, np.resize(out, own.tau.size))


class Judge:
    """Agreement of models with the record as it was, and as it was cleaned; intervals by the best model's spectrum."""

    def __init__(self, found: ModelSearch, scaled: Scaled, treated: Treated) -> None:
        self.found, self.samples, self.means = found, treated.samples, found.data.grid.means
        squares = squares_of_spectrum(scaled.own.tau, *found.whole)
        self.own, self.clean = (with_spectrum(d, squares, treated.spread) for d in (scaled.own, scaled.clean))
        self.plain, self.removed, self.ramp = scaled.own, scaled.removed, scaled.ramp
        self.below = treated.below / self.own.tau  # is in the samples and not in the model
        peaks = found.resonances
        self.peaks = np.sum([t.allan(q, self.own.tau, self.means) for t, q in peaks], axis=0) if peaks else 0.0

    @property
    def ranked(self) -> list[Fitted]:
        """Return the models that were tried, the one worth most first."""
        return sorted(self.found.seen.values(), key=worth, reverse=True)

    def both(self, variance: Array) -> tuple[DeviationAgreement, DeviationAgreement]:
        """Return the agreements of an Allan variance (k,) of the broadband terms."""
        noise = np.maximum(variance + self.peaks + self.below, 0.0)
        return (compare(self.own, np.sqrt(noise + self.removed), self.samples),
                compare(self.clean, np.sqrt((noise + self.ramp)[: self.clean.tau.size]), self.samples))  # fmt: skip

    def share(self, variance: Array) -> float:
        """Return the least share of averaging times that agree; 1 where enough do."""
        both = self.both(variance)
        return 1.0 if all(a.holds_at_octaves for a in both) else min(min(a.share, a.octaves) for a in both)

    def near_the_record(self, at: Fitted, clouds: Sequence[Cloud]) -> Fitted:
        """Return a model, or parameters of it, as good as the one given that agrees with the intervals of the power law
        alone, the one given where there is none.

        They are narrower where the noise is uneven or a resonance; who computes them elsewhere has no other ones.
        """
        tau = self.own.tau

        def plain(variance: Array) -> bool:
            whole = np.maximum(variance + self.peaks + self.below, 0.0)
            return compare(self.plain, np.sqrt(whole + self.removed), self.samples).holds_at_octaves

        others = [f for f in self.ranked if f.model != at.model and worth(f) > worth(at) - WELL]
        for f in [at, *(f for f in others if filtered(f.model) <= filtered(at.model))]:
            cloud = next((c for c in clouds if c.model == f.model), None)
            rows = f.p[None]
            if cloud is not None:
                order = np.argsort(-cloud.log)
                rows = np.concatenate([rows, cloud.p[order[cloud.log[order] > np.max(cloud.log) - WELL]]])
            for p, variance in zip(rows, allan(f.model, rows, tau, self.means), strict=True):
                if plain(variance) and self.share(variance) == 1.0:
                    return replace(f, p=p)
        return at

    def choose(self, clouds: Sequence[Cloud]) -> Fitted:
        """Return the model to be reported: of greatest evidence, terms paid for, of those that agree with the record.

        Where no maximum agrees the draws are tried, the most probable ones first; where none does, the closest one.
        """
        tau = self.own.tau
        ranked = self.ranked
        near = [f for f in ranked if worth(f) > worth(ranked[0]) - posterior.WINDOW][:TRIED_MODELS]
        tried = [(self.share(allan(f.model, f.p, tau, self.means)), f) for f in near]
        agree = [f for share, f in tried if share == 1.0]
        if filter_probability(clouds) < 1.0 - ABSENT:  # one that is not determined is not reported
            agree = [f for f in agree if not filtered(f.model)] or agree
        if agree:
            return _middle([f for f in agree if worth(f) > worth(agree[0]) - SIMPLER], clouds)
        for cloud in sorted(clouds, key=lambda c: -float(c.weight.sum())):
            order = np.argsort(-cloud.log)[:TRIED]
            order = order[cloud.log[order] > np.max(cloud.log) - DEEP]
            for p, variance in zip(cloud.p[order], allan(cloud.model, cloud.p[order], tau, self.means), strict=True):
                share = self.share(variance)
                if share > max(t[0] for t in tried):
                    tried.append((share, replace(self.found.seen[cloud.model], p=p)))
                    if share == 1.0:
                        return tried[-1][1]
        best = max(tried, key=lambda t: t[0])
        return best[1] if best[0] > tried[0][0] + 0.05 else tried[0][1]


def worth(f: Fitted) -> float:
    """Return the logarithm of the evidence of a model, its terms paid for."""
    return f.evidence - SIMPLER * len(f.model)


def filter_probability(clouds: Sequence[Cloud]) -> float:
    """Return the probability that the white noise has passed a filter."""
    return sum(float(c.weight.sum()) for c in clouds if filtered(c.model))


def _middle(models: Sequence[Fitted], clouds: Sequence[Cloud]) -> Fitted:
    """Return the first of models that are worth the same, or, if its N is not in the middle half of all draws, the one
    whose N is nearest to their median.
    """
    figure = size_of("white")
    values, weights = weighted(clouds, figure)
    if len(models) == 1 or not values.size:
        return models[0]
    low, median, high = (quantile(values, weights, q) for q in (0.25, 0.5, 0.75))
    own = [math.inf if (v := figure(f.model, f.p[None])) is None else float(v[0]) for f in models]
    if low <= own[0] <= high or math.isinf(own[0]):
        return models[0]
    return models[int(np.argmin(np.abs(np.array(own) - median)))]
