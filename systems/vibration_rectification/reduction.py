"""Reduction of the vibration test: g-sensitivity and rectification, from means against gravity and mean squares.

    gyro            rate - w  = b_g + G f + G2 (f2 + s2) + noise
    accelerometer   force - f = b_a + S f + K2 (f2 + s2) + K3 (f3 + 3 f s2) + noise

f = +-g by the way the axis points, s the rms of the vibration that the control accelerometer reads, less its noise at
rest; w the part of the Earth rate along the axis of the gyro.  With the axis one way only, G (S) and K3 are not seen:
then b is that with gravity, and K2 has 3 K3 f in it.  [TEST-RECTIFICATION; IEEE 1293; IEEE 1431]

The case may lean otherwise with the axis up than down (u_lean): the gyro then sees another part of the Earth rate, and
gravity across its axis, by a g-sensitivity that this axis does not show: it is taken as large as G.

Not modelled: vibration across the axis and about it, change of the rectification with frequency, a mean specific force
of the table, fifth and higher powers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.frames import G0
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.channel_tests import ChannelTests
from gyrobench.reduction.estimation.level_shift import jumped
from gyrobench.reduction.estimation.nuisances import BOTH
from gyrobench.reduction.estimation.unshown_columns import fading, heating, intervals_with
from gyrobench.reduction.setup.rate_gyro_bias import bias_is_all, doubts_at_rest, unanswered, word_error
from gyrobench.reduction.setup.sources import GRAVITY, GYRO_WORD, LATITUDE
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
    Record,
    Regression,
    RunDocument,
    SiteSetup,
    told,
    window_problems,
)
from gyrobench.result import Reason
from gyrobench.units import DPH

from . import mistakes
from .sources import CONTROL, LEAN, LEAN_ACROSS, LEAN_COSINE

GYRO, FORCE = "gyro", "accelerometer"
COLUMN = {GYRO: "rate", FORCE: "force"}
LEAST = 3  # levels, rest included
FADING = 1.0 / 3.0  # of a level that is not reached: from a reading to the next one
UG = 1e-6 * G0
SHOWN = 0.01  # probability of a fourth power by chance, below which the report says what it changes
ONCE = Reason(
    "turned.once",
    "The axis was turned over once: a bias that changes then (it is touched, heated, switched) is in the biases, in G "
    "and in S, and in no residual. Take the first position once more at the end.",
)
EAST = "The axis x of the gyro points east, up and down alike, where it sees nothing of the Earth rate."


@dataclass(frozen=True, kw_only=True)
class VibrationSetup(SiteSetup):
    """axis: of the case, along the vibration; measured: no run, whose bias is the same after the axis was turned."""

    axis: str
    measured: bool = False


class VibrationChannel(DriftReduction[VibrationSetup]):
    """Gyro or accelerometer."""

    def __init__(self, windows: Mapping[str, Array], setup: VibrationSetup, channel: str) -> None:
        super().__init__(windows, setup)
        self.channel = channel
        self.up = np.asarray(windows["up"], dtype=float)
        self.f = self.up * setup.gravity
        self.s2 = np.asarray(windows["level"], dtype=float) ** 2
        self.both = np.unique(self.up).size == 2

    @property
    def earth(self) -> Array:
        """Earth rate along the axis of the gyro, rad/s: x points up, down, or east."""
        s = self.setup
        return self.up * (s.earth_rate * math.sin(s.latitude) if s.axis == "x" else 0.0)

    @property
    def ways(self) -> dict[str, Array]:
        """Return which readings have the axis up or down, of those that there are."""
        found = {"up": self.up > 0.0, "down": self.up < 0.0}
        return {n: rows.astype(float) for n, rows in found.items() if np.any(rows)}

    def columns(self, f: Array, s2: Array) -> Array:
        """Return the regressors of bias, linear, square and cube."""
        one, square, cube = np.ones_like(f), f * f + s2, f**3 + 3.0 * f * s2
        if self.channel == GYRO:
            return np.column_stack([one, f, square] if self.both else [one, s2])
        return np.column_stack([one, f, square, cube] if self.both else [one, s2])

    def quantities(self) -> list[Quantity]:
        s, truth = self.setup, self.setup.truth or {}
        if self.channel == GYRO:
            rows = [
                ("b_g", "bias of the gyro" if self.both else "bias of the gyro, with gravity", "deg/h"),
                ("G", f"g-sensitivity of the gyro, {s.axis} axis", "deg/h/g"),
                ("G2", f"rectification of the gyro, {s.axis} axis", "deg/h/g2"),
            ]
        else:
            rows = [
                ("b_a", "bias of the accelerometer" if self.both else "bias of the accelerometer, with gravity", "ug"),
                ("S", "scale factor error of the accelerometer", "ppm"),
                ("K2", "vibration rectification of the accelerometer", "ug/g2"),
                ("K3", "cubic nonlinearity of the accelerometer", "ug/g3"),
            ]
        if not self.both:
            rows = [rows[0], rows[2]]
        return [Quantity.of(n, meaning, unit, truth.get(n)) for n, meaning, unit in rows]

    def regression(self) -> Regression:
        gyro = self.channel == GYRO
        read = np.asarray(self.windows[COLUMN[self.channel]], dtype=float)
        t0, t1 = (np.asarray(self.windows[n], dtype=float) for n in ("t_start", "t_end"))
        shown = [
            Group(f"{self.setup.axis} {way}", np.flatnonzero(self.up == sign), self.s2[self.up == sign] / G0**2,
                  "mean square of the vibration", "g²")
            for way, sign in (("up", 1.0), ("down", -1.0)) if np.any(self.up == sign)
        ]  # fmt: skip
        unit = ("drift", "°/h", DPH) if gyro else ("departure of the specific force", "µg", UG)
        of = nuisances.DRIFT if gyro else nuisances.FORCE
        weighed = nuisances.common(self.windows, f" {self.channel}", of) if self.setup.nuisances else ()
        self.model = X, y = self.columns(self.f, self.s2), read - (self.earth if gyro else self.f)
        return Regression(self.quantities(), X, y, t0, t1, shown, *unit, candidates=weighed)

    def effects(self, found: Findings) -> list[Effect]:
        s, X = self.setup, self.columns(self.f, self.s2)
        out = [CONTROL.effect(s, found.error(0.0, self.columns(self.f, self.s2 * (1.0 + 2e-4)) / 1e-4 - X / 1e-4))]
        if self.channel == FORCE:
            more = self.columns(self.f + 1e-4 * self.up, self.s2) / 1e-4 - X / 1e-4
            out.append(GRAVITY.effect(s, found.error(-self.up, more)))
            # a way lacks (x2 + y2)/2 of the force: u2 in the mean, which both ways share, with standard deviation u2
            shorter = np.array([*(-self.f * w for w in self.ways.values()), -self.f])
            out.append(LEAN_COSINE.effect(LEAN.size(s) ** 2, shorter, parts=(*self.ways, "mean")))
            return out
        north, up = s.earth_rate * math.cos(s.latitude), s.earth_rate * math.sin(s.latitude)
        if s.axis == "x":
            out.append(LATITUDE.effect(s, found.error(-self.up * north)))
        # an axis d that is turned by r is d + r x d: up x goes to -north by a turn about east, and so on
        turns = {"about east": -self.up * north} if s.axis == "x" else {
            "about north": np.full_like(self.up, -up), "about up": np.full_like(self.up, north)}  # fmt: skip
        errors = {f"{way}, {axis}": w * e for way, w in self.ways.items() for axis, e in turns.items()}
        out.append(LEAN.effect(s, np.array([*errors.values()]), parts=tuple(errors)))
        level = np.round(np.sqrt(self.s2) / G0, 1)  # as it was wanted; each reading of it is a little off
        each = {f"{way}, {g:g} g": w * (level == g) for way, w in self.ways.items() for g in np.unique(level)}
        out.append(GYRO_WORD.effect(word_error(s.parameters), np.array([*each.values()]), parts=tuple(each)))
        if self.both:
            across = abs(float(found.value[1])) * s.gravity  # along each of two level axes
            out.append(LEAN_ACROSS.effect(s, np.array([across * w for w in self.ways.values() for _ in range(2)])))
        return out

    def test(self, found: Findings) -> None:
        """Add F tests of the fourth power of the level, and of what differs up and down beyond the model."""
        top = float(np.max(self.s2))
        found.f_test(
            "level.fourth", "fourth power of the level", self.s2[:, None] ** 2 / top**2, "shape over the level",
            "the readings do not go with the mean square of the vibration",
            "the readings go with the mean square of the vibration",
        )  # fmt: skip
        if self.both:
            found.f_test(
                "level.odd", "up against down over the level", self.odd / top ** (1 if self.channel == GYRO else 2),
                "shape over the level", "up and down differ at high levels in a way that no gravity makes",
                "up and down differ as gravity makes it",
            )  # fmt: skip
        if np.any(late := self.late()):
            found.f_test(
                "level.late", "step of the level before", late[:, None], "readings before the level was reached",
                "the first readings of a level hold some of the level before: wait longer, or leave them out",
                "each level was reached before its readings",
            )  # fmt: skip

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Add what the coefficients may be with effects that noise explains as well: other powers of the level, one
        against gravity, heat of the vibration, and what fades after the axis was turned over, as heat that another
        attitude moves does.
        """
        gyro = self.channel == GYRO
        t0, t1 = (np.asarray(self.windows[n], dtype=float) for n in ("t_start", "t_end"))
        square = "G2" if gyro else "K2"
        wider = "and its interval is wider with it. Take more levels"
        text = f"{square} may hold a fourth power of the level, {wider}, or leave out the highest."
        reasons = self._with(result, "level.fourth.with", text, self.s2[:, None] ** 2)
        cause = "as a dead band that vibration overcomes does"
        text = f"{square} may hold what grows with the level itself, {cause}, {wider}."
        reasons += self._with(result, "level.linear.with", text, np.sqrt(self.s2)[:, None])
        if "temperature" not in self.windows:
            text = (
                f"What the vibration heats, and what cools after it, is not told from a drift of the {self.channel}. "
                "Record the temperature of the unit, or take the levels in another order once more."
            )
            reasons += self._with(result, "level.heat.with", text, heating(self.s2, t0, t1))
        if self.both:
            text = (
                f"{'G' if gyro else 'S and K3'} may hold what changes with the level and with up and down, as readings "
                "that are clipped at the ends of a range make it: intervals are wider with it. Take more levels, or "
                "leave out the highest."
            )
            reasons += self._with(result, "level.odd.with", text, self.odd)
            text = (
                "What fades after the axis was turned over, as heat that another attitude moves, is not told from a "
                f"drift of the {self.channel}. Wait longer before the first reading of a position."
            )
            reasons += self._with(result, "turned.fades", text, fading(self.up, t0, t1))
        return replace(result, reasons=[*result.reasons, *reasons])

    @property
    def odd(self) -> Array:
        """Return the column (n, 1) of what acts with the level against gravity: its square of a gyro, its fourth power
        of an accelerometer, whose square is the cubic's.  Readings clipped at the ends of a range make it.
        """
        odd: Array = self.up * (self.s2 if self.channel == GYRO else self.s2**2)
        return odd[:, None]

    def _with(self, result: DriftTestResult, id: str, text: str, more: Array) -> list[Reason]:
        """Return that a verdict must hold with the columns too; a warning where their F test shows them."""
        intervals = intervals_with(*self.model, more, result.coefficients)
        told = next((t.p for t in self.found.tests if f"{t.id}.with" == id), None)
        severity = "warning" if told is not None and told < SHOWN else "condition"
        return [Reason(id, text, BOTH, severity=severity, intervals=intervals)] if intervals else []

    def late(self) -> Array:
        """Return the step of the mean square that a reading would still hold some of, a third of the one before it."""
        new = np.append(True, (np.diff(self.s2) != 0.0) | (np.diff(self.up) != 0.0))
        start = np.maximum.accumulate(np.where(new, np.arange(new.size), 0))
        step = np.where(start > 0, self.s2[start - 1] - self.s2, 0.0) / float(np.max(self.s2))
        turned = self.up[start] != self.up[start - 1]
        return np.asarray(np.where(turned, 0.0, step) * FADING ** (np.arange(new.size) - start))

    def account(self, found: Findings) -> Account:
        if self.channel == GYRO:
            equation = '"rate" - omega = b_g + G f + G_2 (f^2 + s^2)' if self.both else '"rate" - omega = b_g + G_2 s^2'
        elif self.both:
            equation = '"force" - f = b_a + S f + K_2 (f^2 + s^2) + K_3 (f^3 + 3 f s^2)'
        else:
            equation = '"force" - f = b_a + K_2 s^2'
        one_way = "With the axis one way only the bias has gravity in it, and the rectification 3 K3 g."
        return Account(
            method="Mean readings on a shaker at levels, axis up and down; least squares under an estimated noise "
            "model [TEST-RECTIFICATION]",
            sources=["TEST-RECTIFICATION; IEEE 1293; IEEE 1431", "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23"],
            equation=equation,
            conventions=[
                "f: gravity along the axis, +1 g where it points up; s: rms of the vibration as the control "
                "accelerometer reads it.",
                *([EAST] if self.channel == GYRO and self.setup.axis != "x" else []),
                *([] if self.both else [one_way]),
            ],
            reasons=[*mistakes.heated(found, self.channel), *(mistakes.jumped(found, self.up) or jumped(found))],
            random="noise of the instrument",
        )

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [found.noise_sentence("readings"), *found.nuisance_sentences()]


