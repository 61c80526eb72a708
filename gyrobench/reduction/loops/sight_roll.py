"""What a roll of the line of sight makes of a joint angle that moves: the second order of the jitter budget.

In the axes of ``blocks.gimbal.ordered``: 3 along the outer joint, 1 along the inner one, p its angle, c and s at the
start, where the linear model stands; A, B the bodies.  About axis 3 the line of sight turns by w_B3 = c w_A3 - s w_A2.
While the loops hold it, w_A3 = w_A2 s/c and it rolls with w = w_A2 / c, so that an angle dp of the inner joint from its
start adds to first order in it

    rate       d = -dp w                                                          of the line of sight about axis 3
    torque     c (B3 (dp w)' - B2 dp w') - (A2 - A1) w_A1 w_A2                    at the outer gimbal

The outer joint's angle dq from its start counts in full: w_A = R3(q) w_b, what reaches the linear model is
R3(dq) w_b in the place of w_b (:func:`as_at_the_start`).

Not modelled: products of inertia in these terms, third order.  Source: kinematics of GIMBAL-2AXIS; own derivation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.component.blocks.gimbal import ordered_matrix
from gyrobench.component.math import vector
from gyrobench.reduction.loops.loop_measures import Gate


@dataclass(frozen=True)
class RollCoupling:
    """Rate of the line of sight about the outer axis (rad/s) and torque at the outer gimbal (N.m), over the ride."""

    rate: Array
    torque: Array


def roll_coupling(gate: Gate, p: Mapping[str, Any], base: tuple[str, str, str], theta: tuple[str, str]) -> RollCoupling:
    """Return the terms of second order of a ride.

    base: channels of the base's rates about x, y, z; theta: of the joint angles, pitch and yaw.
    """
    inner = int(p["platform.form"])
    x, y, z = as_at_the_start(gate, p, base, theta)
    rates = (x, y, z) if inner == 0 else (z, -y, x)
    p0, q0 = (float(np.asarray(p["platform.theta_0"], float)[k]) for k in (inner, 1 - inner))
    c3, s3, c = np.cos(q0), np.sin(q0), np.cos(p0)
    w1, w2 = c3 * rates[0] + s3 * rates[1], c3 * rates[1] - s3 * rates[0]
    dp, w = gate[theta[inner]] - p0, w2 / c
    A, B = (
        np.diag(np.asarray(ordered_matrix(float(inner), vector(p[f"platform.{n}"])))) for n in ("I_outer", "I_inner")
    )
    dt = float(gate.t[1] - gate.t[0])

    def rise(v: Array) -> Array:
        return np.asarray(np.gradient(v, dt))

    torque = c * (B[2] * rise(dp * w) - B[1] * dp * rise(w))
    return RollCoupling(-dp * w, torque - (A[1] - A[0]) * w1 * w2)


def as_at_the_start(
    gate: Gate, p: Mapping[str, Any], base: tuple[str, str, str], theta: tuple[str, str]
) -> tuple[Array, Array, Array]:
    """Return the base's rates about x, y, z turned by what the outer joint has turned since the start."""
    x, y, z = (gate[name] for name in base)
    outer = 1 - int(p["platform.form"])
    dq = gate[theta[outer]] - float(np.asarray(p["platform.theta_0"], float)[outer])
    c, s = np.cos(dq), np.sin(dq)
    if outer:  # yaw, about z
        return c * x + s * y, c * y - s * x, z
    return x, c * y + s * z, c * z - s * y
