"""Frames: site, Earth rate, gravity, table and mounts.

Local frame L = (E, N, U).  An attitude is a 3x3 matrix whose ROWS are the body axes written in the other
frame: ``v_body = C v_local``.  Gyro axes are I, O, S (input, output, spin reference), right-handed.

A table with its axis on the pole has, at angle 0, the axes x_T = E, y_T = p x E, z_T = p, where p is the
direction of the north pole of the sky.  Turned by +angle (right-handed about z_T): ``v_table = Rz(angle) base
v_local``, and a gyro on it reads ``v_face = face v_table``.  Hu 1981 turns the table against the Earth and
counts that positive: its theta is -angle.  [CONV-FRAMES, TUM1-GEOM; Hu 1981, eq. 3-12..3-16]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.units import EARTH_RATE, G0

__all__ = [
    "EARTH_RATE", "G0", "MOUNTS", "E", "N", "U", "check_rotation", "earth_rate_local", "equatorial_base",
    "equatorial_problems", "gravity_problems", "latitude_problems", "normal_gravity", "passive", "passive_z",
    "polar_base", "pole", "rotation", "rotation_problems", "to_face", "tumble_faces",
]  # fmt: skip


E = np.array([1.0, 0.0, 0.0])
N = np.array([0.0, 1.0, 0.0])
U = np.array([0.0, 0.0, 1.0])

# WGS84 (NIMA TR8350.2): semi-major axis m, flattening, gravity at the equator m/s2, Somigliana's k, m = w2 a2
# b/GM
_A, _F = 6378137.0, 1.0 / 298.257223563
_GAMMA_E, _K, _M = 9.7803253359, 1.931852652458e-3, 3.449786506841e-3

#: Mounts of the single-axis tumble whose output axis lies along the table axis: rows I, O, S in table axes.
#: 1: I = x_T (east), O = +z_T (pole), S = I x O;  2: mount 1 turned 180 degrees about I.
MOUNTS: dict[int, Array] = {
    1: np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    2: np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}


def check_latitude(latitude: float) -> float:
    """``latitude`` (rad) itself; raises ValueError outside -90..90 degrees or when it is no finite number."""
    if not math.isfinite(latitude) or abs(latitude) > math.pi / 2:
        raise ValueError(f"latitude {math.degrees(latitude):.6g} deg lies outside -90..90 deg")
    return latitude


def normal_gravity(latitude: float, height: float = 0.0) -> float:
    """WGS84 normal gravity, m/s2, at geodetic ``latitude`` (rad) and ``height`` (m) above the ellipsoid.

    Somigliana's formula (1e-11 m/s2 of the exact normal field on the ellipsoid) with the second-order height
    term, whose gradient neglects squares of the flattening: 1.1e-7 m/s2 at worst per km of height.  Not
    modelled: the real field's anomaly (some 1e-4 m/s2); give a measured value where it matters. Raises
    ValueError for a latitude outside -90..90 deg or a height outside -11..100 km.
    """
    check_latitude(latitude)
    if not -11e3 <= height <= 100e3:
        raise ValueError(f"height {height:.6g} m lies outside -11000..100000 m")
    s2 = math.sin(latitude) ** 2
    surface = _GAMMA_E * (1.0 + _K * s2) / math.sqrt(1.0 - _F * (2.0 - _F) * s2)
    x = height / _A
    return surface * (1.0 - 2.0 * (1.0 + _F + _M - 2.0 * _F * s2) * x + 3.0 * x * x)


def pole(latitude: float) -> Array:
    """Unit vector to the north celestial pole in (E, N, U)."""
    return np.array([0.0, math.cos(latitude), math.sin(latitude)])


def earth_rate_local(latitude: float, rate: float = EARTH_RATE) -> Array:
    """Earth rate vector in (E, N, U), rad/s."""
    return rate * pole(latitude)


def passive(axis: int, angle: ArrayLike) -> Array:
    """Coordinates in axes turned by +``angle`` (rad) about one of them (0, 1, 2), (..., 3, 3): ``v_new = R v_old``."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.zeros((*np.shape(angle), 3, 3))
    second, third = (axis + 1) % 3, (axis + 2) % 3
    R[..., axis, axis] = 1.0
    R[..., second, second] = R[..., third, third] = c
    R[..., second, third], R[..., third, second] = s, -s
    return R


def passive_z(angle: float) -> Array:
    """Return :func:`passive` about the third axis, of one angle."""
    return passive(2, angle)


