"""Overlapping Allan, modified Allan and Hadamard deviation of a rate, in one pass over blocks, memory bounded.

The record is means of the rate over tau0; theta_i is their running sum, the angle.  For tau = m tau0

    allan      sigma^2 = <(theta_{i+2m} - 2 theta_{i+m} + theta_i)^2> / (2 tau^2)
    modified   the same of the mean angle over m readings from i on
    hadamard   sigma^2 = <(theta_{i+3m} - 3 theta_{i+2m} + 3 theta_{i+m} - theta_i)^2> / (6 tau^2)

for m = 1, 2, 4, 8, ..., over every start i up to m = STARTS.  For longer m the starts are spaced evenly, STARTS/2 or
more of them within tau, and tau is a multiple of their spacing; the degrees of freedom do not change by that (a few
starts within tau are enough, Riley 2008).  Intervals: chi-squared with the equivalent degrees of freedom of Greenhall
2003 for the power law that the deviation shows around tau.  They hold for one tau; values at neighbouring tau are
correlated.  allantools, which gives the degrees of freedom, takes a record whole and without gaps.
[DRIFT-ALLAN; IEEE 952, annex C; Riley 2008, eq. 11, 14, 20, 45; Greenhall 2003]

Residuals of a fit: a constant changes nothing; what the fitted terms take at long tau is missing in the deviation,
which then falls although the instrument does not.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.arrays import Array

KINDS = ("allan", "modified", "hadamard")
STARTS = 1024  # longest m that is computed from every start
FULL, COARSE = 16384, 4096  # cells processed at a time, at the sampling interval and above
MISSING = 0.01  # part of a mean over tau that may be missing


@dataclass(frozen=True)
class Deviation:
    """One deviation over tau, each array (k,): tau in s, the others in the unit of the rate.

    low, high: interval of 95 %; edf: equivalent degrees of freedom; count: differences from every sample on (of long
    tau from every stride-th, which stand for all); exponent: alpha of the power law S ~ f^alpha that the edf are for
    (0 white rate, -1 flicker, -2 random walk, 2 white angle).
    """

    kind: str
    tau: Array
    deviation: Array
    low: Array
    high: Array
    edf: Array
    count: NDArray[np.int64]
    exponent: NDArray[np.int64]


class _Stage:
    """Differences over m cells of ``stride`` samples each, for the m given; pairs of cells go to the next stage.

    Cells (3, n) have rows: mean rate, mean angle less the angle at the start over tau0, part of the samples present.
    """

    def __init__(self, stride: int, steps: list[int], kinds: tuple[str, ...]) -> None:
        self.stride, self.steps, self.kinds = stride, steps, kinds
        self.keep = 3 * max(steps, default=0)
        self.least = FULL if stride == 1 else COARSE
        self.sums = {(kind, m): [0.0, 0] for kind in kinds for m in steps}
        self.begin()

    def begin(self) -> None:
        """Begin a stretch: forget what was before."""
        self.tail, self.fresh, self.waiting = np.empty((3, 0)), list[Array](), 0

    def add(self, cells: Array) -> Array:
        """Take cells (3, n); return pairs of them (3, n'), none until enough are there."""
        self.fresh.append(cells)
        self.waiting += cells.shape[1]
        return self.process() if self.waiting >= self.least else np.empty((3, 0))

    def process(self, end: bool = False) -> Array:
        """Sum up what is waiting; return pairs of its cells.  An odd cell waits on, at the end it takes part."""
        if not self.waiting:
            return np.empty((3, 0))
        fresh = np.concatenate(self.fresh, axis=1) if len(self.fresh) > 1 else self.fresh[0]
        even = self.waiting - self.waiting % 2
        use = fresh if end else fresh[:, :even]
        cells = np.concatenate([self.tail, use], axis=1)
        old = self.tail.shape[1]
        if not self._reached(cells.shape[1] + 1):
            pass  # too short for any difference
        elif cells[2].min(initial=1.0) >= 1.0:
            self._complete(cells, old, end)
        else:
            self._with_gaps(cells, old)
        self.tail = cells[:, max(cells.shape[1] - self.keep, 0) :]
        self.fresh, self.waiting = [fresh[:, even:]], self.waiting - even
        return _pairs(fresh[:, :even], self.stride)

    def _reached(self, angles: int) -> list[int]:
        """Return the steps of which so many angles have a difference."""
        return [m for m in self.steps if 2 * m < angles]

    def _add(self, kind: str, m: int, z: Array, scale: float) -> None:
        entry = self.sums[kind, m]
        entry[0] += float(np.einsum("i,i", z, z)) / scale  # z @ z starts threads, which wait on a busy machine
        entry[1] += z.size

    def _complete(self, cells: Array, old: int, end: bool) -> None:
        # a constant rate is in no difference; without it the sums stay small
        angle = np.concatenate([[0.0], np.cumsum(cells[0] - cells[0].mean())]) * self.stride
        for m in self._reached(angle.size):
            h = m * self.stride
            if "hadamard" in self.kinds:
                second = _second(angle[max(old + 1 - 3 * m, 0) :], m)
                third = second[m:] - second[:-m]
                self._add("hadamard", m, third, 6.0 * h * h)
                if "allan" in self.kinds:  # one that ends in the new cells starts at old + 1 - 2 m or later
                    second = second[max(old + 1 - 2 * m, 0) - max(old + 1 - 3 * m, 0) :]
            elif "allan" in self.kinds:
                second = _second(angle[max(old + 1 - 2 * m, 0) :], m)
            if "allan" in self.kinds:
                self._add("allan", m, second, 2.0 * h * h)
        if "modified" in self.kinds:
            mean = angle[:-1] + cells[1]
            if end and self.stride == 1:  # the last angle has no cell
                mean = np.append(mean, angle[-1])
            area = np.concatenate([[0.0], np.cumsum(mean - mean.mean())])
            for m in self._reached(area.size):
                second = _second(area[max(old + 1 - 3 * m, 0) :], m)
                self._add("modified", m, second[m:] - second[:-m], 2.0 * (m * m * self.stride) ** 2)

    def _with_gaps(self, cells: Array, old: int) -> None:
        """Sum up where samples are missing: means of those present, if no more than MISSING of a mean is not."""
        rate, angle, present = cells
        area = np.concatenate([[0.0], np.cumsum(rate * present)])
        there = np.concatenate([[0.0], np.cumsum(present)])
        path = np.concatenate([[0.0], np.cumsum(rate)]) * self.stride
        mean_angle = np.concatenate([[0.0], np.cumsum(path[:-1] + angle)])
        for m in self.steps:
            share = there[m:] - there[:-m]
            usable = share >= (1.0 - MISSING) * m
            mean = np.where(usable, (area[m:] - area[:-m]) / np.where(usable, share, 1.0), np.nan)
            first = mean[m:] - mean[:-m]
            second = first[m:] - first[:-m]
            each = {"allan": first[max(old + 1 - 2 * m, 0) :]}
            each["hadamard"] = second[max(old + 1 - 3 * m, 0) :]
            scale = {"allan": 2.0, "hadamard": 6.0, "modified": 2.0 * (m * m * self.stride) ** 2}
            if "modified" in self.kinds:
                curve = _second(mean_angle, m)
                curve = curve[m:] - curve[:-m]
                whole = there[3 * m :] - there[: -3 * m] >= 3 * m - 1e-6
                each["modified"] = np.where(whole, curve, np.nan)[max(old + 1 - 3 * m, 0) :]
            for kind in self.kinds:
                self._add(kind, m, each[kind][np.isfinite(each[kind])], scale[kind])


def _second(x: Array, m: int) -> Array:
    d = x[m:] - x[:-m]
    return d[m:] - d[:-m]


def _pairs(cells: Array, stride: int) -> Array:
    """Return cells of twice the length (3, n/2)."""
    a, b = cells[:, ::2], cells[:, 1::2]
    present = 0.5 * (a[2] + b[2])
    share = np.where(present > 0.0, 0.5 * a[2] / np.where(present > 0.0, present, 1.0), 0.5)
    return np.array([share * a[0] + (1.0 - share) * b[0], 0.5 * (a[1] + a[0] * stride + b[1]), present])


class DeviationAccumulator:
    """Deviations of a record that comes in blocks: ``add`` each block, ``gap`` where the record is interrupted.

    A sample that is missing at a known time is NaN: a mean over tau uses those that are there and is left out if more
    than MISSING of it are not (the modified deviation: if any is).  After ``gap`` nothing is computed across it.
    The memory does not depend on the record.
    """

    def __init__(self, tau0: float, kinds: Iterable[str] = ("allan",), fine: bool = False) -> None:
        """fine: four averaging times to an octave, whole numbers of samples, in place of one."""
        self.tau0, self.kinds, self.fine = tau0, tuple(kinds), fine
        unknown = [k for k in self.kinds if k not in KINDS]
        if unknown or not tau0 > 0.0:
            raise ValueError(f"kinds are of {KINDS}, tau0 is positive: {unknown}, {tau0}")
        self._stages = list[_Stage]()

    def _stage(self, k: int) -> _Stage:
        if k == len(self._stages):  # octaves: up to STARTS cells of one sample, then one more for each pairing of cells
            steps = [STARTS] if k else [1 << j for j in range(STARTS.bit_length())]
            if self.fine:  # from 3/4 of an octave below STARTS on, or from one sample
                least = STARTS.bit_length() * 4 - 7 if k else 0
                steps = sorted({round(2.0 ** (j / 4.0)) for j in range(least, STARTS.bit_length() * 4 - 3)})
            self._stages.append(_Stage(1 << k, steps, self.kinds))
        return self._stages[k]

    def add(self, block: Array) -> None:
        """Add rates, NaN where one is missing."""
        x = np.asarray(block, dtype=float)
        for i in range(0, x.size, FULL):
            part = x[i : i + FULL]
            there = np.isfinite(part)
            cells = np.zeros((3, part.size))
            cells[0], cells[2] = (part, 1.0) if there.all() else (np.where(there, part, 0.0), there)
            self._pass_on(0, cells)

    def _pass_on(self, k: int, cells: Array) -> None:
        while cells.shape[1]:
            cells = self._stage(k).add(cells)
            k += 1

    def gap(self) -> None:
        """End a stretch: what follows has no known relation in time to what was before."""
        k = 0
        while k < len(self._stages):
            self._pass_on(k + 1, self._stages[k].process(end=True))
            self._stages[k].begin()
            k += 1

    def result(self) -> dict[str, Deviation]:
        """End the record; return its deviations, every tau that has two differences or more."""
        self.gap()
        return {kind: self._deviation(kind) for kind in self.kinds}

    def _deviation(self, kind: str) -> Deviation:
        rows = [(s.stride, m, *s.sums[kind, m]) for s in self._stages for m in s.steps if s.sums[kind, m][1] > 1]
        stride, m, square, count = np.array(rows).reshape(-1, 4).T
        tau, dev = m * stride * self.tau0, np.sqrt(square / count)
        alpha = _exponents(kind, tau, dev, count / m)
        edf = np.array([degrees_of_freedom(kind, *row) for row in zip(m, count, alpha, strict=True)])
        low, high = (dev * np.sqrt(edf / special.chdtri(edf, p)) for p in (0.025, 0.975))
        return Deviation(kind, tau, dev, low, high, edf, (stride * count).astype(np.int64), alpha)


def deviations(
    rate: Array | Iterable[Array], tau0: float, kinds: Iterable[str] = ("allan",), fine: bool = False
) -> dict[str, Deviation]:  # fmt: skip
    """Return the deviations of a rate (n,), or of stretches of it that have no known relation in time."""
    total = DeviationAccumulator(tau0, kinds, fine)
    for stretch in [rate] if isinstance(rate, np.ndarray) else rate:
        total.add(stretch)
        total.gap()
    return total.result()


@functools.lru_cache(maxsize=4096)  # records of one plan have the same
def degrees_of_freedom(kind: str, m: float, count: float, alpha: int) -> float:
    """Return the equivalent ones of ``count`` differences over m cells, noise of S ~ f^alpha, alpha 2, 0, -1, ..."""
    import allantools

    d = 3 if kind == "hadamard" else 2
    m, count = int(m), int(count)
    if kind == "modified":
        return float(allantools.edf_greenhall(alpha, d, m, count + 3 * m - 1, overlapping=True, modified=True))
    if alpha < 2:
        return float(allantools.edf_greenhall(alpha, d, m, count + d * m, overlapping=True, modified=False))
    # angles are independent: differences are correlated where they share one, k m apart
    weight = np.array([math.comb(d, k) * (-1.0) ** k for k in range(d + 1)])
    shared = np.correlate(weight, weight, "full")[d:] / float(weight @ weight)
    pairs = np.maximum(1.0 - m * np.arange(d + 1) / count, 0.0)
    return count / float(2.0 * (shared**2 @ pairs) - 1.0)


def _exponents(kind: str, tau: Array, dev: Array, independent: Array) -> NDArray[np.int64]:
    """Return alpha of the power law S ~ f^alpha nearest to the slope of the deviation around each tau.

    The slope is of least squares with weights that fall with the distance and with the scatter of a value.
    """
    out = np.zeros(tau.size, dtype=np.int64)
    x, y = np.log2(tau), np.log2(np.maximum(dev, 1e-300))
    lowest = -3 if kind == "hadamard" else -2
    for i in range(tau.size if tau.size > 1 else 0):
        near = 1.0 / (1.0 / independent + 0.05 * (x - x[i]) ** 4 + 1e-3)
        dx = x - near @ x / near.sum()
        mu = 2.0 * float(near @ (dx * y) / (near @ dx**2))
        alpha = round(-mu - 1.0)
        angle = mu < (-2.0 if kind == "modified" else -1.5) and np.all(out[:i] == 2)  # it is at short tau or nowhere
        out[i] = 2 if angle else max(min(alpha, 0), lowest)
    return out
