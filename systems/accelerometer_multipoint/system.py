"""Multi-position test of a pendulous accelerometer on an indexing head with a horizontal axis."""

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

from . import geometry, measured

TURN = 2.0 * math.pi
DEG = math.pi / 180.0
STATIONS = 24  # of the indexing head
MOUNTS = {"both": ("a", "b"), "a": ("a",), "b": ("b",)}


class AccelerometerMultipoint(System):
    """An accelerometer stands in 4, 8, 12 or 24 equally spaced positions about a horizontal axis; gravity gives bias,
    scale factor, second and third order; two mounts give the cross terms with the output and with the pendulum axis.

    [TEST-ACC-MULTI; Hu 1981, eq. 3-38..3-46]
    """

    title = "Multi-position test of an accelerometer"
    spec = ("TEST-ACC-MULTI", "ACC-EXACT", "ACC-4PT", "ACC-MINPTS")
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot("Table", "index_head"),
        "accelerometer": Slot("Accelerometer", "accelerometer_pendulous"),
        "sampler": Slot("Sampler", "sampler"),
    }
    wires = """
        site.f -> table.f_local
        site.omega -> table.omega_local
        sequencer.mode -> table.mode
        sequencer.target -> table.target
        sequencer.face -> table.face
        table.f -> accelerometer.f
        table.angle_read -> sequencer.angle
        table.in_position -> sequencer.in_position
        accelerometer.i_read -> sampler.x
        table.angle_read -> sampler.angle
        sequencer.gate -> sampler.gate
        sequencer.window -> sampler.window
        sequencer.phase -> sampler.phase
        accelerometer.saturated -> sampler.flag
    """
    options = {
        "latitude": Option("45.75deg", "rad", "geographic latitude, north positive", -90 * DEG, 90 * DEG),
        "height": Option(0.0, "m", "height above the ellipsoid"),
        "gravity": Option(0.0, "m/s2", "measured gravity of the site; 0: WGS84 normal gravity"),
        "points": Option(24, int, "positions a turn: 4, or 7 to 24", 4, STATIONS),
        "mounts": Option("both", str, "a (gives k5), b (gives k4) or both"),
        "turns": Option(1, int, "turns in each mount", 1, 24),
        "settle": Option(2.0, "s", "wait before averaging, in each position", 0.0),
        "dwell": Option(10.0, "s", "time averaged in each position"),
        "readings": Option(1, int, "windows in which that time is recorded", 1, 100),
        "scale": Option(0.0, "m/s2/A", "scale λ for the reduction; 0: the parameter scale of the accelerometer", 0.0),
        "u_scale": Option(0.0, "1", "relative standard uncertainty of λ", 0.0),
        "u_current": Option(0.0, "A", "standard uncertainty of the zero of the current meter", 0.0),
        "u_gravity": Option(0.0, "m/s2", "standard uncertainty of gravity", 0.0),
        "u_angle": Option(0.0, "rad", "standard uncertainty of a position of the head that comes back each turn", 0.0),
    }
    noises = (
        "accelerometer.turn_on", "accelerometer.markov", "accelerometer.white", "accelerometer.meter", "table.repeat",
    )  # fmt: skip
    measured_data = MeasuredData(measured.TEMPLATE, measured.read)
    windows = Windows.of("sampler")
    done = "sequencer.done"
    channels = ("table.angle", "accelerometer.i", "accelerometer.theta")
    channel_period = 1.0

    def plan(self) -> Plan:
        """Mount a, then mount b, position after position; the head goes on through the turns and never back."""
        n, phases = self["points"], []
        station = 0
        for mount in MOUNTS.get(self["mounts"], ()):
            for k in range(n * self["turns"]):
                phases.append(
                    Phase(
                        label=f"mount {mount}, {360.0 * (k % n) / n:.4g}°",
                        mode="index",
                        face=mount,
                        target=TURN * station / n,
                        settle=self["settle"],
                        dwell=self["dwell"],
                        window=self["dwell"] / self["readings"],
                    )
                )
                station += 1
        return Plan(phases, {m: f.tolist() for m, f in geometry.FACES.items()})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {
            **self.plan().parameters(),
            "site.latitude": self["latitude"],
            "site.height": self["height"],
            "site.gravity": self["gravity"],
            "table.base": geometry.BASE,
            "table.positions": STATIONS if STATIONS % self["points"] == 0 else self["points"],
        }

    def check(self) -> list[str]:
        from .refusals import points_problems

        found = []
        if self["mounts"] not in MOUNTS:
            found.append(f"mounts = {self['mounts']}: must be a, b or both")
        return found + points_problems(self["points"], self["mounts"], self["turns"])

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        found = []
        faces = parameters.get("sequencer.faces", [])
        matrices = {
            f"sequencer.faces, mount {name}": np.reshape(f, (3, 3))
            for name, f in zip(geometry.FACES, faces, strict=False)
        }
        matrices |= {n: parameters[n] for n in ("accelerometer.mount", "table.base") if n in parameters}
        for name, matrix in matrices.items():
            try:
                frames.check_rotation(matrix, name)
            except ValueError as error:
                found.append(str(error))
        axis = np.asarray(parameters.get("table.base", geometry.BASE))[2]
        if abs(float(axis[2])) > DEG:
            found.append(
                f"table.base: the axis stands {math.degrees(math.asin(min(1.0, abs(float(axis[2]))))):.3g}° from the "
                "horizon; the test needs a horizontal axis (1°)"
            )
        if not found and "accelerometer.mount" in parameters:
            from .refusals import zero_problems

            mounts = MOUNTS[self["mounts"]]
            found += zero_problems({m: geometry.zero_angle(m, parameters["accelerometer.mount"]) for m in mounts})
        return found

    def warnings(self) -> list[str]:
        if self["points"] == 4:
            return ["Four positions: k3 is not told from k1, and the cross term from k0 and k2."]
        return []

    def reduce(self, record: Record, specification: Specification | None = None) -> DriftTestResult:
        from .reduction import from_record

        return from_record(record, specification)
