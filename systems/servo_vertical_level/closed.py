"""Formulas of Hu 1981 for the vertical and level servo tests, corrected.  [SERVO-C1, SERVO-C2; E37, E38, E41]

    x down   theta' = +W s - R - U_z g - K_zx g2        x up   theta' = -W s - R + U_z g - K_zx g2
    y up or down, x level   theta' = -omega_E,x - R  (and -+ U_y g, the empirical drift along the output axis)
    z down   theta' = -omega_E,x - R + U_x g + K_xz g2  z up   theta' = -omega_E,x - R - U_x g + K_xz g2

g stands for gamma = g/g0; coefficients per g0.  The formulas below take rates with the Earth's already removed,
d = theta' + omega_E,x, and give our coefficients in precession sign (D_F = -R, D_I = -U_z, D_S = +U_x ...).
"""

from __future__ import annotations

from collections.abc import Mapping


def three_term(rate_down: float, rate_up: float, rate_z_down: float, earth_up: float, g: float) -> dict[str, float]:
    """Return R, U_z, U_x of 5.3 in the sign of Hu 1981 from table rates (x east for the third), compliance ignored: R
    takes + K_zx g2, U_x g takes + (K_xz + K_zx) g2.  earth_up: W sin(latitude).
    """
    R = -(rate_down + rate_up) / 2.0
    U_z = (rate_up - rate_down + 2.0 * earth_up) / (2.0 * g)
    return {"R": R, "U_z": U_z, "U_x": (rate_z_down + R) / g}


def formulas(d: Mapping[str, float], g: float) -> dict[str, float]:
    """Return our coefficients from the mean drift d of the classes x down, x up, y down, y up, z down, z up (rad/s), as
    many as there are; empty where no formula of Hu 1981 applies.
    """
    vertical = {"x down", "x up"} <= d.keys()
    out = {}
    if vertical:
        out["D_I"] = (d["x down"] - d["x up"]) / (2.0 * g)
    if {"y down", "y up"} <= d.keys():
        out["D_O"] = (d["y down"] - d["y up"]) / (2.0 * g)
    if {"z down", "z up"} <= d.keys():
        out["D_S"] = (d["z down"] - d["z up"]) / (2.0 * g)
    if d.keys() == {"x down", "x up"}:  # class 1 alone
        return {**out, "D_F": (d["x down"] + d["x up"]) / 2.0}
    if d.keys() == {"x down", "x up", "z down"}:  # the three-term route
        book = three_term(d["x down"], d["x up"], d["z down"], 0.0, g)
        return {"D_F": -book["R"], "D_I": -book["U_z"], "D_S": book["U_x"]}
    if len(out) < 2 or "D_O" not in out or "D_S" not in out or len(d) not in (4, 6):
        return {}
    D_F = (d["y down"] + d["y up"]) / 2.0
    out |= {"D_F": D_F, "D_SS": ((d["z down"] + d["z up"]) / 2.0 - D_F) / g**2}
    if vertical:
        out["D_II"] = ((d["x down"] + d["x up"]) / 2.0 - D_F) / g**2
    return out
