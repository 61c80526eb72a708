"""Finding north by the Earth rate: a gyro on a turning head, or two gyros at rest, with an estimator of the heading."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.system.families.moving_bases import BASES
from gyrobench.system.families.option_groups import NUISANCES, SITE, type_b
from gyrobench.system.families.table_test import TableTest, on_table, sampled
from gyrobench.system.part_files import has_port
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Plan
from gyrobench.system.system import Option, Slot, Windows

from . import after, plans, sources
from .after import OWN, WHITE, RandomErrors
from .measured import MEASURED

FORCE = "\ntable -> gyro: f"  # of a gyro that feels it
SOUGHT = "sequencer -> table: mode target face"
SEEKING = "sequencer -> table: mode face\n    sequencer -> finder: target\n    finder.command -> table.target"
UNKNOWN = 1e-9  # density of a gyro that does not state its noise, rad/s/sqrt(Hz): the finder needs one
FACES = {plans.FACE: np.eye(3).tolist()}


class NorthFinding(TableTest):
    """The heading of a head from the horizontal Earth rate: two, four or several positions, continuous rotation, with
    the tilt measured, or strapdown.  The method is the estimator in the slot finder, and its plan.

    [NORTH-COMMON, NORTH-2POS, NORTH-4POS, NORTH-CONT, NORTH-TILT, NORTH-STRAPDOWN, NORTH-DRIFT; GSP ch. 5,
    section 5.3.2]
    """

    title = "North finding by gyro"
    spec = (
        "NORTH-COMMON", "NORTH-2POS", "NORTH-4POS", "NORTH-CONT", "NORTH-TILT", "NORTH-STRAPDOWN", "NORTH-DRIFT",
        "NORTH-AFTER",
    )  # fmt: skip
    protocol = "design"
    slots = {
        **on_table(
            table=Slot("Table", "table_rate"),
            gyro=Slot("RateGyro", "gyro_rate"),
            accelerometers=Slot("Accelerometers", "accelerometer_triad"),
            finder=Slot("NorthFinder", "northfinder_four_position"),
        ),
        "sampler_x": Slot("Sampler", "sampler"),
        "level_x": Slot("Sampler", "sampler"),
        "level_y": Slot("Sampler", "sampler"),
    }
    wires = f"""
        {TableTest.wires}
        {sampled("sampler_x")}
        {sampled("level_x")}
        {sampled("level_y")}
        table -> gyro: omega
        table -> accelerometers: f
        gyro.rate -> finder.rate
        accelerometers -> finder: f_read=f
        table -> finder: angle_read=angle
        sequencer -> finder: gate phase done=finished
        gyro.rate[2] -> sampler.x
        gyro.rate[1] -> sampler_x.x
        accelerometers.f_read[1] -> level_x.x
        accelerometers.f_read[2] -> level_y.x
    """
    options = (
        {
            "method": Option("four", str, f"{', '.join(plans.PARTS)}, or auto: the shortest that reaches `wanted`"),
            "time": Option(300.0, "s", "total time: moves, settling, readings", 2.0),
            "wanted": Option(0.0, "rad", "standard deviation of the heading wanted (method auto)", 0.0),
            "rough": Option("90deg", "rad", "rough heading, known beforehand", -math.pi, math.pi),
            "sigma_rough": Option(
                0.0, "rad", "standard uncertainty of the rough heading (method two, measured data); 0: not stated", 0.0
            ),
            "level": Option(True, bool, "the head is levelled: methods that take it for level may be chosen (auto)"),
            "axes": Option(1, int, "axes of the gyro (method auto)", 1, 2),
            "positions": Option(12, int, "positions a turn (method several)", 3, 36),
            "back": Option(False, bool, "positions forwards, then backwards: a linear drift of the bias cancels"),
            "turns": Option(5.0, "1", "turns of the head (methods continuous, tilt)", 0.5, 100.0),
            "drift_order": Option(0, int, "power of time up to which a drift of the bias is estimated", 0, 3),
            "settle": Option(0.5, "s", "wait after each move", 0.0),
            "windows": Option(32, int, "averaging windows of all positions together", 8, 1000),
            "heading": Option("40deg", "rad", "true heading of the head (simulated)", -math.pi, math.pi),
            "pitch": Option(0.0, "rad", "true pitch, up positive (simulated)", -1.5, 1.5),
            "roll": Option(0.0, "rad", "true roll, right side down positive (simulated)", -1.5, 1.5),
            "base": Option("rest", str, f"what the head stands on (simulated): {', '.join(BASES)}"),
            "density": Option(0.0, "rad/s/sqrt(Hz)", "white noise of the gyro; 0: of the gyro in the slot", 0.0),
        }
        | SITE
        | NUISANCES
        | type_b("latitude", sources)
    )  # fmt: skip
    noises = (
        "gyro.turn_on_x", "gyro.turn_on_y", "gyro.markov_x", "gyro.markov_y", "gyro.white_x", "gyro.white_y",
        "accelerometers.white_x", "accelerometers.white_y", "accelerometers.white_z",
    )  # fmt: skip
    assumed = ("gyro.mount", "gyro.scale", "accelerometers.mount", "accelerometers.scale", "accelerometers.bias")
    measured_data = MEASURED
    windows = Windows.of(
        "sampler", mean_x="sampler_x.mean", f_x="level_x.mean", f_y="level_y.mean", std_x="sampler_x.std"
    )
    done = "finder.done"
    channels = ("finder.heading", "finder.sigma", "finder.status", "finder.horizontal", "table.angle")
    channel_period = 1.0
    shown = ("finder.heading", "finder.sigma", "finder.horizontal")

    def set(self, name: str, value: Any) -> None:
        """Set an option; the method puts its estimator, a moving base its ground into the slots."""
        super().set(name, value)
        if name in ("method", "base", "wanted", "density", "latitude", "rough", "level", "axes", "settle"):
            part = plans.PARTS.get(self.chosen, self.slots["finder"].part)
            moving = "site" if self["base"] == "rest" else "ground_motion"
            vars(self)["slots"] = {
                **self.slots,
                "finder": replace(self.slots["finder"], part=part),
                "site": replace(self.slots["site"], part=moving),
            }
            wired = (SOUGHT, SEEKING) if self.chosen == "null" else (SEEKING, SOUGHT)
            vars(self)["wires"] = self.wires.replace(*wired)

    def place(self, slot: str, part: str | Path, bench: Path | None = None) -> None:
        super().place(slot, part, bench)
        if slot == "gyro" and FORCE not in self.wires and has_port(part, "f", bench):
            vars(self)["wires"] = self.wires + FORCE

    @property
    def auto(self) -> tuple[float, str] | None:
        """Total time, s, and method, where the shortest is asked for; None otherwise, or without what it needs."""
        if self["method"] != "auto" or not (self["wanted"] > 0.0 and self["density"] > 0.0):
            return None
        return plans.shortest(self.values, self.step)

    @property
    def chosen(self) -> str:
        """The method; of auto the shortest."""
        given = "four" if self["method"] == "auto" else str(self["method"])  # check() says what is missing
        return self.auto[1] if self.auto else given

    @property
    def total(self) -> float:
        """Total time, s: the option, or what the method auto needs."""
        return self.auto[0] if self.auto else float(self["time"])

    def plan(self) -> Plan:
        if self.chosen not in plans.PARTS:
            return Plan()  # check() says why
        found = plans.phases(
            self.chosen, self.total, self["positions"], self["back"], self["turns"], self["settle"], self["windows"],
            self.step,
        )  # fmt: skip
        return Plan(found, FACES)

    def base(self) -> Array:
        """Axes of the head at table angle 0: heading, then pitch about x, then roll about y.  [NORTH-COMMON]"""
        R = [
            frames.rotation(axis, angle).T
            for axis, angle in ((frames.N, self["roll"]), (frames.E, self["pitch"]), (frames.U, -self["heading"]))
        ]
        return np.asarray(R[0] @ R[1] @ R[2])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        gravity = self["gravity"] or frames.normal_gravity(self["latitude"], self["height"])
        finder = {
            "finder.latitude?": self["latitude"],
            "finder.gravity?": gravity,
            "finder.density?": self["density"] or self._density(parts) or UNKNOWN,
        }
        if self["drift_order"]:
            finder["finder.ramp?"] = self["drift_order"]
        if self.chosen in plans.SIDED:
            finder["finder.rough?"] = self["rough"]
        moved = {"table.acceleration": plans.ACCELERATION, "table.index_rate": plans.RATE}
        return {**super().parameters(parts), **moved, **BASES.get(self["base"], {}), **finder}

    def _density(self, parts: PartValues) -> float:
        """Return the white noise of the gyro in the slot, as its parameters state it."""
        rate = _random_errors(parts)
        return rate.white if rate else 0.0

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        if not self["density"] and _random_errors(parameters) is None:
            problems.append(
                "density unknown: the parameters of the gyro do not state its white noise; give the option density "
                "(the output density of the gyro, as 0.3deg/h/sqrt(Hz))"
            )
        return problems

    def check(self) -> list[str]:
        problems = super().check()
        known = [*plans.PARTS, "auto"]
        if self["method"] not in known:
            return [*problems, f"method = {self['method']}: must be one of {', '.join(known)}"]
        if self["base"] not in BASES:
            problems.append(f"base = {self['base']}: must be one of {', '.join(BASES)}")
        if self["method"] == "auto" and self.auto is None:
            problems.append("method = auto: give what is wanted and the noise of the gyro: wanted=1arcmin, "
                            "density=0.3deg/h/sqrt(Hz)")  # fmt: skip
        if abs(self["latitude"]) > math.radians(85.0):
            problems.append(
                f"latitude = {math.degrees(self['latitude']):.4g}°: within 5° of a pole the horizontal Earth rate is "
                "below 9 % of that at the equator; no north finder by Earth rate"
            )
        problems += after.lost(self.chosen, self["u_bias"], self["latitude"])
        lost = plans.overhead(self.chosen, self["positions"], self["back"], self["settle"], self.step)
        least = 5.0 * self.step * (self["windows"] + self["positions"])
        if self.total - lost <= least:
            problems.append(
                f"time = {self.total:.4g} s: moves and settling take {lost:.4g} s, the readings need {least:.3g} s more"
            )
        if self["drift_order"] and (self.chosen.startswith("strapdown") or self.chosen == "null"):
            problems.append(f"drift_order: of the methods with one gyro axis and fixed positions, not of {self.chosen}")
        if self.chosen in ("two", "null", "strapdown two") and self["back"]:
            problems.append(f"back: the method {self.chosen} has two positions only; a drift cancels with four")
        return problems

    def warnings(self) -> list[str]:
        found = []
        if abs(self["latitude"]) > math.radians(80.0):
            factor = math.cos(math.radians(40.0)) / math.cos(self["latitude"])
            found.append(f"Latitude above 80°: the error of the heading is {factor:.2g} times that at 40°.")
        near = min(abs(self["rough"]), math.pi - abs(self["rough"]))
        if self.chosen == "two" and near < plans.MARGIN:
            found.append("Two positions near north or south: the heading is ill-conditioned; take four.")
        if self.chosen in plans.SIDED and math.sin(self["rough"]) * math.sin(self["heading"]) < 0.0:
            found.append(
                "Two positions have two headings, ψ and −ψ, and no residual tells them apart: rough lies on the other "
                "side of the meridian than the heading and will choose the wrong one. Correct rough, or take a third "
                "position, at 90° to the two (method four or several)."
            )
        tilted = max(abs(self["pitch"]), abs(self["roll"]))
        if tilted > 1e-5 and self.chosen in ("two", "null", "four", "several", "continuous"):
            found.append(
                f"The head is tilted by up to {math.degrees(tilted):.3g}°, the method {self.chosen} takes it for "
                "level: the heading is wrong by the tilt about north times tan(latitude); take tilt or strapdown."
            )
        off = 0.375 * (self["pitch"] ** 2 + self["roll"] ** 2)  # largest, see NORTH-TILT
        if self.chosen == "tilt" and off > 0.1 * math.radians(1.0 / 60.0):
            found.append(
                f"Tilt of {math.degrees(tilted):.3g}°: the finder of the method tilt is right to first order, its "
                f"heading wrong by up to {math.degrees(off) * 60.0:.2g}′; the reduction, and strapdown two, are "
                "right at any tilt."
            )
        return found


def _random_errors(values: Mapping[str, Any] | PartValues) -> RandomErrors | None:
    """Return the random errors of the gyro as far as its white noise; None where its parameters do not state it."""
    return RandomErrors.of({n: values[f"gyro.{n}"] for n in (*WHITE, *OWN) if f"gyro.{n}" in values})
