"""Noise of averaged data: white rate noise plus a Gauss-Markov process or a power law, through averaging windows.

Data are means over windows [t0_i, t1_i] with gaps between them.  The noise is

    e_i = (1/T_i) integral of ( w(t) + x(t) ) dt,   dx = -x/tau dt + sigma sqrt(2/tau) dW,   w white of density N,

x stationary and running on through the gaps.  With r = T/tau, a = (1 - exp(-r))/r, v = 2 (r - 1 + exp(-r))/r^2:

    var e_i = N^2/T_i + sigma^2 v_i,    cov(e_i, e_j) = sigma^2 a_i a_j exp(-gap/tau)   (gap: end of i to start of j)

exactly, whatever the window lengths.  A constant (turn-on bias) is no noise here: it belongs to the constant term.

Data that are differences of readings, (angle_i - angle_{i-1}) / T_i, also carry the errors n of the readings, white and
shared by neighbours: var += 2 s^2 / T^2, cov of neighbours -= s^2 / (T_i T_{i+1})  [RED-RATE: lag-1 correlation -1/2].
In place of the Gauss-Markov process there may be flicker, or a spectrum between that and random walk (power_law).  Not
modelled: drift that goes on below the reciprocal of the record, quanta that are no white error.  [RED-GLS; own
derivation, proved by tests]
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import power_law
from gyrobench.reduction.estimation.window_means import mean_gain as mean_gain
from gyrobench.reduction.estimation.window_means import mean_variance as mean_variance
from gyrobench.reduction.estimation.window_means import middles
from gyrobench.reduction.estimation.window_means import process_covariance as process_covariance


def relative_variance(t0: Array, t1: Array, model: tuple[float, float, float]) -> Array:
    """Variances (n,) of windows over that of one of the median length; model: tau (s), share and reading."""
    tau, share, reading = model
    length = t1 - t0
    window = float(np.median(length))
    if tau < 0.0:
        law, one = (power_law.variance(t0, t1, np.array([-tau]), n)[..., 0] for n in (length, window))
        slow = share * law / one
    else:
        slow = share * mean_variance(length / tau) / float(mean_variance(np.array(window / tau)))
    return np.asarray((1.0 - reading) * (slow + (1.0 - share) * window / length) + reading * (window / length) ** 2)


@dataclass(frozen=True)
class NoiseGrid:
    """Candidate noise models: correlation time, correlated share of the variance of a window, prior weight.

    share = sigma^2 v / (N^2/T + sigma^2 v) for a window of the typical length; reading: what reading errors make of
    its whole variance.
    """

    tau: Array  # (G,), s; where negative, the exponent of a power law instead: a spectrum f^tau
    share: Array  # (G,)
    prior: Array  # (G,), sums to 1
    reading: Array  # (G,)


#: The population of instrument noise that intervals are made for; candidates are a quadrature over it.  One in four
#: instruments has white noise alone, one in four Gauss-Markov drift alone, two have both (sample_instrument()).
FAMILIES = (0.25, 0.25, 0.5)
#: Of all instruments one in five has a power law instead (power_law).  It is weighed where the record is longer than
#: BROAD windows: over a narrower band white noise and a Gauss-Markov process make up such a spectrum.
POWER_LAWS, BROAD = 0.2, 50.0
#: Correlation time, log-uniform: from SHORTEST windows to LONGEST of the record (of slower drift a record holds no
#: more than a constant and a trend).
SHORTEST, LONGEST = 0.3, 0.5
#: Of both: variance of the Gauss-Markov part of a window over that of the white part, log-uniform: from a density at
#: zero frequency FAINTEST times the white one (less changes no mean) to STRONGEST (more is as without white noise).
FAINTEST, STRONGEST = 0.3, 100.0
#: Where data are differences of readings: how often reading errors are negligible, else their variance over that of
#: the rest of a window, log-uniform.
NO_READING, READING = 0.25, (0.05, 100.0)
TAUS, ODDS, READINGS = 9, 6, 4  # cells of the quadrature; more change no coverage
NUMBERS = 1 << 16  # held of whitened data at a time


def _taus(t0: Array, t1: Array) -> tuple[float, float, float]:
    """Typical window, shortest and longest correlation time, s."""
    window, record = float(np.median(t1 - t0)), float(t1[-1] - t0[0])
    return window, SHORTEST * window, max(LONGEST * record, 3.0 * window)


def _least_odds(window: float, tau: Array) -> Array:
    return np.asarray(FAINTEST * mean_variance(window / tau) * window / (2.0 * tau))


def noise_grid(t0: Array, t1: Array, readings: bool = False) -> NoiseGrid:
    """Return the grid of candidate models for windows [t0, t1] (s); readings: of differences of readings."""
    window, shortest, longest = _taus(t0, t1)
    tau = middles(shortest, longest, TAUS)
    odds = middles(_least_odds(window, tau), STRONGEST, ODDS).ravel()
    every = np.concatenate([[window], tau, np.tile(tau, ODDS)])
    share = np.concatenate([[0.0], np.ones(TAUS), odds / (1.0 + odds)])
    prior = np.repeat(np.array(FAMILIES) / (1, TAUS, TAUS * ODDS), (1, TAUS, TAUS * ODDS))
    if float(t1[-1] - t0[0]) > BROAD * window:
        slope, part, weight = power_law.candidates(t0, t1)
        every, share = np.concatenate([every, -slope]), np.concatenate([share, part])
        prior = np.concatenate([(1.0 - POWER_LAWS) * prior, POWER_LAWS * weight])
    if not readings:
        return NoiseGrid(every, share, prior, np.zeros_like(every))
    part = middles(*READING, READINGS)
    size = np.concatenate([[0.0], part / (1.0 + part)])
    weight = np.concatenate([[NO_READING], np.full(READINGS, (1.0 - NO_READING) / READINGS)])
    n = size.size
    return NoiseGrid(np.tile(every, n), np.tile(share, n), np.outer(weight, prior).ravel(), np.repeat(size, every.size))


def sample_instrument(
    rng: np.random.Generator, t0: Array, t1: Array, readings: bool = False
) -> tuple[float, float, float]:
    """tau (s), share and reading of one instrument of the population, as :class:`NoiseGrid` has them."""

    def log_uniform(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    window, shortest, longest = _taus(t0, t1)
    family = rng.choice(3, p=FAMILIES)
    tau, share, reading = log_uniform(shortest, longest), float(family > 0), 0.0
    if family == 2:
        odds = log_uniform(float(_least_odds(window, np.array(tau))), STRONGEST)
        share = odds / (1.0 + odds)
    if readings and rng.random() >= NO_READING:
        part = log_uniform(*READING)
        reading = part / (1.0 + part)
    return tau, share, reading


@dataclass(frozen=True)
class _Filter:
    """Gains of the innovations recursion for m windows and G models, each array (m, G):

    e_i = y_i - a_i x_i + h_i e_{i-1},   x_{i+1} = f_i x_i + k_i e_i,   var e_i = s_i

    x: mean of the process at the start of window i, given the windows before it; f and k reach over the gap to the
    next window.  h: 1/T_i times what e_{i-1} says of the error of the reading that both windows share; None without.
    """

    rows: slice
    a: Array
    f: Array
    k: Array
    s: Array
    h: Array | None = None

    @functools.cached_property
    def move(self) -> Array:
        """f - k a: what x_i itself leaves of x_{i+1}, without h."""
        return self.f - self.k * self.a

    @functools.cached_property
    def scale(self) -> Array:
        """1/sqrt(s)."""
        return np.asarray(1.0 / np.sqrt(self.s))

    @functools.cached_property
    def logdet(self) -> Array:
        """(G,): part of the log determinant."""
        return np.asarray(np.log(self.s).sum(axis=0))


def _filters(t0: Array, t1: Array, tau: Array, share: Array, reading: Array | None, rows: int) -> Iterable[_Filter]:
    """Return the recursion for ``rows`` windows at a time.

    Of short records it is kept: fits to the same windows (other data, other columns, a correction) ask for it again.
    """
    if t0.size * tau.size > NUMBERS:
        return _recursion(t0, t1, tau, share, reading, rows)
    given = (None if v is None else np.asarray(v, dtype=float).tobytes() for v in (t0, t1, tau, share, reading))
    return _kept(tuple(given), min(rows, t0.size))


@functools.lru_cache(maxsize=16)
def _kept(given: tuple[bytes | None, ...], rows: int) -> tuple[_Filter, ...]:
    t0, t1, tau, share, reading = (np.frombuffer(b"" if v is None else v) for v in given)
    return tuple(_recursion(t0, t1, tau, share, reading if given[-1] is not None else None, rows))


def _recursion(t0: Array, t1: Array, tau: Array, share: Array, reading: Array | None, rows: int) -> Iterator[_Filter]:
    """Yield the recursion for ``rows`` windows at a time; the variances run on from block to block.

    The covariance is scaled so that a window of the median length has variance 1.
    """
    length = t1 - t0
    window = float(np.median(length))
    gap = np.append(t0[1:] - t1[:-1], 0.0)
    neighbour = np.append(0.0, np.where(gap[:-1] > 1e-6 * window, 0.0, 1.0 / length[:-1]))  # 0: a reading of its own
    rest = np.ones_like(share) if reading is None else 1.0 - reading
    size = rest * share / mean_variance(window / tau)
    q = (1.0 - rest) * window**2 / 2.0  # variance of one reading error
    p, last = size, (np.zeros_like(size), np.ones_like(size))
    for start in range(0, length.size, rows):
        block = slice(start, start + rows)
        t = length[block, None]
        r = t / tau
        phi, a, v = np.exp(-r), mean_gain(r), mean_variance(r)
        pause = np.exp(-np.maximum(gap[block], 0.0)[:, None] / tau)
        # given the start: variance of the mean, of the process at the next window, covariance of the two
        n = np.maximum(v - a * a, 0.0) * size + rest * (1.0 - share) * window / t
        d = (pause * pause * (1.0 - phi * phi) + (1.0 - pause * pause)) * size
        c = pause * a * (1.0 - phi) * size
        f = pause * phi
        if np.any(q > 0.0):
            shared = q * neighbour[block, None] / t
            p, k, s = _variances_with_readings(p, last, a, f, n + 2.0 * q / (t * t), d, c, shared)
            yield _Filter(block, a, f, k, s, shared / np.concatenate([last[1][None], s[:-1]]))
            last = k[-1], s[-1]
        else:
            p, k, s = _variances(p, a, f, n, d, c)
            yield _Filter(block, a, f, k, s)


def _variances(p: Array, a: Array, f: Array, n: Array, d: Array, c: Array) -> tuple[Array, Array, Array]:
    """Return p (G,) of the window after the last, k and s (m, G), from the variance p of x at the first window.

    p' = f^2 p + d - (f a p + c)^2 / s  with  s = a^2 p + n  is  (alpha p + beta) / s: the squares of p cancel.
    """
    square = a * a
    alpha = f * f * n + square * d - 2.0 * f * a * c
    beta = d * n - c * c
    if p.size == 1:
        return _variances_of_one(float(p[0]), alpha, beta, square, f * a, n, c)
    path, s = np.empty((len(a) + 1, p.size)), np.empty_like(a)
    path[0] = p
    for al, be, sq, ni, pi, si, after in zip(alpha, beta, square, n, path[:-1], s, path[1:], strict=True):
        np.multiply(sq, pi, out=si)
        si += ni
        np.multiply(al, pi, out=after)
        after += be
        after /= si
    return path[-1], (f * a * path[:-1] + c) / s, s


def _variances_of_one(
    p: float, alpha: Array, beta: Array, square: Array, moved: Array, n: Array, c: Array
) -> tuple[Array, Array, Array]:
    """The recursion for one model: plain numbers are five times as quick as arrays of one."""
    path, s = [p], []
    for al, be, sq, ni in zip(*(x[:, 0].tolist() for x in (alpha, beta, square, n)), strict=True):
        s.append(sq * p + ni)
        p = (al * p + be) / s[-1]
        path.append(p)
    variance = np.array(s)[:, None]
    return np.array([p]), (moved * np.array(path[:-1])[:, None] + c) / variance, variance


def _variances_with_readings(
    p: Array, last: tuple[Array, Array], a: Array, f: Array, n: Array, d: Array, c: Array, shared: Array
) -> tuple[Array, Array, Array]:
    """As :func:`_variances`, with reading errors of variance q: n holds 2 q/T^2; shared: q/(T T'), T' of the neighbour.

    last: k and s of the window before the first, which tells of the shared reading: its variance over T^2 falls by
    shared^2/s, and its covariance with x over T is -k shared.
    """
    known = shared * shared
    squared = f * f
    k0, s0 = last
    columns = (a, f, squared, n, d, c, shared, known)
    if p.size == 1:
        return _with_readings_of_one(float(p[0]), float(k0[0]), float(s0[0]), columns)
    k, s = np.empty_like(a), np.empty_like(a)
    for ai, fi, ff, ni, di, ci, hi, gi, ki, si in zip(*columns, k, s, strict=True):
        cross = hi * k0
        seen = ai * p
        seen += cross
        cross += seen
        cross *= ai
        cross += ni
        np.divide(gi, s0, out=si)
        np.subtract(cross, si, out=si)
        seen *= fi
        seen += ci
        np.divide(seen, si, out=ki)
        p = ff * p
        p += di
        seen *= ki
        p -= seen
        k0, s0 = ki, si
    return p, k, s


def _with_readings_of_one(p: float, k0: float, s0: float, columns: tuple[Array, ...]) -> tuple[Array, Array, Array]:
    """The same for one model, as :func:`_variances_of_one`."""
    k, s = [], []
    for ai, fi, ff, ni, di, ci, hi, gi in zip(*(x[:, 0].tolist() for x in columns), strict=True):
        cross = hi * k0
        seen = ai * p + cross
        s0 = (cross + seen) * ai + ni - gi / s0
        seen = seen * fi + ci
        k0 = seen / s0
        p = ff * p + di - seen * k0
        k.append(k0)
        s.append(s0)
    return np.array([p]), np.array(k)[:, None], np.array(s)[:, None]


def _rows(models: int, columns: int) -> int:
    return max(1, NUMBERS // max(models * columns, 1))


def whitened_blocks(
    t0: Array, t1: Array, columns: Array, tau: Array, share: Array, reading: Array | None = None
) -> Iterator[tuple[slice, Array, Array]]:
    """Yield rows, ``columns`` of these rows made white (m, c, G) and their part of the log determinant (G,).

    As :func:`whiten`, some windows at a time: the memory does not grow with the record.
    """
    if tau[0] < 0.0:
        yield from power_law.whitened_blocks(t0, t1, columns, -tau, share, reading)
        return
    c = columns.shape[1]
    x, before, scratch = np.zeros((3, c, tau.size))
    for w in _filters(t0, t1, tau, share, reading, _rows(tau.size, c)):
        y = columns[w.rows, :, None]
        e = np.empty((y.shape[0], c, tau.size))
        if w.h is None:
            path = w.k[:, None, :] * y  # becomes x of the next window
            e[0] = x
            for move, after in zip(w.move, path, strict=True):
                np.multiply(move, x, out=scratch)
                after += scratch
                x = after
            e[1:] = path[:-1]
            e *= w.a[:, None, :]
            np.subtract(y, e, out=e)
        else:
            for yi, ai, fi, ki, hi, ei in zip(y, w.a, w.f, w.k, w.h, e, strict=True):
                np.multiply(hi, before, out=ei)
                ei += yi
                np.multiply(ai, x, out=scratch)
                ei -= scratch
                np.multiply(ki, ei, out=scratch)
                x *= fi
                x += scratch
                before = ei
            before = before.copy()
        e *= w.scale[:, None, :]
        yield w.rows, e, w.logdet


def whiten(
    t0: Array, t1: Array, columns: Array, tau: Array, share: Array, reading: Array | None = None
) -> tuple[Array, Array]:
    """``columns`` (n, c) made white for each of G models: (n, G, c), and log determinant of the covariance (G,).

    The covariance is scaled so that a window of the median length has variance 1.  Innovations of the process, O(n).
    """
    out, logdet = np.empty((len(columns), columns.shape[1], tau.size)), np.zeros(tau.size)
    for rows, white, part in whitened_blocks(t0, t1, columns, tau, share, reading):
        out[rows] = white
        logdet += part
    return out.transpose(0, 2, 1), logdet


def whiten_transposed(t0: Array, t1: Array, columns: Array, model: tuple[float, float, float]) -> Array:
    """W' z of ``columns`` z (n, c) for one model (tau, share, reading), where W is what :func:`whiten` multiplies by.

    With z = W x it is R^-1 x.  The recursion of :class:`_Filter` run backwards, O(n).
    """
    if model[0] < 0.0:
        return power_law.whiten_transposed(t0, t1, columns, -model[0], *model[1:])
    tau, share, reading = (np.array([v]) for v in model)
    (w,) = _filters(t0, t1, tau, share, reading, len(columns))
    out = columns / np.sqrt(w.s)
    later, scratch = np.zeros((2, columns.shape[1]))
    after, h_after = scratch, 0.0
    k, f, a = (v[::-1, 0].tolist() for v in (w.k, w.f, w.a))
    h = [0.0] * len(k) if w.h is None else w.h[::-1, 0].tolist()
    for row, ki, fi, ai, hi in zip(out[::-1], k, f, a, h, strict=True):
        np.multiply(later, ki, out=scratch)
        if h_after:
            scratch += h_after * after
        row += scratch
        later *= fi
        np.multiply(row, ai, out=scratch)
        later -= scratch
        after, h_after = row, hi
    return out
