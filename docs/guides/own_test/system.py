"""Six-position test: each axis of a floated gyro up and down, its current read in torque rebalance."""

from gyrobench import attitudes, frames
from gyrobench.reduction.drift.rest_test import SMALL, RestTest
from gyrobench.reduction.toolkit import Source
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SETTLE, SITE, TORQUER, type_b
from gyrobench.system.families.rebalance_test import RebalanceTest
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option

POSITIONS = ("U N", "-U N", "N U", "N -U", "N E", "N -E")  # input and output axis; in the last two S is down, up


class SixPositionReduction(RestTest):
    names = ("D_F", "D_I", "D_O", "D_S", "D_II", "D_SS")  # what they tell apart: no two axes share gravity
    method = "Least squares over six positions"

    @Source("fixture.level", "level of the fixture about east", "rad", "u_level", parameter="table.tilt[1]")
    def level(self, found):
        return -self.believed(found, self.axes @ frames.rotation(frames.E, SMALL).T)


class SixPosition(RebalanceTest):
    title = "Six-position test"
    slots = RebalanceTest.with_parts(table="table_rate", gyro="floated_gyro", rebalance="rebalance_analog")
    options = SITE | TORQUER | SETTLE | CORRECTIONS | NUISANCES | {"dwell": Option(600.0, "s", "time in a position")}
    options |= type_b("mount", "scale_factor", "nonlinearity", "current")
    reduction = SixPositionReduction

    def plan(self):
        each = {"mode": "index", "settle": self["settle"], "dwell": self["dwell"], "window": self["dwell"] / 10.0}
        faces = {p: attitudes.parse(p, self["latitude"]) for p in POSITIONS}
        return Plan([Phase(label=p, face=p, **each) for p in POSITIONS], faces)
