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
from dataclasses import replace
from functools import cached_property

import numpy as np

from gyrobench import frames
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.channel_tests import ChannelTests
from gyrobench.reduction.setup import sources
from gyrobench.reduction.setup.sources import Source
from gyrobench.reduction.setup.window_checks import window_problems
from gyrobench.reduction.toolkit import (
    Account,
    Array,
    Coefficient,
    DriftReduction,
    DriftTestResult,
    Effect,
    Findings,
    Group,
    Quantity,
    Reason,
    Record,
    Regression,
    RunDocument,
    Table,
)
from gyrobench.units import ARCSEC, DPH

from . import mistakes, norms, tables, turn_errors, turns
from .channels import AXES, CHANNELS, UG, ImuInstrument, overview
from .hand_positions import COLUMNS, HandSetup, Positions

UNKNOWN = "unknown"  # option attitudes
STEADY = math.radians(2.0)  # rad/s, beyond what bias and g-sensitivity change from position to position
ESTIMATED = 16  # positions from which on the noise of a gyro at rest is estimated
LEVEL_RATE = Source(
    "earth.rate.level", "level Earth rate, its heading not known", "rad/s", "", "amplitude along two level directions"
)
WHITE = "noise of the instrument and what the model does not hold, from the residuals"
CONVENTIONS = [
    "Axes of the case: x along the input axis of the accelerometer x, y in the plane of those of x and y, z "
    "right-handed to them; so Sa_xy, Sa_xz and Sa_yz are zero. Gyros in these axes.",
    "reading = input + bias + matrix · input; specific force f = a − g: an axis that points up reads +1 g.",
]


class HandChannel(DriftReduction[HandSetup]):
    """One of the regressions, all of which share the positions."""

    words = ""

    def __init__(self, positions: Positions) -> None:
        super().__init__({}, positions.setup)
        self.at = positions

    def account(self, found: Findings) -> Account:
        return Account(
            method="Positions at rest in unknown attitudes and the turns between them; least squares about the "
            "solution, noise from what is left [IMU-HAND]",
            sources=["IMU-HAND; Tedaldi 2014, eq. 1..13", "RED-OLS; Hu 1981, eq. 4-64..4-78"],
            equation=self.equation,
            conventions=CONVENTIONS,
            random=WHITE,
        )

    equation = ""

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [found.noise_sentence("data")]


class HandAccelerometers(HandChannel):
    """Nine unknowns of three accelerometers from the size of gravity."""

    equation = '|(1 + S_a)^(-1) (f_"read" - b_a)| = g'

    def regression(self) -> Regression:
        D, at = self.at.scale_a, self.at
        readings = at.acc / D[0]
        X = -norms.slopes(at.triad, readings)
        solution = np.concatenate([[at.triad.matrix[p] for p in norms.PLACES], at.triad.bias])
        y = np.linalg.norm(at.force, axis=1) - self.setup.gravity + X @ (solution - self.start)
        group = Group("positions", np.arange(y.size), np.arange(1.0, y.size + 1), "number of the position", "")
        unit = ("specific force less gravity", "µg", UG)
        return Regression(list(norms.NAMES), X, y, at.start, at.end, [group], *unit, noise="white", limit=norms.LIMIT)

    @property
    def start(self) -> Array:
        """The unknowns from which the data are counted: the middle of counts."""
        D, middle = self.at.scale_a
        return np.concatenate([np.zeros(6), middle / D])

    def derived(self, found: Findings) -> Findings:
        """Return the fit as the instruments have it: counts and their scale factors where the scale was unknown."""
        counts, D = "a" in self.setup.counts, self.at.scale_a[0]
        truth = {} if counts else dict(self.setup.truth or {})
        quantities = [_quantity("a", n, counts, truth, float(D[0])) for n in norms.NAMES]
        diagonal = {i: k for k, (i, j) in enumerate(norms.PLACES) if i == j}

        def of(change: Array) -> Array:
            b = self.start + change
            if not counts:
                return b
            out = np.array(b)
            for k, (i, j) in enumerate(norms.PLACES):
                own = 1.0 + b[diagonal[i]]
                out[k] = D[i] * own if i == j else b[k] / own
            return out

        return found.derive(quantities, of)

    def effects(self, found: Findings) -> list[Effect]:
        y = found.data.y
        return [sources.GRAVITY.effect(self.setup, -np.ones(y.size))]


