"""Wiring, plan and parameters of the two-axis servo test: two single-axis servo tables, one on the other.

The outer table turns about X; on its plate stands the inner one with its axis along Y.  Table axes are (Y, Z, X) of the
outer and (Z, X, Y) of the inner table, so that v_gyro = A v_mount with A of SERVO2-A.  The slot stand is
between site and outer table: it turns what the site says into the axes of the mount, phase by phase.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gyrobench.system.families import servo_stand
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.sockets import Connector, Socket

from .geometry import MOUNTS

if TYPE_CHECKING:
    from gyrobench.system.system import System

FACE = "gyro x, y, z along X, Y, Z at 0, 0"
#: (Y, Z, X) in (X, Y, Z), (Z, X, Y) in (Y, Z, X) and (x, y, z) in (Z, X, Y): the same matrix three times
NEXT = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
#: what a servo table is told of a free rotor, which neither lags nor pulls at the table: H/C = 1, hardly any inertia
FREE = {"H_g": 1e-6, "C_g": 1e-6, "J_g": 1e-12, "network": 1}

COUPLING = Socket(
    "AxisCoupling",
    "what the two axes of a servo table need of each other",
    (
        Connector("u", "input", "V", "pickoff voltage about gyro x"),
        Connector("angle", "input", "rad", "inner angle"),
        Connector("ready_x", "input", "1", "1 when the outer axis is in position", whole=True),
        Connector("ready_y", "input", "1", "1 when the inner axis is in position", whole=True),
        Connector("u_outer", "output", "V", "voltage for the servo of the outer axis"),
        Connector("in_position", "output", "1", "1 when both axes are in position", whole=True),
    ),
)
WOBBLE = Socket(
    "AxisWobble",
    "wobble of a table axis: what the table's base feels",
    (
        Connector("angle", "input", "rad", "table angle"),
        Connector("f_base", "input", "m/s2", "specific force along the axes of what carries the table", (3,)),
        Connector("omega_base", "input", "rad/s", "inertial rate along them", (3,)),
        Connector("f", "output", "m/s2", "specific force along the axes that wobble", (3,)),
        Connector("omega", "output", "rad/s", "inertial rate along them", (3,)),
    ),
)
# the torquer about y precesses the rotor about x: the cage of u_x feeds i_y
WIRES = """
    site.f -> stand.f_face
    site.omega -> stand.omega_face
    sequencer.phase -> stand.mount
    outer.angle -> wobble_x.angle
    stand.f -> wobble_x.f_base
    stand.omega -> wobble_x.omega_base
    wobble_x.f -> outer.f_local
    wobble_x.omega -> outer.omega_local
    sequencer.mode -> outer.mode
    sequencer.target -> outer.target
    inner.angle -> wobble_y.angle
    outer.f -> wobble_y.f_base
    outer.omega -> wobble_y.omega_base
    wobble_y.f -> inner.f_local
    wobble_y.omega -> inner.omega_local
    sequencer.mode -> inner.mode
    sequencer.target -> inner.target
    sequencer.face -> inner.face
    inner.omega -> gyro.omega
    inner.f -> gyro.f
    gyro.u_x -> coupling.u
    inner.angle -> coupling.angle
    outer.in_position -> coupling.ready_x
    inner.in_position -> coupling.ready_y
    coupling.u_outer -> outer.u
    gyro.u_y -> inner.u
    gyro.u_x -> cage_x.u
    gyro.u_y -> cage_y.u
    sequencer.mode -> cage_x.mode
    sequencer.mode -> cage_y.mode
    cage_x.i -> gyro.i_y
    cage_y.i -> gyro.i_x
    outer.angle_read -> sequencer.angle
    coupling.in_position -> sequencer.in_position
    gyro.u_x -> sampler_x.x
    outer.angle_read -> sampler_x.angle
    sequencer.gate -> sampler_x.gate
    sequencer.window -> sampler_x.window
    sequencer.phase -> sampler_x.phase
    gyro.saturated -> sampler_x.flag
    gyro.u_y -> sampler_y.x
    inner.angle_read -> sampler_y.angle
    sequencer.gate -> sampler_y.gate
    sequencer.window -> sampler_y.window
    sequencer.phase -> sampler_y.phase
    gyro.saturated -> sampler_y.flag
"""
COLUMNS = {
    "phase": "sampler_x.window_phase",
    **{c: f"sampler_x.{c}" for c in ("t_start", "t_end", "n", "flagged")},
    **{f"outer_{e}": f"sampler_x.angle_{e}" for e in ("start", "end")},
    **{f"inner_{e}": f"sampler_y.angle_{e}" for e in ("start", "end")},
    **{f"{c}_{a}": f"sampler_{a}.{c}" for a in "xy" for c in ("mean", "std")},
}
NOISES = (
    "gyro.turn_on_x", "gyro.turn_on_y", "gyro.markov_x", "gyro.markov_y", "gyro.white_x", "gyro.white_y",
    "gyro.pickoff_x", "gyro.pickoff_y", "outer.rumble", "inner.rumble",
)  # fmt: skip


def plan(mounts: Sequence[int], time: float, window: float, settle: float) -> Plan:
    """Each mount after a phase that brings both axes to 0 with the rotor caged."""
    phases = []
    for m in mounts:
        phases.append(Phase(f"mount {m}: to the start", "index", FACE, settle=1.0, dwell=0.1, window=0.1))
        phases.append(Phase(f"mount {m}", "servo", FACE, settle=settle, dwell=time, window=window))
    return Plan(phases, {FACE: NEXT})


def parameters(system: System, mounts: Sequence[int]) -> dict[str, Any]:
    """Of all parts, from the plan and the site options."""
    rows = plan(mounts, system["time"], system["window"], system["settle"])
    placed = {
        f"stand.mounts[{2 * k + i},{j + 1}]": MOUNTS[m][j] for k, m in enumerate(mounts) for i in (1, 2) for j in (0, 1)
    }
    table = {**FREE, "base": NEXT, "index_rate": servo_stand.INDEX_RATE, "capture_rate": servo_stand.CAPTURE_RATE}
    gains = {
        f"{slot}.K_g": system.overrides[name]
        for slot, name in (("outer", "gyro.K_sg_x"), ("inner", "gyro.K_sg_y"))
        if name in system.overrides
    }
    return {
        **rows.parameters(),
        **placed,
        "site.latitude": system["latitude"],
        "site.height": system["height"],
        "site.gravity": system["gravity"],
        "stand.latitude": system["latitude"],
        "stand.base": np.eye(3),
        **{f"{slot}.{n}": value for slot in ("outer", "inner") for n, value in table.items()},
        **gains,
        "wobble_x.axis": 1,  # X of X, Y, Z
        "wobble_y.axis": 1,  # Y of Y, Z, X
    }
