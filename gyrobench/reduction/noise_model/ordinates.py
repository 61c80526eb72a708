"""Ordinates of the cosine transform of stretches of a rate, and their likelihood under a noise model.

The cosine transform (type 2) of a stretch of n samples has ordinates k = 1 .. n-1 at omega = pi k/n; its mean is left
out.  Under the model their covariance is

    random walk     diag S(omega), exactly (white noise, too)
    Gauss-Markov    diag S(omega) less one rank for even and one for odd k, exactly
    quantization    diag S(omega) plus one rank for each parity: the errors of the first and the last angle
    flicker         correlated among the first ones, from its generalized covariance
    others          diag S(omega): their memory is short against a stretch

The first LOW of each parity are kept singly with all of this (of Gauss-Markov drift a rank that matters is in them);
the others are summed up in bins of equal logarithmic width.  The errors of the end angles are kept in all of them.  A
ramp common to the stretches, a mean of the odd ordinates, is eliminated as in restricted maximum likelihood; it is
taken off by least squares before, so that what is left of it is in the first ordinates alone.

At the zeros of a filter the diagonal is less than what the two ends of a stretch leave there, a few numbers in hundreds
of ordinates.  So the ordinates from EDGES/(samples of a taper) on are those of the stretch with tapered ends, which
leave nothing; of a taper w they are worth <w^2>^2/<w^4> of as many, and have no error of an end angle.
[DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.precision import smooth_spectrum
from gyrobench.reduction.noise_model.sensor_filters import Grid, passes_slow
from gyrobench.reduction.noise_model.terms import SLOW, NoiseTerm, allan_of_spectrum, covariance_grid, markov_parts
from gyrobench.reduction.series.noise_spectra import flicker

LOW = 16  # first ordinates of each parity that are kept singly
WIDTH = 0.01  # of a bin of ordinates, of the logarithm of k
SHORTEST = 64  # samples of a stretch
AROUND, NEAR, CLEAR = 257, 9, 5.0  # ordinates around and near a peak, and how much the near ones exceed the others
SINGLE = 500  # of the near ones that exceed most, at most
CHI = 1.2703628454614782  # log of chi squared of one degree of freedom: its mean is minus this
HUGE = 1e30
TAPER, LEAST_TAPER, MOST_TAPER = 0.025, 32, 256  # of an end of a stretch: part of it, and samples
EDGES = 30.0  # rad over a taper from which on it makes little of a slow change: the sixth power of that less
FLOOR = 1e-14  # of a spectrum, where the variance of the first differences of the record is 1

Model = tuple[NoiseTerm, ...]


@dataclass(frozen=True)
class _Part:
    """Ordinates of one parity of one stretch; low (LOW,): the first ones; the rest in bins (b,)."""

    odd: bool
    n: int
    low: Array
    k: Array  # of the bins, middle
    half_width: Array
    count: Array
    power: Array
    total: Array
    plain: NDArray[np.bool_]  # of the stretch as it is, not with tapered ends


def _parts(x: Array, extra: Array | None) -> list[_Part]:
    """Both parities of a stretch (n,), odd ones first; extra: powers (n,) of the ordinates to be added."""
    n = x.size
    c = fft.dct(x, norm="ortho")
    square, known, worth = c * c, np.ones(n), np.ones(n)
    first, tapered, share = _tapered(x)
    square[first:], worth[first:], c[first:] = tapered, share, 0.0
    edges = np.union1d(_edges(square), [first])
    if extra is not None:
        square = square + extra
        known = _known(extra, square)
        c = c / np.sqrt(known)
    weight = worth * np.minimum(known / np.mean(known), 1.0) ** 2
    out = []
    for odd in (True, False):
        k = np.arange(1 if odd else 2, n, 2)
        low, k = k[:LOW], k[LOW:]
        start = np.unique(np.searchsorted(k, edges))
        start = start[start < k.size]
        count = np.add.reduceat(weight[k], start)
        begin, last = k[start].astype(float), k[np.append(start[1:], k.size) - 1].astype(float)
        out.append(_Part(odd, n, c[low], 0.5 * (begin + last), 0.5 * (last - begin) + 1.0, count,
                         np.add.reduceat((weight * square)[k], start),
                         np.add.reduceat((weight * c)[k], start), begin < first))  # fmt: skip
    return out


def _tapered(x: Array) -> tuple[int, Array, float]:
    """Return the first ordinate that is taken of a stretch (n,) with tapered ends, the powers from it on, and how many
    independent ones each of them is worth; of a short stretch none.
    """
    n = x.size
    length = min(int(TAPER * n), MOST_TAPER)
    if length < LEAST_TAPER:
        return n, np.empty(0), 1.0
    rise = np.sin(0.5 * np.pi * (np.arange(length) + 0.5) / length) ** 2
    y = x - x.mean()
    y[:length] *= rise
    y[n - length :] *= rise[::-1]
    square, fourth = (1.0 - 2.0 * length / n * (1.0 - float(np.mean(rise**p))) for p in (2, 4))
    first = max(int(EDGES / length * n / np.pi), 2 * LOW + 1)
    return first, fft.dct(y, norm="ortho")[first:] ** 2 / square, square**2 / fourth


def _known(extra: Array, square: Array) -> Array:
    """Return the part (n,) of the powers of the ordinates that the samples give; the rest is of those that lack.

    With a known error of variance f S an ordinate tells of log S as (1 - f)^2 ordinates: they count so, against what
    the lack of samples takes from all alike.
    """
    lacks = smooth_spectrum(np.maximum(extra, 0.0)) / smooth_spectrum(np.maximum(square, 0.0))
    lacks[0] = 0.0
    return np.asarray(1.0 - np.clip(lacks, 0.0, 0.95))


def _edges(square: Array) -> NDArray[np.int64]:
    """Return the first ordinates of bins of powers (n,): of equal logarithmic width, but single ones of each parity
    where a peak stands out that is narrower than they are.
    """
    n = square.size
    edges = [2 * LOW + 1]
    while edges[-1] < n:
        edges.append(max(edges[-1] + 2, round(edges[-1] * (1.0 + WIDTH))))
    start = np.array(edges)
    # by the geometric mean around, that peaks do not move
    log = np.log(np.maximum(square, 1e-300)) + CHI
    around = np.exp(ndimage.uniform_filter1d(log, AROUND, mode="reflect"))
    near = ndimage.uniform_filter1d(square, NEAR, mode="reflect")
    excess = near / around
    excess[: edges[0]] = 0.0
    least = max(CLEAR, float(np.partition(excess, -SINGLE)[-SINGLE])) if n > SINGLE else CLEAR
    single = np.flatnonzero(ndimage.maximum_filter1d((excess > least).astype(np.int8), 2 * NEAR))
    return np.unique(np.concatenate([start, single[(single % 2 == 1) & (single >= edges[0])]]))


class Ordinates:
    """Ordinates of the stretches of a record in unit time, and what the likelihood needs of them.

    stretches: each (n,), NaN nowhere, n >= SHORTEST; extras: what is added to the powers of each, or None.
    weight: part of the samples that are information.  means: see :mod:`terms`.  rounding: variance of the errors that
    the step of the output makes, 0 where none is known.
    """

    def __init__(self, stretches: Sequence[Array], means: bool = False, extras: Sequence[Array | None] = (),
                 weight: float = 1.0, rounding: float = 0.0) -> None:  # fmt: skip
        times = [np.arange(x.size) - 0.5 * (x.size - 1) for x in stretches]
        length = sum(float(t @ t) for t in times)
        self.slope = sum(float(t @ x) for t, x in zip(times, stretches, strict=True)) / length
        parts = [p for i, (t, x) in enumerate(zip(times, stretches, strict=True))
                 for p in _parts(x - self.slope * t, extras[i] if extras else None)]  # fmt: skip
        self.n = np.array([p.n for p in parts])
        self.samples, self.rounding = int(self.n.sum() // 2), rounding
        self.odd = np.array([p.odd for p in parts])
        k = np.array([np.arange(1 if p.odd else 2, 2 * LOW + 1, 2) for p in parts])
        self.low_omega = np.pi * k / self.n[:, None]  # (g, LOW)
        self.columns = np.array([p.low for p in parts])
        omega = np.concatenate([np.pi * p.k / p.n for p in parts])
        half = np.concatenate([np.pi * p.half_width / p.n for p in parts])
        self.b = omega.size
        self.count, self.power, self.total = (
            np.concatenate([getattr(p, name) for p in parts]) for name in ("count", "power", "total")
        )
        self.count, self.power, self.total = weight * self.count, weight * self.power, weight * self.total
        self.starts = np.cumsum([0] + [p.k.size for p in parts])[:-1]
        grid = np.concatenate([omega, self.low_omega.ravel()])
        sizes = np.concatenate([*(np.where(p.plain, float(p.n), np.inf) for p in parts), np.repeat(self.n, LOW)])
        self.grid = Grid(grid, means, np.concatenate([half, np.zeros(self.low_omega.size)]), sizes)
        self.ends = np.concatenate([np.sqrt(2.0 / p.n) * np.cos(0.5 * np.pi * p.k / p.n) * p.plain for p in parts])
        half_low = 0.5 * self.low_omega
        self.low_ends = np.sqrt(2.0 / self.n[:, None]) * np.cos(half_low)
        self.all_ends = np.concatenate([self.ends, self.low_ends.ravel()])
        self.ramp = np.where(self.odd[:, None], -self.low_ends / (2.0 * np.sin(half_low) ** 2), 0.0)
        ratio, correlation = flicker(low=2 * LOW)
        self._flicker = np.array([correlation[1 - o :: 2, 1 - o :: 2] for o in self.odd.astype(int)])
        self._flicker_ratio = np.array([ratio[1 - o :: 2] for o in self.odd.astype(int)])
        self.all_count = np.concatenate([self.count, np.ones(self.low_omega.size)])
        self.all_power = np.concatenate([self.power, self.columns.ravel() ** 2])
        self.fixed = np.zeros(grid.size)  # spectrum of terms that are not fitted
        self.fixed_angle = 0.0  # and the variance of their errors of an angle

    def hold(self, terms: Sequence[tuple[NoiseTerm, Array]]) -> None:
        """Take terms with their parameters as they are, beside those of a model."""
        self.fixed = np.asarray(sum((t.spectrum(p, self.grid) for t, p in terms), np.zeros(self.fixed.size)))
        self.fixed_angle = sum(float(t.angle(p)) for t, p in terms)

    # ------------------------------------------------------------------ spectra and the covariance of the first ones
    def low_covariance(self, term: NoiseTerm, p: Array, S: Array) -> Array:
        """Return what is not diagonal in the covariance (..., g, LOW, LOW) of the first ordinates of a term, or 0.

        S (..., g, LOW): its spectrum there.
        """
        if term.name == "flicker":
            size = np.sqrt(S * self._flicker_ratio)
            full = self._flicker * size[..., :, None] * size[..., None, :]
            diagonal = np.arange(LOW)
            full[..., diagonal, diagonal] -= S
            return np.asarray(full)
        z, amplitude, _ = markov_parts(np.exp(p[..., 1]), self.grid.means)
        z, v = z[..., None], np.exp(p[..., 0]) * amplitude
        sign = np.where(self.odd, -1.0, 1.0) * z ** (self.n - 1.0)
        share = 2.0 * z * (1.0 - z) * (1.0 - z * (1.0 + sign) / (1.0 + z))  # (..., g)
        a = self.low_ends / (1.0 - 2.0 * z[..., None] * np.cos(self.low_omega) + z[..., None] ** 2)
        scale = -v[..., None] * (1.0 - z * z) * share
        out: Array = scale[..., None, None] * a[..., :, None] * a[..., None, :]
        return out

    def covariance(self, model: Model, p: Array) -> tuple[Array, Array]:
        """Return spectra S (..., b) of the bins and the covariance (..., g, LOW, LOW) of the first ordinates, without
        the errors of the end angles; p (..., q) in the order of the terms.
        """
        shape = p.shape[:-1]
        S = np.broadcast_to(self.fixed, (*shape, self.fixed.size)).copy()
        low = np.zeros((*shape, *self.low_omega.shape, LOW))
        passes = passed(model, p, self.grid)
        for term, q in split(model, p):
            s = term.spectrum(q, self.grid)
            s = s * passes if passes is not None and term.name in SLOW else s
            S += s
            if term.name in ("flicker", "gauss_markov"):
                low += self.low_covariance(term, q, s[..., self.b :].reshape(*shape, *self.low_omega.shape))
        diagonal = np.arange(LOW)
        low[..., diagonal, diagonal] += S[..., self.b :].reshape(*shape, *self.low_omega.shape) + FLOOR
        return np.maximum(S[..., : self.b], FLOOR), low

    # ------------------------------------------------------------------ likelihood
    def rest(self, S: Array, low: Array, q2: Array) -> tuple[Array, Array, Array]:
        """Return the part of -2 log likelihood that is not a sum over bins (M,), and ramp and its variance.

        S (M, b), low (M, g, LOW, LOW); q2 (M,): variance of the error of an angle.
        """
        factor = _factor(low)
        columns = np.stack([self.columns, self.low_ends, self.ramp], axis=-1)
        solved = np.linalg.solve(factor, np.broadcast_to(columns, (*low.shape[:-1], 3)))
        forms = np.swapaxes(solved, -1, -2) @ solved  # (M, g, 3, 3)
        cc, cu, cr = (forms[..., 0, j] for j in range(3))
        uu, ur, rr = forms[..., 1, 1], forms[..., 1, 2], forms[..., 2, 2]
        if np.any(q2 > 0.0):
            cu = cu + np.add.reduceat(self.total * self.ends / S, self.starts, axis=-1)
            uu = uu + np.add.reduceat(self.count * self.ends**2 / S, self.starts, axis=-1)
        s = 2.0 * q2[..., None]
        left = 1.0 / (1.0 + s * uu)
        shrink = s * left
        info = np.sum(rr - shrink * ur**2, axis=-1)
        score = np.sum(cr - shrink * cu * ur, axis=-1)
        value = np.sum(cc - shrink * cu**2 - np.log(left), axis=-1) - score**2 / info + np.log(info)
        value = value + 2.0 * np.sum(np.log(np.diagonal(factor, axis1=-2, axis2=-1)), axis=(-2, -1))
        return value, score / info, 1.0 / info

    def angle(self, model: Model, p: Array) -> Array:
        """Return the variance of the error of an angle (...), 0 where the model has none."""
        angles = [term.angle(q) for term, q in split(model, p) if term.rises]
        return np.asarray(np.zeros(p.shape[:-1]) + self.fixed_angle + sum(angles))

    def value(self, model: Model, p: Array) -> Array:
        """Return -2 log restricted likelihood (M,) of parameters p (M, q)."""
        S, low = self.covariance(model, p)
        out: Array = np.sum(self.count * np.log(S) + self.power / S, axis=-1)
        return out + self.rest(S, low, self.angle(model, p))[0]

    def ramp_of(self, model: Model, p: Array) -> tuple[Array, Array]:
        """Return the ramp per unit time (M,) and its standard deviation, for given parameters (M, q)."""
        S, low = self.covariance(model, p)
        _, ramp, variance = self.rest(S, low, self.angle(model, p))
        return ramp + self.slope, np.sqrt(variance)

    def scoring(self, model: Model, p: Array) -> tuple[float, Array, Array]:
        """Return -2 log likelihood at p (q,), its gradient and twice the expected information (q, q).

        The information is that of uncorrelated ordinates.
        """
        S = self.fixed.copy()
        dS = np.zeros((p.size, S.size))
        low = np.zeros((*self.low_omega.shape, LOW))
        dlow = np.zeros((p.size, *low.shape))
        shape, at = self.low_omega.shape, 0
        passes, slow, filter_rows = passed(model, p, self.grid), np.zeros(S.size), slice(0)
        for term, q in split(model, p):
            steps = np.concatenate([q[None], *((q + h * e)[None] for e in np.eye(q.size)[1:] for h in (1e-4, -1e-4))])
            s = term.spectrum(steps, self.grid)
            if passes is not None and term.name in SLOW:
                s = s * passes
                slow += s[0]
            elif term.name == "white":
                white, filter_rows = s[0], slice(at + 1, at + q.size)
            S += s[0]
            dS[at] = s[0]
            dS[at + 1 : at + q.size] = (s[1::2] - s[2::2]) / 2e-4
            if term.name in ("flicker", "gauss_markov"):
                extra = self.low_covariance(term, steps, s[:, self.b :].reshape(-1, *shape))
                low += extra[0]
                dlow[at] = extra[0]
                dlow[at + 1 : at + q.size] = (extra[1::2] - extra[2::2]) / 2e-4
            at += q.size
        if passes is not None:
            dS[filter_rows] *= 1.0 + slow / white
        diagonal = np.arange(LOW)
        low[..., diagonal, diagonal] += S[self.b :].reshape(shape) + FLOOR
        dlow[..., diagonal, diagonal] += dS[:, self.b :].reshape(-1, *shape)
        S = np.maximum(S, FLOOR)
        slope = dS / S
        high = slice(0, self.b)
        value = float(np.sum(self.count * np.log(S[high]) + self.power / S[high]))
        gradient = slope[:, high] @ (self.count - self.power / S[high])
        h = 1e-4
        q2, dq = float(self.angle(model, p)), np.zeros(p.size)
        if any(term.rises for term in model):
            dq = (self.angle(model, p + h * np.eye(p.size)) - self.angle(model, p - h * np.eye(p.size))) / (2.0 * h)
        signs = np.concatenate([[0.0], np.full(p.size, h), np.full(p.size, -h)])
        which = np.concatenate([[0], np.arange(p.size), np.arange(p.size)])
        moved = S[high] + signs[:, None] * dS[which][:, high] if q2 else np.broadcast_to(S[high], (signs.size, self.b))
        rest = self.rest(
            np.maximum(moved, FLOOR), low + signs[:, None, None, None] * dlow[which], q2 + signs * dq[which]
        )[0]
        gradient += (rest[1 : 1 + p.size] - rest[1 + p.size :]) / (2.0 * h)
        return value + float(rest[0]), gradient, (slope * self.all_count) @ slope.T


def _factor(low: Array) -> Array:
    """Return the Cholesky factors of covariances (..., LOW, LOW); rounding that makes one indefinite is lifted, what is
    no number is a variance that nothing has.
    """
    try:
        return np.asarray(np.linalg.cholesky(low), dtype=float)
    except np.linalg.LinAlgError:
        sound = np.isfinite(low).all(axis=(-2, -1), keepdims=True)
        values, vectors = np.linalg.eigh(np.where(sound, low, HUGE * np.eye(LOW)))
        values = np.maximum(values, 1e-9 * np.abs(values).max(axis=-1, keepdims=True))
        lifted = vectors * values[..., None, :] @ np.swapaxes(vectors, -1, -2)
        return np.asarray(np.linalg.cholesky(lifted), dtype=float)


def split(model: Model, p: Array) -> list[tuple[NoiseTerm, Array]]:
    """Return each term with its parameters (..., size)."""
    out, at = [], 0
    for term in model:
        out.append((term, p[..., at : at + term.size]))
        at += term.size
    return out


def size_of(term: str) -> Callable[[Model, Array], Array | None]:
    """Return the figure log variance of the first term of a name, of N the sum of white and readout noise."""

    def figure(model: Model, p: Array) -> Array | None:
        parts = [q[..., 0] for t, q in split(model, p) if t.name == term or (term == "white" and t.name == "readout")]
        return np.logaddexp.reduce(parts, axis=0) if parts else None

    return figure


def joined(parts: Sequence[tuple[NoiseTerm, Array]]) -> tuple[Model, Array]:
    """Return model and parameters of terms with their parameters."""
    return tuple(t for t, _ in parts), np.concatenate([q for _, q in parts], axis=-1)


def parameters(model: Model) -> int:
    """Return the number of parameters of a model."""
    return sum(term.size for term in model)


def filtered(model: Model) -> bool:
    """Return whether the white noise of a model has passed a filter."""
    return any(term.filter != "none" for term in model)


def passed(model: Model, p: Array, grid: Grid) -> Array | None:
    """Return what a filter that slow noise passes too passes of the power (..., b), None where there is none."""
    for term, q in split(model, p):
        if passes_slow(term.filter):
            return term.unit(q[..., 1:], grid)
    return None


def spectrum(model: Model, p: Array, grid: Grid) -> Array:
    """Return S (..., b) of a model."""
    passes = passed(model, p, grid)
    each = [term.spectrum(q, grid) * (passes if passes is not None and term.name in SLOW else 1.0)
            for term, q in split(model, p)]  # fmt: skip
    return np.asarray(np.sum(each, axis=0))


def allan(model: Model, p: Array, m: Array, means: bool = False) -> Array:
    """Return the Allan variance (..., k) of means over m samples, of the terms of a model."""
    out = np.asarray(np.sum([term.allan(q, m, means) for term, q in split(model, p)], axis=0))
    grid = covariance_grid(means)
    passes = passed(model, p, grid)
    slow = [term.spectrum(q, grid) for term, q in split(model, p) if term.name in SLOW]
    if passes is None or not slow:
        return out
    # what the low-pass holds back of slow noise has a short memory
    least = 1e-6 * out
    return np.maximum(out - allan_of_spectrum(np.sum(slow, axis=0) * (1.0 - passes), m), least)
