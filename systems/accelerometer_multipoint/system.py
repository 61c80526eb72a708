"""Multi-position test of a pendulous accelerometer on an indexing head with a horizontal axis."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SITE, type_b
from gyrobench.system.families.table_test import TableTest, on_table
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot
from gyrobench.system.values import InvalidValueError
from gyrobench.system.visits import Visit, nearest_turn, parse_visits

from . import geometry, sources
from .measured import MEASURED

TURN = 2.0 * math.pi
DEG = math.pi / 180.0
STATIONS = 24  # of the indexing head
MOUNTS = {"both": ("a", "b"), "a": ("a",), "b": ("b",)}


class AccelerometerMultipoint(TableTest):
    """An accelerometer stands in 4, 8, 12 or 24 equally spaced positions about a horizontal axis; gravity gives bias,
    scale factor, second and third order; two mounts give the cross terms with the output and with the pendulum axis.

    [TEST-ACC-MULTI; Hu 1981, eq. 3-38..3-46]
    """

    title = "Multi-position test of an accelerometer"
    spec = ("TEST-ACC-MULTI", "ACC-EXACT", "ACC-4PT", "ACC-MINPTS")
    protocol = "design"
    slots = on_table(table=Slot("Table", "index_head"), accelerometer=Slot("Accelerometer", "accelerometer_pendulous"))
    wires = f"""
        {TableTest.wires}
        table -> accelerometer: f
        accelerometer -> sampler: i_read=x saturated=flag
    """
    options = (
        SITE
        | CORRECTIONS
        | {
            "nuisances": NUISANCES["nuisances"],
            "points": Option(24, int, "positions a turn: 4, or 7 to 24", 4, STATIONS),
            "mounts": Option("both", str, "a (gives k5), b (gives k4) or both"),
            "turns": Option(1, int, "turns in each mount", 1, 24),
            "visits": Option(
                "", str, "positions in place of these, 'a 0deg 10s; a 45deg; b 90deg': mount, angle, dwell"
            ),
            "settle": Option(2.0, "s", "wait before averaging, in each position", 0.0),
            "dwell": Option(10.0, "s", "time averaged in each position"),
            "readings": Option(1, int, "windows in which that time is recorded", 1, 100),
            "scale": Option(
                0.0, "m/s2/A", "scale λ for the reduction; 0: the parameter scale of the accelerometer", 0.0
            ),
        }
        | type_b(sources)
    )
    noises = (
        "accelerometer.turn_on", "accelerometer.markov", "accelerometer.white", "accelerometer.meter", "table.repeat",
    )  # fmt: skip
    assumed = ("table.base",)
    measured_data = MEASURED
    channels = ("table.angle", "accelerometer.i", "accelerometer.theta")
    channel_period = 1.0

    def plan(self) -> Plan:
        """Return mount a, then mount b, position after position; the head goes on through the turns and never back.

        Of visits, in their order; the head takes the shorter way.
        """
        if self["visits"]:
            return self._visiting(self.visits())
        n = self["points"]
        phases: list[Phase] = []
        each = {"settle": self["settle"], "dwell": self["dwell"], "window": self["dwell"] / self["readings"]}
        for mount in MOUNTS.get(self["mounts"], ()):
            for k in range(n * self["turns"]):
                label, target = f"mount {mount}, {360.0 * (k % n) / n:.4g}°", TURN * len(phases) / n
                phases.append(Phase(label, "index", mount, target, **each))
        return Plan(phases, {m: f.tolist() for m, f in geometry.FACES.items()})

    def visits(self) -> list[Visit]:
        """Return the visits of the option.  Raises InvalidValueError."""
        found = parse_visits("visits", self["visits"], ("", "rad"), self["dwell"])
        for k, v in enumerate(found, 1):
            if v.place[0] not in geometry.FACES:
                raise InvalidValueError(f"visits, visit {k}: mount '{v.place[0]}' must be a or b")
            if abs(v.place[1] * STATIONS / TURN - round(v.place[1] * STATIONS / TURN)) > 1e-6:
                step = 360.0 / STATIONS
                raise InvalidValueError(f"visits, visit {k}: {v.place[1] / DEG:.6g}° is not a multiple of {step:g}°")
        return found

    def _visiting(self, visits: list[Visit]) -> Plan:
        phases: list[Phase] = []
        angle = 0.0
        for v in visits:
            mount, at = v.place
            angle = nearest_turn(at, angle, TURN)
            each = {"settle": self["settle"], "dwell": v.dwell, "window": v.dwell / self["readings"]}
            phases.append(Phase(f"mount {mount}, {at / DEG:.4g}°", "index", mount, angle, **each))
        return Plan(phases, {m: f.tolist() for m, f in geometry.FACES.items()})

    def base(self) -> Array:
        return geometry.BASE

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        stations = STATIONS if self["visits"] or STATIONS % self["points"] == 0 else self["points"]
        return {**super().parameters(parts), "table.positions": stations}

    def check(self) -> list[str]:
        from .refusals import points_problems

        problems = super().check()
        if self["visits"]:
            try:
                self.visits()
            except InvalidValueError as error:
                problems.append(str(error))
        else:
            problems += points_problems(self["points"], self["mounts"], self["turns"])
        if self["mounts"] not in MOUNTS:
            problems.append(f"mounts = {self['mounts']}: must be a, b or both")
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        axis = np.asarray(parameters.get("table.base", geometry.BASE))[2]
        if abs(float(axis[2])) > DEG:
            problems.append(
                f"table.base: the axis stands {math.degrees(math.asin(min(1.0, abs(float(axis[2]))))):.3g}° from the "
                "horizon; the test needs a horizontal axis (1°)"
            )
        if not problems and "accelerometer.mount" in parameters:
            from .refusals import zero_problems

            mounts = sorted({str(v.place[0]) for v in self.visits()}) or MOUNTS[self["mounts"]]
            problems += zero_problems({m: geometry.zero_angle(m, parameters["accelerometer.mount"]) for m in mounts})
        return problems

    def warnings(self) -> list[str]:
        if self["points"] == 4 and not self["visits"]:
            return ["Four positions: k3 is not told from k1, and the cross term from k0 and k2."]
        return []
