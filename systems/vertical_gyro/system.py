"""Vertical gyro with its erection, through erection, rest, acceleration, turn, loop and roll."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench.system.families.loop_test import FLOWN, LoopTest, by_phase
from gyrobench.system.families.option_groups import MOVING
from gyrobench.system.loop_plan import LoopPhase
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot
from gyrobench.units import DEG, G0

PHASES = ("erection", "rest", "acceleration", "turn", "loop", "roll")
LAWS = ("switches", "linear")
PITCH_RATE, ROLL_RATE = 36.0 * DEG, 60.0 * DEG  # of the loop and the roll


class VerticalGyroBench(LoopTest):
    """A vertical gyro is erected from a tilt, rests, and then flies an acceleration, a turn, a loop and a roll; what it
    shows is compared with the vehicle's true pitch and roll.

    [VERTICAL-GYRO; GSP ch. 5, section 5.3.1]
    """

    title = "Vertical gyro"
    spec = ("VERTICAL-GYRO",)
    slots = {
        "exciter": Slot("Excitation", "exciter"),
        "motion": Slot("Motion", "manoeuvre"),
        "gyro": Slot("VerticalGyro", "vertical_gyro"),
        "erection": Slot("ErectionController", "erection_controller"),
    }
    wires = f"""
        {FLOWN}
        motion -> gyro: omega alpha f
        gyro -> erection: e_x e_y f_inner turn
        erection -> gyro: T_x T_y
    """
    options = {
        "phases": Option(" ".join(PHASES), str, f"what is flown, of: {' '.join(PHASES)}"),
        "tilt": Option("2deg", "rad", "tilt of the rotor at the start, about x", 0.0),
        "law": Option("switches", str, f"erection: {' or '.join(LAWS)}"),
        "rate": Option("4deg/min", "rad/s", "erection rate, the largest of the linear law", sets="erection.rate"),
        "dead_zone": Option("10arcmin", "rad", "dead zone of the switches", 0.0, sets="erection.dead_zone"),
        "gain": Option(0.05, "1/s", "linear law: rate per tilt", sets="erection.gain"),
        "cut_off": Option(1, int, "1: the erection is cut off in manoeuvre", 0, 1, sets="erection.cut_off"),
        "fast_time": Option(0.0, "s", "fast start, ten times the rate; 0: none", 0.0, sets="erection.fast_time"),
        "ring": Option(1, int, "1: with follow-up ring", 0, 1, sets="gyro.ring"),
        "acceleration": Option(0.2 * G0, "m/s2", "acceleration forward"),
        "turn": Option("3deg/s", "rad/s", "rate of the turn"),
        "speed": Option(50.0, "m/s", "speed in the turn", 0.0, sets="motion.speed"),
        "time": Option(60.0, "s", "length of erection, rest, acceleration and turn, and of the wait before each"),
        **MOVING,
    }
    noises = ("gyro.white", "gyro.white_y")
    step = 1e-2
    channels = (
        "exciter.phase", "exciter.gate", "motion.angle[1]", "motion.angle[2]", "motion.angle[3]", "gyro.pitch",
        "gyro.roll", "gyro.e_x", "gyro.e_y", "gyro.inner", "gyro.ring_angle", "erection.cut",
    )  # fmt: skip
    shown = (
        "motion.angle", "gyro.pitch gyro.roll", "gyro.e_x gyro.e_y", "gyro.inner", "gyro.ring_angle", "erection.cut",
    )  # fmt: skip
    channel_period = 0.1

    bodies = """
        vehicle: z motion.angle[3], x motion.angle[1], y motion.angle[2]
        as the gyro shows it: z motion.angle[3], x gyro.pitch, y gyro.roll
    """

    def phases(self) -> list[LoopPhase]:
        """Return the phases asked for; before each manoeuvre (not the erection) the vehicle rests for as long."""
        wait = self["time"]
        lengths = {"loop": 2.0 * math.pi / PITCH_RATE, "roll": 2.0 * math.pi / ROLL_RATE}
        return [
            LoopPhase(p, settle=0.0 if p in ("erection", "rest") else wait, dwell=lengths.get(p, wait))
            for p in self.asked()
        ]

    def design(self, parts: PartValues) -> dict[str, Any]:
        rows = {
            "acceleration": {"forward": self["acceleration"]}, "turn": {"turn": self["turn"]},
            "loop": {"pitch": PITCH_RATE}, "roll": {"roll": ROLL_RATE},
        }  # fmt: skip
        table = by_phase(self.asked(), ("forward", "turn", "pitch", "roll"), rows)
        return {
            **{f"motion.{n}": x for n, x in table.items()},
            "gyro.tilt": [self["tilt"], 0.0],
            "erection.H?": parts["gyro.H"],
            "erection.law": LAWS.index(self["law"]) if self["law"] in LAWS else 0,
        }

    def check(self) -> list[str]:
        problems = self.not_offered(PHASES) + self.no_choice(law=LAWS) + self.not_positive("rate", "gain", "time")
        if self["tilt"] > 60.0 * DEG and self["fast_time"] == 0.0:
            problems.append(
                f"tilt = {self['tilt'] / DEG:.3g}°: beyond 60° the switches are of no use; give a fast start, fast_time"
            )
        if not self["ring"] and "loop" in self.asked():
            problems.append(
                "ring = 0: without the follow-up ring the gimbals lock in the loop, at 90° of pitch; take ring=1, or "
                "phases without loop"
            )
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        gyro, erection = parameters.get("gyro.H"), parameters.get("erection.H")
        if gyro is not None and erection is not None and not math.isclose(gyro, erection, rel_tol=1e-6):
            return [f"gyro.H = {gyro:g} and erection.H = {erection:g} N.m.s: the erection must know the gyro's H"]
        return []
