"""Dynamics of a floated gyro: its float angle against small angles of a vibrating table, sines and steps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.system.families import vibrating_table
from gyrobench.system.families.option_groups import SITE, type_b
from gyrobench.system.families.table_test import ON_TABLE, SDF_NOISES
from gyrobench.system.loop_plan import LoopPhase, LoopPlan
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot

from . import sources
from .measured import MEASURED

#: gyro axes I, O, S (rows) in table axes: O = z_T along the table axis, which points to the pole
OUTPUT_ON_TABLE = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
FACES = {"input": ON_TABLE, "output": OUTPUT_ON_TABLE}


class GyroDynamics(vibrating_table.ShakenTest):
    """A table shakes a floated gyro about its input or its output axis, its loop open, at one frequency after another,
    and turns it to and fro; the float angle against that of the table gives time constant, stiffnesses and response.

    [TEST-GYRO-DYNAMICS; Hu 1981, eq. 2-57..2-67]
    """

    title = "Dynamics of a floated gyro"
    spec = ("TEST-GYRO-DYNAMICS", "GYRO-DYN-1", "GYRO-DYN-3")
    slots = {
        "site": Slot("Site", "site"),
        "exciter": Slot("Excitation", "exciter"),
        "table": Slot(vibrating_table.TABLE, "rate_table_vibrating"),
        "gyro": Slot("SdfGyro", "compliant_gyro"),
    }
    wires = vibrating_table.SHAKEN + "table -> gyro: omega alpha f"
    open = ("gyro.i",)
    options = (
        SITE
        | {"axis": Option("input", str, "axis of the gyro along that of the table: input or output")}
        | vibrating_table.FREQUENCIES
        | {
            "highest": Option("300Hz", "Hz", "highest frequency", 1e-2),
            "angle": Option("1arcmin", "rad", "amplitude of the table angle, and its steps", 1e-9),
            "acceleration": Option("200rad/s2", "rad/s2", "largest amplitude of the table's acceleration", 1e-6),
        }
        | vibrating_table.TIMES
        | {
            "steps": Option(8, int, "steps of the table angle, about the input axis alone", 0, 50),
            "rise": Option(0.02, "s", "time in which a step turns", 1e-4),
            "hold": Option(0.2, "s", "time the angle is held after a step", 1e-3),
            "K_sg": Option(0.0, "V/rad", "pickoff gain for the reduction; 0: the parameter K_sg of the gyro", 0.0),
            "H": Option(
                0.0, "N.m.s", "spin angular momentum, for the stiffnesses; 0: the parameter H of the gyro", 0.0
            ),
        }
        | vibrating_table.STATED
        | type_b(sources)
        | vibrating_table.MOUNT
    )
    noises = ("table.reading", *SDF_NOISES)
    step = 5e-5
    channels = ("exciter.phase", "exciter.gate", "table.rate_read", "gyro.u", "gyro.saturated")
    shown = ("table.rate_read", "gyro.u")
    measured_data = MEASURED

    @property
    def channel_period(self) -> float:  # type: ignore[override]
        """At least twelve samples a period and forty a turn, whole steps apart."""
        finest = min(1.0 / (12.0 * self["highest"]), self["rise"] / 40.0)
        return float(max(1, math.floor(finest / self.step + 1e-9)) * self.step)

    def turns(self) -> int:
        """Return how many steps there are: about the input axis alone, where the float keeps an angle."""
        return int(self["steps"]) if self["axis"] == "input" else 0

    def plan(self) -> LoopPlan:
        phases = []
        for f in self.frequencies():
            dwell = math.ceil(max(self["periods"], self["dwell"] * f) - 1e-9) / f
            size = min(self["angle"], self["acceleration"] / (2.0 * math.pi * f) ** 2)
            phases.append(LoopPhase(f"{f:.4g} Hz", "motion", "sine", 3, size, f, self["settle"], dwell))
        rise, hold = self["rise"], self["hold"]
        for n in range(self.turns()):
            size = self["angle"] * (1.0 if n % 2 == 0 else -1.0)
            label = f"step {n + 1}"
            phases.append(LoopPhase(label, "motion", "step", 3, size, 1.0 / rise, 2.0 * hold, 2.0 * rise + hold))
        return LoopPlan(phases)

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        face = np.array(FACES.get(self["axis"], ON_TABLE))
        return {**self.plan().parameters(), **self.owned(), "table.base": self.base(), "table.face": face}

    def base(self) -> Array:
        """Return the table axes at which the input axis sees no Earth rate, however the table turns."""
        base = frames.equatorial_base(self["latitude"])
        return base[[2, 1, 0]] * [[1.0], [-1.0], [1.0]] if self["axis"] == "output" else base

    def check(self) -> list[str]:
        problems = super().check()
        if self["axis"] not in FACES:
            problems.append(f"axis = {self['axis']}: must be input or output")
        if 0 < self["steps"] < 3:
            problems.append(f"steps = {self['steps']}: their scatter is the uncertainty; at least 3, or 0 for none")
        if len(self.frequencies()) + self.turns() > 99:
            problems.append("points and steps: more than 99 phases")
        fastest = math.pi * self["angle"] * 2.0 / self["rise"] ** 2
        if self.turns() and fastest > 100.0 * self["acceleration"]:
            problems.append(f"rise = {self['rise']:g} s: a turn of this angle takes {fastest:.3g} rad/s2; a longer one")
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        names = ("H", "C", "K_sg", "u_max")
        known = [parameters.get(f"gyro.{n}") for n in names]
        if None in known:
            return problems
        H, C, K_sg, u_max = (float(x) for x in known)  # type: ignore[arg-type]
        most = (H / C if self["axis"] == "input" and C > 0.0 else 1.0) * self["angle"] * K_sg
        if most > 0.5 * u_max:
            problems.append(
                f"angle = {self['angle']:.3g} rad gives {most:.3g} V; at most half of the pickoff's range, "
                f"{u_max:g} V, so that the drift of the free float stays within the other"
            )
        return problems
