"""Outliers of a lot by robust Mahalanobis distances.

Ordinary distances are masked: a few bad instruments pull mean and covariance towards themselves.  The search starts
from the half of the lot with the smallest covariance determinant (P. Rousseeuw and K. Van Driessen, Technometrics 41
(1999) 212) and lets every instrument back in that the accepted ones do not reject (as A. Hadi, J. R. Stat. Soc. B 54
(1992) 761).  The last judgement is that of each instrument against all accepted others: with m accepted ones in p
coefficients, d² of one more follows p (m + 1)(m - 1) / (m (m - p)) F(p, m - p) in normal lots, so the chance that a lot
without outliers names any is about ``level``, whatever its size.  Beside the distance in all coefficients each is
judged by itself, half the chance for either: one coefficient that is far off is diluted among many.

Not modelled: lots of mixed populations (two batches), and heavy-tailed ones, whose tails are named as outliers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, stats

from gyrobench.arrays import Array

Mask = NDArray[np.bool_]

LEVEL = 0.01  # chance of naming any instrument of a lot without outliers
STARTS = 150  # random subsets with which the search for the smallest determinant begins
FOLLOWED = 10  # of them, until the determinant no longer falls
ROUNDS = 30
MIN_PER_COEFFICIENT = 5  # instruments for each coefficient of a joint distance
MIN_INSTRUMENTS = 8
USUAL = 0.5  # share of the instruments that have a coefficient, from which on it is part of the distance
WEIGHTED = 0.975  # quantile of chi-square up to which the first distances accept


@dataclass(frozen=True)
class LotOutliers:
    """Robust distances of n instruments in q coefficients.

    joint: one distance in all used coefficients; else the largest of the coefficients one by one, for a small lot.
    distance: (n,), NaN where a coefficient is missing.  p: (n,), the smallest of the distance and of the coefficients,
    times the number of judgements.
    outlier: (n,).  score: (n, q), deviation from the mean of the accepted over their standard deviation, NaN for
    coefficients that are not used.  used: (q,), coefficients that most rows have, that vary and are not combinations of
    others.  limit: distance above which an instrument is named; one that is named below it is so by one coefficient.
    """

    joint: bool
    distance: Array
    p: Array
    outlier: Mask
    score: Array
    used: Mask
    limit: float


def robust_outliers(values: Array) -> LotOutliers | None:
    """Return the robust distances of the rows of ``values`` (n, q); None for fewer than eight complete rows.

    Coefficients that half of the rows lack are left out; rows that lack another are not judged.
    """
    x = np.asarray(values, float)
    known = np.isfinite(x)
    usual = known.sum(axis=0) > USUAL * known.any(axis=1).sum()
    complete = known[:, usual].all(axis=1) & known.any(axis=1)
    n = int(complete.sum())
    if n < MIN_INSTRUMENTS:
        return None
    inside = np.where(usual, x[complete], 0.0)  # a constant, which is not used
    used = _independent(inside)
    if not used.any():
        return None
    p = int(used.sum())
    joint = n >= MIN_PER_COEFFICIENT * p
    alone = [np.array([k]) for k in np.flatnonzero(used)]
    together = [np.flatnonzero(used)] if joint and p > 1 else []
    distance, chance, limit = np.zeros(n), np.ones(n), 0.0
    score = np.full(inside.shape, np.nan)
    for group in [*alone, *together]:
        many = group.size > 1
        count = n * (1 if many else p) * (2 if together else 1)
        scaled = _scaled(inside[:, group])
        accepted = _accepted(scaled, LEVEL / count, np.random.default_rng(1))
        d2, tail, limit2 = _judged(scaled, accepted, LEVEL / count)
        chance = np.fmin(chance, count * tail)
        if many:
            distance, limit = np.sqrt(d2), float(np.sqrt(limit2))
        elif not together:
            distance, limit = np.fmax(distance, np.sqrt(d2)), max(limit, float(np.sqrt(limit2)))
        kept = scaled[accepted]
        score[:, group] = (scaled - kept.mean(axis=0)) / kept.std(axis=0, ddof=1)
    return LotOutliers(
        joint,
        _spread(distance, complete),
        _spread(np.minimum(1.0, chance), complete),
        np.where(complete, _spread(chance, complete) < LEVEL, False),
        _spread(score, complete),
        used,
        limit,
    )


def _spread(values: Array, rows: Mask) -> Array:
    """Return the values in their rows, NaN elsewhere."""
    found = np.full((len(rows), *values.shape[1:]), np.nan)
    found[rows] = values
    return found


def _scaled(x: Array) -> Array:
    """Return the columns from their median, over their median absolute deviation (where this is 0: their deviation)."""
    x = x - np.median(x, axis=0)
    mad = np.median(np.abs(x), axis=0)
    return np.asarray(x / np.where(mad > 0.0, mad, np.maximum(x.std(axis=0), np.finfo(float).tiny)))


def _independent(x: Array) -> Mask:
    """Return which columns vary and are not a combination of those before (to 1e-8 of their deviation)."""
    used = np.zeros(x.shape[1], bool)
    varies = np.ptp(x, axis=0) > 1e-12 * np.abs(x).max(axis=0)
    scaled = _scaled(x)
    for k in np.flatnonzero(varies):
        rest = scaled[:, k] - scaled[:, k].mean()
        if used.any():
            others = scaled[:, used] - scaled[:, used].mean(axis=0)
            rest = rest - others @ linalg.lstsq(others, rest)[0]
        used[k] = bool(np.linalg.norm(rest) > 1e-8 * np.linalg.norm(scaled[:, k]))
    return used


def _accepted(x: Array, each: float, rng: np.random.Generator) -> Mask:
    """Return the rows that the accepted rows do not reject, grown from the half with the smallest determinant."""
    n, p = x.shape
    half = (n + p + 1) // 2
    core = _smallest_determinant(x, half, rng)
    d2 = _squared_distances(x, core)
    d2 *= stats.chi2.median(p) / np.median(d2)
    inner = d2 <= stats.chi2.ppf(WEIGHTED, p)
    # the covariance of what a chi-square quantile cuts off, back to that of the population
    shrunk = stats.chi2.cdf(stats.chi2.ppf(WEIGHTED, p), p + 2) / WEIGHTED
    accepted: Mask = _squared_distances(x, inner) * shrunk <= _limit(int(inner.sum()), p, each)
    for _ in range(ROUNDS):
        _, tail, _ = _judged(x, accepted, each)
        again = tail >= each
        if (again == accepted).all():
            break
        accepted = again
    return accepted


def _smallest_determinant(x: Array, half: int, rng: np.random.Generator) -> Mask:
    """Return the ``half`` rows with the smallest covariance determinant, by concentration steps from random subsets."""
    n, p = x.shape
    trials: list[tuple[float, int, Mask]] = []
    for _ in range(STARTS):
        rows = np.zeros(n, bool)
        rows[rng.choice(n, p + 1, replace=False)] = True
        for _ in range(2):
            rows = _closest(x, rows, half)
        trials.append((_log_determinant(x[rows]), len(trials), rows))
    best: tuple[float, Mask] | None = None
    for value, _, start in sorted(trials, key=lambda t: t[:2])[:FOLLOWED]:
        rows = start
        for _ in range(ROUNDS):
            closer = _closest(x, rows, half)
            if (closer == rows).all():
                break
            rows, value = closer, _log_determinant(x[closer])
        if best is None or value < best[0]:
            best = value, rows
    assert best is not None
    return best[1]


def _closest(x: Array, rows: Mask, half: int) -> Mask:
    order = np.argsort(_squared_distances(x, rows), kind="stable")
    closest = np.zeros(len(x), bool)
    closest[order[:half]] = True
    return closest


def _log_determinant(x: Array) -> float:
    return float(np.linalg.slogdet(np.atleast_2d(np.cov(x, rowvar=False)))[1])


def _squared_distances(x: Array, rows: Mask) -> Array:
    """Return d² of all rows from mean and covariance of some; a singular covariance is widened by a millionth."""
    off = x - x[rows].mean(axis=0)
    covariance = np.atleast_2d(np.cov(x[rows], rowvar=False))
    covariance = covariance + 1e-12 * max(float(np.trace(covariance)), 1e-300) * np.eye(len(covariance))
    return np.asarray(np.einsum("ij,ij->i", off, linalg.solve(covariance, off.T, assume_a="pos").T))


def _limit(m: int, p: int, each: float) -> float:
    """Return the d² above which one more row is rejected by m accepted ones."""
    return float(p * (m + 1) * (m - 1) / (m * (m - p)) * stats.f.isf(each, p, m - p))


def _judged(x: Array, accepted: Mask, each: float) -> tuple[Array, Array, float]:
    """Return d² of each row from all accepted others, its p, and the limit of d².

    For an accepted row, mean and covariance are those without it: with q = m d² / (m - 1)² of the distance with it,
    d² without is (m - 2) m / (m - 1) q / (1 - q), which takes no second decomposition.
    """
    p = x.shape[1]
    m = int(accepted.sum())
    d2 = _squared_distances(x, accepted)
    q = np.clip(m * d2 / (m - 1) ** 2, 0.0, 1.0 - 1e-12)
    d2 = np.where(accepted, (m - 2) * m / (m - 1) * q / (1.0 - q), d2)
    others = np.where(accepted, m - 1.0, float(m))
    tail: Array = stats.f.sf(d2 * others * (others - p) / (p * (others + 1) * (others - 1)), p, others - p)
    return d2, tail, _limit(m, p, each)
