"""A channel of a record with several, as the findings of all channels together need it."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.noise_model import Minimum
from gyrobench.reduction.series.channel_units import ChannelUnits
from gyrobench.reduction.series.lines import SpectralLine
from gyrobench.reduction.series.noise_coefficients import Estimate
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Coefficient, DriftColumn, Reason
from gyrobench.side_by_side import each

T = TypeVar("T")
LONG = 100_000  # samples from which on a process of its own is worth its start
AXIS = re.compile(r"(?:(.*?)[ _.]?([xyz])|([xyz])[ _.]?(.*))", re.I)


@dataclass(frozen=True)
class RecordChannel:
    """What a channel says, and its whitened ordinates (n - 1,) from the grid point ``first`` on; mean in SI."""

    name: str
    units: ChannelUnits
    coefficients: list[Coefficient]
    reasons: list[Reason]
    summary: list[str]
    column: DriftColumn
    first: int
    ordinates: Array
    lines: Sequence[SpectralLine]
    resolution: float  # of a frequency, Hz
    N: Estimate
    minimum: Minimum
    agrees: bool
    inside: float  # share of averaging times
    explained: float | None  # share of the variance that other columns explain; None without any
    found: str  # lines, wild samples, steps in short
    mean: float
    u_mean: float  # by the noise of the channel

    @property
    def axis(self) -> tuple[str, str]:
        """The name without its axis, and the axis x, y or z, "" where the name has none."""
        match = AXIS.fullmatch(self.name)
        if match is None:
            return self.name, ""
        stem, last, first, rest = match.groups()
        return (stem, last.lower()) if last else (rest, first.lower())


def analysed(task: Callable[[int], T], count: int, samples: int) -> list[T]:
    """Return task(0) ... task(count - 1), of long records side by side.  Raises ReductionError with all problems."""

    def done(k: int) -> tuple[list[T], list[str]]:
        try:
            return [task(k)], []
        except ReductionError as error:
            return [], error.problems

    found = each(done, count, samples >= LONG)
    if problems := [p for _, wrong in found for p in wrong]:
        raise ReductionError(problems)
    return [result for results, _ in found for result in results]


def triads(channels: Sequence[RecordChannel], words: str) -> list[list[RecordChannel]]:
    """Return the channels that are axes x, y, z of one instrument, those without such names where they are three.

    words: what they read, rate or specific force.
    """
    mine = [c for c in channels if c.units.words == words]
    by: dict[str, dict[str, RecordChannel]] = {}
    for c in mine:
        stem, axis = c.axis
        if axis:
            by.setdefault(stem, {}).setdefault(axis, c)
    found = [[of[a] for a in "xyz"] for of in by.values() if len(of) == 3]
    return found or ([mine] if len(mine) == 3 else [])


def mean_of(triad: Sequence[RecordChannel]) -> tuple[Array, Array]:
    """Return means (3,) and their standard uncertainties by noise, SI."""
    return np.array([c.mean for c in triad]), np.array([c.u_mean for c in triad])
