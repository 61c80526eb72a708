"""Wiring, plan and parameters of the two-axis servo test: two single-axis servo tables, one on the other.

The outer table turns about X; on its plate stands the inner one with its axis along Y.  Table axes are (Y, Z, X) of the
outer and (Z, X, Y) of the inner table, so that v_gyro = A v_mount with A of SERVO2-A.  The slot stand is
between site and outer table: it turns what the site says into the axes of the mount, phase by phase.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.servo_channel import FREE
from gyrobench.system.families.servo_test import CAPTURE_RATE, INDEX_RATE, stand_parameters
from gyrobench.system.families.table_test import sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan

from .geometry import MOUNTS

FACE = "gyro x, y, z along X, Y, Z at 0, 0"
#: (Y, Z, X) in (X, Y, Z), (Z, X, Y) in (Y, Z, X) and (x, y, z) in (Z, X, Y): the same matrix three times
NEXT = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))

COUPLING = Socket(
    "AxisCoupling",
    "what the two axes of a servo table need of each other",
    (
        inp("u", "V", "pickoff voltage about gyro x"),
        inp("angle", "rad", "inner angle"),
        inp("ready_x", "1", "1 when the outer axis is in position", whole=True),
        inp("ready_y", "1", "1 when the inner axis is in position", whole=True),
        out("u_outer", "V", "voltage for the servo of the outer axis"),
        out("in_position", "1", "1 when both axes are in position", whole=True),
    ),
)
WOBBLE = Socket(
    "AxisWobble",
    "wobble of a table axis: what the table's base feels",
    (
        inp("angle", "rad", "table angle"),
        inp("f_base", "m/s2", "specific force along the axes of what carries the table", 3),
        inp("omega_base", "rad/s", "inertial rate along them", 3),
        out("f", "m/s2", "specific force along the axes that wobble", 3),
        out("omega", "rad/s", "inertial rate along them", 3),
    ),
)
# the torquer about y precesses the rotor about x: the cage of u_x feeds i_y
WIRES = f"""
    site -> stand: f=f_face omega=omega_face
    sequencer -> stand: phase=mount
    outer -> wobble_x: angle
    stand -> wobble_x: f=f_base omega=omega_base
    wobble_x -> outer: f=f_local omega=omega_local
    sequencer -> outer: mode target
    inner -> wobble_y: angle
    outer -> wobble_y: f=f_base omega=omega_base
    wobble_y -> inner: f=f_local omega=omega_local
    sequencer -> inner: mode target face
    inner -> gyro: omega f
    gyro -> coupling: u_x=u
    inner -> coupling: angle in_position=ready_y
    outer -> coupling: in_position=ready_x
    coupling -> outer: u_outer=u
    gyro -> inner: u_y=u
    gyro -> cage_x: u_x=u
    gyro -> cage_y: u_y=u
    sequencer -> cage_x: mode
    sequencer -> cage_y: mode
    cage_x -> gyro: i=i_y
    cage_y -> gyro: i=i_x
    outer.angle_read -> sequencer.angle
    coupling -> sequencer: in_position
    gyro -> sampler_x: u_x=x saturated=flag
    gyro -> sampler_y: u_y=x saturated=flag
    {sampled("sampler_x", "outer: angle_read")}
    {sampled("sampler_y", "inner: angle_read")}
"""
#: what turns the magnetic field into the axes of the gyro
FIELD = """
    stand -> surroundings: axes
    outer -> surroundings: angle
    inner -> surroundings: angle=angle_y
"""
COLUMNS = {
    "phase": "sampler_x.window_phase",
    **{c: f"sampler_x.{c}" for c in ("t_start", "t_end", "n", "flagged")},
    **{f"outer_{e}": f"sampler_x.angle_{e}" for e in ("start", "end")},
    **{f"inner_{e}": f"sampler_y.angle_{e}" for e in ("start", "end")},
    **{f"{c}_{a}": f"sampler_{a}.{c}" for a in "xy" for c in ("mean", "std")},
}


#: samplers of the compensating currents, which precess the rotor about x and about y
METERS = {"x": "torquing_x", "y": "torquing_y"}
LEVELLED = f"""
    sequencer -> cage_x: target=command
    sequencer -> cage_y: target_y=command
    outer -> cage_x: angle_read=angle
    inner -> cage_y: angle_read=angle
    cage_x -> torquing_x: i=x
    cage_y -> torquing_y: i=x
    {sampled("torquing_x", "outer: angle_read")}
    {sampled("torquing_y", "inner: angle_read")}
"""
LEVELLING = 0.1  # 1/s: a table that the torquers keep level comes to rest at the drift over it


def plan(
    mounts: Sequence[int], time: float, window: float, settle: float, currents: Mapping[int, tuple[float, float]]
) -> Plan:
    """Return each mount after a phase that brings both axes to 0 with the rotor caged.

    currents: compensating ones of a mount, A, about x and y; none where the torquers are idle.
    """
    phases = []
    for m in mounts:
        about_x, about_y = currents.get(m, (0.0, 0.0))
        phases.append(Phase(f"mount {m}: to the start", "index", FACE, settle=1.0, dwell=0.1, window=0.1))
        times = {"settle": settle, "dwell": time, "window": window}
        phases.append(Phase(f"mount {m}", "servo", FACE, about_x, target_y=about_y, **times))
    return Plan(phases, {FACE: NEXT})


def levelling(parts: PartValues) -> dict[str, Any]:
    """Return the gains that keep both axes at 0 by the torquers."""
    return {"cage_x.K_a": LEVELLING / float(parts["gyro.k_y"]), "cage_y.K_a": LEVELLING / float(parts["gyro.k_x"])}


def parameters(parts: PartValues, mounts: Sequence[int]) -> dict[str, Any]:
    """Return the parameters of the stand and of both tables."""
    table = {**FREE, "base": NEXT, "index_rate": INDEX_RATE, "capture_rate": CAPTURE_RATE}
    return {
        **stand_parameters(MOUNTS[m] for m in mounts for _ in range(2)),
        **{f"{slot}.{n}": value for slot in ("outer", "inner") for n, value in table.items()},
        "outer.K_g": parts["gyro.K_sg_x"],
        "inner.K_g": parts["gyro.K_sg_y"],
        "wobble_x.axis": 1,  # X of X, Y, Z
        "wobble_y.axis": 1,  # Y of Y, Z, X
    }
