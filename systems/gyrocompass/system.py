"""Gyrocompass: settling from switch-on, free oscillation, change of speed, turn, rolling between the quarters."""

from __future__ import annotations

import math
from typing import Any

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.loop_test import LoopTest, by_phase
from gyrobench.system.loop_plan import LoopPhase
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot
from gyrobench.units import DEG, G0

from .linear import LIQUID, liquid_decay, liquid_share

MOST = 85.0 * DEG  # latitude
RADIUS = 6.371e6  # m
PHASES = ("settling", "undamped", "speed", "turn", "rolling")
DAMPINGS = ("vertical", "horizontal", "none")
SLEWED, SLEW_TIME = 3.0 * DEG, 120.0  # free oscillation: amplitude, and the time in which it is turned there

SHIP = Socket(
    "ShipMotion",
    "rates of the level axes and specific force of a ship",
    (
        inp("phase", "1", "number of the running phase, from 1"),
        inp("gate", "1", "1 while the manoeuvre acts"),
        out("rate", "rad/s", "inertial rate of the level axes E, N, U", 3),
        out("f", "m/s2", "specific force at the compass, E, N, U", 3),
        out("heading", "rad", "true heading, clockwise"),
        out("speed", "m/s", "speed over the ground"),
        out("latitude_now", "rad", "latitude"),
        out("angle", "rad", "roll, pitch", 2, optional=True),
    ),
)
COMPASS = Socket(
    "Gyrocompass",
    "finds north by the Earth's rate and gravity",
    (
        inp("rate", "rad/s", "inertial rate of the level axes E, N, U", 3),
        inp("f", "m/s2", "specific force at the compass, E, N, U", 3),
        inp("heading", "rad", "heading of the ship, clockwise"),
        inp("speed", "m/s", "speed by the log", optional=True),
        inp("cut", "1", "1: the damping is cut off", optional=True),
        inp("slew", "rad/s", "precession in azimuth asked for, east", optional=True),
        out("psi", "rad", "heading shown, clockwise"),
        out("tilt", "rad", "tilt of the rotor axis, up", optional=True),
    ),
)


def ten(time: float) -> float:
    """Return a time rounded up to ten seconds, so that phases begin with a sample of the record."""
    return 10.0 * math.ceil(time / 10.0)


