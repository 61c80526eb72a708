"""What tests of north finding share."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from systems.north_finder import plans

NAME = "north_finder"


def windows(
    method: str, heading: float, latitude: float, pitch: float = 0.0, roll: float = 0.0, noise: float = 0.0
) -> dict[str, np.ndarray]:
    """Windows of a method without bias, from v_b = C v_ENU by scipy's rotations."""
    C = Rotation.from_euler("ZXY", [-heading, pitch, roll]).as_matrix().T
    angles = plans.targets(method) or [-2.0 * math.pi * k / 36 for k in range(36)]
    rows = np.repeat(angles, max(32 // len(angles), 1))
    n, W = rows.size, 7.2921159e-5
    turned = [Rotation.from_euler("z", a).as_matrix().T @ C for a in rows]
    rate = np.array([T @ [0.0, W * math.cos(latitude), W * math.sin(latitude)] for T in turned])
    force = np.array([T @ [0.0, 0.0, 9.80665] for T in turned])
    rate += noise * np.random.default_rng(3).normal(size=(n, 3))
    t = 10.0 * np.arange(n)
    return {"phase": np.ones(n), "t_start": t, "t_end": t + 10.0, "angle_start": rows, "angle_end": rows,
            "mean_x": rate[:, 0], "mean": rate[:, 1], "f_x": force[:, 0], "f_y": force[:, 1]}  # fmt: skip
