"""Sines of known frequencies in a stretch: their sizes by the samples that are there, each frequency by its own noise.

Without missing samples sines are orthogonal to the noise at other frequencies, and ordinary least squares do.  With a
part missing at random, that part of the power of the whole record is noise of a sine everywhere: under a filter that
holds the noise 10^4 below, sines of nothing are a hundred times what is there.  Then they are of generalized least
squares, beta = (X'W X)^-1 X'W y with the weight W of the samples that are there: W x is the product of the precision
with x completed.  The spectrum of that weight is even across a line, which would weigh itself down.
[DRIFT-PERIODIC, DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.gap_completion import Completed, completed_by
from gyrobench.reduction.noise_model.precision import Precision, even_across, ordinates, smooth_spectrum
from gyrobench.reduction.series.lines import LEVEL, SpectralLine

CHUNK = 1 << 17  # samples of a sine computed at a time
CYCLES = 3.0  # in a stretch, at least


def standing(y: Array, done: Completed, lines: Sequence[SpectralLine]) -> tuple[SpectralLine, ...]:
    """Return the lines that the samples of a stretch y (n,) that are there show, NaN where one is missing, with the
    amplitudes and phases that they have; found in what was completed, which may hold one up that is not there.
    """
    gone = _gone(y, done)
    if not gone.size or not lines:
        return tuple(lines)
    beta, covariance = _weighted(done, gone, np.array([x.frequency for x in lines]))
    found = list[SpectralLine]()
    for i, line in enumerate(lines):
        own = slice(2 * i, 2 * i + 2)
        (c, s), mine = beta[own].tolist(), covariance[own, own]
        if float(beta[own] @ np.linalg.solve(mine, beta[own])) > 2.0 * math.log(y.size / LEVEL):
            amplitude, u = math.hypot(c, s), math.sqrt(0.5 * float(np.trace(mine)))
            phase = math.atan2(c, s) - math.pi * line.frequency * y.size  # of c cos + s sin about the middle
            u_frequency = line.u_frequency * (u / amplitude) / (line.u_amplitude / line.amplitude)
            found.append(replace(line, amplitude=amplitude, u_amplitude=u, u_frequency=u_frequency,
                                 phase=(phase + math.pi) % (2.0 * math.pi) - math.pi))  # fmt: skip
    return tuple(found)


def sines_of(y: Array, done: Completed, lines: Sequence[SpectralLine]) -> Array:
    """Return the sines (n,) of the lines in a stretch y (n,), NaN where a sample is missing."""
    frequencies = np.array([x.frequency for x in lines if x.frequency * y.size > CYCLES])
    if not frequencies.size:
        return np.zeros(y.size)
    gone = _gone(y, done)
    return _sum(_weighted(done, gone, frequencies)[0] if gone.size else _ordinary(y, frequencies), y.size, frequencies)


def _gone(y: Array, done: Completed) -> NDArray[np.int64]:
    return np.union1d(np.flatnonzero(~np.isfinite(y)), done.wild)


def _columns(n: int, frequencies: Array) -> Iterator[tuple[slice, Array]]:
    """Yield parts of n samples with cosine and sine of each frequency about the middle, a level and a slope."""
    for a in range(0, n, CHUNK):
        t = np.arange(a, min(a + CHUNK, n)) - 0.5 * n
        phase = 2.0 * math.pi * frequencies[:, None] * t
        waves = np.stack([np.cos(phase), np.sin(phase)], axis=1).reshape(-1, t.size)
        yield slice(a, a + t.size), np.concatenate([waves, np.ones((1, t.size)), t[None] / n])


def _sum(beta: Array, n: int, frequencies: Array) -> Array:
    """Return the sines (n,) of sizes beta (2 k,)."""
    parts: list[Array] = [beta @ X[: beta.size] for _, X in _columns(n, frequencies)]
    return np.concatenate(parts)


def _ordinary(y: Array, frequencies: Array) -> Array:
    """Return the sizes (2 k,) of cosine and sine of each frequency, of least squares beside level and slope."""
    size = 2 * frequencies.size
    M, right = np.zeros((size + 2, size + 2)), np.zeros(size + 2)
    for part, X in _columns(y.size, frequencies):
        M += X @ X.T
        right += X @ y[part]
    return np.asarray(np.linalg.lstsq(M, right, rcond=1e-12)[0][:size], dtype=float)


def _weighted(done: Completed, gone: NDArray[np.int64], frequencies: Array) -> tuple[Array, Array]:
    """Return the sizes (2 k,) of cosine and sine of each frequency in a completed stretch by its samples that are not
    ``gone``, and their covariance.
    """
    n, size = done.x.size, 2 * frequencies.size
    first = _ordinary(done.x, frequencies)
    rest = done.x - _sum(first, n, frequencies)
    S = even_across(smooth_spectrum(ordinates(rest) ** 2 + done.lacking), 2.0 * n * frequencies)
    P = Precision(S)

    def products(column: Array) -> Array:
        """Return X' W x (2 k,) of a column x (n,)."""
        w = P(completed_by(column, gone, S))
        out: Array = sum((X[:size] @ w[part] for part, X in _columns(n, frequencies)), np.zeros(size))
        return out

    each = (np.concatenate([X[j] for _, X in _columns(n, frequencies)]) for j in range(size))
    covariance = np.linalg.pinv(np.array([products(x) for x in each]), hermitian=True)
    beta: Array = first + covariance @ products(rest)
    return beta, covariance
