"""Continuous models of gimballed platforms from the equations alone, for numpy and scipy: nothing of the parts.

Three gimbals, roll outside, pitch, azimuth inside (A order: pitch, roll, azimuth), by virtual power: with J_k the rates
of body k per joint rate and w_k its inertial rate [PLATFORM-3AXIS-KIN, -DYN],

    sum_k J_k^T (I_k w_k' + w_k x I_k w_k + u_k x f_k) = t + J_a^T M_gyro

w_k' with q'' = 0 is a complex-step derivative of w_k along the motion.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

Array = Any
EPS = 1e-30
BODIES = np.array([[0.8, 0.9, 0.7], [0.4, 0.6, 0.5], [0.6, 0.5, 0.7]])  # roll, pitch gimbal, inner element


def turned(axis: int, angle: Any, v: Array) -> Array:
    """v in axes turned about x, y or z (0, 1, 2)."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out = np.array(v, dtype=np.result_type(v, angle))
    out[i] = np.cos(angle) * v[i] + np.sin(angle) * v[j]
    out[j] = np.cos(angle) * v[j] - np.sin(angle) * v[i]
    return out


def along(q: Array, v: Array) -> list[Array]:
    """A vector of the base in axes of roll gimbal, pitch gimbal, inner element."""
    r = turned(1, q[1], v)
    f = turned(0, q[0], r)
    return [r, f, turned(2, q[2], f)]


def rates(q: Array, dq: Array, wb: Array) -> list[Array]:
    """Inertial rates of roll gimbal, pitch gimbal, inner element, each in its own axes."""
    r = turned(1, q[1], wb) + dq[1] * np.eye(3)[1]
    f = turned(0, q[0], r) + dq[0] * np.eye(3)[0]
    return [r, f, turned(2, q[2], f) + dq[2] * np.eye(3)[2]]


def accelerations(
    q: Array, dq: Array, wb: Array, ab: Array, torque: Array, m_gyro: Array, unbalance: Array | None = None,
    fb: Array | None = None,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """q'', and rate and angular acceleration of the inner element."""
    w = rates(q, dq, wb)
    bias = [x.imag / EPS for x in rates(q + 1j * EPS * dq, dq.astype(complex), wb + 1j * EPS * ab)]
    per_rate = [rates(q, e, np.zeros(3)) for e in np.eye(3)]
    mass, force = np.zeros((3, 3)), np.array(torque, dtype=float)
    for k in range(3):
        jac = np.column_stack([per_rate[j][k] for j in range(3)])
        mass += jac.T @ (BODIES[k][:, None] * jac)
        need = BODIES[k] * bias[k] + np.cross(w[k], BODIES[k] * w[k])
        if unbalance is not None:
            need = need + np.cross(unbalance[k], along(q, fb)[k])
        force -= jac.T @ need
    ddq = np.linalg.solve(mass, force + jac.T @ m_gyro)
    return ddq, w[2], bias[2] + jac @ ddq


def three_axis_loop() -> tuple[Callable[..., Array], int]:
    """x' = f(x, w_b, a_b) of systems/platform_three_axis without delays, and the place of the attitude in x.

    Gyros J b'' + C b' = H w_I - J a_O, torque on the element -H (w_O + b') along I; motor torque = voltage; u_A = T2 u;
    F = K (1 + wc/(15 s)) (1 + 4 s/wc) / (1 + s/(4 wc)), K for a crossover at 10 Hz with the inertias at joint angles 0.
    """
    h, j, c, k_sg = 0.02, 2.5e-5, 0.02, 10.0
    out_axis = [(1, -1.0), (2, 1.0), (1, -1.0)]  # O of the gyros x, y, z
    wc = 2.0 * math.pi * 10.0
    s = 1j * wc
    shape = (1 + wc / (15 * s)) * (1 + 4 * s / wc) / (1 + s / (4 * wc)) * k_sg * h / c / (s * (j / c * s + 1.0))
    inertia = np.array([1.0, 2.0, 0.7])
    gain = 1.0 / np.abs(shape / (inertia * s))

    def slope(x: Array, wb: Array, ab: Array) -> Array:
        q, dq, b, bd, lead, total = x[:3], x[3:6], x[6:9], x[9:12], x[12:15], x[15:18]
        ca, sa, cf = np.cos(q[2]), np.sin(q[2]), np.cos(q[0])
        u = k_sg * b
        u = np.array([ca * u[0] - sa * u[1], (sa * u[0] + ca * u[1]) / cf, u[2]])
        y = lead + 16.0 * (u - lead)  # (1 + 4 s/wc) / (1 + s/(4 wc)): lead is the lag of u by 1/(4 wc)
        torque = -gain * (y + total) - 0.05 * dq
        w = rates(q, dq, wb)[2]
        w_o = np.array([sign * w[k] for k, sign in out_axis])
        ddq, w, a = accelerations(q, dq, wb, ab, torque, -h * (w_o + bd))
        a_o = np.array([sign * a[k] for k, sign in out_axis])
        return np.concatenate([dq, ddq, bd, (h * w - c * bd) / j - a_o, 4 * wc * (u - lead), wc / 15 * y, w])

    return slope, 18


def isolation(slope: Callable[..., Array], start: Array, place: int, axis: int, hertz: float) -> float:
    """dB: attitude (all axes) over the angle of the base about one axis, from the linearized continuous model."""
    zero, n, d = np.zeros(3), start.size, 1e-6
    e = np.eye(3)[axis]

    def difference(f: Callable[[float], Array]) -> Array:
        return (f(d) - f(-d)) / (2.0 * d)

    a = np.column_stack([difference(lambda x, k=k: slope(start + x * np.eye(n)[k], zero, zero)) for k in range(n)])
    by_rate = difference(lambda x: slope(start, x * e, zero))
    by_acceleration = difference(lambda x: slope(start, zero, x * e))
    s = 2j * math.pi * hertz
    x = np.linalg.solve(s * np.eye(n) - a, by_rate * s + by_acceleration * s * s)
    return 20.0 * math.log10(np.linalg.norm(x[place : place + 3]))
