"""Three-gimbal platform: two gyros with their rotors at right angles, azimuth resolver, three stabilizer channels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from gyrobench.record.record import Record
from gyrobench.result import LoopResult, Specification
from gyrobench.system import flight_plan
from gyrobench.system.flight_plan import Leg
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, System

DEG = math.pi / 180.0
DPH = DEG / 3600.0
AXES = ("pitch", "roll", "azimuth")  # the A order
K_SG = 10.0  # V/rad, pickoffs
K_X, K_Y = 17.227e3 * DPH, 17.180e3 * DPH  # rad/s/A, scale factors the commands reckon with
CAP = math.acos(0.1)  # the secant grows to 10
#: rows: gyro axes x, y, z (rotor) in platform axes; gyro_a feels y and z, gyro_b feels z (monitor) and x
MOUNTS = {"gyro_a": [[0, 1, 0], [0, 0, 1], [1, 0, 0]], "gyro_b": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]}
TEST = (1.5, 2.5, 4.0, 5.5, 7.0, 9.0, 13.0, 18.0)  # Hz


COMMON = """
    exciter.phase -> motion.phase
    exciter.gate -> motion.gate
    exciter.torque -> load.torque
    load.M -> platform.M_load
    motion.omega -> platform.omega_b
    motion.alpha -> platform.alpha_b
    motion.f -> platform.f_b
    platform.theta -> decoupler.theta
    gyro_b.u_y -> decoupler.u[1]
    gyro_a.u_x -> decoupler.u[2]
    gyro_a.u_y -> decoupler.u[3]
    exciter.command[1] -> gyro_b.i_x
    exciter.command[2] -> gyro_a.i_y
    exciter.command[3] -> gyro_a.i_x
    exciter.command[3] -> gyro_b.i_y