def rotation(axis: ArrayLike, angle: float) -> Array:
    """Active right-handed rotation by ``angle`` (rad) about ``axis`` (any length but zero): ``v_turned = R
    v``.
    """
    n = np.asarray(axis, dtype=float)
    size = float(np.linalg.norm(n))
    if not (math.isfinite(size) and size > 0.0):
        raise ValueError(f"rotation axis {n.tolist()} has no direction")
    x, y, z = n / size
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * (k @ k))


def check_rotation(matrix: ArrayLike, name: str, tolerance: float = 1e-9) -> Array:
    """``matrix`` as a 3x3 array; ValueError naming ``name`` and the defect unless orthonormal with
    determinant +1.
    """
    c = np.asarray(matrix, dtype=float)
    if c.shape != (3, 3):
        raise ValueError(f"{name}: a 3x3 matrix is expected (rows = body axes), got shape {c.shape}")
    if not np.all(np.isfinite(c)):
        raise ValueError(f"{name}: the matrix holds a non-finite number")
    defect = float(np.max(np.abs(c @ c.T - np.eye(3))))
    if defect > tolerance:
        raise ValueError(
            f"{name}: rows are not orthonormal (largest defect of C C' - 1 is {defect:.3g}, "
            f"allowed {tolerance:g}); each row is a unit vector at right angles to the others"
        )
    if np.linalg.det(c) < 0.0:
        raise ValueError(f"{name}: determinant is -1, a left-handed set of axes; reverse one row")
    return c


def rotation_problems(matrices: Mapping[str, ArrayLike]) -> list[str]:
    """Return what :func:`check_rotation` says of each of the named matrices."""
    problems = []
    for name, matrix in matrices.items():
        try:
            check_rotation(matrix, name)
        except ValueError as error:
            problems.append(str(error))
    return problems


def latitude_problems(latitude: float) -> list[str]:
    """Return why there is no such latitude (rad), as a sentence; empty where there is."""
    if abs(latitude) <= math.pi / 2:
        return []
    return [f"latitude {math.degrees(latitude):.6g}° lies outside −90..90°"]


def gravity_problems(gravity: float) -> list[str]:
    """Return why there is no such gravity (m/s2) on Earth, as a sentence; empty where there is."""
    return [] if 9.7 <= gravity <= 9.9 else [f"gravity {gravity:.6g} m/s² lies outside 9.7..9.9 m/s²"]


def polar_base(latitude: float) -> Array:
    """Base matrix of a table with its axis on the pole: rows x_T = E, y_T = p x E, z_T = p at angle 0."""
    p = pole(check_latitude(latitude))
    return np.array([E, np.cross(p, E), p])


def equatorial_base(latitude: float) -> Array:
    """Return the base of a table with its axis east, first axis on the pole: its axis sees no Earth rate."""
    p = pole(latitude)
    return np.array([p, np.cross(E, p), E])


def equatorial_problems(base: ArrayLike, latitude: float) -> list[str]:
    """Return by how much a table axis sees Earth rate, where it is not at right angles to the pole (1 degree)."""
    along = float(np.asarray(base)[2] @ pole(latitude))
    if abs(along) <= math.radians(1.0):
        return []
    rate = along * EARTH_RATE / units.factor("deg/h")
    return [f"table.base: the axis must be at right angles to the pole (1°); it sees {rate:.3g} °/h of Earth rate"]


def tumble_faces(latitude: float) -> dict[str, Array]:
    """The four attitudes of the single-axis tumble, rows I, O, S in table axes at angle 0.

    ``mount 1``, ``mount 2``: output axis along +pole and -pole, input axis east.  ``static 3``, ``static 4``:
    input axis east, output axis up and down (these two depend on latitude because the table axis does).
    """
    base = polar_base(latitude)
    up, down = np.array([E, U, np.cross(E, U)]), np.array([E, -U, np.cross(E, -U)])
    return {"mount 1": MOUNTS[1], "mount 2": MOUNTS[2], "static 3": up @ base.T, "static 4": down @ base.T}


def to_face(vector: ArrayLike, face: ArrayLike, base: ArrayLike, angle: float) -> Array:
    """A local (E, N, U) vector in face axes with the table at ``angle`` (rad)."""
    return np.asarray(np.asarray(face) @ passive_z(angle) @ np.asarray(base) @ np.asarray(vector))


def rows(matrix: Sequence[Sequence[float]]) -> list[float]:
    """A 3x3 matrix as nine numbers row by row (the form of the sequencer's ``faces`` parameter)."""
    return [float(v) for row in matrix for v in row]
