"""Vertical and level servo tests of a floated gyro: the gyro holds a table with its axis vertical or level."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench import frames
from gyrobench.record.record import Record
from gyrobench.result import DriftTestResult, Specification
from gyrobench.system.families import servo_stand
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Plan
from gyrobench.system.system import MeasuredData, Option, Slot, System, Windows

from . import measured

DEG = math.pi / 180.0
THREE = "x down; x up; x east, z down"
SIX = "x down; x up; x east, y up; x east, y down; x east, z up; x east, z down"
#: words for sets of attitudes
SETS = {
    "three": THREE,
    "six": SIX,
    "vertical": "; ".join(servo_stand.VERTICAL),
    "level": "; ".join(servo_stand.LEVEL),
    "all": "; ".join((*servo_stand.VERTICAL, *servo_stand.LEVEL)),
}


class ServoVerticalLevel(System):
    """The gyro holds the table with the input axis down or up (class 1) or level (class 2); the table rate less the
    Earth's is the drift, and attitudes compared give its coefficients: R, U_z, U_x by the three-term route.

    [TEST-SERVO-VERT, TEST-SERVO-LEVEL; Hu 1981, eq. 3-60..3-83]
    """

    title = "Vertical and level servo test"
    spec = ("TEST-SERVO-VERT", "TEST-SERVO-LEVEL", "TEST-COMPOSITE", "LOOP-TABLE-SERVO", "GYRO-DYN-1", "GYRO-STATIC-9")
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
        "attitudes": Option("six", str, "three, six, vertical, level, all, or names separated by semicolons"),
        "cycles": Option(2, int, "times the attitudes are gone through", 1, 12),
        "dwell": Option(600.0, "s", "time in each attitude", 1e-3),
        "windows": Option(10, int, "windows in each dwell", 1, 200),
        "settle": Option(10.0, "s", "wait after the loop has closed", 0.5),
        "tracking": Option("2arcsec", "rad", "largest angle of the table against the gyro; 0: not judged", 0.0),
        "u_axis": Option(0.0, "rad", "standard uncertainty of the table axis, about each axis, each phase", 0.0),
        "u_mount": Option(0.0, "rad", "standard uncertainty of the input axis against the table axis", 0.0),
        "u_unbalance": Option(0.0, "rad", "angle by unbalance of the table at 1 g over the stiffness, std. unc.", 0.0),
        "u_time": Option(0.0, "1", "relative standard uncertainty of the time base", 0.0),
    }
    noises = servo_stand.NOISES
    measured_data = MeasuredData(measured.TEMPLATE, measured.read)
    windows = Windows.of("sampler")
    done = "sequencer.done"
    channels = ("table.angle", "gyro.u", "gyro.drift")
    channel_period = 10.0

    def attitudes(self) -> list[str]:
        """Those of one cycle, in their order."""
        text = SETS.get(self["attitudes"], self["attitudes"])
        return [name.strip() for name in text.split(";") if name.strip()]

    def plan(self) -> Plan:
        """Each dwell begins so that what the Earth turns the table is half before and half after angle 0."""
        holds = []
        common = {"settle": self["settle"], "dwell": self["dwell"], "window": self["dwell"] / self["windows"]}
        for name in self.attitudes() * self["cycles"]:
            start = 0.0
            if name in servo_stand.LEVEL:
                half = self["settle"] + self["dwell"] / 2.0
                start = self.earth(name) * half
            holds.append(servo_stand.Hold(name, start=start, **common))
        return servo_stand.plan([h for h in holds if h.attitude in servo_stand.ATTITUDES])

    def earth(self, name: str) -> float:
        """Earth rate along the input axis, rad/s."""
        local = frames.earth_rate_local(self["latitude"])
        return float((servo_stand.attitude(name, self["latitude"]) @ local)[0])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return servo_stand.parameters(self)

    def check(self) -> list[str]:
        from .refusals import option_problems

        names = self.attitudes()
        known = {n: self.earth(n) for n in names if n in servo_stand.LEVEL}
        return option_problems(names, known, self["settle"] + self["dwell"])

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        return servo_stand.problems(parameters, self.plan())

    def warnings(self) -> list[str]:
        from .refusals import unseen

        return unseen(self.attitudes())

    def reduce(self, record: Record, specification: Specification | None = None) -> DriftTestResult:
        from .reduction import from_record

        return from_record(record, specification)
