"""Samples of a stretch that are missing or wild, completed by what its own noise says of them.

The precision of the noise is diagonal in the cosine transform, P = C' diag(1/S) C.  A sample x_t differs from what all
others say of it by (P x)_t/P_tt, of standard deviation P_tt^(-1/2): wild is what exceeds a limit, the largest of
its neighbourhood first; where many are, the limit falls as long as few of what exceeds it are the noise's own.  Missing
and wild samples x_m get their conditional mean -P_mm^-1 P_mo x_o (conjugate gradients), and the powers of the ordinates
the expectation of what is left, by draws P_mm^-1 (P u)_m of u from the same noise.  S is a smoothed spectrum of the
completed stretch, so both are repeated until it stays: slowly where much less noise is at some frequencies than at
others, so each change is carried on by half of itself and more.  [DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import fft, special

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.precision import FIRST, Precision, ordinates, smooth_spectrum

FALSE = 0.002  # samples of a record that are called wild by chance; with estimates of noise and scatter 0.004
LOWEST, CHANCE = 3.7, 0.03  # limit in a record of many wild samples: part of them that may be the noise's own
BULK = 0.97  # of the samples, by which the scatter is measured
CORE = 3.0  # standard deviations of samples that no wild one is among
LOCAL, PARTS = 512, 64  # samples, at least, and parts of a stretch, at most, of which the scatter is taken
SWEEPS, LEAKS = 8, 0.1  # of wild samples; what is less than a part of the largest waits for the next
AGAIN = 3.0  # of the limit of a sample alone: what is less far off is judged once more
ENDS = 64  # samples from an end, within which the transform takes the noise for another one than it is
ROUNDS, MOST_ROUNDS, AVERAGED = 4, 24, 8  # of spectrum and completion, at least, at most; the last that are averaged
RESTS, STAYS = 0.01, 0.03  # change of the logarithm of a spectrum that needs no more rounds, and after the last
ONWARD = 1.8  # how far the change of a round is carried on
MOST_LOST = 0.5  # of the power in an octave: where less is known, noise of several kinds is not told apart
DRAWS = 40_000  # samples of all draws of a round; one at least, four at most
BLOCK = 256  # samples of a median, of the level that wild samples do not move
PARTS_OF_OCTAVE = 8  # in which the rounds come to rest: the zero of a filter takes up some of them
WHITE = 0.5  # of the least spectrum: the most that the excess of the core may be
# of the residuals independent, at least, for their core to be known: where they hang together by a gap of the spectrum,
# smaller wild samples are found
EVEN = 0.2
BELOW = 0.5  # of the power of the wild samples: the most that is wild below the limit; where it is more, the tails are
# continuous and the noise's own.  Of wild samples of normal sizes, 3.4 times the noise or more, it is less
SEED = 90125


@dataclass(frozen=True)
class Completed:
    """A stretch x (n,) without missing values, and extra (n,): powers of the ordinates that the completion lacks.

    wild: indices.  missing: samples that were not there.  white (n,): the stretch with an even spectrum, of unit
    variance, NaN where a sample is missing or wild.  noise (n,): a draw of what the completed samples may differ by.
    stays: whether the spectrum of the completion came to an end.  below: variance of white noise by which the samples
    of ``x`` exceed the noise that ``extra`` leaves, as wild ones below the limit are among them; negative where the
    limit has taken tails of the noise for wild.
    """

    x: Array
    extra: Array | None
    wild: NDArray[np.int64]
    missing: int
    white: Array
    noise: Array | None
    stays: bool = True
    below: float = 0.0

    @property
    def lacking(self) -> Array | float:
        return 0.0 if self.extra is None else self.extra

    @property
    def drawn(self) -> Array:
        """Return the stretch (n,) with what was missing or wild drawn from the noise around."""
        return self.x if self.noise is None else self.x + self.noise


def level(x: Array) -> Array:
    """Return the medians of blocks of a series (n,), NaN where nothing is there, interpolated to every sample."""
    n = x.size
    size = min(BLOCK, max(n // 4, 1))
    parts = x[: n // size * size].reshape(-1, size)
    known = np.isfinite(parts).sum(axis=1)
    there = known > size // 4
    if not there.any():
        return np.full(n, float(np.nanmedian(x)))
    middle = (np.arange(parts.shape[0]) + 0.5) * size
    medians = np.median(parts, axis=1)  # the faster one, of the blocks that are whole
    part = there & (known < size)
    medians[part] = np.nanmedian(parts[part], axis=1)
    out: Array = np.interp(np.arange(n), middle[there], medians[there])
    return out


def local_scale(z: Array, missing: NDArray[np.bool_], wild: NDArray[np.bool_]) -> Array:
    """Return the scatter of a series (n,), by the size that BULK of all samples do not exceed, wild ones among the
    others.

    By parts of the series: where its noise changes slowly, no sample is wild for it.  1 for a normal series of unit
    variance.  Heavy tails that more than 1 - BULK of the samples are in are the noise's own.
    """
    n = z.size
    size = max(LOCAL, n // PARTS)
    if n < 2 * size:
        return np.full(n, _bulk(z[~(missing | wild)], int(np.count_nonzero(~missing))))
    edges = np.linspace(0, n, n // size + 1).astype(int)
    parts = [slice(a, b) for a, b in pairwise(edges.tolist())]
    found = np.array([_bulk(z[s][~(missing | wild)[s]], int(np.count_nonzero(~missing[s]))) for s in parts])
    out: Array = np.interp(np.arange(n), 0.5 * (edges[1:] + edges[:-1]), found)
    return out


def _bulk(z: Array, n: int) -> float:
    """Return the size that BULK of n samples do not exceed, over that of unit normal ones; z: those that are left."""
    k = min(int(BULK * n), z.size - 1)
    return float(np.partition(np.abs(z), k)[k]) / float(-special.ndtri(0.5 * (1.0 - BULK))) if z.size else 1.0


def _scatter(z: Array) -> float:
    return 1.4826 * float(np.median(np.abs(z))) if z.size else 1.0


def limit_of(size: Array) -> float:
    """Return the standard deviations from which on a sample is wild, of their absolute values (m,)."""
    m = size.size
    highest = float(-special.ndtri(0.5 * FALSE / m))
    tail = np.sort(size[size > LOWEST])
    own = 2.0 * m * special.ndtr(-tail)
    exceed = tail.size - np.arange(tail.size)
    good = np.flatnonzero((own <= CHANCE * exceed) & (exceed > 1))  # of a single one FALSE decides
    return min(highest, float(tail[good[0]]) - 1e-9) if good.size else highest


def core_excess(z: Array) -> float:
    """Return by how much the mean square of z (m,) exceeds that of its normal core, over the latter.

    Negative where the limit has cut the tails of the core; 0 where the core is not normal: its tails are its own.
    """
    if abs(_scatter(z) / _bulk(z, z.size) - 1.0) > 0.1:
        return 0.0
    inside = np.abs(z) < CORE
    m2 = float(np.mean(z[inside] ** 2))

    def squares(s: float) -> float:
        c = CORE / s
        density = math.exp(-0.5 * c * c) / math.sqrt(2.0 * math.pi)
        return s * s * (1.0 - 2.0 * c * density / float(special.erf(c / math.sqrt(2.0))))

    s = math.sqrt(m2)
    for _ in range(30):
        s *= math.sqrt(m2 / squares(s))
    return float(np.mean(z * z)) / (s * s) - 1.0


def complete(x: Array, find_wild: bool = True) -> Completed:
    """Return a stretch (n,), NaN where a sample is missing, completed; wild samples are found and count as missing."""
    missing = ~np.isfinite(x)
    wild = np.zeros(x.size, dtype=bool)
    base = level(x)
    off = np.where(missing, 0.0, x - base)
    scale = _scatter(off[~missing])
    y = base + (np.clip(off, -4.0 * scale, 4.0 * scale) if scale else off)
    lost = np.zeros(x.size)
    noise: Array | None = None
    z = np.zeros(x.size)
    S: Array | None = None
    stays = True
    draws = min(max(DRAWS // x.size, 1), 4)
    filled = _Filler(x)
    Y = ordinates(y)
    for k in range(MOST_ROUNDS):
        now = smooth_spectrum(Y**2 + lost)
        change = math.inf if S is None else changed(now, S)
        stays = change < STAYS
        if k >= ROUNDS and change < RESTS:
            break
        last = k - (MOST_ROUNDS - AVERAGED)
        rng = np.random.default_rng([SEED, max(last, 0)])  # the same draws: what changes is the spectrum
        S = now if S is None or k == 1 or last >= 0 else S * (now / S) ** ONWARD
        P = Precision(S)
        y = filled(missing | wild, P)
        if k == 1 and wild.any():
            # what was wild beside a wilder one may be none by what the others say of it: it is judged once more
            far = np.abs(np.where(missing, 0.0, x) - y) * math.sqrt(P.diagonal)
            wild &= far > AGAIN * float(-special.ndtri(0.5 * FALSE / x.size))
            y = filled(missing | wild, P)
        for _ in range(SWEEPS if find_wild else 1):
            Y = ordinates(y)
            z = P.of(Y) / math.sqrt(P.diagonal)
            fresh = _wildest(z, missing, wild) if find_wild else np.zeros(1, dtype=bool)
            if not fresh.any():
                break
            wild |= fresh
            y = filled(missing | wild, P)
        else:
            Y = ordinates(y)
        at = np.flatnonzero(missing | wild)
        if not at.size:
            stays = True
            if k:
                break
            continue
        found, noise = _lacking(P, at, at, draws, rng)
        lost = lost + (found - lost) / (last + 1.0) if last > 0 else found
    ends = _own_ends(x, wild, missing, P)
    if ends.size:
        at = np.flatnonzero(missing | wild)
        wild[ends] = False
        y[ends] = x[ends]
        Y = ordinates(y)
        kept = np.flatnonzero(missing | wild)
        lost, noise = _lacking(P, at, kept, AVERAGED * draws, rng) if kept.size else (np.zeros(x.size), None)
        stays = stays or not kept.size
    excess = 0.0
    if wild.any() and P.diagonal**2 > EVEN * float(np.mean(P.S**-2.0)):
        # what is wild but below the limit is white noise of the samples as they are
        excess = core_excess((z / local_scale(z, missing, wild))[~(missing | wild)]) / P.diagonal
        if excess > BELOW * float(np.sum((x[wild] - y[wild]) ** 2)) / x.size:
            excess = 0.0
        excess = min(excess, WHITE * float(P.S.min()))  # no more than is there
    white = fft.idct(Y / np.sqrt(P.S), norm="ortho")
    white[missing | wild] = np.nan
    extra = lost - excess if noise is not None else None
    return Completed(y, extra, np.flatnonzero(wild), int(missing.sum()), white, noise, stays, excess)


def _lacking(
    P: Precision, at: NDArray[np.int64], kept: NDArray[np.int64], draws: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return the powers (n,) that the completion of the samples ``at`` lacks at those of them that are ``kept``, as a
    mean of draws, and the last draw (n,).
    """
    lost, noise = np.zeros(P.S.size), np.zeros(P.S.size)
    solve = P.solver(at)
    for _ in range(draws):
        full = np.zeros(P.S.size)
        full[at] = solve(fft.idct(rng.standard_normal(P.S.size) / np.sqrt(P.S), norm="ortho")[at])
        noise = np.zeros(P.S.size)
        noise[kept] = full[kept]
        lost += ordinates(noise) ** 2 / draws
    return lost, noise


