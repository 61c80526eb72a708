"""A rate record of any length, as the fit of noise coefficients takes it.

Up to WHOLE samples the stretches are kept as they are.  Longer ones become means of BLOCK samples, and the powers of
what is faster than the means, from cosine transforms of parts of some WHOLE samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.series.noise_spectra import FastPowers

WHOLE = 1 << 21  # samples kept as they are
BLOCK = 512
LEAST = 8  # blocks of a part whose transform is used
SHORTEST = 40  # samples of a stretch that is used
STRETCHES = 200  # used, the longest
LOST = 16  # samples in a row that are filled


@dataclass(frozen=True)
class Condensed:
    """Stretches of means over ``block`` samples, and sums of powers as of :class:`FastPowers` (7, 0 or more bins)."""

    stretches: list[Array]
    block: int
    fast: Array


class LongRecord:
    """Rates that come in blocks; NaN for a sample that is lost."""

    def __init__(self) -> None:
        self._raw: list[list[Array]] = [[]]
        self._means: list[list[Array]] = []
        self._waiting, self._open = 0, False
        self._fast = FastPowers(0.5 / BLOCK)

    def add(self, rate: Array) -> None:
        """Add rates (n,)."""
        x = np.array(rate, dtype=float)
        self._raw[-1].append(x)
        self._waiting += x.size
        if self._waiting > WHOLE:
            self._condense()

    def gap(self) -> None:
        """End a stretch: the time to what follows is not known."""
        self._raw.append([])

    def condensed(self) -> Condensed:
        """End the record and return it."""
        if self._means:
            self._condense()
            stretches, block, fast = [np.concatenate(parts) for parts in self._means], BLOCK, self._fast.sums
        else:
            stretches = [x for parts in self._raw if parts for x in present(np.concatenate(parts))]
            block, fast = 1, np.zeros((7, 0))
        stretches = sorted((x for x in stretches if x.size >= SHORTEST), key=lambda x: -x.size)[:STRETCHES]
        return Condensed(stretches, block, fast)

    def _condense(self) -> None:
        rest: list[Array] = []
        for i, parts in enumerate(self._raw):
            pieces = present(np.concatenate(parts), 1) if parts else []
            for j, x in enumerate(pieces):
                runs_on = i == len(self._raw) - 1 and j == len(pieces) - 1 and bool(np.isfinite(parts[-1][-1]))
                n = (x.size - runs_on) // BLOCK
                if runs_on:
                    rest = [x[n * BLOCK :]]
                blocks = x[: n * BLOCK].reshape(n, BLOCK)
                if not (self._open and i == j == 0):
                    self._means.append([])
                self._means[-1].append(blocks.mean(axis=1))
                if n >= LEAST:
                    self._fast.add(x[: n * BLOCK])
        self._open, self._raw = bool(rest), [rest]
        self._waiting = sum(x.size for x in rest)


def present(x: Array, shortest: int = SHORTEST) -> list[Array]:
    """Return the parts between gaps; up to LOST samples in a row are filled with those before, if it is 1 % at most.

    Filled samples repeat the noise of their neighbours, so that its level is kept; the joints raise Q^2 by about one
    part in as many as there are samples from one joint to the next.
    """
    there = np.isfinite(x)
    if there.all():
        return [x] if x.size >= shortest else []
    edges = np.flatnonzero(np.diff(np.concatenate([[1], there.astype(np.int8), [1]]))).reshape(-1, 2)
    short = [(a, b) for a, b in edges if b - a <= min(LOST, a) and b < x.size]
    if sum(b - a for a, b in short) <= 0.01 * x.size:
        x = x.copy()
        for a, b in short:
            x[a:b] = x[2 * a - b : a]
    there = np.isfinite(x)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(np.int8), [0]]))).reshape(-1, 2)
    return [x[a:b] for a, b in edges if b - a >= shortest]
