"""The regressions of positions in unknown attitudes: sizes of gravity, turns, gyros at rest.  [IMU-HAND]"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.nuisances import BOTH
from gyrobench.reduction.estimation.unshown_columns import intervals_with
from gyrobench.reduction.setup import sources
from gyrobench.reduction.setup.sources import Source
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
    Regression,
)
from gyrobench.units import ARCSEC, DPH

from . import hand_noise, norms, turn_errors, turns
from .channels import AXES, UG, ImuInstrument
from .hand_positions import HandSetup, Positions

ESTIMATED = 16  # positions from which on the noise of a gyro at rest is estimated
LEVEL_RATE = Source(
    "earth.rate.level", "level Earth rate, its heading not known", "rad/s", "", "amplitude along two level directions"
)
OWN_LEVEL_RATE = Source(
    "earth.rate.apart", "level Earth rate where turns lack samples, its heading not known", "rad/s", "",
    "amplitude along two level directions",
)  # fmt: skip
ORDERED = 0.2  # least share of a trend of a bias that the other unknowns of accelerometers leave
SQUARES = (
    "Accelerometers may hold squares of the specific force: their coefficients have wider intervals with them. Take "
    "more positions, opposite ones."
)
WHITE = "noise of the instrument and what the model does not hold, from the residuals"
CONVENTIONS = [
    "Axes of the case: x along the input axis of the accelerometer x, y in the plane of those of x and y, z "
    "right-handed to them; so Sa_xy, Sa_xz and Sa_yz are zero. Gyros in these axes.",
    "reading = input + bias + matrix · input; specific force f = a − g: an axis that points up reads +1 g.",
]


class HandChannel(DriftReduction[HandSetup]):
    """One of the regressions, all of which share the positions."""

    equation = ""

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

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [found.noise_sentence("data")]

    def quantities(self, kind: str, names: Sequence[str], scale: float) -> list[Quantity]:
        """Return coefficients of gyros (g) or accelerometers (a); of counts, ``scale`` of them for a unit of SI, a
        diagonal element is a scale factor.
        """
        counts = kind in self.setup.counts
        truth = {} if counts else dict(self.setup.truth or {})
        return [_quantity(kind, n, counts, truth, scale) for n in names]


class HandAccelerometers(HandChannel):
    """Nine unknowns of three accelerometers from the size of gravity."""

    equation = '|(1 + S_a)^(-1) (f_"read" - b_a)| = g'

    @cached_property
    def data(self) -> tuple[Array, Array, Array]:
        """Regressors (n, 9), sizes of gravity (n,) with them, and what makes their noise white (n, n)."""
        at = self.at
        X = -norms.slopes(at.triad, at.acc / at.scale_a[0])
        solution = np.concatenate([[at.triad.matrix[p] for p in norms.PLACES], at.triad.bias])
        y = np.linalg.norm(at.force, axis=1) - self.setup.gravity + X @ (solution - self.start)
        middle = 0.5 * (at.start + at.end)
        return X, y, hand_noise.whitener(hand_noise.of_sizes(at.up @ at.triad.inverse, middle, X, y))

    def regression(self) -> Regression:
        (X, y, W), at = self.data, self.at
        group = Group("positions", np.arange(y.size), np.arange(1.0, y.size + 1), "number of the position", "")
        unit = ("specific force less gravity", "µg", UG)
        return Regression(list(norms.NAMES), W @ X, W @ y, at.start, at.end, [group], *unit, "white", limit=norms.LIMIT)

    @property
    def squares(self) -> Array:
        """Change (n, 3) of the sizes with a square of the specific force in each accelerometer."""
        return np.asarray(self.at.up * self.at.force**2)

    def test(self, found: Findings) -> None:
        """Add an F test of squares, which the biases would take in part for their own."""
        found.f_test(
            "square", "squares of the accelerometers", self.data[2] @ self.squares, "quadratic nonlinearity",
            "the readings hold squares of the specific force, which the biases are off by",
            "no squares of the specific force are in the residuals",
        )  # fmt: skip

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Say with what else verdicts must hold: squares of the specific force, which their F test need not see, and,
        where the order of the positions hides them, biases that change linearly in time.
        """
        at, (X, y, W) = self.at, self.data
        counts, reasons = "a" in self.setup.counts, list[Reason]()

        def wider(more: Array) -> dict[str, tuple[float, float]]:
            return {} if counts else intervals_with(W @ X, W @ y, W @ more, result.coefficients)

        if squares := wider(self.squares):
            reasons.append(Reason("squares.with", SQUARES, BOTH, severity="condition", intervals=squares))
        time = at.start + at.end
        trends = -at.up @ at.triad.inverse * ((time - time.mean()) / np.ptp(time))[:, None]
        left = trends - X @ np.linalg.lstsq(X, trends, rcond=None)[0]
        seen = np.linalg.norm(left, axis=0) / np.linalg.norm(trends, axis=0)
        if np.min(seen) <= ORDERED:
            which = " and ".join(a for a, share in zip(AXES, seen, strict=True) if share <= ORDERED)
            text = (
                f"The order of the positions hides a bias of the accelerometer {which} that changes in time: it would "
                "be taken for scale factor and misalignment. Take opposite directions one after the other, or repeat "
                "the first positions at the end."
            )
            intervals = wider(trends)
            reasons.append(Reason("order.trend", text, BOTH if intervals else (), intervals=intervals))
        return replace(result, reasons=[*result.reasons, *reasons])

    @property
    def start(self) -> Array:
        """The unknowns from which the data are counted: the middle of counts."""
        D, middle = self.at.scale_a
        return np.concatenate([np.zeros(6), middle / D])

    def derived(self, found: Findings) -> Findings:
        """Return the fit as the instruments have it: counts and their scale factors where the scale was unknown."""
        counts, D = "a" in self.setup.counts, float(self.at.scale_a[0][0])

        def of(change: Array) -> Array:
            b = self.start + change
            if not counts:
                return b
            S = _in_counts(norms.Triad.of(b).matrix, D)
            return np.array([*(S[place] for place in norms.PLACES), *b[6:]])

        return found.derive(self.quantities("a", norms.NAMES, D), of)

    def effects(self, found: Findings) -> list[Effect]:
        return [sources.GRAVITY.effect(self.setup, -self.data[2].sum(axis=1))]