class HandTurns(HandChannel):
    """Nine elements of the matrix of three gyros from gravity before and after each turn."""

    equation = "u_(k+1) = Q_k^T u_k, quad Q_k = product exp((1 + S_g)^(-1) (omega_read - b) dif t)"

    def regression(self) -> Regression:
        found = self.at.found
        X = -turns.slopes(found.turned, found.matrix)
        y = turns.left(found.turned, found.matrix) + X @ found.matrix.ravel()
        number = np.repeat(np.arange(1.0, len(found.turned) + 1), 2)
        W = turn_errors.whitener(self.at, X, y)
        ends = np.array([[t.time[0], t.time[-1]] for t in found.turned])
        halves = np.column_stack([ends[:, 0], ends.mean(axis=1), ends.mean(axis=1), ends[:, 1]]).reshape(-1, 2)
        group = Group("turns", np.arange(y.size), number, "number of the turn", "")
        names = [f"Sg_{a}{b}" for a in AXES for b in AXES]
        unit = ("whitened direction of gravity", "″", ARCSEC)
        return Regression(names, W @ X, W @ y, halves[:, 0], halves[:, 1], [group], *unit, "white", limit=norms.LIMIT)

    def derived(self, found: Findings) -> Findings:
        counts, D = "g" in self.setup.counts, self.at.scale_g
        truth = {} if counts else dict(self.setup.truth or {})
        names = [f"Sg_{a}{b}" for a in AXES for b in AXES]
        quantities = [_quantity("g", n, counts, truth, D) for n in names]

        def of(b: Array) -> Array:
            if not counts:
                return b
            S = b.reshape(3, 3)
            own = 1.0 + np.diag(S)
            out = S / own[:, None]
            np.fill_diagonal(out, D * own)
            return np.asarray(out.ravel())

        return found.derive(quantities, of)

    def effects(self, found: Findings) -> list[Effect]:
        """Return the level Earth rate; what readings at rest share between turns is in the weights."""
        at, own = self.at, self.at.found
        X = -turns.slopes(own.turned, own.matrix)
        W = turn_errors.whitener(at, X, turns.left(own.turned, own.matrix) + X @ own.matrix.ravel())
        return [LEVEL_RATE.effect(own.u, turn_errors.of_level_rate(at) @ W, parts=("first", "second"))]


class HandGyro(HandChannel):
    """Bias and g-sensitivity of a gyro at rest."""

    def __init__(self, positions: Positions, channel: ImuInstrument) -> None:
        super().__init__(positions)
        self.channel = channel
        self.level = positions.level_by_others(channel.axis)  # Earth rate and its u

    @property
    def equation(self) -> str:  # type: ignore[override]
        i = self.channel.letter
        return f'omega_"read,{i}" - omega_{i} = b_g + sum_k G_k f_k \\/ g_0'

    def regression(self) -> Regression:
        at, c, s = self.at, self.channel, self.setup
        matrix = np.eye(3) + at.found.matrix
        y = (at.gyro[:, c.axis] - self.middle) / at.scale_g - ((at.vertical + self.level[0]) @ matrix.T)[:, c.axis]
        quantities = self._quantities()
        X = np.column_stack([np.ones(len(y)), at.force / frames.G0])
        group = Group("positions", np.arange(y.size), np.arange(1.0, y.size + 1), "number of the position", "")
        many = y.size >= ESTIMATED
        weighed = [replace(nuisances.trend(at.start, at.end), name=f"trend {c.name}")] if many and s.nuisances else []
        unit, noise = ("rate at rest", "°/h", DPH), "estimated" if many else "white"
        return Regression(quantities, X, y, at.start, at.end, [group], *unit, noise, candidates=weighed)

    @property
    def middle(self) -> float:
        """What the data are counted from: the mean of counts, which begin anywhere."""
        return float(np.mean(self.at.gyro[:, self.channel.axis])) if "g" in self.setup.counts else 0.0

    def _quantities(self) -> list[Quantity]:
        counts = "g" in self.setup.counts
        truth = {} if counts else dict(self.setup.truth or {})
        return [_quantity("g", n, counts, truth, self.at.scale_g) for n in self.channel.names(())]

    def derived(self, found: Findings) -> Findings:
        start = np.array([self.middle / self.at.scale_g, 0.0, 0.0, 0.0])
        return found.derive(self._quantities(), lambda b: start + b) if self.middle else found

    def effects(self, found: Findings) -> list[Effect]:
        at, c = self.at, self.channel
        level = np.array([d[:, c.axis] for d in at.found.level])  # (n, 2)
        if at.enough:
            return [LEVEL_RATE.effect(self.level[1], level.T.copy(), parts=("first", "second"))]
        own = np.concatenate([np.diag(level[:, 0]), np.diag(level[:, 1])])  # a heading of its own each
        return [LEVEL_RATE.effect(at.level_size, own)]


