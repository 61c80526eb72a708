"""A platform axis held by a motor; a floated two-degree-of-freedom gyro on it is the sensor only."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from gyrobench.system.families.loop_test import OneAxisTest, data_sheet, hold, noises, stabilizer, torquer
from gyrobench.system.loop_plan import LoopPhase, sweep
from gyrobench.system.part_files import has_port
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot

from .closed import DoubleLoop, LagLeadLoop, double_gains, rc_times

RANGE = 0.1  # rad, of the pickoffs
CAGE = 12.0  # A/V, from u_y to the torquer about x: the second channel follows the case with about 10 1/s
MOTORS = {  # 27 V make 2.7 N.m in both; the ideal one at once, without lag and back EMF
    "ideal": {"k_t": 1.0, "R": 10.0, "L": 0.0, "k_e": 0.0},
    "real": {"k_t": 1.0, "R": 10.0, "L": 0.01, "k_e": 1.0},
}
V_MAX, I_MAX = 27.0, 2.7  # V, A
TEST = (0.5, 0.8, 1.2, 1.6, 2.0, 2.5, 3.2, 4.5, 6.5, 9.0, 12.0, 15.0, 18.0, 23.0, 30.0, 45.0)  # Hz
MOTION = (0.5, 1.0, 2.0, 5.0, 10.0)  # Hz
TIMES = ("tau1", "T1", "tau2", "T2")
NAMES = ("platform.J", "platform.k_t", "platform.R", "gyro.K_sg_x", "stabilizer.K", *(f"stabilizer.{n}" for n in TIMES))

DOUBLE = (*NAMES[:4], *(f"stabilizer.{n}" for n in ("K_p", "K_v", "integral")))
RC = ("R1", "C1", "R2", "C2")
SINGLE, TWO = "single", "double"
STABILIZERS = {SINGLE: "stabilizer_lead_lag", TWO: "stabilizer_double_loop"}


def loop_of(parameters: Mapping[str, Any]) -> LagLeadLoop | DoubleLoop | None:
    """Return the closed form of parts with these parameters; None of other ones (another stabilizer)."""
    if all(n in parameters for n in DOUBLE):
        j, k_t, r, k_sg, k_p, k_v, integral = (float(parameters[n]) for n in DOUBLE)
        d = k_v * (1.0 + float(parameters.get("stabilizer.tacho_scale_error", 0.0)))
        k = k_t * float(parameters.get("platform.ratio", 1.0)) / r
        return DoubleLoop(j, k * d, k * k_v * k_p * k_sg, integral)
    if any(n not in parameters for n in NAMES) or parameters.get("stabilizer.integral"):
        return None
    j, k_t, r, k_sg, gain, *times = (float(parameters[n]) for n in NAMES)
    return LagLeadLoop(j, k_sg * gain * k_t * float(parameters.get("platform.ratio", 1.0)) / r, *times)


class StabilizerFloated2dof(OneAxisTest):
    """The gyro's case is fixed to the platform and its rotor keeps its direction; the x pickoff gives the angle of the
    platform, a lag-lead network and a motor turn it back.  A current in the torquer about y precesses the rotor about
    x, and the platform follows.  The second channel, u_y, is caged by its own torquer.

        J_x th'' = M - K_m K_x G(s) th       L = K_m K_x G/(J_x s2),  K_m the motor with its amplifier, K_x the pickoff

    loops = double: a tachometer closes a rate loop inside the position loop of the gyro.
    [STAB-FLOATED-2DOF, STAB-TWO-LOOP; GSP ch. 5, eq. 5-24..5-26, corrected; end of section 5.1.4]
    """

    title = "Stabilizer with a floated two-degree-of-freedom gyro"
    spec = ("STAB-FLOATED-2DOF", "STAB-TWO-LOOP")
    slots = OneAxisTest.with_parts(motion="base_motion", load="load_torque", platform="platform_single_axis") | {
        "gyro": Slot("TwoAxisGyro", "gyro_2dof"),
        "stabilizer": stabilizer("stabilizer_lead_lag"),
    }
    wires = OneAxisTest.wires + """
        exciter.command[1] -> gyro.i_y
        gyro.M_react[1] -> platform.M_gyro
        gyro.u_y -> gyro.i_x
        gyro.u_x -> stabilizer.u
        platform.theta_dot -> stabilizer.rate
        platform.theta -> stabilizer.theta
    """  # fmt: skip
    #: the torquer about y turns the platform about x
    factors = {"exciter.command[1] -> gyro.i_y": torquer("gyro.k_y", 10), "gyro.u_y -> gyro.i_x": CAGE}
    options = {
        "J_x": Option(0.5, "kg.m2", "inertia of the platform"),
        "stiffness": Option(8250.0, "N.m/rad", "K_m K_x: motor with amplifier, times pickoff"),
        "K_G": Option(2.0, "1", "gain of the network at rest"),
        "tau1": Option(0.2, "s", "lag, numerator", 0.0),
        "T1": Option(2.0, "s", "lag, denominator"),
        "tau2": Option(0.03, "s", "lead, numerator", 0.0),
        "T2": Option(0.003, "s", "lead, denominator"),
        "R1": Option(0.0, "Ohm", "RC network of fig. 5-7 in place of the times, lead beside C1; 0: the times", 0.0),
        "C1": Option(0.0, "F", "its capacitor beside R1", 0.0),
        "R2": Option(0.0, "Ohm", "its resistor to ground, in series with C2", 0.0),
        "C2": Option(0.0, "F", "its capacitor to ground; alone: that of the network whose R and C are printed", 0.0),
        "loops": Option(SINGLE, str, "single: the network; double: position loop around a rate loop of a tachometer"),
        "rate_loop": Option(40.0, "Hz", "crossover of the rate loop, loops = double", 0.1),
        "position_loop": Option(10.0, "Hz", "crossover of the position loop around it", 0.01),
        "integral": Option(0.0, "Hz", "corner of the integral part of that position loop; 0: none", 0.0),
        "motor": Option("ideal", str, "ideal: a torque at once; real: with inductance and back EMF"),
        "viscous": Option(0.02, "N.m.s/rad", "viscous friction against the base", 0.0),
        "load": Option(1.0, "N.m", "disturbance torque of the step"),
        "command": Option(5e-3, "rad/s", "rate commanded by the torquer of the gyro"),
        "base": Option("1deg", "rad", "amplitude of the base up to 1 Hz", 0.0),
        "test": Option(1e-3, "V", "amplitude of the test sines from 15 Hz on; below it grows, as the loop leaves less"),
        **hold(30.0),
        "blow": Option(0.0, "N.m", "torque of a last, large disturbance; 0: none"),
        "blow_time": Option(0.1, "s", "how long it acts", 1e-3),
    }
    noises = noises(channels=("_x", "_y"))
    step = 1e-4
    channel_period = 1e-3
    channels = (*OneAxisTest.channels, "stabilizer.e")
    shown = (
        "platform.attitude", "platform.omega", "stabilizer.e", "exciter.torque", "exciter.motion_angle",
        "platform.saturated gyro.saturated",
    )  # fmt: skip

    @property
    def two(self) -> bool:
        """Return whether a tachometer closes a loop inside."""
        return str(self["loops"]) == TWO

    def place(self, slot: str, part: str | Path, bench: Path | None = None) -> None:
        super().place(slot, part, bench)
        if slot == "stabilizer" and not self.two and has_port(part, "rate", bench):
            self.set("loops", TWO)

    def set(self, name: str, value: Any) -> None:
        super().set(name, value)
        if name == "loops" and value in STABILIZERS:
            slot = replace(self.slots["stabilizer"], part=STABILIZERS[str(value)])
            vars(self)["slots"] = {**self.slots, "stabilizer": slot}

    def phases(self) -> list[LoopPhase]:
        settle = 3.0  # s: the slowest pole of the default loop, -4.96 1/s, leaves exp(-7) in the second half
        base = self["base"] * (0.1 if self.two else 1.0)  # the tachometer's motor is at its limit from 0.02 rad/s on
        phases = [
            LoopPhase("load step", "torque", "step", 1, self["load"], settle=1.0, dwell=3.0),
            LoopPhase("command step", "command", "step", 1, self["command"], settle=5.0, dwell=3.0),
            *sweep("loop", "test", TEST, lambda f: self["test"] * max(1.0, 15.0 / f) ** 1.5, settle=settle),
            *sweep("base", "motion", MOTION, lambda f: base / max(1.0, f), settle=settle, dwell=2.0),
            LoopPhase("drift", "hold", settle=settle, dwell=self["hold"]),
        ]
        if self["blow"] != 0.0:
            phases += [
                LoopPhase("blow", "torque", "step", 1, self["blow"], settle=0.5, dwell=self["blow_time"]),
                LoopPhase("after the blow", dwell=3.0),
            ]
        return phases

    def design(self, parts: PartValues) -> dict[str, Any]:
        motor = parts.all_given({f"platform.{n}": v for n, v in self.motor().items()})
        pickoff = parts["gyro.K_sg_x"]
        torque = motor["platform.k_t"] / motor["platform.R"] * parts["platform.ratio"]  # N.m/V
        rate, position, corner = (2.0 * math.pi * self[n] for n in ("rate_loop", "position_loop", "integral"))
        k_p, k_v = double_gains(self["J_x"], torque, pickoff, rate, position, corner)
        return {
            "stabilizer.K_p?": k_p,
            "stabilizer.K_v?": k_v,
            "stabilizer.integral?": corner,
            "platform.J": self["J_x"],
            "platform.viscous?": self["viscous"],
            **{f"{n}?": v for n, v in motor.items()},
            "platform.v_max?": V_MAX,
            "platform.i_max?": I_MAX,
            "gyro.u_max": RANGE * pickoff,
            "gyro.k_y": data_sheet(parts["gyro.k_y"], 10),
            "stabilizer.K?": self["K_G"] * (self["stiffness"] / (pickoff * torque)),  # the amplifier counts to K_m
            **{f"stabilizer.{n}?": value for n, value in self.times().items()},
            "stabilizer.v_max?": V_MAX,
        }

    def times(self) -> dict[str, float]:
        """Return the time constants of the network, those of its resistors and capacitors where they are given."""
        found = rc_times(*(self[n] for n in RC)) if all(self[n] for n in RC) else [self[n] for n in TIMES]
        return dict(zip(TIMES, found, strict=True))

    def motor(self) -> dict[str, float]:
        return MOTORS.get(self["motor"], MOTORS["ideal"])

    def crossovers(self) -> dict[str, float]:
        """Return that of the closed form, where its loop is stable."""
        if self.two:
            return {"stabilizer": self["position_loop"]}
        loop = LagLeadLoop(self["J_x"], self["stiffness"] * self["K_G"], **self.times())
        return {"stabilizer": loop.margin()[0] / (2.0 * math.pi)} if loop.stable() else {}

    def check(self) -> list[str]:
        """Return refusals of values; an unstable loop is let run, warned with its pole."""
        problems = self.not_positive("J_x", "stiffness", "K_G", "T1", "T2") + self.no_choice(
            motor=MOTORS, loops=STABILIZERS
        )
        given = [n for n in RC if self[n]]
        if given and given not in (list(RC), ["C2"]):
            problems.append(
                f"{', '.join(given)}: an RC network has {', '.join(RC)}; C2 alone: the one to be printed for"
            )
        if not self["position_loop"] < self["rate_loop"]:
            problems.append(
                f"position_loop = {self['position_loop']:g} Hz: it must be slower than rate_loop = "
                f"{self['rate_loop']:g} Hz, the loop inside"
            )
        if not self["integral"] < self["position_loop"]:
            problems.append(
                f"integral = {self['integral']:g} Hz: it must be below position_loop = {self['position_loop']:g} Hz"
            )
        most = V_MAX * MOTORS["ideal"]["k_t"] / MOTORS["ideal"]["R"]
        if abs(self["load"]) >= most:
            problems.append(
                f"load = {self['load']:g} N.m: the motor gives {most:g} N.m, and no loop stands against more; "
                "what a larger disturbance does is shown by the option blow"
            )
        return problems

    def warnings(self) -> list[str]:
        times = self.times()
        falling = times["T1"] > times["tau1"] > times["tau2"] > times["T2"]
        return [] if falling else ["the network is not a lag and a lead: T1 > tau1 > tau2 > T2 does not hold"]

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        """Say what is known of the loop before the run; nothing is refused here."""
        loop = loop_of(parameters)
        at = loop.limit() if loop is not None and loop.stable() else None
        if at is not None and at[1] < 1.0 and abs(self["blow"]) > 0.0:
            logging.getLogger("gyrobench").warning(
                "%s: the loop is conditionally stable: it becomes unstable at %.3g of its gain, where it swings with "
                "%.3g Hz; a motor at its limit lowers the gain, and the blow may bring it there",
                self.name, at[1], at[0] / (2.0 * math.pi),
            )  # fmt: skip
        return []
