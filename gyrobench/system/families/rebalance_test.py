"""Tests of a gyro in torque rebalance on a table: one channel, or two."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from gyrobench.system.families.table_test import SDF_NOISES, TABLE, TableTest, on_table, sampled
from gyrobench.system.system import Slot

TWO_AXIS_NOISES = tuple(f"{name}_{axis}" for name in SDF_NOISES for axis in "xy")
STEP_MAX = 5e-3  # s
#: the gyro on the table, its loop, and the reading of the current
REBALANCE = """
    table -> gyro: omega alpha f
    rebalance -> gyro: i
    gyro -> rebalance: u
    rebalance -> sampler: i_read=x saturated=flag
"""


class RebalanceTest(TableTest):
    """A floated gyro holds its float by its torquer; the current of the torquer is read.

    slots = RebalanceTest.with_parts(table=..., gyro=..., rebalance=...)
    """

    slots: ClassVar[Mapping[str, Slot]] = on_table(table="Table", gyro="SdfGyro", rebalance="Rebalance")
    wires = TableTest.wires + REBALANCE
    noises: ClassVar[tuple[str, ...]] = (*SDF_NOISES, "rebalance.meter")
    channels: ClassVar[tuple[str, ...]] = ("gyro.u", "rebalance.i", "gyro.drift")

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
    gyro -> rebalance_x: u_y=u
    gyro -> rebalance_y: u_x=u
    rebalance_x -> gyro: i=i_x
    rebalance_y -> gyro: i=i_y
    rebalance_x -> sampler_x: i_read=x saturated=flag
    rebalance_y -> sampler_y: i_read=x saturated=flag
    """
        + sampled("sampler_x")
        + sampled("sampler_y")
    )
    noises: ClassVar[tuple[str, ...]] = (*TWO_AXIS_NOISES, "rebalance_x.meter", "rebalance_y.meter")
    channels: ClassVar[tuple[str, ...]] = (
        "gyro.u_x",
        "gyro.u_y",
        "rebalance_x.i",
        "rebalance_y.i",
        "gyro.drift_x",
        "gyro.drift_y",
    )
