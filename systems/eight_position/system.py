"""Eight-position test of a two-degree-of-freedom gyro with two rebalance loops."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SITE, type_b
from gyrobench.system.families.physical_form import PHYSICAL_FORM
from gyrobench.system.families.rebalance_test import TwoChannelTest
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Windows
from gyrobench.system.values import InvalidValueError
from gyrobench.system.visits import Visit, parse_visits

from . import positions, refusals
from .measured import MEASURED


class EightPosition(TwoChannelTest):
    """The gyro stands in eight attitudes, several times over; Earth rate and gravity give both torquers' scale
    factors, the constant drifts and the mass unbalances of both channels.

    [TEST-8POS; Hu 1981, eq. 3-1..3-11, Table 3-1]
    """

    title = "Eight-position test"
    spec = ("TEST-8POS", "GYRO-DYN-2DOF", "GYRO-STATIC-2DOF", "LOOP-REBALANCE")
    protocol = "design"
    slots = TwoChannelTest.with_parts(
        table="table_rate", gyro="gyro_2dof", rebalance_x="rebalance_analog", rebalance_y="rebalance_analog"
    )
    options = (
        SITE
        | PHYSICAL_FORM
        | {
            "cycles": Option(10, int, "times the eight positions are gone through", 1, 12),
            "visits": Option("", str, "positions in place of these cycles, '1 60s; 3; 5 90s; ...': number, time"),
            "readings": Option(10, int, "readings (averaging windows) in each position", 1, 100),
            "dwell": Option(60.0, "s", "time of the readings in each position"),
            "settle": Option(10.0, "s", "wait before the readings, after each change of position", 1.0),
            "sigma": Option(True, bool, "scatter over the cycles is asked for (at least two cycles)"),
            "terms": Option(6, int, "unknowns of a channel: 4 (Hu 1981) or 6 (with two compliance differences)", 4, 6),
        }
        | CORRECTIONS
        | NUISANCES
        | type_b("latitude", "current", "nonlinearity", "pulse", "switching",
                 attitude="standard uncertainty of each position, about each axis, independent",
                 mount="standard uncertainty of the gyro in its fixture, about each axis")
    )  # fmt: skip
    measured_data = MEASURED
    windows = Windows.of(
        "sampler_x", "t_start t_end angle_start angle_end",
        **{f"{n}_{c}": f"sampler_{c}.{n}" for c in "xy" for n in ("mean", "std", "flagged")}, n="sampler_x.n",
    )  # fmt: skip

    def plan(self) -> Plan:
        """Return the eight positions, ``cycles`` times, or visits; the table does not turn, the mount changes."""
        faces = {positions.NAMES[n]: a for n, a in positions.ATTITUDES.items()}
        if self["visits"]:
            return Plan(self._visiting(self.visits()), faces)
        readings = {"settle": self["settle"], "dwell": self["dwell"], "window": self["dwell"] / self["readings"]}
        phases = [
            Phase(label=f"cycle {c}, {name}", mode="index", face=name, target=0.0, **readings)
            for c in range(1, self["cycles"] + 1)
            for name in faces
        ]
        return Plan(phases, faces)

    def visits(self) -> list[Visit]:
        """Return the visits of the option.  Raises InvalidValueError."""
        found = parse_visits("visits", self["visits"], ("",), self["dwell"])
        known = [str(n) for n in positions.ATTITUDES]
        for k, v in enumerate(found, 1):
            if v.place[0] not in known:
                raise InvalidValueError(f"visits, visit {k}: position '{v.place[0]}' must be 1 to 8")
        return found

    def _visiting(self, visits: list[Visit]) -> list[Phase]:
        """Return the phases of visits.  A cycle of a position is its visit: the n-th of each."""
        phases, seen = [], dict.fromkeys(positions.ATTITUDES, 0)
        for v in visits:
            n = int(v.place[0])
            seen[n] += 1
            readings = {"settle": self["settle"], "dwell": v.dwell, "window": v.dwell / self["readings"]}
            name = positions.NAMES[n]
            phases.append(Phase(label=f"cycle {seen[n]}, {name}", mode="index", face=name, target=0.0, **readings))
        return phases

    def check(self) -> list[str]:
        return refusals.options(self) + super().check()

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        if problems := super().check_parameters(parameters):
            return problems
        base = np.asarray(parameters.get("table.base", np.eye(3)), dtype=float)
        mount = np.asarray(parameters.get("gyro.mount", np.eye(3)), dtype=float)
        faces = self.planned_faces(parameters).values()
        a, b = parameters.get("table.tilt", [0.0, 0.0])
        tilt = frames.rotation([0.0, 1.0, 0.0], -b) @ frames.rotation([1.0, 0.0, 0.0], -a)
        actual = {n: mount @ np.asarray(f) @ tilt @ base for n, f in enumerate(faces, 1)}
        return refusals.attitudes(actual)

    def warnings(self) -> list[str]:
        return refusals.near_pole(self["latitude"])
