"""Polar servo test of a floated gyro: the gyro holds a table whose axis lies along the pole, a day in each mount."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench.record.record import Record
from gyrobench.result import DriftTestResult, Specification
from gyrobench.system.families import servo_stand
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Plan
from gyrobench.system.system import MeasuredData, Option, Slot, System, Windows

from . import measured

TURN = 2.0 * math.pi
DEG = math.pi / 180.0


class ServoPolar(System):
    """The input axis lies along the pole (mount S: -pole, N: +pole) and gravity goes round the gyro once a day; the
    table rate gives seven coefficients and R + K_zx g2 sin2(latitude), two dwells with x east separate these.  The same
    record tells the random drift and its correlation, and turns compared tell the long-term stability.

    [TEST-SERVO-POLAR, TEST-COMPOSITE; Hu 1981, eq. 3-84..3-93, Tables 3-2, 3-3]
    """

    title = "Polar servo test"
    spec = ("TEST-SERVO-POLAR", "TEST-COMPOSITE", "LOOP-TABLE-SERVO", "GYRO-DYN-1", "GYRO-STATIC-9")
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "stand": Slot(servo_stand.STAND, "fixture"),
        "table": Slot(servo_stand.SERVO_TABLE, "table_servo"),
        "gyro": Slot("SdfGyro", "floated_gyro"),
        "cage": Slot(servo_stand.CAGE, "cage"),
        "sampler": Slot("Sampler", "sampler"),
    }
    wires = servo_stand.WIRES
    options = {
        "latitude": Option("45.75deg", "rad", "geographic latitude, north positive", -90 * DEG, 90 * DEG),
        "height": Option(0.0, "m", "height above the ellipsoid"),
        "gravity": Option(0.0, "m/s2", "measured gravity of the site; 0: WGS84 normal gravity"),
        "mounts": Option("S N", str, "mounts in their order: S (input axis against the pole), N (along it)"),
        "turns": Option(1, int, "turns in each mount, at least", 1, 60),
        "time": Option(86400.0, "s", "time in each mount, at least", 1.0),
        "window": Option(600.0, "s", "length of a window", 1e-3),
        "dwell": Option(3600.0, "s", "length of each of the two dwells with the input axis east"),
        "settle": Option(10.0, "s", "wait after the loop has closed", 0.5),
        "route": Option("dwells", str, "how R and K_zx are told apart: dwells, equal (K_zx = K_xz) or combination"),
        "terms": Option(9, int, "terms of the model: 4 (low grades), 8 (Hu 1981), 9 (with D_O)", 4, 9),
        "tracking": Option("2arcsec", "rad", "largest angle of the table against the gyro; 0: not judged", 0.0),
        "u_axis": Option(0.0, "rad", "standard uncertainty of the table axis, about each axis, each phase", 0.0),
        "u_mount": Option(0.0, "rad", "standard uncertainty of the input axis against the table axis", 0.0),
        "u_wobble": Option(0.0, "rad", "wobble of the table axis twice a turn, std. unc. of its amplitude", 0.0),
        "u_angle1": Option(0.0, "rad", "angle error once a turn, standard uncertainty of its amplitude", 0.0),
        "u_angle2": Option(0.0, "rad", "angle error twice a turn, standard uncertainty of its amplitude", 0.0),
        "u_unbalance": Option(0.0, "rad", "angle by unbalance of the table at 1 g over the stiffness, std. unc.", 0.0),
        "u_time": Option(0.0, "1", "relative standard uncertainty of the time base", 0.0),
    }
    noises = servo_stand.NOISES
    measured_data = MeasuredData(measured.TEMPLATE, measured.read)
    windows = Windows.of("sampler")
    done = "sequencer.done"
    channels = ("table.angle", "gyro.u", "gyro.drift")
    channel_period = 60.0

    def mounts(self) -> list[str]:
        """Attitudes of the turns, in their order."""
        return [f"polar {m}" for m in self["mounts"].replace(",", " ").split()]

    def plan(self) -> Plan:
        """Two dwells (route dwells), then each mount; every phase begins at a whole turn."""
        common = {"settle": self["settle"]}
        holds = []
        if self["route"] == "dwells":
            window = self["dwell"] / max(1, round(self["dwell"] / self["window"]))
            holds = [servo_stand.Hold(f"x east, y {w}", self["dwell"], window, **common) for w in ("up", "down")]
        angle = 0.0
        for mount in self.mounts():
            travel = TURN * self["turns"]
            whole = travel * (1.0 + 1.2 * self["window"] / self["time"])  # the last window may be cut off
            holds.append(servo_stand.Hold(mount, self["time"], self["window"], start=angle, travel=whole, **common))
            angle += travel if mount == "polar S" else -travel
        return servo_stand.plan(holds)

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return servo_stand.parameters(self)

    def check(self) -> list[str]:
        from .refusals import option_problems

        return option_problems(self.values)

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        from .refusals import model_problems

        return servo_stand.problems(parameters, self.plan()) + model_problems(parameters, self["terms"])

    def warnings(self) -> list[str]:
        from .refusals import unseen

        return unseen(self["route"], self.mounts(), self["terms"])

    def reduce(self, record: Record, specification: Specification | None = None) -> DriftTestResult:
        from .reduction import from_record

        return from_record(record, specification)