"""


def _wires() -> str:
    lines = [COMMON]
    for gyro in MOUNTS:
        lines += [f"platform.omega -> {gyro}.omega", f"platform.f -> {gyro}.f"]
    for k, axis in enumerate(AXES, 1):
        lines += [
            f"decoupler.u_axes[{k}] -> {axis}.u",
            f"exciter.test[{k}] -> {axis}.test",
            f"{axis}.v -> platform.v[{k}]",
        ]
    return "\n".join(lines)


class PlatformThreeGimbal(System):
    """Two two-degree-of-freedom gyros, rotors along x and y of the platform, feel its turning; an azimuth resolver
    turns their signals into those of the gimbal axes, and a channel for each axis drives its servo.

        L(s) = feedback / (s (lag s + 1))      for each axis, with the resolver at every azimuth

    First the flight: a roll, by default to 90 deg and so into gimbal lock, a yaw, and the way back.  Then, at rest,
    load steps, sweeps of the three loops, a commanded rate and a drift hold.
    [PLATFORM-3GIMBAL-2DOF; GSP ch. 5, section 5.2.1]
    """

    title = "Three-gimbal platform with two gyros"
    spec = ("PLATFORM-3GIMBAL-2DOF", "RESOLVER-AZ", "DECOUPLE-T2")
    slots = {
        "exciter": Slot("Excitation", "exciter"),
        "motion": Slot("Motion", "manoeuvre"),
        "load": Slot("Load", "load_torque"),
        "platform": Slot("Platform", "platform_three_gimbal_2dof"),
        "gyro_a": Slot("TwoAxisGyro", "gyro_2dof"),
        "gyro_b": Slot("TwoAxisGyro", "gyro_2dof"),
        "decoupler": Slot("Decoupler", "decoupler_t2"),
        **{axis: Slot("Stabilizer", "stabilizer_lead_lag") for axis in AXES},
    }
    wires = _wires()
    factors = {
        "exciter.command[1] -> gyro_b.i_x": 1.0 / K_X,
        "exciter.command[2] -> gyro_a.i_y": 1.0 / K_Y,
        "exciter.command[3] -> gyro_a.i_x": 1.0 / K_X,
        "exciter.command[3] -> gyro_b.i_y": 1.0 / K_Y,
    }
    loops = {axis: f"{axis}.u" for axis in AXES}
    options = {
        "roll": Option("90deg", "rad", "roll of the base in the flight"),
        "yaw": Option("50deg", "rad", "yaw of the base after it, about its own z"),
        "roll_rate": Option("36deg/s", "rad/s", "rate of the roll", 1e-3),
        "yaw_rate": Option("10deg/s", "rad/s", "rate of the yaw", 1e-3),
        "mount": Option(1, int, "outer gimbal, 0: roll (lock at pitch 90 deg), 1: pitch (lock at roll 90 deg)", 0, 1),
        "allow_lock": Option(True, bool, "go on in gimbal lock; false: the platform ends the run there"),
        "rate_max": Option("60deg/s", "rad/s", "largest rate of a gimbal", 0.1),
        "azimuth": Option(0.0, "rad", "azimuth joint angle at the start"),
        "resolver_offset": Option(0.0, "rad", "error of the resolver's zero"),
        "feedback": Option(40.0, "1/s", "rate of a servo for an angle of the platform", 1.0),
        "integral": Option(0.0, "1/s", "corner of the integral part of the channels; 0: none", 0.0),
        "mounting": Option("3arcmin", "rad", "mounting error of the gyros, about each of their axes", 0.0, 0.1),
        "torquer": Option(1e-4, "1", "error of the torquers' scale factors"),
        "load": Option(50.0, "N.m", "disturbance torque of the steps"),
        "command": Option(2e-3, "rad/s", "rate commanded about the platform's z"),
        "hold": Option(20.0, "s", "length of the drift hold", 1.0),
    }
    noises = tuple(f"{g}.{n}_{c}" for g in MOUNTS for n in ("turn_on", "markov", "white", "pickoff") for c in "xy")
    step = 5e-4
    done = "exciter.done"
    channels = (  # those that a report draws come first
        *(f"platform.attitude[{k}]" for k in (1, 2, 3)), *(f"platform.theta[{k}]" for k in (1, 2, 3)),
        "exciter.phase", "exciter.gate", *(f"exciter.torque[{k}]" for k in (1, 2, 3)),
        *(f"exciter.test[{k}]" for k in (1, 2, 3)), "exciter.command[3]", *(f"motion.omega[{k}]" for k in (1, 2, 3)),
        *(f"platform.theta_dot[{k}]" for k in (1, 2, 3)), "platform.lock", "pitch.e", "roll.e", "azimuth.e",
        "gyro_a.u_y", "gyro_b.u_x", "gyro_a.drift_x", "gyro_a.drift_y", "gyro_b.drift_x", "gyro_b.drift_y",
        "gyro_a.saturated", "gyro_b.saturated",
    )  # fmt: skip
    channel_period = 2e-3

    def at_rest(self) -> list[LoopPhase]:
        """Steps, sweeps, command and hold, after the flight; 7 / feedback = 0.18 s lets the loops settle."""
        wait = 14.0 / self["feedback"]
        phases = []
        for k, axis in enumerate(AXES, 1):
            phases.append(
                LoopPhase(f"load on {axis}", "torque", "step", k, self["load"], settle=2 * wait, dwell=2 * wait)
            )
        for k, axis in enumerate(AXES, 1):
            phases += sweep(f"loop {axis}", "test", TEST, 0.02, axis=k, settle=wait)
        phases.append(LoopPhase("command", "command", "step", 3, self["command"], settle=2 * wait, dwell=1.0))
        return [*phases, LoopPhase("drift", "hold", settle=2 * wait, dwell=self["hold"])]

    def legs(self) -> list[Leg]:
        """The flight and the way back; whole steps, so that the angles are exact."""
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

    def plan(self) -> LoopPlan:
        """The flight comes first: after a drift of minutes the gimbals would no longer meet at exactly 90 deg."""
        return LoopPlan([*flight_plan.phases(self.legs()), *self.at_rest()])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        found: dict[str, Any] = {
            **self.plan().parameters(),
            **flight_plan.parameters(self.legs()),
            "motion.earth_rate?": 0.0,
            "platform.mount?": self["mount"],
            "platform.allow_lock?": int(self["allow_lock"]),
            "platform.rate_max": self["rate_max"],
            "platform.theta_0[3]": self["azimuth"],
            "decoupler.form?": 1,
            "decoupler.mount?": self["mount"],
            "decoupler.theta_f_max?": CAP,
            "decoupler.offset?": self["resolver_offset"],
        }
        for sign, (gyro, mount) in zip((1.0, -1.0), MOUNTS.items(), strict=True):
            error = Rotation.from_rotvec(np.full(3, sign * self["mounting"])).as_matrix()
            found |= {
                f"{gyro}.mount": (np.array(mount, float) @ error).tolist(),
                f"{gyro}.K_sg_x": K_SG,
                f"{gyro}.K_sg_y": K_SG,
                f"{gyro}.u_max": 1.0,
                f"{gyro}.k_x": K_X * (1.0 + self["torquer"]),
                f"{gyro}.k_y": K_Y * (1.0 + self["torquer"]),
            }
        for axis in AXES:
            found |= {f"{axis}.{n}?": 1.0 for n in ("tau1", "T1", "tau2", "T2")}
            found |= {f"{axis}.K": self["feedback"] / K_SG, f"{axis}.integral?": self["integral"]}
        return found

    def check(self) -> list[str]:
        if self["feedback"] * self.step > 0.05:
            return [
                f"feedback = {self['feedback']:g} 1/s: the loop is closed through a delay of one step, {self.step:g} "
                f"s, which wants a crossover up to 1/(20 step) = {0.05 / self.step:g} 1/s"
            ]
        return []

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = []
        rotors = [np.asarray(parameters[f"{g}.mount"], float)[2] for g in MOUNTS if f"{g}.mount" in parameters]
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

    def reduce(self, record: Record, specification: Specification | None = None) -> LoopResult:
        from .reduction import from_record

        return from_record(record, specification)
