"""Flights of the gimballed platforms: a vehicle's rates, the true attitude by rotations, feedback of the true error.

Flights are written in axes forward, left, up; base axes here are x right, y forward, z up.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from native_parts import make
from scipy.spatial.transform import Rotation
from wired import BENCH

from gyrobench.packaging import load_part

Three = load_part("platform_three_gimbal_2dof", BENCH)
Four = load_part("platform_four_gimbal", BENCH)
DEG = math.pi / 180.0


def base_rate(roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    """deg/s about forward, left (nose down) and up, in base axes rad/s."""
    return np.array([-pitch, roll, yaw]) * DEG


def turn(axis: int, angle: float) -> np.ndarray:
    """Active rotation about x, y or z (0, 1, 2)."""
    out = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out[i, i] = out[j, j] = math.cos(angle)
    out[j, i] = math.sin(angle)
    out[i, j] = -out[j, i]
    return out


def platform_in_base(theta: np.ndarray, mount: int, theta_4: float = 0.0) -> np.ndarray:
    """Active rotation from base axes to platform axes; theta in A order."""
    pitch, roll, azimuth = (turn(k, theta[k]) for k in range(3))
    inner = pitch @ roll if mount == 1 else roll @ pitch
    return turn(1, theta_4) @ inner @ azimuth


def vector(c: np.ndarray) -> np.ndarray:
    """Rotation vector of a matrix, below 180 deg."""
    axis = 0.5 * np.array([c[2, 1] - c[1, 2], c[0, 2] - c[2, 0], c[1, 0] - c[0, 1]])
    size = math.sqrt(axis @ axis)
    return axis * (math.atan2(size, 0.5 * (np.trace(c) - 1.0)) / size if size > 0.0 else 1.0)


def t2(theta: np.ndarray, mount: int) -> np.ndarray:
    """Platform axes to motor axes (A order), the secant held beyond 84 deg."""
    c, s = math.cos(theta[2]), math.sin(theta[2])
    secant = math.cos(theta[0] if mount == 0 else theta[1])
    secant = 1.0 / math.copysign(max(abs(secant), 0.1), secant)
    out = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    out[1 - mount] *= secant
    return out


def fly(
    part: str,
    profile: Callable[[float], np.ndarray],
    seconds: float,
    feedback: float = 40.0,
    inputs: Callable[[float], dict[str, float]] = lambda t: {},
    h: float = 1e-3,
    **parameters: float,
) -> dict[str, np.ndarray]:
    """Worst error, and over time: t, theta, theta_4, error (rad), attitude, lock.  ``parameters`` by FMI name with
    their start angles (theta_0[1] ...) and the mount; the feedback (1/s) turns the platform back to where it began."""
    four = part == "platform_four_gimbal"
    mount = 1 if four else int(parameters.get("mount", 0))
    one = make(part, "native")
    one.set({n: float(x) for n, x in parameters.items()})
    one.initialize()
    names = [f"{n}[{k}]" for n in ("theta", "attitude", "omega") for k in (1, 2, 3)] + ["lock", "saturated"]
    names += ["theta_4"] if four else []
    vehicle, rows = np.eye(3), []
    x = np.array(one.get(names))
    begin = platform_in_base(x[:3], mount, x[11] if four else 0.0)
    error, last, move = np.zeros(3), None, np.eye(3)
    for k in range(round(seconds / h)):
        wb = profile(k * h)
        if last is None or np.any(wb != last):
            move, last = Rotation.from_rotvec(wb * h).as_matrix(), wb
        v = -feedback * t2(x[:3], mount) @ error
        values = {f"omega_b[{i + 1}]": wb[i] for i in range(3)} | {f"v[{i + 1}]": v[i] for i in range(3)}
        one.set(values | inputs(k * h))
        one.step(k * h, h)
        vehicle = vehicle @ move
        x = np.array(one.get(names))
        g4 = x[11] if four else 0.0
        error = vector(begin.T @ vehicle @ platform_in_base(x[:3], mount, g4))
        rows.append(((k + 1) * h, *x[:3], g4, *error, *x[3:6], x[9], x[10]))
    one.free()
    rows = np.array(rows)
    return {
        "t": rows[:, 0], "theta": rows[:, 1:4], "theta_4": rows[:, 4], "error": np.linalg.norm(rows[:, 5:8], axis=1),
        "attitude": rows[:, 8:11], "lock": rows[:, 11], "saturated": rows[:, 12],
    }  # fmt: skip
