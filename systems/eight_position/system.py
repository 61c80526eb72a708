"""Eight-position test of a two-degree-of-freedom gyro with two rebalance loops."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.record.record import Record
from gyrobench.result import DriftTestResult, Specification
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import MeasuredData, Option, Slot, System, Windows

from . import measured, positions, refusals

DEG = math.pi / 180.0


class EightPosition(System):
    """The gyro stands in eight attitudes, several times over; Earth rate and gravity give both torquers' scale
    factors, the constant drifts and the mass unbalances of both channels.

    [TEST-8POS; Hu 1981, eq. 3-1..3-11, Table 3-1]
    """

    title = "Eight-position test"
    spec = ("TEST-8POS", "GYRO-DYN-2DOF", "GYRO-STATIC-2DOF", "LOOP-REBALANCE")
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
    wires = """
        site.f -> table.f_local
        site.omega -> table.omega_local
        sequencer.mode -> table.mode
        sequencer.target -> table.target
        sequencer.face -> table.face
        table.omega -> gyro.omega
        table.f -> gyro.f
        gyro.u_y -> rebalance_x.u        # the torquer about x nulls the pickoff about y
        rebalance_x.i -> gyro.i_x
        gyro.u_x -> rebalance_y.u
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
        "latitude": Option("45.75deg", "rad", "geographic latitude, north positive", -90 * DEG, 90 * DEG),
        "height": Option(0.0, "m", "height above the ellipsoid"),
        "gravity": Option(0.0, "m/s2", "measured gravity of the site; 0: WGS84 normal gravity"),
        "cycles": Option(10, int, "times the eight positions are gone through", 1, 12),
        "readings": Option(10, int, "readings (averaging windows) in each position", 1, 100),
        "dwell": Option(60.0, "s", "time of the readings in each position"),
        "settle": Option(10.0, "s", "wait before the readings, after each change of position", 1.0),
        "sigma": Option(True, bool, "scatter over the cycles is asked for (at least two cycles)"),
        "terms": Option(6, int, "unknowns of a channel: 4 (Hu 1981) or 6 (with two compliance differences)", 4, 6),
        "u_attitude": Option(0.0, "rad", "standard uncertainty of each position, about each axis, independent", 0.0),
        "u_mount": Option(0.0, "rad", "standard uncertainty of the gyro in its fixture, about each axis", 0.0),
        "u_latitude": Option(0.0, "rad", "standard uncertainty of the latitude", 0.0),
        "u_current": Option(0.0, "A", "standard uncertainty of the zero of the current meters", 0.0),
        "u_nonlinearity": Option(0.0, "1", "relative torquer nonlinearity at the largest current, standard unc.", 0.0),
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
            **{n: f"sampler_x.{n}" for n in ("t_start", "t_end", "angle_start", "angle_end")},
            **{f"{n}_{c}": f"sampler_{c}.{n}" for c in "xy" for n in ("mean", "std", "flagged")},
            "n": "sampler_x.n",
        },
    )
    done = "sequencer.done"
    channels = ("gyro.u_x", "gyro.u_y", "rebalance_x.i", "rebalance_y.i", "gyro.drift_x", "gyro.drift_y")
    channel_period = 10.0

    def plan(self) -> Plan:
        """The eight positions, ``cycles`` times; the table does not turn, the mount changes."""
        faces = {positions.NAMES[n]: a for n, a in positions.ATTITUDES.items()}
        readings = {"settle": self["settle"], "dwell": self["dwell"], "window": self["dwell"] / self["readings"]}
        phases = [
            Phase(label=f"cycle {c}, {name}", mode="index", face=name, target=0.0, **readings)
            for c in range(1, self["cycles"] + 1)
            for name in faces
        ]
        return Plan(phases, faces)

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
        base = np.asarray(parameters.get("table.base", np.eye(3)), dtype=float)
        mount = np.asarray(parameters.get("gyro.mount", np.eye(3)), dtype=float)
        faces = {f"sequencer.faces, {n}": a for n, a in self.plan().faces.items()}
        given = parameters.get("sequencer.faces", [])
        faces |= {n: np.reshape(f, (3, 3)) for n, f in zip(faces, given, strict=False)}
        for name, matrix in {**faces, "gyro.mount": mount, "table.base": base}.items():
            try:
                frames.check_rotation(matrix, name)
            except ValueError as error:
                found.append(str(error))
        if found:
            return found
        a, b = parameters.get("table.tilt", [0.0, 0.0])
        tilt = frames.rotation([0.0, 1.0, 0.0], -b) @ frames.rotation([1.0, 0.0, 0.0], -a)
        actual = {n: mount @ np.asarray(f) @ tilt @ base for n, f in enumerate(faces.values(), 1)}
        return refusals.attitudes(actual)

    def warnings(self) -> list[str]:
        return refusals.near_pole(self["latitude"])

    def reduce(self, record: Record, specification: Specification | None = None) -> DriftTestResult:
        from .reduction import from_record

        return from_record(record, specification)
