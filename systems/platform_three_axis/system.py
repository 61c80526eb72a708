"""Three-axis platform: three floated gyros, distribution of their signals to the motors, three stabilizer loops."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from gyrobench.system.families import loop_test as loop
from gyrobench.system.families.arranged import Arranged
from gyrobench.system.families.loop_test import AXES, LoopTest, ThreeAxisTest, three
from gyrobench.system.families.three_gyros import MOUNTS, commands
from gyrobench.system.families.three_gyros import design as three_gyros
from gyrobench.system.loop_plan import LoopPhase, sweep
from gyrobench.system.part_files import has_port
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import OnRequest, Option, Slot

from . import optical_loop, rate_loops

DEG = math.pi / 180.0
MIL = 2.0 * math.pi / 6000.0  # rad; the mil of DECOUPLE-BENCH-83MIL
GYROS = tuple(MOUNTS)
ESTIMATORS = {f"estimator_{axis}": gyro for axis, gyro in zip("xyz", GYROS, strict=True)}
ANGLE, RATE, OPTICAL = "angle", "rate", "optical"
SERVO = "servo_three_loop"
#: the motors of a servo with a current loop: of the part as it is
MOTOR = {"k_t": 1.0, "R": 2.0, "L": 4e-3, "k_e": 1.0}
CURRENT_STEP = 2e-4  # s
ANGLE_TEST, RATE_TEST = 2e-3, 0.02  # V, of the test sines: 0.2 mrad of a float, 20 mrad/s
COMMAND = 1e-3  # rad/s, of the command step
COMMANDS = commands("exciter.command")


class PlatformThreeAxisSystem(Arranged, ThreeAxisTest):
    """Three floated gyros on the inner element of three gimbals; their signals are distributed to the motors of the
    gimbals by T2 (or are not), and a stabilizer on each axis holds the element in inertial space.

    loops = rate: the gyros are rebalanced, their currents the rates, and each axis has a current, a rate and a position
    loop; loops = optical: a tracking loop on the line of sight outside of them.

    [PLATFORM-3AXIS-DYN, DECOUPLE-T2, DECOUPLE-BENCH-83MIL, SERVO-3LOOP; Xia 2008, section 1.3.2, ch. 5]
    """

    arranged_by = "loops"
    arranged = ("slots", "wires", "on_request", "factors", "channels", "channel_period", "noises", "loops", "shown")
    title = "Three-axis stabilized platform"
    spec = ("PLATFORM-3AXIS-DYN", "PLATFORM-3AXIS-KIN", "DECOUPLE-T2", "DECOUPLE-BENCH-83MIL", "GYRO-OA-COUPLING-Y2")
    reduction = "reduction"
    bodies = """
        base: z motion.angle[3], x motion.angle[1], y motion.angle[2]
        roll gimbal: base, y platform.theta[2]
        pitch gimbal: roll gimbal, x platform.theta[1]
        inner element: pitch gimbal, z platform.theta[3]
    """
    slots = LoopTest.with_parts(motion="base_motion", load="load_torque") | {
        "platform": Slot("Platform", "platform_three_axis"),
        **{gyro: Slot("SdfGyro", "floated_gyro") for gyro in GYROS},
        "decoupler": Slot("Decoupler", "decoupler_t2"),
        **{axis: loop.stabilizer("stabilizer_lead_lag") for axis in AXES},
    }
    wires = loop.MOVED + ThreeAxisTest.wires + "\n".join(COMMANDS) + "".join(
        f"""
        platform -> {gyro}: omega alpha f
        {gyro}.M_react[{k}] -> platform.M_gyro[{k}]
        {gyro}.u -> decoupler.u[{k}]
        """
        for k, gyro in enumerate(GYROS, 1)
    )  # fmt: skip
    on_request = {
        slot: OnRequest(
            {slot: Slot("Estimator", "estimator_none")},
            f"{gyro}.u -> {slot}.z\n{slot}.estimate -> decoupler.u[{k}]",
            channels=(f"{gyro}.u", f"{slot}.estimate"),
            instead_of=f"{gyro}.u -> decoupler.u[{k}]",
        )
        for k, (slot, gyro) in enumerate(ESTIMATORS.items(), 1)
    }
    factors = COMMANDS
    options = {
        "pitch": Option("20deg", "rad", "joint angle of the middle gimbal at the start", -80 * DEG, 80 * DEG),
        "roll": Option(0.0, "rad", "joint angle of the outer gimbal at the start"),
        "azimuth": Option("30deg", "rad", "joint angle of the inner gimbal at the start"),
        "crossover": Option(10.0, "Hz", "crossover of each loop, for the gains", 0.5, 30.0),
        "load_step": Option(1.0, "N.m", "disturbance torque of the steps"),
        "swing": Option(83 * MIL, "rad", "amplitude of base and of commanded angle (83 of 6000 mil); 0: neither", 0.0),
        "frequency": Option(1.0, "Hz", "frequency of the commanded sine", 0.1, 5.0),
        "sweeps": Option(True, bool, "test sines for the margins of each axis"),
        "loops": Option(
            ANGLE,
            str,
            "angle: floated gyros and stabilizers; rate: rebalanced gyros, servos of three loops; optical: with a "
            "tracking loop outside",
        ),
        "track": Option(
            0.0,
            "Hz",
            "crossover of the position loops on the joint angles, loops = rate, 0: none; of the tracking loops, "
            "loops = optical, 0: an eighth of crossover",
            0.0,
        ),
        **loop.hold(30.0, 5.0),
        **loop.PROFILE,
    }
    noises = loop.noises(GYROS)
    step = 1e-4
    channels = (
        "exciter.phase", "exciter.gate", *three("exciter.command", "exciter.test"), "exciter.motion_angle[1]",
        *three("motion.angle", "platform.attitude", "platform.theta"), "platform.lock", "platform.at_stop",
        "decoupler.saturated",
        *(f"{axis}.e" for axis in AXES), *(f"{axis}.v" for axis in AXES),
    )  # fmt: skip
    shown = (
        "platform.attitude", "motion.angle", "platform.theta", "pitch.e roll.e azimuth.e", "pitch.v roll.v azimuth.v",
        "platform.lock platform.saturated decoupler.saturated",
    )  # fmt: skip
    channel_period = 1e-3

    @property
    def rates(self) -> bool:
        """Return whether the gyros are rebalanced and the servos take rates."""
        return str(self["loops"]) in (RATE, OPTICAL)

    @property
    def optical(self) -> bool:
        """Return whether a tracking loop is outside of the rate loops."""
        return str(self["loops"]) == OPTICAL

    @property
    def tracking(self) -> float:
        """Return the crossover of the tracking loops, Hz."""
        return float(self["track"] or self["crossover"] / 8.0)

    def place(self, slot: str, part: str | Path, bench: Path | None = None) -> None:
        super().place(slot, part, bench)
        if slot in AXES and not self.rates and has_port(part, "i_motor", bench):
            self.set("loops", RATE)

    def arrange(self) -> None:
        if self.rates:
            wanted, more = rate_loops.on_request()
            kept = {n: s for n, s in self.slots.items() if n not in AXES}
            vars(self).update(
                slots={**kept, **rate_loops.slots(SERVO)},
                wires=f"{loop.MOVED}{ThreeAxisTest.wires}{rate_loops.WIRES}",
                on_request=wanted,
                factors={**rate_loops.FACTORS, **more},
                noises=(*self.noises, *(f"{slot}.meter" for slot in rate_loops.NAMES)),
            )
        if self.optical:
            vars(self).update(
                slots={**self.slots, **optical_loop.slots()},
                wires=optical_loop.wires(self.wires),
                factors={k: v for k, v in self.factors.items() if k not in optical_loop.INSTEAD} | optical_loop.FACTORS,
                channels=tuple(dict.fromkeys((*self.channels, *optical_loop.CHANNELS))),
                noises=(*self.noises, "tracker.image_noise"),
                loops={**self.loops, **optical_loop.LOOPS},
                shown=("tracker.miss", "tracker.error", "tracker.rate", *self.shown),
                channel_period=optical_loop.CHANNEL_PERIOD,
            )
        vars(self)["channels"] = self._with_limits()

    def phases(self) -> list[LoopPhase]:
        """Return loads, commands, base sines at 0.5, 0.7, 0.9 Hz, a sweep about x, test sines of each axis, drift; with
        an optical loop the test sines of all loops, and the ride.
        """
        if self.optical:
            return [*self.sines(), *optical_loop.phases(self.tracking, self["hold"], self["sweeps"])]
        f = self["frequency"]
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
        return [*phases, *self.sines(), LoopPhase("drift", "hold", settle=3.0, dwell=self["hold"])]

    def sines(self) -> list[LoopPhase]:
        """Return the test sines of each axis."""
        found, size = [], RATE_TEST if self.rates else ANGLE_TEST
        for k, axis in enumerate(AXES if self["sweeps"] else (), 1):
            tones = [self["crossover"] * x for x in (0.3, 0.6, 0.9, 1.2, 2.0, 3.5)]
            found += sweep(f"loop {axis}", "test", tones, size, axis=k, settle=4.0, periods=20)
        return found

    def crossovers(self) -> dict[str, float]:
        """Return those of the stabilizers, or of the tracking loops outside of them."""
        return dict.fromkeys(optical_loop.LOOPS, self.tracking) if self.optical else super().crossovers()

    def design(self, parts: PartValues) -> dict[str, Any]:
        found: dict[str, Any] = {
            "platform.theta_0": [self["pitch"], self["roll"], self["azimuth"]],
            "decoupler.theta_f_max?": 80 * DEG,
            **(self.servos(parts) if self.rates else three_gyros(parts, self["crossover"])),
        }
        for slot in (n for n in ESTIMATORS if n in self.slots):
            density = f"rebalance_{slot[-1]}.meter" if self.rates else f"{ESTIMATORS[slot]}.pickoff"
            found |= self.estimator(slot, parts[density] ** 2 / self.step)
        return found

    def servos(self, parts: PartValues) -> dict[str, Any]:
        """Return the parameters of rebalanced gyros and of servos with three loops."""
        start = [self[n] for n in AXES]
        track = 0.0 if self.optical else self["track"]
        found = {"commands.theta_f_max?": 80 * DEG, **rate_loops.design(parts, self["crossover"], track, start, MOTOR)}
        if self.optical:
            found |= optical_loop.design(self["crossover"], self.tracking, len(self.plan().phases))
        return found

    def check(self) -> list[str]:
        problems = [*super().check(), *self.no_choice(loops=(ANGLE, RATE, OPTICAL))]
        if self["track"] > 0.0 and not self.rates:
            problems.append("track: a position loop is one of loops = rate, a tracking loop one of loops = optical")
        if self["track"] > rate_loops.SLOWER * self["crossover"]:
            problems.append(
                f"track = {self['track']:g} Hz: the outer loop is slower than a fifth of the rate loop, up to "
                f"{rate_loops.SLOWER * self['crossover']:g} Hz here"
            )
        if self.rates and self.step > CURRENT_STEP:
            problems.append(
                f"step = {self.step:g} s: the current loops cross at {rate_loops.CURRENT:g} Hz and want "
                f"{CURRENT_STEP:g} s at most"
            )
        return problems

    def estimator(self, slot: str, variance: float) -> dict[str, float]:
        """Return what an estimator of a gyro's signal is set to: the variance of a reading, and a band five times the
        crossover, which costs the loop a degree of phase at most.
        """
        values = {"R": variance, "R0": variance, "sigma": math.sqrt(variance), "Ts": self.step}
        values["q"] = (2.0 * math.pi * 5.0 * self["crossover"]) ** 4 * variance * self.step
        return {f"{slot}.{name}?": x for name, x in values.items()}
