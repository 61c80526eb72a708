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

from gyrobench.frames import G0

Amplitudes = Mapping[str, float]
#: symbol of Hu 1981 -> coefficient of the bench and its sign
BOOK = {
    "R_x": ("Dy_0", 1), "u_y": ("Dy_z", 1), "u_zx": ("Dy_y", -1), "Q_x": ("Dy_yz", 1),
    "R_y": ("Dx_0", -1), "u_x": ("Dx_z", 1), "u_zy": ("Dx_x", -1), "Q_y": ("Dx_xz", -1),
}  # fmt: skip


def simple(channel: str, one: Amplitudes, two: Amplitudes, latitude: float, gravity: float) -> dict[str, float]:
    """Return R, u, Q of Hu 1981, per g0, of a channel from the amplitudes of its torquer rate in mounts 1 and 2.

    The torquer rate of the y channel is k_x i_x, that of the x channel k_y i_y.
    """
    g, c, s, s2 = gravity / G0, math.cos(latitude), math.sin(latitude), math.sin(2.0 * latitude)
    mean, half = (one["A0"] + two["A0"]) / 2.0, (one["A0"] - two["A0"]) / (2.0 * g * s)
    if channel == "y":
        along, cross = (one["B1"] - two["B1"]) / (2.0 * g * c), (one["B1"] + two["B1"]) / (g * g * s2)
        return {"R_x": -mean, "u_y": half, "u_zx": along, "Q_x": cross}
    along, cross = (one["A1"] + two["A1"]) / (2.0 * g * c), (two["A1"] - one["A1"]) / (g * g * s2)
    return {"R_y": mean, "u_x": half, "u_zy": along, "Q_y": cross}


def nine(
    channel: str, one: Amplitudes, two: Amplitudes, y3: float, y4: float, latitude: float, gravity: float
) -> dict[str, float]:
    """Return nine coefficients of a channel from the amplitudes of its drift in mounts 1 and 2 and the dwells."""
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
