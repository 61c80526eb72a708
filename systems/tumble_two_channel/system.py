"""Single-axis tumble of a two-degree-of-freedom gyro, both channels in torque rebalance."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench import frames, units
from gyrobench.record.record import Record
from gyrobench.result import DriftTestResult, Specification
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import MeasuredData, Option, Slot, System, Windows

from . import geometry, measured

TURN = 2.0 * math.pi
DEG = math.pi / 180.0
STEP_MAX = 5e-3  # s
INDEX_RATE = 3e-3  # rad/s: in a dwell's mount the y axis sees the table move; the torquer follows up to 4.2e-3 rad/s
SAMPLED = ("t_start", "t_end", "angle_start", "angle_end", "n", "flagged")


class TumbleTwoChannel(System):
    """The spin axis lies along the table axis and that along the pole; the table turns at ten times Earth rate against
    the Earth.  Both measuring axes are perpendicular to it, so that neither Earth rate nor table rate enters.  Two
    mounts (spin axis along +pole and -pole) give the eight coefficients of the simple model; with two dwells (inner
    gimbal axis vertical) nine coefficients a channel.

    [TEST-TUMBLE1-2DOF-A, -B; Hu 1981, eq. 3-22..3-37]
    """

    title = "Single-axis tumble test of a two-degree-of-freedom gyro"
    spec = ("TEST-TUMBLE1-2DOF-A", "TEST-TUMBLE1-2DOF-B", "GYRO-DYN-2DOF", "GYRO-STATIC-2DOF", "LOOP-REBALANCE")
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot("Table", "table_rate"),
        "gyro": Slot("TwoAxisGyro", "gyro_2dof"),
        "rebalance_x": Slot("Rebalance", "rebalance_analog"),
        "rebalance_y": Slot("Rebalance", "rebalance_analog"),
        "sampler_x": Slot("Sampler", "sampler"),
        "sampler_y": Slot("Sampler", "sampler"),
    }
    # the x pickoff pairs with the torquer about y, and the y pickoff with the torquer about x
    wires = """
        site.f -> table.f_local
        site.omega -> table.omega_local
        sequencer.mode -> table.mode
        sequencer.target -> table.target
        sequencer.face -> table.face
        table.omega -> gyro.omega
        table.f -> gyro.f
        gyro.u_y -> rebalance_x.u
        gyro.u_x -> rebalance_y.u
        rebalance_x.i -> gyro.i_x
        rebalance_y.i -> gyro.i_y
        table.angle_read -> sequencer.angle
        table.in_position -> sequencer.in_position
        rebalance_x.i_read -> sampler_x.x
        table.angle_read -> sampler_x.angle
        sequencer.gate -> sampler_x.gate
        sequencer.window -> sampler_x.window
        sequencer.phase -> sampler_x.phase
        rebalance_x.saturated -> sampler_x.flag
        rebalance_y.i_read -> sampler_y.x
        table.angle_read -> sampler_y.angle
        sequencer.gate -> sampler_y.gate
        sequencer.window -> sampler_y.window
        sequencer.phase -> sampler_y.phase
        rebalance_y.saturated -> sampler_y.flag
    """
    options = {
        "model": Option("nine", str, "nine: nine terms a channel, two mounts and two dwells; simple: four, two mounts"),
        "latitude": Option("45.75deg", "rad", "geographic latitude, north positive", -90 * DEG, 90 * DEG),
        "height": Option(0.0, "m", "height above the ellipsoid"),
        "gravity": Option(0.0, "m/s2", "measured gravity of the site; 0: WGS84 normal gravity"),
        "rate": Option("10 ERU", "rad/s", "size of the table rate"),
        "turns": Option(1, int, "turns in each mount and sense", 1, 20),
        "both_senses": Option(False, bool, "each mount is turned against the Earth and with it"),
        "windows": Option(72, int, "averaging windows a turn", 5, 720),
        "dwell": Option(1200.0, "s", "length of each of the two dwells"),
        "settle": Option(10.0, "s", "wait before averaging, after each move", 0.0),
        "fold": Option(False, bool, "accept that Dx_yy and Dy_xx are folded into the other squares and the constant"),
        "tilt": Option(
            False, bool, "estimate the tilts of the measuring axes towards the spin axis; needs both_senses"
        ),
        "u_axis": Option(0.0, "rad", "standard uncertainty of the table axis against the pole", 0.0),
        "u_mount": Option(0.0, "rad", "standard uncertainty of the gyro axes against the fixture", 0.0),
        "u_angle1": Option(0.0, "rad", "error of the angle readings once a turn, standard unc.", 0.0),
        "u_angle2": Option(0.0, "rad", "error of the angle readings twice a turn, standard unc.", 0.0),
        "u_scale_factor": Option(0.0, "1", "relative standard uncertainty of the torquer scale factors", 0.0),
        "u_nonlinearity": Option(0.0, "1", "relative torquer nonlinearity at the largest current, standard unc.", 0.0),
        "u_current": Option(0.0, "A", "standard uncertainty of the zero of the current meters", 0.0),
        "k_x": Option(0.0, "rad/s/A", "scale factor of the torquer about x; 0: the parameter k_x of the gyro", 0.0),
        "k_y": Option(0.0, "rad/s/A", "scale factor of the torquer about y; 0: the parameter k_y of the gyro", 0.0),
    }
    noises = (
        "gyro.turn_on_x", "gyro.turn_on_y", "gyro.markov_x", "gyro.markov_y", "gyro.white_x", "gyro.white_y",
        "gyro.pickoff_x", "gyro.pickoff_y", "rebalance_x.meter", "rebalance_y.meter",
    )  # fmt: skip
    measured_data = MeasuredData(measured.TEMPLATE, measured.read)
    windows = Windows(
        "sampler_x.count",
        {
            "phase": "sampler_x.window_phase",
            **{n: f"sampler_x.{n}" for n in SAMPLED},
            "flagged_y": "sampler_y.flagged",
            **{f"{n}_{a}": f"sampler_{a}.{n}" for n in ("mean", "std") for a in "xy"},
        },
    )
    done = "sequencer.done"
    channels = ("table.angle", "gyro.u_x", "gyro.u_y", "rebalance_x.i", "rebalance_y.i", "gyro.drift_x", "gyro.drift_y")
    channel_period = 10.0

    def faces(self) -> dict[str, Any]:
        """The mounts of the model: gyro axes x, y, z (rows) in the table axes at angle 0."""
        return geometry.faces(self["model"], self["latitude"])

    def plan(self) -> Plan:
        """Dwell (nine terms only), tumble, dwell, tumble; a dwell brings the table back to a whole turn."""
        rate, turns, n = abs(self["rate"]), self["turns"], self["windows"]
        at_rest = {"mode": "index", "settle": self["settle"], "dwell": self["dwell"]}
        at_rest["window"] = self["dwell"] / max(1, round(self["dwell"] / (TURN / rate / n))) if rate > 0.0 else 1.0
        turning = {"mode": "rate", "settle": self["settle"], "travel": TURN * turns, "window": TURN / n}
        phases: list[Phase] = []
        angle = 0.0
        for mount, rest in (("mount 1", "static 3"), ("mount 2", "static 4")):
            if self["model"] == "nine":
                phases.append(Phase(label=rest, face=rest, target=angle, **at_rest))
            phases.append(Phase(label=f"{mount}, against the Earth", face=mount, target=-rate, **turning))
            if self["both_senses"]:
                phases.append(Phase(label=f"{mount}, with the Earth", face=mount, target=rate, **turning))
            else:
                angle -= TURN * turns
        return Plan(phases, self.faces())

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {
            **self.plan().parameters(),
            "site.latitude": self["latitude"],
            "site.height": self["height"],
            "site.gravity": self["gravity"],
            "table.base": frames.polar_base(self["latitude"]),
            "table.index_rate": INDEX_RATE,
        }

    def check(self) -> list[str]:
        found = geometry.refusals(self["latitude"], self["model"])
        if self.step > STEP_MAX:
            found.append(
                f"step = {self.step:g} s: the rebalance loops exchange once a step and need at most {STEP_MAX:g} s"
            )
        if not self["rate"] > 0.0:
            found.append(
                "rate = 0: the table does not turn, so no coefficient can be separated; Hu 1981 turns at 10 ERU"
            )
        if self["tilt"] and not self["both_senses"]:
            found.append(
                "tilt: at one table rate the tilt of a measuring axis towards the spin axis cannot be told from Dx_z, "
                "Dy_z; set both_senses=true"
            )
        return found

    def warnings(self) -> list[str]:
        return geometry.cautions(self["latitude"])

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        found = []
        faces = parameters.get("sequencer.faces", [])
        matrices = {
            f"sequencer.faces, {name}": np.reshape(f, (3, 3)) for name, f in zip(self.faces(), faces, strict=False)
        }
        matrices |= {n: parameters[n] for n in ("gyro.mount", "table.base") if n in parameters}
        for name, matrix in matrices.items():
            try:
                frames.check_rotation(matrix, name)
            except ValueError as error:
                found.append(str(error))
        for channel, (square, into) in geometry.FOLD.items():
            value = parameters.get(f"gyro.{square}", 0.0) / units.factor("deg/h")
            if value and self["model"] == "nine" and not self["fold"]:
                found.append(
                    f"gyro.{square} = {value:g} deg/h/g2 ({channel} channel): at constant |g| it cannot be told from "
                    f"{into[0]}, {into[1]} and {into[2]}; set fold=true to accept the combinations {into[0]} + γ² "
                    f"{square}, {into[1]} − {square}, {into[2]} − {square}"
                )
        return found

    def reduce(self, record: Record, specification: Specification | None = None) -> DriftTestResult:
        from .reduction import from_record

        return from_record(record, specification)
