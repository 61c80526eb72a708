"""Ideal and noisy records of a two-axis tumble, made from the measurement equation alone."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
from stated import with_sizes

from gyrobench import drift, frames
from gyrobench.system.system import load_system

system = load_system("tumble_two_axis")
_room = type(system).__module__
reduction: Any = importlib.import_module(".reduction", _room)
closed: Any = importlib.import_module(".closed", _room)
geometry: Any = importlib.import_module(".geometry", _room)

DPH = math.pi / 180.0 / 3600.0
K = 17.2 * DPH / 1e-3


def attitude(phi: float, outer: float, inner: float) -> np.ndarray:
    """C = R_x(inner) R_y(outer) C0 [TUM2AX-GEOM], rows I, O, S in ENU: y(0) = p, z(0) = west."""
    p = frames.pole(phi)
    y, z = p, -frames.E
    c0 = np.array([np.cross(y, z), y, z])
    b, a = outer, inner
    ry = np.array([[math.cos(b), 0, -math.sin(b)], [0, 1, 0], [math.sin(b), 0, math.cos(b)]])
    rx = np.array([[1, 0, 0], [0, math.cos(a), math.sin(a)], [0, -math.sin(a), math.cos(a)]])
    out: np.ndarray = rx @ ry @ c0
    return out


def setup(latitude: float = 45.75, **changes: Any) -> Any:
    values: dict[str, Any] = {"latitude": math.radians(latitude), "gravity": 9.8, "k": K}
    return reduction.TwoAxisSetup(**with_sizes({**values, **changes}))


def record(
    s: Any, truth: dict[str, float], positions: int = 36, each: int = 2, cycles: int = 1, noise: Any = None,
    turned: Any = None,
) -> dict[str, np.ndarray]:  # fmt: skip
    """``each`` averages in every position.  noise() -> rad/s.  turned: rotation of the gyro axes against the plate."""
    rows = []
    t = 0.0
    for j in range(positions * cycles):
        theta = 2.0 * math.pi * j / positions
        C = attitude(s.latitude, s.m * theta, s.n * theta)
        C = C if turned is None else turned @ C
        xyz = -C @ frames.U * s.gravity / frames.G0
        rate = float(C[0] @ frames.earth_rate_local(s.latitude))
        t += 70.0
        for _ in range(each):
            y = float(drift.drift(xyz, truth)) + (noise() if noise else 0.0)
            rows.append([j + 1, t, t + 60.0, *[s.m * theta] * 2, *[s.n * theta] * 2, (rate - y) / s.k, 0])
            t += 60.0
    names = ("phase", "t_start", "t_end", "outer_start", "outer_end", "inner_start", "inner_end", "mean", "flagged")
    out = {n: np.array([r[k] for r in rows]) for k, n in enumerate(names)}
    out["phase"], out["flagged"] = out["phase"].astype(int), out["flagged"].astype(int)
    return out
