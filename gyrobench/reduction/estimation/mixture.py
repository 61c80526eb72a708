"""Mixture of t distributions over candidate noise models: standard deviation, 95 % half width, tails.

Every candidate gives an estimate, a covariance and a weight (:mod:`gyrobench.reduction.estimation.noise_mixture_fit`,
:mod:`gyrobench.reduction.series.column_regression`).
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.uncertainty import NORMAL

DOUBT = 0.05  # probability from which on a verdict must hold if the noise is slow drift, too
RESOLVED = 1e-8  # of a variance: what is left of it beside a known part is lost in rounding below
LIGHT = 1e-5  # candidates this much less likely than the likeliest are left out of the intervals


@dataclass(frozen=True)
class Mixture:
    """Candidates that count: weights (g,), their estimates less the mean (g, p), covariances (g, p, p), t's dof.

    known (p, p): the part of the covariance that errors of known size make under the likeliest noise model, as the
    lines of a budget have it, known_each (g, p, p): of each candidate; None without such.
    """

    weight: Array
    off: Array
    covariance: Array
    dof: int
    slow: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(1, bool))  # (g,): with drift slower than SLOW
    known: Array | None = None
    known_each: Array | None = None

    def spread(self, J: Array) -> tuple[Array, Array]:
        """Standard deviation and 95 % half width, of type A, of the combinations J (q, p) of the coefficients.

        Errors of known size are in the covariances of the candidates and taken out here; combine_uncertainties() adds
        them source by source.  What is left makes the whole with them again, or more: it is no less than without them
        in each candidate.
        """
        off, (each, dof) = self.off @ J.T, self._each(J)
        half = _half_width(self.weight, off, each, dof)
        sd = np.sqrt(self.weight @ (each**2 + off**2))
        if self.known is None or self.known_each is None:
            return sd, half
        known = np.einsum("qi,ij,qj->q", J, self.known, J)
        least = sd**2 - np.einsum("qi,gij,qj,g->q", J, self.known_each, J, self.weight)
        k = np.minimum(half / np.maximum(sd, 1e-300), NORMAL)
        least = np.maximum(least, RESOLVED * sd**2)
        return np.sqrt(np.maximum(sd**2 - known, least)), np.sqrt(np.maximum(half**2 - k**2 * known, k**2 * least))

    def _each(self, J: Array) -> tuple[Array, Array]:
        """Standard deviations (g, q) of the combinations and their degrees of freedom, those of the noise or, where a
        part of the variance is known, by Welch and Satterthwaite.
        """
        variance = np.einsum("qi,gij,qj->gq", J, self.covariance, J)
        dof = np.full(variance.shape, float(self.dof))
        if self.known_each is not None:
            noise = variance - np.einsum("qi,gij,qj->gq", J, self.known_each, J)
            variance = np.maximum(variance, 1e-300)
            dof *= np.square(variance / np.maximum(noise, 1e-2 * variance))
        return np.sqrt(np.maximum(variance, 0.0)), dof

    def if_slow(self, J: Array) -> tuple[float, Array]:
        """Return the probability of slow drift, and the 95 % half widths of the combinations, of type A and about the
        mean of all candidates, if that is the noise; zeros where it is less probable than DOUBT.
        """
        probability = float(self.weight[self.slow].sum())
        if probability < DOUBT:
            return probability, np.zeros(len(J))
        sd, dof = (x[self.slow] for x in self._each(J))
        half = _half_width(self.weight[self.slow] / probability, self.off[self.slow] @ J.T, sd, dof)
        if self.known is None:
            return probability, half
        known = NORMAL**2 * np.einsum("qi,ij,qj->q", J, self.known, J)
        return probability, np.sqrt(np.maximum(half**2 - known, 0.0))

    def outside(self, J: Array, distance: Array) -> Array:
        """Return the probability that a combination lies farther than ``distance`` (q,) from its mean."""
        sd, dof = self._each(J)
        return _tails(self.weight, self.off @ J.T, np.maximum(sd, 1e-150), dof, distance)


def _tails(w: Array, off: Array, sd: Array, dof: Array, distance: Array) -> Array:
    """Return the probability of the mixture outside +-distance from its mean, per coefficient."""
    upper = special.stdtr(dof, -(distance - off) / sd)
    lower = special.stdtr(dof, -(distance + off) / sd)
    out: Array = w @ (upper + lower)
    return np.clip(out, 0.0, 1.0)


def _nearly(dof: Array, t: Array) -> Array:
    """The t distribution to 3e-6 from ten degrees of freedom on, in a fraction of the time: the normal one up to u,

    z = sqrt((dof - 1/2) ln(1 + t^2/dof)),   u = z + (z^3 + 3 z)/(48 (dof - 1/2)^2)               [Hill 1970]
    """
    a = dof - 0.5
    z = np.copysign(np.sqrt(a * np.log1p(t * t / dof)), t)
    return np.asarray(special.ndtr(z * (1.0 + (z * z + 3.0) / (48.0 * a * a))))


def _half_width(w: Array, off: Array, sd: Array, dof: Array, level: float = 0.95) -> Array:
    """Distance from the mean that the mixture goes beyond with a probability of 1 - level, per coefficient.

    Newton's method between bounds that close in; bisection where a narrow candidate makes it creep.  First on tails
    that take little time, so that one or two steps on those of the t distribution are left.
    """
    first = dof.flat[0]
    quantile = special.stdtrit(first if np.all(dof == first) else dof, 0.5 + level / 2)
    far = np.max(np.abs(off) + quantile * sd, axis=0)
    x = np.minimum(np.min(np.broadcast_to(quantile, sd.shape), axis=0) * np.sqrt(w @ (sd**2 + off**2)), far)
    size = np.maximum(sd, 1e-300)
    both, half = np.array([off, -off]), -(dof + 1.0) / 2.0
    height = np.exp(special.gammaln(-half) - special.gammaln(dof / 2.0)) / np.sqrt(dof * math.pi) / size
    # the error after a step of Newton's is of the order of its square
    for distribution, near in ((_nearly, 1e-4), (special.stdtr, 1e-7)) if len(w) > 1 else ((special.stdtr, 1e-7),):
        low, high = np.zeros_like(far), far
        for k in range(40):
            with np.errstate(over="ignore"):  # a constant that a combination does not have: sd 0
                t = (both - x) / size
                excess = w @ distribution(dof, t).sum(axis=0) - (1.0 - level)
                density = w @ (height * np.exp(half * np.log1p(t * t / dof)).sum(axis=0))
            low, high = np.where(excess > 0.0, x, low), np.where(excess > 0.0, high, x)
            step = x + excess / np.maximum(density, 1e-300)
            inside = (step >= low) & (step <= high) & (k < 12)
            new = np.where(inside, step, (low + high) / 2.0)
            done = bool(np.all(np.abs(new - x) <= np.where(inside, near, near / 1e3) * high))
            x = new
            if done:
                break
    return np.asarray(x)


@functools.cache
def _quantiles() -> tuple[Array, Array]:
    """Falling 97.5 % points of t distributions and their degrees of freedom."""
    dof = np.concatenate([np.arange(1.0, 30.0, 0.25), np.geomspace(30.0, 1e4, 60)])
    return special.stdtrit(dof, 0.975), dof


def equivalent_dof(ratio: Array) -> Array:
    """Return the degrees of freedom whose t quantile over one standard uncertainty (of the scaled t) is ``ratio``."""
    quantile, dof = _quantiles()
    out = np.interp(ratio, quantile[::-1], dof[::-1])
    return np.asarray(np.where(ratio <= quantile[-1], np.inf, out))
