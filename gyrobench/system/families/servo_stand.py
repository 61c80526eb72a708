"""What the servo tests share: a table that its own gyro holds still, on a stand that gives its axis any direction.

    class ServoPolar(System):
        slots, wires = {"stand": Slot(servo.STAND, ...), "table": Slot(servo.SERVO_TABLE, ...), ...}, servo.WIRES
        def plan(self): return servo.plan([servo.Hold("polar S", dwell=86400.0, window=600.0, settle=2.0, travel=TURN)])
        def parameters(self): return servo.parameters(self)

The input axis x of the gyro lies along the table axis, y and z on the face.  The slot stand is between site
and table: it turns what the site says into the axes x, y, z of the attitude at angle 0, phase by phase (its mount
number is the number of the phase).  In servo mode the torquer is idle; in all others the slot cage holds the float by
it.  [LOOP-TABLE-SERVO, MEAS-SERVO]
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames
from gyrobench.record.csv_reader import WINDOW_COLUMNS
from gyrobench.record.record import Record
from gyrobench.system.lab_record import read_record
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.sockets import Connector, Socket
from gyrobench.system.system import System

Array = NDArray[np.float64]
FACE = "input axis along the table axis"
#: gyro axes I, O, S (rows) in table axes: I = z_T, O = x_T, S = y_T
ON_TABLE = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
#: table axes (rows) in the axes x, y, z of the attitude at angle 0: the transpose of it
BASE = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))

E, N, U, P, Q = 1, 2, 3, 4, 5  # directions of the part fixture: east, north, up, pole, E x P
_LEVEL = {
    f"x {name}, {axis} {way}": (x, y if way == up else -y)
    for name, x, horizontal in (("east", E, -N), ("north", N, E), ("west", -E, N), ("south", -N, -E))
    for axis, y, up in (("y", U, "up"), ("z", horizontal, "down"))
    for way in ("up", "down")
}
#: attitude -> directions of x and y at angle 0; z = x cross y.  Class 1, 2, 3 of Hu 1981.
ATTITUDES: dict[str, tuple[int, int]] = {
    "x down": (-U, E), "x up": (U, E), **_LEVEL, "polar S": (-P, -E), "polar N": (P, -E),
}  # fmt: skip
VERTICAL = ("x down", "x up")
LEVEL = tuple(_LEVEL)
POLAR = ("polar S", "polar N")


def _in(name: str, unit: str, meaning: str, *shape: int, optional: bool = False) -> Connector:
    return Connector(name, "input", unit, meaning, shape, optional, name in ("mode", "mount"))


def _out(name: str, unit: str, meaning: str, *shape: int, optional: bool = False) -> Connector:
    whole = name in ("in_position", "saturated")
    return Connector(name, "output", unit, meaning, shape, optional, whole)


SERVO_TABLE = Socket(
    "ServoTable",
    "turntable with one axis that nulls the pickoff of the gyro on it",
    (
        _in("f_local", "m/s2", "specific force along the axes of the attitude at angle 0", 3),
        _in("omega_local", "rad/s", "Earth rate along them", 3),
        _in("mode", "1", "0 hold, 1 index, 2 rate, 3 servo"),
        _in("target", "", "angle (rad) or rate (rad/s), by mode"),
        _in("face", "1", "rows: the gyro axes I, O, S in table axes", 3, 3),
        _in("u", "V", "pickoff voltage of the gyro"),
        _out("angle", "rad", "table angle, cumulative"),
        _out("rate", "rad/s", "table rate relative to its base", optional=True),
        _out("angle_read", "rad", "table angle as the encoder reads it, cumulative"),
        _out("omega", "rad/s", "inertial rate in face axes", 3),
        _out("alpha", "rad/s2", "angular acceleration in face axes", 3, optional=True),
        _out("f", "m/s2", "specific force in face axes", 3),
        _out("in_position", "1", "1 when the target is reached, or the loop closed"),
        _out("saturated", "1", "1 while the motor is at its limit", optional=True),
    ),
)
STAND = Socket(
    "Stand",
    "turns what the site says into the axes of the attitude of a phase",
    (
        _in("mount", "1", "number of the phase"),
        _in("f_face", "m/s2", "specific force, ENU", 3),
        _in("omega_face", "rad/s", "Earth rate, ENU", 3),
        _out("f", "m/s2", "specific force, attitude axes", 3),
        _out("omega", "rad/s", "Earth rate, attitude axes", 3),
    ),
)
CAGE = Socket(
    "Cage",
    "holds the float by the torquer outside servo mode",
    (_in("u", "V", "pickoff voltage"), _in("mode", "1", "mode of the table"), _out("i", "A", "torquer current")),
)
WIRES = """
    site.f -> stand.f_face
    site.omega -> stand.omega_face
    sequencer.phase -> stand.mount
    stand.f -> table.f_local
    stand.omega -> table.omega_local
    sequencer.mode -> table.mode
    sequencer.target -> table.target
    sequencer.face -> table.face
    table.omega -> gyro.omega
    table.alpha -> gyro.alpha
    table.f -> gyro.f
    gyro.u -> table.u
    gyro.u -> cage.u
    sequencer.mode -> cage.mode
    cage.i -> gyro.i
    table.angle_read -> sequencer.angle
    table.in_position -> sequencer.in_position
    gyro.u -> sampler.x
    table.angle_read -> sampler.angle
    sequencer.gate -> sampler.gate
    sequencer.window -> sampler.window
    sequencer.phase -> sampler.phase
    gyro.saturated -> sampler.flag
