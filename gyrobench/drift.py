"""Static drift models of a single-degree-of-freedom gyro.  [GYRO-STATIC-8/-9/-10; 000_791234d3afc34a0c.txt
eq. 2-27..2-49]

    omega_d = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_OO Y2 + D_SS Z2 + D_IO X Y + D_OS Y Z + D_IS X Z

omega_d is the drift in precession sign (rate of the rotor axis about the input axis; rebalance gives k i =
omega_IA - omega_d), (X, Y, Z) = -f/g0 the specific force along I, O, S in the book's sign, in multiples of g0
= 9.80665 m/s2. Coefficients are in rad/s (per g0, per g0 squared); at the surface in deg/h, deg/h/g,
deg/h/g2.

Where |f| does not change, X2 + Y2 + Z2 is a constant: D_OO cannot be told from D_F, D_II and D_SS.
Not modelled: vibration, orders above two, input rate and torquer command terms, aging, temperature (see the
part).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gyrobench.units import DEG, G0

NAMES = ("D_F", "D_I", "D_O", "D_S", "D_II", "D_OO", "D_SS", "D_IO", "D_OS", "D_IS")
TERM_SETS: dict[int, tuple[str, ...]] = {
    3: ("D_F", "D_I", "D_S"),
    4: ("D_F", "D_I", "D_S", "D_IS"),
    5: ("D_F", "D_I", "D_S", "D_II", "D_IS"),
    8: ("D_F", "D_I", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS"),
    9: ("D_F", "D_I", "D_O", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS"),
    10: NAMES,
}
MEANING = {
    "D_F": "constant drift",
    "D_I": "mass unbalance along the spin axis (drift per g along the input axis)",
    "D_O": "drift per g along the output axis",
    "D_S": "mass unbalance along the input axis (drift per g along the spin axis)",
    "D_II": "compliance, g² along the input axis",
    "D_OO": "g² along the output axis (empirical)",
    "D_SS": "compliance, g² along the spin axis",
    "D_IO": "compliance, input and output axes",
    "D_OS": "compliance, output and spin axes",
    "D_IS": "anisoelasticity, input and spin axes",
}
_AXES = {"I": 0, "O": 1, "S": 2}


def order(name: str) -> int:
    """Power of g of a coefficient: D_F 0, D_I 1, D_IS 2."""
    return 0 if name == "D_F" else len(name) - 2


def surface_unit(name: str) -> str:
    """Unit of ``name`` for the user: deg/h, deg/h/g or deg/h/g2."""
    return ("deg/h", "deg/h/g", "deg/h/g2")[order(name)]


def terms(which: int) -> tuple[str, ...]:
    """Coefficient names of the ``which``-term model; ValueError for an unknown number."""
    if which not in TERM_SETS:
        raise ValueError(f"{which}-term drift model unknown; there are {', '.join(map(str, TERM_SETS))}")
    return TERM_SETS[which]


def regressors(xyz: ArrayLike, names: tuple[str, ...] = NAMES) -> NDArray[np.float64]:
    """Rows of the design: ``xyz`` (..., 3) in multiples of g0, book sign -> (..., len(names))."""
    v = np.asarray(xyz, dtype=float)
    columns = []
    for name in names:
        product = np.ones(v.shape[:-1])
        for axis in name[2:] if name != "D_F" else "":
            product = product * v[..., _AXES[axis]]
        columns.append(product)
    return np.stack(columns, axis=-1)


def drift(xyz: ArrayLike, coefficients: Mapping[str, float]) -> NDArray[np.float64]:
    """omega_d at ``xyz`` (..., 3); unknown names are refused with KeyError."""
    unknown = [n for n in coefficients if n not in NAMES]
    if unknown:
        raise KeyError(f"unknown drift coefficient {', '.join(unknown)}; known: {', '.join(NAMES)}")
    names = tuple(n for n in NAMES if n in coefficients)
    out: NDArray[np.float64] = regressors(xyz, names) @ np.array([coefficients[n] for n in names])
    return out


# --------------------------------------------------------------------------------------------- signs
#: convention -> (sign of the rate against omega_d, sign of the force axis against X, Y, Z)
CONVENTIONS = {
    "precession": (1, 1),  # the bench: omega_d against -f/g0
    "torque": (-1, 1),  # the book's 2-40, 3-58, 3-95: omega_M = -omega_d against -f/g0
    "precession_f": (1, -1),  # omega_d against +f/g0: linear terms change sign
    # indicated rate omega_IA + omega_M against +f/g0 (own derivation from sign definitions)
    "ieee": (-1, -1),
}


def change_sign(coefficients: Mapping[str, float], from_: str, to: str) -> dict[str, float]:
    """Coefficients written in convention ``from_`` rewritten in ``to`` (keys of :data:`CONVENTIONS`).

    Turning the force axis round changes the linear terms only; turning the rate round changes all.  [IEEE]
    """
    for c in (from_, to):
        if c not in CONVENTIONS:
            raise ValueError(f"sign convention '{c}' unknown; there are {', '.join(CONVENTIONS)}")
    rate = CONVENTIONS[from_][0] * CONVENTIONS[to][0]
    force = CONVENTIONS[from_][1] * CONVENTIONS[to][1]
    return {n: v * rate * (force if order(n) == 1 else 1) for n, v in coefficients.items()}


# --------------------------------------------------------------------------------------------- physical form
#: physical quantity -> unit.  M_O: constant torque about the output axis; l_*: float mass centre; K_ij:
#: displacement along i per unit force along j.  K_SS-K_II is the only combination of the two that can be had
#: from a drift test.
PHYSICAL = {
    "M_O": "N.m",
    "l_I": "m",
    "l_S": "m",
    "K_SI": "m/N",
    "K_IS": "m/N",
    "K_SO": "m/N",
    "K_IO": "m/N",
    "K_SS": "m/N",
    "K_II": "m/N",
    "K_SS-K_II": "m/N",
}


def _positive(H: float, m: float) -> None:
    for name, value, unit in (("H", H, "N.m.s"), ("m", m, "kg")):
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} = {value:g} {unit}: a finite positive number is expected")


def from_physical(H: float, m: float, physical: Mapping[str, float]) -> dict[str, float]:
    """Coefficients (rad/s per g0^n) of spin momentum ``H``, float mass ``m`` and the quantities of
    :data:`PHYSICAL`.

    Only what ``physical`` determines is returned.  D_O and D_OO have no rigid-body cause and never come out.
    Raises ValueError for H, m <= 0, an unknown or non-finite entry, a negative K_II or K_SS, K_SS - K_II
    given twice. [GYRO-STATIC-8; eq. 2-27..2-34 corrected by E7-E9]
    """
    _positive(H, m)
    for name, value in physical.items():
        if name not in PHYSICAL:
            raise ValueError(f"physical quantity '{name}' unknown; there are {', '.join(PHYSICAL)}")
        if not math.isfinite(value):
            raise ValueError(f"{name} = {value} is no finite number")
        if name in ("K_SS", "K_II") and value < 0.0:
            raise ValueError(
                f"{name} = {value:g} m/N: a structure does not move against the force, expected >= 0"
            )
    pair = {"K_SS", "K_II"} & physical.keys()
    if pair and "K_SS-K_II" in physical:
        raise ValueError(f"K_SS-K_II and {' and '.join(sorted(pair))} define D_IS twice; give one of the two")
    if len(pair) == 1:
        missing = ({"K_SS", "K_II"} - pair).pop()
        raise ValueError(f"D_IS needs K_SS and K_II; {missing} is missing")
    p = dict(physical)
    if pair:
        p["K_SS-K_II"] = p["K_SS"] - p["K_II"]
    a, q = m * G0 / H, m * m * G0 * G0 / H
    rule = {
        "D_F": ("M_O", -1.0 / H),
        "D_I": ("l_S", -a),
        "D_S": ("l_I", a),
        "D_II": ("K_SI", -q),
        "D_SS": ("K_IS", q),
        "D_IO": ("K_SO", -q),
        "D_OS": ("K_IO", q),
        "D_IS": ("K_SS-K_II", -q),
    }
    return {n: s * p[key] for n, (key, s) in rule.items() if key in p}


def to_physical(H: float, m: float, coefficients: Mapping[str, float]) -> dict[str, float]:
    """The inverse of :func:`from_physical`; D_O and D_OO have no physical form and are refused unless
    zero.
    """
    _positive(H, m)
    for n in ("D_O", "D_OO"):
        if coefficients.get(n, 0.0) != 0.0:
            raise ValueError(f"{n} = {coefficients[n]:g}: an empirical term, it has no form in m, l and K")
    a, q = m * G0 / H, m * m * G0 * G0 / H
    rule = {
        "M_O": ("D_F", -H),
        "l_S": ("D_I", -1.0 / a),
        "l_I": ("D_S", 1.0 / a),
        "K_SI": ("D_II", -1.0 / q),
        "K_IS": ("D_SS", 1.0 / q),
        "K_SO": ("D_IO", -1.0 / q),
        "K_IO": ("D_OS", 1.0 / q),
        "K_SS-K_II": ("D_IS", -1.0 / q),
    }
    return {key: s * coefficients[n] for key, (n, s) in rule.items() if n in coefficients}


def merge(
    coefficients: Mapping[str, float], H: float, m: float, physical: Mapping[str, float]
) -> dict[str, float]:
    """Coefficients given partly as D's and partly in physical form; one given in both forms is refused."""
    derived = from_physical(H, m, physical) if physical else {}
    twice = sorted(derived.keys() & coefficients.keys())
    if twice:
        raise ValueError(
            f"{', '.join(twice)}: given as coefficient and by physical quantities; give one of the two"
        )
    return {n: {**coefficients, **derived}[n] for n in NAMES if n in coefficients or n in derived}


_DPH = DEG / 3600.0
#: The standard gyro, rad/s per g0^n.  R = 0.3, U_z = 0.9, U_x = -0.7 deg/h(/g), K_zz-K_xx = 0.15, K_zx =
#: 0.05, K_xz = 0.04, K_zy = 0.03, K_xy = -0.02 deg/h/g2 in torque sign (book ranges, spec d1 section 1)
#: turned into precession sign; D_O = 0.1 deg/h/g is empirical (no rigid-body cause); D_OO = 0.
STANDARD: dict[str, float] = {
    n: v * _DPH
    for n, v in {
        "D_F": -0.3,
        "D_I": -0.9,
        "D_O": 0.1,
        "D_S": -0.7,
        "D_II": -0.05,
        "D_OO": 0.0,
        "D_SS": 0.04,
        "D_IO": -0.03,
        "D_OS": -0.02,
        "D_IS": -0.15,
    }.items()
}
