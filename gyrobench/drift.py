"""Static drift models of one- and two-degree-of-freedom gyros.  [GYRO-STATIC-8/-9/-10, GYRO-STATIC-2DOF;
Hu 1981, eq. 2-27..2-49]

    omega_d = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_OO Y2 + D_SS Z2 + D_IO X Y + D_OS Y Z + D_IS X Z

omega_d is the drift in precession sign (rate of the rotor axis about the input axis; rebalance gives k i =
omega_IA - omega_d), (X, Y, Z) = -f/g0 the specific force along I, O, S in the sign of Hu 1981, in multiples of g0
= 9.80665 m/s2. Coefficients are in rad/s (per g0, per g0 squared); at the surface in deg/h, deg/h/g,
deg/h/g2.

A two-degree-of-freedom gyro has one such set per channel, named Dx_0, Dx_x, Dx_xz ... and Dy_0, Dy_y, Dy_yz ...
over its axes x, y, z (outer gimbal, inner gimbal, spin).  Each channel is the model above in axes of its own:
(I, O, S) = (x, y, z) for the x channel, (y, -x, z) for the y channel.

Where |f| does not change, X2 + Y2 + Z2 is a constant: D_OO cannot be told from D_F, D_II and D_SS.
Not modelled: vibration, orders above two, input rate and torquer command terms, aging, temperature (see the
part).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gyrobench.units import DPH, G0

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
    "D_F": "acceleration-insensitive (fixed) drift rate",
    "D_I": "acceleration-sensitive drift rate, input axis (mass unbalance along the spin axis)",
    "D_O": "acceleration-sensitive drift rate, output axis (empirical)",
    "D_S": "acceleration-sensitive drift rate, spin reference axis (mass unbalance along the input axis)",
    "D_II": "acceleration-squared-sensitive drift rate, input axis (compliance)",
    "D_OO": "acceleration-squared-sensitive drift rate, output axis (empirical)",
    "D_SS": "acceleration-squared-sensitive drift rate, spin reference axis (compliance)",
    "D_IO": "acceleration-squared-sensitive drift rate, input and output axes (compliance)",
    "D_OS": "acceleration-squared-sensitive drift rate, output and spin reference axes (compliance)",
    "D_IS": "acceleration-squared-sensitive drift rate, input and spin reference axes (anisoelasticity)",
}
#: the square that cannot be told from the others at constant |g| -> the three that take it up
FOLDED = {"D_OO": ("D_F", "D_II", "D_SS"), "Dx_yy": ("Dx_0", "Dx_xx", "Dx_zz"), "Dy_xx": ("Dy_0", "Dy_yy", "Dy_zz")}
_AXES = {"I": 0, "O": 1, "S": 2, "x": 0, "y": 1, "z": 2}
_OWN = {"x": {"I": "x", "O": "y", "S": "z"}, "y": {"I": "y", "O": "x", "S": "z"}}  # of a channel, signs apart


def _axes(name: str) -> str:
    """Return the axes a coefficient multiplies: "" for D_F and Dx_0, "IS" for D_IS, "xz" for Dx_xz."""
    return "".join(a for a in name.partition("_")[2] if a in _AXES)


def name_2dof(channel: str, name: str) -> str:
    """Return what the coefficient ``name`` is called in the x or y channel of a two-degree-of-freedom gyro: D_IS is
    Dx_xz and Dy_yz.  Raises KeyError for another channel."""
    return f"D{channel}_" + ("".join(sorted(_OWN[channel][a] for a in _axes(name))) or "0")


def sign_2dof(channel: str, name: str) -> int:
    """Return the sign of the coefficient ``name`` in a channel: the output axis of the y channel is -x."""
    return -1 if channel == "y" and name.count("O") == 1 else 1


#: channel -> coefficient names in the order of NAMES
NAMES_2DOF = {c: tuple(name_2dof(c, n) for n in NAMES) for c in ("x", "y")}


def meaning(name: str) -> str:
    """Return what a coefficient multiplies, in words."""
    if name in MEANING:
        return MEANING[name]
    channel, axes = name[1:].split("_")
    along = f"{axes[0]} axis" if len(set(axes)) == 1 else f"{axes[0]} and {axes[-1]} axes"
    what = (
        "acceleration-insensitive (fixed) drift rate",
        f"acceleration-sensitive drift rate, {along}",
        f"acceleration-squared-sensitive drift rate, {along}",
    )[order(name)]
    return f"{what}, {channel} channel"


def order(name: str) -> int:
    """Return the power of g of a coefficient: D_F 0, D_I 1, D_IS 2; Dx_0 0, Dx_xz 2."""
    return len(_axes(name))


def surface_unit(name: str) -> str:
    """Return the unit of ``name`` for the user: deg/h, deg/h/g or deg/h/g2."""
    return ("deg/h", "deg/h/g", "deg/h/g2")[order(name)]


def terms(which: int) -> tuple[str, ...]:
    """Coefficient names of the ``which``-term model; ValueError for an unknown number."""
    if which not in TERM_SETS:
        raise ValueError(f"{which}-term drift model unknown; there are {', '.join(map(str, TERM_SETS))}")
    return TERM_SETS[which]


def terms_2dof(channel: str, which: int) -> tuple[str, ...]:
    """Coefficient names of the ``which``-term model of a channel: x, 9: Dx_0, Dx_x, Dx_y, ... without Dx_yy."""
    return tuple(name_2dof(channel, n) for n in terms(which))


def typst_2dof(channel: str, names: Iterable[str]) -> str:
    """Return the drift of a channel over X, Y, Z as Typst math, the terms Dx_0, Dx_xz ... of ``names``."""
    parts = []
    for axes in (n.split("_")[1] for n in names):
        upper = axes.upper()
        power = f"{upper[0]}^2" if len(axes) == 2 and axes[0] == axes[1] else " ".join(upper)
        parts.append(f'D_"{channel}0"' if axes == "0" else f'D_"{channel},{axes}" {power}')
    return " + ".join(parts)


def fold_problems(true: Mapping[str, float], prefix: str = "") -> list[str]:
    """Return which squares of a simulated gyro no test at constant |g| sees: coefficients in rad/s per g0 squared.

    prefix: of the names in ``true``, which the sentences repeat ("gyro.").
    """
    return [
        f"{prefix}{square} = {true[prefix + square] / DPH:g} °/h/g²: at constant |g| it cannot be told from {a}, {b} "
        f"and {c}; set fold=true to report the combinations {a} + γ² {square}, {b} − {square}, {c} − {square}"
        for square, (a, b, c) in FOLDED.items()
        if true.get(prefix + square)
    ]


@functools.cache
def _factors(names: tuple[str, ...]) -> tuple[list[int], list[int]]:
    """Return the first and the second factor of each coefficient: 0 to 2 the axes, 3 for none."""
    axes = [[_AXES[axis] for axis in _axes(name)] + [3, 3] for name in names]
    return [a[0] for a in axes], [a[1] for a in axes]


def regressors(xyz: ArrayLike, names: tuple[str, ...] = NAMES) -> NDArray[np.float64]:
    """Return the rows of the design: ``xyz`` (..., 3) in multiples of g0, sign of Hu 1981 -> (..., len(names)).

    ``names`` of a two-degree-of-freedom gyro stand over its axes x, y, z, in both channels.
    """
    v = np.asarray(xyz, dtype=float)
    factors = np.concatenate([v, np.ones((*v.shape[:-1], 1))], axis=-1)
    first, second = _factors(tuple(names))
    out: NDArray[np.float64] = factors.take(first, axis=-1) * factors.take(second, axis=-1)
    return out


def drift(xyz: ArrayLike, coefficients: Mapping[str, float]) -> NDArray[np.float64]:
    """omega_d at ``xyz`` (..., 3), of a gyro or of one channel; names unknown or of two channels: KeyError."""
    first = next(iter(coefficients), "D_F")
    known = next((s for s in NAMES_2DOF.values() if first in s), NAMES)
    unknown = [n for n in coefficients if n not in known]
    if unknown:
        raise KeyError(f"unknown drift coefficient {', '.join(unknown)}; known: {', '.join(known)}")
    names = tuple(n for n in known if n in coefficients)
    out: NDArray[np.float64] = regressors(xyz, names) @ np.array([coefficients[n] for n in names])
    return out


def at_points(coefficients: Mapping[str, float]) -> Callable[[tuple[float, float, float]], float]:
    """Return :func:`drift` of a single point (X, Y, Z), in plain numbers: thirty times as quick for one."""
    factors = [
        (value, first, second)
        for first, second, value in zip(*_factors(tuple(coefficients)), coefficients.values(), strict=True)
        if value != 0.0
    ]

    def rate(at: tuple[float, float, float]) -> float:
        v, total = (*at, 1.0), 0.0
        for value, first, second in factors:
            total += value * v[first] * v[second]
        return total

    return rate


# --------------------------------------------------------------------------------------------- signs
#: convention -> (sign of the rate against omega_d, sign of the force axis against X, Y, Z)
CONVENTIONS = {
    "precession": (1, 1),  # the bench: omega_d against -f/g0
    "torque": (-1, 1),  # Hu 1981, eq. 2-40, 3-58, 3-95: omega_M = -omega_d against -f/g0
    "precession_f": (1, -1),  # omega_d against +f/g0: linear terms change sign
    # indicated rate omega_IA + omega_M against +f/g0 (own derivation from sign definitions)
    "ieee": (-1, -1),
}


def change_sign(coefficients: Mapping[str, float], from_: str, to: str) -> dict[str, float]:
    """Return the coefficients written in convention ``from_`` rewritten in ``to`` (keys of :data:`CONVENTIONS`).

    Turning the force axis round changes the linear terms only; turning the rate round changes all.  [CONV-SIGNS]
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
    """Return the coefficients (rad/s per g0^n) of spin momentum ``H``, float mass ``m`` and the quantities of
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
            raise ValueError(f"{name} = {value:g} m/N: a structure does not move against the force, expected >= 0")
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


def from_physical_2dof(H: float, m: float, physical: Mapping[str, float], outer: float = 0.0) -> dict[str, float]:
    """Return the coefficients of both channels of a two-degree-of-freedom gyro, rad/s per g0^n.  [GYRO-STATIC-2DOF]

    ``m``: mass of rotor and inner gimbal, kg.  ``physical``: M_x, M_y (constant torques, N.m), l_x, l_y, l_z (m),
    K_ij (m/N; displacement along i per unit force along j) or the differences K_zz-K_xx, K_zz-K_yy.  ``outer``:
    mass of the outer gimbal times its arm along z, kg.m; it acts about the outer axis only, so that
    Dy_y = -(m l_z + outer) g0/H and Dx_x = -m l_z g0/H (u_zx and u_zy of Hu 1981).  Only what ``physical``
    determines is returned.  Raises ValueError as :func:`from_physical` does, naming the channel.
    """
    _positive(H, m)
    out: dict[str, float] = {}
    used: set[str] = set()
    for channel, own in _OWN.items():
        given: dict[str, float] = {}
        for key in PHYSICAL:
            name = "".join(own.get(letter, letter) for letter in key)
            if name in physical:
                given[key] = physical[name] * sign_2dof(channel, key)
                used.add(name)
        if "K_SS" in given and "K_II" not in given and f"K_{own['O']}{own['O']}" in physical:
            del given["K_SS"]  # K_zz was meant for the other channel
        if channel == "y" and "l_S" in given:
            given["l_S"] += outer / m
        try:
            coefficients = from_physical(H, m, given)
        except ValueError as e:
            axes = "I, O, S = " + ("x, y, z" if channel == "x" else "y, -x, z")
            raise ValueError(f"{channel} channel ({axes}): {e}") from e
        for n, v in coefficients.items():
            out[name_2dof(channel, n)] = v * sign_2dof(channel, n)
    unknown = sorted(physical.keys() - used)
    if unknown:
        raise ValueError(f"physical quantity '{unknown[0]}' unknown for a two-degree-of-freedom gyro")
    return out


def to_physical(H: float, m: float, coefficients: Mapping[str, float]) -> dict[str, float]:
    """Return the inverse of :func:`from_physical`; D_O and D_OO have no physical form and are refused unless
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


def merge(coefficients: Mapping[str, float], H: float, m: float, physical: Mapping[str, float]) -> dict[str, float]:
    """Return the coefficients given partly as D's and partly in physical form; one given in both forms is refused."""
    derived = from_physical(H, m, physical) if physical else {}
    twice = sorted(derived.keys() & coefficients.keys())
    if twice:
        raise ValueError(f"{', '.join(twice)}: given as coefficient and by physical quantities; give one of the two")
    return {n: {**coefficients, **derived}[n] for n in NAMES if n in coefficients or n in derived}


#: The standard gyro, rad/s per g0^n.  R = 0.3, U_z = 0.9, U_x = -0.7 deg/h(/g), K_zz-K_xx = 0.15, K_zx =
#: 0.05, K_xz = 0.04, K_zy = 0.03, K_xy = -0.02 deg/h/g2 in torque sign (ranges of Hu 1981)
#: turned into precession sign; D_O = 0.1 deg/h/g is empirical (no rigid-body cause); D_OO = 0.
STANDARD: dict[str, float] = {
    n: v * DPH
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
