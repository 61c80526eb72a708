"""Vertical and level servo tests of a floated gyro: the gyro holds a table with its axis vertical or level."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

from gyrobench.attitudes import LEVEL, SERVO_ATTITUDES, VERTICAL
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, TORQUER, type_b
from gyrobench.system.families.servo_channel import own_name
from gyrobench.system.families.servo_test import Hold, ServoTest
from gyrobench.system.families.table_test import sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import OnRequest, Option, Slot
from gyrobench.system.values import InvalidValueError
from gyrobench.units import DPH

from . import compensation
from .measured import MEASURED

METER = "torquing"  # the sampler of the compensating current
DRIFTED = math.radians(0.1)  # a drift that turns a level table by less than this in half a dwell moves no start
THREE = "x down; x up; x east, z down"
SIX = "x down; x up; x east, y up; x east, y down; x east, z up; x east, z down"
#: words for sets of attitudes
SETS = {
    "three": THREE,
    "six": SIX,
    "vertical": "; ".join(VERTICAL),
    "level": "; ".join(LEVEL),
    "all": "; ".join((*VERTICAL, *LEVEL)),
}


class ServoVerticalLevel(ServoTest):
    """The gyro holds the table with the input axis down or up (class 1) or level (class 2); the table rate less the
    Earth's is the drift, and attitudes compared give its coefficients: R, U_z, U_x by the three-term route.


    With ``levelled`` a compensating current takes the Earth's rate out of the level attitudes, for long dwells; with
    ``compensate`` one takes the drift of given coefficients out of all, and the drift is measured again.

    [TEST-SERVO-VERT, TEST-SERVO-LEVEL, SERVO-LEVELLED; Hu 1981, eq. 3-60..3-83]
    """

    title = "Vertical and level servo test"
    spec = ("TEST-SERVO-VERT", "TEST-SERVO-LEVEL", "TEST-COMPOSITE", "LOOP-TABLE-SERVO", "GYRO-DYN-1", "GYRO-STATIC-9")
    slots = ServoTest.with_parts(stand="fixture", table="table_servo", gyro="floated_gyro", cage="cage")
    axis_parts: ClassVar[Mapping[str, str]] = {"gyro": "gyro_2dof", "lock": "rebalance_two_axis"}
    options = (
        ServoTest.options
        | CORRECTIONS
        | NUISANCES
        | {
            "attitudes": Option("six", str, "three, six, vertical, level, all, or names separated by semicolons"),
            "cycles": Option(2, int, "times the attitudes are gone through", 1, 12),
            "dwell": Option(600.0, "s", "time in each attitude", 1e-3),
            "windows": Option(10, int, "windows in each dwell", 1, 200),
            "compensate": Option("", str, "coefficients whose drift the torquer takes out, or the folder of a run"),
            "levelled": Option(False, bool, "compensating current in level attitudes: the table stays level for long"),
        }
        | TORQUER
        | type_b("scale_factor")
    )
    on_request: ClassVar[Mapping[str, OnRequest]] = {
        **ServoTest.on_request,
        METER: OnRequest(
            {METER: Slot("Sampler", "sampler")},
            f"""
            sequencer -> cage: target=command
            cage -> {METER}: i=x
            {sampled(METER)}
            """,
            {"current": f"{METER}.mean"},
        ),
    }
    measured_data = MEASURED

    def __init__(self) -> None:
        super().__init__()
        self.torquer = 17.2e3 * DPH  # rad/s/A, of the gyro in the slot, which parameters() has seen

    def set(self, name: str, value: Any) -> None:
        super().set(name, value)
        if name == "compensate" and Path(str(value)).is_dir():
            super().set(name, compensation.of_folder(Path(str(value)), self.channel))
        if self["levelled"] or self["compensate"]:
            self.request(METER)

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        k = f"gyro.{own_name(self.channel, 'k')}"
        self.torquer = self["k"] or (float(parts[k]) if k in parts else self.torquer)
        return super().parameters(parts)

    def attitudes(self) -> list[str]:
        """Return those of one cycle, in their order."""
        text = SETS.get(self["attitudes"], self["attitudes"])
        return [name.strip() for name in text.split(";") if name.strip()]

    def holds(self) -> list[Hold]:
        """Return the holds.  Each level dwell begins so that what the Earth turns the table is half before and half
        after angle 0; what the drift turns it too, where that is more than DRIFTED.
        """
        from .refusals import LIMIT

        holds = []
        common = {"settle": self["settle"], "dwell": self["dwell"], "window": self["dwell"] / self["windows"]}
        for name in self.attitudes() * self["cycles"]:
            start, by_torquer = 0.0, -self.compensated(name)
            if name in LEVEL:
                half = self["settle"] + self["dwell"] / 2.0
                if self["levelled"]:
                    by_torquer += self.earth(name)
                else:
                    start = self.earth(name) * half
                drifted = (float(self.expected().rates(name)[0][0]) - self.compensated(name)) * half
                if abs(drifted) > DRIFTED or abs(start) + 2.0 * abs(drifted) > LIMIT:
                    start -= drifted
            holds.append(Hold(name, start=start, current=by_torquer / self.torquer, **common))
        return [h for h in holds if h.attitude in SERVO_ATTITUDES]

    def compensated(self, name: str) -> float:
        """Return the drift that the option compensate takes out of an attitude, rad/s."""
        if not self["compensate"] or name not in SERVO_ATTITUDES:
            return 0.0
        put_in = compensation.coefficients(self["compensate"], self.channel)
        return float(replace(self.expected(), drift=put_in).rates(name)[0][0])

    def earth(self, name: str) -> float:
        """Return the Earth rate along the input axis, rad/s."""
        return float(self.expected().rates(name)[1][0])

    def check(self) -> list[str]:
        from .refusals import option_problems

        names = self.attitudes()
        try:
            compensation.coefficients(self["compensate"], self.channel)
        except InvalidValueError as error:
            return [str(error)]
        known = {n: 0.0 if self["levelled"] else self.earth(n) for n in names if n in LEVEL}
        return option_problems(names, known, self["settle"] + self["dwell"]) + super().check()

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        from .refusals import option_problems

        names = [n for n in self.attitudes() if n in LEVEL]
        rates = {n: float(self.expected().table_rate(n)[0]) for n in names}
        levelling = {n: self.earth(n) if self["levelled"] else 0.0 for n in names}
        rates = {n: rate + levelling[n] - self.compensated(n) for n, rate in rates.items()}
        limit, most = parameters.get("cage.i_max", math.inf), max((abs(h.current) for h in self.holds()), default=0.0)
        if most > limit:
            return [f"levelled, compensate: they ask for {most * 1e3:.3g} mA, cage.i_max = {limit * 1e3:.3g} mA"]
        problems = option_problems(names, rates, self["settle"] + self["dwell"], "the Earth and the drift turn")
        return super().check_parameters(parameters) + (problems if names else [])

    def warnings(self) -> list[str]:
        from gyrobench.reduction.drift.channels import words

        from .refusals import unseen

        return [words(text, self.channel) for text in unseen(self.attitudes())]
