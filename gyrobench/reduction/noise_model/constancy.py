"""Whether the terms of a noise model are as large in every quarter of a record as in the whole of it.

Each quarter of the longest stretch is a record of its own.  With the shapes of the model as they are (filter, tau,
frequencies) its log variances are those of greatest likelihood, by scoring, with the inverse of the information as
their covariance.  Of even noise the sum of (log v_k - mean)^2/u_k^2 over the quarters is chi-squared of three degrees
of freedom.  The power of a band that keeps its phase for tau of n samples varies by 2 sum rho^2/n: tau/n of a damped
oscillator, sqrt(pi) tau/n of a band, whatever its skirts, which leak in so short a record, tell.  A term that a quarter
alone does not tell (slow drift, a narrow band) is not judged.  [DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.ordinates import Model, Ordinates
from gyrobench.reduction.noise_model.terms import PEAKS, NoiseTerm
from gyrobench.reduction.noise_model.treatment import Treated

PARTS, LEAST = 4, 512  # quarters, and samples of one
STEPS = 6  # of the scoring
TOLD = 0.3  # standard deviation of a log variance above which a part does not tell the term
COHERENT = {"resonance": 1.0, "band": math.sqrt(math.pi)}  # variance of the power over tau/n
CHANCE = 1e-3  # of a change of any term in a record of even noise


@dataclass(frozen=True)
class TermOverTime:
    """A term over the quarters of a record: rms (k,) over that of the mean, u (k,), p of so large differences.

    frequency: of a band, per sample; 0 of other terms.
    """

    term: NoiseTerm
    frequency: float
    rms: Array
    u: Array
    p: float

    @property
    def coefficient(self) -> str:
        """Return the coefficient whose change it is, "" of a band and of white noise of a free shape: that may be the
        power at other frequencies than N is of.
        """
        free = "shape" in self.term.filter
        return "" if free else {"white": "N", "quantization": "Q", "flicker": "B", "walk": "K"}.get(self.term.name, "")


def over_time(treated: Treated, shape: tuple[Model, Array], means: bool) -> tuple[TermOverTime, ...]:
    """Return the terms that every quarter of the longest stretch tells, in the order of the model."""
    model, p = shape
    x = max(treated.stretches, key=lambda s: s.own.size).done.drawn
    if x.size < PARTS * LEAST:
        return ()
    size = np.cumsum([0] + [t.size for t in model])[:-1]
    found = [_log_variances(part, model, p, size, means, treated) for part in np.array_split(x, PARTS)]
    off, u = np.array([f[0] for f in found]), np.array([f[1] for f in found])
    out = []
    for j, (term, at) in enumerate(zip(model, size.tolist(), strict=True)):
        if not float(np.max(u[:, j])) < TOLD:
            continue
        w = u[:, j] ** -2
        mean = float(np.average(off[:, j], weights=w))
        chance = float(special.chdtrc(PARTS - 1, np.sum((off[:, j] - mean) ** 2 * w)))
        frequency = math.exp(p[at + 2]) / (2.0 * math.pi) if term.name in PEAKS else 0.0
        rms = np.exp(0.5 * (off[:, j] - mean))
        out.append(TermOverTime(term, frequency, rms, 0.5 * rms * u[:, j], chance))
    return tuple(out)


def changing(terms: tuple[TermOverTime, ...]) -> list[TermOverTime]:
    """Return the terms that change along the record by more than chance, those that are judged taken together."""
    return [t for t in terms if t.p < CHANCE / len(terms)]


def _log_variances(
    x: Array, model: Model, p: Array, sizes: Array, means: bool, treated: Treated
) -> tuple[Array, Array]:
    """Return the log variances of the terms of a part (n,) less those of the model, and their standard deviations."""
    known = treated.there / sum(s.own.size for s in treated.stretches)
    data = Ordinates([x - x.mean()], means, weight=known / treated.spread)
    at, H = p.copy(), np.eye(sizes.size)
    for _ in range(STEPS):
        _, gradient, info = data.scoring(model, at)
        H = info[np.ix_(sizes, sizes)] + 1e-6 * np.eye(sizes.size)
        at[sizes] += np.clip(-np.linalg.solve(H, gradient[sizes]), -1.0, 1.0)
        at[sizes] = np.clip(at[sizes], p[sizes] - 5.0, p[sizes] + 5.0)
    coherent = [COHERENT[t.name] * math.exp(p[k + 1]) if t.name in PEAKS else 0.0
                for t, k in zip(model, sizes.tolist(), strict=True)]  # fmt: skip
    return (at - p)[sizes], np.sqrt(np.diagonal(np.linalg.inv(0.5 * H)) + np.array(coherent) / x.size)
