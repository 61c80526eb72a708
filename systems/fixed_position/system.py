"""Fixed-position test of a floated gyro in torque rebalance."""

from __future__ import annotations

from gyrobench.attitudes import attitude_problems
from gyrobench.system.families.option_groups import ATTITUDE, CORRECTIONS, NUISANCES, SITE, SUPPLY, TORQUER, type_b
from gyrobench.system.families.physical_form import PHYSICAL_FORM
from gyrobench.system.families.rate_reading import RateReading
from gyrobench.system.plan import Plan
from gyrobench.system.system import Option

from .measured import ATTITUDE as FACE
from .measured import MEASURED


class FixedPosition(RateReading):
    """The gyro stands still in its service attitude with its rebalance loop closed, or a rate gyro does: one composite
    drift, and by repeats its stability.

    [TEST-FIXED; Hu 1981, ch. 3 par. 2.2]
    """

    title = "Fixed-position test"
    spec = ("TEST-FIXED", "GYRO-DYN-1", "GYRO-STATIC-9", "LOOP-REBALANCE")
    slots = RateReading.with_parts(table="table_rate", gyro="floated_gyro", rebalance="rebalance_analog")
    rate_gyro = "gyro_rate"
    options = (
        SITE
        | PHYSICAL_FORM
        | ATTITUDE
        | RateReading.reads
        | {
            "dwell": Option(3600.0, "s", "time of the readings"),
            "readings": Option(30, int, "readings (averaging windows)", 8, 10000),
            "settle": Option(10.0, "s", "wait before the readings", 1.0),
        }
        | TORQUER
        | NUISANCES
        | CORRECTIONS
        | type_b("attitude", "latitude", "scale_factor", "current")
        | SUPPLY
    )
    measured_data = MEASURED

    def plan(self) -> Plan:
        return self.in_attitude(FACE, self["dwell"], self["dwell"] / self["readings"])

    def check(self) -> list[str]:
        return attitude_problems(self["attitude"], self["latitude"]) + super().check()
