"""Whether slow drift falls faster than its terms do, as a smooth curve that is no noise does, or is less than they are.

Of ordinates of power P and count c under a spectrum S with the part s of slow terms, P/S - c has variance 2 c.  A tilt
of s adds s/S (log omega - its mean), the mean such that the size of s takes nothing of it: the sum of the products is
large and negative where the first ordinates exceed S and the next ones fall short of it.  Its distribution is that of
draws of chi squared.  What a walk of the same steepness looks like no record tells from a curve.

Of the first ordinates the sum of P/S is chi squared of c: far less is what a filter leaves that takes the bias off.
[DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import math

import numpy as np
from scipy.stats import chi2

from gyrobench.reduction.noise_model.maximum import Fitted
from gyrobench.reduction.noise_model.ordinates import joined, spectrum, split
from gyrobench.reduction.noise_model.search import ModelSearch
from gyrobench.reduction.noise_model.terms import SLOW

SLOW_PART, FEWEST = 0.3, 4  # of the spectrum that slow noise is, and ordinates where it is more
DRAWS, SEED = 4000, 6203
START = 8  # ordinates at least, and the part of all at most, that are the slowest


def weak_start(found: ModelSearch, at: Fitted) -> float:
    """Return the probability that the slowest ordinates together, as many as have the least, are so small by chance;
    the first is left out, as in steep_fall.
    """
    omega, count = found.data.grid.omega, found.data.all_count
    S, _ = found.excess(at)
    # the errors of the end angles are two numbers of each stretch, which may be small
    S = S - 2.0 * float(found.data.angle(at.model, at.p)) * found.data.all_ends**2
    order = np.argsort(omega)
    order = order[omega[order] > 1.5 * math.pi / float(found.data.n.max())]
    c, total = np.cumsum(count[order]), np.cumsum((found.data.all_power / S)[order])
    ends = np.flatnonzero((c >= START) & (c <= c[-1] / START))
    least = float(np.min(chi2.cdf(total[ends], c[ends]), initial=1.0))
    return min(1.0, least * math.log2(c[-1])) if ends.size else 1.0  # independent lengths: about one an octave


def steep_fall(found: ModelSearch, at: Fitted) -> float:
    """Return the probability of so steep a fall of the slow drift by chance; 1.0 where there is too little of it.

    The first ordinate is left out: most of it is the ramp's.
    """
    grid, count = found.data.grid, found.data.all_count
    parts = split(at.model, at.p)
    fast = [(t, p) for t, p in parts if t.name not in SLOW]
    S, excess = found.excess(at)
    slow = spectrum(at.model, at.p, grid) - (spectrum(*joined(fast), grid) if fast else 0.0)
    share = slow / S
    use = (share > SLOW_PART) & (grid.omega > 1.5 * math.pi / float(found.data.n.max()))
    if np.count_nonzero(use) < FEWEST:
        return 1.0
    share, count, log = share[use], count[use], np.log(grid.omega[use])
    tilt = share * (log - float(np.average(log, weights=count * share**2)))
    chance = np.random.default_rng(SEED).gamma(0.5 * count, 2.0, (DRAWS, count.size)) - count
    return float(np.mean(chance @ tilt <= float(excess[use] @ tilt)))
