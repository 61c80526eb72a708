"""Closed formulas of Hu 1981 for the two-channel tumble, corrected.

Harmonics over theta = -(table angle) of mount 1 and 2, gamma = g/g0, phi the latitude.  Simple model (3-22..3-25 with
E24, TUM2A), amplitudes of the torquer rates k_x i_x and k_y i_y = omega_IA - omega_d (a: constant, b: sine of x, e:
cosine of y):

    R_x = -(a1 + a2)/2     u_y = (a1 - a2)/(2 gamma sin phi)      u_zx = (b1 - b2)/(2 gamma cos phi)
    R_y = +(a1' + a2')/2   u_x = (a1' - a2')/(2 gamma sin phi)    u_zy = (e1 + e2)/(2 gamma cos phi)
    Q_x = (b1 + b2)/(gamma^2 sin 2 phi)                           Q_y = (e2 - e1)/(gamma^2 sin 2 phi)

Nine terms a channel (3-26..3-37 with E25-E29, TUM2B-REDUCE), amplitudes of the drift omega_d, A, B of the x channel and
C, D of the y channel; y3, y4 the drift in the dwells with y up and down: see :func:`nine`.
They hold for the ideal geometry (geometry.faces, table axis on the pole) and whole turns.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gyrobench.arrays import Array
from gyrobench.frames import G0
from gyrobench.reduction.drift import harmonic
from gyrobench.reduction.estimation.regression import Fit

Amplitudes = Mapping[str, float]
#: symbol of Hu 1981 -> coefficient of the bench and its sign
BOOK = {
    "R_x": ("Dy_0", 1), "u_y": ("Dy_z", 1), "u_zx": ("Dy_y", -1), "Q_x": ("Dy_yz", 1),
    "R_y": ("Dx_0", -1), "u_x": ("Dx_z", 1), "u_zy": ("Dx_x", -1), "Q_y": ("Dx_xz", -1),
}  # fmt: skip


def simple(
    x1: Amplitudes, x2: Amplitudes, y1: Amplitudes, y2: Amplitudes, latitude: float, gravity: float
) -> dict[str, float]:
    """R, u, Q of Hu 1981, per g0, from amplitudes of k_x i_x (x1, x2) and k_y i_y (y1, y2) in mounts 1 and 2."""
    g, c, s, s2 = gravity / G0, math.cos(latitude), math.sin(latitude), math.sin(2.0 * latitude)
    return {
        "R_x": -(x1["A0"] + x2["A0"]) / 2.0,
        "u_y": (x1["A0"] - x2["A0"]) / (2.0 * g * s),
        "u_zx": (x1["B1"] - x2["B1"]) / (2.0 * g * c),
        "Q_x": (x1["B1"] + x2["B1"]) / (g * g * s2),
        "R_y": (y1["A0"] + y2["A0"]) / 2.0,
        "u_x": (y1["A0"] - y2["A0"]) / (2.0 * g * s),
        "u_zy": (y1["A1"] + y2["A1"]) / (2.0 * g * c),
        "Q_y": (y2["A1"] - y1["A1"]) / (g * g * s2),
    }


def nine(
    channel: str, one: Amplitudes, two: Amplitudes, y3: float, y4: float, latitude: float, gravity: float
) -> dict[str, float]:
    """Nine coefficients of a channel from the amplitudes of its drift in mounts 1 and 2 and the dwells."""
    g, c, s, s2 = gravity / G0, math.cos(latitude), math.sin(latitude), math.sin(2.0 * latitude)
    mean, second, dwell = one["A0"] + two["A0"], one["A2"] + two["A2"], y3 + y4
    d = f"D{channel}_"
    out = {
        d + "x": (one["B1"] + two["B1"]) / (2.0 * g * c),
        d + "y": (two["A1"] - one["A1"]) / (2.0 * g * c),
        d + "z": (two["A0"] - one["A0"]) / (2.0 * g * s),
        d + "xy": (two["B2"] - one["B2"]) / (g * g * c * c),
        d + "xz": (two["B1"] - one["B1"]) / (g * g * s2),
        d + "yz": (one["A1"] + two["A1"]) / (g * g * s2),
    }
    if channel == "x":
        out[d + "0"] = dwell / 2.0
        out[d + "xx"] = -second / (g * g * c * c)
        out[d + "zz"] = (mean + second - dwell) / (2.0 * g * g * s * s)
    else:
        out[d + "0"] = dwell / 2.0 - second / (c * c)
        out[d + "yy"] = second / (g * g * c * c)
        out[d + "zz"] = (mean - second - dwell) / (2.0 * g * g * s * s) + 4.0 * second / (g * g * s2 * s2)
    return out


def amplitudes(
    phase: Array, start: Array, end: Array, y: Array, roles: Mapping[int, str], order: int = 2
) -> tuple[dict[str, Fit], str]:
    """Harmonics of ``y`` (n,) over theta for both mounts, and why not ("" when all is well).

    phase, start, end (rad): one entry for each window.  roles: phase -> mount 1, mount 2 (others are left out).
    """
    fits = {}
    for mount in ("mount 1", "mount 2"):
        mine = [p for p, r in roles.items() if r == mount]
        for p in mine:
            here = phase == p
            if harmonic.whole_turns(start[here], end[here]) is None:
                turned = math.degrees(float(np.sum(np.abs(end[here] - start[here]))))
                return {}, f"phase {p} covers {turned:.4g}°, no whole turns without gap; least squares only"
        rows = np.isin(phase, mine)
        fits[mount] = harmonic.fit(-start[rows], -end[rows], y[rows], order)
    return fits, ""


def named(fit: Fit) -> dict[str, float]:
    return dict(zip(fit.names, fit.beta.tolist(), strict=True))
