"""Scale factor of a gyro's pickoff: the table steps through small angles while the float is free."""

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

from . import measured
from .refusals import drift_problems, points_problems, range_problems

DEG = math.pi / 180.0
FACE = "input axis on the table axis"
#: rows I, O, S in table axes at angle 0: input axis on the table axis, output axis on the first
ON_TABLE = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
TABLE = {"acceleration": 0.1, "index_rate": 0.1}  # of the table, if it does not say (rad/s2, rad/s)


def base(latitude: float) -> np.ndarray[Any, Any]:
    """Rows: table axes in (E, N, U) at angle 0: the pole, east x pole, east.  The axis sees no Earth rate, nor does
    the spin axis, so that the float's angle lets none in.
    """
    p = frames.pole(latitude)
    return np.array([p, np.cross(frames.E, p), frames.E])


class PickoffScaleFactor(System):
    """The gyro is open loop with its input axis along the table axis, at right angles to the pole.  The table steps
    quickly through angles within the range of the pickoff; the slope of its voltage is the scale factor.

    [TEST-PICKOFF; Hu 1981, appendix 1 of chapter 3]
    """

    title = "Pickoff scale factor"
    spec = ("TEST-PICKOFF", "GYRO-DYN-1")
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
        "range": Option("20arcmin", "rad", "the table goes from -range to +range", 0.0),
        "points": Option(11, int, "angles", 2, 49),
        "both_ways": Option(
            True, bool, "back again over the same angles, so that the drift can be told from the slope"
        ),
        "settle": Option(0.03, "s", "wait before averaging, at each angle", 0.0),
        "dwell": Option(0.1, "s", "time averaged at each angle"),
        "drift": Option("2deg/h", "rad/s", "largest drift to be expected of the gyro", 0.0),
        "gain": Option(
            0.0, "1", "angle of the float per angle of the case, H/C; 0: from the parameters of the gyro", 0.0
        ),
        "u_gain": Option(0.0, "1", "relative standard uncertainty of that gain", 0.0),
        "u_angle": Option(0.0, "1", "relative standard uncertainty of the angle scale of the table", 0.0),
        "u_voltage": Option(0.0, "1", "relative standard uncertainty of the voltmeter", 0.0),
    }
    noises = ("gyro.turn_on", "gyro.markov", "gyro.white", "gyro.pickoff")
    step = 1e-4  # s: the rate of a move of 0.2 s reaches the gyro as held values, wrong by acceleration step2/4 at most
    measured_data = MeasuredData(measured.TEMPLATE, measured.read)
    windows = Windows.of("sampler")
    open = ("gyro.i",)
    done = "sequencer.done"
    channels = ("table.angle", "gyro.u", "gyro.drift")
    channel_period = 0.01

    def angles(self) -> list[float]:
        """The angles in their order, rad; back over the same ones with both_ways."""
        there: list[float] = np.linspace(-self["range"], self["range"], self["points"]).tolist()
        return there + there[-2::-1] if self["both_ways"] else there

    def plan(self) -> Plan:
        phases = [
            Phase(label=f"{math.degrees(a) * 60.0:.4g}′", mode="index", face=FACE, target=a, settle=self["settle"],
                  dwell=self["dwell"], window=self["dwell"])
            for a in self.angles()
        ]  # fmt: skip
        return Plan(phases, {FACE: ON_TABLE})

    def duration(self, acceleration: float = TABLE["acceleration"], index_rate: float = TABLE["index_rate"]) -> float:
        """From the first reading to the last with the ways between them, s."""
        step = 2.0 * self["range"] / max(self["points"] - 1, 1)
        peak = min(index_rate, math.sqrt(step * acceleration))
        move = peak / acceleration + step / peak if peak > 0.0 else 0.0
        n = len(self.angles())
        return float(n * (self["settle"] + self["dwell"]) + (n - 1) * move)

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {
            **self.plan().parameters(),
            "site.latitude": self["latitude"],
            "site.height": self["height"],
            "site.gravity": self["gravity"],
            "table.base": base(self["latitude"]),
        }

    def check(self) -> list[str]:
        found = points_problems(self["points"])
        if not self["range"] > 0.0:
            found.append("range = 0: the table does not move")
        return found

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        found = []
        for name in ("gyro.mount", "table.base"):
            if name in parameters:
                try:
                    frames.check_rotation(parameters[name], name)
                except ValueError as error:
                    found.append(str(error))
        axis = np.asarray(parameters.get("table.base", base(self["latitude"])))[2]
        along = float(axis @ frames.pole(self["latitude"]))
        if abs(along) > DEG:
            rate = along * frames.EARTH_RATE / units.factor("deg/h")
            found.append(
                f"table.base: the axis must be at right angles to the pole (1°); it sees {rate:.3g} °/h of Earth rate"
            )
        moves = {k: float(parameters.get(f"table.{k}", v)) for k, v in TABLE.items()}
        found += drift_problems(self["drift"], self.duration(**moves), 2.0 * self["range"])
        known = [parameters.get(f"gyro.{n}") for n in ("u_max", "K_sg", "H", "C")]
        if None not in known:
            u_max, k_sg, h, c = (float(v) for v in known)  # type: ignore[arg-type]
            found += range_problems(self["range"], u_max / (k_sg * h / c))
        return found

    def reduce(self, record: Record, specification: Specification | None = None) -> DriftTestResult:
        from .reduction import from_record

        return from_record(record, specification)
