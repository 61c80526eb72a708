"""Reduction of the single-axis tumble: nine drift coefficients of a floated gyro from averaged torquer currents.

    y = omega_IA - k i = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_SS Z2 + D_IO XY + D_OS YZ + D_IS XZ + noise

Every window is a row; regressors are averaged over the window as the current is, so no [AVG-SINC] damping is left.
The noise (white, Gauss-Markov or both) is estimated from the same record and weighs the rows.  The closed
formulas stand beside the estimates.  [TEST-TUMBLE1-SDF; Hu 1981, eq. 3-12..3-21]

Misalignment of the input axis, a trend in time, temperature, asymmetry of the torquer and constants that differ from
mount to mount or from turn-on to turn-on are weighed by the data (gyrobench.reduction.estimation.nuisances).

Not modelled: change of the drift with time other than linear, torquer nonlinearity (a line of the budget).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np

from gyrobench import drift
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.drift import drift_terms, window_regressors
from gyrobench.reduction.drift.turns import Turns
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.toolkit import (
    Account,
    Array,
    Candidate,
    DriftTest,
    Effect,
    Findings,
    Group,
    Quantity,
    Reason,
    Regression,
    window_problems,
)  # fmt: skip

from . import budget, closed
from .refusals import plan_problems, setup_problems
from .setup import TumbleSetup, setup_of

COLUMNS = ("angle_start", "angle_end", "t_start", "t_end")
TILT_MEANING = "misalignment of the input axis towards the output axis"


class Reduction(DriftTest[TumbleSetup]):
    """Nine drift coefficients from the windows of a tumble."""

    handling = staticmethod(handling_candidates.tumble)
    setup_of = staticmethod(setup_of)

    def __init__(self, windows: Mapping[str, Array], setup: TumbleSetup) -> None:
        super().__init__(windows, setup)
        self.names = drift.terms(9 if setup.terms == 10 else setup.terms)
        if setup.tilt:  # estimated whatever the data say of it
            self.names = (*self.names, budget.TILT)

    def problems(self) -> list[str]:
        return setup_problems(self.setup) + window_problems(self.windows) or plan_problems(self.setup, self.windows)

    def regression(self) -> Regression:
        s, t = self.setup, self.turning
        rate = window_regressors.axis_rate(t, s.base, s.latitude, s.earth_rate)
        y = rate - s.k * self.current
        X = budget.design(s, t, self.names)
        self.closed, self.fits, self.no_closed = closed.reduce(
            self.phase, t.angle_start, t.angle_end, t.t_end - t.t_start, y, s.faces, s.latitude, s.gravity
        )
        groups = [self._group(X, p) for p in s.faces]
        candidates = self._candidates(nuisances.fitted(rate, X, y))
        quantities = [self._quantity(n) for n in self.names]
        return Regression(quantities, X, y, t.t_start, t.t_end, groups, candidates=candidates)

    @cached_property
    def phase(self) -> Array:
        return np.asarray(self.windows["phase"]).astype(int)

    @cached_property
    def turning(self) -> window_regressors.Turning:
        face = np.array([np.asarray(self.setup.faces[p], dtype=float) for p in self.phase.tolist()])
        a0, a1, t0, t1 = (np.asarray(self.windows[c], dtype=float) for c in COLUMNS)
        return window_regressors.Turning(a0, a1, t0, t1, face)

    @cached_property
    def current(self) -> Array:
        """Torquer current (n,), A, with the sign of the precession convention."""
        mean = np.asarray(self.windows["mean"], dtype=float)
        return mean if self.setup.polarity == "project" else -mean

    def _candidates(self, torque: Array) -> list[Candidate]:
        """Return set-up effects that a tumble may have: misalignment, trend, temperature, torquer (its rate ``torque``,
        rad/s), constants from mount to mount and from turn-on to turn-on.
        """
        s = self.setup
        if not s.nuisances:
            return []
        along = window_regressors.axis_rate(self.turning, s.base, s.latitude, s.earth_rate, 1)
        tilt = [] if s.tilt is not None else [Candidate.of(budget.TILT, TILT_MEANING, "arcsec", -along)]
        mounts = nuisances.mounts(self.phase, s.faces)
        return [
            *tilt, *nuisances.common(self.windows), *nuisances.torquer(torque), nuisances.scatter("mount", mounts)
        ]  # fmt: skip

    def _quantity(self, name: str) -> Quantity:
        if name == budget.TILT:
            return Quantity.of(name, TILT_MEANING, "arcsec")
        return drift_terms.quantity(self.setup, name, self.closed)

    def _group(self, X: Array, p: int) -> Group:
        """Drift against table angle where the table turns, against time in a dwell."""
        s, t, mine = self.setup, self.turning, self.phase == p
        if not s.turns(p):
            middle = (t.t_start + t.t_end) / 2.0
            return Group(s.label(p), mine, middle[mine] - t.t_start[mine][0], "time in the dwell", "s")
        angle = np.degrees(np.mod(((t.angle_start + t.angle_end) / 2.0)[mine], 2.0 * math.pi))
        dense = np.radians(np.arange(0.0, 361.0, 3.0))
        face = np.broadcast_to(np.asarray(s.faces[p], dtype=float), (dense.size, 3, 3))
        still = window_regressors.Turning(dense, dense, np.zeros_like(dense), np.ones_like(dense), face)
        curve = budget.design(s, still, self.names)
        if budget.TILT in self.names:
            curve[:, -1] = float(np.mean(X[mine, -1]))  # the table turns, the plotted one does not
        return Group(s.label(p), mine, angle, "table angle", "°", (np.degrees(dense), curve))

    def effects(self, found: Findings) -> list[Effect]:
        spread = np.asarray(self.windows.get("std", np.zeros(self.phase.size)), dtype=float)
        return budget.effects(self.setup, self.turning, self.current, spread, found)

    def test(self, found: Findings) -> None:
        s, t = self.setup, self.turning
        phases = [(s.label(p), self.phase == p) for p in s.faces if s.turns(p)]
        self.turns = Turns(found, phases, -t.angle_start, -t.angle_end)
        self.turns.test()

    def account(self, found: Findings) -> Account:
        s = self.setup
        left = 'omega_"IA" - k i = '
        if budget.TILT in self.names:
            left += 'omega_d - epsilon_"IO" omega_"OA", quad '
        return Account(
            method="Torque-rebalance tumble about the polar axis in two mounts with two dwells; least squares over all "
            "windows under an estimated noise model [TEST-TUMBLE1-SDF]",
            sources=[
                "TEST-TUMBLE1-SDF, TUM1-REDUCE; Hu 1981, eq. 3-12..3-21, corrected by E20-E23",
                "GYRO-STATIC-9; Hu 1981, eq. 2-36, 2-47",
                "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
            ],
            equation=drift_terms.equation(f"{left}omega_d = ", (n for n in self.names if n != budget.TILT)),
            conventions=[
                *s.sign_conventions(s.k),
                "Gyro axes I, O, S right-handed; local frame east, north, up; table angle right-handed about the pole, "
                "so that turning against the Earth is negative; the θ of Hu 1981 is minus the table angle.",
                *([] if s.terms in (9, 10) else [f"{s.terms}-term model: the terms left out are taken as zero."]),
                *([] if s.fold else [drift_terms.NO_OO]),
            ],
            no_closed=self.no_closed,
            closed_caption="From the same windows; the formulas weigh all windows alike; D_F, D_O rest on the dwells",
            tables=self.turns.table("θ = −angle"),
            harmonics=self.turns.harmonics(self.fits),
            repeatability=self.turns.repeatability(),
            reasons=[*self._dominant(found), *drift_terms.folded(s), *self._missing()],
        )

    def _dominant(self, found: Findings) -> list[Reason]:
        """Return that the tilt of the input axis makes most of the uncertainty of D_O, where it does."""
        tilt = next(e for e in self.effects(found) if e.id == budget.TOWARDS_OUTPUT.id)
        j = self.names.index("D_O") if "D_O" in self.names else 0
        if abs(float(tilt.changes(found)[0, j])) * tilt.size <= float(found.u[j]):
            return []
        text = "The tilt of the input axis makes most of the uncertainty of D_O; tilt=yes estimates it."
        return [Reason("tumble.tilt_dominates", text)]

    def _missing(self) -> list[Reason]:
        truth = self.setup.truth or {}
        missing = [n for n in drift.NAMES if n not in self.names and n != "D_OO" and truth.get(n, 0.0) != 0.0]
        text = f"{', '.join(missing)} is simulated but not in the {self.setup.terms}-term model: the others are biased."
        return [Reason("drift.missing", text)] if missing else []


reduce = Reduction.reduce
