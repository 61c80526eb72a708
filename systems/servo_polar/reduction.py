"""Reduction of the polar servo test: drift coefficients, composite drift and its stability from table angles.

    theta' + omega_E,x = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_SS Z2 + D_IO XY + D_OS YZ + D_IS XZ + noise

Least squares over all windows, regressors averaged over each; noise white, Gauss-Markov and of the angle readings,
estimated from the same record.  The formulas of Hu 1981 stand beside.  [TEST-SERVO-POLAR, TEST-COMPOSITE]

Not modelled: change of the coefficients per g with time (turns compared show it); see
gyrobench.reduction.drift.servo_regression.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gyrobench import drift
from gyrobench.attitudes import POLAR, SERVO_ATTITUDES, on_servo_table
from gyrobench.reduction.drift import drift_terms, harmonic, servo_regression
from gyrobench.reduction.drift.held_test import HeldSetup, HeldTest
from gyrobench.reduction.drift.turns import Turns
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.reduction.toolkit import Account, Array, Findings, Group, Record, Regression, RunDocument, plain, told
from gyrobench.result import Coefficient, DriftTestResult, Reason, Table
from gyrobench.units import DPH

from . import closed, live, refusals
from .model import PolarModel

TURN = 2.0 * math.pi


@dataclass(frozen=True, kw_only=True)
class PolarSetup(HeldSetup):
    """route: how D_F and D_II are told apart.  terms: of the model.  wanted: standard deviations that the live estimate
    is to reach, rad/s.
    """

    route: str = "dwells"
    terms: int = 9
    wanted: Sequence[float] = ()

    @property
    def mounts(self) -> list[str]:
        """The mounts in which the table turns, in their order."""
        return [n for n in self.labels.values() if n in POLAR]


def setup_of(run: RunDocument) -> PolarSetup:
    """Return the setup that a run.json describes; dwells count where they are to tell D_F from D_II."""
    route, terms = str(run.options.get("route", "dwells")), int(run.options.get("terms", 9))
    s = PolarSetup.of(run, route=route, terms=terms, wanted=run.parameters.get(f"{live.SLOT}.wanted", ()))
    if route == "dwells" and len(set(s.mounts)) != 1:
        return s
    return replace(s, labels={p: n for p, n in s.labels.items() if n in POLAR or n not in SERVO_ATTITUDES})


class Reduction(HeldTest[PolarSetup]):
    """Coefficients and composite drift of a table that turns about the pole as its gyro lets it."""

    setup_of = staticmethod(setup_of)
    attitudes = SERVO_ATTITUDES

    def problems(self) -> list[str]:
        return refusals.latitude_problems(self.setup.latitude) or super().problems()

    def record_problems(self) -> list[str]:
        s = self.setup
        each = {p: int(np.count_nonzero(self.mine(p))) for p, n in s.labels.items() if n in POLAR}
        few = "windows: at least 8 are needed"
        wrong = [f"phase {p} ({s.labels[p]}) has {n} {few}" for p, n in each.items() if 0 < n < 8]
        dwells = {n for n in s.labels.values() if n not in POLAR}
        if s.route == "dwells" and len(set(s.mounts)) > 1 and dwells != {"x east, y up", "x east, y down"}:
            wrong.append(
                "R and K_zx both asked for: two dwells 'x east, y up' and 'x east, y down' are needed (route dwells), "
                "or the assumption K_zx = K_xz (route equal); route combination gives R + K_zx γ² sin²φ"
            )
        if not s.mounts:
            wrong.append(f"no polar mount in the record; phases are {', '.join(s.labels.values())}")
        return wrong

    def columns(self, held: servo_regression.HeldWindows) -> Array:
        return self.model.columns(held, self.setup.place)

    def regression(self) -> Regression:
        s, h = self.setup, self.held
        self.model = PolarModel.of(s.route, s.mounts, s.terms)
        groups = {n: np.isin(self.phase, [p for p, m in s.labels.items() if m == n]) for n in s.labels.values()}
        book, self.fits, self.no_closed = closed.reduce(
            h.angle_start, h.angle_end, h.t_end - h.t_start, groups, s.latitude, s.gamma, s.earth_rate, s.route
        )
        fitted, self.reported = self.model.quantities(s.place, s.truth, book)
        return self.drift_rates(fitted, [self._group(p) for p in s.labels])

    def fitted(self) -> Findings:
        """Return the fit; where the turns do not tell the coefficients apart, how far each mount turned is said."""
        data = self.regression()
        try:
            return data.fit()
        except ReductionError as error:
            h, labels = self.held, self.setup.labels
            turned = [
                f"{n} {plain(refusals.turned(h.angle_start[self.mine(p)], h.angle_end[self.mine(p)]), 4)}°"
                for p, n in labels.items()
                if n in POLAR
            ]
            advice = f"the mounts turned by {', '.join(turned)}: more of a turn tells more"
            raise ReductionError([*error.problems, advice]) from None

    def derived(self, found: Findings) -> Findings:
        return super().derived(self.model.report(found, self.reported))

    def _group(self, p: int) -> Group:
        """Return drift against table angle in the turns, against time in a dwell."""
        label, h, mine = self.setup.labels[p], self.held, self.mine(p)
        if label not in POLAR:
            return self.dwell(p)
        angle = np.degrees(np.mod(((h.angle_start + h.angle_end) / 2.0)[mine], TURN))
        dense = np.radians(np.arange(0.0, 361.0, 3.0))
        axes = np.broadcast_to(on_servo_table(label, self.setup.latitude), (dense.size, 3, 3))
        still = servo_regression.HeldWindows(dense, dense, 0.0 * dense, np.ones_like(dense), axes)
        return Group(label, mine, angle, "table angle", "°", (np.degrees(dense), self.columns(still)))

    def test(self, found: Findings) -> None:
        labels, h = self.setup.labels, self.held
        phases = [(labels[p], self.mine(p)) for p in labels if labels[p] in POLAR]
        self.turns = Turns(found, phases, h.angle_start, h.angle_end)
        self.turns.test()

    def account(self, found: Findings) -> Account:
        s, model = self.setup, self.model
        self.statistics = self.composites(self._random(found))
        self.live = live.tables(self.windows, s.labels, s.wanted)
        names = model.names if s.terms != 4 else drift.NAMES  # of four terms it is said in other words
        return Account(
            method="The gyro holds a table with its axis along the pole in two mounts; least squares over all windows "
            "under an estimated noise model with shared angle readings [TEST-SERVO-POLAR]",
            sources=[
                "TEST-SERVO-POLAR, SERVO-C3-REDUCE; Hu 1981, eq. 3-84..3-90, Tables 3-2, 3-3, corrected by "
                "E39, E40, E42-E44, E52, E53",
                "TEST-COMPOSITE; Hu 1981, eq. 3-91..3-93, corrected by E45, E46",
                "RED-RATE (shared readings), RED-GLS; Hu 1981, eq. 4-1..4-11, 4-79..4-88, corrected by ER1, ER23",
            ],
            equation=self.equation(model.names),
            conventions=(
                *servo_regression.conventions(s.channel),
                "Harmonics: a cosine, b sine of θ; Hu 1981 has them the other way.",
            ),
            no_closed=self.no_closed,
            closed_caption="From the same windows; the formulas: harmonics of each mount, means of the dwells",
            tables=[
                servo_regression.book_table(found, {n: model.words(n, book=True) for n in model.fitted}, s.channel),
                *self.locked_tables(),
                *self.turns.table(),
                *self._turn_differences(found),
                *self.composite_tables(self.statistics),
                *self.live,
            ],
            harmonics=self.turns.harmonics(self.fits),
            repeatability=self.turns.repeatability(),
            reasons=[
                *(Reason("mounts.unseen", t) for t in refusals.unseen(s.route, s.mounts, s.terms, s.channel)),
                *self.named(drift_terms.left_out(s.truth, names, drift.NAMES, f"{s.terms}-term")),
            ],
        )

    def _random(self, found: Findings) -> Array:
        """Return drift rates (n,) of which is removed what the fit says to go with the angle: in whole turns all but
        its constant, in part of one all but its mean.
        """
        fitted, out, h = found.y - found.est.residual, found.est.residual.copy(), self.held
        for p, label in self.setup.labels.items():
            mine = self.mine(p)
            start, end, constant = h.angle_start[mine], h.angle_end[mine], float(fitted[mine].mean())
            if label in POLAR and refusals.turned(start, end) >= closed.WHOLE:
                constant = float(harmonic.fit(start, end, fitted[mine]).beta[0])
            out[mine] += constant
        return out

    def _turn_differences(self, found: Findings) -> list[Table]:
        """Return later turns less the first, point by point at the same angle; the fit, common to all, drops out."""
        rows: list[list[Any]] = []
        turns, residual = self.turns, found.est.residual / DPH
        middle = (turns.start + turns.end) / 2.0
        for p, label in self.setup.labels.items():
            mine = self.mine(p)
            if label not in POLAR or not turns.turn[mine].any():
                continue
            first = mine & (turns.turn == 0)
            x, r = np.mod(middle[first], TURN), residual[first]
            order = np.argsort(x)
            for k in range(1, int(turns.turn[mine].max()) + 1):
                there = mine & (turns.turn == k)
                if np.count_nonzero(there) < 0.8 * x.size:
                    continue
                d = residual[there] - np.interp(np.mod(middle[there], TURN), x[order], r[order], period=TURN)
                rows.append([label, k + 1, d.size, float(d.mean()), float(d.std(ddof=1))])
        head = ["series", "turn", "windows", "mean difference / (°/h)", "scatter / (°/h)"]
        return [Table("turns.less_first", "Turns less the first turn", "At the same table angle", head, rows)] * bool(
            rows
        )

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        first = coefficients[0].name
        out = told(coefficients, f"Constant drift {first} = {{{first}}}.")
        whole = {n: c for n, c in self.statistics.items() if not isinstance(c, str) and n.startswith(tuple(POLAR))}
        if whole:
            name, worst = max(whole.items(), key=lambda item: item[1].sigma)
            time = f"below 1/e after {worst.time:g} s" if worst.time is not None else "not below 1/e within a quarter"
            size = f"{plain(worst.sigma / DPH, 3)} °/h over windows of {worst.dT:g} s ({name})"
            out.append(f"Random drift σ = {size}, correlation {time}.")
        return [*out, found.noise_sentence(), *found.nuisance_sentences(), *live.sentence(self.live)]

    @classmethod
    def from_record(cls, record: Record) -> DriftTestResult:
        """Return what a record says, and what it would have said had each mount been left when it might have been."""
        result = super().from_record(record)
        return replace(result, tables=[*result.tables, *live.had_it_stopped(record, result, cls.of_record)])
