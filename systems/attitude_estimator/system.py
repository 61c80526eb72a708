"""Attitude of a moving vehicle by gyros, accelerometers and heading: filters that find the gyro drift too."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench.component.blocks.gyro import DEG_H
from gyrobench.system.families.loop_test import FLOWN, LoopTest, by_phase, three
from gyrobench.system.loop_plan import LoopPhase
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot
from gyrobench.units import DEG, G0

PHASES = ("rest", "rocking", "turn", "acceleration", "recovery")
AXES = ("x", "y", "z")
#: static and dynamic errors of each gyro, of the size of a floated gyro in a stiff analogue loop; the others are 0
ERRORS = {
    "D_F": -8.0 * DEG_H, "D_I": -12.0 * DEG_H, "D_O": 0.0, "D_S": 10.0 * DEG_H, "D_II": 0.0, "D_OO": 0.0, "D_SS": 0.0,
    "D_IO": 0.0, "D_OS": 0.0, "D_IS": -1.0 * DEG_H, "J": 1.25e-3, "dJ": 1.5e-4, "HK": 2e-3, "J_IO": 0.0, "J_OS": 0.0,
    "J_SI": 0.0,
}  # fmt: skip
IMU_ERRORS = {f"imu.{a}_{n}": value for a in AXES for n, value in ERRORS.items()}
#: noise of the instruments -> what the filters are told of it
TOLD = {"gyro": "gyro", "bias": "bias", "acc": "acc"}


class AttitudeEstimatorTest(LoopTest):
    """A vehicle rests, rocks, accelerates and turns; its attitude is estimated from three gyros, three accelerometers
    and a heading reference, and compared with the true one, the estimated gyro biases with theirs.

    [EST-ATTITUDE, GYRO-STATIC-ERR, GYRO-DYNAMIC-ERR]
    """

    title = "Attitude estimation on a moving base"
    spec = ("EST-ATTITUDE", "GYRO-STATIC-ERR", "GYRO-DYNAMIC-ERR")
    bodies = """
        vehicle: z motion.angle[3], x motion.angle[1], y motion.angle[2]
        estimated: z estimator.angle[3], x estimator.angle[1], y estimator.angle[2]
    """
    slots = {
        "exciter": Slot("Excitation", "exciter"),
        "motion": Slot("Motion", "manoeuvre"),
        "imu": Slot("InertialUnit", "inertial_unit"),
        "compensation": Slot("RateCompensator", "gyro_error_compensator"),
        "estimator": Slot("AttitudeEstimator", "attitude_mekf"),
    }
    wires = f"""
        {FLOWN}
        motion -> imu: omega alpha f angle
        imu -> compensation: indicated f_read=f
        compensation.omega -> estimator.omega
        imu -> estimator: f_read=f heading heading_new
    """
    options = {
        "phases": Option(" ".join(PHASES), str, f"what the vehicle does, of: {' '.join(PHASES)}"),
        "rest": Option(120.0, "s", "length of rest and recovery", 0.0),
        "rocking": Option("20deg", "rad", "largest roll while rocking; pitch and yaw are half and a third of it", 0.0),
        "period": Option(10.0, "s", "period of the rocking", 0.0),
        "cycles": Option(30, int, "periods of the rocking", 1, 10000),
        "acceleration": Option(0.05 * G0, "m/s2", "acceleration forward", 0.0),
        "turn": Option("3deg/s", "rad/s", "rate of the turn"),
        "speed": Option(50.0, "m/s", "speed in the turn", 0.0, sets="motion.speed?"),
        "time": Option(60.0, "s", "length of acceleration and turn", 0.0),
        "heading_period": Option(1.0, "s", "time between two heading readings; 0: none", 0.0,
                                 sets="imu.heading_period?"),
        "known": Option(1.0, "1", "share of the static and dynamic errors that the compensation knows", 0.0, 2.0),
        "gate": Option(0.1, "m/s2", "largest difference of the specific force's size from gravity", 0.0,
                       sets="estimator.gate?"),
        "latitude": Option("40deg", "rad", "geographic latitude", -90 * DEG, 90 * DEG,
                           sets="motion.latitude? estimator.latitude?"),
        "earth_rate": Option(7.2921159e-5, "rad/s", "Earth rate; 0: none", 0.0,
                             sets="motion.earth_rate? estimator.earth_rate?"),
    }  # fmt: skip
    noises = (*(f"imu.noise_{a}_{n}" for a in AXES for n in ("bias", "gyro", "acc_bias", "acc")), "imu.heading_noise")
    step = 1e-2
    channels = (
        "exciter.phase", "exciter.gate", *three("motion.angle", "imu.static", "imu.bias", "compensation.static",
        "estimator.angle", "estimator.bias"), "estimator.aided", "estimator.nis", "estimator.used",
        *(f"estimator.covariance[{i},{j}]" for i in range(1, 7) for j in range(i, 7)),
    )  # fmt: skip
    shown = ("motion.angle", "estimator.angle", "imu.bias", "estimator.bias", "estimator.aided")

    def phases(self) -> list[LoopPhase]:
        lengths = {
            "rest": self["rest"], "recovery": self["rest"], "rocking": self["period"] * self["cycles"],
            "acceleration": self["time"], "turn": self["time"],
        }  # fmt: skip
        return [LoopPhase(p, dwell=lengths.get(p, 0.0)) for p in self.asked()]

    def design(self, parts: PartValues) -> dict[str, Any]:
        """Return manoeuvres by phase; the compensation knows the errors, the filters the noise of the instruments."""
        peak = math.pi / self["period"] * self["rocking"] if self["period"] else 0.0  # of the rate, for the angle's
        rows = {
            "acceleration": {"forward": self["acceleration"]},
            "turn": {"turn": self["turn"]},
            "rocking": {
                "roll": peak, "pitch": 0.5 * peak, "yaw": peak / 3.0,
                "frequency": 1.0 / self["period"] if self["period"] else 0.0,
            },
        }  # fmt: skip
        table = by_phase(self.asked(), ("forward", "turn", "pitch", "roll", "yaw", "frequency"), rows)
        errors = parts.all_given(IMU_ERRORS)
        known = {n.replace("imu", "compensation", 1) + "?": self["known"] * x for n, x in errors.items()}
        told = {f"estimator.noise_of_{n}?": parts.get(f"imu.noise_x_{own}", 0.0) for n, own in TOLD.items()}
        moved = {f"motion.{n}[{k}]?": x for n, row in table.items() for k, x in enumerate(row, 1) if x != 0.0}
        return {
            **moved,
            **{f"{n}?": x for n, x in errors.items()},
            **known,
            **{n: x for n, x in told.items() if x > 0.0},
            "estimator.noise_of_tau?": parts.get("imu.bias_tau", 3600.0),
            "estimator.noise_of_heading?": max(parts.get("imu.heading_noise", 0.0), 1e-6),
        }

    def check(self) -> list[str]:
        return self.not_offered(PHASES) + self.not_positive("rest", "period", "time", "gate")

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        """Refuse phases named after manoeuvres on a base that flies none, but moves by itself."""
        moving = [p for p in self.asked() if p in ("rocking", "turn", "acceleration")]
        if not moving or "motion.forward[1]" in parameters or "motion.forward" in parameters:
            return []
        return [
            f"phases: {', '.join(moving)}: the part in the slot motion flies no manoeuvres (no parameters forward, "
            "turn, roll); it moves by itself: take phases=rest"
        ]

    def warnings(self) -> list[str]:
        if self["heading_period"] == 0.0:
            return [
                "Without heading readings neither the heading nor the gyro bias along the vertical is observable. "
                "Their errors grow as the drift and the stated variances do. Give heading_period."
            ]
        return []
