"""Reduction of positions up and down: an axis stands up, then down; nothing else is known of the attitude.

    accelerometer i   f_read_i = ba_i + (1 + Sa_ii) g s                s = +1 up, -1 down
    gyro i            rate_i   = bg_i + hg_i s,    hg_i = (1 + Sg_ii) w sin(latitude) + G_ii g/g0

hg, half of up less down, is the vertical Earth rate where the gyro has no g-sensitivity.  Each position is averaged in
pieces, from which the noise is estimated, of gyros with the errors of the readings of an angle.  [IMU-UPDOWN]

An axis that leans by t reads g cos t: what the two level accelerometers read is tilt or bias, and 1 - cos t, even from
0 to what it would be without bias, is in u of Sa; the level Earth rate along it, whose heading is anything, in u of bg
and hg, unless u_mount states the lean.

An input axis that leans towards a level one by m reads m t of a case that leans by t to the same side up and down, as
bias.  Half of the difference and half of the sum of what a level accelerometer reads, as angles, are these two or bias;
their product, even from 0, is in u of ba.

A bias that changes when the axis is turned over is half in hg and Sa and in no residual of one turn (turned.once); one
that fades from then on is a drift to the noise: verdicts must hold with it (turned.fades).

Not modelled: misalignments of the gyros; squares of the specific force, which two directions do not tell from a bias.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.channel_tests import ChannelTests
from gyrobench.reduction.estimation.unshown_columns import fading, intervals_with
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
    Regression,
    RunDocument,
    Table,
    plain,
)
from gyrobench.result import Reason
from gyrobench.units import DPH

from .budget import ImuSetup
from .channels import AXES, CHANNELS, UG, ImuInstrument, overview
from .hand_positions import COLUMNS

ONCE = Reason(
    "turned.once",
    "The axis was turned over once: a bias that changes then (it is touched, heated, switched) is in the biases, in hg "
    "and in Sa, and in no residual. Take the first position once more at the end.",
)
UPRIGHT = 0.9  # of gravity along the axis that stands up or down
TILT = Source(
    "axis.vertical", "axis off the vertical", "rad", "u_mount", "of each position, towards the level Earth rate"
)
LEAN = Source("axis.cosine", "axis off the vertical, by the level accelerometers", "1", "", "1 less the cosine")
LEAN_BIAS = Source(
    "axis.product",
    "axis off the vertical, by the level accelerometers, times a misalignment",
    "1",
    "",
    "both as angles",
)
LEAN_RATE = Source(
    "axis.lean", "axis off the vertical, by the level accelerometers", "rad", "", "of each position, level Earth rate"
)


class UpDownChannel(DriftReduction[ImuSetup]):
    """One instrument of an axis that stood up and down; sign (n,): +1 up, -1 down, of its rows."""

    def __init__(self, windows: Mapping[str, Array], setup: ImuSetup, channel: ImuInstrument, sign: Array) -> None:
        super().__init__(windows, setup)
        self.channel, self.sign = channel, sign

    @property
    def expected(self) -> float:
        """Vertical Earth rate, rad/s."""
        return self.setup.earth_rate * math.sin(self.setup.latitude)

    def regression(self) -> Regression:
        c, s, w = self.channel, self.setup, self.windows
        rows = self.sign != 0.0
        t0, t1, read = (np.asarray(w[n], dtype=float)[rows] for n in ("t_start", "t_end", f"mean_{c.name}"))
        sign = self.sign[rows]
        X = np.column_stack([np.ones(sign.size), sign])
        shown = Group(c.words, np.arange(sign.size), (t0 - t0[0]) / 60.0, "time", "min")
        if c.gyro:
            quantities = [c.quantity(f"bg_{c.letter}", {}), self._half()]
            unit, y, noise = ("rate", "°/h", DPH), read, "readings"
        else:
            X[:, 1] *= s.gravity
            quantities = [c.quantity(n, {}) for n in (f"ba_{c.letter}", f"Sa_{c.letter}{c.letter}")]
            unit, y, noise = ("departure of the specific force", "µg", UG), read - s.gravity * sign, "estimated"
        weighed = [replace(n, name=f"{n.name} {c.name}") for n in nuisances.common(w) if c.gyro and s.nuisances]
        weighed = [replace(n, columns=np.asarray(n.columns)[rows]) for n in weighed]
        return Regression(quantities, X, y, t0, t1, [shown], *unit, noise, candidates=weighed, ideal=1e-12)

    def _half(self) -> Quantity:
        c = self.channel
        meaning = f"half of up less down of the {c.words}"
        return Quantity.of(f"hg_{c.letter}", meaning, "deg/h")

    def effects(self, found: Findings) -> list[Effect]:
        s, y = self.setup, found.data.y
        if not self.channel.gyro:
            sign = self.sign[self.sign != 0.0]
            cosine, up = float(np.mean(self._lean**2)) / 2.0, sign > 0.0
            first, last = (self._level[:, rows].mean(axis=1) for rows in (up, ~up))
            product = float(np.sum(np.abs(first**2 - last**2))) / 4.0  # of half the difference and half the sum
            return [
                sources.GRAVITY.effect(s, -sign),
                LEAN.effect(cosine / math.sqrt(3.0), -s.gravity * sign),
                LEAN_BIAS.effect(product / math.sqrt(3.0), np.full(y.size, s.gravity)),
            ]
        level = s.earth_rate * math.cos(s.latitude)
        phase = np.asarray(self.windows["phase"])[self.sign != 0.0]
        each = np.array([np.where(phase == p, level, 0.0) for p in np.unique(phase)]).reshape(-1, y.size)
        if TILT.size(s):
            return [TILT.effect(s, each)]
        largest = float(np.max(self._lean))
        return [LEAN_RATE.effect(largest / math.sqrt(2.0), each * self._lean / largest)]  # towards any heading

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Add what the coefficients may be with a bias that fades after the axis was turned over."""
        rows = self.sign != 0.0
        sign, t0, t1 = (
            np.asarray(v, dtype=float)[rows] for v in (self.sign, *map(self.windows.get, ("t_start", "t_end")))
        )
        data = self.regression()
        intervals = intervals_with(data.X, data.y, fading(sign, t0, t1), result.coefficients)
        text = (
            "What fades after the axis was turned over, as heat that another attitude moves, is not told from a drift "
            f"of the {self.channel.words}. Wait longer before the first reading of a position."
        )
        faded = Reason("turned.fades", text, ("pass", "fail"), severity="condition", intervals=intervals)
        return replace(result, reasons=[*result.reasons, *([faded] if intervals else [])])

    @property
    def _level(self) -> Array:
        """Angles of the axis to the vertical (2, n), rad, if what the other accelerometers read were no bias."""
        read = np.array([self.windows[f"mean_a{a}"] for a in AXES if a != self.channel.letter], dtype=float)
        return np.asarray(read[:, self.sign != 0.0] / self.setup.gravity)

    @property
    def _lean(self) -> Array:
        return np.asarray(np.hypot(*self._level))

    def account(self, found: Findings) -> Account:
        i = self.channel.letter
        if self.channel.gyro:
            equation = f'omega_"read,{i}" = b_g + h_g s, quad s = plus.minus 1'
        else:
            equation = f'f_"read,{i}" = b_a + (1 + S_a) g s, quad s = plus.minus 1'
        return Account(
            method="An axis up and down, each position averaged in pieces; least squares under an estimated noise "
            "model [IMU-UPDOWN]",
            sources=["IMU-UPDOWN; IEEE 1559 (terms)", "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23"],
            equation=equation,
            conventions=[
                "Specific force f = a − g: an axis that points up reads +1 g; s = +1 up, −1 down.",
                "hg holds the vertical Earth rate, its scale factor error and the g-sensitivity along the axis.",
                "Biases hold what goes with the square of the specific force.",
            ],
            random="noise of the instrument",
        )

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [found.noise_sentence("pieces"), *found.nuisance_sentences()]


