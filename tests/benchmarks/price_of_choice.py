"""What choosing among models costs: coverage of the 95 % intervals against the true size of an effect, by calculation.

    python tests/benchmarks/price_of_choice.py

A coefficient that one possible effect moves, with the weights of nuisance_states, known noise and no other effect:

* a single effect, e.g. a tilt that the dwells alone tell from Dx_z: its estimate is t ~ N(c, 1) in its own standard
  uncertainties.  With it the coefficient has the error noise + k (t - c), without it noise - k c; the odds of its being
  there are exp(t^2/2)/SIZE.
* a scatter of groups, e.g. mounts, of which m contrasts are free: their mean square is (1 + s^2) chi^2_m/m in units of
  the noise of a group; a coefficient that rests on the groups has the variance 1 + s^2, whatever is assumed.

The interval is that of the mixture.  Coverage is integrated over the data, for the effect absent and of each size.  If
sizes come as often as the prior has them 95 % hold in the mean, exactly, as of any interval with a probability of 95 %:
what is above 95 % where the effect is absent is paid for by what is below it where there is a small one.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, special, stats

from gyrobench.reduction.estimation.mixture import Mixture
from gyrobench.reduction.estimation.nuisance_states import OCTAVE, SCATTERS, SIZE

Array = NDArray[np.float64]
MANY = 10**6  # degrees of freedom of a noise that is known
STEP = 0.05


def half_width(weight: Array, off: Array, sd: Array) -> float:
    """Half width about the mean of a mixture of normal distributions."""
    off = off - float(weight @ off)
    m = Mixture(weight, off[:, None], np.square(sd)[:, None, None], MANY)
    return float(m.spread(np.eye(1))[1][0])


def single(widening: float, sizes: Array) -> tuple[Array, float]:
    """Coverage for each size (in standard uncertainties of the effect) and its mean over the prior.

    widening: standard uncertainty of the coefficient with the effect over that without.
    """
    k = math.sqrt(widening**2 - 1.0)  # of a noise of 1
    t = np.arange(-60.0, 60.0 + STEP / 2, STEP)
    odds = np.exp(np.minimum(t**2 / 2.0, 600.0)) / SIZE
    p = odds / (1.0 + odds)
    half = np.array([half_width(np.array([1 - q, q]), np.array([0.0, k * x]), np.array([1.0, widening]))
                     for q, x in zip(p, t, strict=True)])  # fmt: skip

    def held(c: float) -> float:
        # with the noise common to both: the error of the mean is noise + k (p t - c)
        off = k * (p * t - c)
        inside = special.ndtr(half - off) - special.ndtr(-half - off)
        return float(np.sum(np.exp(-0.5 * (t - c) ** 2) * inside) * STEP / math.sqrt(2.0 * math.pi))

    c = np.arange(0.0, 40.0 + STEP / 2, STEP)
    lack = 2.0 * integrate.simpson(np.array([0.95 - held(x) for x in c]), x=c)
    mean = 0.95 + 0.5 * (held(0.0) - 0.95) - 0.5 * lack / (SIZE * math.sqrt(2.0 * math.pi))
    return np.array([held(x) for x in sizes]), mean


def scatter(m: int, sizes: Array, octave: float = OCTAVE) -> tuple[Array, float]:
    """Coverage for each size (in standard uncertainties of one constant) and its mean over the prior."""
    s = np.array([0.0, *SCATTERS])
    prior = np.array([1.0, *[octave] * len(SCATTERS)])
    square = np.geomspace(1e-3, 1e6, 3000)  # sum of the squares of the contrasts

    def width(q: float) -> float:
        log = np.log(prior) - m / 2.0 * np.log1p(s**2) + 0.5 * q * s**2 / (1.0 + s**2)
        w = np.exp(log - log.max())
        return half_width(w / w.sum(), np.zeros_like(s), np.sqrt(1.0 + s**2))

    half = np.array([width(q) for q in square])

    def held(size: float) -> float:
        unit = 1.0 + size**2
        density = stats.chi2.pdf(square / unit, m) / unit
        inside = special.erf(half / math.sqrt(2.0 * unit))
        return float(integrate.simpson(density * inside * square, x=np.log(square)))

    every = np.array([held(x) for x in s])
    return np.array([held(x) for x in sizes]), float(prior @ every / prior.sum())


def main() -> None:
    sizes = np.array([0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 10.0])
    print(f"{'size of the effect':<34}" + " ".join(f"{x:>6g}" for x in sizes) + "    mean over the prior")
    for widening in (1.2, 2.0, 5.0, 34.0, 70.0):
        held, mean = single(widening, sizes)
        print(f"single, widens {widening:<19g}" + " ".join(f"{x:6.3f}" for x in held) + f"    {mean:.4f}", flush=True)
    for m in (2, 6, 12):
        for octave in (1.0 / 7.0, 0.3, OCTAVE):
            held, mean = scatter(m, sizes, octave)
            name = f"scatter, {m} contrasts, {octave:.2g}"
            print(f"{name:<34}" + " ".join(f"{x:6.3f}" for x in held) + f"    {mean:.4f}", flush=True)


if __name__ == "__main__":
    main()
