"""Reduction of the two-axis servo test: drift coefficients of both channels from the angles of both table axes.

    x channel   x' cos y + e . (A row 1) = omega_dx        y channel   y' + e . (A row 2) = omega_dy      [eq. 3-97]

Each channel is a least squares problem of its own over all windows; rates and regressors are averaged over the window
(windows.py), the noise (white, Gauss-Markov, errors of shared readings) is estimated from the same record.  The Hu 1981
route, its formulas at the middles of the windows, stands beside.  [TEST-SERVO2-2DOF]

Not modelled: change of the coefficients per g with time (mount against mount shows it), noise common to both channels.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gyrobench import drift
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.drift import channels, drift_terms, servo_regression
from gyrobench.reduction.drift.held_test import HeldSetup
from gyrobench.reduction.estimation import nuisances, regression
from gyrobench.reduction.estimation.channel_tests import ChannelTests
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.sentences import plain, told
from gyrobench.reduction.toolkit import Account, Array, DriftReduction, Effect, Findings, Group, Quantity, truth_of
from gyrobench.result import Coefficient, DriftTestResult, Reason, Table
from gyrobench.units import DPH

from . import budget, closed, geometry, levelled, refusals
from .windows import ANGLES, track

REQUIRED = ("phase", "t_start", "t_end", *ANGLES)
CONVENTIONS = (
    "Drift ω_d in precession sign: inertial rate of the plate along the gyro's x and y axes; ω_M of Hu 1981 is −ω_dx.",
    "X, Y, Z = −f/g0 along x (outer gimbal), y (inner gimbal) and z (spin) axis (sign of Hu 1981: a body axis that "
    "points up reads −1); g0 = 9.80665 m/s². Against +f/g0 the linear coefficients change sign.",
    "Outer angle x right-handed about X, inner angle y about Y of the mount; gyro x along X, y along Y at 0, 0; ω_X, "
    "ω_Y, ω_Z: Earth rate along X, Y, Z = X × Y; local frame east, north, up. Torquers idle while the gyro holds the "
    "table; the turn about z is not controlled.",
)


@dataclass(frozen=True, kw_only=True)
class TwoAxisServoSetup(HeldSetup):
    """terms: of the model of a channel.  gains: of the pickoffs about x and y, V/rad.  levelled: the torquers keep both
    angles at 0.  torquers: their scale factors, by the axis they precess about, rad/s/A.
    """

    terms: int = 9
    gains: Mapping[str, float] = field(default_factory=dict)
    levelled: bool = False
    torquers: Mapping[str, float] = field(default_factory=dict)

    def names(self, channel: str) -> tuple[str, ...]:
        """Return the coefficients of a channel."""
        return drift.terms_2dof(channel, self.terms)


class ServoChannel(DriftReduction[TwoAxisServoSetup]):
    """One channel of the windows that both share."""

    def __init__(self, whole: Reduction, channel: str) -> None:
        super().__init__(whole.windows, whole.setup)
        self.whole, self.channel, self.axis = whole, channel, "xy".index(channel)
        self.names = whole.setup.names(channel)

    def regression(self) -> Regression:
        s, w, seen = self.setup, self.whole, self.whole.seen
        quantities = [Quantity.drift(n, (s.truth or {}).get(n), w.book[n]) for n in self.names]
        y = seen.inertial(s.place)[:, self.axis]
        # a misalignment of the gyro on the plate is not weighed: z stays among the stars, and what x and y see of it is
        # nearly what the coefficients of the other axis make (a line of the budget)
        rows = {n: np.asarray(v)[w.held] for n, v in w.windows.items()}
        end = f",{self.channel}"
        weighed = [*nuisances.common(rows, end), nuisances.scatter("mount", w.phase.tolist(), end)]
        return Regression(
            quantities, w.X[self.channel], y, seen.t_start, seen.t_end, [self.whole.group(p) for p in s.labels],
            noise="readings", limit=1e6, candidates=weighed if s.nuisances else (),
        )  # fmt: skip

    def effects(self, found: Findings) -> list[Effect]:
        return budget.effects(self.axis, found, self.whole.seen, self.whole.phase, self.names, self.setup)

    def test(self, found: Findings) -> None:
        """Add an F test: is the constant drift that of the first mount in all others?"""
        others = np.unique(self.whole.phase)[1:]
        if others.size and not any(c.scatter for c, _ in found.joined):
            found.f_test(
                "mounts.agree", "mount to mount", (self.whole.phase[:, None] == others).astype(float),
                "change of the constant drift between mounts",
                "the constant drift is not the same in all mounts: turn-on, warm-up, or a mount that is not true",
                "constant drift alike in all mounts",
            )  # fmt: skip

    def account(self, found: Findings) -> Account:
        s, c = self.setup, self.channel
        left = (
            "dot(x) cos y + omega_X cos y + omega_Y sin x sin y - omega_Z cos x sin y"
            if c == "x"
            else "dot(y) + omega_Y cos x + omega_Z sin x"
        )
        return Account(
            method="The gyro holds a two-axis table still among the stars; least squares of each channel over all "
            "windows under an estimated noise model with shared angle readings [TEST-SERVO2-2DOF]",
            sources=[
                "TEST-SERVO2-2DOF, SERVO2-A, SERVO2-KIN, APP2; Hu 1981, eq. 3-94..3-102 and appendix 2, "
                "corrected by E47, E50, E51",
                "GYRO-STATIC-2DOF; Hu 1981, eq. 2-29..2-46, corrected by E7-E9",
                "RED-RATE (shared readings), RED-GLS; Hu 1981, eq. 4-1..4-11, 4-79..4-88, corrected by ER1, ER23",
            ],
            equation=f'{left} = omega_"d{c}" \\ omega_"d{c}" = {drift.typst_2dof(c, self.names)}',
            conventions=CONVENTIONS,
            closed_caption="The formulas of Hu 1981 at the middles of the same windows, ordinary least squares",
            reasons=drift_terms.left_out(s.truth, self.names, drift.NAMES_2DOF[c], f"{s.terms}-term"),
        )

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [found.noise_sentence(), *found.nuisance_sentences()]


class Reduction(ChannelTests[TwoAxisServoSetup]):
    """Coefficients of both channels of a record."""

    handling = staticmethod(handling_candidates.two_axes)

    @classmethod
    def setup_of(cls, run: RunDocument) -> TwoAxisServoSetup:
        level, other = bool(run.options.get("levelled", False)), levelled.OTHER
        known = {n: float(run.options.get(n) or run.parameters.get(f"gyro.{n}") or 0.0) for n in ("k_x", "k_y")}
        return TwoAxisServoSetup.of(
            run,
            levelled=level,
            torquers={a: known[f"k_{other[a]}"] for a in "xy"},
            **({"remount": None} if level else {}),
            terms=int(run.options.get("terms", 9)),
            gains={a: run.parameters.get(f"gyro.K_sg_{a}", 0.0) for a in "xy"},
            truth=truth_of(run, [n for c in "xy" for n in drift.NAMES_2DOF[c]]),
        )

    def of_channel(self, name: str) -> ServoChannel | levelled.LevelChannel:
        return levelled.LevelChannel(self, name) if self.setup.levelled else ServoChannel(self, name)

    def group(self, p: int) -> Group:
        """Return the windows of a phase against the time in its mount."""
        rows, seen = self.phase == p, self.seen
        middle = (seen.t_start + seen.t_end) / 2.0
        x = (middle[rows] - seen.t_start[rows][0]) / 3600.0
        return Group(self.setup.name(p), rows, x, "time in the mount", "h")

    def overview(self, results: Mapping[str, DriftTestResult]) -> list[str]:
        """Return the numbers that matter, as sentences."""
        if not self.setup.levelled:
            return super().overview(results)
        every = [c for r in results.values() for c in r.coefficients]
        named = [c.name for c in every if c.name.startswith("ω_d")]
        return told(every, *(f"Composite drift {n} = {{{n}}}." for n in named))

    def problems(self) -> list[str]:
        s, known = self.setup, {f"mount {m}": m for m in geometry.MOUNTS}
        wrong = [f"phase {p}: '{n}' is none of the mounts {', '.join(known)}" for p, n in s.labels.items()
                 if n not in known]  # fmt: skip
        if wrong := wrong or servo_regression.window_problems(self.windows, s.labels, REQUIRED):
            return wrong
        every = np.asarray(self.windows["phase"]).astype(int)
        self.held = np.isin(every, list(s.labels))
        self.phase = every[self.held]
        self.mount = np.array([known[s.labels[p]] for p in self.phase.tolist()])
        base = {m: geometry.base(m, s.latitude) for m in set(self.mount.tolist())}
        w_all = {c: np.asarray(v)[self.held] for c, v in self.windows.items()}
        w = {c: w_all[c].astype(float) for c in REQUIRED}
        self.seen = track(w, self.phase, np.array([base[m] for m in self.mount.tolist()]))
        if s.levelled or "current_x" in w_all or "current_y" in w_all:
            return self._levelled_problems(w)
        self.X = {c: self.seen.design(s.place, s.names(c)) for c in "xy"}
        inner = np.concatenate([w["inner_start"], w["inner_end"]])
        if wrong := self._record_problems(inner):
            return wrong
        place = (s.latitude, s.gamma, s.earth_rate)
        self.book = closed.reduce(self.seen.middle(), self.mount, place, s.terms)
        return []

    def _levelled_problems(self, w: Mapping[str, Array]) -> list[str]:
        """Return why the rows of a levelled record cannot be reduced; w: :data:`REQUIRED`."""
        s, missing = self.setup, [n for n in ("current_x", "current_y") if n not in self.windows]
        if not s.levelled:
            return ["the record has currents of the torquers: state levelled = true, or leave them out"]
        if missing:
            return [f"column {', '.join(missing)} is missing: levelled asks for the currents of both torquers"]
        if unknown := [f"k_{levelled.OTHER[a]}" for a, k in s.torquers.items() if not k > 0.0]:
            return [f"{', '.join(unknown)} unknown: give the scale factor of the torquer, as k_x = 17.2deg/h/mA"]
        held = {n: np.asarray(v, dtype=float)[self.held] for n, v in self.windows.items() if n.startswith("current_")}
        self.torqued = levelled.torqued(s, held)
        return levelled.problems({n: w[n] for n in ANGLES}) + self._tracking_problems()

    def _tracking_problems(self) -> list[str]:
        s, found = self.setup, []
        for a in "xy":
            part = {k: self.windows[f"{k}_{a}"] for k in ("mean", "std") if f"{k}_{a}" in self.windows}
            if len(part) == 2:
                problems = servo_regression.tracking_problems(part, self.held, s.gains.get(a, 0.0), s.tracking)
                found += [f"{a} axis: {text}" for text in problems]
        return found

    def _record_problems(self, inner: Array) -> list[str]:
        """Return why the rows cannot be reduced: gimbal lock (inner angles, rad), tracking, rank."""
        s, found = self.setup, []
        worst = float(inner[np.argmin(np.cos(inner))])
        if math.cos(worst) < geometry.LEAST:
            found.append(
                f"gimbal lock: the inner angle reaches {plain(math.degrees(worst), 4)}°, "
                f"{plain(math.degrees(math.acos(geometry.LEAST)), 3)}° is allowed; leave out the windows beyond"
            )
        found += self._tracking_problems()
        for c, X in self.X.items():
            seen = regression.examine(X, s.names(c))
            if seen.short:
                found.append(f"{c} channel: {seen.weakness}")
        most = refusals.MOST_SINGLE if np.unique(self.mount).size == 1 else refusals.MOST
        if not found and (k := refusals.condition(self.X)) > most:
            mounts = " ".join(map(str, np.unique(self.mount)))
            found.append(f"mounts {mounts}: condition {plain(k, 3)}, {most:g} is allowed: add another mount")
        return found

    def reasons(self) -> list[Reason]:
        if self.setup.levelled:
            return []
        k = refusals.condition(self.X)
        if k <= refusals.WARN:
            return []
        weak = [f"{regression.examine(X, self.setup.names(c)).weakest} ({c})" for c, X in self.X.items()]
        which = " ".join(str(m) for m in dict.fromkeys(self.mount.tolist()))
        condition = f"Mounts {which}: condition {plain(k, 3)} of the coefficients per g"
        text = f"{condition}; least determined: {', '.join(weak)}."
        return [Reason("mounts.weak", text)]

    def tables(self, coefficients: Sequence[Coefficient]) -> list[Table]:
        if self.setup.levelled:
            return levelled.tables(self)
        found = {c: test.found for c, test in self.each.items()}
        return [t for t in (self._mounts_table(found), _book_table(found), _shared_table(found)) if t.rows]

    def _mounts_table(self, found: Mapping[str, Findings]) -> Table:
        rows: list[list[Any]] = []
        s, seen = self.setup, self.seen
        for p, label in s.labels.items():
            k = self.phase == p
            time = float(seen.t_end[k][-1] - seen.t_start[k][0])
            zero = refusals.locked(int(self.mount[k][0]), s.latitude, time, s.earth_rate)
            outer, inner = seen.angle[k][..., 0], seen.angle[k][..., 1]
            angles = (float(outer[-1, -1] - outer[0, 0]), float(np.max(np.abs(inner))), zero)
            scatter = [float(np.std(f.est.residual[k])) / DPH for f in found.values()]
            rows.append([label, p, int(k.sum()), time / 3600.0, *map(math.degrees, angles), *scatter])
        head = [
            "mount", "phase", "windows", "time / h", "outer / °", "inner / °", "no drift / °", "x / (°/h)", "y / (°/h)",
        ]  # fmt: skip
        caption = "Turn of the outer axis, largest inner angle and that of a gyro without drift; scatter of residuals"
        return Table("mounts", "Mounts", caption, head, rows)


def _book_table(found: Mapping[str, Findings]) -> Table:
    """Return the estimates in the names of Hu 1981: torque sign in the first line of 3-95, precession sign in the
    second.
    """
    rows = [[f"{row[0]}, {c}", *row[1:]] for c, fit in found.items() for row in channels.book_rows(fit, c)]
    caption = "Of the lines −α̇ (x) and β̇ (y) of 3-95; last column: sign against this report"
    head = ["Hu 1981", "estimate", "u of type A", "unit", "this report", "sign"]
    return Table("notation.book", "Notation of Hu 1981", caption, head, rows)


def _shared_table(found: Mapping[str, Findings]) -> Table:
    """Return K_zx and K_zy of both channels; they must agree where they have a rigid-body cause.  [STATIC-DRIFT]"""
    rows: list[list[Any]] = []
    for symbol in ("K_zx", "K_zy"):
        pair = []
        for c, fit in found.items():
            ours, sign = channels.BOOK[c][symbol]
            k = [q.name for q in fit.quantities].index(ours)
            pair.append((sign * float(fit.value[k]) / DPH, float(fit.u[k]) / DPH))
        (a, ua), (b, ub) = pair
        both = 2.0 * math.hypot(ua, ub)
        E_n: Any = (a - b) / both if both > 0.0 else 0.0
        rows.append([symbol, a, b, a - b, "–" if any(f.ideal for f in found.values()) else E_n])
    caption = "E_n: difference over its expanded uncertainty (type A); below 1 in size they agree"
    head = ["Hu 1981", "x channel / (°/h/g²)", "y channel / (°/h/g²)", "difference", "E_n"]
    return Table("channels.shared", "Compliances seen by both channels", caption, head, rows)