def _own_ends(x: Array, wild: NDArray[np.bool_], missing: NDArray[np.bool_], P: Precision) -> NDArray[np.int64]:
    """Return the wild samples near an end of x (n,) that differ from what the others say of them by no more than the
    noise does there.

    The transform takes a stretch for one that is reflected at its ends.  A sample differs from its conditional mean by
    w'x, of variance w'Gw under the covariance G of the noise that goes on: the mean of S |W|^2.  Of an angle noise of
    rms Q it is more by Q^2 for the first and the last sample, whose outer angles are in no other one.
    """
    n = x.size
    near = np.flatnonzero(wild & (np.minimum(np.arange(n), np.arange(n)[::-1]) < ENDS))
    if not near.size:
        return near
    at = np.flatnonzero(missing | wild)
    S = np.append(P.S, P.S[-1])
    S[0] = S[1]
    highest = float(-special.ndtri(0.5 * FALSE / n))
    off, size = np.empty(near.size), np.empty(near.size)
    solve = P.solver(at)
    for i, t in enumerate(near.tolist()):
        full = np.zeros(n)
        full[at] = solve((at == t).astype(float))
        w = P(full)
        W = np.abs(np.fft.rfft(w, 2 * n)) ** 2
        W[1:-1] *= 2.0
        size[i] = math.sqrt(float(W @ S) / (2.0 * n))
        known = ~missing
        off[i] = abs(float(w[known] @ x[known]))
    return near[off < highest * size]


