"""Multi-position and rate test of an inertial measurement unit on a table with two axes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SETTLE, SITE, type_b
from gyrobench.system.families.table_test import TableTest
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Plan
from gyrobench.system.system import OnRequest, Option, Slot, Windows
from gyrobench.system.values import InvalidValueError
from gyrobench.system.visits import Visit, parse_visits

from . import geometry, instruments, norms, plans, sources
from .channels import CHANNELS
from .hand import UNKNOWN
from .measured import MEASURED

IMU = Socket(
    "Imu",
    "three gyros and three accelerometers: inertial rate and specific force in, readings out",
    (
        inp("omega", "rad/s", "inertial rate, axes of the plate", 3),
        inp("f", "m/s2", "specific force, axes of the plate", 3),
        out("rate", "rad/s", "rates that the gyros x, y, z read", 3),
        out("f_read", "m/s2", "specific force that the accelerometers x, y, z read", 3),
    ),
)
COMPENSATOR = Socket(
    "ImuCompensator",
    "takes known errors off the readings of an inertial measurement unit",
    (
        inp("rate", "rad/s", "rates that the gyros x, y, z read", 3),
        inp("f_read", "m/s2", "specific force that the accelerometers x, y, z read", 3),
        out("omega", "rad/s", "inertial rate, axes of the case", 3),
        out("f", "m/s2", "specific force, axes of the case", 3),
    ),
)
#: noises of the accelerometers of the bench
ACCELEROMETER_NOISES = tuple(
    f"accelerometers.{n}"
    for n in ("turn_on", "white", *(f"{a}_{m}" for a in "xyz" for m in ("flicker", "walk")),
              *(f"white_{a}" for a in "xyz"))
)  # fmt: skip


class ImuPositions(TableTest):
    """Static positions and turns in both senses give bias, scale factor and misalignment of three gyros and three
    accelerometers, and the g-sensitivity of the gyros: gravity, the Earth rate and the rate of the table are known in
    every position.

    [IMU-POSITIONS, IMU-HAND, IMU-UPDOWN; IEEE 1559, Tedaldi 2014]
    """

    title = "Multi-position and rate test of an inertial measurement unit"
    spec = ("IMU-POSITIONS", "IMU-HAND", "IMU-UPDOWN")
    reduction = "reduction"
    protocol = "design"
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot("TwoAxisTable", "table_two_axis"),
        "imu": Slot(IMU, "imu"),
        **{f"sampler_{c.name}": Slot("Sampler", "sampler") for c in CHANNELS},
    }
    wires = instruments.wires()
    on_request: ClassVar[Mapping[str, OnRequest]] = {
        instruments.ACCELEROMETERS: OnRequest(
            {instruments.ACCELEROMETERS: Slot("Accelerometers", "accelerometer_mems")}, "",
            channels=tuple(f"accelerometers.f_read[{k}]" for k in (1, 2, 3)),
        ),
        instruments.COMPENSATOR: OnRequest(
            {instruments.COMPENSATOR: Slot(COMPENSATOR, "imu_compensator")}, "",
            channels=tuple(f"compensator.{n}[{k}]" for n in ("omega", "f") for k in (1, 2, 3)),
        ),
        instruments.CHAMBER: OnRequest(
            {instruments.CHAMBER: Slot("Surroundings", "thermal_chamber"), "thermometer": Slot("Sampler", "sampler")},
            "", {"temperature": "thermometer.mean"},
            ("chamber.temperature", "chamber.room"),
        ),
    }  # fmt: skip
    fitted: ClassVar[Mapping[str, tuple[str, str]]] = {"imu_compensator": (instruments.COMPENSATOR, "compensation")}
    options = (
        SITE
        | {
            "attitudes": Option("table", str, "table (read by it), unknown (gravity and turns), up_down (of a file)"),
            "positions": Option(12, int, "positions: 6, 12, 18, 20, 24, 26 or 36"),
            "visits": Option("", str, "positions in place of these, '30deg 45deg 120s; ...': both angles, dwell"),
            "dwell": Option(60.0, "s", "averaging time in each position"),
            "windows": Option(4, int, "averages a position", 1, 100),
            "rate": Option("30deg/s", "rad/s", "rate of the turns; 0: none", 0.0, 20.0),
            "sampling": Option(0.0, "Hz", "samples of a file without a column time: sampling rate", 0.0),
            "cycles": Option(1, int, "times that positions and turns are gone through", 1, 16),
            "turns": Option(5, int, "whole turns in each sense about each axis of the case; 0: none", 0, 100),
            "rate_axes": Option("xyz", str, "axes of the case about which it is turned"),
        }
        | {
            "thermal": Option(False, bool, "bias and scale factors that follow the temperature join the model"),
            "bias_order": Option(3, int, "order of the biases over the temperature", 0, 3),
            "scale_order": Option(2, int, "order of the scale factors over the temperature", 0, 2),
            "hysteresis_width": Option(10.0, "K", "temperature change that goes through the hysteresis", 1e-3),
            "reference": Option(0.0, "K", "temperature that the coefficients belong to, as the thermometer reads it"),
            "hot": Option(40.0, "K", "highest temperature of the chamber, above that of the coefficients"),
            "cold": Option(-40.0, "K", "lowest temperature of the chamber"),
        }
        | SETTLE
        | NUISANCES
        | CORRECTIONS
        | type_b(
            "square", "angle1", "angle2", "wobble", "latitude", "time",
            axis="standard uncertainty of the outer axis against level, and against east",
            mount="standard uncertainty of the case about each of its axes on the plate",
        )
        | type_b(sources.ZERO, sources.HYSTERESIS, "gravity", sources.GYRO_SCALE)
    )  # fmt: skip
    noises = tuple(f"imu.{a}_{n}" for a in "xyz" for n in ("gyro", "gyro_bias", "acc", "acc_bias"))
    assumed = ("table.base", "imu.mount")
    measured_data = MEASURED
    step = 1e-2
    windows = Windows(
        "sampler_gx.count",
        {
            "phase": "sampler_gx.window_phase",
            **{n: f"sampler_gx.{n}" for n in ("t_start", "t_end", "n")},
            **{f"outer_{e}": f"sampler_gx.angle_{e}" for e in ("start", "end")},
            **{f"inner_{e}": f"sampler_gy.angle_{e}" for e in ("start", "end")},
            **{f"{n}_{c.name}": f"sampler_{c.name}.{n}" for n in ("mean", "std") for c in CHANNELS},
        },
    )
    bodies = """
        outer ring: base table.base, x table.angle_x
        plate: outer ring, y table.angle_y
        instrument: plate, faces sequencer
    """
    channels = ("table.angle_x", "table.angle_y", *(f"imu.{c.output}[{c.axis + 1}]" for c in CHANNELS))

    @property
    def channel_period(self) -> float:  # type: ignore[override]
        """Every step where the turns between the positions are integrated."""
        return self.step if self["attitudes"] == UNKNOWN else 10.0

    def request(self, slot: str) -> None:
        """Add the slots asked for, and read what comes last: the compensator, accelerometers of their own, the unit."""
        there = slot in self.slots
        super().request(slot)
        if slot in self.on_request and not there:
            vars(self)["wires"] = instruments.wires(self.slots)
        if slot == instruments.CHAMBER and not there:
            for name, value in {"thermal": True, **plans.CYCLES}.items():
                if name not in self.given:
                    self.set(name, value)
        if slot == instruments.ACCELEROMETERS and not there:
            more = (*self.noises, *ACCELEROMETER_NOISES), (*self.assumed, "accelerometers.mount")
            vars(self).update(noises=more[0], assumed=more[1])

    def times(self) -> plans.Times:
        """Return dwells and turns.  Raises InvalidValueError."""
        axes = self["rate_axes"]
        if len(set(axes)) < len(axes) or set(axes) - set("xyz"):
            raise InvalidValueError(f"rate_axes = {axes}: letters of xyz are expected, each once")
        return plans.Times(self["settle"], self["dwell"], self["windows"], self["rate"], self["turns"], axes)

    def visits(self) -> list[Visit]:
        """Return the positions.  Raises InvalidValueError."""
        if given := parse_visits("visits", self["visits"], ("rad", "rad"), self["dwell"]):
            return given
        if self["positions"] not in geometry.POSITIONS:
            known = ", ".join(map(str, geometry.POSITIONS))
            raise InvalidValueError(f"positions = {self['positions']}: {known} are possible, or visits")
        return plans.positions(self["positions"], self["dwell"])

    def plan(self) -> Plan:
        """Return the positions, then the turns about x, y and z, each after a rest."""
        return plans.plan(self.visits(), self.times(), self["cycles"])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        moves = {"table.index_rate": [plans.INDEX_RATE] * 2, "table.acceleration": [plans.ACCELERATION] * 2}
        more: dict[str, Any] = {}
        if instruments.CHAMBER in self.slots:
            more = plans.chamber(self.plan(), self["cold"], self["hot"])
            more["imu.hysteresis_width?"] = self["hysteresis_width"]
        return {**super().parameters(parts), **moves, **more}

    def check(self) -> list[str]:
        if self["attitudes"] not in ("table", UNKNOWN):
            return [f"attitudes = {self['attitudes']}: a run has table or unknown; up_down is of files"]
        problems = norms.problems if self["attitudes"] == UNKNOWN else geometry.force_problems
        return super().check() + problems(self._directions())

    def _directions(self) -> np.ndarray[Any, Any]:
        """Return the directions of the case that point up in the phases at rest."""
        rest = [p for p in self.plan().phases if p.mode == "index"]
        x, y = (np.array([getattr(p, n) for p in rest]) for n in ("target", "target_y"))
        return np.column_stack([-np.cos(x) * np.sin(y), np.sin(x), np.cos(x) * np.cos(y)])

    def warnings(self) -> list[str]:
        if self["attitudes"] == UNKNOWN:
            return []
        axes = self["rate_axes"] if self.times().rates else ""
        return geometry.unseen_rates(tuple("xyz".index(a) for a in axes))
