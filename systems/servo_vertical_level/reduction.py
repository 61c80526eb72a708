"""Reduction of the vertical and level servo tests: drift coefficients and composite drift from table angles.

    theta' + omega_E,x = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_SS Z2 + noise,   as many as the attitudes tell apart

Least squares over all windows, regressors averaged over each; noise white, Gauss-Markov and of the angle readings,
estimated from the same record.  The formulas of Hu 1981 stand beside.  [TEST-SERVO-VERT, TEST-SERVO-LEVEL]

Not modelled: D_IO, D_OS, D_IS, which a level attitude sees by the sine of its angle (at most 1 degree); see
gyrobench.reduction.drift.servo_regression.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from gyrobench.attitudes import LEVEL, VERTICAL
from gyrobench.reduction.drift import servo_regression
from gyrobench.reduction.drift.held_test import HeldSetup, HeldTest
from gyrobench.reduction.toolkit import Account, Array, Findings, Group, Quantity, Regression, RunDocument, plain, told
from gyrobench.result import Coefficient, Reason, Table
from gyrobench.units import DPH

from . import closed, compensation, refusals


@dataclass(frozen=True, kw_only=True)
class LevelSetup(HeldSetup):
    """compensate: coefficients that the torquer took out.  levelled: it took the Earth's rate out, too."""

    compensate: str = ""
    levelled: bool = False

    @classmethod
    def of(cls, run: RunDocument, **own: Any) -> Self:
        known = {n: run.options.get(n, default) for n, default in (("compensate", ""), ("levelled", False))}
        return super().of(run, **{**known, **own})


