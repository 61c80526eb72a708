"""A small system for the tests: the standard parts on a short plan."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot, System, Windows

IDENTITY = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


class SmallTumble(System):
    """Two dwells and a short turn of a floated gyro."""

    title = "small tumble"
    spec = ("TEST",)
    slots: ClassVar = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot("Table", "table_rate"),
        "gyro": Slot("SdfGyro", "floated_gyro"),
        "rebalance": Slot("Rebalance", "rebalance_analog"),
        "sampler": Slot("Sampler", "sampler"),
    }
    wires = """
        site.f -> table.f_local
        site.omega -> table.omega_local
        sequencer.mode -> table.mode
        sequencer.target -> table.target
        sequencer.face -> table.face
        table.omega -> gyro.omega
        table.alpha -> gyro.alpha
        table.f -> gyro.f
        gyro.u -> rebalance.u
        rebalance.i -> gyro.i
        table.angle_read -> sequencer.angle
        table.angle_read -> sampler.angle
        table.in_position -> sequencer.in_position
        sequencer.gate -> sampler.gate
        sequencer.window -> sampler.window
        sequencer.phase -> sampler.phase
        rebalance.i_read -> sampler.x
        rebalance.saturated -> sampler.flag
    """
    options: ClassVar = {
        "latitude": Option("45.75deg", "rad", "geographic latitude", min=-math.pi / 2, max=math.pi / 2),
        "dwell": Option(0.4, "s", "dwell of the fixed phases"),
        "turns": Option(0.05, "1", "turns at the rate"),
    }
    windows = Windows.of("sampler")
    done = "sequencer.done"
    channels = ("gyro.u", "rebalance.i", "table.angle")
    channel_period = 0.01

    def plan(self) -> Plan:
        return Plan(
            [
                Phase("rest", "hold", "up", settle=0.1, dwell=self["dwell"], window=0.1),
                Phase("turn", "rate", "up", target=0.5, settle=0.1, travel=2 * math.pi * self["turns"], window=0.05),
                Phase("side", "index", "side", target=0.0, settle=0.1, dwell=self["dwell"], window=0.2),
            ],
            {"up": IDENTITY, "side": [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]},
        )

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        moves = {"table.acceleration": 1.0}  # rad/s2: a sixth of the time that its default takes for the same windows
        return {**self.plan().parameters(), **moves, "site.latitude": self["latitude"]}

    def check(self) -> list[str]:
        return ["latitude 0: nothing to see"] if self["latitude"] == 0.0 else []
