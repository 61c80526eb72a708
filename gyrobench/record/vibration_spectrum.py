"""Spectra of a vibrating base, from a CSV file to the parameters of the part base_vibration.

# instrument = rate sensor on the mast, ride of 4 May
frequency [Hz],rate_x [deg2/s2/Hz],rate_z [deg2/s2/Hz],acceleration_z [m2/s4/Hz]
0.5,0.4,0.2,0.01
5,0.4,0.2,0.05
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.csv_reader import CsvColumn, DataError, read_measured

POINTS = 24  # of the part base_vibration
FEWEST = 200  # frequencies between two points
_KINDS = {"rate": ("rad2/s2/Hz", "angular rate about"), "acceleration": ("m2/s4/Hz", "acceleration along")}
_COLUMNS = (
    CsvColumn("frequency", "Hz", "frequency, rising"),
    *(
        CsvColumn(f"{kind}_{axis}", unit, f"one-sided density of the {words} {axis}", required=False)
        for kind, (unit, words) in _KINDS.items()
        for axis in "xyz"
    ),
)


@dataclass(frozen=True)
class VibrationSpectrum:
    """One-sided power spectral densities of the angular rate (rad2/s2/Hz) and the acceleration (m2/s4/Hz) of a base.

    f: Hz, rising, 2 to 24 points.  rate, acceleration: (3, points) about and along x, y, z of the base.  Between the
    points they go straight in logarithms, next to a 0 in the density; outside there is nothing.
    """

    f: Array
    rate: Array
    acceleration: Array = field(default_factory=lambda: np.zeros((3, 0)))

    def __post_init__(self) -> None:
        if not self.acceleration.size:
            object.__setattr__(self, "acceleration", np.zeros((3, self.f.size)))

    def density(self, kind: str, axis: int, f: Array) -> Array:
        """Return a density at frequencies; kind: "rate" or "acceleration"; axis from 0."""
        s = getattr(self, kind)[axis]
        k = np.clip(np.searchsorted(self.f, f, "right") - 1, 0, self.f.size - 2)
        share = np.log(f / self.f[k]) / np.log(self.f[k + 1] / self.f[k])
        a, b = s[k], s[k + 1]
        both = (a > 0.0) & (b > 0.0)
        logs = np.exp((1.0 - share) * np.log(np.where(both, a, 1.0)) + share * np.log(np.where(both, b, 1.0)))
        found = np.where(both, logs, (1.0 - share) * a + share * b)
        inside = (f >= self.f[0]) & (f <= self.f[-1])
        return np.asarray(np.where(inside, found, 0.0))

    def frequencies(self) -> Array:
        """Return frequencies between which no density changes by more than 2 %: peaks as narrow as they are."""
        found = []
        for k, (low, high) in enumerate(pairwise(self.f)):
            ends = np.vstack([self.rate, self.acceleration])[:, k : k + 2]
            turns = np.abs(np.log(np.divide(*ends[np.all(ends > 0.0, axis=1)].T)))
            steep = max(FEWEST, int(np.ceil(50.0 * max([np.log(high / low), *turns]))))
            found.append(np.geomspace(low, high, steep + 1))
        return np.unique(np.concatenate(found))

    def rms(self, kind: str, axis: int) -> float:
        """Return the root mean square over all frequencies, SI."""
        f = self.frequencies()
        return float(np.sqrt(np.trapezoid(self.density(kind, axis, f), f)))

    def parameters(self, slot: str = "vibration") -> dict[str, Any]:
        """Return the parameters of the base_vibration in ``slot``."""

        def filled(row: Array) -> list[float]:
            return [*map(float, row), *[0.0] * (POINTS - row.size)]

        return {
            f"{slot}.points": int(self.f.size),
            f"{slot}.frequency": filled(self.f),
            f"{slot}.rate_psd": [filled(row) for row in self.rate],
            f"{slot}.acceleration_psd": [filled(row) for row in self.acceleration],
        }


def read_spectrum(file: Path) -> VibrationSpectrum:
    """Return the spectra of a file; a density whose column is missing is 0.

    Raises DataError for frequencies that do not rise from above 0, fewer than 2 or more than 24 points, negative
    densities, no density at all, and as :func:`gyrobench.record.csv_reader.read_measured`; OSError without the file.
    """
    columns, _ = read_measured(file, _COLUMNS, "frequency")
    f = columns["frequency"]
    given = {n: columns[n] for n in (c.name for c in _COLUMNS[1:]) if columns.get(n) is not None}
    problems = []
    if not given:
        problems.append("no density: at least one column rate_x, rate_y, rate_z or acceleration_x ... is needed")
    if not 2 <= f.size <= POINTS:
        problems.append(f"{f.size} points: 2 to {POINTS} are allowed")
    if f.size and not f[0] > 0.0:
        problems.append("the first frequency must be above 0")
    problems += [f"column {n}: a density is never below 0" for n, x in given.items() if np.any(x < 0.0)]
    if problems:
        raise DataError(file, problems)
    rate, acceleration = (
        np.array([given.get(f"{kind}_{axis}", np.zeros(f.size)) for axis in "xyz"]) for kind in _KINDS
    )
    return VibrationSpectrum(f, rate, acceleration)