class UpDownReduction(ChannelTests[ImuSetup]):
    """Gyro and accelerometer of each axis that stood up and down."""

    label = "{}"

    @property
    def names(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(c.name for c in CHANNELS if c.axis in self.axes)

    @cached_property
    def signs(self) -> Array:
        """+1 and -1 where an axis stands up and down, 0 elsewhere (n, 3)."""
        read = np.array([np.asarray(self.windows[f"mean_a{a}"], dtype=float) for a in AXES]).T
        size = np.linalg.norm(read, axis=1)[:, None]
        return np.where(np.abs(read) > UPRIGHT * size, np.sign(read), 0.0)

    @cached_property
    def axes(self) -> tuple[int, ...]:
        """Axes that stood both ways."""
        return tuple(k for k in range(3) if {-1.0, 1.0} <= set(self.signs[:, k].tolist()))

    def of_channel(self, name: str) -> DriftReduction[ImuSetup]:
        channel = next(c for c in CHANNELS if c.name == name)
        return UpDownChannel(self.windows, self.setup, channel, self.signs[:, channel.axis])

    @classmethod
    def setup_of(cls, run: RunDocument) -> ImuSetup:
        return ImuSetup.of(run)

    def problems(self) -> list[str]:
        s = self.setup
        if problems := s.site_problems() + window_problems(self.windows, COLUMNS):
            return problems
        if not self.axes:
            seen = [
                f"{a} {'up' if v > 0 else 'down'}" for k, a in enumerate(AXES) for v in np.unique(self.signs[:, k]) if v
            ]
            return [f"no axis stands up and down (to 25°); positions at rest: {', '.join(seen) or 'none upright'}"]
        size = float(np.median(np.linalg.norm([self.windows[f"mean_a{a}"] for a in AXES], axis=0)))
        if abs(size / s.gravity - 1.0) > 0.2:
            return [
                f"accelerometers: at rest they read {plain(size, 4)} m/s², gravity is {plain(s.gravity, 4)}: the unit "
                "is mistaken"
            ]
        return []

    def reasons(self) -> list[Reason]:
        """Return that an axis was turned over once."""
        turned = [np.count_nonzero(np.diff(s[s != 0.0])) for s in self.signs[:, list(self.axes)].T]
        return [ONCE] if 1 in turned else []

    def overview(self, results: Mapping[str, DriftTestResult]) -> list[str]:
        return overview([c for r in results.values() for c in r.coefficients])

    def tables(self, coefficients: Sequence[Coefficient]) -> list[Table]:
        """Return half of up less down beside the vertical Earth rate."""
        earth = self.setup.earth_rate * math.sin(self.setup.latitude) / DPH
        rows = [
            [c.name[-1], c.estimate, c.u, earth, c.estimate - earth, (c.estimate - earth) / c.u if c.u else None]
            for c in coefficients if c.name.startswith("hg_")
        ]  # fmt: skip
        caption = (
            "Half of up less down beside the vertical Earth rate of the latitude; the difference is scale factor error "
            "and g-sensitivity along the axis, °/h/g"
        )
        head = ["axis", "half / (°/h)", "u / (°/h)", "Earth rate / (°/h)", "difference / (°/h)", "difference / u"]
        return [Table("imu.updown", "Up and down", caption, head, rows)]
