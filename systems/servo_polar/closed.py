"""Formulas of Hu 1981 for the polar servo test, corrected.  [SERVO-C3-REDUCE; eq. 3-85..3-88, Table 3-3, E36-E44, E52]

theta' in mount m = S, N is A0m + A1m sin(theta) + B1m cos(theta) + A2m sin(2 theta) + B2m cos(2 theta): here the A are
the sines and the B the cosines, and what is fitted is theta', not omega_d.  gamma = g/g0, s, c of the latitude:

    A0S = +W - (R + U_z gamma s + K_zx gamma2 s2 - K_xz gamma2 c2 / 2)     A0N = -W - (R - U_z gamma s + ...)
    B1S = +U_x gamma c - dK gamma2 sin(2 phi)/2                            B1N = -U_x gamma c - dK gamma2 sin(2 phi)/2
    A1S = A1N = -K_zy gamma2 sin(2 phi)/2    A2S = A2N = K_xy gamma2 c2/2    B2S = B2N = K_xz gamma2 c2/2

and, with the empirical drift along the output axis (U_y = -D_O), -U_y gamma c in A1S and +U_y gamma c in A1N.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.drift import harmonic
from gyrobench.reduction.drift.servo_regression import BOOK
from gyrobench.reduction.estimation import regression

from .refusals import turned

WHOLE = 356.0  # degrees that count as a whole turn
Amplitudes = Mapping[str, float]


def amplitudes(
    angle_start: Array, angle_end: Array, rate: Array, order: int = 2
) -> tuple[dict[str, float], regression.Fit]:
    """Return A0, A1, B1, A2, B2 of theta' (A: sine, B: cosine) by least squares over window means, and the fit itself
    (whose names are the other way round: A cosine, B sine).
    """
    fit = harmonic.fit(angle_start, angle_end, rate, order)
    other = {"A": "B", "B": "A"}
    named = {(n if n == "A0" else other[n[0]] + n[1:]): float(v) for n, v in zip(fit.names, fit.beta, strict=True)}
    return named, fit


def separate(S: Amplitudes, N: Amplitudes, latitude: float, g: float, earth_rate: float) -> dict[str, float]:
    """Return U_x, U_z, U_y, dK, K_xz, K_zy, K_xy and "R+" = R + K_zx gamma2 s2 from the amplitudes of both mounts, in
    the names and sign of Hu 1981, rad/s per g0^n.
    """
    s, c, s2 = math.sin(latitude), math.cos(latitude), math.sin(2.0 * latitude)
    B2 = (S["B2"] + N["B2"]) / 2.0
    return {
        "U_x": (S["B1"] - N["B1"]) / (2.0 * g * c),
        "U_z": (N["A0"] - S["A0"] + 2.0 * earth_rate) / (2.0 * g * s),
        "U_y": (N["A1"] - S["A1"]) / (2.0 * g * c),
        "ΔK": -(S["B1"] + N["B1"]) / (g * g * s2),
        "K_xz": 2.0 * B2 / (g * g * c * c),
        "K_zy": -(S["A1"] + N["A1"]) / (g * g * s2),
        "K_xy": (S["A2"] + N["A2"]) / (g * g * c * c),
        "R+": -(S["A0"] + N["A0"]) / 2.0 + B2,
    }


def resolve(found: Mapping[str, float], latitude: float, g: float, R: float | None, equal: bool) -> dict[str, float]:
    """Return R and K_zx from "R+": (ii) with R of the dwells, (i) with K_zx = K_xz, or not at all."""
    square = (g * math.sin(latitude)) ** 2
    rest = {n: v for n, v in found.items() if n != "R+"}
    if R is not None:
        return {**rest, "R": R, "K_zx": (found["R+"] - R) / square}
    if equal:
        return {**rest, "R": found["R+"] - found["K_xz"] * square, "K_zx": found["K_xz"]}
    return {**rest, "R": found["R+"]}


def ours(book: Mapping[str, float]) -> dict[str, float]:
    """Return coefficients in the names and torque sign of Hu 1981 as ours.  [CROSS-MAP]"""
    return {name: sign * book[symbol] for name, (symbol, sign) in BOOK.items() if symbol in book}


def reduce(
    start: Array, end: Array, length: Array, groups: Mapping[str, NDArray[np.bool_]], latitude: float, g: float,
    earth_rate: float, route: str,
) -> tuple[dict[str, float], dict[str, regression.Fit], str]:  # fmt: skip
    """Return our coefficients by the formulas, the harmonic fit of each mount, and why not ("" when all is well).

    start, end (rad), length (s): of the windows.  groups: attitude -> rows.  Harmonics want a whole turn: least squares
    over part of one would give them large and correlated errors.
    """
    rate = (end - start) / length
    mounts = {m: rows for m, rows in groups.items() if m.startswith("polar")}
    parts = {m: turned(start[rows], end[rows]) for m, rows in mounts.items()}
    both = {m: amplitudes(start[r], end[r], rate[r]) for m, r in mounts.items() if parts[m] >= WHOLE}
    fits = {m: fit for m, (_, fit) in both.items()}
    if short := [f"{m} turned by {parts[m]:.4g}°" for m in mounts if m not in both]:
        return {}, fits, f"harmonics want a whole turn; {', '.join(short)}"
    if set(both) != {"polar S", "polar N"}:
        return {}, fits, f"they need both mounts, there is {', '.join(both) or 'none'}"
    found = separate(both["polar S"][0], both["polar N"][0], latitude, g, earth_rate)
    R = None
    if route == "dwells":
        means = [float(np.sum((end - start)[r]) / np.sum(length[r])) for m, r in groups.items() if m not in both]
        R = -float(np.mean(means))
    return ours(resolve(found, latitude, g, R, route == "equal")), fits, ""
