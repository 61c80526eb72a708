"""Threshold: the least rate at which a gyro answers with half of it, from small rates of both senses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.result import Coefficient, Table
from gyrobench.units import DEG

SMALL = 0.02  # of the largest rate: rates below it are left to the threshold, but those at rest
SAME = 1e-3  # relative: rates that are the same but for the sense
HALF = 0.5  # of the response that a rate should have
FALSE = 0.05  # probability that any rate of a plan with repeats is surely answered, or not, where it is not so
MEANING = "threshold: rate at which the gyro begins to answer with half of it, between two rates of the plan"


@dataclass(frozen=True)
class SmallRates:
    """Response over rate of each small rate (n,), half the difference of both senses, with its u; rates rise, rad/s.

    margin (n,): by how much a ratio must differ from the half of a response to be surely on its side.  unit, scale: of
    the rates as printed, rad/s per unit.
    """

    rate: Array
    ratio: Array
    u: Array
    margin: Array
    unit: str = "°/s"
    scale: float = DEG

    @classmethod
    def of(cls, w: Array, y: Array, phase: NDArray[np.int_], unit: str = "°/s", scale: float = DEG) -> SmallRates:
        """Return the responses in readings of phases (n,) that repeat each rate: what drifts between phases is seen.

        w, y: rates and readings (n,), rad/s.

        The variance of a ratio is the larger of three: of the readings and of the means of repeated phases, each pooled
        over all rates, and of the repeats of this rate alone, for a rate that is answered now and then scatters more
        than others.  margin: Student's quantiles of each for FALSE, shared by all rates but in the last.
        """
        cells = list(_both_senses(w))
        means = [[[y[side & (phase == p)] for p in np.unique(phase[side])] for side in sides] for _, *sides in cells]
        reading, dof_reading = _pooled([x for sides in means for side in sides for x in side])
        between, dof_between = _pooled([np.array([x.mean() for x in side]) for sides in means for side in sides])
        shared = 1.0 - 0.5 * FALSE / max(len(cells), 1)
        rows = []
        for (r, plus, minus), sides in zip(cells, means, strict=True):
            within = math.sqrt(reading * sum(1.0 / np.count_nonzero(side) for side in (plus, minus)))
            own = [np.array([x.mean() for x in side]) for side in sides]
            alone = sum(float(np.var(x, ddof=1)) / x.size for x in own if x.size > 1)
            sizes = (
                (within, dof_reading, shared),
                (math.sqrt(between * sum(1.0 / len(side) for side in sides)), dof_between, shared),
                (math.sqrt(alone), sum(x.size - 1 for x in own), 1.0 - 0.5 * FALSE),
            )
            u = 0.5 * max(size for size, *_ in sizes) / r
            known = [float(stats.t.ppf(p, dof)) * size for size, dof, p in sizes if dof]
            margin = max(known, default=math.inf)
            rows.append((r, 0.5 * (float(y[plus].mean()) - float(y[minus].mean())) / r, u, 0.5 * margin / r))
        rate, ratio, u_ratio, margins = np.reshape(rows, (-1, 4)).T.copy()
        return cls(rate, ratio, u_ratio, margins, unit, scale)

    @property
    def silent(self) -> bool:
        """Whether a rate is surely not answered."""
        return bool(np.any(self.ratio + self.margin < HALF))

    @property
    def answered(self) -> bool:
        """Whether every rate is surely answered."""
        return bool(np.all(self.ratio - self.margin > HALF))

    @property
    def bounds(self) -> tuple[float, float] | None:
        """Largest rate surely without and least rate surely with half of the response; 0 and infinity where none is;
        None where a rate above one that responds does not, or the readings do not say it of any.
        """
        answers, silent = self.ratio - self.margin > HALF, self.ratio + self.margin < HALF
        low = float(self.rate[silent].max()) if silent.any() else 0.0
        high = float(self.rate[answers].min()) if answers.any() else math.inf
        return (low, high) if low < high and (answers.any() or silent.any()) else None

    def coefficient(self, truth: float | None) -> Coefficient | None:
        """Return the threshold with the rates between which it lies; None without small rates."""
        if not self.rate.size:
            return None
        shown = None if truth is None else truth / self.scale
        nothing = Coefficient(
            "threshold", MEANING, self.unit, math.nan, math.nan, 1.0, (math.nan, math.nan), truth=shown
        )
        if self.bounds is None:
            return _without(nothing, "not determined: the readings of the small rates are too noisy", math.nan)
        low, high = (x / self.scale for x in self.bounds)
        if low == 0.0:
            return _without(
                nothing, f"below {plain(high, 4)} {self.unit}: none of the plan is surely without an answer", high
            )
        if math.isinf(high):
            why = f"above {plain(low, 4)} {self.unit}: none of the plan is surely answered"
            return _without(nothing, why, math.nan)
        u = (high - low) / math.sqrt(12.0)  # nothing is known between the two
        return Coefficient(
            "threshold", MEANING, self.unit, 0.5 * (low + high), u, math.sqrt(3.0), (low, high), truth=shown,
            z=None if shown is None else (0.5 * (low + high) - shown) / u,
        )  # fmt: skip

    def table(self) -> list[Table]:
        if not self.rate.size:
            return []
        rows = [
            [r / self.scale, x, u, "yes" if x - m > HALF else "no" if x + m < HALF else "not sure"]
            for r, x, u, m in zip(*(v.tolist() for v in (self.rate, self.ratio, self.u, self.margin)), strict=True)
        ]
        caption = "Half the difference of both senses over the rate; a response: surely more than half"
        return [
            Table(
                "rate.small", "Response to small rates", caption, [f"rate / ({self.unit})", "ratio", "u", "response"],
                rows,
            )
        ]  # fmt: skip

    def sentence(self) -> list[str]:
        found = self.coefficient(None)
        if found is None:
            return []
        if found.no_value:
            return [f"Threshold {found.no_value}."]
        return [f"Threshold between {plain(found.interval[0], 4)} and {plain(found.interval[1], 4)} {self.unit}."]


def _without(c: Coefficient, why: str, high: float) -> Coefficient:
    return Coefficient(
        c.name, c.meaning, c.unit, math.nan, math.nan, c.k, (0.0, high) if math.isfinite(high) else c.interval,
        truth=c.truth, no_value=why,
    )  # fmt: skip


def _both_senses(w: Array) -> Iterator[tuple[float, NDArray[np.bool_], NDArray[np.bool_]]]:
    """Yield each size of the rates w (n,) that is there in both senses, with the rows of either."""
    for r in _distinct(np.abs(w)):
        plus, minus = (np.abs(s * w - r) < SAME * r for s in (1.0, -1.0))
        if plus.any() and minus.any():
            yield r, plus, minus


def _pooled(groups: list[Array]) -> tuple[float, int]:
    """Return the variance within groups, and its degrees of freedom."""
    dof = sum(x.size - 1 for x in groups)
    return (sum(float(np.sum((x - x.mean()) ** 2)) for x in groups) / dof, dof) if dof else (0.0, 0)


def _distinct(values: Array) -> list[float]:
    found: list[float] = []
    for v in np.sort(values).tolist():
        if not found or v - found[-1] > SAME * v:
            found.append(v)
    return found


def phases(w: Array) -> NDArray[np.int_]:
    """Return the number of the phase of each row (n,), from 0: rows that follow one another at the same rate w."""
    changes = np.abs(np.diff(w)) > SAME * np.abs(w[1:])
    return np.concatenate([[0], np.cumsum(changes)])