class GyrocompassTest(LoopTest):
    """A pendulous gyrocompass settles from switch-on, swings undamped, and goes through a change of speed, a turn and
    rolling; its heading is compared with the ship's.

    [GYROCOMPASS; GSP ch. 5, section 5.3.2]
    """

    title = "Gyrocompass"
    spec = ("GYROCOMPASS",)
    slots = {
        "exciter": Slot("Excitation", "exciter"),
        "ship": Slot(SHIP, "ship_motion"),
        "compass": Slot(COMPASS, "gyrocompass"),
    }
    wires = """
        exciter -> ship: phase gate
        ship -> compass: rate f heading speed
        exciter.test[1] -> compass.cut
        exciter.command[1] -> compass.slew
    """
    factors = {"exciter.test[1] -> compass.cut": 1.0}  # 1/V
    options = {
        "phases": Option(" ".join(PHASES), str, f"what is done, of: {' '.join(PHASES)}"),
        "damping": Option("vertical", str, f"torque that damps: {', '.join(DAMPINGS)}"),
        "damping_ratio": Option(0.33, "1", "of the damped oscillation", 0.02, 0.9),
        "period": Option(0.0, "s", "period without damping at the latitude; 0: Schuler's, mgl/H = g/(R w cos L)", 0.0),
        "offset": Option("20deg", "rad", "azimuth of the rotor axis at switch-on, east", -math.pi, math.pi),
        "tilt": Option(0.0, "rad", "its tilt at switch-on, up", -1.0, 1.0, sets="compass.tilt_start"),
        "band": Option("1deg", "rad", "heading error within which it has settled", 1e-4),
        "settle": Option(0.0, "s", "length of the damped phases; 0: eight decay times", 0.0),
        "latitude": Option("40deg", "rad", "geographic latitude", -90 * DEG, 90 * DEG, sets="ship.latitude"),
        "latitude_correction": Option(False, bool, "the latitude error is corrected",
                                      sets="compass.latitude_correction"),
        "speed_correction": Option(False, bool, "the speed error is corrected", sets="compass.speed_correction"),
        "course": Option(0.0, "rad", "course before the turn, clockwise", sets="ship.start_heading"),
        "speed": Option(10.0, "m/s", "speed after the change of speed", 0.0),
        "speed_time": Option(300.0, "s", "time of the change of speed", 1.0),
        "turn": Option("1deg/s", "rad/s", "rate of the turn, clockwise"),
        "turned": Option("135deg", "rad", "angle of the turn", 0.0),
        "cut": Option(True, bool, "the damping is cut off while speed or course change"),
        "roll": Option("10deg", "rad", "amplitude of the roll", 0.0, 1.0),
        "roll_period": Option(10.0, "s", "period of the roll", 1.0),
        "lever": Option(10.0, "m", "height of the compass above the roll axis", sets="ship.lever"),
        "swing_period": Option(60.0, "s", "period of the element's swing about the rotor axis", 1.0,
                               sets="compass.swing_period"),
        "sailing": Option(False, bool, "the latitude follows the way", sets="ship.sailing"),
        "noise": Option("0.01deg/sqrt(Hz)", "rad/sqrt(Hz)", "noise of the reading", 0.0),
        "random_drift": Option("0.0002deg/sqrt(h)", "rad/s/sqrt(Hz)", "angle random walk, azimuth and tilt", 0.0),
        "earth_rate": Option(7.2921159e-5, "rad/s", "Earth rate", 1e-9, sets="ship.earth_rate"),
    }  # fmt: skip
    noises = ("compass.white", "compass.white_az", "compass.white_el")
    step = 0.1
    channels = (
        "exciter.phase", "exciter.gate", "exciter.test[1]", "compass.psi", "compass.tilt", "ship.heading", "ship.speed",
        "ship.latitude_now", "ship.angle[1]",
    )  # fmt: skip
    shown = ("compass.psi ship.heading", "compass.tilt", "ship.speed", "ship.angle", "exciter.test")

    @property
    def north(self) -> float:
        """Return the horizontal Earth rate, rad/s."""
        return float(self["earth_rate"]) * math.cos(self["latitude"])

    @property
    def omega(self) -> float:
        """Return the frequency without damping, rad/s, as the compass is designed."""
        if self["period"] > 0.0:
            return 2.0 * math.pi / float(self["period"])
        return math.sqrt(G0 / RADIUS + self.north**2)

    def damped(self) -> float:
        """Return the length (s) of a damped phase: eight times the slowest decay time."""
        if self["settle"] > 0.0:
            return float(self["settle"])
        ratio = float(self["damping_ratio"])
        if self["damping"] == "vertical":
            return ten(8.0 / (ratio * self.omega))
        if self["damping"] == "horizontal":
            return ten(8.0 / (liquid_decay(liquid_share(ratio)) * self.omega))
        return ten(6.0 * math.pi / self.omega)

    def phases(self) -> list[LoopPhase]:
        """Return the phases asked for, each with what has to come before and after it; the settling is always first."""
        wanted, wait = self.asked(), self.damped()
        free = ten(5.0 * math.pi / self.omega)
        cut: dict[str, Any] = {"kind": "test", "amplitude": 1.0} if self["cut"] else {}
        found = [LoopPhase("settling", dwell=wait)]
        if "undamped" in wanted:
            found += [
                LoopPhase("slew", "command", "step", amplitude=SLEWED / SLEW_TIME, dwell=SLEW_TIME),
                LoopPhase("undamped", "test", "step", amplitude=1.0, dwell=free),
            ]
            if self["damping"] != "none":
                found += [LoopPhase("damped again", dwell=wait)]
        if "speed" in wanted:
            found += [
                LoopPhase("change of speed", shape="step", dwell=self["speed_time"], **cut),
                LoopPhase("steaming", dwell=wait),
            ]
        if "turn" in wanted:
            found += [
                LoopPhase("turn", shape="step", dwell=self["turned"] / abs(self["turn"] or 1.0), **cut),
                LoopPhase("after the turn", dwell=wait),
            ]
        if "rolling" in wanted:
            found += [LoopPhase("rolling", dwell=wait)]
        return found

    def design(self, parts: PartValues) -> dict[str, Any]:
        rows = {
            "change of speed": {"forward": self["speed"] / self["speed_time"]}, "turn": {"turn": self["turn"]},
            "rolling": {"roll": self["roll"], "roll_frequency": 1.0 / self["roll_period"]},
        }  # fmt: skip
        labels = [phase.label for phase in self.phases()]
        table = by_phase(labels, ("forward", "turn", "roll", "roll_frequency"), rows)
        H, omega, ratio = parts["compass.H"], self.omega, self["damping_ratio"]
        pendulum = H * (omega * omega / self.north - self.north)
        liquid = liquid_share(ratio) * H * omega * omega / self.north if self["damping"] == "horizontal" else 0.0
        return {
            **{f"ship.{n}": x for n, x in table.items()},
            "ship.radius?": RADIUS,
            "compass.mgl?": pendulum,
            "compass.D?": 2.0 * ratio * H * omega if self["damping"] == "vertical" else 0.0,
            "compass.C?": liquid,
            "compass.T?": 1.0 / omega,
            "compass.azimuth_start?": self["offset"],
            "compass.latitude?": self["latitude"],
            "compass.earth_rate?": self["earth_rate"],
            "compass.radius?": RADIUS,
            "compass.white?": self["noise"],
            "compass.white_az?": self["random_drift"],
            "compass.white_el?": self["random_drift"],
        }

    def check(self) -> list[str]:
        problems = self.not_offered(PHASES) + self.no_choice(damping=DAMPINGS)
        if abs(self["latitude"]) > MOST:
            problems.append(
                f"latitude = {self['latitude'] / DEG:.4g}°: beyond 85° the horizontal Earth rate gives no direction"
            )
        elif self.omega <= self.north:
            problems.append(
                f"period = {self['period']:g} s: must be below the {2.0 * math.pi / self.north:.6g} s of a compass "
                "without pendulum"
            )
        if self["damping"] == "horizontal" and self["damping_ratio"] > LIQUID:
            problems.append(f"damping_ratio = {self['damping_ratio']:g}: a liquid gives {LIQUID} at most")
        steady = [p for p in self.asked() if p in ("speed", "turn", "rolling")]
        if self["damping"] == "none" and steady:
            problems.append(f"damping = none: {', '.join(steady)} begin with a settled compass; take phases=undamped")
        if "turn" in self.asked():
            problems += self.not_positive("turned")
            if self["turn"] == 0.0:
                problems.append("turn = 0: the turn must have a rate")
        return problems
