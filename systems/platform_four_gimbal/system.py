"""Four-gimbal platform: an outer roll gimbal with its own servo keeps the inner three away from lock, where it can."""

from __future__ import annotations

import math
from typing import Any

from gyrobench.record.record import Record
from gyrobench.result import LoopResult, Specification
from gyrobench.system import flight_plan
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, System

from .flights import FLIGHTS

DEG = math.pi / 180.0
AXES = ("pitch", "roll", "azimuth")  # the A order: gimbals 3, 2, 1
LAWS = ("secant", "sign", "constant")  # the part's gain 0, 1, 2
K_SG = 10.0  # V/rad, pickoffs
CAP = math.acos(0.1)  # the secant of the inner roll grows to 10
#: rows: gyro axes x, y, z (rotor) in platform axes; gyro_a feels y and z, gyro_b feels z and x
MOUNTS = {"gyro_a": [[0, 1, 0], [0, 0, 1], [1, 0, 0]], "gyro_b": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]}
TEST = (2.5, 5.0, 7.0, 10.0, 14.0)  # Hz
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


class PlatformFourGimbal(System):
    """Gimbals from outside: 4 roll, 3 pitch, 2 inner roll, 1 azimuth.  The inner three are held by two gyros, resolver
    and three channels; the servo of the fourth nulls the inner roll, g4' = k G(g3) g2.

    First the loops and the drift at rest, then one of the flights.
    [PLATFORM-4GIMBAL; GSP ch. 5, section 5.2.2]
    """

    title = "Four-gimbal platform"
    spec = ("PLATFORM-4GIMBAL", "PLATFORM-3GIMBAL-2DOF")
    slots = {
        "exciter": Slot("Excitation", "exciter"),
        "motion": Slot("Motion", "manoeuvre"),
        "load": Slot("Load", "load_torque"),
        "platform": Slot("FourGimbalPlatform", "platform_four_gimbal"),
        "gyro_a": Slot("TwoAxisGyro", "gyro_2dof"),
        "gyro_b": Slot("TwoAxisGyro", "gyro_2dof"),
        "decoupler": Slot("Decoupler", "decoupler_t2"),
        **{axis: Slot("Stabilizer", "stabilizer_lead_lag") for axis in AXES},
    }
    wires = _wires()
    loops = {axis: f"{axis}.u" for axis in AXES}
    open = ("gyro_a.i_x", "gyro_a.i_y", "gyro_b.i_x", "gyro_b.i_y")  # left at their start values
    options = {
        "flight": Option("crossing", str, f"what is flown: {', '.join(FLIGHTS)}"),
        "law": Option("sign", str, f"gain of the fourth servo: {', '.join(LAWS)}"),
        "locked": Option(False, bool, "the fourth gimbal starts locked; it is released off the vertical"),
        "release": Option("80deg", "rad", "pitch below which a locked fourth gimbal is released"),
        "allow_vertical": Option(True, bool, "secant and constant gain at pitch 90 deg too; false: refused there"),
        "k": Option(30.0, "1/s", "servo of the fourth gimbal: rate for an angle", 0.1),
        "feedback": Option(40.0, "1/s", "rate of a servo for an angle of the platform", 1.0),
        "rate_max": Option(5.0, "rad/s", "largest rate of a gimbal", 0.1),
        "load": Option(50.0, "N.m", "disturbance torque of the steps; 0: none, and no sweeps"),
        "hold": Option(20.0, "s", "length of the drift hold before the flight", 1.0),
    }
    noises = tuple(f"{g}.{n}_{c}" for g in MOUNTS for n in ("turn_on", "markov", "white", "pickoff") for c in "xy")
    step = 5e-4
    done = "exciter.done"
    channels = (  # those that a report draws come first
        *(f"platform.attitude[{k}]" for k in (1, 2, 3)), "platform.theta_4", "platform.theta[1]", "platform.theta[2]",
        "platform.theta[3]", "exciter.phase", "exciter.gate", *(f"exciter.torque[{k}]" for k in (1, 2, 3)),
        *(f"exciter.test[{k}]" for k in (1, 2, 3)), *(f"motion.omega[{k}]" for k in (1, 2, 3)),
        *(f"platform.theta_dot[{k}]" for k in (1, 2, 3)), "platform.theta_4_dot", "platform.lock",
        "pitch.e", "roll.e", "azimuth.e", "gyro_a.saturated", "gyro_b.saturated",
    )  # fmt: skip
    channel_period = 2e-3

    def flown(self) -> Any:
        return FLIGHTS.get(self["flight"], FLIGHTS["crossing"])

    def at_rest(self) -> list[LoopPhase]:
        """Steps and sweeps (with a load), and the hold; 7 / feedback lets the loops settle."""
        wait = 14.0 / self["feedback"]
        phases = []
        if self["load"] != 0.0:
            for k, axis in enumerate(AXES, 1):
                phases.append(
                    LoopPhase(f"load on {axis}", "torque", "step", k, self["load"], settle=2 * wait, dwell=2 * wait)
                )
            for k, axis in enumerate(AXES, 1):
                phases += sweep(f"loop {axis}", "test", TEST, 0.02, axis=k, settle=wait)
        return [*phases, LoopPhase("drift", "hold", settle=2 * wait, dwell=self["hold"])]

    def plan(self) -> LoopPlan:
        """The flight comes last, but where it begins out of the null, which would not wait."""
        legs = flight_plan.phases(self.flown().legs)
        return LoopPlan([*legs, self.at_rest()[-1]] if self.flown().inner else [*self.at_rest(), *legs])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        flown = self.flown()
        found: dict[str, Any] = {
            **self.plan().parameters(),
            **flight_plan.parameters(flown.legs, 0 if flown.inner else len(self.at_rest())),
            "motion.earth_rate?": 0.0,
            "motion.start_angle[1]?": flown.pitch,
            "platform.gain": LAWS.index(self["law"]) if self["law"] in LAWS else 0,
            "platform.k": self["k"],
            "platform.launch": int(self["locked"]),
            "platform.release": self["release"],
            "platform.allow_vertical": int(self["allow_vertical"]),
            "platform.rate_max": self["rate_max"],
            "platform.theta_0": [-flown.pitch, flown.inner, 0.0],
            "decoupler.form?": 1,
            "decoupler.mount?": 1,
            "decoupler.theta_f_max?": CAP,
        }
        for gyro, mount in MOUNTS.items():
            found |= {f"{gyro}.mount": mount, f"{gyro}.K_sg_x": K_SG, f"{gyro}.K_sg_y": K_SG, f"{gyro}.u_max": 1.0}
        for axis in AXES:
            found |= {f"{axis}.{n}?": 1.0 for n in ("tau1", "T1", "tau2", "T2")}
            found |= {f"{axis}.K": self["feedback"] / K_SG}
        return found

    def check(self) -> list[str]:
        problems = []
        if self["flight"] not in FLIGHTS:
            problems.append(f"flight = {self['flight']}: must be one of {', '.join(FLIGHTS)}")
        if self["law"] not in LAWS:
            problems.append(f"law = {self['law']}: must be one of {', '.join(LAWS)}")
        if self["feedback"] * self.step > 0.05:
            problems.append(
                f"feedback = {self['feedback']:g} 1/s: the loop is closed through a delay of one step, {self.step:g} "
                f"s, which wants a crossover up to 1/(20 step) = {0.05 / self.step:g} 1/s"
            )
        return problems

    def warnings(self) -> list[str]:
        if self.flown().vertical and not self["locked"] and self["law"] != "sign":
            return [f"law = {self['law']} at pitch 90°: the fourth gimbal turns over there (law=sign does not)"]
        return []

    def reduce(self, record: Record, specification: Specification | None = None) -> LoopResult:
        from .reduction import from_record

        return from_record(record, specification)
