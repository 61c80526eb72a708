"""Least squares over readings at places that are visited repeatedly, with the variances found from the residuals.

A reading has an error of its visit, one that returns at its place (rounding of the counts, what harmonics leave), and,
read by an autocollimator, a random walk with the time:

    V = s2 I + t2 (same place) + w2 min(t, t')            each part of its own rows

The variances are those of restricted maximum likelihood (Patterson and Thompson), none below its least.  Where a walk
and the errors of visits are all there is, the fit is averaged over the size of the walk instead
(:func:`averaged_over_walk`): a walk that hides under the noise is often estimated as none.
[TABLE-POSITION; derived]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.optimize import brentq, nnls

from gyrobench.reduction.loops.loop_toolkit import Array

ROUNDS = 30  # of variances and weights, at most
REDUNDANT = 0.1  # rows more than values; fewer are rounding of the arithmetic
ALONE = 1e-9  # of the largest information of a combination of variances: less is none
SAME = 1e-3  # relative change of the variances at which they stay
STILL = 0.25  # probability that nothing walks, before the data are seen
#: variance of a walk at its end over that of a visit, all but none equally likely
WALKS = np.concatenate([[0.0], np.geomspace(0.1, 3000.0, 13)])
NOTHING = 1e-9  # of the variance of the data: the least of a visit


@dataclass(frozen=True)
class Part:
    """A part of the covariance of the data: its shape (n, n), and its least variance, SI squared.

    least: what is known of rounding, which distorts a wave of a few counts in its own harmonics too, where the
    residuals do not show it.
    """

    shape: Array
    least: float = 0.0


def visits(rows: slice, place: NDArray[np.int64], least: float = 0.0) -> list[Part]:
    """Return the parts of each visit and, where places are visited repeatedly, of what returns at them.

    least: of what returns, or of all where no place is visited twice.
    """
    inside = np.zeros(place.size)
    inside[rows] = 1.0
    same = (place[:, None] == place[None, :]) * np.outer(inside, inside)
    if not np.any(same.sum(axis=1) > 1.5):
        return [Part(np.diag(inside), least)]
    return [Part(np.diag(inside)), Part(same, least)]


def walk(rows: slice, t: Array, group: NDArray[np.int64]) -> Part:
    """Return the part of a random walk with the time t (n,), which starts anew in each group (n,)."""
    start = np.zeros(t.size)
    for g in np.unique(group):
        start[group == g] = t[group == g].min()
    inside = np.zeros(t.size)
    inside[rows] = 1.0
    since = t - start
    shape = np.minimum(since[:, None], since[None, :]) * (group[:, None] == group[None, :]) * np.outer(inside, inside)
    return Part(shape / max(float(np.max(shape)), 1e-300))


@dataclass(frozen=True)
class PlacesFit:
    """Estimates with their standard uncertainties (type A).

    variance: of the visits of the first rows, SI squared, 0 if nothing is left for it beside the other parts, with its
    degrees of freedom free.  redundant: the residuals of these rows show variances at all.
    """

    value: Array
    u: Array
    X: Array
    gain: Array  # value = gain y
    V: Array  # covariance of y
    variance: float
    free: float
    redundant: bool
    shapes: list[Array]  # of the parts whose variances are found
    error: Array  # covariance of these variances

    def freedom(self, gain: Array) -> float:
        """Return the degrees of freedom of gain y (n,): those of the variances that make its u (Satterthwaite)."""
        each = np.array([gain @ shape @ gain for shape in self.shapes])  # d u2 / d variance
        square = float(gain @ self.V @ gain) ** 2
        return max(2.0 * square / max(float(each @ self.error @ each), 1e-4 * square), 3.0)


def least_squares(X: Array, y: Array, parts: Sequence[Part]) -> PlacesFit:
    """Return the generalized least squares solution with the variances of the parts; the first is that of a visit.

    A variance that is at its least is known.
    """
    scale = float(np.var(y)) + 1e-30
    own = np.array([np.count_nonzero(p.shape) == np.count_nonzero(np.diag(p.shape)) for p in parts])
    least = np.maximum(np.where(own, NOTHING, 0.0), np.array([p.least for p in parts]) / scale)
    variances = np.maximum(np.where(own, 1.0, 0.0), least)
    for _ in range(ROUNDS):
        _, _, information, score = _weighed(X, y / math.sqrt(scale), parts, variances)
        last, variances = variances, least + _not_negative(information, score - information @ least)
        if np.allclose(variances, last, rtol=SAME, atol=0.0):
            break
    V, covariance, information, _ = _weighed(X, y, parts, variances * scale)
    gain = covariance @ X.T @ np.linalg.inv(V)
    u2, found = np.diag(covariance), variances > least
    known = information[np.ix_(found, found)]
    unit = np.outer(_units(known), _units(known))
    error = 2.0 * unit * np.linalg.pinv(known * unit, rcond=ALONE)  # covariance of the variances
    redundant = float(np.sum(np.diag(parts[0].shape) * (1.0 - np.sum(X * gain.T, axis=1)))) > REDUNDANT
    told = redundant and bool(found[0])
    free = max(2.0 * (variances[0] * scale) ** 2 / float(error[0, 0]), 1.0) if told else 1.0
    variance = float(variances[0]) * scale if told else 0.0
    shapes = [p.shape for p, is_found in zip(parts, found, strict=True) if is_found]
    return PlacesFit(gain @ y, np.sqrt(u2), X, gain, V, variance, free, redundant, shapes, error)


@dataclass(frozen=True)
class Averaged:
    """Estimates, their standard uncertainties and the coverage factors of 95 %; dof: of the residuals."""

    value: Array
    u: Array
    k: Array
    dof: float


def averaged_over_walk(X: Array, y: Array, part: Part) -> Averaged:
    """Return the mean over walks of the generalized least squares solutions, weighed by their restricted likelihood.

    V = s2 (I + r shape) with r of :data:`WALKS`.  With a flat prior of the values and of log s the likelihood of r is
    |V|^-1/2 |X' V^-1 X|^-1/2 (y' P y)^-(n-p)/2, and the values are t distributed with n - p degrees of freedom; the
    interval is that of the mixture.
    """
    n, p = X.shape
    dof = float(n - p)
    size, axes = np.linalg.eigh(part.shape)
    size, Z, z = np.maximum(size, 0.0), axes.T @ X, axes.T @ y
    score, values, spreads = [], [], []
    for r in WALKS:
        w = 1.0 / (1.0 + r * size)
        normal = Z.T @ (w[:, None] * Z)
        covariance = np.linalg.inv(normal)
        found = covariance @ (Z.T @ (w * z))
        square = float(w @ (z - Z @ found) ** 2) + 1e-300
        score.append(0.5 * (float(np.sum(np.log(w))) - np.linalg.slogdet(normal)[1] - dof * math.log(square)))
        values.append(found)
        spreads.append(np.sqrt(np.diag(covariance) * square / dof))
    prior = np.where(WALKS > 0.0, (1.0 - STILL) / (WALKS.size - 1), STILL)
    weight = prior * np.exp(np.array(score) - max(score))
    weight /= weight.sum()
    b, s = np.array(values), np.array(spreads)
    value = weight @ b
    u = np.sqrt(weight @ (s**2 * dof / max(dof - 2.0, 1.0) + (b - value) ** 2))
    half = np.array([_half_width(weight, b[:, j] - value[j], s[:, j], dof) for j in range(p)])
    return Averaged(value, u, np.divide(half, u, out=np.full(p, 2.0), where=u > 0.0), dof)


def _half_width(weight: Array, off: Array, spread: Array, dof: float) -> float:
    """Return h with a probability of 95 % within +-h of a mixture of t distributions."""
    if not np.all(spread > 0.0):
        return 0.0

    def missing(h: float) -> float:
        inside = special.stdtr(dof, (h - off) / spread) - special.stdtr(dof, (-h - off) / spread)
        return float(weight @ inside) - 0.95

    return float(brentq(missing, 0.0, 1e3 * float(np.max(np.abs(off) + spread))))


def _not_negative(F: Array, q: Array) -> Array:
    """Return x >= 0 of the least x' F x / 2 - q' x."""
    unit = _units(F)  # the two readings may differ by orders in their variances
    size, axes = np.linalg.eigh(F * np.outer(unit, unit))
    root = np.sqrt(np.where(size > ALONE * size[-1], size, 0.0))
    y = np.divide(axes.T @ (unit * q), root, out=np.zeros_like(q), where=root > 0.0)
    return np.asarray(unit * nnls(root[:, None] * axes.T, y)[0])


def _units(F: Array) -> Array:
    """Return the units in which each variance has an information of 1; 0 where it has none."""
    own = np.diag(F)
    return np.asarray(np.divide(1.0, np.sqrt(np.maximum(own, 0.0)), out=np.zeros_like(own), where=own > 0.0))


def _weighed(X: Array, y: Array, parts: Sequence[Part], variances: Array) -> tuple[Array, Array, Array, Array]:
    """Return V, the covariance of the values, and information F and score q of the variances, F variances = q.

    F_ij = tr(P V_i P V_j), q_i = y' P V_i P y, P = W - W X (X' W X)^-1 X' W.
    """
    V: Array = 1e-12 * float(np.max(variances)) * np.eye(y.size)
    for v, p in zip(variances, parts, strict=True):
        V = V + v * p.shape
    W: Array = np.asarray(np.linalg.inv(V), dtype=np.float64)
    covariance: Array = np.asarray(np.linalg.inv(X.T @ W @ X), dtype=np.float64)
    P = W - W @ X @ covariance @ X.T @ W
    shaped = [P @ p.shape for p in parts]
    information = np.array([[np.sum(a * b.T) for a in shaped] for b in shaped])
    score = np.array([y @ a @ P @ y for a in shaped])
    return V, covariance, information, score
