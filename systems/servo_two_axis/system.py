"""Two-axis servo test: a two-degree-of-freedom gyro holds a table with two axes, mount by mount."""

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
from gyrobench.system.values import parse

from . import measured, setup

DEG = math.pi / 180.0


class ServoTwoAxis(System):
    """The x pickoff drives the outer and the y pickoff the inner axis of a table, so that the plate keeps the gyro's
    x and y axes free of rotation but for the drift, while the base turns with the Earth below.  The angles of both axes
    over a day in two of the twelve mounts of Hu 1981 give nine coefficients a channel; the torquers are idle.

    [TEST-SERVO2-2DOF; Hu 1981, eq. 3-94..3-102, appendix 2]
    """

    title = "Two-axis servo test"
    spec = ("TEST-SERVO2-2DOF", "LOOP-TABLE-SERVO", "GYRO-DYN-2DOF", "GYRO-STATIC-2DOF")
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "stand": Slot(servo_stand.STAND, "fixture"),
        "wobble_x": Slot(setup.WOBBLE, "axis_wobble"),
        "outer": Slot(servo_stand.SERVO_TABLE, "table_servo"),
        "wobble_y": Slot(setup.WOBBLE, "axis_wobble"),
        "inner": Slot(servo_stand.SERVO_TABLE, "table_servo"),
        "gyro": Slot("TwoAxisGyro", "gyro_2dof"),
        "coupling": Slot(setup.COUPLING, "axis_coupling"),
        "cage_x": Slot(servo_stand.CAGE, "cage"),
        "cage_y": Slot(servo_stand.CAGE, "cage"),
        "sampler_x": Slot("Sampler", "sampler"),
        "sampler_y": Slot("Sampler", "sampler"),
    }
    wires = setup.WIRES
    open = ("outer.face",)  # left at their start values
    options = {
        "latitude": Option("45.75deg", "rad", "geographic latitude, north positive", -90 * DEG, 90 * DEG),
        "height": Option(0.0, "m", "height above the ellipsoid"),
        "gravity": Option(0.0, "m/s2", "measured gravity of the site; 0: WGS84 normal gravity"),
        "mounts": Option("2 4", str, "mounts in their order, by their numbers in Hu 1981 (1 to 12)"),
        "time": Option(86400.0, "s", "time in each mount", 1.0),
        "window": Option(600.0, "s", "length of a window", 1e-3),
        "settle": Option(10.0, "s", "wait after both loops have closed", 0.5),
        "terms": Option(9, int, "terms of the model of a channel: 8 (Hu 1981), 9 (with Dx_y, Dy_x)", 8, 9),
        "tracking": Option("2arcsec", "rad", "largest angle of the table against the gyro; 0: not judged", 0.0),
        "u_axis": Option(0.0, "rad", "standard uncertainty of each mount, about each of its axes", 0.0),
        "u_square": Option(0.0, "rad", "standard uncertainty of the right angle between the table axes", 0.0),
        "u_mount": Option(0.0, "rad", "standard uncertainty of the gyro axes against the plate", 0.0),
        "u_angle1": Option(0.0, "rad", "angle error once a turn of either axis, std. unc. of its amplitude", 0.0),
        "u_angle2": Option(0.0, "rad", "angle error twice a turn of either axis, std. unc. of its amplitude", 0.0),
        "u_wobble": Option(0.0, "rad", "wobble of either axis twice a turn, std. unc. of its amplitude", 0.0),
        "u_time": Option(0.0, "1", "relative standard uncertainty of the time base", 0.0),
    }
    noises = setup.NOISES
    measured_data = MeasuredData(measured.TEMPLATE, measured.read)
    windows = Windows("sampler_x.count", setup.COLUMNS)
    done = "sequencer.done"
    channels = ("outer.angle", "inner.angle", "gyro.u_x", "gyro.u_y", "gyro.drift_x", "gyro.drift_y")
    channel_period = 60.0

    def mounts(self) -> list[int]:
        """Numbers of the mounts; those of the default where the option is no list of them (check says so)."""
        from .refusals import numbers

        return numbers(self["mounts"]) or [2, 4]

    def earth_rate(self) -> float:
        """rad/s, as the site will have it."""
        return float(parse("site.earth_rate", self.overrides.get("site.earth_rate", frames.EARTH_RATE), "rad/s"))

    def plan(self) -> Plan:
        return setup.plan(self.mounts(), self["time"], self["window"], self["settle"])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return setup.parameters(self, self.mounts())

    def check(self) -> list[str]:
        from .refusals import option_problems

        return option_problems(self.values, self.step, self.earth_rate())

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        from .refusals import model_problems

        return model_problems(parameters, self.mounts(), self.values)

    def warnings(self) -> list[str]:
        from .refusals import cautions

        return cautions(self.mounts(), self["latitude"], self["time"], self.earth_rate(), self["terms"])

    def reduce(self, record: Record, specification: Specification | None = None) -> DriftTestResult:
        from .reduction import from_record

        return from_record(record, specification)
