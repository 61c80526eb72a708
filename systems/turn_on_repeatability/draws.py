"""Warm-ups that a record allows: sizes and time constants by chance, an exponential that is hardly seen among them.

    p(tau, A | y) ~ exp(-|y - sum A m(tau)|2/2 sigma2) p(A_q)        A_q by chance of the size found, ln tau even

Where one exponential was found, a second of its size may be there: intervals of a fit without it are too narrow, and
whether it is there is not known to the fit.  A size that is itself by chance, small ones as likely as large ones,
favours a record of one: of two exponentials taken for one it held sizes and times in 0.87 to 0.90.  Sizes go out of
the posterior in closed form; ln tau is drawn by differential evolution (Braak 2006).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gyrobench.arrays import Array

from .warming import Curves

WALKERS, ROUNDS, KEPT = 100, 100, 25


class Posterior:
    """of: kinds of the exponentials, the first of kind 0; doubtful: rms of the size of the last of them by chance."""

    def __init__(self, curves: Curves, of: Sequence[int], variance: float, doubtful: float | None) -> None:
        self.curves, self.of, self.variance = curves, list(of), variance
        self.q, self.doubtful = len(self.of), doubtful
        self.low, self.high = np.full(self.q, curves.low), np.full(self.q, curves.high)
        if doubtful is not None:
            self.low[-1] = curves.first  # faster ones are over before the record sees them

    def of_sizes(self, at: Array) -> tuple[Array, Array, Array]:
        """Return ln of the density (w,) at (w, q) but for a constant; mean (w, q) and precision (w, q, q) of sizes."""
        A = self.curves.at(at, self.of)
        P = np.swapaxes(A, 1, 2) @ A / self.variance
        b = np.einsum("wdq,d->wq", A, self.curves.y) / self.variance
        size = np.sqrt(np.maximum(np.einsum("wqq->wq", P), 1e-300))
        known = self.q - (self.doubtful is not None)
        R = P / (size[:, :, None] * size[:, None, :]) + 1e-10 * np.eye(self.q)
        flat = 0.5 * np.linalg.slogdet(R[:, :known, :known])[1] + np.sum(np.log(size[:, :known]), axis=1)
        if self.doubtful is not None:
            R[:, -1, -1] += 1.0 / (self.doubtful * size[:, -1]) ** 2
        mean = np.linalg.solve(R, (b / size)[..., None])[..., 0]
        log = (
            0.5 * np.sum(mean * b / size, axis=1) - 0.5 * np.linalg.slogdet(R)[1] - np.sum(np.log(size), axis=1) + flat
        )
        inside = np.all((at >= self.low) & (at <= self.high), axis=1)
        return np.where(inside, log, -np.inf), mean / size, R * (size[:, :, None] * size[:, None, :])

    def drawn(self, start: Array, spread: Array) -> tuple[Array, Array, Array]:
        """Return sizes (m, q), ln tau (m, q) and levels (m,), means of the coefficients of X.

        start: ln tau (q0,) as found, spread: their standard uncertainties; those not among them start anywhere.
        """
        rng = np.random.default_rng(2)
        d = self.low.size
        x = rng.uniform(self.low, self.high, (WALKERS, d))
        known = start.size
        x[:, :known] = start + spread * rng.normal(size=(WALKERS, known))
        x = np.clip(x, self.low, self.high)
        log = self.of_sizes(x)[0]
        kept, half = [], WALKERS // 2
        for k in range(ROUNDS):
            for own in (np.arange(half), np.arange(half, WALKERS)):
                others = (own[0] + half + np.argsort(rng.random((half, half)), axis=1)[:, :2]) % WALKERS
                scale = 1.0 if k % 5 == 4 else 2.38 / math.sqrt(2.0 * d)
                step = scale * (x[others[:, 0]] - x[others[:, 1]])
                new = x[own] + step * rng.uniform(0.5, 1.2, (half, 1)) + 1e-6 * rng.normal(size=(half, d))
                found = self.of_sizes(new)[0]
                taken = np.log(rng.random(half)) < found - log[own]
                x[own], log[own] = np.where(taken[:, None], new, x[own]), np.where(taken, found, log[own])
            if k >= ROUNDS // 2 and k % (ROUNDS // 2 // KEPT) == 0:
                kept.append(x.copy())
        at = np.concatenate(kept)
        _, mean, P = self.of_sizes(at)
        L = np.linalg.cholesky(P)
        z = rng.normal(size=(*mean.shape, 1))
        size, log_tau = mean + np.linalg.solve(np.swapaxes(L, 1, 2), z)[..., 0], at
        c = self.curves
        level = c.level + math.sqrt(self.variance * c.level_variance) * rng.normal(size=len(at))
        for j, k in enumerate(self.of):
            level = level - size[:, j] * c.levels[k](log_tau[:, j])
        return size, log_tau, level
