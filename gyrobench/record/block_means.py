"""Means of a series of any length: at most MOST of each column; with more, neighbours are averaged in pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gyrobench.arrays import Array

MOST = 1 << 22  # means that are held for each column
PART = 1 << 18  # samples that are filled in at a time


@dataclass
class BlockMeans:
    """Means over ``factor`` samples on the grid, NaN where a sample is missing; pairs are averaged when it is full."""

    names: Sequence[str]
    factor: int = 1
    count: int = 0  # means that are complete
    data: dict[str, Array] = field(default_factory=dict)
    opened: dict[str, Array] = field(default_factory=dict)  # samples of the mean that is not complete

    def __post_init__(self) -> None:
        self.data = {n: np.empty(1 << 16) for n in self.names}
        self.opened = {n: np.empty(0) for n in self.names}

    def first_halved_by(self, samples: int) -> bool:
        """Return whether what is held, every sample up to here, is averaged for the first time by so many more."""
        return self.factor == 1 and self.count + samples > MOST

    def skip(self, samples: int) -> None:
        """Add a gap."""
        while samples > 0:
            part = min(samples, PART)
            if samples > MOST * self.factor:
                self._halve()
                continue
            self.add({n: np.full(part, np.nan) for n in self.names})
            samples -= part

    def add(self, block: Mapping[str, Array]) -> None:
        """Add samples that follow the ones before."""
        rows = {n: np.concatenate([self.opened[n], block[n]]) for n in self.names}
        size = next(iter(rows.values())).size
        whole = size // self.factor
        while self.count + whole > MOST:
            self._halve(rows)
            size = next(iter(rows.values())).size
            whole = size // self.factor
        end = whole * self.factor
        for n, v in rows.items():
            self._store(n, v[:end].reshape(whole, self.factor).mean(axis=1) if self.factor > 1 else v[:end])
            self.opened[n] = v[end:].copy()
        self.count += whole

    def _store(self, name: str, values: Array) -> None:
        held = self.data[name]
        if self.count + values.size > held.size:
            held = np.concatenate([held[: self.count], np.empty(max(self.count, values.size))])
            self.data[name] = held
        held[self.count : self.count + values.size] = values

    def _halve(self, rows: dict[str, Array] | None = None) -> None:
        """Average pairs; an odd mean at the end goes back to the samples that are still open, ``factor`` times."""
        pairs = self.count // 2
        for n in self.names:
            held = self.data[n]
            if self.count % 2:
                back = np.full(self.factor, held[self.count - 1])
                if rows is None:
                    self.opened[n] = np.concatenate([back, self.opened[n]])
                else:
                    rows[n] = np.concatenate([back, rows[n]])
            held[:pairs] = 0.5 * (held[: 2 * pairs : 2] + held[1 : 2 * pairs : 2])
        self.count, self.factor = pairs, 2 * self.factor

    def columns(self) -> dict[str, Array]:
        """Return the means; those of samples at the end that do not fill one are left out."""
        return {n: self.data[n][: self.count].copy() for n in self.names}
