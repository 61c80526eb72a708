"""Two-axis tumble of a floated gyro in torque rebalance: nine coefficients in one run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench import frames, units
from gyrobench.record.record import Record
from gyrobench.result import DriftTestResult, Specification
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import MeasuredData, Option, Slot, System, Windows

from . import geometry, measured

DEG = math.pi / 180.0
STEP_MAX = 5e-3  # s


class TumbleTwoAxis(System):
    """The gyro goes from position to position on a table with two axes: outer axis along the pole, inner axis along the
    input axis, their angles in the ratio m:n.  The input axis stays perpendicular to the pole, so that the Earth rate
    never enters; the inner rate does, hence the table stands still while the current is averaged.

    [TEST-TUMBLE2-SDF; Hu 1981, eq. 3-47..3-53]
    """

    title = "Two-axis tumble test"
    spec = ("TEST-TUMBLE2-SDF", "GYRO-DYN-1", "GYRO-STATIC-9", "LOOP-REBALANCE")
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot("TwoAxisTable", "table_two_axis"),
        "gyro": Slot("SdfGyro", "floated_gyro"),
        "rebalance": Slot("Rebalance", "rebalance_analog"),
        "sampler": Slot("Sampler", "sampler"),
        "sampler_inner": Slot("Sampler", "sampler"),
    }
    # sampler_inner averages the same current; it is there for the inner angle at both ends of a window
    wires = """
        site.f -> table.f_local
        site.omega -> table.omega_local
        sequencer.mode -> table.mode_x
        sequencer.mode -> table.mode_y
        sequencer.target -> table.target_x
        sequencer.target_y -> table.target_y
        sequencer.face -> table.face
        table.omega -> gyro.omega
        table.alpha -> gyro.alpha
        table.f -> gyro.f
        rebalance.i -> gyro.i
        gyro.u -> rebalance.u
        table.angle_x_read -> sequencer.angle
        table.in_position -> sequencer.in_position
        rebalance.i_read -> sampler.x
        table.angle_x_read -> sampler.angle
        sequencer.gate -> sampler.gate
        sequencer.window -> sampler.window
        sequencer.phase -> sampler.phase
        rebalance.saturated -> sampler.flag
        rebalance.i_read -> sampler_inner.x
        table.angle_y_read -> sampler_inner.angle
        sequencer.gate -> sampler_inner.gate
        sequencer.window -> sampler_inner.window
        sequencer.phase -> sampler_inner.phase
    """
    options = {
        "latitude": Option("45.75deg", "rad", "geographic latitude, north positive", -90 * DEG, 90 * DEG),
        "height": Option(0.0, "m", "height above the ellipsoid"),
        "gravity": Option(0.0, "m/s2", "measured gravity of the site; 0: WGS84 normal gravity"),
        "m": Option(5, int, "outer angle of a position in units of theta", 1, 20),
        "n": Option(1, int, "inner angle of a position in units of theta", 1, 20),
        "positions": Option(36, int, "equally spaced positions of a cycle", 1, 99),
        "cycles": Option(1, int, "how often the positions are gone through (99 phases in all)", 1, 9),
        "dwell": Option(120.0, "s", "averaging time in each position"),
        "windows": Option(2, int, "averages a position", 1, 100),
        "settle": Option(10.0, "s", "wait before averaging, after each move", 0.0),
        "inner_rate": Option(0.003, "rad/s", "rate of the inner axis between positions; the torquer must follow it"),
        "harmonic": Option(False, bool, "insist on the harmonic route beside least squares"),
        "fold": Option(False, bool, "accept that D_OO is folded into D_F, D_II and D_SS"),
        "u_axis": Option(0.0, "rad", "standard uncertainty of the outer axis against the pole", 0.0),
        "u_square": Option(0.0, "rad", "standard uncertainty of the right angle between the table axes", 0.0),
        "u_mount": Option(0.0, "rad", "standard uncertainty of the gyro axes against the plate", 0.0),
        "u_scale_factor": Option(0.0, "1", "relative standard uncertainty of the torquer scale factor", 0.0),
        "u_nonlinearity": Option(0.0, "1", "relative torquer nonlinearity at the largest current, standard unc.", 0.0),
        "u_current": Option(0.0, "A", "standard uncertainty of the zero of the current meter", 0.0),
        "k": Option(0.0, "rad/s/A", "torquer scale factor for the reduction; 0: the parameter k of the gyro", 0.0),
    }
    noises = ("gyro.turn_on", "gyro.markov", "gyro.white", "gyro.pickoff", "rebalance.meter")
    measured_data = MeasuredData(measured.TEMPLATE, measured.read)
    windows = Windows(
        "sampler.count",
        {
            "phase": "sampler.window_phase",
            **{c: f"sampler.{c}" for c in ("t_start", "t_end", "mean", "std", "n", "flagged")},
            **{f"outer_{e}": f"sampler.angle_{e}" for e in ("start", "end")},
            **{f"inner_{e}": f"sampler_inner.angle_{e}" for e in ("start", "end")},
        },
    )
    done = "sequencer.done"
    channels = ("table.angle_x", "table.angle_y", "gyro.u", "rebalance.i", "gyro.drift")
    channel_period = 10.0

    def plan(self) -> Plan:
        """The positions in order, every one with both angles; angles are counted on through the turns."""
        phases = []
        each = {"mode": "index", "face": "gyro", "settle": self["settle"], "dwell": self["dwell"]}
        each["window"] = self["dwell"] / self["windows"]
        for j in range(self["positions"] * self["cycles"]):
            theta = 2.0 * math.pi * j / self["positions"]
            label = f"θ = {math.degrees(theta):.6g}°"
            phases.append(Phase(label=label, target=self["m"] * theta, target_y=self["n"] * theta, **each))
        return Plan(phases, {"gyro": geometry.FACE.tolist()})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {
            **self.plan().parameters(),
            "site.latitude": self["latitude"],
            "site.height": self["height"],
            "site.gravity": self["gravity"],
            "table.base": geometry.base(self["latitude"]),
            "table.index_rate[2]": self["inner_rate"],
        }

    def check(self) -> list[str]:
        values = (self["latitude"], self["m"], self["n"], self["positions"])
        found = geometry.refusals(*values)
        if self["harmonic"] and not found:
            found = geometry.harmonic_problems(*values)
        if self.step > STEP_MAX:
            found.append(
                f"step = {self.step:g} s: the rebalance loop exchanges once a step and needs at most {STEP_MAX:g} s"
            )
        if not self["inner_rate"] > 0.0:
            found.append("inner_rate = 0: the inner axis would never arrive")
        return found

    def warnings(self) -> list[str]:
        from .reduction import cautions

        return cautions(self["latitude"], self["m"], self["n"], self["positions"])

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        found = []
        for n in ("gyro.mount", "table.base"):
            if n in parameters:
                try:
                    frames.check_rotation(parameters[n], n)
                except ValueError as error:
                    found.append(str(error))
        reach = parameters.get("gyro.k", math.inf) * parameters.get("rebalance.i_max", math.inf)
        if self["inner_rate"] > 0.9 * reach:
            found.append(
                f"inner_rate = {self['inner_rate']:g} rad/s: the inner axis is the input axis, and the torquer follows "
                f"up to k i_max = {reach:.4g} rad/s; at most 0.9 of that"
            )
        square = parameters.get("gyro.D_OO", 0.0) / units.factor("deg/h")
        if square and not self["fold"]:
            found.append(
                f"gyro.D_OO = {square:g} deg/h/g2: at constant |g| it cannot be told from D_F, D_II and D_SS; set "
                "fold=true to accept the combinations D_F + γ² D_OO, D_II − D_OO, D_SS − D_OO"
            )
        return found

    def reduce(self, record: Record, specification: Specification | None = None) -> DriftTestResult:
        from .reduction import from_record

        return from_record(record, specification)
