"""Polar servo test of a floated gyro: the gyro holds a table whose axis lies along the pole, a day in each mount."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES
from gyrobench.system.families.servo_channel import own_name
from gyrobench.system.families.servo_test import Hold, ServoTest
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import OnRequest, Option

from . import live
from .measured import MEASURED

TURN = 2.0 * math.pi
PATIENCE = 2.0  # a turn that nobody asked for may take this many times the time asked for


class ServoPolar(ServoTest):
    """The input axis lies along the pole (mount S: -pole, N: +pole) and gravity goes round the gyro once a day; the
    table rate gives seven coefficients and R + K_zx g2 sin2(latitude), two dwells with x east separate these.  The same
    record tells the random drift and its correlation, and turns compared tell the long-term stability.

    [TEST-SERVO-POLAR, TEST-COMPOSITE; Hu 1981, eq. 3-84..3-93, Tables 3-2, 3-3]
    """

    title = "Polar servo test"
    spec = ("TEST-SERVO-POLAR", "TEST-COMPOSITE", "LOOP-TABLE-SERVO", "GYRO-DYN-1", "GYRO-STATIC-9")
    slots = ServoTest.with_parts(stand="fixture", table="table_servo", gyro="floated_gyro", cage="cage")
    axis_parts: ClassVar[Mapping[str, str]] = {"gyro": "gyro_2dof", "lock": "rebalance_two_axis"}
    options = (
        ServoTest.options
        | {
            "mounts": Option("S N", str, "mounts in their order: S (input axis against the pole), N (along it)"),
            "turns": Option(1, int, "turns in each mount, at least; 0: what the time gives", 0, 60),
            "time": Option(86400.0, "s", "time in each mount, at least", 1.0),
            "window": Option(600.0, "s", "length of a window", 1e-3),
            "dwell": Option(3600.0, "s", "length of each of the two dwells with the input axis east"),
            "route": Option("dwells", str, "how R and K_zx are told apart: dwells, equal (K_zx = K_xz) or combination"),
            "wanted": Option("0.001deg/h", "rad/s", "with the slot coefficients: wanted u of mean and harmonics", 0.0),
            "terms": Option(9, int, "terms of the model: 4 (low grades), 8 (Hu 1981), 9 (with D_O)", 4, 9),
        }
        | CORRECTIONS
        | NUISANCES
    )
    on_request: ClassVar[Mapping[str, OnRequest]] = {**ServoTest.on_request, live.SLOT: live.ON_REQUEST}
    shorter = "give that time, or turns=0 for as much of a turn as the time gives, or turns=1"
    measured_data = MEASURED
    channel_period = 60.0

    def mounts(self) -> list[str]:
        """Return the attitudes of the turns, in their order."""
        return [f"polar {m}" for m in self["mounts"].replace(",", " ").split()]

    def holds(self) -> list[Hold]:
        """Return two dwells (route dwells), then each mount; every phase begins at a whole turn."""
        common = {"settle": self["settle"]}
        holds = []
        if self["route"] == "dwells":
            window = self["dwell"] / max(1, round(self["dwell"] / self["window"]))
            holds = [Hold(f"x east, y {w}", self["dwell"], window, **common) for w in ("up", "down")]
        angle = 0.0
        longest = math.inf if "turns" in self.given else PATIENCE * self["time"]
        for mount in self.mounts():
            travel = TURN * self["turns"]
            whole = travel * (1.0 + 1.2 * self["window"] / self["time"])  # the last window may be cut off
            holds.append(
                Hold(mount, self["time"], self["window"], start=angle, travel=whole, longest=longest, **common)
            )
            angle += travel if mount == "polar S" else -travel
        return holds

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        """Return parameters that tell the live estimator the noise of the gyro in the slot, and the readings'
        quantum.
        """
        found = super().parameters(parts)
        if live.SLOT not in self.slots:
            return found
        told = {"tau": "markov_tau", "rms": "markov", "white": "white"}
        told = {name: f"gyro.{own_name(self.channel, own)}" for name, own in told.items()}
        found |= {f"{live.SLOT}.{name}?": parts[source] for name, source in told.items() if source in parts}
        if "table.quantum" in parts:
            found[f"{live.SLOT}.sigma?"] = float(parts["table.quantum"]) / math.sqrt(12.0)
        return found | {f"{live.SLOT}.wanted[{k}]?": self["wanted"] for k in range(1, 6)}

    def check(self) -> list[str]:
        from .refusals import option_problems

        return option_problems(self.values) + super().check()

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        from .refusals import model_problems

        return super().check_parameters(parameters) + model_problems(parameters, self.channel)

    def warnings(self) -> list[str]:
        from .refusals import unseen

        return unseen(self["route"], self.mounts(), self["terms"], self.channel)
