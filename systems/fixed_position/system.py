"""Fixed-position test of a floated gyro in torque rebalance."""

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


class FixedPosition(System):
    """The gyro stands still in its service attitude with its rebalance loop closed: one composite drift, and by
    repeats its stability.

    [TEST-FIXED; Hu 1981, ch. 3 par. 2.2]
    """

    title = "Fixed-position test"
    spec = ("TEST-FIXED", "GYRO-DYN-1", "GYRO-STATIC-9", "LOOP-REBALANCE")
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
        "attitude": Option("E U", str, "I and O (and S) axes: E, N, U, P, Q or minus these, or a matrix of rows"),
        "dwell": Option(3600.0, "s", "time of the readings"),
        "readings": Option(30, int, "readings (averaging windows)", 8, 10000),
        "settle": Option(10.0, "s", "wait before the readings", 1.0),
        "k": Option(0.0, "rad/s/A", "torquer scale factor for the reduction; 0: the parameter k of the gyro"),
        "u_attitude": Option(0.0, "rad", "standard uncertainty of the attitude about each gyro axis", 0.0),
        "u_latitude": Option(0.0, "rad", "standard uncertainty of the latitude", 0.0),
        "u_scale_factor": Option(0.0, "1", "relative standard uncertainty of the torquer scale factor", 0.0),
        "u_current": Option(0.0, "A", "standard uncertainty of the zero of the current meter", 0.0),
    }
    noises = ("gyro.turn_on", "gyro.markov", "gyro.white", "gyro.pickoff", "rebalance.meter")
    measured_data = MeasuredData(measured.TEMPLATE, measured.read)
    windows = Windows.of("sampler")
    done = "sequencer.done"
    channels = ("gyro.u", "rebalance.i", "gyro.drift")
    channel_period = 10.0

    def plan(self) -> Plan:
        """One phase; the mount is the attitude itself, as the table stands level at angle 0."""
        try:
            face = parse(self["attitude"], self["latitude"])
        except ValueError:
            return Plan()  # check() says why
        phase = Phase(
            label="service attitude", mode="index", face="service attitude", target=0.0, settle=self["settle"],
            dwell=self["dwell"], window=self["dwell"] / self["readings"],
        )  # fmt: skip
        return Plan([phase], {"service attitude": face})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {
            **self.plan().parameters(),
            "site.latitude": self["latitude"],
            "site.height": self["height"],
            "site.gravity": self["gravity"],
            "table.base": np.eye(3),
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
        if not (self["k"] or parameters.get("gyro.k")):
            found.append("k unknown: the gyro has no parameter k; give the option k, as 17.2deg/h/mA")
        return found

    def reduce(self, record: Record, specification: Specification | None = None) -> DriftTestResult:
        from .reduction import from_record

        return from_record(record, specification)
