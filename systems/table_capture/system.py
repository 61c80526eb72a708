"""Capture of a servo table: from a pickoff offset of degrees to null, within a required time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench.system.families.option_groups import VERTICAL_AXIS
from gyrobench.system.families.servo_channel import gyro_on_table
from gyrobench.system.families.servo_test import GYRO_SERVO
from gyrobench.system.families.table_test import FACE, ON_TABLE, SDF_NOISES, TABLE
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot, System

TAU = {1: 4e-4, 2: 1e-3}  # s, of the gyro for which a network is made
LAWS = ("speed-limited", "time-optimal")  # values of table.capture_law
MOVE = 0.2  # rad/s and rad/s2 of the table while it sets the offset
PAUSE = 0.2  # s before servo mode


class TableCapture(System):
    """The table turns under its gyro by an angle, so that the float stands off null; then servo mode begins.

        capture:  M = clip(-k_p u, +-k_d v_lim) - k_d w        until u and w stay near zero, then the fine loop

    With law = time-optimal the rate wanted is that from which the motor can just brake, up to the range of the pickoff.
    capture = false closes the fine loop at once: far from null it is beyond its linear range, torque_max / K_T, and as
    it is conditionally stable, the limit of the motor makes it unstable.

    [CTRL-CAPTURE; Hu 1981, sections 5.5 (one-1), 6.1 (item 6)]
    """

    title = "Capture of a servo table"
    spec = ("CTRL-CAPTURE", "TABLE-SERVO")
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot("ServoTable", "table_servo"),
        "gyro": Slot("SdfGyro", "floated_gyro"),
    }
    wires = TABLE + GYRO_SERVO
    open = ("gyro.i",)
    options = {
        "offset": Option("2deg", "rad", "angle of the float from null when servo mode begins"),
        "limit": Option("5s", "s", "longest time to null that is allowed", 0.1, 1000.0),
        "null": Option("1arcsec", "rad", "null: the table angle against the gyro stays within it"),
        "capture": Option(True, bool, "capture first; false: the fine loop immediately", sets="table.capture"),
        "capture_rate": Option(50.0, "rad/s", "natural frequency while capturing; friction holds the table off null by "
                               "friction / (J capture_rate2)", 1.0, sets="table.capture_rate"),
        "law": Option(LAWS[0], str, f"how the table returns: {' or '.join(LAWS)}"),
        "friction": Option("1400g.cm", "N.m", "Coulomb friction on the table axis", 0.0, sets="table.friction"),
        "range": Option("0.5deg", "rad", "range of the pickoff, of the float angle"),
        "J": Option(2.56, "kg.m2", "inertia of table and load", sets="table.J"),
        "H": Option(0.04, "N.m.s", "spin angular momentum of the gyro", sets="gyro.H"),
        "C": Option(0.03, "N.m.s/rad", "float damping", sets="gyro.C"),
        "network": Option(2, int, "1: gyro of 0.4 ms, 2: of 1 ms", 1, 2, sets="table.network"),
        **VERTICAL_AXIS,
    }  # fmt: skip
    noises = (*SDF_NOISES, "table.rumble")
    done = "sequencer.done"
    closed_loop = True
    step = 1e-4
    channel_period = 1e-3
    channels = (
        "sequencer.phase", "sequencer.gate", "table.angle", "table.omega[1]", "table.in_position", "table.saturated",
        "gyro.b", "gyro.u", "gyro.saturated",
    )  # fmt: skip
    bodies = """
        table: base table.base, x table.tilt[1], y table.tilt[2], z table.angle
        instrument: table, faces sequencer
    """
    shown = ("gyro.b", "table.omega", "table.in_position", "table.saturated gyro.saturated")

    def turn(self) -> float:
        """Return the angle of the table that leaves the float at the offset, rad."""
        return float(self["offset"] * self["C"] / self["H"])

    def plan(self) -> Plan:
        if not self["H"]:
            return Plan()  # check() says why
        hold = 1.2 * self["limit"]
        phases = [
            Phase("offset", "index", FACE, target=self.turn(), settle=0.5 * PAUSE, dwell=0.5 * PAUSE,
                  window=0.5 * PAUSE),
            Phase("servo", "servo", FACE, dwell=hold, window=hold),
        ]  # fmt: skip
        return Plan(phases, {FACE: ON_TABLE})

    @property
    def stop(self) -> float:  # type: ignore[override]
        """Return where the run ends if the fine loop is never closed, s."""
        way = abs(self.turn())
        return float(2.0 * math.sqrt(way / MOVE) + way / MOVE + PAUSE + 2.0 * self["limit"])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        inertia = parts.given("gyro.J", TAU[self["network"]] * parts.given("gyro.C", self["C"]))
        told = gyro_on_table(parts) | {"table.H_g": self["H"], "table.C_g": self["C"], "table.J_g": inertia}
        return {
            **self.plan().parameters(),
            **self.owned(),
            **told,
            **({"table.capture_law": 1} if self["law"] == LAWS[1] else {}),
            "gyro.J": inertia,
            "gyro.u_max": self["range"] * parts["gyro.K_sg"],
            "table.acceleration": MOVE,
            "table.index_rate": MOVE,
        }

    def check(self) -> list[str]:
        unknown = [] if self["law"] in LAWS else [f"law = {self['law']}: must be {' or '.join(LAWS)}"]
        return unknown + [
            f"{n} = {self[n]:g} {self.options[n].unit}: must be > 0"
            for n in ("offset", "null", "range", "J", "H", "C")
            if not self[n] > 0.0
        ]

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        stop = float(parameters.get("gyro.stop", 0.0))
        if 0.0 < stop <= self["offset"]:
            return [f"offset = {self['offset']:.4g} rad: the stop of the float is at {stop:.4g} rad"]
        return []

    def warnings(self) -> list[str]:
        if self["capture"]:
            return []
        return ["capture = false: far from null the fine loop is beyond its linear range; it will hardly settle"]
