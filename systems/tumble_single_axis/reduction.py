"""Reduction of the single-axis tumble: nine drift coefficients of a floated gyro from averaged torquer currents.

    y = omega_IA - k i = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_SS Z2 + D_IO XY + D_OS YZ + D_IS XZ + noise

Every window is a row; regressors are averaged over the window as the current is, so no [AVG-SINC] damping is left.
Of a table that rests at its angles they are those of the angles: nothing is averaged, and its rate is 0.  [TUM1-STOPS]
The noise (white, Gauss-Markov or both) is estimated from the same record and weighs the rows.  The closed
formulas stand beside the estimates.  [TEST-TUMBLE1-SDF; Hu 1981, eq. 3-12..3-21]

Misalignment of the input axis, a trend in time, temperature, asymmetry of the torquer and constants that differ from
mount to mount or from turn-on to turn-on are weighed by the data (gyrobench.reduction.estimation.nuisances).  Windows,
fit and budget are those of gyrobench.reduction.drift.turning_test.

Not modelled: change of the drift with time other than linear, torquer nonlinearity (a line of the budget).
"""

from __future__ import annotations

from dataclasses import dataclass

from gyrobench import drift, frames
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.drift import drift_terms, supplies, window_regressors
from gyrobench.reduction.drift.drift_terms import OneLoopSetup
from gyrobench.reduction.drift.turning_test import Formulas, TurningTest
from gyrobench.reduction.setup.setups import TurningSetup
from gyrobench.reduction.setup.sources import INPUT_TO_OUTPUT, INPUT_TO_SPIN, TURNED, Effect
from gyrobench.reduction.setup.window_checks import window_problems
from gyrobench.reduction.toolkit import Account, Array, Findings, Location, Quantity, Reason, Regression, RunDocument

from . import closed
from .refusals import refusals

CONTINUOUS = (
    "Torque-rebalance tumble about the polar axis in two mounts with two dwells; least squares over all windows under "
    "an estimated noise model"
)
INTERMITTENT = (
    "Intermittent torque-rebalance tumble about the polar axis, at rest at the angles of two mounts, with two dwells; "
    "least squares over all windows under an estimated noise model"
)


@dataclass(frozen=True, kw_only=True)
class TumbleSetup(TurningSetup, OneLoopSetup):
    """terms: of the model.  tilt: the small angle of the input axis towards the output axis (where it is estimated D_O
    rests on the dwells).
    """

    terms: int = 9

    def problems(self, folding: bool = True) -> list[str]:
        problems = refusals(self.latitude) + super().problems(folding)
        if self.terms not in drift.TERM_SETS:
            problems.append(f"{self.terms}-term model unknown; there are {', '.join(map(str, drift.TERM_SETS))}")
        if self.terms == 10 and not self.fold:
            problems.append(
                "ten terms have rank 9 at constant |g|: the data do not see D_II + D_OO + D_SS − γ² D_F; reduce nine "
                "terms, or set fold to report the combinations"
            )
        return problems


class Reduction(TurningTest[TumbleSetup]):
    """Nine drift coefficients from the windows of a tumble."""

    handling = staticmethod(handling_candidates.tumble)
    mounting = ((INPUT_TO_OUTPUT, 2, 1.0), (INPUT_TO_SPIN, 1, -1.0), (TURNED["input"], 0, 1.0))

    @classmethod
    def setup_of(cls, run: RunDocument) -> TumbleSetup:
        faces = frames.tumble_faces(Location.of(run).latitude)
        return TumbleSetup.of_plan(run, faces, terms=int(run.options.get("terms", 9)))

    def problems(self) -> list[str]:
        return self.setup.problems() + window_problems(self.windows) or self.plan_problems()

    def regression(self) -> Regression:
        s = self.setup
        self.terms = drift.terms(9 if s.terms == 10 else s.terms)
        self.k, self.quantum, self.pulses = s.k, s.quantum, s.pulses
        return super().regression()

    def closed(self, y: Array) -> Formulas:
        s = self.setup
        fits, dwells, why = self.harmonics_of(y, frames.tumble_faces(s.latitude))
        if why:
            return {}, {}, why
        one, two = (fits[m].named for m in ("mount 1", "mount 2"))
        return closed.formulas(one, two, dwells["static 3"], dwells["static 4"], s.latitude, s.gravity), fits, ""

    def quantity(self, name: str) -> Quantity:
        return drift_terms.quantity(self.setup, name, self.book)

    def effects(self, found: Findings) -> list[Effect]:
        """Return the sources of a tumble, and the supplies of the gyro."""
        s, t, read = self.setup, self.turning, self.read
        x = window_regressors.regressors(t, s.base, s.gravity, ("D_I", "D_O", "D_S"))
        readings = supplies.rebalanced(self.rate(t), s.k * read.mean)
        return [*super().effects(found), *s.supplies.effects(found, readings, x, (t.t_start + t.t_end) / 2.0)]

    def account(self, found: Findings) -> Account:
        s = self.setup
        tilt = 'omega_d - epsilon_"IO" omega_"OA", quad ' if s.tilt else ""
        every = [n for n in drift.NAMES if n != "D_OO"]
        missing = drift_terms.left_out(s.truth, self.terms, every, f"{s.terms}-term")
        return Account(
            method=f"{INTERMITTENT if s.intermittent else CONTINUOUS} [TEST-TUMBLE1-SDF]",
            sources=[
                *(["TUM1-STOPS; Hu 1981, 3.2.4-1, 5.4"] if s.intermittent else []),
                "TEST-TUMBLE1-SDF, TUM1-REDUCE; Hu 1981, eq. 3-12..3-21, corrected by E20-E23",
                "GYRO-STATIC-9; Hu 1981, eq. 2-36, 2-47",
                "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
            ],
            equation=drift_terms.equation(f'omega_"IA" - k i = {tilt}omega_d = ', self.terms),
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
            reasons=[*self._dominant(found), *drift_terms.folded(s), *missing],
        )

    def _dominant(self, found: Findings) -> list[Reason]:
        """Return that the tilt of the input axis makes most of the uncertainty of D_O, where it does."""
        tilt = next(e for e in self.effects(found) if e.id == INPUT_TO_OUTPUT.id)
        j = self.names.index("D_O") if "D_O" in self.names else 0
        if abs(float(tilt.changes(found)[0, j])) * tilt.size <= float(found.u[j]):
            return []
        text = "The tilt of the input axis makes most of the uncertainty of D_O; tilt=yes estimates it."
        return [Reason("tumble.tilt_dominates", text)]
