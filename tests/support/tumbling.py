"""The tumble system on shortened plans: values, random gyros, and the error of the coupling by hand."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from gyrobench import drift, frames
from gyrobench.system.part_values import PartValues
from gyrobench.system.sockets import Connector, Socket
from gyrobench.system.system import Slot, System, load_system

NAME = "tumble_single_axis"
DPH = math.pi / 180.0 / 3600.0  # 1 deg/h in rad/s
NAMES = drift.terms(9)
RATE = 0.02  # rad/s, 274 times Earth rate: a turn takes 314 s instead of 8616 s

#: A whole tumble in 683 s: both mounts, both dwells.  Settling takes 3 s: the slowest pole of the loop, -11.25 1/s,
#: leaves exp(-34) = 2e-15 of what the start of the table leaves in the loop.
SHORT: dict[str, Any] = {"rate": RATE, "windows": 36, "dwell": 20.0, "settle": 3.0}

#: Ranges of the coefficients in Hu 1981 (ch. 2), deg/h per g^n; signs are drawn.
RANGES = {"D_F": (0.05, 0.55), "D_I": (0.5, 1.3), "D_O": (0.5, 1.3), "D_S": (0.5, 1.3), "D_IS": (0.1, 0.2)}
SQUARES = (0.01, 0.06)


#: An intermittent one in some 350 s: 48 stops and two dwells, windows of 1 s.  Of a move exp(-11.25 3) is left.
STOPPING: dict[str, Any] = {
    "stops": 24, "stop_dwell": 2.0, "windows": 48, "dwell": 20.0, "settle": 3.0,
    "table.index_rate": 1.0, "table.acceleration": 1.0,
}  # fmt: skip


def load() -> System:
    return load_system(NAME)


def quiet(system: System) -> dict[str, Any]:
    """All noise off."""
    return {name: 0.0 for name in system.noises}


def gyro(rng: np.random.Generator) -> dict[str, Any]:
    """Nine true coefficients in the range of Hu 1981, both signs: values for the system, SI."""
    sizes = {n: rng.uniform(*RANGES.get(n, SQUARES)) for n in NAMES}
    return {f"gyro.{n}": float(size * rng.choice([-1.0, 1.0]) * DPH) for n, size in sizes.items()}


def latitude(rng: np.random.Generator) -> float:
    """rad, 12 to 78 degrees north or south."""
    return float(math.radians(rng.uniform(12.0, 78.0)) * rng.choice([-1.0, 1.0]))


def lag(values: dict[str, Any], rate: float = RATE) -> dict[str, float]:
    """Error of each coefficient (deg/h) that the rebalance loop leaves at the table rate ``rate``, by hand.

    Float and PI controller with K_sg H k K_p = 20, K_sg H k K_i = 200 (LOOP-REBALANCE), J = 2e-4, C = 0.2:

        k i / w = (20 s + 200) / (J s3 + C s2 + 20 s + 200) = 1 - (J s3 + C s2) / (...) = 1 - C s2/200 + O(s3)

    At s = j n rate a harmonic n of the drift is read too large by e_n = (C/200) (n rate)2 = 1e-3 n2 rate2; constants
    are read exactly (the loop integrates twice).  The phase error is O(rate3).  In the formulas of TUM1-REDUCE the
    coefficients D_I, D_S, D_IO, D_OS come from first harmonics, D_IS from the second; D_II and D_SS are half the sum
    of the constants (exact) minus or plus the cosine of 2 theta, which is (D_SS - D_II)/2.  So

        error of D_I = e_1 D_I ...,  of D_IS = e_2 D_IS,  of D_II = e_2 (D_II - D_SS)/2 = - error of D_SS

    and D_F, D_O (dwells) have none.  At 10 Earth rates e_1 = 5e-10; at RATE it is 4e-7, below 1e-6 deg/h for
    coefficients up to 1.3 deg/h/g.  Exchanging u and i once a step of 1 ms moves the poles, not this law.
    """
    one, two = 1e-3 * rate**2, 4e-3 * rate**2
    true = {n: values[f"gyro.{n}"] / DPH for n in NAMES}
    half = two * (true["D_II"] - true["D_SS"]) / 2.0
    scaled = {n: one * true[n] for n in ("D_I", "D_S", "D_IO", "D_OS")}
    return {"D_F": 0.0, "D_O": 0.0, "D_II": half, "D_SS": -half, "D_IS": two * true["D_IS"], **scaled}


def errors(result: Any, values: dict[str, Any]) -> dict[str, float]:
    """Estimate minus truth, deg/h per g^n."""
    return {c.name: c.estimate - values[f"gyro.{c.name}"] / DPH for c in result.coefficients}


def drift_in(face: str, values: dict[str, Any], latitude: float, gravity: float, angle: float = 0.0) -> float:
    """Drift rate (rad/s) of the static model at a table angle."""
    local = -frames.U * gravity / frames.G0
    xyz = frames.to_face(local, frames.tumble_faces(latitude)[face], frames.polar_base(latitude), angle)
    row = drift.regressors(xyz, NAMES)
    return float(sum(r * values[f"gyro.{n}"] for r, n in zip(row, NAMES, strict=True)))


_STAND = Socket(
    "PolarStand",
    "the polar axes of the table",
    (
        Connector("f_face", "input", "m/s2", "specific force, ENU", (3,)),
        Connector("omega_face", "input", "rad/s", "Earth rate, ENU", (3,)),
        Connector("f", "output", "m/s2", "specific force, polar axes", (3,)),
        Connector("omega", "output", "rad/s", "Earth rate, polar axes", (3,)),
    ),
)
WOBBLE = Socket(
    "Wobble",
    "wobble of the table axis",
    (
        Connector("angle", "input", "rad", "table angle"),
        Connector("f_base", "input", "m/s2", "specific force", (3,)),
        Connector("omega_base", "input", "rad/s", "inertial rate", (3,)),
        Connector("f", "output", "m/s2", "specific force, wobbling axes", (3,)),
        Connector("omega", "output", "rad/s", "inertial rate, wobbling axes", (3,)),
    ),
)


def wobbling(base: System) -> System:
    """A tumble with the part axis_wobble before the table, and before that a stand along whose axes it wobbles: those
    of the table, which needs no base of its own.
    """

    class Wobbling(type(base)):  # type: ignore[misc]
        slots: ClassVar[dict[str, Slot]] = {
            **base.slots,
            "stand": Slot(_STAND, "fixture"),
            "wobble": Slot(WOBBLE, "axis_wobble"),
        }
        wires = base.wires.replace(
            "site -> table: f=f_local omega=omega_local",
            "site -> stand: f=f_face omega=omega_face\n    stand -> wobble: f=f_base omega=omega_base\n"
            "    wobble -> table: f=f_local omega=omega_local\n    table -> wobble: angle",
        )

        def parameters(self, parts: PartValues) -> dict[str, Any]:
            east, p_cross_east = 1, -5  # directions of the part fixture
            mount = {"stand.mounts[1,1]": east, "stand.mounts[1,2]": p_cross_east, "stand.latitude": self["latitude"]}
            return {**super().parameters(parts), "table.base": np.eye(3), "wobble.axis": 3, **mount}

    system: System = Wobbling()
    system.name, system.folder = base.name, base.folder
    return system
