"""Tests of a gyro at rest that read the current of its rebalance loop, or the rate of a gyro with its loop inside."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from gyrobench.attitudes import parse
from gyrobench.system.families.arranged import Arranged
from gyrobench.system.families.rebalance_test import RebalanceTest
from gyrobench.system.families.table_test import TableTest, on_table
from gyrobench.system.part_files import has_port
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot

CURRENT, RATE = "current", "rate"
#: the gyro on the table, and the reading of its rate
RATE_GYRO = """
    table -> gyro: omega f
    gyro.rate[1] -> sampler.x
    gyro -> sampler: saturated=flag
"""
#: noises of the rate gyros of the bench
RATE_NOISES = tuple(
    f"gyro.{n}"
    for n in ("turn_on", "flicker_x", "flicker_y", "walk_x", "walk_y", "white", "optical", "electronics", "crossings",
              "quantum",
              "turn_on_x", "turn_on_y", "markov_x", "markov_y", "white_x", "white_y")
)  # fmt: skip


class RateReading(Arranged, RebalanceTest):
    """A gyro at rest: torque rebalance, or a rate gyro whose axis x is read.

    The option reading says which; a part in the slot gyro that has an output rate sets it.
    """

    arranged_by = "reading"
    arranged = ("slots", "wires", "channels", "noises", "assumed", "read_by", "windows")
    rate_gyro: ClassVar[str]  # the part that stands in the slot gyro where a rate is read, unless another one is given
    readings: ClassVar[tuple[str, ...]] = (CURRENT, RATE)
    reads: ClassVar[dict[str, Option]] = {
        "reading": Option(CURRENT, str, "what is read: current (torque rebalance), or rate (of a rate gyro, axis x)")
    }

    @property
    def reads_rate(self) -> bool:
        return str(self["reading"]) == RATE

    def place(self, slot: str, part: str | Path, bench: Path | None = None) -> None:
        super().place(slot, part, bench)
        if slot == "gyro" and not self.reads_rate and has_port(part, "rate", bench):
            self.set("reading", RATE)

    def arrange(self) -> None:
        if self.reads_rate:
            slots = on_table(table=self.slots["table"], gyro=Slot("RateGyro", self.rate_gyro))
            vars(self).update(
                slots=slots,
                wires=TableTest.wires + RATE_GYRO,
                channels=("gyro.rate[1]", "gyro.density"),
                noises=RATE_NOISES,
                read_by={},
                assumed=(*TableTest.assumed, "gyro.scale?"),
            )

    def in_attitude(self, label: str, dwell: float, window: float) -> Plan:
        """Return a plan of one phase; the mount is the attitude itself, as the table stands level at angle 0."""
        try:
            face = parse(self["attitude"], self["latitude"])
        except ValueError:
            return Plan()  # check() says why
        phase = Phase(
            label=label, mode="index", face=label, target=0.0, settle=self["settle"], dwell=dwell, window=window
        )
        return Plan([phase], {label: face})

    def check(self) -> list[str]:
        problems = super().check()
        if self["reading"] not in self.readings:
            problems.append(f"reading = {self['reading']}: must be {' or '.join(self.readings)}")
        for name in ("k", "u_current"):
            if self["reading"] != CURRENT and name in self.options and self[name]:
                problems.append(f"{name}: of a torquer and its current; with reading = {self['reading']} there is none")
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        if self["reading"] == CURRENT and not (self["k"] or parameters.get("gyro.k")):
            problems.append("k unknown: the gyro has no parameter k; give the option k, as 17.2deg/h/mA")
        return problems
