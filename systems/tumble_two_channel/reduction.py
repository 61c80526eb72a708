"""Reduction of the two-channel tumble: drift coefficients of both channels from averaged torquer currents.

    x channel   omega_x - k_y i_y = omega_dx        y channel   omega_y - k_x i_x = omega_dy        [MEAS-REBALANCE]

Each channel is a least squares problem of its own: every window is a row, regressors are averaged over the window as
the current is, and the noise of each channel is estimated from the same record (gyrobench.reduction.drift.
turning_test).  The closed formulas of Hu 1981 stand beside the estimates.
[TEST-TUMBLE1-2DOF-A, -B; Hu 1981, eq. 3-22..3-37]

Not modelled: change of the drift with time, torquer nonlinearity (a line of the budget), noise common to both channels,
independent mount errors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gyrobench import drift
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.drift import drift_terms, window_regressors
from gyrobench.reduction.drift.pulses import Pulses
from gyrobench.reduction.drift.turning_test import Formulas, TurningTest
from gyrobench.reduction.estimation.channel_tests import ChannelTests
from gyrobench.reduction.setup.run_metadata import Location, number, truth_of
from gyrobench.reduction.setup.setups import TurningSetup, scale_factor_problems
from gyrobench.reduction.setup.sources import TURNED
from gyrobench.reduction.toolkit import Account, Array, Findings, Quantity, RunDocument, plain, window_problems
from gyrobench.result import Coefficient, Reason, Table
from gyrobench.units import DPH

from . import closed, geometry

COLUMNS = ("phase", "t_start", "t_end", "angle_start", "angle_end", "mean_x", "mean_y")


OTHER = {"x": "y", "y": "x"}  # the torquer that measures a channel stands about the other axis


@dataclass(frozen=True, kw_only=True)
class TwoChannelSetup(TurningSetup):
    """k: scale factors of the torquers about x and y, rad/s/A.  model: simple or nine.  fold: Dx_yy and Dy_xx may be
    there and are folded into others.  tilt: those of the measuring axes towards the spin axis.
    quantum: resolution of each current reading.  pulses: of pulse-width rebalances, by the torquer's axis.
    """

    k: Mapping[str, float]
    model: str = "nine"
    quantum: Mapping[str, float] = field(default_factory=dict)
    pulses: Mapping[str, Pulses | None] = field(default_factory=dict)


class TumbleChannel(TurningTest[TwoChannelSetup]):
    """One channel, with the current of the torquer about the other axis."""

    across = 2
    rotates, upright = "spin axis", "y axis"
    mixed, lost = "constants and z terms mix", "the constants cannot be told from the squares"
    mounting = tuple((TURNED[n], k, 1.0) for k, n in enumerate("xyz"))

    def __init__(self, windows: Mapping[str, Array], setup: TwoChannelSetup, channel: str) -> None:
        super().__init__(windows, setup)
        self.channel, self.torquer = channel, OTHER[channel]
        self.axis, self.held = geometry.AXIS[channel], 1 if setup.model == "simple" else 2
        self.tilt, self.tilt_meaning = geometry.TILT[channel], f"tilt of the {channel} axis towards the spin axis"
        self.terms, self.k = geometry.terms(setup.model, channel), setup.k[self.torquer]
        self.quantum, self.pulses = setup.quantum.get(self.torquer, 0.0), setup.pulses.get(self.torquer)
        self.elsewhere = drift_terms.elsewhere(channel)
        self.square = geometry.SQUARES[channel]

    def closed(self, y: Array) -> Formulas:
        s, c = self.setup, self.channel
        fits, dwells, why = self.harmonics_of(y, geometry.faces(s.model, s.latitude))
        if why:
            return {}, {}, why
        one, two = (fits[m].named for m in ("mount 1", "mount 2"))
        if s.model == "nine":
            rest = dwells["static 3"], dwells["static 4"]
            return closed.nine(c, one, two, *rest, s.latitude, s.gravity), fits, ""
        one, two = ({n: -v for n, v in of.items()} for of in (one, two))  # the torquer turns against the drift
        symbols = closed.simple(c, one, two, s.latitude, s.gravity)
        return {closed.BOOK[b][0]: closed.BOOK[b][1] * v for b, v in symbols.items()}, fits, ""

    def quantity(self, name: str) -> Quantity:
        return drift_terms.quantity(self.setup, name, self.book, self.square if self.setup.model == "nine" else "")

    def account(self, found: Findings) -> Account:
        s, simple = self.setup, self.setup.model == "simple"
        part = ("two mounts, simple model", "A") if simple else ("two mounts and two dwells, nine terms", "B")
        left_out, said = self._left_out(found)
        return Account(
            method=f"Torque-rebalance tumble of both channels about the polar axis, {part[0]}; least squares of each "
            f"channel over all windows under an estimated noise model [TEST-TUMBLE1-2DOF-{part[1]}]",
            sources=[
                "TEST-TUMBLE1-2DOF-A, TUM2A; Hu 1981, eq. 3-22..3-25, signs corrected by E24"
                if simple
                else "TEST-TUMBLE1-2DOF-B, TUM2B-REDUCE; Hu 1981, eq. 3-26..3-37, corrected by E25-E29",
                "GYRO-STATIC-2DOF; Hu 1981, eq. 2-29..2-46, corrected by E7-E9",
                "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
            ],
            equation=self._equation(),
            conventions=_conventions(s),
            no_closed=self.no_closed,
            closed_caption="From the same windows; the formulas weigh all windows of a mount alike",
            tables=[*self.turns.table("θ = −angle"), *left_out],
            harmonics=self.turns.harmonics(self.fits),
            repeatability=self.turns.repeatability(),
            reasons=[
                *said,
                *([] if simple else drift_terms.folded(s, self.square)),
                *(Reason("latitude.weak", text) for text in geometry.cautions(s.latitude)),
            ],
        )

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [found.noise_sentence()]

    def _equation(self) -> str:
        c, s = self.channel, self.setup
        left = f"omega_{c} - k_{self.torquer} i_{self.torquer}"
        tilt = f' = omega_"d{c}" - epsilon_"{c}z" omega_z, quad' if s.tilt else " ="
        return f'{left}{tilt} omega_"d{c}" = {drift.typst_2dof(c, self.terms)}'

    def _left_out(self, found: Findings) -> tuple[list[Table], list[Reason]]:
        """Return what simulated terms outside the model do to the coefficients: a table and a warning."""
        s, truth = self.setup, self.setup.truth or {}
        extra = [n for n in drift.NAMES_2DOF[self.channel] if n not in self.names and truth.get(n, 0.0) != 0.0]
        if s.model == "nine":
            extra = [n for n in extra if n != self.square]
        if not extra:
            return [], []
        more = window_regressors.regressors(self.turning, s.base, s.gravity, tuple(extra)) @ np.array(
            [truth[n] for n in extra]
        )
        shift = found.gain @ more / DPH
        rows = [[q.title, float(v), q.unit] for q, v in zip(found.quantities, shift, strict=True)]
        who = ", ".join(extra)
        caption = f"Predicted shift by {who}, which are simulated and outside the model; likeliest noise model"
        table = Table("drift.left_out", "Terms left out", caption, ["coefficient", "shift", "unit"], rows)
        text = f"{who} is simulated but not in the {s.model} model: the others are shifted as the table says."
        return [table], [Reason("drift.left_out", text)]


class Reduction(ChannelTests[TwoChannelSetup]):
    """Both channels from windows with :data:`COLUMNS` (mean_x, mean_y: currents of the torquers about x and y, A)."""

    handling = staticmethod(handling_candidates.tumble)
    channel = TumbleChannel

    @classmethod
    def setup_of(cls, run: RunDocument) -> TwoChannelSetup:
        model = str(run.options.get("model", "nine"))
        return TwoChannelSetup.of_plan(
            run,
            geometry.faces(model, Location.of(run).latitude),
            k={a: number(run, f"k_{a}", f"gyro.k_{a}", f"scale factor of the torquer about {a}") for a in "xy"},
            model=model,
            truth=truth_of(run, (n for c in "xy" for n in drift.NAMES_2DOF[c])),
            quantum={a: float(run.parameters.get(f"rebalance_{a}.resolution", 0.0)) for a in "xy"},
            pulses={a: Pulses.of(run, f"rebalance_{a}") for a in "xy"},
        )

    def problems(self) -> list[str]:
        s, w, nine = self.setup, self.windows, self.setup.model == "nine"
        problems = geometry.refusals(s.latitude, s.model) + s.problems(nine)
        problems += [text for a, k in s.k.items() for text in scale_factor_problems(k, f"k_{a}")]
        if problems := problems + window_problems(w, COLUMNS):
            return problems
        x = TumbleChannel(w, s, "x")
        problems = x.plan_problems(nine)
        turned = np.asarray(w["angle_end"], dtype=float) - np.asarray(w["angle_start"], dtype=float)
        turning = np.isin(x.phase, [p for p in s.faces if s.turns(p)])
        if s.tilt and len(set(np.sign(turned[turning]).tolist())) < 2:
            problems.append("tilt: turns in both senses are needed to tell the tilt from the z terms")
        return problems

    def tables(self, coefficients: Sequence[Coefficient]) -> list[Table]:
        """Return the simple model in the symbols of Hu 1981."""
        if self.setup.model != "simple":
            return []
        by_name, rows = {c.name: c for c in coefficients}, []
        for symbol, (name, sign) in closed.BOOK.items():
            c = by_name[name]
            formula = None if c.closed is None else sign * c.closed
            rows.append([symbol, f"{'−' if sign < 0 else ''}{name}", sign * c.estimate, c.u, formula, c.unit])
        caption = (
            "R = M/H (R_x, the torque about x, appears in the drift about y), u = m g0 l/H, Q = m² g0² ΔK/H; u_zx with "
            "and u_zy without the outer gimbal"
        )
        head = ["symbol", "is", "least squares", "u", "closed formula", "unit"]
        return [Table("notation.book", "Quantities of Hu 1981", caption, head, rows)]


def _conventions(s: TwoChannelSetup) -> list[str]:
    sign = "k i = ω_IA − ω_d" if s.polarity == "project" else "k i = ω_d − ω_IA as in Hu 1981, sign inverted at entry"
    k = {a: f"{plain(v * 1e-3 / DPH, 6)} °/h/mA" for a, v in s.k.items()}
    simple = ["Terms outside the simple model are taken as zero."]
    squares = ["Dx_yy and Dy_xx are taken as zero; if not, Dx_0 holds γ² Dx_yy, Dx_xx and Dx_zz hold −Dx_yy; y alike."]
    return [
        "Drift ω_d in precession sign; for the sign of an indicated rate turn all coefficients round.",
        "X, Y, Z = −f/g0 along x (outer gimbal), y (inner gimbal) and z (spin) axis (sign of Hu 1981: a body axis that "
        "points up reads −1); g0 = 9.80665 m/s². Against +f/g0 the linear coefficients change sign.",
        f"Torquer currents: {sign}; the current i_y measures the x channel and i_x the y channel. k_x = {k['x']}, "
        f"k_y = {k['y']}.",
        "Gyro axes right-handed; local frame east, north, up; table angle right-handed about the pole, so that turning "
        "against the Earth is negative; the θ of Hu 1981 is minus the table angle.",
        *(simple if s.model == "simple" else [] if s.fold else squares),
    ]
