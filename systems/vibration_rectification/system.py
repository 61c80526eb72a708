"""Vibration rectification and g-sensitivity: a gyro and an accelerometer on a shaker, at levels, axis up and down."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.frames import G0
from gyrobench.system.connectors import Socket, inp, limit_flag, out
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SITE, type_b
from gyrobench.system.families.rate_reading import RATE_NOISES
from gyrobench.system.families.table_test import sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot, System, Windows
from gyrobench.system.values import InvalidValueError
from gyrobench.units import DPH

from . import sources
from .measured import MEASURED

AXES = "xyz"
WAYS = ("up", "down")
#: rows: axes x, y, z of the case in east, north, up; the axis along the vibration up, then down
FACES: dict[str, dict[str, Array]] = {
    "x": {"up": np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]), "down": np.array([[0, 0, -1], [1, 0, 0], [0, -1, 0]])},
    "y": {"up": np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]), "down": np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])},
    "z": {"up": np.eye(3), "down": np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1]])},
}
TABLE = Socket(
    "VibrationTable",
    "shaker with a vertical axis: level asked for in, specific force on its plate and control accelerometer out",
    (
        inp("f_local", "m/s2", "specific force at the site, ENU", 3),
        inp("omega_local", "rad/s", "Earth rate at the site, ENU", 3),
        inp("face", "1", "rows: axes of the case in east, north, up", 3, 3),
        inp("level_wanted", "", "rms of the vibration asked for, m/s2"),
        out("omega", "rad/s", "inertial rate, axes of the case", 3),
        out("f", "m/s2", "specific force, axes of the case", 3),
        out("f_control", "m/s2", "vibration as the control accelerometer reads it"),
        out("angle", "rad", "angle about the axis"),
        out("in_position", "1", "1: the table is where it should be", whole=True),
    ),
)
#: of the instruments, unless others are given: 50 ug/g2; 10 deg/h/g and 5 deg/h/g2 along each axis
SQUARE = 50e-6 / G0
LINEAR, QUADRATIC = 10.0 * DPH / G0, 5.0 * DPH / G0**2
ACCELEROMETERS = Socket(
    "ForceTriad",
    "accelerometers: specific force in, measured specific force out",
    (
        inp("f", "m/s2", "specific force, axes of the case", 3),
        out("f_read", "m/s2", "measured specific force along x, y, z", 3),
        limit_flag("saturated", "1 while a specific force is beyond the range"),
    ),
)
PERIODS = 20.0  # of the lowest frequency in a reading


class VibrationRectification(System):
    """A shaker with a vertical axis vibrates a gyro and a triad of accelerometers at levels, one axis of the case up,
    then down.  What the mean readings change by, against gravity and the mean square of the specific force, is the
    g-sensitivity of the gyro, and the rectification of both.

    [TEST-RECTIFICATION; IEEE 1293, IEEE 1431: vibration rectification, acceleration sensitivity]
    """

    title = "Vibration rectification and g-sensitivity"
    spec = ("TEST-RECTIFICATION", "ACCEL-MEMS", "GYRO-VIBRATORY")
    reduction = "reduction"
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot(TABLE, "vibration_table"),
        "gyro": Slot("RateGyro", "gyro_vibratory"),
        "accelerometers": Slot(ACCELEROMETERS, "accelerometer_mems"),
        **{f"sampler_{n}": Slot("Sampler", "sampler") for n in ("gyro", *AXES, "level")},
    }
    wires = f"""
        site -> table: f=f_local omega=omega_local
        sequencer -> table: target=level_wanted face
        table -> sequencer: angle in_position
        table -> gyro: omega f
        table -> accelerometers: f
        gyro.rate[1] -> sampler_gyro.x
        gyro -> sampler_gyro: saturated=flag
        accelerometers.f_read[1] -> sampler_x.x
        accelerometers.f_read[2] -> sampler_y.x
        accelerometers.f_read[3] -> sampler_z.x
        accelerometers -> sampler_level: saturated=flag
        table -> sampler_level: f_control=x
        {"".join(sampled(f"sampler_{n}", "table: angle") for n in ("gyro", *AXES, "level"))}
    """
    options = (
        SITE
        | {
            "axis": Option("x", str, "axis of the case along the vibration: x, y or z"),
            "levels": Option("0 0.7 1 1.4 1.7", str, "rms of the vibration, g; 0 comes first"),
            "ways": Option("up down", str, "how the axis points: up, down, or both"),
            "low": Option("20Hz", "Hz", "lowest frequency of the vibration", 1e-2, sets="table.low"),
            "high": Option("200Hz", "Hz", "highest frequency", 1e-2, sets="table.high"),
            "lines": Option(12, int, "sines: 12, noise in the band; 1: a sine at low", 1, 12, sets="table.lines"),
            "window": Option(2.0, "s", "time of a reading, after which the vibration repeats itself", 1e-2,
                             sets="table.repeat"),
            "readings": Option(6, int, "readings at each level", 2, 1000),
            "cycles": Option(2, int, "times the levels are gone through in each position", 1, 9),
            "settle": Option(1.5, "s", "wait before the readings, in which the level is reached", 0.6),
        }
        | NUISANCES
        | CORRECTIONS
        | type_b("latitude", sources, "gravity")
    )  # fmt: skip
    noises = ("table.control", *RATE_NOISES, "gyro.pickoff",
              *(f"accelerometers.{n}" for n in ("turn_on", "white", *(f"{a}_{m}" for a in AXES
                                                                     for m in ("flicker", "walk")))))  # fmt: skip
    assumed = ("gyro.mount", "accelerometers.mount")
    measured_data = MEASURED
    done = "sequencer.done"
    step = 5e-4
    windows = Windows(
        "sampler_gyro.count",
        {
            "phase": "sampler_gyro.window_phase",
            **{n: f"sampler_gyro.{n}" for n in ("t_start", "t_end", "n", "flagged")},
            "rate": "sampler_gyro.mean",
            **{f"force_{a}": f"sampler_{a}.mean" for a in AXES},
            "level": "sampler_level.std",
            "flagged_force": "sampler_level.flagged",
        },
    )
    channels = ("gyro.rate[1]", "table.level")
    channel_period = 0.5
    bodies = ""

    def rms(self) -> list[float]:
        """Return the levels, m/s2.  Raises InvalidValueError."""
        try:
            given = [float(x) * G0 for x in str(self["levels"]).replace(",", " ").split()]
        except ValueError:
            given = []
        if len(given) < 2 or given[0] != 0.0 or any(not a < b < math.inf for a, b in pairwise(given)):
            raise InvalidValueError(f"levels = {self['levels']}: 0 and rising numbers in g are expected, as 0 1 2")
        return given

    def pointing(self) -> list[str]:
        """Return how the axis points, one way after the other.  Raises InvalidValueError."""
        given = str(self["ways"]).replace(",", " ").split()
        if not given or set(given) - set(WAYS) or len(set(given)) < len(given):
            raise InvalidValueError(f"ways = {self['ways']}: up, down or both are expected")
        return given

    def plan(self) -> Plan:
        """Return the levels, up and down by turns, in one position after the other."""
        axis = self["axis"] if self["axis"] in FACES else "x"
        phases = []
        for way in self.pointing():
            for cycle in range(self["cycles"]):
                levels = self.rms() if cycle % 2 == 0 else self.rms()[::-1]
                phases += [self._phase(axis, way, level) for level in levels]
        return Plan(phases, {f"{axis} {way}": FACES[axis][way] for way in self.pointing()})

    def _phase(self, axis: str, way: str, level: float) -> Phase:
        label = f"{axis} {way}, {level / G0:.4g} g rms" if level else f"{axis} {way}, at rest"
        window = self["window"]
        return Phase(label, "hold", f"{axis} {way}", target=level, settle=self["settle"],
                     dwell=self["readings"] * window, window=window)  # fmt: skip

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {
            **self.plan().parameters(),
            **self.owned(),
            **{f"gyro.g[1,{k}]?": LINEAR for k in (1, 2, 3)},
            **{f"gyro.g2[1,{k}]?": QUADRATIC for k in (1, 2, 3)},
            "accelerometers.square?": SQUARE,
        }

    def check(self) -> list[str]:
        problems = [] if self["axis"] in FACES else [f"axis = {self['axis']}: x, y or z is expected"]
        if self["lines"] > 1 and not self["low"] < self["high"]:
            problems.append(f"low = {self['low']:g} Hz: must be below high = {self['high']:g} Hz")
        if max(self["low"], self["high"] if self["lines"] > 1 else 0.0) * self.step > 0.11:
            problems.append(f"high = {self['high']:g} Hz: a period needs nine communication steps of {self.step:g} s")
        if self["low"] * self["window"] < PERIODS:
            problems.append(f"window = {self['window']:g} s: {PERIODS:g} periods of {self['low']:g} Hz are needed")
        return problems
