"""Single-axis tumble of a floated gyro in torque rebalance, as a co-simulation that carries its own plan."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from gyrobench import drift, frames
from gyrobench.system.families.handed_axis import pole_axis
from gyrobench.system.families.option_groups import CORRECTIONS, FOLD, NUISANCES, SITE, SUPPLY, TILT, TORQUER, type_b
from gyrobench.system.families.physical_form import PHYSICAL_FORM
from gyrobench.system.families.rebalance_test import RebalanceTest
from gyrobench.system.families.tumble_test import TumbleTest
from gyrobench.system.system import Option

from .measured import MEASURED


class TumbleSingleAxis(TumbleTest, RebalanceTest):
    """The table axis lies along the pole and turns at ten times Earth rate against the Earth; the input axis is
    perpendicular to it, so that neither Earth rate nor table rate enters.  Two mounts (output axis along +pole and
    -pole) and two dwells with the output axis vertical give nine drift coefficients.

    [TEST-TUMBLE1-SDF; Hu 1981, eq. 3-12..3-21]
    """

    title = "Single-axis tumble test"
    spec = ("TEST-TUMBLE1-SDF", "GYRO-DYN-1", "GYRO-STATIC-9", "LOOP-REBALANCE")
    protocol = "design"
    slots = RebalanceTest.with_parts(table="table_rate", gyro="floated_gyro", rebalance="rebalance_analog")
    options = (
        SITE
        | PHYSICAL_FORM
        | TumbleTest.tumble
        | TumbleTest.intermittent
        | FOLD
        | TILT
        | NUISANCES
        | {"terms": Option(9, int, "terms of the fitted model: 9 (10 terms have rank 9 at 1 g)", 3, 9)}
        | CORRECTIONS
        | type_b("axis", "mount", "remount", "wobble", "angle1", "angle2", "scale_factor", "nonlinearity", "current")
        | type_b("pulse", "switching")
        | SUPPLY
        | TORQUER
    )
    takes: ClassVar[Mapping[str, Any]] = {"stand_alignment": pole_axis()}
    measured_data = MEASURED
    channels = ("table.angle", *RebalanceTest.channels)

    def faces(self) -> dict[str, Any]:
        return frames.tumble_faces(self["latitude"])

    def check(self) -> list[str]:
        from .refusals import refusals

        problems = refusals(self["latitude"]) + super().check()
        if self["terms"] not in drift.TERM_SETS:
            problems.append(f"terms = {self['terms']}: no such model; there are 3, 4, 5, 8 and 9 terms")
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        terms = parameters.get("gyro.terms", 9)
        if terms not in drift.TERM_SETS:
            known = ", ".join(str(t) for t in drift.TERM_SETS)
            problems.append(f"gyro.terms = {terms:g}: no such model; the gyro has {known} terms")
        return problems if self["fold"] else problems + drift.fold_problems(parameters, "gyro.")