class Reduction(HeldTest[LevelSetup]):
    """Coefficients and composite drift of a table that is held with its axis vertical or level."""

    setup_of = LevelSetup.of
    attitudes = (*VERTICAL, *LEVEL)

    def record_problems(self) -> list[str]:
        """Return level attitudes beyond 1 degree."""
        found, angles = [], np.maximum(np.abs(self.held.angle_start), np.abs(self.held.angle_end))
        for p, label in self.setup.labels.items():
            worst = float(np.max(angles[self.mine(p)], initial=0.0))
            if label in LEVEL and worst > refusals.LIMIT * 1.001:
                found.append(
                    f"phase {p} ({label}) reaches {plain(math.degrees(worst), 4)}° from level; 1° is the limit of the "
                    "small-angle test: shorten the dwell, or start on the other side of level"
                )
        return found

    def columns(self, held: servo_regression.HeldWindows) -> Array:
        return servo_regression.design(held, self.setup.place, self.seen.names)

    def regression(self) -> Regression:
        s, labels = self.setup, list(self.setup.labels.values())
        self.seen = refusals.seen(labels)
        self.y = servo_regression.drift_rate(self.held, s.place)
        self.book = closed.formulas(self._class_means(), s.gamma)
        groups = [self._together(label) for label in dict.fromkeys(labels)]
        return self.drift_rates([self._quantity(n) for n in self.seen.names], groups)

    def _class_means(self) -> dict[str, float]:
        """Return the mean drift of the attitudes with the same vertical axis (x down, x up, y down ...), rad/s, each
        phase alike (end to end: (5.0)).
        """
        length, each = self.held.t_end - self.held.t_start, dict[str, list[float]]()
        for p, label in self.setup.labels.items():
            rows = self.mine(p)
            mean = float(np.sum((self.y * length)[rows]) / np.sum(length[rows]))
            each.setdefault(label.rpartition(", ")[2], []).append(mean)
        return {n: float(np.mean(v)) for n, v in each.items()}

    def _quantity(self, name: str) -> Quantity:
        s, seen, g = self.setup, self.seen, self.setup.gamma
        true = None if s.truth is None else seen.truth(name, s.truth, g)
        q = replace(Quantity.drift(name, true, self.book.get(name)), combination=seen.combination(name, g))
        shown = seen.shown(name)
        return replace(q, meaning=f"{q.meaning}, with compliance in it", shown=shown) if shown else q

    def _together(self, label: str) -> Group:
        """Return drift against time, cycles of the same attitude together."""
        rows = np.isin(self.phase, [p for p, n in self.setup.labels.items() if n == label])
        t0, middle = self.held.t_start, (self.held.t_start + self.held.t_end) / 2.0
        first = np.array([t0[self.mine(p)][0] for p in self.phase[rows].tolist()])
        return Group(label, rows, middle[rows] - first, "time in the dwell", "s")

    def account(self, found: Findings) -> Account:
        formulas = "Hu 1981 has formulas for class 1, for the three-term route and for complete pairs"
        return Account(
            method="The gyro holds a table with its axis vertical or level; least squares over all windows under an "
            "estimated noise model with shared angle readings [TEST-SERVO-VERT, TEST-SERVO-LEVEL]",
            sources=[
                "TEST-SERVO-VERT, TEST-SERVO-LEVEL, SERVO-C1, SERVO-C2; Hu 1981, eq. 3-60..3-83, corrected "
                "by E36-E38, E41",
                "TEST-COMPOSITE; Hu 1981, eq. 3-91..3-93, corrected by E45, E46",
                "RED-RATE (shared readings), RED-GLS; Hu 1981, eq. 4-1..4-11, 4-79..4-88, corrected by ER1, ER23",
            ],
            equation=self.equation(self.seen.names),
            conventions=servo_regression.conventions(self.setup.channel),
            no_closed="" if self.book else formulas,
            closed_caption="From the same windows; the formulas take every attitude as at angle 0",
            tables=[
                self._attitudes_table(found.est.residual),
                servo_regression.book_table(found, self._book_words(), self.setup.channel),
                *self.locked_tables(),
                *self.compensation(found),
                *self.composite_tables(self.composites(self.y)),
            ],
            reasons=self.named(self._unseen()),
        )

    def compensation(self, found: Findings) -> list[Table]:
        """Return what is left of a systematic drift that the torquer took out; none where it did not."""
        s, torqued = self.setup, self.held.torqued
        if not s.compensate or torqued is None:
            return []
        put_in = compensation.coefficients(s.compensate, s.channel)
        each: dict[str, tuple[Array, Array]] = {}
        for label in dict.fromkeys(s.labels.values()):
            rows = np.isin(self.phase, [p for p, n in s.labels.items() if n == label])
            levelling = s.earth(self.held.axes[rows][0]) if s.levelled and label in LEVEL else 0.0
            each[label] = self.y[rows], torqued[rows] - levelling
        return compensation.tables(found, put_in, s.channel, each)

    def _unseen(self) -> list[Reason]:
        """Return what the attitudes do not tell, and what angles off level let in of it."""
        labels, truth = self.setup.labels, self.setup.truth or {}
        found = [Reason("attitudes.unseen", text) for text in refusals.unseen(list(labels.values()))]
        level = np.isin(self.phase, [p for p, n in labels.items() if not n.startswith(("x down", "x up"))])
        angles = np.concatenate([self.held.angle_start[level], self.held.angle_end[level]])
        worst = float(np.max(np.abs(angles), initial=0.0))
        both = [n for n in self.seen.lost if truth.get(n, 0.0)]
        if both and worst > 0.0:
            size = max(abs(truth[n]) for n in both) * worst / DPH
            text = f"Of {', '.join(both)} angles up to {plain(np.degrees(worst))}° let {plain(size, 1)} °/h in."
            found.append(Reason("attitudes.off_level", text))
        return found

    def _book_words(self) -> dict[str, str]:
        """Return the combinations in the notation of Hu 1981: R + γ² K_zx."""
        out = {}
        for name in self.seen.names:
            symbol, sign = servo_regression.BOOK[name]
            words = [symbol]
            for other, s, k in self.seen.mixed[name]:
                its, way = servo_regression.BOOK[other]
                words.append(f"{'+' if s * way * sign > 0 else '−'} {('', 'γ ', 'γ² ')[k]}{its}")
            out[name] = " ".join(words)
        return out

    def _attitudes_table(self, residual: Array) -> Table:
        rows = []
        for p, label in self.setup.labels.items():
            mine = self.mine(p)
            means = (float(x[mine].mean()) / DPH for x in (self.y, residual))
            rows.append([label, p, int(mine.sum()), *means])
        caption = "Mean of the windows of a phase; residual: less the fitted model"
        head = ["attitude", "phase", "windows", "drift / (°/h)", "residual / (°/h)"]
        return Table("attitudes", "Drift in each attitude", caption, head, rows)

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        first = (f"{c.meaning[:1].upper()}{c.meaning[1:]} {c.name} = {{{c.name}}}." for c in coefficients[:2])
        left = [compensation.sentence(t) for t in self.compensation(found) if t.id == "compensation.attitudes"]
        return [*told(coefficients, *first), *left, found.noise_sentence(), *found.nuisance_sentences()]
