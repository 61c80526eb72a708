"""Servo tests: a table that its own gyro holds still, on a stand that gives its axis any direction.

The input axis x of the gyro lies along the table axis, y and z on the face.  The slot stand is between site
and table: it turns what the site says into the axes x, y, z of the attitude at angle 0, phase by phase (its mount
number is the number of the phase).  In servo mode the torquer is idle; in all others the slot cage holds the float by
it.  [LOOP-TABLE-SERVO, MEAS-SERVO]
"""

from __future__ import annotations

import contextlib
import math
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from gyrobench import frames
from gyrobench.attitudes import SERVO_ATTITUDES
from gyrobench.record.csv_reader import WINDOW_COLUMNS, CsvColumn
from gyrobench.system.configurable import Option
from gyrobench.system.families.option_groups import SITE, SUPPLY, type_b
from gyrobench.system.families.physical_form import PHYSICAL_FORM
from gyrobench.system.families.servo_channel import CHANNEL, ChannelTest, gyro_on_table, own_name
from gyrobench.system.families.servo_expectation import Expected, capture_problems
from gyrobench.system.families.table_test import (
    FACE,
    ON_STAND,
    SDF_NOISES,
    TableTest,
    on_table,
    sampled,
    supply,
    surroundings,
)
from gyrobench.system.lab_record import laboratory_rows
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import MeasuredData, OnRequest, Slot

#: table axes (rows) in the axes x, y, z of the attitude at angle 0: the transpose of ON_TABLE
BASE = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
#: the gyro on the table whose servo nulls its pickoff
GYRO_SERVO = """
    table -> gyro: omega alpha f
    gyro -> table: u
"""
INDEX_RATE = 5e-3  # rad/s: the cage holds the float up to 8.3e-3
#: rad/s (8 Hz): brushes hold a turning table M / (J capture_rate2) from null, and must let it within capture_angle
CAPTURE_RATE = 50.0
SITE_AND_STAND = SITE | {"latitude": replace(SITE["latitude"], sets="site.latitude stand.latitude")}
TRACKING = {"tracking": Option("2arcsec", "rad", "largest angle of the table against the gyro; 0: not judged", 0.0)}


@dataclass(frozen=True)
class Hold:
    """A phase in which the gyro holds the table: attitude, start angle (rad), s of settling, dwell and windows, rad
    that must be turned at least, s that this may take; current of the torquer, A.
    """

    attitude: str
    dwell: float
    window: float
    settle: float
    start: float = 0.0
    travel: float = 0.0
    longest: float = math.inf
    current: float = 0.0


def stand_parameters(directions: Iterable[tuple[int, int]]) -> dict[str, Any]:
    """Return the mounts of the stand, one for each phase of the plan: numbered directions of x and y."""
    places = {f"stand.mounts[{k},{j + 1}]": xy[j] for k, xy in enumerate(directions, 1) for j in (0, 1)}
    return {**places, "stand.base": np.eye(3)}


