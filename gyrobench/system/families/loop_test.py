"""Tests of loops that hold a platform: excitation by load, command, test signal and base, and a drift hold.

    class Mine(OneAxisTest):
        slots = OneAxisTest.with_parts(motion=..., load=..., platform=...) | {"gyro": Slot("SdfGyro", ...), ...}
        wires = OneAxisTest.wires + "gyro.u -> stabilizer.u"
        options = {"crossover": Option(10.0, "Hz", "..."), **hold(30.0)}

        def phases(self): return [LoopPhase("load step", ...), *sweep("loop", "test", ...), LoopPhase("drift", ...)]
        def design(self, parts): return {"stabilizer.K": wc / parts["gyro.K_sg"]}

A design follows the values that the parts in the slots have; where a loop will not cross where it was asked to, the
user is told before the run, with what was set or swapped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from gyrobench.record.motion_profile import read_profile
from gyrobench.system.families.option_groups import GYRO_NOISES
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import LIMIT
from gyrobench.system.sockets import socket
from gyrobench.system.system import Option, Slot, System

AXES = ("pitch", "roll", "azimuth")  # motor axes in A order
#: the exciter moves the base, by its signals
MOVED = "exciter -> motion: motion_angle motion_rate motion_acceleration\n"
#: the base flies legs, in the phases that the exciter counts
FLOWN = "exciter -> motion: phase gate\n"
PROFILE = {"profile": Option("", str, "CSV file with the recorded motion of the base (time, pitch, roll, heading)")}


def hold(time: float, least: float = 1.0) -> dict[str, Option]:
    """Return the option with the length of the drift hold, s."""
    return {"hold": Option(time, "s", "length of the drift hold", least, 3600.0)}


def noises(gyros: Iterable[str] = ("gyro",), channels: Sequence[str] = ("",)) -> tuple[str, ...]:
    """Return the noises of gyros; channels: "_x", "_y" of those with two degrees of freedom."""
    return tuple(f"{g}.{n}{c}" for g in gyros for n in GYRO_NOISES for c in channels)


def three(*names: str) -> tuple[str, ...]:
    """Return "name[1]", "name[2]", "name[3]" of each name."""
    return tuple(f"{name}[{k}]" for name in names for k in (1, 2, 3))


def data_sheet(value: float, decimals: int = 9) -> float:
    """Return a scale factor as a data sheet prints it; the test gives it to gyro and design alike."""
    return round(value, decimals)


def torquer(name: str, decimals: int | None = None) -> Callable[[PartValues], float]:
    """Return the factor from a commanded rate to the current of a torquer with the scale factor "slot.parameter"."""

    def factor(parts: PartValues) -> float:
        return 1.0 / (parts[name] if decimals is None else data_sheet(parts[name], decimals))

    return factor


def by_phase(
    labels: Sequence[str], signals: Sequence[str], rows: Mapping[str, Mapping[str, float]]
) -> dict[str, list[float]]:
    """Return signals of a motion, each with its value in every phase, 0 where it has none.

    labels: of the phases in their order; those beyond LIMIT, which a plan refuses, are left out.  rows: label -> signal
    -> value.
    """
    table = {name: [0.0] * LIMIT for name in signals}
    for k, label in enumerate(labels[:LIMIT]):
        for name, value in rows.get(label, {}).items():
            table[name][k] = value
    return table


def stabilizer(part: str = "", signal: str = "angle") -> Slot:
    """Return the slot of a stabilizer; signal: "angle" or "rate", what the gyro tells it."""
    return Slot("Stabilizer", part, {"u": signal})


#: what these limit is a gain, which stays linear: a system records it where it wants to say so
GAINS = ("Decoupler", "LosDecoupler")


def _has_limit(slot: Slot) -> bool:
    """Return whether a part there says that a signal is at a limit."""
    return slot.socket not in GAINS and socket(slot.socket).connector("saturated") is not None


class LoopTest(System):
    """Exciter and motion of the base; the plan of a system is its ``phases``, its parameters are its ``design``."""

    slots: ClassVar[dict[str, Slot]] = {
        "exciter": Slot("Excitation", "exciter"),
        "motion": Slot("Motion"),
        "load": Slot("Load"),
    }
    wires = "exciter -> load: torque\n"
    done = "exciter.done"

    def __init__(self) -> None:
        """Record what says that a part is at a limit, of every part: what was measured then is not the linear loop."""
        super().__init__()
        vars(self)["channels"] = self._with_limits()

    def _with_limits(self) -> tuple[str, ...]:
        """Return the channels with the flags of all parts that have a limit."""
        flags = [f"{name}.saturated" for name, slot in self.slots.items() if _has_limit(slot)]
        return tuple(dict.fromkeys((*self.channels, *flags)))

    def phases(self) -> list[LoopPhase]:
        """Return what the test does, one after the other."""
        return []

    def design(self, parts: PartValues) -> dict[str, Any]:
        """Return the parameters that follow from options and parts, beside plan, motion and what options own."""
        return {}

    def plan(self) -> LoopPlan:
        """Return the phases, or a ride by the recorded motion."""
        return LoopPlan([LoopPhase("ride", dwell=self["hold"])] if self.values.get("profile") else self.phases())

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {**self.plan().parameters(), **self.recorded_motion(), **self.owned(), **self.design(parts)}

    def recorded_motion(self) -> dict[str, Any]:
        """Return the parameters of a recorded motion of the base, from the ride on, or behind all that is excited."""
        if not self.values.get("profile"):
            return {}
        found = read_profile(Path(self.values["profile"]))
        phases = self.plan().phases
        excited = [k + 1 for k, p in enumerate(phases) if p.kind != "hold"]
        first = next((k for k, p in enumerate(phases) if p.label == "ride"), max(excited, default=0))
        began = sum(p.duration() for p in phases[:first])
        return {**found, "motion.profile_t": [began + t for t in found["motion.profile_t"]]}

    def asked(self) -> list[str]:
        """Return the labels in the option phases."""
        return [str(p) for p in self["phases"].replace(",", " ").split()]

    def not_offered(self, labels: Sequence[str]) -> list[str]:
        """Return a sentence for each phase that is asked for and is none of these."""
        return [f"phases: '{p}' is none of {', '.join(labels)}" for p in self.asked() if p not in labels]

    def crossovers(self) -> dict[str, float]:
        """Return the option crossover, for all loops, where a system has one."""
        return dict.fromkeys(self.loops, self["crossover"]) if "crossover" in self.options else {}

    def not_positive(self, *names: str) -> list[str]:
        """Return a sentence for each option that must be above 0 and is not."""
        return [f"{n} = {self[n]:g} {self.options[n].unit}: must be > 0" for n in names if not self[n] > 0.0]

    def no_choice(self, **choices: Iterable[str]) -> list[str]:
        """Return a sentence for each option that is none of its choices."""
        return [f"{n} = {self[n]}: must be one of {', '.join(c)}" for n, c in choices.items() if self[n] not in c]


class OneAxisTest(LoopTest):
    """A platform with one axis, moved with its base."""

    slots: ClassVar[dict[str, Slot]] = LoopTest.slots | {"platform": Slot("PlatformAxis")}
    wires = (
        MOVED
        + LoopTest.wires
        + """
        exciter.test[1] -> stabilizer.test
        motion -> platform: omega=omega_b alpha=alpha_b f=f_b
        load.M[1] -> platform.M_load
        platform -> gyro: omega f
        stabilizer -> platform: v
        """
    )
    loops: ClassVar[dict[str, str]] = {"stabilizer": "stabilizer.u"}
    channels: ClassVar[tuple[str, ...]] = (
        "exciter.phase", "exciter.gate", "exciter.torque[1]", "exciter.command[1]", "exciter.test[1]",
        "exciter.motion_angle[1]", "platform.attitude", "platform.omega[1]",
    )  # fmt: skip


class ThreeAxisTest(LoopTest):
    """A platform with three motor axes: gyro signals distributed by a decoupler, a stabilizer for each axis."""

    wires = LoopTest.wires + """
        load.M -> platform.M_load
        motion -> platform: omega=omega_b alpha=alpha_b f=f_b
        platform -> decoupler: theta
        """ + "".join(
        f"""
        decoupler.u_axes[{k}] -> {axis}.u
        exciter.test[{k}] -> {axis}.test
        {axis}.v -> platform.v[{k}]
        """
        for k, axis in enumerate(AXES, 1)
    )  # fmt: skip
    loops: ClassVar[dict[str, str]] = {axis: f"{axis}.u" for axis in AXES}


def commanded(rates: str) -> dict[str, Callable[[PartValues], float]]:
    """Return the wires from three commanded rates to the torquers of two gyros, each with its factor: a current is the
    rate over the scale factor that the torquer is believed to have.
    """
    return {
        f"{rates}[1] -> gyro_b.i_x": torquer("gyro_b.k_x"),
        f"{rates}[2] -> gyro_a.i_y": torquer("gyro_a.k_y"),
        f"{rates}[3] -> gyro_a.i_x": torquer("gyro_a.k_x"),
        f"{rates}[3] -> gyro_b.i_y": torquer("gyro_b.k_y"),
    }


class TwoGyroTest(ThreeAxisTest):
    """A platform of rate servos with two gyros, their rotors at right angles: gyro_a feels y and z, gyro_b z and x.

    L(s) = feedback / (s (lag s + 1))      for each axis, with the resolver at every azimuth
    """

    #: rows: gyro axes x, y, z (rotor) in platform axes
    mounts: ClassVar[dict[str, list[list[int]]]] = {
        "gyro_a": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
        "gyro_b": [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
    }
    signals: ClassVar[dict[str, str]] = {"pitch": "gyro_b._y", "roll": "gyro_a._x", "azimuth": "gyro_a._y"}
    tones: ClassVar[tuple[float, ...]] = ()  # Hz, of the sweeps
    slots: ClassVar[dict[str, Slot]] = LoopTest.slots | {
        "platform": Slot("Platform"),
        **{gyro: Slot("TwoAxisGyro") for gyro in mounts},
        "decoupler": Slot("Decoupler"),
        **{axis: stabilizer() for axis in AXES},
    }
    sensed: ClassVar[str] = """
        platform -> gyro_a: omega f
        platform -> gyro_b: omega f
        gyro_b.u_y -> decoupler.u[1]
        gyro_a.u_x -> decoupler.u[2]
        gyro_a.u_y -> decoupler.u[3]
        """
    wires = FLOWN + ThreeAxisTest.wires + sensed
    options: ClassVar[dict[str, Option]] = {
        "feedback": Option(40.0, "1/s", "rate of a servo for an angle of the platform", 1.0),
        "load": Option(50.0, "N.m", "disturbance torque of the steps"),
        **hold(20.0),
    }
    noises = noises(mounts, ("_x", "_y"))
    step = 5e-4
    channel_period = 2e-3
    bodies = """
        base: z motion.angle[3], x motion.angle[1], y motion.angle[2]
        outer gimbal: base, outer platform
        middle gimbal: outer gimbal, middle platform
        inner element: middle gimbal, z platform.theta[3]
    """

    @property
    def wait(self) -> float:
        """Return the time, s, of which 7 / feedback lets the loops settle, twice."""
        return 14.0 / float(self["feedback"])

    def steps(self) -> list[LoopPhase]:
        """Return a step of load and a sweep of the loop for each axis."""
        long = 2 * self.wait
        found = [
            LoopPhase(f"load on {axis}", "torque", "step", k, self["load"], settle=long, dwell=long)
            for k, axis in enumerate(AXES, 1)
        ]
        for k, axis in enumerate(AXES, 1):
            found += sweep(f"loop {axis}", "test", self.tones, 0.02, axis=k, settle=self.wait)
        return found

    def drift(self) -> LoopPhase:
        """Return the drift hold."""
        return LoopPhase("drift", "hold", settle=2 * self.wait, dwell=self["hold"])

    def design(self, parts: PartValues) -> dict[str, Any]:
        """Return pickoffs for +-0.1 rad, a resolver whose secant grows to 10, and channels of ``feedback``."""
        found: dict[str, Any] = {
            "motion.earth_rate?": 0.0,
            "platform.rate_max": self["rate_max"],
            "decoupler.form?": 1,
            "decoupler.theta_f_max?": math.acos(0.1),
        }
        for gyro, mount in self.mounts.items():
            found |= {f"{gyro}.mount": mount, f"{gyro}.u_max": 0.1 * parts[f"{gyro}.K_sg_x"]}
        for axis, signal in self.signals.items():
            pickoff = parts[signal.replace("._", ".K_sg_")]
            found |= {f"{axis}.{n}?": 1.0 for n in ("tau1", "T1", "tau2", "T2")}
            found[f"{axis}.K"] = self["feedback"] / (pickoff * parts["platform.rate_gain"])
        return found

    def misplaced(self, parts: PartValues) -> dict[str, Any]:
        """Return the gyros with the errors of their mounting and of their torquers, options of some of these tests."""
        from scipy.spatial.transform import Rotation

        found: dict[str, Any] = {}
        for sign, (gyro, mount) in zip((1.0, -1.0), self.mounts.items(), strict=True):
            error = Rotation.from_rotvec(np.full(3, sign * self["mounting"])).as_matrix()
            found[f"{gyro}.mount"] = (np.array(mount, float) @ error).tolist()
            found |= {f"{gyro}.{k}": parts[f"{gyro}.{k}"] * (1.0 + self["torquer"]) for k in ("k_x", "k_y")}
        return found

    def crossovers(self) -> dict[str, float]:
        """Return where |L| = 1, at the feedback, the lag of the servos left out."""
        return dict.fromkeys(AXES, self["feedback"] / (2.0 * math.pi))

    def check(self) -> list[str]:
        if self["feedback"] * self.step > 0.05:
            return [
                f"feedback = {self['feedback']:g} 1/s: the loop is closed through a delay of one step, {self.step:g} "
                f"s, which wants a crossover up to 1/(20 step) = {0.05 / self.step:g} 1/s"
            ]
        return []
