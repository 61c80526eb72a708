"""Four accelerometers on one indexing head: their coefficients and the errors of the head told apart."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from gyrobench.arrays import Array
from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.option_groups import SITE, type_b
from gyrobench.system.families.table_test import TableTest, on_table, sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot, Windows

from . import geometry, sources
from .head import first_harmonic
from .measured import MEASURED

TURN = 2.0 * math.pi
FACE = "head"
SENSOR = Socket(
    "StaticAccelerometer",
    "accelerometer with voltage output: specific force in, voltage out",
    (inp("f", "m/s2", "specific force, head axes", 3), out("U", "V", "voltage")),
)
#: default sensors 2 to 4; sensor 1 is the default of the part
OTHERS: dict[int, dict[str, float]] = {
    2: {"K_F": -4.13e-3, "K_I": 1.32453, "K_O": -7.3e-6, "K_IO": 8e-6, "K_II": 1.6e-5},
    3: {"K_F": -9.2e-4, "K_I": 1.29800, "K_O": -1.2e-5, "K_IO": -1.9e-5, "K_II": 7e-6},
    4: {"K_F": -1.3e-3, "K_I": 1.29999, "K_O": -8.6e-6, "K_IO": -9e-6, "K_II": 2.5e-6},
}


class AccelerometerFour(TableTest):
    """Four accelerometers a quarter of a turn apart on one head, read together in 24 positions: five coefficients of
    each and the harmonics of the head's angle errors from the second on, in one least squares.

    [TEST-ACCEL4, ACCEL-MODEL; Dong 2014, eq. 1-31]
    """

    title = "Four accelerometers on one indexing head"
    spec = ("TEST-ACCEL4", "ACCEL-MODEL")
    protocol = "design"
    slots = {
        **on_table(table=Slot("Table", "index_head")),
        **{f"accelerometer_{i}": Slot(SENSOR, "accelerometer_static") for i in geometry.SENSORS},
        **{f"sampler_{i}": Slot("Sampler", "sampler") for i in geometry.SENSORS[1:]},
    }
    wires = (
        TableTest.wires
        + "".join(sampled(f"sampler_{i}") for i in geometry.SENSORS[1:])
        + "".join(f"\ntable -> accelerometer_{i}: f\n" for i in geometry.SENSORS)
        + "accelerometer_1.U -> sampler.x\n"
        + "".join(f"accelerometer_{i}.U -> sampler_{i}.x\n" for i in geometry.SENSORS[1:])
    )
    options = SITE | {
        "points": Option(24, int, "positions a turn", 16, 24),
        "turns": Option(1, int, "turns", 1, 4),
        "settle": Option(3.0, "s", "wait before averaging, in each position", 0.0),
        "dwell": Option(10.0, "s", "time averaged in each position"),
        "D1c": Option("3.094arcsec", "rad", "first harmonic of the head as an autocollimator measured it, cosine"),
        "D1s": Option("-0.392arcsec", "rad", "the same, sine"),
        **type_b(sources),
        "d1_unknown": Option(False, bool, "no such measurement: K_F, K_IO and K_II are biased by K_I D1"),
        "head_error": Option("11arcsec", "rad", "half range of the head's random errors (simulated)", 0.0, 1e-3),
        "head_seed": Option(1, int, "which random errors (simulated)", 0),
        "head_D1c": Option("3.094arcsec", "rad", "true first harmonic of the head, cosine (simulated)", -1e-3, 1e-3),
        "head_D1s": Option("-0.392arcsec", "rad", "the same, sine", -1e-3, 1e-3),
        **type_b("voltage", "gravity"),
    }
    noises = (*(f"accelerometer_{i}.white" for i in geometry.SENSORS), "table.repeat")
    assumed = ("table.base",)
    takes: ClassVar[Mapping[str, Any]] = {"table_position_test": first_harmonic}
    measured_data = MEASURED
    windows = Windows.of("sampler", **{f"mean_{i}": f"sampler_{i}.mean" for i in geometry.SENSORS[1:]})
    channels = (*(f"accelerometer_{i}.U" for i in geometry.SENSORS), "table.angle")
    channel_period = 1.0

    def plan(self) -> Plan:
        """Return phases in which the head goes on through the turns, position after position."""
        n = self["points"]
        each = {"settle": self["settle"], "dwell": self["dwell"], "window": self["dwell"]}
        phases = [
            Phase(f"{360.0 * (k % n) / n:.4g}°", "index", FACE, TURN * k / n, **each) for k in range(n * self["turns"])
        ]
        return Plan(phases, {FACE: np.eye(3).tolist()})

    def base(self) -> Array:
        return geometry.BASE

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        n = self["points"]
        error = geometry.errors(n, self["head_error"], self["head_seed"], self["head_D1c"], self["head_D1s"])
        found = {**super().parameters(parts), "table.positions": n, "table.error": [*error.tolist(), *[0.0] * (24 - n)]}
        for i in geometry.SENSORS:
            found[f"accelerometer_{i}.mount"] = geometry.mount(i).tolist()
            found |= {f"accelerometer_{i}.{k}?": v for k, v in OTHERS.get(i, {}).items()}
        return found

    def check(self) -> list[str]:
        problems = super().check()
        if self["points"] * self["turns"] > 99:
            problems.append(f"{self['points']} positions in {self['turns']} turns: at most 99 in all")
        return problems
