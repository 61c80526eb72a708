"""A platform about two axes, a power gyro with its loop for each."""

from __future__ import annotations

import math
from typing import Any

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.loop_test import MOVED, LoopTest, hold, stabilizer
from gyrobench.system.loop_plan import LoopPhase, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot

from .closed import TwoAxes, one_axis_limit

PLATFORM = Socket(
    "TwoAxisPowerPlatform",
    "platform about two axes that carries a power gyro for each",
    (
        inp("M", "N.m", "torques on the platform about x and y: motors and load", 2),
        inp("S", "N.m", "servo torques on the precession axes", 2, optional=True),
        inp("omega_b", "rad/s", "inertial rate of the base", 3),
        out("u", "V", "potentiometer voltages", 2),
        out("attitude", "rad", "inertial angle of the platform about x and y", 2),
        out("omega", "rad/s", "inertial rate of the platform about x and y", 2),
        out("precession", "rad", "angles of the gyros against the platform", 2),
    ),
)
GYRO = ("H", "J_x", "J_y", "C_x", "C_y")
K_I, RATIO = 10.0, 100.0  # amplifier and reducer; the motor's gain makes the K_m that is asked for
STOP = math.radians(5.0)  # of the gyros, by the plan
TEST = (0.3, 0.6, 1.0, 1.5, 2.0, 2.7, 4.0, 6.0, 9.0, 13.0, 17.0, 22.0, 30.0, 45.0)  # Hz
MOTION = (0.2, 0.5, 1.0, 2.0, 5.0)  # Hz


