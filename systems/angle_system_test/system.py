"""Test of an angle reading system: errors of the scales by two heads or by reversal, lags, rate readouts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from gyrobench import frames
from gyrobench.system.families.option_groups import type_b
from gyrobench.system.families.table_test import TABLE, TableTest, on_table, sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import LIMIT, Phase, Plan
from gyrobench.system.system import Option, Slot, Windows

from . import harmonics, sources
from .measured import MEASURED

FACE = "table"
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
WINDOW = GOLDEN * math.pi / harmonics.POLE_PAIRS  # rad between two readings at a rate: they fall all over a fine cycle
#: parameters that make a reader what it is: the second head reads the same scale with the same electronics
SHARED = (
    *("mode", "pole_pairs", "f_0", "f_T", "f_c", "quantum", "rate_max", "phases", "shifter_slope", "stamp", "slew"),
    *("coarse_zero", "coarse_error", "coarse_phase", "coarse_limit", "loop_type", "loop_K_v"),
    *(f"encoder_{n}" for n in ("pitch_order", "d0", "de", "e3", "e5")),
    *(f"encoder_{n}{of}" for n in ("eccentricity", "tilt", "pitch", "interpolation") for of in ("", "_phase")),
)
NOISE = "reader.encoder_reading reader_2.encoder_reading reference.encoder_reading"
TURN = 2.0 * math.pi
#: columns of gates and degrees: gate_start -> "gate.t_start"
COUNTED = {
    f"{slot}_{n}": f"{slot}.{output}"
    for slot in ("gate", "inverse")
    for n, output in (("number", "number"), ("rate", "rate"), ("start", "t_start"), ("end", "t_end"))
}


class AngleSystemTest(TableTest):
    """The table stops at angles all around, then turns at several rates both ways.  Two readings of one scale, by a
    second head or after the scale has been turned on its shaft, separate its errors from those of the reference;
    rates show lags; counts with stamps become rates by gate and by the time of a degree.

    [ANGLE-INDUCTOSYN, READOUT-RATE; Hu 1981, sections 5.4 (three), 5.5 (one-3)]
    """

    title = "Angle system test"
    spec = ("ANGLE-INDUCTOSYN", "READOUT-RATE")
    measured_data = MEASURED
    slots = on_table(
        table=Slot("Table", "table_rate"),
        reader=Slot("AngleReader", "inductosyn"),
        reader_2=Slot("AngleReader", "inductosyn"),
        reference=Slot("AngleReader", "inductosyn"),
        gate=Slot("RateReadout", "rate_gate"),
        inverse=Slot("RateReadout", "inverse_rate"),
    )
    wires = (
        TABLE
        + sampled()
        + """
    table -> reader: angle rate
    table -> reader_2: angle rate
    table -> reference: angle rate
    reader -> gate: count t_read
    reader -> inverse: count t_read
    reader -> sampler: angle_read=x lost=flag
    """
    )
    options: ClassVar[dict[str, Option]] = {
        "method": Option("two_heads", str, "two_heads, or reversal: the scale turned on its shaft by `head`"),
        "head": Option("50.1deg", "rad", "angle between the two readings of the scale", sets="reader_2.head"),
        "positions": Option(0, int, "angles in a turn; 0: 83, with reversal 41", 0, 90),
        "rates": Option("20 200 1000", str, "rates in Earth rates, each forwards and backwards"),
        "travel": Option("20deg", "rad", "angle turned at each rate, read every 0.309 deg", 0.05),
        "settle": Option(0.5, "s", "wait before a reading, after each move", 0.0),
        "gate": Option(1.0, "s", "gate of the rate readout", sets="gate.gate"),
        "noise": Option("0.02arcsec", "rad", "standard deviation of a reading before it is counted", 0.0, sets=NOISE),
        "reference_zero": Option("70.7deg", "rad", "angle at which the reference is mounted", sets="reference.head"),
        **type_b(sources),
        "quantum": Option(0.0, "rad", "angle of a count of the reader, of measured data; 0: of the part", 0.0),
        "reference_quantum": Option(0.0, "rad", "of the reference, of measured data; 0: that of the reader", 0.0),
    }
    assumed = ("table.base",)
    open = ("table.face",)
    noises = tuple(NOISE.split())
    step = 5e-3  # s, the sample of the electronics; the table is known in closed form
    channels = ("reader.angle_read", "reference.angle_read", "table.rate", "reader.lost")
    bodies = """
        table: base table.base, x table.tilt[1], y table.tilt[2], z reader.angle_read
    """
    channel_period = 1.0
    windows = Windows.of(
        "sampler",
        reading="reader.angle_read", t_reading="reader.t_read", reading_2="reader_2.angle_read",
        reference="reference.angle_read", t_reference="reference.t_read", **COUNTED,
    )  # fmt: skip

    @property
    def reversal(self) -> bool:
        return bool(self["method"] == "reversal")

    def angles(self, turn: int = 0) -> list[float]:
        """Return the angles of the positions: all around, irregular, so that high orders do not look like low ones.

        turn: 1 for the second one of a reversal, with other angles.
        """
        n = self["positions"] or (41 if self.reversal else 83)
        return [TURN * (j + ((turn * n + j) * GOLDEN) % 1.0) / n for j in range(n)]

    def rates(self) -> list[float]:
        """Return the rates (rad/s), forwards and backwards in turn; what is not a number is left to check()."""
        return [sign * x * frames.EARTH_RATE for x in numbers(self["rates"]) for sign in (1.0, -1.0)]

    def plan(self) -> Plan:
        at_rest = {"mode": "index", "face": FACE, "settle": self["settle"], "dwell": 0.1, "window": 0.1}
        phases = [Phase(label=f"{math.degrees(a):.2f}°", target=a, **at_rest) for a in self.angles()]
        if self.reversal:
            again = self.angles(1)[::-1]
            phases += [Phase(label=f"turned {math.degrees(a):.2f}°", target=a, **at_rest) for a in again]
        turning = {"mode": "rate", "face": FACE, "settle": 1.0, "travel": self["travel"], "window": WINDOW}
        phases += [Phase(label=f"{r / frames.EARTH_RATE:g} ERU", target=r, **turning) for r in self.rates()]
        return Plan(phases, {FACE: np.eye(3).tolist()})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        same = {f"reader_2.{n}?": parts[f"reader.{n}"] for n in SHARED}
        return {**same, **super().parameters(parts)}

    def check(self) -> list[str]:
        problems = word_problems(self["method"], self["rates"])
        if problems:
            return problems
        if len(self.plan().phases) > LIMIT:
            problems.append(
                f"{len(self.plan().phases)} phases: at most {LIMIT} fit in a plan; fewer positions or rates"
            )
        if len(self.angles()) < 30:
            problems.append(f"{len(self.angles())} positions: at least 30 are needed for the orders of a scale")
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        if harmonics.separation(1, self["head"]) < harmonics.LEAST:
            problems.append(
                f"head = {math.degrees(self['head']):g}°: both readings have nearly the same eccentricity error; "
                "take 12° or more"
            )
        turning = max((abs(r) for r in self.rates()), default=0.0)
        for slot in ("reader", "reference"):
            most = parameters.get(f"{slot}.rate_max")
            if most is not None and turning > float(most):
                problems.append(
                    f"rates: {turning / frames.EARTH_RATE:g} ERU exceed {slot}.rate_max = {float(most):g} rad/s"
                )
        return problems

    def warnings(self) -> list[str]:
        gates = [abs(self["travel"] / r) / self["gate"] for r in self.rates()]
        few = min(gates, default=2.0)
        if few < 2.0:
            return [
                f"At the highest rate the travel takes {few:.2g} gates of {self['gate']:g} s: no gate reading of it."
            ]
        return []


def numbers(text: str) -> list[float]:
    """Return the words of a text that are numbers."""
    found = []
    for word in text.split():
        try:
            found.append(float(word))
        except ValueError:
            continue
    return found


def word_problems(method: str, rates: str) -> list[str]:
    """Return what is wrong with the options that are words."""
    problems = []
    if method not in ("two_heads", "reversal"):
        problems.append(f"method = {method}: two_heads or reversal")
    values = numbers(rates)
    if not values or len(values) < len(rates.split()):
        problems.append(f"rates = '{rates}': numbers of Earth rates separated by blanks, such as '20 200 1000'")
    if any(not 0.0 < v <= 1999.9 for v in values):
        problems.append(f"rates = '{rates}': each must be above 0 and at most 1999.9 Earth rates")
    return problems