class Reduction(ChannelTests[VibrationSetup]):
    """Gyro and accelerometer from windows with t_start, t_end, up, level (m/s2), rate (rad/s) and force (m/s2)."""

    label = "{}"
    channel = VibrationChannel
    handling = staticmethod(mistakes.candidates)

    @property
    def names(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(n for n, column in COLUMN.items() if column in self.windows)

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        return cls.reduce(labelled(record), cls.setup_of(record.run))

    @classmethod
    def setup_of(cls, run: RunDocument) -> VibrationSetup:
        axis = str(run.options["axis"])
        truth = None if run.measured else true_values(run, axis)
        return VibrationSetup.of(run, axis=axis, measured=run.measured, truth=truth)

    def problems(self) -> list[str]:
        s, w = self.setup, self.windows
        problems = frames.latitude_problems(s.latitude) + frames.gravity_problems(s.gravity)
        if not self.names:
            return [*problems, "neither rate nor force: one of the columns is needed"]
        if problems := problems + window_problems(w, ("t_start", "t_end", "level", *(COLUMN[n] for n in self.names))):
            return problems
        if s.axis not in "xyz" or not s.axis:
            problems.append(f"axis = {s.axis}: x, y or z is expected")
        if np.any(np.abs(np.asarray(w["up"])) != 1):
            problems.append("up: 1 (the axis points up) or −1 (down) is expected")
        level = np.asarray(w["level"], dtype=float)
        if np.any(level < 0.0):
            problems.append("level: an rms is 0 or above")
        elif np.unique(np.round(level, 2)).size < LEAST or np.min(level) > 0.1 * np.max(level):
            problems.append(f"level: at rest and at least {LEAST - 1} levels are needed")
        return problems

    def result(self) -> DriftTestResult:
        found = super().result()
        s, said = self.setup, [*mistakes.implausible(found.coefficients), *doubts_at_rest(self.setup.parameters)]
        said += unanswered(s.parameters) if s.axis == "x" else []
        if s.measured and np.count_nonzero(np.diff(self.windows["up"])) == 1:
            said.append(ONCE)
        if s.axis == "x":
            vertical = s.earth_rate * math.sin(s.latitude) / DPH
            said += mistakes.same_both_ways(found.coefficients, vertical / s.gravity * G0)
        return replace(found, reasons=[*found.reasons, *said])

    def overview(self, results: Mapping[str, DriftTestResult]) -> list[str]:
        every = [c for r in results.values() for c in r.coefficients]
        names = {c.name for c in every}
        said = {
            "G": "g-sensitivity of the gyro {G}.", "G2": "Rectification of the gyro {G2}.",
            "K2": "Vibration rectification of the accelerometer {K2}.",
        }  # fmt: skip
        return told(every, *(text for name, text in said.items() if name in names))


reduce = Reduction.reduce


def labelled(record: Record) -> dict[str, Array]:
    """Return the windows with up, level and force; of a run by its plan, its noise at rest taken off the level."""
    windows = dict(record.windows)
    if record.run.measured:
        return windows
    rows = {row.phase: row for row in record.run.plan}
    phase = np.asarray(windows["phase"]).astype(int).tolist()
    windows["up"] = np.array([-1 if rows[p].face.endswith("down") else 1 for p in phase])
    n = np.asarray(windows["n"], dtype=float)
    read = np.asarray(windows["level"], dtype=float) ** 2 * (n - 1.0) / n  # the mean of whole periods is known: 0
    rest = np.array([rows[p].target == 0.0 for p in phase])
    windows["level"] = np.where(rest, 0.0, np.sqrt(np.maximum(read - float(np.mean(read[rest])), 0.0)))
    windows["flagged"] = np.maximum(windows["flagged"], windows.pop("flagged_force"))
    windows["force"] = windows[f"force_{record.run.options['axis']}"]
    return windows


def true_values(run: RunDocument, axis: str) -> dict[str, float]:
    """Return what the parameters of simulated instruments make of the coefficients, SI; those that are known."""
    p: dict[str, Any] = dict(run.parameters)
    k = "xyz".index(axis)
    found: dict[str, float] = {}
    if "gyro.g" in p and "gyro.readout_mismatch" not in p and float(p.get("gyro.closed", 1.0)) > 0.5:
        seen = math.cos(float(np.ravel(p.get("gyro.phase_error", 0.0))[0]))
        linear, square = (np.reshape(np.asarray(p.get(f"gyro.{n}", np.zeros((2, 3))), dtype=float), (2, 3))[0]
                          for n in ("g", "g2"))  # fmt: skip
        found |= {"G": float(linear[k]) * seen, "G2": float(square[k]) * seen}
        alone = {n: v for n, v in p.items() if n not in ("gyro.g", "gyro.g2")}
        if bias_is_all(alone) and len(str(run.options["ways"]).split()) == 2:
            found["b_g"] = float(np.ravel(p["gyro.bias"])[0]) * seen
    if "accelerometers.square" in p:
        found |= _accelerometer(p, k, run)
    return found


def _accelerometer(p: Mapping[str, Any], k: int, run: RunDocument) -> dict[str, float]:
    """Return those of the accelerometer k.  a = axes f; an axis that leans feels its cosine."""
    felt = float(np.reshape(np.asarray(p.get("accelerometers.axes", np.eye(3)), dtype=float), (3, 3))[k, k])
    scale = (1.0 + float(np.ravel(p["accelerometers.scale"])[k])) * felt - 1.0
    square, cube = (float(p[f"accelerometers.{n}"]) for n in ("square", "cubic"))
    if len(str(run.options["ways"]).split()) == 2:
        bias = float(np.ravel(p["accelerometers.bias"])[k])
        drifting = ("turn_on", *(f"{'xyz'[k]}_{n}" for n in ("flicker", "walk")))
        steady = not any(np.any(np.asarray(p.get(f"accelerometers.{n}", 0.0))) for n in drifting)
        return {"S": scale, "K2": square * felt**2, "K3": cube * felt**3} | ({"b_a": bias} if steady else {})
    return {} if cube else {"K2": square * felt**2}
