"""A platform axis stabilized by a power gyro: the gyro bears the load, a motor takes it over."""

from __future__ import annotations

import math
from typing import Any

from gyrobench.system.families.loop_test import MOVED, PROFILE, LoopTest, hold, noises, stabilizer
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot

#: of the gyro where the user gives nothing else [STAB-POWER-2DOF], and what the stabilizer is told of it
GYRO = {"H": 10.0, "J_x": 0.5, "J_y": 0.02, "C_x": 10.0, "C_y": 2.0, "K_sg_y": 10.0, "u_max": 5.0}
TOLD = {"H": "H_g", "J_x": "J_x", "J_y": "J_y", "C_x": "C_x", "C_y": "C_y", "K_sg_y": "k_u"}
STOP = math.radians(5.0)  # of the gyro
K_I, RATIO = 10.0, 100.0  # amplifier and reducer; the motor's gain makes the K_m that is asked for
TEST = (0.3, 0.6, 1.0, 1.5, 2.0, 2.7, 4.0, 6.0, 9.0, 13.0, 17.0, 22.0, 30.0, 45.0)  # Hz
MOTION = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)  # Hz


class StabilizerPower2dof(LoopTest):
    """Two-degree-of-freedom gyro as sensor and source of torque on one axis, with a correction motor.

        J_x a'' + C_x a' + H b' = -K_m b + M_x        J_y b'' + C_y b' - H a' = M_y

    a: platform (outer gimbal with the load), b: precession.  [STAB-POWER-2DOF; GSP ch. 5, eq. 5-1..5-23]
    """

    title = "Power gyro stabilizer with a two-degree-of-freedom gyro"
    spec = ("STAB-POWER-2DOF",)
    slots = LoopTest.with_parts(motion="base_motion", load="load_torque") | {
        "stabilizer": stabilizer("stabilizer_power"),
        "gyro": Slot("TwoAxisGyro", "gyro_2dof"),
    }
    wires = MOVED + LoopTest.wires + """
        motion -> gyro: omega alpha=alpha_b f
        gyro.u_y -> stabilizer.u
        exciter.test[1] -> stabilizer.test
        load.M[1] -> stabilizer.M_load
        stabilizer.M -> gyro.M_x
        load.M[2] -> gyro.M_y
    """  # fmt: skip
    loops = {"stabilizer": "stabilizer.u"}
    open = ("gyro.i_x", "gyro.i_y")
    step = 1e-4
    channel_period = 1e-3
    channels = (
        "exciter.phase", "exciter.gate", "exciter.torque[1]", "exciter.torque[2]", "exciter.test[1]",
        "motion.angle[1]", "gyro.alpha", "gyro.beta", "stabilizer.e", "stabilizer.v", "gyro.drift_x",
    )  # fmt: skip
    shown = ("gyro.alpha", "gyro.beta", "stabilizer.v", "motion.angle", "exciter.torque")
    noises = noises(channels=("_x", "_y"))
    options = {
        "K_m": Option(100.0, "N.m/rad", "stiffness of the correction, ratio k_u k_i k_m", 0.0),
        "load": Option(1.0, "N.m", "disturbance torque of the step on the platform axis"),
        "servo": Option(0.02, "N.m", "torque on the precession axis that turns the platform"),
        "base": Option("0.5deg", "rad", "amplitude of the base in the motion sweep"),
        "test": Option(0.02, "V", "amplitude of the test voltage in the sweep of the loop"),
        **hold(30.0),
        "allow_unstable": Option(False, bool, "run with a K_m beyond the Routh limit"),
        **PROFILE,
    }

    def phases(self) -> list[LoopPhase]:
        settle = 1.5  # s: the slowest pole of the default loop, -9.1 1/s, leaves exp(-7) in the second half
        return [
            LoopPhase("load step", "torque", "step", 1, self["load"], settle=settle, dwell=3.0),
            LoopPhase("servo torque", "torque", "constant", 2, self["servo"], settle=2 * settle, dwell=3.0),
            *sweep("loop", "test", TEST, self["test"], settle=2 * settle),
            *sweep("base", "motion", MOTION, lambda f: self["base"] / max(1.0, f), settle=2 * settle, periods=3),
            LoopPhase("drift", "hold", settle=2 * settle, dwell=self["hold"]),
        ]

    def plan(self) -> LoopPlan:
        """Return the phases; a recorded motion goes on beside them."""
        return LoopPlan(self.phases())

    def design(self, parts: PartValues) -> dict[str, Any]:
        gyro = {n: parts.given(f"gyro.{n}", value) for n, value in GYRO.items()}
        k_i, ratio = parts.given("stabilizer.k_i", K_I), parts.given("stabilizer.ratio", RATIO)
        return {
            **{f"gyro.{n}": value for n, value in gyro.items()},
            **{f"stabilizer.{there}": gyro[here] for here, there in TOLD.items()},
            "gyro.stop": STOP,
            "stabilizer.polarity": -1,  # u_y is the case against the rotor, the potentiometer reads k_u b
            "stabilizer.k_i": k_i,
            "stabilizer.ratio": ratio,
            "stabilizer.k_m": self["K_m"] / (gyro["K_sg_y"] * k_i * ratio),
            "stabilizer.allow_unstable": int(self["allow_unstable"]),
        }

    def check(self) -> list[str]:
        """Return refusals before the run; an unstable K_m is refused by the stabilizer."""
        if self["K_m"] == 0.0:
            return ["K_m = 0: without the correction motor nothing takes the load off the gyro; K_m must be > 0"]
        lean = abs(self["load"]) / self["K_m"]
        if lean > 0.8 * STOP:
            return [
                f"load = {self['load']:g} N.m leans the gyro by load / K_m = {math.degrees(lean):.3g} deg; its stop is "
                "at 5 deg: take a smaller load or a larger K_m"
            ]
        return []
