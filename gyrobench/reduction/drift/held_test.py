"""What tests share in which the gyro holds its table: setup, windows, set-up effects, composite drift of each phase.

    class Reduction(HeldTest[HeldSetup]):
        attitudes = VERTICAL
        def columns(self, held): ...           # design matrix
        def record_problems(self): ...

[MEAS-SERVO; gyrobench.reduction.drift.servo_regression]
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.drift import channels, composite, drift_terms, servo_regression
from gyrobench.reduction.drift.supplies import Supplies
from gyrobench.reduction.estimation.drift_test import DriftReduction
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.reported import Group
from gyrobench.reduction.series.noise_coefficients_table import noise_coefficients_table
from gyrobench.reduction.setup.run_metadata import remount_of
from gyrobench.reduction.setup.setups import SiteSetup
from gyrobench.reduction.setup.sources import TORQUER_SCALE, Effect
from gyrobench.result import DriftTestResult, Reason, Table
from gyrobench.units import DPH


@dataclass(frozen=True, kw_only=True)
class HeldSetup(SiteSetup):
    """labels: phase -> attitude, of the phases in which the gyro holds the table.  tracking: largest angle of the table
    against the gyro, rad.  gain: of the pickoff, V/rad of the case (0: unknown).  channel: of a two-degree-of-freedom
    gyro, x or y; truth is then in the names and signs of a floated gyro.  k_locked: scale factor of the torquer that
    locks the other axis, rad/s/A (0: unknown).  k: of the torquer that compensates in a level attitude.
    """

    labels: Mapping[int, str]
    channel: str = ""
    tracking: float = servo_regression.TRACKING
    gain: float = 0.0
    k_locked: float = 0.0
    k: float = 0.0
    supplies: Supplies = field(default_factory=Supplies)

    @classmethod
    def of(cls, run: RunDocument, **own: Any) -> Self:
        p, channel = run.parameters, str(run.options.get("channel", ""))
        floated = p.get("gyro.K_sg", 0.0) * p.get("gyro.H", 0.0) / (p.get("gyro.C") or 1.0)
        torquer = {"": "k", "x": "k_y", "y": "k_x"}.get(channel, "k")  # it stands on the other axis
        known: dict[str, Any] = {
            "channel": channel,
            "labels": {row.phase: row.label for row in run.plan if row.mode == "servo"},
            "tracking": float(run.options.get("tracking", servo_regression.TRACKING)),
            "gain": p.get(f"gyro.K_sg_{channel}", 0.0) if channel else floated,
            "k": float(run.options.get("k") or p.get(f"gyro.{torquer}") or 0.0),
            "k_locked": p.get(f"gyro.k_{channel}", 0.0) if channel else 0.0,
            "truth": channels.truth_in(run, channel),
            "remount": remount_of(run),
            "supplies": Supplies.of(run),
        }
        made = super().of(run, **{**known, **own})
        return replace(made, errors=channels.errors_in(made.errors, channel))

    def name(self, phase: int) -> str:
        """Return the attitude of a phase, with its number where the attitude comes back."""
        label = self.labels[phase]
        return label if list(self.labels.values()).count(label) == 1 else f"{label}, phase {phase}"

    def earth(self, axes: Array) -> float:
        """Return the Earth rate along the first of axes (rows, in ENU), rad/s."""
        return float((axes @ (self.earth_rate * frames.pole(self.latitude)))[0])


H = TypeVar("H", bound=HeldSetup)


class HeldTest(DriftReduction[H]):
    """A floated gyro that holds a table with one axis; see the module.  attitudes: that a phase may have."""

    handling = staticmethod(handling_candidates.servo)
    attitudes: ClassVar[Collection[str]]

    def columns(self, held: servo_regression.HeldWindows) -> Array:
        """Return the design matrix (n, p) of windows."""
        raise NotImplementedError

    def record_problems(self) -> list[str]:
        """Return what is wrong with the windows ``self.held`` of the phases ``self.phase``, as sentences."""
        return []

    def problems(self) -> list[str]:
        s = self.setup
        self.held, self.phase, rows = servo_regression.held_windows(self.windows, s.labels, self.attitudes, s.latitude)
        tracking = servo_regression.tracking_problems(self.windows, rows, s.gain, s.tracking)
        self.of_held = {n: np.asarray(v)[rows] for n, v in self.windows.items()}
        if "current" in self.of_held:
            self.held = replace(self.held, torqued=s.k * np.asarray(self.of_held["current"], dtype=float))
        unknown = self.held.torqued is not None and not s.k > 0.0
        text = "k unknown: the record has currents of the torquer; give its scale factor, as k = 17.2deg/h/mA"
        return [*self.record_problems(), *tracking, *([text] if unknown else [])]

    def drift_rates(self, quantities: list[Quantity], groups: list[Group]) -> Regression:
        """Return the regression of the drift rates of all windows, neighbours of which share an angle reading."""
        s, h = self.setup, self.held
        y, X = servo_regression.drift_rate(h, s.place), self.columns(h)
        weighed = servo_regression.candidates(h, s.place, self.columns, self.phase, self.of_held) if s.nuisances else []
        return Regression(quantities, X, y, h.t_start, h.t_end, groups, noise="readings", candidates=weighed)

    def effects(self, found: Findings) -> list[Effect]:
        s, h = self.setup, self.held
        known = servo_regression.effects(h, s.place, found, self.columns, self.phase, s)
        if h.torqued is not None:
            known.append(TORQUER_SCALE.effect(s, found.error(-h.torqued)))
        return [*known, *s.supplies.effects(found, self._by_supplies(), self._gravity(), (h.t_start + h.t_end) / 2.0)]

    def _gravity(self) -> Array:
        """Return the means of (X, Y, Z) over the windows (n, 3)."""
        return servo_regression.design(self.held, self.setup.place, ("D_I", "D_O", "D_S"))

    def _by_supplies(self) -> dict[str, Array]:
        """Return what Supplies.effects asks for: theta' + omega_E = (omega_d + k i)/(1 + f)."""
        turned = servo_regression.drift_rate(replace(self.held, torqued=None), self.setup.place)
        torque = np.zeros_like(turned) if self.held.torqued is None else self.held.torqued
        return {"frequency": -turned, "drift": np.ones_like(turned), "torque": torque}

    def mine(self, phase: int) -> NDArray[np.bool_]:
        """Return the rows (n,) of a phase."""
        return np.equal(self.phase, phase)

    def dwell(self, phase: int) -> Group:
        """Return the windows of a phase against the time in it."""
        h, mine = self.held, self.mine(phase)
        middle = (h.t_start + h.t_end) / 2.0
        return Group(self.setup.labels[phase], mine, middle[mine] - h.t_start[mine][0], "time in the dwell", "s")

    def composites(self, d: Array) -> dict[str, composite.Composite | str]:
        """Return the statistics of each phase of drift rates (n,) less what goes with the angle, or why it has none."""
        found: dict[str, composite.Composite | str] = {}
        for p in self.setup.labels:
            mine = self.mine(p)
            rates, times = d[mine], (self.held.t_start[mine], self.held.t_end[mine])
            earth = self.setup.earth(self.held.axes[mine][0])
            wrong = composite.problems(rates, *times, earth)
            found[self.setup.name(p)] = "; ".join(wrong) if wrong else composite.composite(rates, *times, earth)
        return found

    @staticmethod
    def composite_tables(statistics: Mapping[str, composite.Composite | str]) -> list[Table]:
        return composite.tables(statistics, DPH, "°/h")

    def derived(self, found: Findings) -> Findings:
        """Return the fit in the names of the gyro."""
        return channels.in_channel(found, self.setup.channel)

    def named(self, reasons: Iterable[Reason]) -> list[Reason]:
        """Return reasons with the coefficients in the names of the gyro."""
        return [replace(r, text=channels.words(r.text, self.setup.channel)) for r in reasons]

    def equation(self, names: tuple[str, ...]) -> str:
        """Return the measurement equation with the terms ``names``, Typst math."""
        channel = self.setup.channel
        left = f'dot(theta) + omega_"E,{channel or "x"}" = omega_d, quad omega_d = '
        return channels.typst(channel, left, names) if channel else drift_terms.equation(left, names)

    def locked_tables(self) -> list[Table]:
        """Return what the torquer of the locked axis read in each phase; none for a floated gyro."""
        c, k = self.setup.channel, self.setup.k_locked
        if not c or "locked" not in self.of_held:
            return []
        rows: list[list[Any]] = []
        for p, label in self.setup.labels.items():
            i = np.asarray(self.of_held["locked"], dtype=float)[self.mine(p)]
            rate = [float(i.mean()) * k / DPH, float(np.ptp(i)) * k / DPH] if k else [None, None]
            rows.append([label, p, i.size, float(i.mean()) * 1e3, *rate])
        other = "y" if c == "x" else "x"
        caption = (
            f"Current of the torquer about {c}, which nulls u_{other}; its rate k i is the inertial rate of the {other}"
            " axis less its drift, and no unknown of the fit"
        )
        head = ["attitude", "phase", "windows", "mean current / mA", "rate / (°/h)", "range of the rate / (°/h)"]
        return [Table("locked", f"The locked {other} axis", caption, head, rows)]

    @classmethod
    def from_record(cls, record: Record) -> DriftTestResult:
        """Return what a record says; a long one has a table of its noise coefficients."""
        result = super().from_record(record)
        return replace(result, tables=[*result.tables, *noise_coefficients_table(result, record, residual=True)])
