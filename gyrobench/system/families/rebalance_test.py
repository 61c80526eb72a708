"""Tests of a gyro in torque rebalance on a table: one channel, or two."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from gyrobench.system.families.table_test import SDF_NOISES, TABLE, TableTest, on_table, sampled, supply, surroundings
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import OnRequest, Slot

TWO_AXIS_NOISES = tuple(f"{name}_{axis}" for name in SDF_NOISES for axis in "xy")
STEP_MAX = 5e-3  # s
#: the gyro on the table, its loop, and the reading of the current
REBALANCE = """
    table -> gyro: omega alpha f
    rebalance -> gyro: i
    gyro -> rebalance: u
    rebalance -> sampler: i_read=x saturated=flag
"""


def pulse_errors(slot: str) -> tuple[str, ...]:
    """Return the parameters of a rebalance by pulses that a test takes as zero."""
    return tuple(f"{slot}.{name}?" for name in ("dI_plus", "dI_minus", "dT"))


class RebalanceTest(TableTest):
    """A floated gyro holds its float by its torquer; the current of the torquer is read.

    slots = RebalanceTest.with_parts(table=..., gyro=..., rebalance=...)
    """

    slots: ClassVar[Mapping[str, Slot]] = on_table(table="Table", gyro="SdfGyro", rebalance="Rebalance")
    wires = TableTest.wires + REBALANCE
    on_request: ClassVar[Mapping[str, OnRequest]] = surroundings() | supply()
    noises: ClassVar[tuple[str, ...]] = (*SDF_NOISES, "rebalance.meter")
    channels: ClassVar[tuple[str, ...]] = ("gyro.u", "rebalance.i", "gyro.drift")
    assumed: ClassVar[tuple[str, ...]] = (*TableTest.assumed, *pulse_errors("rebalance"))
    #: slot of a rebalance -> its sampler, and what the gain of its loop is made of: pickoff gain, torquer scale factor
    read_by: ClassVar[Mapping[str, tuple[str, str, str]]] = {"rebalance": ("sampler", "K_sg", "k")}

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        counting = {f"{s}.integrated?": 1 for r, (s, *_) in self.read_by.items() if f"{r}.f_q" in parts}
        return {**super().parameters(parts), **counting}

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        for slot, (_, pickoff, torquer) in self.read_by.items():
            problems += self._saw_problems(parameters, slot, pickoff, torquer)
        return problems

    def _saw_problems(self, parameters: Mapping[str, Any], slot: str, pickoff: str, torquer: str) -> list[str]:
        """Return that the loop is too fast for the saw of a pulse-width rebalance.  [REBAL-PWM]"""
        chain = [parameters.get(n) for n in (f"gyro.{pickoff}", f"gyro.{torquer}", f"{slot}.K_p", f"{slot}.f_s")]
        floated = pickoff == "K_sg"  # the float turns at (H/C) k i, a free rotor at k i
        ratio = parameters.get("gyro.H", 0.0) / (parameters.get("gyro.C") or math.inf) if floated else 1.0
        if None in chain:
            return []
        *gains, saw = (float(x) for x in chain)  # type: ignore[arg-type]
        crossover = ratio * math.prod(gains) / (2.0 * math.pi)
        if crossover <= 0.1 * saw:
            return []
        return [
            f"{slot}.f_s = {saw:g} Hz: the loop crosses over at {crossover:.3g} Hz, the saw must be at least ten times "
            f"faster; lower {slot}.K_p or raise {slot}.f_s"
        ]

    def check(self) -> list[str]:
        problems = super().check()
        if self.step > STEP_MAX:
            problems.append(
                f"step = {self.step:g} s: the rebalance loop exchanges once a step and needs at most {STEP_MAX:g} s"
            )
        return problems


class TwoChannelTest(RebalanceTest):
    """A two-degree-of-freedom gyro with two such loops: the torquer about x nulls the y pickoff, and the other way.

    slots = TwoChannelTest.with_parts(table=..., gyro=..., rebalance_x=..., rebalance_y=...)
    """

    slots: ClassVar[Mapping[str, Slot]] = {
        **{n: s for n, s in on_table(table="Table", gyro="TwoAxisGyro").items() if n != "sampler"},
        **{f"rebalance_{a}": Slot("Rebalance") for a in "xy"},
        **{f"sampler_{a}": Slot("Sampler", "sampler") for a in "xy"},
    }
    wires = (
        TABLE
        + """
    table -> gyro: omega f
    gyro -> rebalance_x: u_y=u u_x=u_cross
    gyro -> rebalance_y: u_x=u u_y=u_cross
    rebalance_x -> gyro: i=i_x
    rebalance_y -> gyro: i=i_y
    rebalance_x -> sampler_x: i_read=x saturated=flag
    rebalance_y -> sampler_y: i_read=x saturated=flag
    """
        + sampled("sampler_x")
        + sampled("sampler_y")
    )
    assumed: ClassVar[tuple[str, ...]] = (
        *TableTest.assumed,
        *pulse_errors("rebalance_x"),
        *pulse_errors("rebalance_y"),
    )
    read_by: ClassVar[Mapping[str, tuple[str, str, str]]] = {
        "rebalance_x": ("sampler_x", "K_sg_y", "k_x"),
        "rebalance_y": ("sampler_y", "K_sg_x", "k_y"),
    }
    noises: ClassVar[tuple[str, ...]] = (*TWO_AXIS_NOISES, "rebalance_x.meter", "rebalance_y.meter")
    channels: ClassVar[tuple[str, ...]] = (
        "gyro.u_x", "gyro.u_y", "rebalance_x.i", "rebalance_y.i", "gyro.drift_x", "gyro.drift_y",
    )  # fmt: skip
