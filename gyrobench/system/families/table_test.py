"""Tests of an instrument on a table, phase by phase: slots, wires, site, plan, windows and checks that they share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.system.connectors import SUPPLIES, Socket
from gyrobench.system.families.option_groups import GYRO_NOISES, SITE
from gyrobench.system.families.physical_form import physical_drift
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Plan
from gyrobench.system.system import OnRequest, Option, Slot, System, Windows

FACE = "input axis along the table axis"
#: gyro axes I, O, S (rows) in table axes: I = z_T, O = x_T, S = y_T
ON_TABLE = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))

SDF_NOISES = tuple(f"gyro.{name}" for name in GYRO_NOISES)


def on_table(**sockets: str | Socket | Slot) -> dict[str, Slot]:
    """Return the slots of a test on a table: site and sequencer, those given, sampler.

    sockets: a Slot with its part, or a socket, whose part with_parts() names.
    """
    given = {name: s if isinstance(s, Slot) else Slot(s) for name, s in sockets.items()}
    plain = {name: Slot(name.capitalize(), name) for name in ("site", "sequencer", "sampler")}
    return {"site": plain["site"], "sequencer": plain["sequencer"], **given, "sampler": plain["sampler"]}


def sampled(slot: str = "sampler", angle: str = "table: angle_read") -> str:
    """Return the wires of a sampler: its windows from the plan, and the angle ("slot: output") at their ends."""
    source, _, output = angle.partition(": ")
    return f"""
    {source} -> {slot}: {output}=angle
    sequencer -> {slot}: gate window phase
    """


#: the table at its site, moved by the plan
TABLE = """
    site -> table: f=f_local omega=omega_local
    sequencer -> table: mode target face
    table -> sequencer: angle_read=angle in_position
"""


#: what turns the magnetic field into the axes of the instrument: a table with one axis, on a stand, with two axes
ONE_AXIS = """
    table -> surroundings: angle
    sequencer -> surroundings: face
"""
ON_STAND = ONE_AXIS + "stand -> surroundings: axes"
TWO_AXES = """
    table -> surroundings: angle_x=angle angle_y
    sequencer -> surroundings: face
"""


def surroundings(angle: str = "table: angle_read", turned: str = ONE_AXIS) -> dict[str, OnRequest]:
    """Return the slot with the temperature and the magnetic field at the gyro, and a thermometer in the windows.

    angle: "slot: output", as of :func:`sampled`.  turned: wires of the attitude of the gyro.
    """
    wires = f"""
    surroundings -> gyro: temperature dT B dB
    surroundings -> thermometer: temperature=x
    {sampled("thermometer", angle)}
    {turned}
    """
    slots = {"surroundings": Slot("Surroundings", "surroundings"), "thermometer": Slot("Sampler", "sampler")}
    columns = {"temperature": "thermometer.mean"}
    return {"surroundings": OnRequest(slots, wires, columns, ("surroundings.temperature",))}


def supply() -> dict[str, OnRequest]:
    """Return the slot with the electrical supplies of the gyro."""
    names = " ".join(c.name for c in SUPPLIES)
    slots = {"supply": Slot("Supply", "supply")}
    return {"supply": OnRequest(slots, f"supply -> gyro: {names}", channels=("supply.wheel_frequency",))}


class TableTest(System):
    """The sequencer moves the table through the plan; the sampler averages a reading over windows of each phase.

    A test gives the slots, with the parts it is made with, the wires of its instrument, plan(), base() where the table
    does not stand level, and the reduction.
    """

    slots: ClassVar[Mapping[str, Slot]] = on_table(table="Table")
    wires = TABLE + sampled()
    options: ClassVar[dict[str, Option]] = SITE
    assumed: ClassVar[tuple[str, ...]] = ("table.base", "gyro.mount")
    windows = Windows.of("sampler")
    done = "sequencer.done"
    channel_period = 10.0
    bodies = """
        table: base table.base, x table.tilt[1], y table.tilt[2], z table.angle or windows
        instrument: table, faces sequencer
    """

    def base(self) -> Array:
        """Return the table axes (rows) in east, north, up at angle 0."""
        return np.eye(3)

    def planned_faces(self, parameters: Mapping[str, Any]) -> dict[str, ArrayLike]:
        """Return the mounts of the plan (gyro axes in table axes) as the sequencer has them, by name."""
        plan = self.plan()
        planned = plan.faces if isinstance(plan, Plan) else {}
        given = zip(planned, parameters.get("sequencer.faces", []), strict=False)
        return {**planned} | {name: np.reshape(face, (3, 3)) for name, face in given}

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {
            **self.plan().parameters(),
            **self.owned(),
            **physical_drift(self, parts),
            "table.base": self.base(),
            **(self.field_axes() if "surroundings" in self.slots else {}),
        }

    def check(self) -> list[str]:
        return frames.gravity_problems(self["gravity"]) if self["gravity"] else []

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        """Mounts of the plan and of the parts that are no rotations."""
        matrices: dict[str, ArrayLike] = {
            f"sequencer.faces, {n}": face for n, face in self.planned_faces(parameters).items()
        }
        matrices |= {n: m for n, m in parameters.items() if n.endswith((".mount", ".base")) and np.shape(m) == (3, 3)}
        return frames.rotation_problems(matrices)

    def field_axes(self) -> dict[str, Any]:
        """Return the parameters of the surroundings that say how the table stands."""
        return {"surroundings.base": self.base()}


class OpenLoopTest(TableTest):
    """A floated gyro on a table without a loop: its pickoff is read."""

    slots: ClassVar[Mapping[str, Slot]] = on_table(table="Table", gyro="SdfGyro")
    wires = (
        TableTest.wires
        + """
    table -> gyro: omega alpha f
    gyro -> sampler: u=x saturated=flag
    """
    )
    on_request: ClassVar[Mapping[str, OnRequest]] = surroundings() | supply()
    open: ClassVar[tuple[str, ...]] = ("gyro.i",)
    noises: ClassVar[tuple[str, ...]] = SDF_NOISES
