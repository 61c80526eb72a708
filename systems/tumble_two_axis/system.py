"""Two-axis tumble of a floated gyro in torque rebalance: nine coefficients in one run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from gyrobench import drift
from gyrobench.arrays import Array
from gyrobench.system.families.handed_axis import pole_axis
from gyrobench.system.families.option_groups import CORRECTIONS, FOLD, NUISANCES, SETTLE, SITE, SUPPLY, TORQUER, type_b
from gyrobench.system.families.physical_form import PHYSICAL_FORM
from gyrobench.system.families.rebalance_test import REBALANCE, RebalanceTest
from gyrobench.system.families.table_test import TWO_AXES, sampled, supply, surroundings
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot, Windows
from gyrobench.system.values import InvalidValueError
from gyrobench.system.visits import Visit, nearest_turn, parse_visits

from . import geometry
from .measured import MEASURED


class TumbleTwoAxis(RebalanceTest):
    """The gyro goes from position to position on a table with two axes: outer axis along the pole, inner axis along the
    input axis, their angles in the ratio m:n.  The input axis stays perpendicular to the pole, so that the Earth rate
    never enters; the inner rate does, hence the table stands still while the current is averaged.

    [TEST-TUMBLE2-SDF; Hu 1981, eq. 3-47..3-53]
    """

    title = "Two-axis tumble test"
    spec = ("TEST-TUMBLE2-SDF", "GYRO-DYN-1", "GYRO-STATIC-9", "LOOP-REBALANCE")
    protocol = "design"
    slots = RebalanceTest.with_parts(gyro="floated_gyro", rebalance="rebalance_analog") | {
        "table": Slot("TwoAxisTable", "table_two_axis"),
        "sampler_inner": Slot("Sampler", "sampler"),
    }
    # sampler_inner averages the same current; it is there for the inner angle at both ends of a window
    wires = f"""
        site -> table: f=f_local omega=omega_local
        sequencer -> table: mode=mode_x mode=mode_y target=target_x target_y face
        table -> sequencer: angle_x_read=angle in_position
        {REBALANCE}
        {sampled("sampler", "table: angle_x_read")}
        rebalance.i_read -> sampler_inner.x
        {sampled("sampler_inner", "table: angle_y_read")}
    """
    on_request = surroundings("table: angle_x_read", TWO_AXES) | supply()
    bodies = """
        outer ring: base table.base, x table.angle_x
        plate: outer ring, y table.angle_y
        instrument: plate, faces sequencer
    """
    options = (
        SITE
        | PHYSICAL_FORM
        | {
            "m": Option(5, int, "outer angle of a position in units of theta", 1, 20),
            "n": Option(1, int, "inner angle of a position in units of theta", 1, 20),
            "positions": Option(36, int, "equally spaced positions of a cycle", 1, 99),
            "cycles": Option(1, int, "how often the positions are gone through (99 phases in all)", 1, 9),
            "visits": Option("", str, "positions in place of these, '30deg 45deg 120s; ...': both angles, dwell"),
            "dwell": Option(120.0, "s", "averaging time in each position"),
            "windows": Option(2, int, "averages a position", 1, 100),
            "inner_rate": Option(0.003, "rad/s", "rate of the inner axis in moves", sets="table.index_rate[2]"),
            "harmonic": Option(False, bool, "insist on the harmonic route beside least squares"),
        }
        | SETTLE
        | FOLD
        | NUISANCES
        | CORRECTIONS
        | type_b("square", "mount", "angle1", "angle2", "wobble",
                 axis="standard uncertainty of the outer axis against the pole")
        | type_b("scale_factor", "nonlinearity", "current", "pulse", "switching")
        | SUPPLY
        | TORQUER
    )  # fmt: skip
    takes: ClassVar[Mapping[str, Any]] = {"stand_alignment": pole_axis("outer axis")}
    measured_data = MEASURED
    windows = Windows.of(
        "sampler", "t_start t_end mean std n flagged",
        **{f"outer_{e}": f"sampler.angle_{e}" for e in ("start", "end")},
        **{f"inner_{e}": f"sampler_inner.angle_{e}" for e in ("start", "end")},
    )  # fmt: skip
    channels = ("table.angle_x", "table.angle_y", *RebalanceTest.channels)

    def base(self) -> Array:
        return geometry.base(self["latitude"])

    def field_axes(self) -> dict[str, Any]:
        return {**super().field_axes(), "surroundings.inner": 1}

    def plan(self) -> Plan:
        """Return the positions in order, every one with both angles; angles are counted on through the turns.

        Of visits, in their order; each axis takes the shorter way.
        """
        if self["visits"]:
            return self._visiting(self.visits())
        phases = []
        each = {"mode": "index", "face": "gyro", "settle": self["settle"], "dwell": self["dwell"]}
        each["window"] = self["dwell"] / self["windows"]
        for j in range(self["positions"] * self["cycles"]):
            theta = 2.0 * math.pi * j / self["positions"]
            label = f"θ = {math.degrees(theta):.6g}°"
            phases.append(Phase(label=label, target=self["m"] * theta, target_y=self["n"] * theta, **each))
        return Plan(phases, {"gyro": geometry.FACE.tolist()})

    def visits(self) -> list[Visit]:
        """Return the visits of the option.  Raises InvalidValueError."""
        return parse_visits("visits", self["visits"], ("rad", "rad"), self["dwell"])

    def _visiting(self, visits: list[Visit]) -> Plan:
        phases = []
        angles = (0.0, 0.0)
        for v in visits:
            outer, inner = v.place
            angles = tuple(nearest_turn(a, b, 2.0 * math.pi) for a, b in zip(v.place, angles, strict=True))  # type: ignore[assignment]
            label = f"{math.degrees(outer):.6g}°, {math.degrees(inner):.6g}°"
            each = {"mode": "index", "face": "gyro", "settle": self["settle"], "dwell": v.dwell}
            window = v.dwell / self["windows"]
            phases.append(Phase(label=label, target=angles[0], target_y=angles[1], window=window, **each))
        return Plan(phases, {"gyro": geometry.FACE.tolist()})

    def check(self) -> list[str]:
        if not self["inner_rate"] > 0.0:
            return ["inner_rate = 0: the inner axis would never arrive", *super().check()]
        if self["visits"]:
            return self._visit_problems() + super().check()
        values = (self["latitude"], self["m"], self["n"], self["positions"])
        problems = geometry.refusals(*values)
        if self["harmonic"] and not problems:
            problems = geometry.harmonic_problems(*values)
        return problems + super().check()

    def _visit_problems(self) -> list[str]:
        try:
            angles = np.array([v.place for v in self.visits()])
        except InvalidValueError as error:
            return [str(error)]
        if self["harmonic"]:
            return ["harmonic: the positions of visits are not equally spaced on a path; leave out one of the two"]
        return geometry.visit_problems(self["latitude"], angles[:, 0], angles[:, 1])

    def warnings(self) -> list[str]:
        values = (self["latitude"], self["m"], self["n"], self["positions"])
        return [] if self["visits"] else geometry.cautions(*values)

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        reach = parameters.get("gyro.k", math.inf) * parameters.get("rebalance.i_max", math.inf)
        if self["inner_rate"] > 0.9 * reach:
            problems.append(
                f"inner_rate = {self['inner_rate']:g} rad/s: the inner axis is the input axis, and the torquer follows "
                f"up to k i_max = {reach:.4g} rad/s; at most 0.9 of that"
            )
        return problems if self["fold"] else problems + drift.fold_problems(parameters, "gyro.")