class StabilizerPowerTwoAxis(LoopTest):
    """Two power gyros on one platform, the second turned by 90 degrees about the vertical: each bears the load of its
    axis and its potentiometer drives the motor of it.  The potentiometers read the platform about the other axis, too,
    and the dampers couple both.

        J_x th'' + C_x th' + H be' - i C_y c' = -K_m c + M,   J_y be'' + C_y c' - H th' = S,   c = be + i th

    th = a_x + i a_y, be the precessions alike.  [STAB-POWER-TWO-AXIS; GSP ch. 5, section 5.1.1, eq. 5-7, 5-8]
    """

    title = "Two-axis stabilizer with two power gyros"
    spec = ("STAB-POWER-TWO-AXIS", "STAB-POWER-2DOF")
    slots = LoopTest.with_parts(motion="base_motion", load="load_torque") | {
        "stabilizer_x": stabilizer("stabilizer_power"),
        "stabilizer_y": stabilizer("stabilizer_power"),
        "platform": Slot(PLATFORM, "platform_power_gyros"),
    }
    wires = MOVED + LoopTest.wires + """
        motion.omega -> platform.omega_b
        platform.u[1] -> stabilizer_x.u
        platform.u[2] -> stabilizer_y.u
        exciter.test[1] -> stabilizer_x.test
        exciter.test[2] -> stabilizer_y.test
        load.M[1] -> stabilizer_x.M_load
        load.M[2] -> stabilizer_y.M_load
        stabilizer_x.M -> platform.M[1]
        stabilizer_y.M -> platform.M[2]
        load.M[3] -> platform.S[1]
    """  # fmt: skip
    loops = {"x": "stabilizer_x.u", "y": "stabilizer_y.u"}
    open = ("platform.S[2]",)
    step = 1e-4
    channel_period = 1e-3
    channels = (
        "exciter.phase", "exciter.gate", *(f"exciter.torque[{k}]" for k in (1, 2, 3)), "exciter.test[1]",
        "exciter.test[2]", "exciter.motion_angle[1]", "motion.angle[1]", "platform.attitude[1]",
        "platform.attitude[2]", "platform.precession[1]", "platform.precession[2]", "stabilizer_x.e", "stabilizer_y.e",
        "stabilizer_x.v", "stabilizer_y.v",
    )  # fmt: skip
    shown = (
        "platform.attitude", "platform.precession", "stabilizer_x.v stabilizer_y.v", "motion.angle", "exciter.torque",
    )  # fmt: skip
    noises = ("platform.white",)
    options = {
        "K_m": Option(100.0, "N.m/rad", "stiffness of either correction, ratio k_u k_i k_m"),
        "H": Option(10.0, "N.m.s", "spin angular momentum of either gyro", sets="platform.H"),
        "J_x": Option(0.5, "kg.m2", "inertia of the platform about either axis", sets="platform.J_x"),
        "J_y": Option(0.02, "kg.m2", "inertia of a rotor with its inner gimbal", sets="platform.J_y"),
        "C_x": Option(10.0, "N.m.s/rad", "damping of the platform against the base", 0.0, sets="platform.C_x"),
        "C_y": Option(2.0, "N.m.s/rad", "damping of the precession against the platform", 0.0, sets="platform.C_y"),
        "drift": Option("0.3deg/h", "rad/s", "drift of either gyro, about x and y"),
        "load": Option(1.0, "N.m", "disturbance torque of the steps"),
        "servo": Option(0.02, "N.m", "torque on the precession axis of gyro 1 that turns the platform about x"),
        "base": Option("0.5deg", "rad", "amplitude of the base in the motion sweep", 0.0),
        "test": Option(0.02, "V", "amplitude of the test voltage in the sweep of the loop"),
        **hold(30.0),
        "allow_unstable": Option(False, bool, "run with a K_m beyond the limit"),
    }

    def axes(self) -> TwoAxes:
        """Return the closed forms of these options."""
        return TwoAxes(**{n: float(self[n]) for n in (*GYRO, "K_m")})

    def phases(self) -> list[LoopPhase]:
        settle = 3.0  # s: the slowest pole of the default loop, -6 1/s
        return [
            LoopPhase("load about x", "torque", "step", 1, self["load"], settle=settle, dwell=3.0),
            LoopPhase("load about y", "torque", "step", 2, self["load"], settle=settle, dwell=3.0),
            LoopPhase("servo torque", "torque", "constant", 3, self["servo"], settle=settle, dwell=3.0),
            *sweep("loop", "test", TEST, self["test"], settle=settle),
            *sweep("base", "motion", MOTION, lambda f: self["base"] / max(1.0, f), settle=settle, periods=3),
            LoopPhase("drift", "hold", settle=settle, dwell=self["hold"]),
        ]

    def design(self, parts: PartValues) -> dict[str, Any]:
        found: dict[str, Any] = {"platform.drift": [self["drift"]] * 2}
        k_u = parts.given("platform.k_u", 10.0)
        for slot in ("stabilizer_x", "stabilizer_y"):
            k_i, ratio = parts.given(f"{slot}.k_i", K_I), parts.given(f"{slot}.ratio", RATIO)
            found |= {
                f"{slot}.k_u": k_u,
                f"{slot}.k_i": k_i,
                f"{slot}.ratio": ratio,
                f"{slot}.k_m": self["K_m"] / (k_u * k_i * ratio),
                f"{slot}.polarity": 1,
                f"{slot}.H_g": 0.0,  # its limit is that of one axis: checked here for both
            }
        return found

    def check(self) -> list[str]:
        problems = self.not_positive("K_m", "H", "J_x", "J_y")
        if problems:
            return problems
        lean = abs(self["load"]) / self["K_m"]
        if lean > 0.8 * STOP:
            problems.append(
                f"load = {self['load']:g} N.m leans the gyro by load / K_m = {math.degrees(lean):.3g} deg, more than "
                "4: take a smaller load or a larger K_m"
            )
        axes = self.axes()
        if not axes.stable() and not self["allow_unstable"]:
            problems.append(
                f"K_m = {self['K_m']:g} N.m/rad: the loops of both axes together are stable up to {axes.limit():.4g} "
                f"N.m/rad (one alone up to {one_axis_limit(*(self[n] for n in GYRO)):.4g}); lower it, add damping, or "
                "set allow_unstable=true"
            )
        return problems