def mostly_known(x: Array, extra: Array | None) -> bool:
    """Return whether most of the power in every octave is that of x (n,), not of what the completion lacks."""
    if extra is None:
        return True
    return bool(np.all(octaves(extra) < MOST_LOST * octaves(ordinates(x) ** 2 + extra)))


def changed(now: Array, before: Array) -> float:
    """Return the largest mean change of the logarithm of a spectrum (n,) over parts of an octave."""
    return float(np.max(np.abs(octaves(np.log(now / before), PARTS_OF_OCTAVE))))


def octaves(x: Array, parts: int = 1) -> Array:
    """Return the means of ordinates (n,) over octaves, or over parts of them, from the eighth on."""
    count = max(int(parts * math.log2(x.size / FIRST)), 1)  # the last one may be up to twice as long
    edges = np.unique(np.round(FIRST * 2.0 ** (np.arange(count) / parts)).astype(int))
    out: Array = np.add.reduceat(x[FIRST:], edges - FIRST) / np.diff(np.append(edges, x.size))
    return out


class _Filler:
    """A stretch x (n,) with the conditional mean of what is gone; what does not change with the spectrum is kept."""

    def __init__(self, x: Array) -> None:
        self.x, self.gone = x, np.zeros(x.size, dtype=bool)
        self.base = self.rest = self.Y = np.empty(0)

    def __call__(self, gone: NDArray[np.bool_], P: Precision) -> Array:
        at = np.flatnonzero(gone)
        if not at.size:
            return self.x.copy()
        if not np.array_equal(gone, self.gone):
            self.gone = gone.copy()
            self.base = level(np.where(gone, np.nan, self.x))  # the gradients start from it
            self.rest = np.where(gone, 0.0, self.x - self.base)
            self.Y = ordinates(self.rest + self.base)
        y = self.rest.copy()
        y[at] = P.solver(at)(-P.of(self.Y)[at])
        y += self.base
        return y


