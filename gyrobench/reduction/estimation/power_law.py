"""Noise of averaged data with a spectrum f^-a, 0 < a <= 2: flicker (a = 1), random walk (a = 2) and what is between,
with white noise and errors of readings beside it.

Independent Gauss-Markov processes whose correlation times are in geometric progression, with variances that go with
tau^(a - 1), add up to

    S(w) = sum 2 sigma^2 tau/(1 + w^2 tau^2) ~ w^-a

between the reciprocals of the longest and the shortest one; of flicker, equal variances, pi sigma^2/(h w) times
1 +- 2/cosh(pi^2/h), h the step of ln tau (Poisson's sum): with steps of a decade within 5.5 % of 1/f.  Means over
windows have the closed covariances of :mod:`gyrobench.reduction.estimation.noise`, process by process, and their
innovations follow from a Kalman filter with one state for each of them, O(n).  [DRIFT-RANDOM-ALLAN, RED-GLS; own
derivation, proved by tests]

Not modelled: what such noise does below 1/(2 pi LONGEST) of the reciprocal of the record.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.window_means import mean_gain, mean_variance, middles

#: Correlation times: from SHORTEST windows (faster processes are white noise in means) to LONGEST of the record, at
#: most DECADE apart.
SHORTEST, LONGEST, DECADE = 0.1, 1.0, 10.0
#: Exponents a, one as often as the other (steeper spectra are those of the slowest Gauss-Markov processes, gentler ones
#: of flicker with white noise), ALONE of them without white noise, as of Gauss-Markov drift (noise.FAMILIES).  Where
#: there is some the odds are log-uniform: from FAINTEST of its density at the reciprocal of the record to LOUDEST at
#: the highest frequency that windows show.
SLOPES, ALONE = (1.0, 1.5), 1.0 / 3.0
FAINTEST, LOUDEST, ODDS = 0.1, 10.0, 4
NUMBERS = 1 << 16  # held of gains and whitened data at a time


@functools.lru_cache(maxsize=64)
def _processes(window: float, record: float, slopes: tuple[float, ...]) -> tuple[Array, Array]:
    shortest, longest = SHORTEST * window, LONGEST * record
    tau = np.geomspace(shortest, longest, 1 + math.ceil(math.log(longest / shortest, DECADE)))
    part = (tau / longest) ** (np.array(slopes)[:, None] - 1.0)
    return tau, part / part.sum(axis=1, keepdims=True)


def processes(t0: Array, t1: Array, slopes: Array) -> tuple[Array, Array]:
    """Return correlation times (k,), s, and variances (m, k), sum 1, of the processes that stand for S ~ f^-slope, in
    windows [t0, t1], for slopes (m,).
    """
    return _processes(float(np.median(t1 - t0)), float(t1[-1] - t0[0]), tuple(slopes.tolist()))


def variance(t0: Array, t1: Array, slopes: Array, length: Array | float) -> Array:
    """Return the variance (..., m) of means over ``length`` (s) of such noise of unit variance."""
    tau, part = processes(t0, t1, slopes)
    return np.asarray(mean_variance(np.divide.outer(length, tau)) @ part.T)


def candidates(t0: Array, t1: Array) -> tuple[Array, Array, Array]:
    """Return slopes, shares of the variance of a window, and prior (sum 1) of the candidates, as noise.NoiseGrid."""
    slopes, window = np.array(SLOPES), float(np.median(t1 - t0))
    ends = np.array([2.0 * math.pi / float(t1[-1] - t0[0]), math.pi / window])
    first, last = relative_density(t0, t1, slopes, ends)
    odds = middles(FAINTEST / first, LOUDEST / last, ODDS).T
    share = np.column_stack([np.ones_like(slopes), odds / (1.0 + odds)])
    prior = np.tile([ALONE, *[(1.0 - ALONE) / ODDS] * ODDS], slopes.size) / slopes.size
    return np.repeat(slopes, 1 + ODDS), share.ravel(), prior


def relative_density(t0: Array, t1: Array, slopes: Array, w: Array) -> Array:
    """Return the densities (n, m) at w (n,), rad/s, over that of white noise of the same variance in a window."""
    (tau, part), window = processes(t0, t1, slopes), float(np.median(t1 - t0))
    out: Array = (2.0 * tau / (1.0 + np.multiply.outer(w, tau) ** 2)) @ part.T
    return out / (variance(t0, t1, slopes, window) * window)


@dataclass(frozen=True)
class _Gains:
    """Of m windows, G models and k states: the innovations recursion

    e_i = y_i - a_i x_i,   x_{i+1} = f_i x_i + k_i e_i,   1/sqrt(var e_i) = scale_i

    x: the processes at the start of window i, given the windows before it; the last state of data with errors of the
    readings is the error of the reading at the start.
    """

    rows: slice
    a: Array  # (m, k)
    f: Array  # (m, k)
    k: Array  # (m, G, k)
    scale: Array  # (m, G)

    @functools.cached_property
    def logdet(self) -> Array:
        """(G,): part of the log determinant."""
        return np.asarray(-2.0 * np.log(self.scale).sum(axis=0))


def _all_gains(
    t0: Array, t1: Array, slope: Array, share: Array, reading: Array | None, columns: int
) -> Iterable[_Gains]:
    """Return the recursion some windows at a time; of short records it is kept, as those of noise._filters."""
    states = processes(t0, t1, slope)[0].size + (reading is not None)
    rows = max(1, NUMBERS // (share.size * states * columns))
    if t0.size * share.size * states > NUMBERS:
        return _recursion(t0, t1, slope, share, reading, rows)
    given = tuple(None if v is None else np.asarray(v, dtype=float).tobytes() for v in (t0, t1, slope, share, reading))
    return _kept(given)


@functools.lru_cache(maxsize=16)
def _kept(given: tuple[bytes | None, ...]) -> tuple[_Gains, ...]:
    t0, t1, slope, share, reading = (np.frombuffer(b"" if v is None else v) for v in given)
    return tuple(_recursion(t0, t1, slope, share, None if given[-1] is None else reading, t0.size))


def _recursion(t0: Array, t1: Array, slope: Array, share: Array, reading: Array | None, rows: int) -> Iterator[_Gains]:
    """Yield the recursion for ``rows`` windows at a time; a window of the median length has variance 1."""
    (tau, part), length = processes(t0, t1, slope), t1 - t0
    window = float(np.median(length))
    gap = np.append(t0[1:] - t1[:-1], 0.0)
    rest = np.ones_like(share) if reading is None else 1.0 - reading
    size = part * (rest * share / variance(t0, t1, slope, window))[:, None]  # variance of each process
    q = (1.0 - rest) * window**2 / 2.0  # of one reading error
    own = slice(0, tau.size)
    k = tau.size + (reading is not None)
    P = np.zeros((share.size, k, k))
    P[:, range(tau.size), range(tau.size)] = size
    if reading is not None:
        P[:, -1, -1] = q
    for start in range(0, length.size, rows):
        block = slice(start, start + rows)
        t, pause = length[block, None], np.exp(-np.maximum(gap[block], 0.0)[:, None] / tau)
        phi, gain = np.exp(-t / tau), mean_gain(t / tau)
        a, f = np.zeros((2, len(t), k))
        d, c = np.zeros((2, len(t), share.size, k))
        a[:, own], f[:, own] = gain, pause * phi
        d[:, :, own] = (1.0 - pause * pause * phi * phi)[:, None, :] * size
        c[:, :, own] = (pause * gain * (1.0 - phi))[:, None, :] * size
        n = np.maximum(mean_variance(t / tau) - gain * gain, 0.0) @ size.T + rest * (1.0 - share) * window / t
        if reading is not None:
            a[:, -1] = -1.0 / t[:, 0]
            d[:, :, -1] = q
            c[:, :, -1] = np.where(gap[block] > 1e-6 * window, 0.0, 1.0)[:, None] * q / t
            n += q / (t * t)
        K, s = np.empty_like(c), np.empty_like(n)
        diagonal, ff = np.arange(k), f[:, :, None] * f[:, None, :]
        for ai, fi, ffi, ni, di, ci, Ki, si in zip(a, f, ff, n, d, c, K, s, strict=True):
            seen = P @ ai
            np.add(seen @ ai, ni, out=si)
            seen *= fi
            seen += ci
            np.divide(seen, si[:, None], out=Ki)
            P = P * ffi
            P -= seen[:, :, None] * Ki[:, None, :]
            P[:, diagonal, diagonal] += di
        yield _Gains(block, a, f, K, 1.0 / np.sqrt(s))


def whitened_blocks(
    t0: Array, t1: Array, columns: Array, slope: Array, share: Array, reading: Array | None
) -> Iterator[tuple[slice, Array, Array]]:
    """As :func:`gyrobench.reduction.estimation.noise.whitened_blocks`, of models with a power law."""
    c, models = columns.shape[1], share.size
    reading = reading if reading is not None and np.any(reading > 0.0) else None
    x = None
    for w in _all_gains(t0, t1, slope, share, reading, c):
        states = w.a.shape[1]
        if x is None:
            x, step = np.zeros((2, c * models, states))
        y = columns[w.rows]
        e = np.empty((len(y), c, models))
        for yi, ai, fi, ki, ei in zip(y, w.a, w.f, w.k, e, strict=True):
            np.subtract(yi[:, None], (x @ ai).reshape(c, models), out=ei)
            x *= fi
            np.multiply(ei[:, :, None], ki, out=step.reshape(c, models, states))
            x += step
        e *= w.scale[:, None, :]
        yield w.rows, e, w.logdet


def whiten_transposed(t0: Array, t1: Array, columns: Array, slope: float, share: float, reading: float) -> Array:
    """As :func:`gyrobench.reduction.estimation.noise.whiten_transposed`: the recursion run backwards."""
    one = np.array([slope]), np.array([share]), np.array([reading]) if reading else None
    blocks = list(_all_gains(t0, t1, *one, columns.shape[1]))
    out: Array = columns.copy()
    later = np.zeros((columns.shape[1], blocks[0].a.shape[1]))
    for w in reversed(blocks):
        rows = out[w.rows]
        rows *= w.scale
        for row, a, f, k in zip(rows[::-1], w.a[::-1], w.f[::-1], w.k[::-1, 0], strict=True):
            row += later @ k
            later *= f
            later -= row[:, None] * a
    return out