"""
NOISES = ("gyro.turn_on", "gyro.markov", "gyro.white", "gyro.pickoff", "table.rumble")
INDEX_RATE = 5e-3  # rad/s: the cage holds the float up to 8.3e-3
#: rad/s (8 Hz): brushes hold a turning table M / (J capture_rate2) from null, and must let it within capture_angle
CAPTURE_RATE = 50.0
SHARED = {"H": "H_g", "J": "J_g", "C": "C_g", "K_sg": "K_g"}  # of the gyro -> what the table is told of it


@dataclass(frozen=True)
class Hold:
    """A phase in which the gyro holds the table: attitude, start angle (rad), s of settling, dwell and windows, rad
    that must be turned at least.
    """

    attitude: str
    dwell: float
    window: float
    settle: float
    start: float = 0.0
    travel: float = 0.0


def plan(holds: Sequence[Hold]) -> Plan:
    """Each hold after a phase that brings the table to its start angle with the float caged."""
    phases = []
    for h in holds:
        to = {"label": f"{h.attitude}: to the start", "mode": "index", "target": h.start, "settle": 1.0}
        phases.append(Phase(face=FACE, dwell=0.1, window=0.1, **to))  # type: ignore[arg-type]
        phases.append(
            Phase(h.attitude, "servo", FACE, settle=h.settle, dwell=h.dwell, travel=h.travel, window=h.window)
        )
    return Plan(phases, {FACE: ON_TABLE})


def parameters(system: System) -> dict[str, Any]:
    """Of all parts, from the plan, the site options and the parameters of the gyro that the user set."""
    rows = system.plan()
    names = [p.label.partition(":")[0] for p in rows.phases]
    mounts = {f"stand.mounts[{k},{j + 1}]": float(ATTITUDES[n][j]) for k, n in enumerate(names, 1) for j in (0, 1)}
    told = {f"gyro.{a}": f"table.{b}" for a, b in SHARED.items()}
    return {
        **rows.parameters(),
        **{n: int(v) for n, v in mounts.items()},
        "site.latitude": system["latitude"],
        "site.height": system["height"],
        "site.gravity": system["gravity"],
        "stand.latitude": system["latitude"],
        "stand.base": np.eye(3),
        "table.base": BASE,
        "table.index_rate": INDEX_RATE,
        "table.capture_rate": CAPTURE_RATE,
        **{told[n]: v for n, v in system.overrides.items() if n in told},
    }


def attitude(name: str, latitude: float) -> Array:
    """Rows x, y, z in (E, N, U) with the table at angle 0.  KeyError for an unknown name."""
    p = frames.pole(latitude)
    directions = {E: frames.E, N: frames.N, U: frames.U, P: p, Q: np.cross(frames.E, p)}
    x, y = (np.sign(k) * directions[abs(k)] for k in ATTITUDES[name])
    return np.array([x, y, np.cross(x, y)])


def problems(parameters: Mapping[str, Any], plan: Plan) -> list[str]:
    """What is wrong with the parameters of the parts (slot.name: SI), as sentences."""
    found = []
    for name in ("gyro.mount", "table.base", "stand.base"):
        if name in parameters:
            try:
                frames.check_rotation(parameters[name], name)
            except ValueError as error:
                found.append(str(error))
    if len(plan.phases) > 49:
        found.append(f"the plan has {len(plan.phases)} phases, two for each attitude: the stand knows 49")
    rate, limit = parameters.get("table.index_rate"), parameters.get("cage.i_max")
    if rate is not None and limit is not None and "gyro.k" in parameters and rate > 0.9 * limit * parameters["gyro.k"]:
        found.append(
            f"table.index_rate = {rate:g} rad/s: the cage holds the float up to cage.i_max gyro.k = "
            f"{limit * parameters['gyro.k']:.3g} rad/s; index more slowly"
        )
    return found


def read(system: System, data: Path, values: Mapping[str, str], known: Sequence[str]) -> Record:
    """A laboratory's CSV (phase, t_start, t_end, angle_start, angle_end; mean, std, n, flagged) with the attitudes
    ``known``.  Raises DataError, and InvalidValueError for an option that does not fit.
    """
    columns = tuple(
        replace(c, unit="V", meaning="pickoff voltage", required=False) if c.name in ("mean", "std") else c
        for c in WINDOW_COLUMNS
    )
    names = dict.fromkeys(known, "servo")
    return read_record(system, data, values, needed={"latitude": "45.75deg"}, attitudes=lambda: names, columns=columns)
