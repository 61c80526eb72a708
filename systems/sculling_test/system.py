"""Sculling test of a strapdown unit: what increments and algorithm make of a vibration in phase with an angle."""

from __future__ import annotations

from typing import Any

import numpy as np

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families import strapdown_motion
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SITE, type_b
from gyrobench.system.families.table_test import sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, Windows

from . import sources
from .measured import MEASURED

FORCES = "specific force that the accelerometers x, y, z read"
TABLE = strapdown_motion.motion_table(
    "ScullingTable",
    "table that rocks about one horizontal axis and shakes along the other: rates and forces of the case, attitude",
    inp("angle_wanted", "", "amplitude of the angle, rad"),
)
IMU = Socket(
    "StrapdownUnit",
    "three gyros and three accelerometers: inertial rate and specific force in, readings out",
    (*strapdown_motion.UNIT, out("f_read", "m/s2", FORCES, 3)),
)
BOTH_INCREMENTS = Socket(
    "Increments",
    "rates and specific force in, angle and velocity increments at the output rate of the unit out",
    (
        *strapdown_motion.INCREMENTS,
        inp("f_read", "m/s2", FORCES, 3),
        out("dvelocity", "m/s", "velocity increments of the last output", 3),
    ),
)
USER_OF_VELOCITY = Socket(
    "StrapdownVelocity",
    "velocity from angle and velocity increments: by how much it changes beyond gravity",
    (
        *strapdown_motion.USER,
        inp("dvelocity", "m/s", "velocity increments", 3),
        inp("f_local", "m/s2", "specific force at rest", 3),
        out("acceleration", "m/s2", "change of the velocity over the step, by the step, table axes", 3),
    ),
)


class ScullingTest(strapdown_motion.StrapdownMotion):
    """A table rocks a strapdown unit about one horizontal axis and shakes it along the other, in phase, at one
    frequency after another.  The case stays where it was, the velocity that its user computes does not: its change
    along the vertical against that at rest shows what filters, output rate, sculling terms and lever arms cost him.

    [TEST-SCULLING; Savage 1998b, Roscoe 2001]
    """

    title = "Sculling test of a strapdown unit"
    spec = ("TEST-SCULLING", "TEST-CONING")
    kind, amplitude, updated = "axis of the drift vertical", "angle", "velocity"
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot(TABLE, "table_sculling"),
        "imu": Slot(IMU, "imu"),
        "increments": Slot(BOTH_INCREMENTS, "angle_increments"),
        "user": Slot(USER_OF_VELOCITY, "strapdown_attitude"),
        "sampler": Slot("Sampler", "sampler"),
    }
    wires = f"""
        site -> table: f=f_local omega=omega_local
        sequencer -> table: phase target=frequency_wanted target_y=angle_wanted
        table -> sequencer: angle in_position
        table -> imu: omega f
        imu -> increments: rate f_read
        increments -> user: dtheta dvelocity number
        table -> user: attitude closing=align
        site -> user: omega=omega_local f=f_local
        user.acceleration[3] -> sampler.x
        {sampled("sampler", "table: angle")}
    """
    options = (
        SITE
        | {
            "axis": Option("z", str, "axis of the case along the vertical: x, y or z"),
            "angle": Option("0.5deg", "rad", "amplitude of the angle, about the axis after it", 1e-6, 0.5),
            "vibration": Option(5.0, "m/s2", "amplitude of the vibration along the third axis", sets="table.vibration"),
            "frequencies": Option("5 10 20 40", str, "of both, Hz"),
            "bandwidth": Option("200Hz", "Hz", "3 dB of the filter of the gyros; 0: none", 0.0,
                                sets="increments.bandwidth"),
            "acc_bandwidth": Option("100Hz", "Hz", "3 dB of that of the accelerometers; 0: none", 0.0,
                                    sets="increments.acc_bandwidth"),
            "sculling": Option(True, bool, "its velocity increments have sculling", sets="increments.sculling"),
            "size": Option(0.0, "m", "height of the third axis' accelerometer above that of the vertical"),
        }
        | strapdown_motion.GONE_THROUGH
        | NUISANCES
        | CORRECTIONS
        | type_b("time", "gravity", sources)
    )  # fmt: skip
    noises = tuple(f"imu.{a}_{n}" for a in strapdown_motion.AXES for n in ("gyro", "gyro_bias", "acc", "acc_bias"))
    measured_data = MEASURED
    windows = Windows.of("sampler", "t_start t_end n", acceleration="sampler.mean")
    channels = ("sampler.mean",)

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        face = strapdown_motion.FACES.get(self["axis"], np.eye(3))
        levers = self["size"] * np.outer(face[:, 1], face[:, 2])
        return {
            **self.plan().parameters(),
            **self.owned(),
            "table.ramp": strapdown_motion.RAMP,
            "table.face": face.tolist(),
            "table.levers": levers.tolist(),
            "user.face": face.tolist(),
            "sampler.integrated?": 1,
        }

    def warnings(self) -> list[str]:
        if self["sculling"] and self["samples"] == 2:
            return ["sculling and samples = 2: the sculling within the increments is computed twice"]
        return []
