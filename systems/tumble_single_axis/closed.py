"""Closed formulas of Hu 1981 for the single-axis tumble, corrected.  [TUM1-REDUCE; eq. 3-14..3-21 with E20-E23]

Harmonics of mount 1 and 2 over theta = -(table angle), first index the order, second the mount, gamma = g/g0, phi the
latitude, y3 and y4 the drift in the dwells with the output axis up and down:

    D_F  = (y3 + y4)/2                     D_O  = (y4 - y3)/(2 gamma)
    D_I  = -(B11 + B12)/(2 gamma cos phi)  D_S  = (A12 - A11)/(2 gamma cos phi)
    D_II = (A01 + A02 - A21 - A22 - y3 - y4)/(2 gamma^2 cos^2 phi)
    D_SS = (A01 + A02 + A21 + A22 - y3 - y4)/(2 gamma^2 cos^2 phi)
    D_IO = (B11 - B12)/(gamma^2 sin 2 phi) D_OS = (A11 + A12)/(gamma^2 sin 2 phi)
    D_IS = (B21 - B22)/(gamma^2 cos^2 phi)

They hold for the ideal geometry (mounts of gyrobench.frames, table axis on the pole) and whole turns.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from gyrobench.frames import G0


def formulas(
    one: Mapping[str, float], two: Mapping[str, float], y3: float, y4: float, latitude: float, gravity: float
) -> dict[str, float]:
    """Return nine coefficients from the amplitudes A0 A1 B1 A2 B2 of both mounts and the two dwells (unit of the
    data).
    """
    g, c, s2 = gravity / G0, math.cos(latitude), math.sin(2.0 * latitude)
    mean, second, dwell = one["A0"] + two["A0"], one["A2"] + two["A2"], y3 + y4
    return {
        "D_F": dwell / 2.0,
        "D_I": -(one["B1"] + two["B1"]) / (2.0 * g * c),
        "D_O": (y4 - y3) / (2.0 * g),
        "D_S": (two["A1"] - one["A1"]) / (2.0 * g * c),
        "D_II": (mean - second - dwell) / (2.0 * g * g * c * c),
        "D_SS": (mean + second - dwell) / (2.0 * g * g * c * c),
        "D_IO": (one["B1"] - two["B1"]) / (g * g * s2),
        "D_OS": (one["A1"] + two["A1"]) / (g * g * s2),
        "D_IS": (one["B2"] - two["B2"]) / (g * g * c * c),
    }