def completed_by(y: Array, at: NDArray[np.int64], S: Array) -> Array:
    """Return a completed series y (n,), its samples ``at`` with the conditional mean that a spectrum S (n,) gives.

    The sums of P y, by which steps are judged, are those of the samples that are there only if P completed the others.
    """
    if not at.size:
        return y
    S = S.copy()
    S[0] = 100.0 * S.size * float(S[1:].max())
    P, y = Precision(S), y.copy()
    y[at] += P.solver(at)(-P(y)[at])
    return y


def _wildest(z: Array, missing: NDArray[np.bool_], wild: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which samples exceed the limit, all within three of them and a part of the largest: a far larger one is in
    all others by its weights, and in the scatter around, by which they are measured.
    """
    gone = missing | wild
    size = np.abs(np.where(gone, 0.0, z))
    scale = local_scale(z, missing, wild)
    if not np.all(scale > 0.0):  # most samples are the same
        return np.zeros(z.size, dtype=bool)
    size /= scale
    inner = slice(ENDS, -ENDS) if z.size > 4 * ENDS else slice(None)  # what exceeds it at the ends is judged by itself
    limit = max(limit_of(size[inner][~gone[inner]]), LEAKS * float(size.max()))
    beyond = np.flatnonzero(size > limit)
    around = size[np.clip(beyond[:, None] + np.arange(-3, 4), 0, size.size - 1)]
    out = np.zeros(size.size, dtype=bool)
    out[beyond[size[beyond] >= around.max(axis=1)]] = True
    return out
