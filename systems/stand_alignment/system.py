"""Azimuth and elevation of a table's axis against the pole: Polaris or a north finder, mirror and inclinometer."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from gyrobench.result import Result
from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.option_groups import CORRECTIONS, type_b
from gyrobench.system.families.table_test import sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot, System, Windows
from gyrobench.units import DEG

from . import polaris, sources
from .measured import MEASURED

STAR, MIRROR, AXIS, HEAD = 1.0, 2.0, 3.0, 4.0
BY = {"star": STAR, "gyro": HEAD}  # what the azimuth is from
FACE = "stand"
LOWEST = 8.0 * DEG  # of Polaris, for a refraction that holds
SIGHTS = Socket(
    "Theodolite",
    "sights of a star, a mirror and an axis by a plan: target in, circle and level out",
    (
        inp("target", "1", "1 star, 2 mirror, 3 axis, 4 head of a north finder; negative: face right"),
        out("reading", "rad", "horizontal circle, face right less half a turn; or the inclinometer"),
        out("level", "rad", "plate level across the line of sight"),
        out("angle_read", "rad", "the target, as an angle"),
        out("in_position", "1", "1: sighted", whole=True),
    ),
)


def heading_of(result: Result) -> dict[str, str]:
    """Return the options that a north finding gives: its heading and the uncertainty of it.

    Raises LookupError where it has no value.
    """
    found = next((c for c in result.coefficients if c.name == "ψ"), None)
    if found is None or found.no_value:
        raise LookupError("no value of the heading ψ")
    return {"by": "gyro", "heading": f"{found.estimate:.12g}deg", "u_heading": f"{found.u:.6g}deg"}


class StandAlignment(System):
    """A theodolite before a test stand sights Polaris and a mirror on the stand, in both faces, and an inclinometer
    reads the stand's axis, turned round: how far the axis is off the pole, about east and across.  Where the sky is not
    to be seen, by = gyro: a mirror on the head of a north finder in place of Polaris.

    [STAND-ALIGNMENT; Hu 1981, section 5.7]
    """

    title = "Alignment of a test stand"
    spec = ("STAND-ALIGNMENT", "ALIGN-ERRORS")
    slots: ClassVar[Mapping[str, Slot]] = {
        "sequencer": Slot("Sequencer", "sequencer"),
        "theodolite": Slot(SIGHTS, "theodolite"),
        "sampler": Slot("Sampler", "sampler"),
        "level_reader": Slot("Sampler", "sampler"),
    }
    wires = f"""
        sequencer -> theodolite: target
        theodolite -> sequencer: angle_read=angle in_position
        theodolite.reading -> sampler.x
        theodolite.level -> level_reader.x
        {sampled("sampler", "theodolite: angle_read")}
        {sampled("level_reader", "theodolite: angle_read")}
    """
    options = {
        "by": Option("star", str, "where the azimuth is from: star, or gyro: the head of a north finder"),
        "heading": Option("20deg", "rad", "azimuth of the mirror on that head, as found", sets="theodolite.head"),
        "latitude": Option(
            "45.75deg", "rad", "geographic latitude, north positive", -89 * DEG, 89 * DEG, sets="theodolite.latitude"
        ),
        "longitude": Option("126.63deg", "rad", "geographic longitude, east positive", -math.pi, 2.0 * math.pi),
        "start": Option("2026-11-28T12:00", str, "UTC of the first sight, as 2026-11-28T12:00"),
        "ut1_utc": Option(0.0, "s", "UT1 less UTC of the day", -0.9, 0.9),
        "pressure": Option("1013hPa", "Pa", "pressure of the air", 0.0, 2e5, sets="theodolite.pressure"),
        "air": Option("283.15K", "K", "temperature of the air", 220.0, 330.0, sets="theodolite.temperature"),
        "sets": Option(6, int, "sets of mirror, star, star, mirror and both inclinometer readings", 2, 16),
        "settle": Option("60s", "s", "time to turn and to point", 1.0),
        "dwell": Option("20s", "s", "time of a sight", 1.0),
    } | CORRECTIONS | type_b(sources)  # fmt: skip
    takes: ClassVar[Mapping[str, Any]] = {"north_finder": heading_of}
    measured_data = MEASURED
    noises = ("theodolite.pointing", "theodolite.bubble")
    windows = Windows.of("sampler", level="level_reader.mean")
    done = "sequencer.done"
    channels = ("theodolite.reading", "theodolite.level", "theodolite.altitude", "theodolite.angle_read")
    shown = ("theodolite.reading", "theodolite.level", "theodolite.altitude")
    channel_period = 10.0
    step = 0.5  # s: nothing is fast here

    def plan(self) -> Plan:
        each = {"settle": self["settle"], "dwell": self["dwell"], "window": self["dwell"]}
        names = {STAR: "star", MIRROR: "mirror", AXIS: "axis", HEAD: "head"}
        sight = BY.get(self["by"], STAR)
        order = (MIRROR, sight, -sight, -MIRROR, AXIS, -AXIS)
        phases = [
            Phase(f"set {k + 1}: {names[abs(t)]}, {'left' if t > 0 else 'right'}", "index", FACE, t, **each)
            for k in range(self["sets"])
            for t in order
        ]
        return Plan(phases, {FACE: np.eye(3).tolist()})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        H, declination = polaris.hour_angle(polaris.julian(self["start"]), self["longitude"], self["ut1_utc"])
        place = {"theodolite.hour_angle": H, "theodolite.declination": declination}
        return {**self.plan().parameters(), **self.owned(), **place}

    def check(self) -> list[str]:
        problems = [] if self["by"] in BY else [f"by = {self['by']}: must be one of {', '.join(BY)}"]
        try:
            polaris.julian(self["start"])
        except ValueError:
            problems.append(f"start = {self['start']}: write it as 2026-11-28T12:00, in UTC")
        if self["latitude"] < LOWEST and self["by"] == "star":
            problems.append(
                f"latitude = {math.degrees(self['latitude']):.4g}°: Polaris stands too low; from 8° north on, or take "
                "by=gyro"
            )
        return problems
