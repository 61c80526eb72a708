"""Threshold: the least rate at which a gyro answers with half of it, from small rates of both senses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.result import Coefficient, Table
from gyrobench.units import DEG

SMALL = 0.02  # of the largest rate: rates below it are left to the threshold, but those at rest
SAME = 1e-3  # relative: rates that are the same but for the sense
HALF = 0.5  # of the response that a rate should have
SURE = 2.0  # standard uncertainties between a ratio and the half of a response
MEANING = "threshold: rate at which the gyro begins to answer with half of it, between two rates of the plan"


@dataclass(frozen=True)
class SmallRates:
    """Response over rate of each small rate (n,), half the difference of both senses, with its u; rates rise, rad/s.

    unit, scale: of the rates as printed, rad/s per unit.
    """

    rate: Array
    ratio: Array
    u: Array
    unit: str = "°/s"
    scale: float = DEG

    @classmethod
    def of(cls, w: Array, y: Array, noise: float, unit: str = "°/s", scale: float = DEG) -> SmallRates:
        """w, y: rates and readings, rad/s; noise: standard deviation of a reading."""
        rows = []
        for r in _distinct(np.abs(w)):
            plus, minus = (np.abs(s * w - r) < SAME * r for s in (1.0, -1.0))
            if plus.any() and minus.any():
                half = 0.5 * (float(y[plus].mean()) - float(y[minus].mean()))
                u = 0.5 * noise * math.sqrt(1.0 / np.count_nonzero(plus) + 1.0 / np.count_nonzero(minus))
                rows.append((r, half / r, u / r))
        columns = [np.array([row[k] for row in rows]) for k in range(3)]
        return cls(columns[0], columns[1], columns[2], unit, scale)

    @property
    def silent(self) -> bool:
        """Whether a rate is surely not answered."""
        return bool(np.any(self.ratio + SURE * self.u < HALF))

    @property
    def bounds(self) -> tuple[float, float] | None:
        """Largest rate surely without and least rate surely with half of the response; 0 and infinity where none is;
        None where a rate above one that responds does not, or the readings do not say it of any.
        """
        answers, silent = self.ratio - SURE * self.u > HALF, self.ratio + SURE * self.u < HALF
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
            return _without(nothing, f"below {high:.4g} {self.unit}: every rate of the plan is answered", high)
        if math.isinf(high):
            return _without(nothing, f"above {low:.4g} {self.unit}: no rate of the plan is answered", math.nan)
        u = (high - low) / math.sqrt(12.0)  # nothing is known between the two
        return Coefficient(
            "threshold", MEANING, self.unit, 0.5 * (low + high), u, math.sqrt(3.0), (low, high), truth=shown,
            z=None if shown is None else (0.5 * (low + high) - shown) / u,
        )  # fmt: skip

    def table(self) -> list[Table]:
        if not self.rate.size:
            return []
        rows = [
            [r / self.scale, x, u, "yes" if x - SURE * u > HALF else "no" if x + SURE * u < HALF else "not sure"]
            for r, x, u in zip(self.rate.tolist(), self.ratio.tolist(), self.u.tolist(), strict=True)
        ]
        caption = "Half the difference of both senses over the rate; a response: more than half, by two u"
        return [
            Table(
                "rate.small",
                "Response to small rates",
                caption,
                [f"rate / ({self.unit})", "ratio", "u", "response"],
                rows,
            )
        ]

    def sentence(self) -> list[str]:
        found = self.coefficient(None)
        if found is None:
            return []
        if found.no_value:
            return [f"Threshold {found.no_value}."]
        return [f"Threshold between {found.interval[0]:.4g} and {found.interval[1]:.4g} {self.unit}."]


def _without(c: Coefficient, why: str, high: float) -> Coefficient:
    return Coefficient(
        c.name, c.meaning, c.unit, math.nan, math.nan, c.k, (0.0, high) if math.isfinite(high) else c.interval,
        truth=c.truth, no_value=why,
    )  # fmt: skip


def _distinct(values: Array) -> list[float]:
    found: list[float] = []
    for v in np.sort(values).tolist():
        if not found or v - found[-1] > SAME * v:
            found.append(v)
    return found


def pooled_std(level: NDArray[Any], y: Array) -> float:
    """Return the standard deviation of readings at the same level (numbers from 0), pooled; NaN of one at each."""
    n = np.bincount(level)
    mean = np.bincount(level, weights=y) / np.maximum(n, 1)
    dof = y.size - int(np.count_nonzero(n))
    return math.sqrt(float(np.sum((y - mean[level]) ** 2)) / dof) if dof > 0 else math.nan
