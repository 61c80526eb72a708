"""Three-gimbal platform: two gyros with their rotors at right angles, azimuth resolver, three stabilizer channels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.system import flight_plan
from gyrobench.system.families.loop_test import AXES, TwoGyroTest, commanded, three
from gyrobench.system.flight_plan import Leg
from gyrobench.system.loop_plan import LoopPhase
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option

COMMANDS = commanded("exciter.command")


class PlatformThreeGimbal(TwoGyroTest):
    """Two two-degree-of-freedom gyros, rotors along x and y of the platform, feel its turning; an azimuth resolver
    turns their signals into those of the gimbal axes, and a channel for each axis drives its servo.

    First the flight: a roll, by default to 90 deg and so into gimbal lock, a yaw, and the way back.  Then, at rest,
    load steps, sweeps of the three loops, a commanded rate and a drift hold.
    [PLATFORM-3GIMBAL-2DOF; GSP ch. 5, section 5.2.1]
    """

    title = "Three-gimbal platform with two gyros"
    spec = ("PLATFORM-3GIMBAL-2DOF", "RESOLVER-AZ", "DECOUPLE-T2")
    reduction = "reduction"
    tones = (1.5, 2.5, 4.0, 5.5, 7.0, 9.0, 13.0, 18.0)  # Hz
    slots = TwoGyroTest.with_parts(
        motion="manoeuvre", load="load_torque", platform="platform_three_gimbal_2dof", gyro_a="gyro_2dof",
        gyro_b="gyro_2dof", decoupler="decoupler_t2", **dict.fromkeys(AXES, "stabilizer_lead_lag"),
    )  # fmt: skip
    wires = TwoGyroTest.wires + "\n".join(COMMANDS)
    factors = COMMANDS
    options = TwoGyroTest.options | {
        "roll": Option("90deg", "rad", "roll of the base in the flight"),
        "yaw": Option("50deg", "rad", "yaw of the base after it, about its own z"),
        "roll_rate": Option("36deg/s", "rad/s", "rate of the roll", 1e-3),
        "yaw_rate": Option("10deg/s", "rad/s", "rate of the yaw", 1e-3),
        "mount": Option(1, int, "outer gimbal, 0: roll (lock at pitch 90 deg), 1: pitch (lock at roll 90 deg)", 0, 1),
        "allow_lock": Option(True, bool, "go on in gimbal lock; false: the platform ends the run there"),
        "rate_max": Option("60deg/s", "rad/s", "largest rate of a gimbal", 0.1),
        "azimuth": Option(0.0, "rad", "azimuth joint angle at the start"),
        "resolver_offset": Option(0.0, "rad", "error of the resolver's zero"),
        "integral": Option(0.0, "1/s", "corner of the integral part of the channels; 0: none", 0.0),
        "mounting": Option("3arcmin", "rad", "mounting error of the gyros, about each of their axes", 0.0, 0.1),
        "torquer": Option(1e-4, "1", "error of the torquers' scale factors"),
        "command": Option(2e-3, "rad/s", "rate commanded about the platform's z"),
    }
    channels = (
        *three("platform.attitude", "platform.theta"), "exciter.phase", "exciter.gate",
        *three("exciter.torque", "exciter.test"), "exciter.command[3]",
        *three("motion.omega", "motion.angle", "platform.theta_dot"), "platform.lock", "pitch.e", "roll.e", "azimuth.e",
        "gyro_a.u_y", "gyro_b.u_x", "gyro_a.drift_x", "gyro_a.drift_y", "gyro_b.drift_x", "gyro_b.drift_y",
    )  # fmt: skip
    shown = (
        "platform.attitude", "platform.theta", "platform.theta_dot", "motion.omega", "pitch.e roll.e azimuth.e",
        "platform.lock gyro_a.saturated gyro_b.saturated",
    )  # fmt: skip

    def legs(self) -> list[Leg]:
        """Return the flight and the way back; whole steps, so that the angles are exact."""
        found: list[Leg] = []
        for name, way in (("roll", 1.0), ("yaw", 1.0), ("yaw", -1.0), ("roll", -1.0)):
            angle = way * self[name]
            time = max(1, round(abs(angle) / self[f"{name}_rate"] / self.step)) * self.step
            if angle != 0.0:
                back = " back" if way < 0.0 else ""
                rest = 0.0 if found else self.channel_period  # the gates open on samples of the record
                label = f"{name} {math.degrees(self[name]):.4g}°{back}"
                found.append(Leg(label, time, rest=rest, **{name: angle / time}))
        return found

    def at_rest(self) -> list[LoopPhase]:
        command = LoopPhase("command", "command", "step", 3, self["command"], settle=2 * self.wait, dwell=1.0)
        return [*self.steps(), command, self.drift()]

    def phases(self) -> list[LoopPhase]:
        """Return the flight, then the rest: after a drift of minutes the gimbals would not meet at exactly 90 deg."""
        return [*flight_plan.phases(self.legs()), *self.at_rest()]

    def design(self, parts: PartValues) -> dict[str, Any]:
        found = super().design(parts) | flight_plan.parameters(self.legs(), self.plan().phases)
        found |= {
            "platform.mount?": self["mount"],
            "platform.allow_lock?": int(self["allow_lock"]),
            "platform.theta_0[3]": self["azimuth"],
            "decoupler.mount?": self["mount"],
            "decoupler.offset?": self["resolver_offset"],
            **{f"{axis}.integral?": self["integral"] for axis in self.signals},
        }
        return found | self.misplaced(parts)

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = []
        rotors = [np.asarray(parameters[f"{g}.mount"], float)[2] for g in self.mounts if f"{g}.mount" in parameters]
        if len(rotors) == 2 and abs(float(rotors[0] @ rotors[1])) > 0.98:
            problems.append(
                "gyro_a.mount and gyro_b.mount: the rotors are parallel, so that nothing feels a turn about them; one "
                "rotor belongs along x, the other along y of the platform"
            )
        here, there = parameters.get("platform.mount"), parameters.get("decoupler.mount")
        if here is not None and there is not None and here != there:
            problems.append(
                f"platform.mount = {here} and decoupler.mount = {there}: the secant belongs to the middle gimbal of "
                "the platform; set the option mount, which gives both"
            )
        return problems
