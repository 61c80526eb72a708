"""A record made ready for its noise model: gaps, wild samples, spectral lines, steps of the level - taken out and told.

A gap of more than LONG samples ends a stretch; what is missing in shorter ones, and wild samples, is completed by what
the noise around says of it (:mod:`completion`).  Lines are found in the longest stretch and taken off the samples that
are there, in each stretch with an amplitude and phase of its own (:mod:`sines`).  [DRIFT-NOISE-MODEL,
DRIFT-PERIODIC]
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import fft, special

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.gap_completion import Completed, complete, mostly_known
from gyrobench.reduction.noise_model.ordinates import SHORTEST, Ordinates
from gyrobench.reduction.noise_model.rate_pulses import Pulse
from gyrobench.reduction.noise_model.sines import sines_of, standing
from gyrobench.reduction.noise_model.slow_changes import LevelChange, Settling, Swing, without
from gyrobench.reduction.noise_model.steps import LevelStep
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.lines import SpectralLine, find_lines

LONG = 1000  # samples of a gap that ends a stretch
MOST = 64  # stretches that are used, the longest
LEAST = 64  # samples of a record
MANY = 100_000  # samples of a stretch whose length matters to the time that it takes
LEVELS = 32  # parts of a record whose noise is compared
ENDS = 256  # samples of an end of a stretch that do not tell of the level
DISTINCT, OFF_STEP = 0.2, 0.05  # values of the samples of an output in steps; how far from a multiple, in steps


Placed = tuple[int, LevelChange]  # and the place of its stretch


@dataclass(frozen=True)
class TreatedStretch:
    """Samples from ``start`` on without a long gap, lines and changes of the level taken out: ``own`` (n,) with NaN,
    ``done`` completed.
    """

    start: int
    own: Array
    done: Completed
    changes: tuple[LevelChange, ...] = ()

    @property
    def gone(self) -> NDArray[np.int64]:
        """Return the indices of the samples that were completed."""
        return np.union1d(np.flatnonzero(~np.isfinite(self.own)), self.done.wild)


@dataclass(frozen=True)
class Treated:
    """Stretches of a record of ``samples`` samples on the grid, and what was taken out of it.

    spread: variance of the mean square of the noise over that of even normal noise, 1 where the level is even; levels
    (k,): rms of the noise in parts of the record, over that of all; p_level: probability of so large a difference of
    them; rounding: variance of what the step of the output makes, 0 where it has none.
    jumps: whether the level steps too often for steps to be taken out.  alike: share of the samples that are as they
    were read and equal the one before.  restless: share of the record that is none at rest.
    """

    samples: int
    stretches: tuple[TreatedStretch, ...]
    lines: tuple[SpectralLine, ...]
    complete_lines: bool
    spread: float
    levels: Array
    p_level: float
    find_wild: bool
    rounding: float = 0.0
    jumps: bool = False
    alike: float = 0.0
    restless: float = 0.0

    def without(self, changes: Sequence[Placed]) -> Treated:
        """Return the record with changes of the level taken out and their stretches completed anew.

        A step has power at low frequencies; what was completed beside it has too much of them.
        """
        stretches = list(self.stretches)
        for place in sorted({place for place, _ in changes}):
            s, mine = stretches[place], [change for i, change in changes if i == place]
            own = without(s.own, mine)
            stretches[place] = TreatedStretch(s.start, own, complete(own, self.find_wild), (*s.changes, *mine))
        spread, levels, p_level = _levels(stretches)
        return replace(self, stretches=tuple(stretches), spread=spread, levels=levels, p_level=p_level)

    @property
    def there(self) -> int:
        """Return the samples that are there and not wild, in the stretches."""
        return sum(s.own.size - s.done.missing - s.done.wild.size for s in self.stretches)

    @property
    def wild(self) -> NDArray[np.int64]:
        """Return the indices of the wild samples on the grid."""
        return np.concatenate([s.start + s.done.wild for s in self.stretches])

    @property
    def filled(self) -> int:
        return sum(s.done.missing for s in self.stretches)

    @property
    def below(self) -> float:
        """Return the variance of wild samples below the limit, which are in the samples and not in the noise."""
        return float(np.average([s.done.below for s in self.stretches], weights=[s.own.size for s in self.stretches]))

    @functools.cached_property
    def settled(self) -> bool:
        """Return whether what was completed came to an end, and is the lesser part, in all stretches."""
        return all(s.done.stays and mostly_known(s.done.x, s.done.extra) for s in self.stretches)

    @property
    def steps(self) -> list[LevelStep]:
        """Return the steps, at their place on the grid."""
        return [replace(x, at=s.start + x.at) for s in self.stretches for x in s.changes if isinstance(x, LevelStep)]

    @property
    def pulses(self) -> list[Pulse]:
        """Return the pulses of the rate, at their place on the grid."""
        return [replace(x, at=s.start + x.at) for s in self.stretches for x in s.changes if isinstance(x, Pulse)]

    @property
    def changes(self) -> list[LevelChange]:
        """Return all changes of the level, each at its place in its stretch."""
        return [x for s in self.stretches for x in s.changes]

    @property
    def settling(self) -> Settling | None:
        """Return how the drift settles from the beginning of the record on."""
        return next((x for x in self.changes if isinstance(x, Settling)), None)

    @property
    def swings(self) -> list[Swing]:
        return [x for x in self.changes if isinstance(x, Swing)]

    def completed(self, place: int, less: Sequence[Placed] = ()) -> Array:
        """Return a stretch completed, without changes of its level, beside which it was completed."""
        return without(self.stretches[place].done.x, [change for i, change in less if i == place])

    def ordinates(self, means: bool, keep_wild: bool = False, less: Sequence[Placed] = ()) -> Ordinates:
        """Return the ordinates of the stretches; keep_wild: with the wild samples left in; less: without changes, what
        was completed as it is.
        """
        weight = self.there / sum(s.own.size for s in self.stretches) / self.spread
        x, extra = [], list[Array | None]()
        for i, s in enumerate(self.stretches):
            y = self.completed(i, less)
            if keep_wild and s.done.wild.size:
                y = y.copy()
                y[s.done.wild] += s.own[s.done.wild] - s.done.x[s.done.wild]
            x.append(y)
            extra.append(None if keep_wild else s.done.extra)
        return Ordinates(x, means, extra, weight, self.rounding)

    def cleaned(self) -> Array:
        """Return the record (samples,) without lines, wild samples and changes of the level, NaN where nothing is or
        was taken out.
        """
        out = np.full(self.samples, np.nan)
        for s in self.stretches:
            y = s.done.x.copy()
            y[~np.isfinite(s.own)] = np.nan
            y[s.done.wild] = np.nan
            out[s.start : s.start + y.size] = y
        return out


def stretches_of(rate: Array, long: int = LONG) -> list[slice]:
    """Return the stretches of a rate (n,), NaN in gaps, of SHORTEST samples or more, without a gap of ``long``.

    Of one of MANY samples up to 0.6 % at its end stay out, so that its length has small factors: the transforms of
    others take ten times as long, and completing its missing samples takes a thousand of them.
    """
    there = np.flatnonzero(np.isfinite(rate))
    if not there.size:
        return []
    cuts = np.flatnonzero(np.diff(there) > long)
    begin, end = np.append(there[0], there[cuts + 1]), np.append(there[cuts], there[-1]) + 1
    end = np.array([a + (n if n < MANY else fft.prev_fast_len(n)) for a, n in zip(begin, end - begin, strict=True)])
    found = [slice(a, b) for a, b in zip(begin.tolist(), end.tolist(), strict=True)
             if np.count_nonzero(np.isfinite(rate[a:b])) >= SHORTEST]  # fmt: skip
    return sorted(sorted(found, key=lambda s: s.start - s.stop)[:MOST], key=lambda s: s.start)


def output_step(x: Array) -> float:
    """Return the step of which the samples (n,) are whole multiples, from any origin; 0.0 where they have none."""
    levels = np.unique(x[np.isfinite(x)])
    if not 2 < levels.size < DISTINCT * x.size:
        return 0.0
    gaps = np.diff(levels)
    count = np.cumsum(np.rint(gaps / gaps.min()))
    step = float((levels[-1] - levels[0]) / count[-1])
    off = np.abs(levels[1:] - levels[0] - step * count)
    return step if float(off.max()) < OFF_STEP * step else 0.0


def treat(
    rate: Array, rounding: float = 0.0, remove_lines: bool = True, find_wild: bool = True, wandering: bool = True
) -> Treated:
    """Return a rate (n,), NaN where a sample is missing, ready for its model; rounding: variance of what the step of
    the output makes; wandering: lines that wander are taken out too.

    Raises SeriesError for fewer samples than LEAST in stretches without long gaps, and for a constant record.
    """
    parts = stretches_of(rate)
    if sum(s.stop - s.start for s in parts) < LEAST:
        raise SeriesError(f"no stretch of {SHORTEST} samples without a gap of more than {LONG}")
    if not float(np.nanstd(rate)) > 0.0:
        raise SeriesError("the record is constant; it has no noise to fit")
    done = [complete(rate[s], find_wild) for s in parts]
    longest = int(np.argmax([s.stop - s.start for s in parts]))
    lines: tuple[SpectralLine, ...] = ()
    full = True
    own = [rate[s].copy() for s in parts]
    if remove_lines:
        found = find_lines(done[longest].drawn, 1.0)
        lines, full = tuple(x for x in found.lines if x.steady or wandering), found.complete
        lines = standing(own[longest], done[longest], lines)
    if lines:
        for y, d in zip(own, done, strict=True):
            y -= sines_of(y, d, lines)
        done = [complete(y, find_wild) for y in own]
    stretches = tuple(TreatedStretch(s.start, y, d) for s, y, d in zip(parts, own, done, strict=True))
    return Treated(rate.size, stretches, lines, full, *_levels(stretches), find_wild, rounding)


def _inner(z: Array) -> Array:
    """Return a whitened stretch without its ends, where what is narrow and high is cut off and stands out."""
    end = min(ENDS, z.size // 16)
    return z[end : z.size - end]


def _levels(stretches: Sequence[TreatedStretch]) -> tuple[float, Array, float]:
    """Return the spread of the mean square, the rms of parts over that of all, and p of so large differences of them,
    of the stretches with an even spectrum.
    """
    z = np.concatenate([_inner(s.done.white) for s in stretches])
    z = z[np.isfinite(z)]
    n = z.size
    square = z * z / float(np.mean(z * z))
    kurtosis = float(np.mean(square**2))
    spread = 0.5 * (kurtosis - 1.0) if kurtosis > 3.0 + 4.0 * math.sqrt(24.0 / n) else 1.0
    parts = max(2, min(LEVELS, n // 64))
    edges = np.linspace(0, n, parts + 1).astype(int)
    mean = np.add.reduceat(square, edges[:-1]) / np.diff(edges)
    # of the part's own noise: heavy tails do not look like a change
    u = np.sqrt(max(spread, 1.0) * 2.0 / np.diff(edges))
    inner = np.sqrt(np.maximum([np.var(square[a:b]) / (b - a) for a, b in pairwise(edges.tolist())], 1e-12))
    p = float(special.chdtrc(parts - 1, np.sum(((mean - 1.0) / np.minimum(np.maximum(inner, 0.3 * u), u)) ** 2)))
    return spread, np.sqrt(mean), p
