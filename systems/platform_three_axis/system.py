"""Three-axis platform: three floated gyros, distribution of their signals to the motors, three stabilizer loops."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from gyrobench.record.motion_profile import read_profile
from gyrobench.record.record import Record
from gyrobench.result import LoopResult, Specification
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, System

DEG = math.pi / 180.0
MIL = 2.0 * math.pi / 6000.0  # rad; the mil of DECOUPLE-BENCH-83MIL
TORQUER = 0.083387953  # rad/s/A, scale factor of floated_gyro (17.2 deg/h/mA)
AXES = ("pitch", "roll", "azimuth")  # motor axes in A order
NEUTRAL = {"pitch": 1.0, "roll": 2.0, "azimuth": 0.7}  # kg.m2 about them at joint angles 0: each drive is normalized
# rows: gyro axes I, O, S in platform axes [GYRO-OA-COUPLING-Y2]
MOUNTS = {
    "gyro_x": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "gyro_y": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
    "gyro_z": [[0, 0, 1], [0, -1, 0], [1, 0, 0]],
}
GYROS = tuple(MOUNTS)
GYRO = {"H": 0.02, "J": 2.5e-5, "C": 0.02, "K_sg": 10.0, "u_max": 0.2, "k": TORQUER}  # [GYRO-SDF-EOM]
COMMAND = 1e-3  # rad/s, of the command step
MOTOR = {"k_t": 1.0, "R": 1.0, "L": 0.0, "k_e": 0.0}  # driven by current: 1 N.m a volt, no back EMF


def _wires() -> str:
    lines = [
        "exciter.motion_angle -> motion.motion_angle",
        "exciter.motion_rate -> motion.motion_rate",
        "exciter.motion_acceleration -> motion.motion_acceleration",
        "exciter.torque -> load.torque",
        "load.M -> platform.M_load",
        "motion.omega -> platform.omega_b",
        "motion.alpha -> platform.alpha_b",
        "motion.f -> platform.f_b",
        "platform.theta -> decoupler.theta",
    ]
    for k, (gyro, axis) in enumerate(zip(GYROS, AXES, strict=True), 1):
        lines += [
            f"platform.omega -> {gyro}.omega",
            f"platform.alpha -> {gyro}.alpha",
            f"platform.f -> {gyro}.f",
            f"exciter.command[{k}] -> {gyro}.i",
            f"{gyro}.M_react[{k}] -> platform.M_gyro[{k}]",
            f"{gyro}.u -> decoupler.u[{k}]",
            f"decoupler.u_axes[{k}] -> {axis}.u",
            f"exciter.test[{k}] -> {axis}.test",
            f"{axis}.v -> platform.v[{k}]",
        ]
    return "\n".join(lines)


class PlatformThreeAxis(System):
    """Three floated gyros on the inner element of three gimbals; their signals are distributed to the motors of the
    gimbals by T2 (or are not), and a stabilizer on each axis holds the element in inertial space.

    [PLATFORM-3AXIS-DYN, DECOUPLE-T2, DECOUPLE-BENCH-83MIL; Xia 2008, ch. 5]
    """

    title = "Three-axis stabilized platform"
    spec = ("PLATFORM-3AXIS-DYN", "PLATFORM-3AXIS-KIN", "DECOUPLE-T2", "DECOUPLE-BENCH-83MIL", "GYRO-OA-COUPLING-Y2")
    slots = {
        "exciter": Slot("Excitation", "exciter"),
        "motion": Slot("Motion", "base_motion"),
        "load": Slot("Load", "load_torque"),
        "platform": Slot("Platform", "platform_three_axis"),
        **{gyro: Slot("SdfGyro", "floated_gyro") for gyro in GYROS},
        "decoupler": Slot("Decoupler", "decoupler_t2"),
        **{axis: Slot("Stabilizer", "stabilizer_lead_lag") for axis in AXES},
    }
    wires = _wires()
    factors = {f"exciter.command[{k}] -> {gyro}.i": 1.0 / TORQUER for k, gyro in enumerate(GYROS, 1)}
    loops = {axis: f"{axis}.u" for axis in AXES}
    options = {
        "pitch": Option("20deg", "rad", "joint angle of the middle gimbal at the start", -80 * DEG, 80 * DEG),
        "roll": Option(0.0, "rad", "joint angle of the outer gimbal at the start"),
        "azimuth": Option("30deg", "rad", "joint angle of the inner gimbal at the start"),
        "crossover": Option(10.0, "Hz", "crossover of each loop, for the gains", 0.5, 30.0),
        "load_step": Option(1.0, "N.m", "disturbance torque of the steps"),
        "swing": Option(
            83.0 * MIL, "rad", "amplitude of base and of commanded angle (83 of 6000 mil); 0: neither", 0.0
        ),
        "frequency": Option(1.0, "Hz", "frequency of the commanded sine", 0.1, 5.0),
        "profile": Option("", str, "CSV file with a recorded motion of the base: a ride of `hold` instead of the plan"),
        "hold": Option(30.0, "s", "time of the drift hold", 5.0, 3600.0),
        "sweeps": Option(True, bool, "test sines for the margins of each axis"),
    }
    noises = tuple(f"{gyro}.{n}" for gyro in GYROS for n in ("turn_on", "markov", "white", "pickoff"))
    step = 1e-4
    done = "exciter.done"
    channels = (
        "exciter.phase",
        "exciter.gate",
        *(f"exciter.command[{k}]" for k in (1, 2, 3)),
        *(f"exciter.test[{k}]" for k in (1, 2, 3)),
        "exciter.motion_angle[1]",
        *(f"motion.angle[{k}]" for k in (1, 2, 3)),
        *(f"platform.attitude[{k}]" for k in (1, 2, 3)),
        *(f"platform.theta[{k}]" for k in (1, 2, 3)),
        "platform.lock",
        "platform.saturated",
        "decoupler.saturated",
        *(f"{axis}.e" for axis in AXES),
        *(f"{axis}.v" for axis in AXES),
    )
    channel_period = 1e-3

    def plan(self) -> LoopPlan:
        """Load steps, commands, base sines at 0.5, 0.7, 0.9 Hz and a sweep about x, test sines of each axis, drift."""
        f, fc = self["frequency"], self["crossover"]
        if self["profile"]:
            return LoopPlan([LoopPhase("ride", dwell=self["hold"])])
        rate = self["swing"] * 2.0 * math.pi * f
        phases = [
            LoopPhase(f"load {a}", "torque", "step", k, self["load_step"], settle=3.0, dwell=3.0)
            for k, a in enumerate(AXES, 1)
        ]
        for k, axis in enumerate("xyz" if self["swing"] else "", 1):
            phases += sweep(f"command {axis}", "command", [f], rate, axis=k, settle=6.0, periods=4)
        if self["swing"]:
            phases.append(LoopPhase("command step", "command", "step", 1, COMMAND, settle=6.0, dwell=4.0))
            size = self["swing"]
            phases += sweep("base x", "motion", [1.0, 2.0, 5.0], lambda f: size / (4.0 * f * f), settle=6.0, dwell=4.0)
        for k, (axis, hertz) in enumerate(zip("xyz", (0.5, 0.7, 0.9), strict=True) if self["swing"] else (), 1):
            phases += sweep(f"base {axis}", "motion", [hertz], self["swing"], axis=k, settle=6.0, periods=4)
        if self["sweeps"]:
            for k, axis in enumerate(AXES, 1):
                tones = [fc * x for x in (0.3, 0.6, 0.9, 1.2, 2.0, 3.5)]
                phases += sweep(f"loop {axis}", "test", tones, 2e-3, axis=k, settle=4.0, periods=20)
        return LoopPlan([*phases, LoopPhase("drift", "hold", settle=3.0, dwell=self["hold"])])

    def stabilizer(self, inertia: float) -> dict[str, float]:
        """F of PLATFORM-1AXIS: (1 + wc/(15 s))(1 + 4 s/wc)/(1 + s/(4 wc)), K so that the loop crosses at wc.

        L = K F K_sg (H/C)/(s (tau s + 1)) k_t/R / (J s), J the neutral inertia of the axis.
        """
        wc = 2.0 * math.pi * self["crossover"]
        s = 1j * wc
        f = (1 + 1 / 15j) * (1 + 4j) / (1 + 0.25j)
        gyro = GYRO["K_sg"] * GYRO["H"] / GYRO["C"] / (s * (GYRO["J"] / GYRO["C"] * s + 1))
        K = 1.0 / abs(f * gyro / (inertia * s))
        return {"K": K, "tau1": 1.0, "T1": 1.0, "tau2": 4 / wc, "T2": 0.25 / wc, "integral": wc / 15, "v_max": 48.0}

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        found: dict[str, Any] = {
            **self.plan().parameters(),
            **(read_profile(Path(self["profile"])) if self["profile"] else {}),
            "platform.theta_0": [self["pitch"], self["roll"], self["azimuth"]],
            **{f"platform.{n}": [x] * 3 for n, x in MOTOR.items()},
            "platform.i_max": [48.0] * 3,
            "decoupler.theta_f_max?": 80 * DEG,
        }
        for gyro, mount in MOUNTS.items():
            found |= {f"{gyro}.mount": mount, f"{gyro}.reaction": True, **{f"{gyro}.{n}": x for n, x in GYRO.items()}}
        for axis, inertia in NEUTRAL.items():
            found |= {f"{axis}.{n}?": x for n, x in self.stabilizer(inertia).items()}
        return found

    def reduce(self, record: Record, specification: Specification | None = None) -> LoopResult:
        from .reduction import from_record

        return from_record(record, specification)
