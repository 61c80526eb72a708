"""Single-axis tumble of a two-degree-of-freedom gyro, both channels in torque rebalance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from gyrobench import drift
from gyrobench.system.families.handed_axis import pole_axis
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SITE, TILTED, type_b
from gyrobench.system.families.physical_form import PHYSICAL_FORM
from gyrobench.system.families.rebalance_test import TwoChannelTest
from gyrobench.system.families.tumble_test import TumbleTest
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Windows

from . import geometry
from .measured import MEASURED

INDEX_RATE = 3e-3  # rad/s: in a dwell's mount the y axis sees the table move; the torquer follows up to 4.2e-3 rad/s


class TumbleTwoChannel(TumbleTest, TwoChannelTest):
    """The spin axis lies along the table axis and that along the pole; the table turns at ten times Earth rate against
    the Earth.  Both measuring axes are perpendicular to it, so that neither Earth rate nor table rate enters.  Two
    mounts (spin axis along +pole and -pole) give the eight coefficients of the simple model; with two dwells (inner
    gimbal axis vertical) nine coefficients a channel.

    [TEST-TUMBLE1-2DOF-A, -B; Hu 1981, eq. 3-22..3-37]
    """

    title = "Single-axis tumble test of a two-degree-of-freedom gyro"
    spec = ("TEST-TUMBLE1-2DOF-A", "TEST-TUMBLE1-2DOF-B", "GYRO-DYN-2DOF", "GYRO-STATIC-2DOF", "LOOP-REBALANCE")
    slots = TwoChannelTest.with_parts(
        table="table_rate", gyro="gyro_2dof", rebalance_x="rebalance_analog", rebalance_y="rebalance_analog"
    )
    options = (
        {"model": Option("nine", str, "nine: nine terms a channel, two mounts, two dwells; simple: four, two mounts")}
        | SITE
        | PHYSICAL_FORM
        | TumbleTest.tumble
        | {
            "fold": Option(False, bool, "accept that Dx_yy and Dy_xx are folded into the other squares, the constant"),
            "tilt": Option("auto", str, "tilts of the measuring axes to the spin axis: estimated (yes; needs "
                           "both_senses), zero (no), or weighed by the data (auto)", form=TILTED),
        }
        | NUISANCES
        | CORRECTIONS
        | type_b("axis", "mount", "remount", "wobble", "angle1", "angle2")
        | type_b("scale_factor", "nonlinearity", "current", "pulse", "switching")
        | {
            f"k_{a}": Option(0.0, "rad/s/A", f"scale factor of the torquer about {a}; 0: that of the gyro", 0.0)
            for a in "xy"
        }
    )  # fmt: skip
    takes: ClassVar[Mapping[str, Any]] = {"stand_alignment": pole_axis()}
    measured_data = MEASURED
    windows = Windows.of(
        "sampler_x", "t_start t_end angle_start angle_end n flagged", flagged_y="sampler_y.flagged",
        **{f"{n}_{a}": f"sampler_{a}.{n}" for n in ("mean", "std") for a in "xy"},
    )  # fmt: skip
    channels = ("table.angle", *TwoChannelTest.channels)

    def faces(self) -> dict[str, Any]:
        return geometry.faces(self["model"], self["latitude"])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {**super().parameters(parts), "table.index_rate": INDEX_RATE}

    def check(self) -> list[str]:
        problems = geometry.refusals(self["latitude"], self["model"]) + super().check()
        if self["tilt"].lower() in ("yes", "true") and not self["both_senses"]:
            problems.append(
                "tilt: at one table rate the tilt of a measuring axis towards the spin axis cannot be told from Dx_z, "
                "Dy_z; set both_senses=true"
            )
        return problems

    def warnings(self) -> list[str]:
        return geometry.cautions(self["latitude"])

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        seen = self["fold"] or self["model"] != "nine"
        return problems if seen else problems + drift.fold_problems(parameters, "gyro.")
