"""The measures of a campaign's table: which there are, in which runs, with which quantities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np

from gyrobench.arrays import Array

Json = dict[str, Any]
SEED_KINDS = ("seed", "seeds")
CONSTANT = 1e-9  # relative; what varies less does not vary
SAMPLED_KINDS = ("lhs", "sobol", "random")


@dataclass(frozen=True)
class CampaignMeasures:
    """Rows of a campaign (a pandas.DataFrame of the stored columns) with the names of its measures and axes.

    done: the rows of the runs that ended with a result.
    """

    rows: Any
    units: Mapping[str, str]
    axes: list[Json]
    names: list[str]

    @classmethod
    def of(cls, rows: Any, units: Mapping[str, str], axes: list[Json]) -> CampaignMeasures:
        names = [c.removesuffix(".estimate") for c in rows.columns if c.endswith(".estimate")]
        return cls(rows, units, axes, [n for n in names if np.isfinite(numbers(rows, f"{n}.estimate")).any()])

    @property
    def done(self) -> Any:
        return self.rows[self.rows["state"] == "done"]

    def unit(self, name: str) -> str:
        return self.units.get(f"{name}.estimate", "")

    def factors(self) -> list[Json]:
        """Return the axes that were varied, without seeds and without files of data."""
        rows = self.done
        return [
            axis
            for axis in self.axes
            if axis["kind"] not in (*SEED_KINDS, "data")
            and f"in.{axis['name']}" in rows
            and rows[f"in.{axis['name']}"].nunique() > 1
        ]

    @property
    def is_lot(self) -> bool:
        """Return True if the rows are measured files, each of an instrument."""
        return "data" in self.rows and bool(self.rows["data"].notna().any())

    def instrument(self) -> list[str]:
        """Return the instrument of each row: as its file names it, else the name of the file."""
        named = self.rows["instrument"] if "instrument" in self.rows else [None] * len(self.rows)
        return [
            str(name) if isinstance(name, str) and name else PurePath(str(data)).stem
            for name, data in zip(named, self.rows["data"], strict=True)
        ]


def shared_seeds(rows: Any) -> Any:
    """Return the seed of each row as a number from 0 where rows share seeds, and so their noise; else None."""
    seeds = rows["seed"]
    if seeds.isna().any() or seeds.nunique() == len(seeds):
        return None
    return np.unique(seeds.to_numpy(dtype=float), return_inverse=True)[1]


def numbers(rows: Any, column: str) -> Array:
    """Return a column as floats, NaN where there is none."""
    if column not in rows:
        return np.full(len(rows), np.nan)
    return np.asarray(rows[column].to_numpy(dtype=float, na_value=np.nan))


def error(rows: Any, name: str) -> Array:
    """Return estimate minus truth, NaN where the truth is not known."""
    return numbers(rows, f"{name}.estimate") - numbers(rows, f"{name}.truth")


def normalized_error(rows: Any, name: str) -> Array:
    """Return error over the half-width of the 95 % interval on its side: beyond ±1 the interval misses the truth."""
    off = error(rows, name)
    below = numbers(rows, f"{name}.estimate") - numbers(rows, f"{name}.lo")
    above = numbers(rows, f"{name}.hi") - numbers(rows, f"{name}.estimate")
    half = np.where(off > 0.0, below, above)  # an estimate above the truth is judged by its lower end
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(half > 0.0, off / half, np.where(off == 0.0, 0.0, np.nan))


def quantities(rows: Any, name: str) -> dict[str, Array]:
    """Return what a measure is studied by: its error, or the estimate where no truth is known; u where it varies."""
    off, u = error(rows, name), numbers(rows, f"{name}.u")
    found = {"error": off} if np.isfinite(off).any() else {"estimate": numbers(rows, f"{name}.estimate")}
    known = u[np.isfinite(u)]
    varies = len(known) > 1 and np.ptp(known) > CONSTANT * known.max()
    return {**found, "u": u} if varies else found
