"""What ground, heat and field do to a gyro on a table: sensitivities from one run, and the budgets of a table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from gyrobench.attitudes import parse
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SITE, TORQUER, type_b
from gyrobench.system.families.rebalance_test import RebalanceTest
from gyrobench.system.families.table_test import sampled, surroundings
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import OnRequest, Option, Slot, Windows
from gyrobench.units import ARCSEC, G0

from . import budgets, isolation, sources
from .budgets import ERU

ATTITUDE = "E U"  # input axis east, output axis up, spin axis south
HEAT = surroundings()["surroundings"]
#: sensitivities of the test sensor of Hu 1981 (section 5.6), where the user gives no others
SENSOR = {
    "D_I": 0.1 * ERU,
    "D_S": 0.1 * ERU,
    "D_SS": 5e-5 * ERU,
    "D_IS": 1e-3 * ERU,
    "D_T": 0.4e-3 * ERU * 1.8,  # per degree Fahrenheit there
    "D_TO": 1e-3 * ERU * 1.8,
    "D_B[1]": 40e-6 * ERU / 1e-4,  # per gauss there
}


#: wires that lead past a foundation, and those through it
FELT = """
    site -> table: alpha=alpha_local
    site.omega[1] -> sampler_rate.x
    site.tilt[1] -> sampler_east.x
    site.tilt[2] -> sampler_north.x
"""
DIRECT = "site -> table: f=f_local omega=omega_local" + FELT
ABOVE = """
    site -> foundation: g a tilt tilt_rate tilt_acceleration omega alpha
    foundation -> table: f_block=f_local omega_block=omega_local alpha_block=alpha_local
    foundation.omega_block[1] -> sampler_rate.x
    foundation.tilt_block[1] -> sampler_east.x
    foundation.tilt_block[2] -> sampler_north.x
