"""Two-axis servo test: a two-degree-of-freedom gyro holds a table with two axes, mount by mount."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from gyrobench import frames
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, type_b
from gyrobench.system.families.physical_form import PHYSICAL_FORM, physical_drift
from gyrobench.system.families.rebalance_test import TWO_AXIS_NOISES
from gyrobench.system.families.servo_test import SITE_AND_STAND, TRACKING
from gyrobench.system.families.table_test import TableTest, supply, surroundings
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Plan
from gyrobench.system.system import OnRequest, Option, Slot, Windows
from gyrobench.system.values import parse_number
from gyrobench.units import DPH

from . import geometry, setup
from .measured import MEASURED


class ServoTwoAxis(TableTest):
    """The x pickoff drives the outer and the y pickoff the inner axis of a table, so that the plate keeps the gyro's
    x and y axes free of rotation but for the drift, while the base turns with the Earth below.  The angles of both axes
    over a day in two of the twelve mounts of Hu 1981 give nine coefficients a channel; the torquers are idle.

    With ``levelled`` the torquers keep both angles at 0 instead: the drift is that of one attitude.  [SERVO2-LEVELLED]

    [TEST-SERVO2-2DOF; Hu 1981, eq. 3-94..3-102, appendix 2]
    """

    title = "Two-axis servo test"
    spec = ("TEST-SERVO2-2DOF", "LOOP-TABLE-SERVO", "GYRO-DYN-2DOF", "GYRO-STATIC-2DOF")
    protocol = "design"
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "stand": Slot("Stand", "fixture"),
        "wobble_x": Slot(setup.WOBBLE, "axis_wobble"),
        "outer": Slot("ServoTable", "table_servo"),
        "wobble_y": Slot(setup.WOBBLE, "axis_wobble"),
        "inner": Slot("ServoTable", "table_servo"),
        "gyro": Slot("TwoAxisGyro", "gyro_2dof"),
        "coupling": Slot(setup.COUPLING, "axis_coupling"),
        "cage_x": Slot("Cage", "cage"),
        "cage_y": Slot("Cage", "cage"),
        "sampler_x": Slot("Sampler", "sampler"),
        "sampler_y": Slot("Sampler", "sampler"),
    }
    wires = setup.WIRES
    on_request: ClassVar[Mapping[str, OnRequest]] = {
        **surroundings("outer: angle_read", setup.FIELD),
        **supply(),
        setup.METERS["x"]: OnRequest(
            {slot: Slot("Sampler", "sampler") for slot in setup.METERS.values()},
            setup.LEVELLED,
            {f"current_{a}": f"{slot}.mean" for a, slot in setup.METERS.items()},
        ),
    }
    open = ("outer.face",)  # left at their start values
    options = (
        SITE_AND_STAND
        | PHYSICAL_FORM
        | {
            "mounts": Option("2 4", str, "mounts in their order, by their numbers in Hu 1981 (1 to 12)"),
            "time": Option(86400.0, "s", "time in each mount", 1.0),
            "window": Option(600.0, "s", "length of a window", 1e-3),
            "settle": Option(10.0, "s", "wait after both loops have closed", 0.5),
            "terms": Option(9, int, "terms of the model of a channel: 8 (Hu 1981), 9 (with Dx_y, Dy_x)", 8, 9),
            "levelled": Option(False, bool, "torquers keep both angles at 0: one composite drift a mount and channel"),
            "k_x": Option(0.0, "rad/s/A", "scale factor of the torquer about x; 0: that of the gyro", 0.0),
            "k_y": Option(0.0, "rad/s/A", "scale factor of the torquer about y; 0: that of the gyro", 0.0),
        }
        | TRACKING
        | CORRECTIONS
        | NUISANCES
        | type_b("scale_factor", "current")
        | type_b("square", "angle1", "angle2", "wobble", "time", "mount", "remount",
                 axis="standard uncertainty of each mount, about each of its axes")
    )  # fmt: skip
    assumed = ("gyro.mount", "outer.base", "inner.base", "stand.base", "stand.mounts")
    noises = (*TWO_AXIS_NOISES, "outer.rumble", "inner.rumble")
    measured_data = MEASURED
    windows = Windows("sampler_x.count", setup.COLUMNS)
    channels = ("outer.angle", "inner.angle", "gyro.u_x", "gyro.u_y", "gyro.drift_x", "gyro.drift_y")
    channel_period = 60.0

    def __init__(self) -> None:
        super().__init__()
        self.torquers = dict.fromkeys(("k_x", "k_y"), 17.2e3 * DPH)  # of the gyro, once parameters() has seen it

    def set(self, name: str, value: Any) -> None:
        super().set(name, value)
        if self["levelled"]:
            self.request(setup.METERS["x"])

    def mounts(self) -> list[int]:
        """Return the numbers of the mounts; the default where the option is no list of them (check says so)."""
        from .refusals import numbers

        return numbers(self["mounts"]) or [2, 4]

    def earth_rate(self) -> float:
        """Return the Earth rate as the site will have it, rad/s."""
        return parse_number("site.earth_rate", self.overrides.get("site.earth_rate", frames.EARTH_RATE), "rad/s")

    def plan(self) -> Plan:
        return setup.plan(self.mounts(), self["time"], self["window"], self["settle"], self.currents())

    def currents(self) -> dict[int, tuple[float, float]]:
        """Return the currents that take the Earth's rate out of each mount, A, about x and y; none without levelled."""
        if not self["levelled"]:
            return {}
        earth = frames.earth_rate_local(self["latitude"], self.earth_rate())
        along = {m: geometry.base(m, self["latitude"]) @ earth for m in self.mounts()}
        return {m: (float(w[0]) / self.torquers["k_y"], float(w[1]) / self.torquers["k_x"]) for m, w in along.items()}

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        known = {n: self[n] or parts.get(f"gyro.{n}", 0.0) for n in self.torquers}
        self.torquers |= {n: float(k) for n, k in known.items() if k}
        physical = physical_drift(self, parts)
        field = self.field_axes() if "surroundings" in self.slots else {}
        return {
            **self.plan().parameters(), **self.owned(), **physical, **setup.parameters(parts, self.mounts()), **field,
            **(setup.levelling(parts) if self["levelled"] else {}),
        }  # fmt: skip

    def field_axes(self) -> dict[str, Any]:
        return {**super().field_axes(), "surroundings.inner": 1}

    def check(self) -> list[str]:
        from .refusals import option_problems

        return option_problems(self.values, self.step, self.earth_rate()) + super().check()

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        from .refusals import current_problems, model_problems

        problems = super().check_parameters(parameters)
        if self["levelled"]:
            problems += current_problems(parameters, self.currents())
        return problems or model_problems(parameters, self.mounts(), self.values)

    def warnings(self) -> list[str]:
        from .refusals import cautions

        if self["levelled"]:
            return []
        return cautions(self.mounts(), self["latitude"], self["time"], self.earth_rate(), self["terms"])
