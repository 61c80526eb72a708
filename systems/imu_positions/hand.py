"""Reduction in unknown attitudes: positions at rest, put there by hand or by a table that is not read, and the turns
between them.

    accelerometers    |C (f_read - b)| = g                    each position                    (norms.py)
    gyros             gravity after a turn is where the gyros say that it is, each turn         (turns.py)
    gyro i at rest    rate_i - w_i = bg_i + sum_k G_ik f_k/g0   each position, f from the accelerometers

Each is linear about its solution and goes through the skeleton of a drift test: one datum a position, two a turn, noise
from what is left.  Of the Earth rate w the vertical part is known from gravity and latitude; the level part, whose
heading is not known, is a line of the budget.  [IMU-HAND; Tedaldi 2014]

Not modelled: nonlinearity, lever arms (slow turns), a delay between the instruments.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from gyrobench.reduction.estimation.channel_tests import ChannelTests
from gyrobench.reduction.setup.window_checks import window_problems
from gyrobench.reduction.toolkit import (
    Array,
    Coefficient,
    DriftReduction,
    DriftTestResult,
    Reason,
    Record,
    Table,
    plain,
)

from . import mistakes, norms, tables, turns
from .channels import AXES, CHANNELS, overview
from .hand_channels import HandAccelerometers, HandGyro, HandTurns
from .hand_positions import COLUMNS, HandSetup, Positions

UNKNOWN = "unknown"  # option attitudes
STEADY = math.radians(2.0)  # rad/s, beyond what bias and g-sensitivity change from position to position


class HandReduction(ChannelTests[HandSetup]):
    """Three accelerometers and three gyros from positions in unknown attitudes."""

    label = "{}"

    @property
    def names(self) -> tuple[str, ...]:  # type: ignore[override]
        return ("accelerometers", *(("gyros",) if self.at.enough else ()), *(() if self.blind else ("gx", "gy", "gz")))

    @property
    def blind(self) -> bool:
        """True where there are no gyros, or they read counts and no turns tell their scale."""
        return not self.at.gyro.size or ("g" in self.setup.counts and not self.at.enough)

    @cached_property
    def at(self) -> Positions:
        return Positions(self.windows, self.setup)

    def of_channel(self, name: str) -> DriftReduction[HandSetup]:
        if name == "accelerometers":
            return HandAccelerometers(self.at)
        if name == "gyros":
            return HandTurns(self.at)
        return HandGyro(self.at, next(c for c in CHANNELS if c.name == name))

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        return cls.reduce(record.windows, HandSetup.of_record(record))

    @property
    def _columns(self) -> tuple[str, ...]:
        """Columns of windows that are needed: none of gyros where there are no gyros."""
        gyros = any(n.startswith("mean_g") for n in self.windows)
        return tuple(n for n in COLUMNS if gyros or not n.startswith("mean_g"))

    def problems(self) -> list[str]:
        if problems := self.setup.site_problems() + window_problems(self.windows, self._columns):
            return problems
        at = self.at
        if len(at.start) < norms.LEAST:
            return norms.problems(np.zeros((len(at.start), 3)))
        D, middle = at.scale_a
        around = (at.acc - middle) / D
        if problems := norms.problems(around / np.linalg.norm(around, axis=1)[:, None]):
            return problems
        return self._mistaken()

    def _mistaken(self) -> list[str]:
        """Return what sizes and turns say of units, axes and signs."""
        s, at = self.setup, self.at
        found = []
        size = float(np.median(np.linalg.norm(at.acc, axis=1)))
        if "a" not in s.counts and abs(size / s.gravity - 1.0) > 0.2:
            found.append(
                f"accelerometers: at rest they read {plain(size, 4)} m/s², gravity is {plain(s.gravity, 4)}: the unit "
                "is mistaken (readings in g, counts: write '[g]', '[counts]' behind the names of the columns)"
            )
        elif at.enough and not np.array_equal(at.labels[1], np.eye(3)):
            found.append(_labels(at.labels[1]))
        elif at.enough and "g" not in s.counts:
            found += [f"gyros: {text}" for text in mistakes.scaled(turns.factor(at.raw_turns), "g")]
        return found or self._moving()

    def _moving(self) -> list[str]:
        """Return the positions in which the gyros read so much more than in the others that they were turned."""
        if self.blind:
            return []
        rate = (self.at.gyro - np.median(self.at.gyro, axis=0)) / self.at.scale_g
        size = np.max(np.abs(rate), axis=1)
        return [
            f"position {k + 1} (t = {plain(self.at.start[k], 6)} s): the gyros read {plain(math.degrees(size[k]), 3)} "
            "°/s more than in the others: it was not at rest"
            for k in np.flatnonzero(size > STEADY)
        ]

    def reasons(self) -> list[Reason]:
        if self.at.enough and not self.at.carried.all():
            first, last = (int(k) + 1 for k in np.flatnonzero(self.at.carried)[[0, -1]])
            text = f"Samples of turns are missing: Sg rests on those from position {first} to {last} alone."
            return [Reason("turns.some", text)]
        if self.at.enough or not self.at.gyro.size:
            return []
        text = (
            "There are no samples of the turns between the positions, or of fewer than 6 one after the other; not "
            "estimable: Sg (scale factors and misalignments of the gyros)."
        )
        if self.blind:
            text += " The gyros read counts, so nothing is said of them."
        return [Reason("turns.none", text)]

    def overview(self, results: Mapping[str, DriftTestResult]) -> list[str]:
        return overview([c for r in results.values() for c in r.coefficients])

    def tables(self, coefficients: Sequence[Coefficient]) -> list[Table]:
        return tables.tables(coefficients)


def _labels(p: Array) -> str:
    """Return what a signed permutation of the gyros against the accelerometers says."""
    handed = "; so labelled one of the triads is left-handed" if np.linalg.det(p) < 0.0 else ""
    signs = dict(zip(AXES, np.diag(p), strict=True))
    if not all(signs.values()):
        reads = mistakes.reads(p)
        return f"gyros: in axes of the accelerometers {reads}{handed}; columns are exchanged, or signs reversed"
    axes = " and ".join(a for a, s in signs.items() if s < 0.0)
    mirrored = ", ".join(a for a, s in signs.items() if s > 0.0)
    other = "" if handed else f", or the sign of the accelerometer {mirrored} is"
    return f"gyros: against the accelerometers the signs of {axes} are reversed{other}{handed}"
