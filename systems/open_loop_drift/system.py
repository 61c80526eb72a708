"""Open-loop drift test: the case is turned by hand so that the pickoff stays about its null."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.record.record import Record
from gyrobench.reduction.drift.attitude_parser import parse
from gyrobench.result import DriftTestResult, Specification
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import MeasuredData, Option, Slot, System, Windows

from . import measured, refusals

DEG = math.pi / 180.0
MOUNT = "input axis on table axis"
ACCELERATION, RATE = 1e-3, 0.01  # rad/s2, rad/s: a gentle hand; the float sees the rate in steps, off by some a h^2


def move_time(way: float) -> float:
    """Time (s) of a move with trapezoidal rate."""
    way = abs(way)
    return 2.0 * math.sqrt(way / ACCELERATION) if way < RATE**2 / ACCELERATION else way / RATE + RATE / ACCELERATION


class OpenLoopDrift(System):
    """No loop is closed: the table turns about the gyro's input axis in small steps, a little over and a little under
    the null of the pickoff in turn; the inertial angle of the null against time is the drift.

    [TEST-OPEN; Hu 1981, ch. 3 par. 1]
    """

    title = "Open-loop drift test"
    spec = ("TEST-OPEN", "GYRO-DYN-1", "GYRO-STATIC-9")
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot("Table", "table_rate"),
        "gyro": Slot("SdfGyro", "floated_gyro"),
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
        table.angle_read -> sequencer.angle
        table.in_position -> sequencer.in_position
        gyro.u -> sampler.x
        table.angle_read -> sampler.angle
        sequencer.gate -> sampler.gate
        sequencer.window -> sampler.window
        sequencer.phase -> sampler.phase
        gyro.saturated -> sampler.flag
    """
    options = {
        "latitude": Option("45.75deg", "rad", "geographic latitude, north positive", -90 * DEG, 90 * DEG),
        "height": Option(0.0, "m", "height above the ellipsoid"),
        "gravity": Option(0.0, "m/s2", "measured gravity of the site; 0: WGS84 normal gravity"),
        "attitude": Option("E U", str, "I and O (and S) axes: E, N, U, P, Q or minus these, or a matrix of rows"),
        "pairs": Option(29, int, "steps over and under the null, two a pair, and one more", 4, 49),
        "wait": Option(60.0, "s", "time the float drifts after each step before it is read", 1.0),
        "dwell": Option(1.0, "s", "time of a reading", 0.0),
        "bracket": Option("1arcmin", "rad", "half the angle between a step over and a step under the null"),
        "follow": Option(0.0, "rad/s", "rate against inertial space at which the hand follows: the drift expected"),
        "float_gain": Option(0.0, "1", "H/C of the float; 0: from the parameters of the gyro, else 1", 0.0),
        "u_attitude": Option(0.0, "rad", "standard uncertainty of the attitude about each gyro axis", 0.0),
        "u_latitude": Option(0.0, "rad", "standard uncertainty of the latitude", 0.0),
        "u_angle": Option(0.0, "rad", "standard uncertainty of the angle turned between first and last reading", 0.0),
        "u_float_gain": Option(0.0, "1", "standard uncertainty of H/C", 0.0),
    }
    noises = ("gyro.turn_on", "gyro.markov", "gyro.white", "gyro.pickoff")
    measured_data = MeasuredData(measured.TEMPLATE, measured.read)
    windows = Windows.of("sampler")
    open = ("gyro.i",)
    done = "sequencer.done"
    channels = ("gyro.u", "gyro.drift", "table.angle")
    channel_period = 1.0

    def plan(self) -> Plan:
        """2 pairs + 1 steps; the table axis is the input axis, so the mount only names the axes."""
        try:
            C = parse(self["attitude"], self["latitude"])
        except ValueError:
            return Plan()  # check() says why
        earth = float(C[0] @ frames.earth_rate_local(self["latitude"]))
        timing = {"settle": self["wait"], "dwell": self["dwell"], "window": self["dwell"]}
        phases: list[Phase] = []
        time, at = 0.0, 0.0
        for j in range(2 * self["pairs"] + 1):
            side, sign = ("over", 1.0) if j % 2 == 0 else ("under", -1.0)
            move = 0.0
            for _ in range(3):  # the sky goes on while the table moves
                ahead = time + move + self["wait"] + self["dwell"]
                target = (self["follow"] - earth) * ahead + sign * self["bracket"]
                move = move_time(target - at)
            time, at = ahead, target
            phases.append(Phase(label=f"reading {j + 1}, {side}", mode="index", face=MOUNT, target=target, **timing))
        return Plan(phases, {MOUNT: [[0, 0, 1], [1, 0, 0], [0, 1, 0]]})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        C = parse(self["attitude"], self["latitude"])
        return {
            **self.plan().parameters(),
            "site.latitude": self["latitude"],
            "site.height": self["height"],
            "site.gravity": self["gravity"],
            "table.base": C[[1, 2, 0]],
            "table.acceleration": ACCELERATION,
            "table.index_rate": RATE,
        }

    def check(self) -> list[str]:
        return refusals.options(self)

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        found = []
        for name in ("gyro.mount", "table.base"):
            try:
                frames.check_rotation(parameters.get(name, np.eye(3)), name)
            except ValueError as error:
                found.append(str(error))
        return found + refusals.pickoff_range(self["bracket"], parameters)

    def reduce(self, record: Record, specification: Specification | None = None) -> DriftTestResult:
        from .reduction import from_record

        return from_record(record, specification)