class ServoTest(ChannelTest, TableTest):
    """A floated gyro, or one axis of a gyro with two, holds the table it stands on; the table angle is read.  A test
    gives holds().

    slots = ServoTest.with_parts(stand=..., table=..., gyro=..., cage=...)
    """

    slots: ClassVar[Mapping[str, Slot]] = on_table(stand="Stand", table="ServoTable", gyro="SdfGyro", cage="Cage")
    wires = f"""
    site -> stand: f=f_face omega=omega_face
    sequencer -> stand: phase=mount
    stand -> table: f=f_local omega=omega_local
    sequencer -> table: mode target face
    {GYRO_SERVO}
    gyro -> cage: u
    sequencer -> cage: mode
    cage -> gyro: i
    table -> sequencer: angle_read=angle in_position
    gyro -> sampler: u=x saturated=flag
    {sampled()}
    """
    on_request: ClassVar[Mapping[str, OnRequest]] = surroundings(turned=ON_STAND) | supply()
    bodies = """
        stand: mounts stand
        table: stand, base table.base, x table.tilt[1], y table.tilt[2], z table.angle
        instrument: table, faces sequencer
    """
    options: ClassVar[dict[str, Option]] = (
        SITE_AND_STAND
        | PHYSICAL_FORM
        | CHANNEL
        | {"settle": Option(10.0, "s", "wait after the loop has closed", 0.5)}
        | TRACKING
        | type_b(
            "unbalance", "remount", "time", "wobble", "angle1", "angle2",
            axis="standard uncertainty of the table axis, about each axis, each phase",
            mount="standard uncertainty of the input axis against the table axis",
        )
        | SUPPLY
    )  # fmt: skip
    shorter: ClassVar[str] = "ask for less travel"  # what to do where a travel takes too long
    assumed: ClassVar[tuple[str, ...]] = (*TableTest.assumed, "stand.base", "stand.mounts")
    noises: ClassVar[tuple[str, ...]] = (*SDF_NOISES, "table.rumble")
    channels: ClassVar[tuple[str, ...]] = ("table.angle", "gyro.u", "gyro.drift")

    def __init__(self) -> None:
        super().__init__()
        self.gyro_drift: dict[str, float] = {}  # of the gyro in the slot, which parameters() has seen
        self.earth_rate = frames.EARTH_RATE  # of the site, likewise

    def expected(self) -> Expected:
        """Return what the table is expected to turn with: the Earth, and the drift of the gyro once it is known."""
        g = self["gravity"] or frames.G0
        if not self["gravity"]:
            with contextlib.suppress(ValueError):  # of values that check() has still to refuse
                g = frames.normal_gravity(self["latitude"], self["height"])
        return Expected(self["latitude"], self.earth_rate, g / frames.G0, self.gyro_drift)

    @abstractmethod
    def holds(self) -> Sequence[Hold]:
        """Return the phases in which the gyro holds the table, in their order."""

    def plan(self) -> Plan:
        """Each hold after a phase that brings the table to its start angle with the float caged."""
        phases, expected = [], self.expected()
        for h in self.holds():
            known = h.attitude in SERVO_ATTITUDES  # check() says where not
            travel = expected.travel_time(h.attitude, h.start, h.travel) if known else 0.0
            to = {"label": f"{h.attitude}: to the start", "mode": "index", "target": h.start, "settle": 1.0}
            phases.append(Phase(face=FACE, dwell=0.1, window=0.1, **to))  # type: ignore[arg-type]
            times = {"settle": h.settle, "dwell": h.dwell, "expected": travel if math.isfinite(travel) else 0.0}
            phases.append(Phase(h.attitude, "servo", FACE, h.current, travel=h.travel, window=h.window, **times))
        return Plan(phases, {FACE: self.face})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        self.gyro_drift = self.gyro_drift_of(parts)
        self.earth_rate = float(parts["site.earth_rate"]) if "site.earth_rate" in parts else frames.EARTH_RATE
        names = (p.label.partition(":")[0] for p in self.plan().phases)
        return {
            **super().parameters(parts),
            **stand_parameters(SERVO_ATTITUDES[n] for n in names),
            "table.base": BASE,
            "table.index_rate": INDEX_RATE,
            "table.capture_rate?": CAPTURE_RATE,
            **gyro_on_table(parts, self.channel),
        }

    def field_axes(self) -> dict[str, Any]:
        return {"surroundings.base": BASE}

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        if (count := len(self.plan().phases)) > 49:
            problems.append(f"the plan has {count} phases, two for each attitude: the stand knows 49")
        rate, limit = parameters.get("table.index_rate"), parameters.get("cage.i_max")
        k = f"gyro.{own_name(self.channel, 'k')}"
        if rate is not None and limit is not None and rate > 0.9 * limit * parameters.get(k, np.inf):
            problems.append(
                f"table.index_rate = {rate:g} rad/s: the cage holds the float up to cage.i_max {k} = "
                f"{limit * parameters[k]:.3g} rad/s; index more slowly"
            )
        return problems or self._hold_problems(parameters)

    def _hold_problems(self, parameters: Mapping[str, Any]) -> list[str]:
        """Return what drift and Earth rate make of the holds: no capture, a turn that never ends or takes too long."""
        expected, rates, problems = self.expected(), {}, []
        for h in self.holds():
            omega_d, earth = expected.rates(h.attitude, h.start)
            rates[h.attitude] = float(omega_d[0]), float(earth[0])
            time = expected.travel_time(h.attitude, h.start, h.travel)
            if math.isinf(time):
                at = math.degrees(expected.rest_angle(h.attitude, h.start, h.travel) - h.start)
                problems.append(
                    f"{h.attitude}: never turns by {math.degrees(h.travel):.4g}°: after {at:.3g}° the drift of this "
                    f"gyro is equal to the Earth rate and the table stays; {self.shorter}"
                )
            elif time > h.longest:
                problems.append(
                    f"{h.attitude}: to turn by {math.degrees(h.travel):.4g}° takes {time:,.0f} s with the drift and "
                    f"Earth rate expected, not {h.dwell:,.0f} s, and the whole plan {self.plan().duration():,.0f} s; "
                    f"{self.shorter}"
                )
        return list(dict.fromkeys(problems)) or capture_problems(parameters, rates)


def laboratory_data(template: str, known: Sequence[str], *more: CsvColumn) -> MeasuredData:
    """Return the template and reader of a laboratory's table angles, held in the attitudes ``known``; more: columns."""
    columns = tuple(
        replace(c, unit="V", meaning="pickoff voltage", required=False) if c.name in ("mean", "std") else c
        for c in WINDOW_COLUMNS
    )
    columns = (*columns, *more)
    names = dict.fromkeys(known, "servo")
    needed = {"latitude": "45.75deg"}
    return laboratory_rows(template, needed=needed, attitudes=lambda _: names, columns=columns)
