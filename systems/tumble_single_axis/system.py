"""Single-axis tumble of a floated gyro in torque rebalance, as a co-simulation that carries its own plan."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench import drift, frames, units
from gyrobench.record.record import Record
from gyrobench.result import DriftTestResult, Specification
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import MeasuredData, Option, Slot, System, Windows

from . import measured

TURN = 2.0 * math.pi
DEG = math.pi / 180.0
STEP_MAX = 5e-3  # s


class TumbleSingleAxis(System):
    """The table axis lies along the pole and turns at ten times Earth rate against the Earth; the input axis is
    perpendicular to it, so that neither Earth rate nor table rate enters.  Two mounts (output axis along +pole and
    -pole) and two dwells with the output axis vertical give nine drift coefficients.

    [TEST-TUMBLE1-SDF; Hu 1981, eq. 3-12..3-21]
    """

    title = "Single-axis tumble test"
    spec = ("TEST-TUMBLE1-SDF", "GYRO-DYN-1", "GYRO-STATIC-9", "LOOP-REBALANCE")
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot("Table", "table_rate"),
        "gyro": Slot("SdfGyro", "floated_gyro"),
        "rebalance": Slot("Rebalance", "rebalance_analog"),
        "sampler": Slot("Sampler", "sampler"),
    }
    wires = """
        site.f -> table.f_local
        site.omega -> table.omega_local
        sequencer.mode -> table.mode
        sequencer.target -> table.target
        sequencer.face -> table.face
        table.omega -> gyro.omega
        table.alpha -> gyro.alpha
        table.f -> gyro.f
        rebalance.i -> gyro.i
        gyro.u -> rebalance.u
        table.angle_read -> sequencer.angle
        table.in_position -> sequencer.in_position
        rebalance.i_read -> sampler.x
        table.angle_read -> sampler.angle
        sequencer.gate -> sampler.gate
        sequencer.window -> sampler.window
        sequencer.phase -> sampler.phase
        rebalance.saturated -> sampler.flag
    """
    options = {
        "latitude": Option("45.75deg", "rad", "geographic latitude, north positive", -90 * DEG, 90 * DEG),
        "height": Option(0.0, "m", "height above the ellipsoid"),
        "gravity": Option(0.0, "m/s2", "measured gravity of the site; 0: WGS84 normal gravity"),
        "rate": Option("10 ERU", "rad/s", "size of the table rate"),
        "turns": Option(1, int, "turns in each mount and sense", 1, 20),
        "both_senses": Option(False, bool, "each mount is turned against the Earth and with it"),
        "windows": Option(72, int, "averaging windows a turn", 6, 720),
        "dwell": Option(1200.0, "s", "length of each of the two dwells"),
        "settle": Option(10.0, "s", "wait before averaging, after each move", 0.0),
        "fold": Option(False, bool, "accept that D_OO is folded into D_F, D_II and D_SS"),
        "tilt": Option(False, bool, "estimate the tilt of the input axis towards the output axis too"),
        "u_axis": Option(0.0, "rad", "standard uncertainty of the table axis against the pole", 0.0),
        "u_mount": Option(0.0, "rad", "standard uncertainty of the input axis against the fixture", 0.0),
        "u_wobble": Option(0.0, "rad", "wobble of the table axis, twice a turn, standard unc.", 0.0),
        "u_angle1": Option(0.0, "rad", "error of the angle readings once a turn, standard unc.", 0.0),
        "u_angle2": Option(0.0, "rad", "error of the angle readings twice a turn, standard unc.", 0.0),
        "u_scale_factor": Option(0.0, "1", "relative standard uncertainty of the torquer scale factor", 0.0),
        "u_nonlinearity": Option(0.0, "1", "relative torquer nonlinearity at the largest current, standard unc.", 0.0),
        "u_current": Option(0.0, "A", "standard uncertainty of the zero of the current meter", 0.0),
        "k": Option(0.0, "rad/s/A", "torquer scale factor for the reduction; 0: the parameter k of the gyro", 0.0),
        "terms": Option(9, int, "terms of the fitted model: 9 (10 terms have rank 9 at 1 g)", 3, 9),
    }
    noises = ("gyro.turn_on", "gyro.markov", "gyro.white", "gyro.pickoff", "rebalance.meter")
    measured_data = MeasuredData(measured.TEMPLATE, measured.read)
    windows = Windows.of("sampler")
    done = "sequencer.done"
    channels = ("table.angle", "gyro.u", "rebalance.i", "gyro.drift")
    channel_period = 10.0

    def faces(self) -> dict[str, Any]:
        """The four mounts: gyro axes I, O, S (rows) in the table axes at angle 0."""
        return frames.tumble_faces(self["latitude"])

    def plan(self) -> Plan:
        """Dwell, tumble, dwell, tumble; a dwell brings the table back to a whole turn."""
        rate, turns, n = abs(self["rate"]), self["turns"], self["windows"]
        at_rest = {"mode": "index", "settle": self["settle"], "dwell": self["dwell"]}
        at_rest["window"] = self["dwell"] / max(1, round(self["dwell"] / (TURN / rate / n))) if rate > 0.0 else 1.0
        turning = {"mode": "rate", "settle": self["settle"], "travel": TURN * turns, "window": TURN / n}
        phases: list[Phase] = []
        angle = 0.0
        for mount, rest in (("mount 1", "static 3"), ("mount 2", "static 4")):
            phases.append(Phase(label=rest, face=rest, target=angle, **at_rest))
            phases.append(Phase(label=f"{mount}, against the Earth", face=mount, target=-rate, **turning))
            if self["both_senses"]:
                phases.append(Phase(label=f"{mount}, with the Earth", face=mount, target=rate, **turning))
            else:
                angle -= TURN * turns
        return Plan(phases, self.faces())

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        base = frames.polar_base(self["latitude"])
        return {
            **self.plan().parameters(),
            "site.latitude": self["latitude"],
            "site.height": self["height"],
            "site.gravity": self["gravity"],
            "table.base": base,
        }

    def check(self) -> list[str]:
        from .reduction import refusals

        found = refusals(self["latitude"])
        if self["terms"] not in drift.TERM_SETS:
            found.append(f"terms = {self['terms']}: no such model; there are 3, 4, 5, 8 and 9 terms")
        if self.step > STEP_MAX:
            found.append(
                f"step = {self.step:g} s: the rebalance loop exchanges once a step and needs at most {STEP_MAX:g} s"
            )
        if not self["rate"] > 0.0:
            found.append(
                "rate = 0: the table does not turn, so no coefficient can be separated; Hu 1981 turns at 10 ERU"
            )
        return found

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
        terms = parameters.get("gyro.terms", 9)
        if terms not in drift.TERM_SETS:
            known = ", ".join(str(t) for t in drift.TERM_SETS)
            found.append(f"gyro.terms = {terms:g}: no such model; the gyro has {known} terms")
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