def _quantity(kind: str, name: str, counts: bool, truth: Mapping[str, float], scale: float) -> Quantity:
    """Return a coefficient; in counts, scale counts for a unit of SI, a diagonal element is a scale factor."""
    what, _, along = name.partition("_")
    channel = ImuInstrument(kind, AXES.index(along[0]))
    if not counts or what == "G" or (what[0] == "S" and along[0] != along[1]):
        return channel.quantity(name, truth)
    if what[0] == "b":
        return Quantity(name, f"bias of the {channel.words}", "counts", 1.0 / scale)
    unit = "counts/(rad/s)" if kind == "g" else "counts/(m/s²)"
    return Quantity(name, f"scale factor of the {channel.words}", unit, 1.0, shown=f"k{kind}_{channel.letter}")


class HandReduction(ChannelTests[HandSetup]):
    """Three accelerometers and three gyros from positions in unknown attitudes."""

    label = "{}"

    @property
    def names(self) -> tuple[str, ...]:  # type: ignore[override]
        return ("accelerometers", *(("gyros",) if self.at.enough else ()), *(() if self.blind else ("gx", "gy", "gz")))

    @property
    def blind(self) -> bool:
        """True where gyros read counts, and no turns tell their scale."""
        return "g" in self.setup.counts and not self.at.enough

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

    @classmethod
    def setup_of(cls, run: RunDocument) -> HandSetup:
        return HandSetup.of(run)

    def problems(self) -> list[str]:
        s = self.setup
        problems = frames.latitude_problems(s.latitude) + frames.gravity_problems(s.gravity)
        if problems := problems + window_problems(self.windows, COLUMNS):
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
                f"accelerometers: at rest they read {size:.4g} m/s², gravity is {s.gravity:.4g}: the unit is mistaken "
                "(readings in g, counts: write '[g]', '[counts]' behind the names of the columns)"
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
            f"position {k + 1} (t = {self.at.start[k]:.6g} s): the gyros read {math.degrees(size[k]):.3g} °/s more "
            "than in the others: it was not at rest"
            for k in np.flatnonzero(size > STEADY)
        ]

    def reasons(self) -> list[Reason]:
        if self.at.enough:
            return []
        text = (
            "There are no samples of the turns between the positions, or not of all, or fewer than 6 turns; not "
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
    order, signs = np.argmax(np.abs(p), axis=1), p.sum(axis=1)
    reads = ", ".join(f"{a} reads {'−' if s < 0 else ''}{AXES[k]}" for a, k, s in zip(AXES, order, signs, strict=True))
    handed = "; so labelled one of the triads is left-handed" if np.linalg.det(p) < 0.0 else ""
    mirrored = ", ".join(a for a in AXES if (p @ np.eye(3))[AXES.index(a), AXES.index(a)] > 0.0)
    other = ""
    if np.array_equal(np.abs(p), np.eye(3)) and np.linalg.det(p) > 0.0:
        other = f", or the sign of the accelerometer {mirrored} is"
    if np.array_equal(np.abs(p), np.eye(3)):
        axes = " and ".join(a for a, s in zip(AXES, signs, strict=True) if s < 0)
        return f"gyros: against the accelerometers the signs of {axes} are reversed{other}{handed}"
    return f"gyros: in axes of the accelerometers {reads}{handed}; columns are exchanged, or signs reversed"
