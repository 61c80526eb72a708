"""What choosing among models costs: coverage of the 95 % intervals against the true size of an effect, by calculation.

    python tests/benchmarks/price_of_choice.py

A coefficient that one possible effect moves, with the weights of nuisance_states, known noise and no other effect:

* a single effect, e.g. a tilt that the dwells alone tell from Dx_z: its estimate is t ~ N(c, 1) in its own standard
  uncertainties.  With it the coefficient has the error noise + k (t - c), without it noise - k c; the odds of its being
  there are exp(t^2/2)/SIZE, and count FAVOUR times.
* a scatter of groups, e.g. mounts, of which m contrasts are free: their mean square is (1 + s^2) chi^2_m/m in units of
  the noise of a group; a coefficient that rests on the groups has the variance 1 + s^2, whatever is assumed.

The interval is that of the mixture.  Coverage is integrated over the data, for the effect absent and of each size.  In
the mean over a prior with the weights of the mixture 95 % hold, exactly, as of any interval with a probability of 95 %.
But one instrument has one effect: what counts is the lowest and the highest of all sizes.  Width: mean half width where
the effect is absent, over that of a model that always has it (of a scatter: of the t interval of the groups alone).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, special, stats

from gyrobench.reduction.estimation.mixture import Mixture
from gyrobench.reduction.estimation.nuisance_states import FAVOUR, OCTAVE, SCATTERS, SIZE

Array = NDArray[np.float64]
MANY = 10**6  # degrees of freedom of a noise that is known
STEP = 0.05
ALL_SIZES = np.concatenate([np.arange(0.0, 4.0, 0.25), np.arange(4.0, 12.1, 0.5)])


def half_width(weight: Array, off: Array, sd: Array) -> float:
    """Half width about the mean of a mixture of normal distributions."""
    off = off - float(weight @ off)
    m = Mixture(weight, off[:, None], np.square(sd)[:, None, None], MANY)
    return float(m.spread(np.eye(1))[1][0])


def single(widening: float, sizes: Array, favour: float = FAVOUR) -> tuple[Array, float, float]:
    """Coverage for each size (in standard uncertainties of the effect), its mean over the prior, and the width.

    widening: standard uncertainty of the coefficient with the effect over that without.
    """
    k = math.sqrt(widening**2 - 1.0)  # of a noise of 1
    t = np.arange(-60.0, 60.0 + STEP / 2, STEP)
    odds = favour * np.exp(np.minimum(t**2 / 2.0, 600.0)) / SIZE
    p = odds / (1.0 + odds)
    half = np.array([half_width(np.array([1 - q, q]), np.array([0.0, k * x]), np.array([1.0, widening]))
                     for q, x in zip(p, t, strict=True)])  # fmt: skip

    def mean(values: Array, c: float) -> float:
        return float(np.sum(np.exp(-0.5 * (t - c) ** 2) * values) * STEP / math.sqrt(2.0 * math.pi))

    def held(c: float) -> float:
        # with the noise common to both: the error of the mean is noise + k (p t - c)
        off = k * (p * t - c)
        return mean(special.ndtr(half - off) - special.ndtr(-half - off), c)

    c = np.arange(0.0, 40.0 + STEP / 2, STEP)
    lack = 2.0 * integrate.simpson(np.array([0.95 - held(x) for x in c]), x=c)
    flat = favour / (SIZE * math.sqrt(2.0 * math.pi))  # weight of a size over that of none
    over_prior = 0.95 + 0.5 * (held(0.0) - 0.95) - 0.5 * flat * lack
    return np.array([held(x) for x in sizes]), over_prior, mean(half, 0.0) / (widening * stats.norm.ppf(0.975))


def scatter(
    m: int, sizes: Array, octave: float = OCTAVE, scatters: Sequence[float] = SCATTERS
) -> tuple[Array, float, float]:
    """Coverage for each size (in standard uncertainties of one constant), its mean over the prior, and the width."""
    s = np.array([0.0, *scatters])
    prior = np.array([1.0, *[octave] * len(scatters)])
    square = np.geomspace(1e-3, 1e6, 3000)  # sum of the squares of the contrasts

    def width(q: float) -> float:
        log = np.log(prior) - m / 2.0 * np.log1p(s**2) + 0.5 * q * s**2 / (1.0 + s**2)
        w = np.exp(log - log.max())
        return half_width(w / w.sum(), np.zeros_like(s), np.sqrt(1.0 + s**2))

    half = np.array([width(q) for q in square])

    def mean(values: Array, unit: float) -> float:
        density = stats.chi2.pdf(square / unit, m) / unit
        return float(integrate.simpson(density * values * square, x=np.log(square)))

    def held(size: float) -> float:
        unit = 1.0 + size**2
        return mean(special.erf(half / math.sqrt(2.0 * unit)), unit)

    every = np.array([held(x) for x in s])
    groups = stats.t.ppf(0.975, m) * np.sqrt(square / m)
    over_prior = float(prior @ every / prior.sum())
    return np.array([held(x) for x in sizes]), over_prior, mean(half, 1.0) / mean(groups, 1.0)


def main() -> None:
    sizes = np.array([0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 10.0])

    def row(name: str, shown: Array, every: Array, mean: float, width: float) -> None:
        print(f"{name:<34}" + " ".join(f"{x:>6.3f}" for x in shown)
              + f"   {every.min():.3f} .. {every.max():.3f}   {mean:.4f}   {width:.2f}", flush=True)  # fmt: skip

    print(
        f"{'size of the effect':<34}" + " ".join(f"{x:>6g}" for x in sizes) + "   of all sizes     of the prior  width"
    )
    n = sizes.size
    for favour in (1.0, FAVOUR):
        for widening in (1.2, 2.0, 5.0, 34.0):
            held, mean, width = single(widening, np.concatenate([sizes, ALL_SIZES]), favour)
            row(f"single, times {favour:g}, widens {widening:g}", held[:n], held[n:], mean, width)
    for first in (1.0, SCATTERS[0]):
        for m in (2, 3, 6, 8, 12):
            scatters = [first / SCATTERS[0] * x for x in SCATTERS]
            held, mean, width = scatter(m, np.concatenate([sizes, ALL_SIZES]), scatters=scatters)
            row(f"scatter from {first:g}, {m} contrasts", held[:n], held[n:], mean, width)


if __name__ == "__main__":
    main()