class HandTurns(HandChannel):
    """Nine elements of the matrix of three gyros from gravity before and after each turn."""

    equation = "u_(k+1) = Q_k^T u_k, quad Q_k = product exp((1 + S_g)^(-1) (omega_read - b) dif t)"

    @cached_property
    def data(self) -> tuple[Array, Array, Array]:
        """Regressors (2 n, 9), directions of gravity (2 n,) with them, and what makes their noise white (2 n, 2 n)."""
        found = self.at.found
        X = -turns.slopes(found.turned, found.matrix)
        y = turns.left(found.turned, found.matrix) + X @ found.matrix.ravel()
        return X, y, turn_errors.whitener(self.at, X, y)

    def regression(self) -> Regression:
        (X, y, W), found = self.data, self.at.found
        number = np.repeat(np.arange(1.0, len(found.turned) + 1), 2)
        ends = np.array([[t.time[0], t.time[-1]] for t in found.turned])
        halves = np.column_stack([ends[:, 0], ends.mean(axis=1), ends.mean(axis=1), ends[:, 1]]).reshape(-1, 2)
        group = Group("turns", np.arange(y.size), number, "number of the turn", "")
        names = [f"Sg_{a}{b}" for a in AXES for b in AXES]
        unit = ("whitened direction of gravity", "″", ARCSEC)
        return Regression(names, W @ X, W @ y, halves[:, 0], halves[:, 1], [group], *unit, "white", limit=norms.LIMIT)

    def derived(self, found: Findings) -> Findings:
        counts, D = "g" in self.setup.counts, self.at.scale_g
        quantities = self.quantities("g", [f"Sg_{a}{b}" for a in AXES for b in AXES], D)
        return found.derive(quantities, lambda b: _in_counts(b.reshape(3, 3), D).ravel() if counts else b)

    def effects(self, found: Findings) -> list[Effect]:
        """Return time base and level Earth rate; what readings at rest share between turns is in the weights."""
        (X, _, W), own = self.data, self.at.found
        return [
            sources.TIME_BASE.effect(self.setup, W @ X @ (np.eye(3) + own.matrix).ravel()),
            LEVEL_RATE.effect(own.u, turn_errors.of_level_rate(self.at) @ W, parts=("first", "second")),
        ]


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
        quantities = self.quantities("g", c.names(()), at.scale_g)
        group = Group("positions", np.arange(y.size), np.arange(1.0, y.size + 1), "number of the position", "")
        many = y.size >= ESTIMATED
        weighed = [replace(nuisances.trend(at.start, at.end), name=f"trend {c.name}")] if many and s.nuisances else []
        unit, noise = ("rate at rest", "°/h", DPH), "estimated" if many else "white"
        return Regression(quantities, at.own, y, at.start, at.end, [group], *unit, noise, candidates=weighed)

    def test(self, found: Findings) -> None:
        """Add an F test of g² terms, which the bias would take in part for its own."""
        u = self.at.up
        squares = np.column_stack([u[:, 0] ** 2 - u[:, 2] ** 2, u[:, 1] ** 2 - u[:, 2] ** 2, u * np.roll(u, 1, axis=1)])
        found.f_test(
            "square", "g² terms of the gyro", squares, "g²-sensitivity",
            "the gyro follows squares of the specific force, which the bias is off by",
            "no g² terms are in the residuals",
        )  # fmt: skip

    @property
    def middle(self) -> float:
        """What the data are counted from: the mean of counts, which begin anywhere."""
        return float(np.mean(self.at.gyro[:, self.channel.axis])) if "g" in self.setup.counts else 0.0

    def derived(self, found: Findings) -> Findings:
        start = np.array([self.middle / self.at.scale_g, 0.0, 0.0, 0.0])
        return found.derive(found.quantities[:4], lambda b: start + b) if self.middle else found

    def effects(self, found: Findings) -> list[Effect]:
        at, c, s = self.at, self.channel, self.setup
        level = np.array([d[:, c.axis] for d in at.found.level])  # (n, 2)
        vertical = sources.LATITUDE.effect(s, -s.earth_rate * math.cos(s.latitude) * at.up[:, c.axis])
        effects = [vertical]
        if at.enough:
            carried = (level * at.carried[:, None]).T.copy()
            effects.append(LEVEL_RATE.effect(self.level[1], carried, parts=("first", "second")))
        if not at.carried.all():
            alone = level * ~at.carried[:, None]  # a heading of its own each
            own = np.concatenate([np.diag(alone[:, 0]), np.diag(alone[:, 1])])
            effects.append((OWN_LEVEL_RATE if at.enough else LEVEL_RATE).effect(at.level_size, own))
        return effects


def _in_counts(S: Array, D: float) -> Array:
    """Return a matrix (3, 3) of readings in counts, D for a unit of SI: scale factors, others over their own."""
    own = 1.0 + np.diag(S)
    out = np.asarray(S / own[:, None])
    np.fill_diagonal(out, D * own)
    return out


def _quantity(kind: str, name: str, counts: bool, truth: Mapping[str, float], scale: float) -> Quantity:
    what, _, along = name.partition("_")
    channel = ImuInstrument(kind, AXES.index(along[0]))
    if not counts or what == "G" or (what[0] == "S" and along[0] != along[1]):
        return channel.quantity(name, truth)
    if what[0] == "b":
        return Quantity(name, f"bias of the {channel.words}", "counts", 1.0 / scale)
    unit = "counts/(rad/s)" if kind == "g" else "counts/(m/s²)"
    return Quantity(name, f"scale factor of the {channel.words}", unit, 1.0, shown=f"k{kind}_{channel.letter}")
