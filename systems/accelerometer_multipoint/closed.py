"""Closed formulas of Hu 1981 from the harmonics of one mount, in exact form.  [ACC, ACC-EXACT; eq. 3-44..3-46]

    y = A0 + sum A_n cos n theta + B_n sin n theta, n = 1 ... 3,      theta_0 = atan2(-A1, -B1)
    a_n = A_n cos n theta_0 - B_n sin n theta_0,                      b_n = A_n sin n theta_0 + B_n cos n theta_0

    k0 = A0 + a_2    k1 = -(b_1 + 3 b_3)/gamma    k2 = -2 a_2/gamma^2    k3 = 4 b_3/gamma^3
    mount a: k5 = 2 b_2/gamma^2                   mount b: k4 = -2 b_2/gamma^2

The printed form takes theta_0 = 0 in the amplitudes; at 2e-4 rad that is below 1 ug.  Four positions, theta = 0, 90,
180, 270 degrees, see one harmonic and the mean only:

    k2' = (S90 - S0)/(gamma^2 cos 2 theta_0)    k0' = S0 - k2' gamma^2 sin^2 theta_0    k1' = hypot(D0, D90)/gamma

S and D half the sum and half the difference of opposite positions.  They stand for [ACC-4PT]

    k1' = k1 + k3 gamma^2,   and in mount a   k0' = k0 + k5 gamma^2 tan(2 theta_0)/2,   k2' = k2 - k5 tan 2 theta_0,
    in mount b the same with -k4 in the place of k5.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gyrobench.arrays import Array

from .geometry import CROSS

EQUAL = 1e-5  # rad, largest departure from equal spacing
LEAST = 7  # equally spaced positions for three harmonics  [ACC-MINPTS]


def spacing(angle: Array) -> tuple[int, str]:
    """Return the number of different positions of a turn, and why they are not equally spaced ("" if they are)."""
    turn = 2.0 * math.pi
    place = np.sort(np.mod(angle + EQUAL, turn))
    first = np.concatenate([[True], np.diff(place) > 10.0 * EQUAL])
    stands = place[first]
    n = stands.size
    gaps = np.diff(np.append(stands, stands[0] + turn))
    k = int(np.argmax(np.abs(gaps - turn / n)))
    if abs(float(gaps[k]) - turn / n) > 2.0 * EQUAL:
        return n, f"a gap of {math.degrees(float(gaps[k])):.6g}° where {360.0 / n:.6g}° would be equal"
    visits = np.bincount(np.cumsum(first) - 1, minlength=n)
    if np.ptp(visits) > 0:
        return n, f"{visits.min()} to {visits.max()} readings a position"
    return n, ""


def harmonics(angle: Array, y: Array, order: int = 3) -> dict[str, float]:
    """Return A0, A1, B1 ... by sums over equally spaced positions (more than 2 ``order`` of them), whole turns."""
    found = {"A0": float(np.mean(y))}
    for n in range(1, order + 1):
        found[f"A{n}"] = 2.0 * float(np.mean(y * np.cos(n * angle)))
        found[f"B{n}"] = 2.0 * float(np.mean(y * np.sin(n * angle)))
    return found


def formulas(h: Mapping[str, float], mount: str, gamma: float) -> dict[str, float]:
    """Return k0 ... k3, k4 or k5 in multiples of g0 (per g0^n) and theta_0 in rad; k1 must be positive."""
    zero = math.atan2(-h["A1"], -h["B1"])
    c = {n: math.cos(n * zero) for n in (1, 2, 3)}
    s = {n: math.sin(n * zero) for n in (1, 2, 3)}
    a2 = h["A2"] * c[2] - h["B2"] * s[2]
    b = {n: h[f"A{n}"] * s[n] + h[f"B{n}"] * c[n] for n in (1, 2, 3)}
    return {
        "k0": h["A0"] + a2,
        "k1": -(b[1] + 3.0 * b[3]) / gamma,
        "k2": -2.0 * a2 / gamma**2,
        "k3": 4.0 * b[3] / gamma**3,
        CROSS[mount]: (2.0 if mount == "a" else -2.0) * b[2] / gamma**2,
        "theta0": zero,
    }


def four_points(angle: Array, y: Array, gamma: float) -> dict[str, float]:
    """Return k0, k1, k2 (which stand for the combinations above) and theta_0 from positions at 0, 90, 180, 270
    degrees.
    """
    quarter = np.mod(np.rint(angle / (math.pi / 2.0)).astype(int), 4)
    p = [float(np.mean(y[quarter == q])) for q in range(4)]
    s0, s90, d0, d90 = (p[0] + p[2]) / 2.0, (p[1] + p[3]) / 2.0, (p[0] - p[2]) / 2.0, (p[1] - p[3]) / 2.0
    zero = math.atan2(-d0, -d90)
    k2 = (s90 - s0) / (gamma**2 * math.cos(2.0 * zero))
    return {"k0": s0 - k2 * (gamma * math.sin(zero)) ** 2, "k1": math.hypot(d0, d90) / gamma, "k2": k2, "theta0": zero}


def stands_for(truth: Mapping[str, float], zeros: Mapping[str, float], gamma: float) -> dict[str, float]:
    """Return what four positions see of a true polynomial; ``zeros``: mount -> theta_0; two mounts: the mean of
    them.
    """
    out = {"k0": 0.0, "k1": 0.0, "k2": 0.0}
    for mount, zero in zeros.items():
        cross = truth["k5"] if mount == "a" else -truth["k4"]
        cubic = truth["k3"] * gamma**2
        c, s = math.cos(zero), math.sin(zero)
        seen = math.hypot(truth["k1"] * c + cubic * c**3, truth["k1"] * s + cubic * s**3)
        out["k0"] += (truth["k0"] + 0.5 * cross * gamma**2 * math.tan(2.0 * zero)) / len(zeros)
        out["k1"] += seen / len(zeros)
        out["k2"] += (truth["k2"] - cross * math.tan(2.0 * zero)) / len(zeros)
    return out