"""
MOVED = tuple(f"{name}[{k}]" for name in ("site.a", "foundation.a_block", "foundation.tilt_block") for k in (1, 2, 3))


class TableEnvironment(RebalanceTest):
    """A gyro in torque rebalance stands still on a table whose ground tilts slowly, whose room warms and in whose coil
    a field swings; the drift is resolved into what each of them does.  Beside it the budgets of surroundings, alignment
    and rate mode, by root of squares, worst case and Monte Carlo.

    [ENV-DISTURBANCE, ALIGN-ERRORS, ERROR-BUDGET; Hu 1981, sections 5.6..5.8]
    """

    title = "Surroundings of a table"
    spec = ("ENV-DISTURBANCE", "ENV-FOUNDATION", "ALIGN-ERRORS", "ERROR-BUDGET")
    on_request: ClassVar[Mapping[str, OnRequest]] = {
        "foundation": OnRequest({"foundation": Slot("Foundation", "foundation_passive")}, ABOVE, {}, MOVED, DIRECT)
    }
    slots = {
        **RebalanceTest.with_parts(table="table_rate", gyro="floated_gyro", rebalance="rebalance_analog"),
        "site": Slot("Site", "ground_motion"),
        **HEAT.slots,
        **{f"sampler_{n}": Slot("Sampler", "sampler") for n in ("rate", "north", "east", "difference", "field")},
    }
    wires = (
        RebalanceTest.wires
        + HEAT.wires
        + FELT
        + """
        surroundings.dT[2] -> sampler_difference.x
        surroundings.B[1] -> sampler_field.x
        """
        + "".join(sampled(f"sampler_{n}") for n in ("rate", "north", "east", "difference", "field"))
    )
    options = (
        SITE
        | {
            "dwell": Option("2h", "s", "time of the readings"),
            "readings": Option(120, int, "readings (averaging windows)", 40, 10000),
            "settle": Option(10.0, "s", "wait before the readings", 1.0),
            "tilting": Option("900arcsec", "rad", "amplitude of the tilts about E and N", 0.0, 4.5e-3),
            "warming": Option("2K/h", "K/s", "ramp of the room"),
            "cooling": Option("4K", "K", "gyro above the room at the start, time constant an eighth of the readings"),
            "coil": Option("2mT", "T", "amplitude of the field along E"),
        }
        | TORQUER
        | NUISANCES
        | CORRECTIONS
        | type_b("mount", "scale_factor", "current", sources)
        | {
            "u_tilt": Option("0.6arcsec", "rad", "surroundings of the later tests: tilt", 0.0),
            "u_rate": Option("2e-5arcsec/s", "rad/s", "rate of tilting", 0.0),
            "u_temperature": Option("10mK", "K", "mean temperature", 0.0),
            "u_difference": Option("2mK", "K", "temperature difference along O", 0.0),
            "u_field": Option("1uT", "T", "magnetic field along I", 0.0),
            "align": Option(budgets.ALIGN, str, "misalignments: NAME ANGLE KIND; ... (normal, uniform, fixed)"),
            "turning": Option(10.0, "1", "table rate over Earth rate, for the misalignments", 0.01),
            "sense": Option(0, int, "table against the Earth -1, with it +1; 0: not known, the larger effect", -1, 1),
            "rate_mode": Option(budgets.RATE_MODE, str, "errors of the angle in rate mode: NAME ANGLE KIND; ..."),
            "averaging": Option("1deg", "rad", "angle over which a rate is averaged", 0.0),
        }
    )  # fmt: skip
    step = 2.5e-3  # s: nothing is fast here
    windows = Windows.of(
        "sampler", temperature="thermometer.mean", ground_rate="sampler_rate.mean", tilt_east="sampler_east.mean",
        tilt_north="sampler_north.mean", difference="sampler_difference.mean", field="sampler_field.mean",
    )  # fmt: skip
    channels = (
        *RebalanceTest.channels, "site.tilt[1]", "site.tilt[2]", "surroundings.temperature", "surroundings.B[1]",
    )  # fmt: skip
    shown = ("gyro.drift", "site.tilt", "surroundings.temperature", "surroundings.B")

    def plan(self) -> Plan:
        window = self["dwell"] / self["readings"]
        phase = Phase(
            label="at rest", mode="index", face=ATTITUDE, target=0.0, settle=self["settle"], dwell=self["dwell"],
            window=window,
        )  # fmt: skip
        return Plan([phase], {ATTITUDE: parse(ATTITUDE, self["latitude"])})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        dwell = self["dwell"]
        return {
            **super().parameters(parts),
            **{f"gyro.{n}": v for n, v in SENSOR.items()},
            # periods that no two of the causes share within the readings
            "site.period[1]": dwell / 3.0,
            "site.period[2]": dwell / 4.3,
            "site.tilt_amplitude[1,1]": self["tilting"],
            "site.tilt_amplitude[2,2]": self["tilting"],
            "surroundings.ramp": self["warming"],
            "surroundings.tau": dwell / 8.0,
            "surroundings.start_above": self["cooling"],
            "surroundings.share[2]": 0.5,
            "surroundings.field_swing[1]": self["coil"],
            "surroundings.period": dwell / 5.7,
            "surroundings.base": self.base(),
        }

    def check(self) -> list[str]:
        problems = super().check() + budgets.latitude_problems(self["latitude"])
        for name in ("align", "rate_mode"):
            try:
                sizes = [line.size for line in budgets.parse(self[name], "rad")]
                if name == "align" and max(sizes) > budgets.SMALL:
                    problems.append(f"align: an angle of {math.degrees(max(sizes)):.3g}° is not small: 1° at most")
            except ValueError as error:
                problems.append(f"{name}: {error}")
        if not self["averaging"] > 0.0:
            problems.append("averaging = 0: an error of the angle becomes one of the rate over an angle above 0")
        for name in ("tilting", "cooling", "coil"):
            if self[name] == 0.0:
                problems.append(f"{name} = 0: what it does cannot be found; give the size of the excitation")
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters) + self._travel_problems(parameters)
        if not (self["k"] or parameters.get("gyro.k")):
            problems.append("k unknown: the gyro has no parameter k; give the option k, as 17.2deg/h/mA")
        return problems

    def _travel_problems(self, parameters: Mapping[str, Any]) -> list[str]:
        """Return that the tilts of this test would drive an active foundation to its stops, and what would not."""
        p = isolation.parameters(parameters)
        if not {"corner", "travel"} <= p.keys():
            return []
        tilts = zip((3.0, 4.3), ("[1,1]", "[2,2]"), strict=True)
        way = max(
            abs(float(parameters.get(f"site.tilt_amplitude{k}", self["tilting"])))
            * float(abs(isolation.follows(n / self["dwell"], p, G0)))
            for n, k in tilts
        )
        if 2.0 * way <= p["travel"]:
            return []
        most = math.floor(self["tilting"] / ARCSEC * p["travel"] / (2.0 * way))
        return [
            f"tilting = {self['tilting'] / ARCSEC:.3g}″: the servo of an active foundation follows a tilt of the "
            f"ground, here by {way:.2g} m and twice that at the start, beyond its travel of {p['travel']:g} m; "
            f"give --set tilting={most}arcsec, or a longer dwell"
        ]
