"""Ideal records of the two-axis servo test, from Hu 1981, eq. 3-95..3-97 alone, written out and integrated."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from gyrobench import frames
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow, RunDocument
from gyrobench.system.system import load_system

NAME = "servo_two_axis"
system = load_system(NAME)
_room = type(system).__module__
geometry: Any = importlib.import_module(".geometry", _room)
windows: Any = importlib.import_module(".windows", _room)
closed: Any = importlib.import_module(".closed", _room)
refusals: Any = importlib.import_module(".refusals", _room)

DPH = math.pi / 180.0 / 3600.0
W = frames.EARTH_RATE
Array = np.ndarray[Any, Any]
Line = Callable[[Array, Sequence[float]], Any]
#: the coefficients of Hu 1981 of both lines, and the ninth of each channel (ours)
X_NAMES = ("R_x", "U_z", "U_x", "K_zz − K_xx", "K_zx", "K_xz", "K_zy", "K_xy")
Y_NAMES = ("R_y", "U_z", "U_y", "K_yy − K_zz", "K_zy", "K_yz", "K_zx", "K_yx")


def mounts(phi: float) -> dict[int, tuple[Array, Array]]:
    """X and Y of the twelve rows of appendix 2, as APP2 lists them."""
    e, n, u, p = frames.E, frames.N, frames.U, frames.pole(phi)
    i = np.cross(e, p)
    return {
        1: (e, n), 2: (e, u), 3: (n, e), 4: (n, u), 5: (e, p), 6: (e, i),
        7: (u, n), 8: (u, e), 9: (p, e), 10: (p, i), 11: (i, e), 12: (i, p),
    }  # fmt: skip


def frame(number: int, phi: float) -> Array:
    """Rows X, Y, Z in ENU."""
    x, y = mounts(phi)[number]
    return np.array([x, y, np.cross(x, y)])


def attitude(x: float, y: float) -> Array:
    """A of 3-96 as the product of two turns: about X by x, then about the new Y by y (passive)."""
    cx, sx, cy, sy = math.cos(x), math.sin(x), math.cos(y), math.sin(y)
    about_x = np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
    about_y = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]])
    out: Array = about_y @ about_x
    return out


def minus_alpha(g: Array, p: Sequence[float]) -> Any:
    """First line of 3-95, corrected (E47); g = SF (..., 3)."""
    X, Y, Z = np.moveaxis(g, -1, 0)
    R, U_z, U_x, dK, K_zx, K_xz, K_zy, K_xy = p[:8]
    out = R + U_z * X - U_x * Z + dK * X * Z + K_zx * X * X - K_xz * Z * Z + K_zy * X * Y - K_xy * Y * Z
    return out - p[8] * Y if len(p) > 8 else out  # our ninth is in precession sign


def beta(g: Array, p: Sequence[float]) -> Any:
    """Second line of 3-95."""
    X, Y, Z = np.moveaxis(g, -1, 0)
    R, U_z, U_y, dK, K_zy, K_yz, K_zx, K_yx = p[:8]
    out = R - U_z * Y + U_y * Z + dK * Y * Z - K_zy * Y * Y + K_yz * Z * Z - K_zx * X * Y + K_yx * X * Z
    return out + p[8] * X if len(p) > 8 else out


def integrate(
    number: int, phi: float, g: float, px: Sequence[float], py: Sequence[float], times: Array
) -> tuple[Array, Array]:
    """Angles of both axes of a gyro with the coefficients of Hu 1981, from 0, 0: omega_x = alpha', omega_y = beta'."""
    base = frame(number, phi)
    earth, down = base @ (W * frames.pole(phi)), base @ np.array([0.0, 0.0, -g])

    def slope(_: float, v: Array) -> list[float]:
        A = attitude(v[0], v[1])
        wx, wy = A[0] @ earth, A[1] @ earth
        at = A @ down
        return [(-minus_alpha(at, px) - wx) / math.cos(v[1]), beta(at, py) - wy]

    found = solve_ivp(slope, (times[0], times[-1]), [0.0, 0.0], "DOP853", t_eval=times, rtol=1e-12, atol=1e-14)
    return found.y[0], found.y[1]


def record(
    numbers: Sequence[int], phi: float, g: float, px: Sequence[float], py: Sequence[float], window: float = 120.0,
    hours: float = 24.0, terms: int = 9,
) -> Record:  # fmt: skip
    """What a perfect table reads: SI, without parameters, as a laboratory's."""
    columns: dict[str, list[Array]] = {"phase": [], "t_start": [], "t_end": []} | {a: [] for a in windows.ANGLES}
    begin = 0.0
    for k, number in enumerate(numbers, 1):
        t = np.arange(0.0, hours * 3600.0 + 1.0, window)
        outer, inner = integrate(number, phi, g, px, py, t)
        n = t.size - 1
        parts = (np.full(n, k), begin + t[:-1], begin + t[1:], outer[:-1], outer[1:], inner[:-1], inner[1:])
        for column, part in zip(columns.values(), parts, strict=True):
            column.append(part)
        begin += t[-1] + 500.0
    run = RunDocument(
        options={"latitude": phi, "gravity": g * frames.G0, "terms": terms},
        parameters={},
        plan=[PlanRow(phase=k, label=f"mount {m}", mode="servo") for k, m in enumerate(numbers, 1)],
    )
    return Record({c: np.concatenate(v) for c, v in columns.items()}, {}, run)


def ours(px: Sequence[float], py: Sequence[float]) -> dict[str, float]:
    """The coefficients of Hu 1981 as ours, deg/h per g^n, by CROSS-MAP."""
    x = ("Dx_0", "Dx_x", "Dx_z", "Dx_xz", "Dx_xx", "Dx_zz", "Dx_xy", "Dx_yz")
    y = ("Dy_0", "Dy_y", "Dy_z", "Dy_yz", "Dy_yy", "Dy_zz", "Dy_xy", "Dy_xz")
    sx, sy = (-1, -1, 1, -1, -1, 1, -1, 1), (1, -1, 1, 1, -1, 1, -1, 1)
    out = {n: s * v / DPH for n, s, v in zip((*x, *y), (*sx, *sy), (*px[:8], *py[:8]), strict=True)}
    if len(px) > 8:
        out |= {"Dx_y": px[8] / DPH, "Dy_x": py[8] / DPH}
    return out
