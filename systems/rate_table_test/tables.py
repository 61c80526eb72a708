"""Departures of each rate from the straight line, and the scale factor of each cycle, beside the fit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.reduction.toolkit import Array, Table, plain
from gyrobench.units import DEG, DPH

PPM = 1e-6
AT_REST = 1e-3  # of the largest rate: the Earth rate alone
WAYS = {1.0: "from below", -1.0: "from above", 0.0: "first"}


def signed(x: float) -> str:
    """Return a number of four digits with the sign of the pages."""
    return plain(x, 4).replace("-", "−")


@dataclass(frozen=True)
class Departures:
    """Mean of y less the straight line at each rate and way it was reached, over the full scale (n,), with its u."""

    rate: Array
    way: Array
    departure: Array
    u: Array

    @classmethod
    def of(cls, w: Array, y: Array, level: Array, way: Array, full: float, noise: float) -> Departures:
        """level: number of the level of each reading; noise: standard deviation of a reading."""
        line = np.polyval(np.polyfit(w, y - w, 1), w)
        off = (y - w - line) / full
        keys = list(dict.fromkeys(zip(np.round(w / full, 4).tolist(), way.tolist(), strict=True)))
        found = []
        for rate, from_where in sorted(keys):
            rows = (np.round(w / full, 4) == rate) & (way == from_where)
            n = int(np.count_nonzero(rows))
            found.append((float(w[rows].mean()), from_where, float(off[rows].mean()), noise / full / math.sqrt(n)))
        return cls(*(np.array([f[k] for f in found]) for k in range(4)))

    @property
    def largest(self) -> int:
        return int(np.argmax(np.abs(self.departure)))

    def _place(self, j: int) -> str:
        rest = abs(self.rate[j]) < AT_REST * np.max(np.abs(self.rate))
        return "at rest" if rest else f"at {signed(self.rate[j] / DEG)} °/s"

    def table(self) -> Table:
        rows = [
            [w / DEG, WAYS[d], x / PPM, u / PPM]
            for w, d, x, u in zip(*(v.tolist() for v in (self.rate, self.way, self.departure, self.u)), strict=True)
        ]
        caption = "Means of all cycles less the straight line through all readings, over the largest rate"
        head = ["rate / (°/s)", "reached", "departure / ppm", "u / ppm"]
        return Table("rate.departures", "Nonlinearity: departures from the straight line", caption, head, rows)

    def sentence(self) -> str:
        j = self.largest
        return (
            f"Largest departure from the straight line: {signed(self.departure[j] / PPM)} ppm of full scale (u = "
            f"{plain(self.u[j] / PPM)} ppm) {self._place(j)}."
        )


@dataclass(frozen=True)
class Cycles:
    """Scale factor error and bias (rad/s) of each cycle by its own straight line, with u of the scale factor error."""

    number: Array
    scale: Array
    bias: Array
    u: Array

    @classmethod
    def of(cls, w: Array, y: Array, cycle: Array, noise: float) -> Cycles:
        found = []
        for k in np.unique(cycle).tolist():
            rows = cycle == k
            x = w[rows]
            if np.ptp(x) > 0.0 and x.size > 2:
                slope, bias = np.polyfit(x, y[rows] - x, 1)
                found.append((k, slope, bias, noise / math.sqrt(float(np.sum((x - x.mean()) ** 2)))))
        return cls(*(np.array([f[j] for f in found]) for j in range(4)))

    @property
    def scatter(self) -> float:
        """Standard deviation of the scale factors from cycle to cycle, n - 1."""
        return float(np.std(self.scale, ddof=1)) if self.scale.size > 1 else math.nan

    def table(self) -> list[Table]:
        if self.scale.size < 2:
            return []
        rows = [
            [int(k), e / PPM, u / PPM, b / DPH]
            for k, e, u, b in zip(*(v.tolist() for v in (self.number, self.scale, self.u, self.bias)), strict=True)
        ]
        head = ["cycle", "scale factor error / ppm", "u / ppm", "bias / (°/h)"]
        caption = "Straight line of each cycle, unweighted; u of white noise of the size of the residuals"
        return [Table("rate.cycles", "Repeatability: scale factor of each cycle", caption, head, rows)]

    def shown(self) -> dict[str, Any]:
        if self.scale.size < 2:
            return {}
        return {
            "scale factor, standard deviation from cycle to cycle / ppm": self.scatter / PPM,
            "of it by noise of the readings / ppm": float(np.sqrt(np.mean(self.u**2))) / PPM,
            "cycles": int(self.scale.size),
        }

    def sentence(self) -> list[str]:
        if self.scale.size < 2:
            return []
        noise = float(np.sqrt(np.mean(self.u**2)))
        return [
            f"Repeatability of the scale factor over {self.scale.size} cycles: standard deviation "
            f"{plain(self.scatter / PPM, 3)} ppm; noise of the readings alone makes {plain(noise / PPM)} ppm."
        ]
