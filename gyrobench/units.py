"""Units: the one place where a unit name becomes a number.

Inside the bench every quantity is SI; degrees per hour, arc seconds, gram-force centimetres and milliamperes
exist only at the surface.  A unit name is a product of symbols: ``rad/s/A``, ``kg.m2``, ``rad/s/sqrt(Hz)``,
``deg/h/g2``.  ``.``, ``*`` or a blank multiplies, ``/`` divides by the next symbol only, a trailing integer is a
power, ``sqrt( )`` halves the powers.  The printed forms (``°/h/g²``) are read too.

The symbol ``g`` is the acceleration g0 = 9.80665 m/s2 ("per g").  Two old composites of the textbooks, where
g is something else, are symbols of their own: ``g.cm`` (gram-force centimetre, torque) and ``g.cm2`` (gram
times square centimetre, moment of inertia).  Radian counts as a base unit, as in FMI: ``Hz`` and ``rad/s`` do
not convert.

Not modelled: logarithmic units; offsets in composites (``degC/m`` is a difference, so ``K/m``).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any

from gyrobench.errors import GyrobenchError
from gyrobench.reading import shorten

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")  #: base units in the order of FMI's BaseUnit attributes
G0 = 9.80665  #: standard acceleration, m/s2; "per g" means per this
EARTH_RATE = 7.2921159e-5  #: rad/s; the unit ERU
DEG = math.pi / 180.0
ARCMIN = math.pi / 10800.0  #: rad
ARCSEC = math.pi / 648000.0  #: rad
DPH = math.pi / 648000.0  #: 1 deg/h in rad/s


class UnitError(GyrobenchError, ValueError):
    """A unit that is unknown or does not fit; the message says what would fit."""


@dataclass(frozen=True)
class Unit:
    """``value_SI = factor * value + offset``; ``exponents`` follow :data:`BASE` (halves occur with sqrt)."""

    name: str
    factor: float
    offset: float
    exponents: tuple[Fraction, ...]

    @cached_property
    def dimension(self) -> str:
        """The SI unit of the same dimension, spelled out: ``kg.m2/s``."""
        up = [_power(b, e) for b, e in zip(BASE, self.exponents, strict=True) if e > 0]
        down = [_power(b, -e) for b, e in zip(BASE, self.exponents, strict=True) if e < 0]
        return "/".join([".".join(up) or "1", *down])


def _power(symbol: str, e: Fraction) -> str:
    if e.denominator == 2:
        inner = symbol if e.numerator == 1 else f"{symbol}{e.numerator}"
        return f"sqrt({inner})"
    return symbol if e == 1 else f"{symbol}{e}"


def _dim(**powers: int) -> tuple[Fraction, ...]:
    return tuple(Fraction(powers.get(b, 0)) for b in BASE)


_TABLE: dict[str, tuple[float, tuple[Fraction, ...]]] = {}


def _define(dimension: tuple[Fraction, ...], **symbols: float) -> None:
    _TABLE.update({name: (factor, dimension) for name, factor in symbols.items()})


_define(_dim(kg=1), kg=1.0, lb=0.45359237)
_define(_dim(m=1), m=1.0, km=1e3, cm=1e-2, mm=1e-3, um=1e-6, nm=1e-9, inch=0.0254, ft=0.3048)
_define(_dim(s=1), s=1.0, ms=1e-3, us=1e-6, ns=1e-9, min=60.0, h=3600.0, day=86400.0)
_define(_dim(A=1), A=1.0, mA=1e-3, uA=1e-6, nA=1e-9)
_define(_dim(K=1), K=1.0, mK=1e-3)
_define(_dim(mol=1), mol=1.0)
_define(_dim(cd=1), cd=1.0)
_define(_dim(rad=1), rad=1.0, mrad=1e-3, urad=1e-6, deg=DEG, arcmin=DEG / 60, arcsec=DEG / 3600, rev=2 * math.pi)
_define(_dim(rad=1, s=-1), ERU=EARTH_RATE, mERU=EARTH_RATE * 1e-3, rpm=2 * math.pi / 60, dps=DEG, mdps=DEG * 1e-3)
_define(_dim(s=-1), Hz=1.0, kHz=1e3, MHz=1e6, mHz=1e-3)
_define(_dim(m=1, s=-2), g=G0, mg=G0 * 1e-3, ug=G0 * 1e-6, Gal=1e-2, mGal=1e-5)
_define(_dim(kg=1, m=1, s=-2), N=1.0, mN=1e-3, uN=1e-6, gf=G0 * 1e-3, kgf=G0, lbf=0.45359237 * G0)
_define(_dim(kg=1, m=2, s=-2), J=1.0)
_define(_dim(kg=1, m=2, s=-3), W=1.0, mW=1e-3)
_define(_dim(kg=1, m=-1, s=-2), Pa=1.0, hPa=1e2, kPa=1e3)
_define(_dim(kg=1, m=2, s=-3, A=-1), V=1.0, mV=1e-3, uV=1e-6)
_define(_dim(kg=1, m=2, s=-3, A=-2), Ohm=1.0, kOhm=1e3)
_define(_dim(kg=-1, m=-2, s=4, A=2), F=1.0, uF=1e-6, nF=1e-9)
_define(_dim(kg=1, s=-2, A=-1), T=1.0, mT=1e-3, uT=1e-6, gauss=1e-4)
_define(_dim(), ppm=1e-6)
_TABLE["%"] = (0.01, _dim())
_TABLE["g.cm"] = (G0 * 1e-5, _dim(kg=1, m=2, s=-2))
_TABLE["g.cm2"] = (1e-7, _dim(kg=1, m=2))
_OFFSET = {"degC": (1.0, 273.15, _dim(K=1))}  # only alone, never in a composite

#: spellings of loggers, read and never printed
_SPELLED = {"sec": "s", "hr": "h"}
_READ = {
    "℃": "degC",
    "º": "deg",
    "°": "deg",
    "″": "arcsec",
    "′": "arcmin",
    "µ": "u",
    "μ": "u",
    "·": ".",
    "²": "2",
    "³": "3",
    "⁻": "-",
    "¹": "1",
    "Ω": "Ohm",
    "^": "",
    "**": "",
}
_TOKEN = re.compile(r"g\.cm2?(?![A-Za-z])|sqrt\(|[A-Za-z]+|%|-?\d+|[./*()]")


def _clean(name: str) -> str:
    text = name.strip()
    for printed, plain in _READ.items():
        text = text.replace(printed, plain)
    text = re.sub(r"√([A-Za-z]+)", r"sqrt(\1)", text)
    text = re.sub(r"(?<=[A-Za-z0-9)])\s+(?=[A-Za-z])", ".", text)  # m s^-2 is no ms^-2
    return re.sub(r"\s+", "", text)


LARGEST_POWER = 9
LONGEST = 100  # letters of a unit: brackets within brackets have no other bound


@lru_cache(maxsize=1024)
def unit(name: str) -> Unit:
    """The unit called ``name``; raises :class:`UnitError` with the offending symbol when it is not one."""
    if len(name) > LONGEST:
        raise UnitError(f"unit '{shorten(name)}': {len(name)} letters; a unit has at most {LONGEST}")
    text = _clean(name)
    if text in _OFFSET:
        factor, offset, exponents = _OFFSET[text]
        return Unit(name, factor, offset, exponents)
    tokens = _TOKEN.findall(text)
    if "".join(tokens) != text or not text:
        raise UnitError(f"unit '{name}': not a unit; write it like rad/s, kg.m2, deg/h/g2, rad/s/sqrt(Hz), 1 or %")
    factor, powers, rest = _product(tokens, name)
    if rest:
        raise UnitError(f"unit '{name}': '{rest[0]}' is out of place")
    return Unit(name, factor, 0.0, powers)


def _product(tokens: list[str], name: str) -> tuple[float, tuple[Fraction, ...], list[str]]:
    factor, powers = 1.0, list(_dim())
    sign, rest = 1, list(tokens)
    while True:
        f, p, rest = _symbol(rest, name)
        factor = factor * f if sign > 0 else factor / f
        powers = [a + sign * b for a, b in zip(powers, p, strict=True)]
        if not rest or rest[0] == ")":
            return factor, tuple(powers), rest
        if rest[0] not in "./*":
            raise UnitError(f"unit '{name}': '.' or '/' expected before '{rest[0]}'")
        sign, rest = (-1 if rest[0] == "/" else 1), rest[1:]


def _symbol(tokens: list[str], name: str) -> tuple[float, tuple[Fraction, ...], list[str]]:
    if not tokens:
        raise UnitError(f"unit '{name}': a symbol is missing at the end")
    head, rest = _SPELLED.get(tokens[0], tokens[0]), tokens[1:]
    if head in ("sqrt(", "("):
        f, p, rest = _product(rest, name)
        if not rest:
            raise UnitError(f"unit '{name}': ')' is missing")
        rest = rest[1:]
        if head == "sqrt(":
            return math.sqrt(f), tuple(e / 2 for e in p), rest
    elif head == "1":
        return 1.0, _dim(), rest
    elif head in _TABLE:
        f, p = _TABLE[head]
    else:
        near = sorted(s for s in _TABLE if s.lower() == head.lower())
        hint = f"; did you mean {' or '.join(near)}?" if near else f"; known: {', '.join(sorted(_TABLE))}"
        why = " (degC has an offset and stands alone; a difference is K)" if head == "degC" else ""
        raise UnitError(f"unit '{name}': unknown symbol '{head}'{why}{hint}")
    if rest and re.fullmatch(r"-?\d+", rest[0]):
        if abs(n := int(rest[0][:4])) > LARGEST_POWER:
            raise UnitError(f"unit '{name}': power {shorten(rest[0], 20)}; {LARGEST_POWER} is the largest")
        if n == 0:
            known = "; g is the standard acceleration g0" if head == "g" else ""
            raise UnitError(f"unit '{name}': power 0 of '{head}'{known}")
        f, p, rest = f**n, tuple(e * n for e in p), rest[1:]
    return f, p, rest


USUAL = (
    "deg/h", "deg/s", "deg/h/g", "deg/h/g2", "deg/h/mA", "deg/h/sqrt(Hz)", "deg/sqrt(h)", "deg/h/K", "N/m", "N/um",
    "N.m", "N.m/rad", "kg.m2",
)  # fmt: skip


@lru_cache(maxsize=1024)
def fitting(name: str) -> tuple[str, ...]:
    """Units of the same dimension as ``name``: its SI spelling, usual compounds of this trade, single symbols."""
    u = unit(name)
    compounds = [s for s in USUAL if unit(s).exponents == u.exponents]
    single = [*_TABLE.items(), *((s, (f, p)) for s, (f, _, p) in _OFFSET.items())]
    return tuple(dict.fromkeys((u.dimension, *compounds, *(s for s, (_, p) in single if p == u.exponents))))


def same_dimension(a: str, b: str) -> bool:
    """True when values in ``a`` and ``b`` convert into one another."""
    return unit(a).exponents == unit(b).exponents


def convert(value: float, from_: str, to: str) -> float:
    """``value`` in unit ``from_`` expressed in unit ``to``; raises :class:`UnitError` on a wrong
    dimension.
    """
    a, b = unit(from_), unit(to)
    if a.exponents != b.exponents:
        raise UnitError(
            f"'{from_}' ({a.dimension}) does not convert to '{to}' ({b.dimension}); "
            f"units that fit: {', '.join(fitting(to))}"
        )
    if a.offset == b.offset == 0.0:
        return value * (a.factor / b.factor)
    return (value * a.factor + a.offset - b.offset) / b.factor


def factor(name: str) -> float:
    """SI value of one ``name`` (for units without offset)."""
    u = unit(name)
    if u.offset:
        raise UnitError(f"'{name}' has an offset and no single factor; use convert")
    return u.factor


_NUMBER = re.compile(r"([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)", re.S)


def parse_quantity(text: str, to: str, per_g0: bool = False) -> float:
    """``"45.75deg"``, ``"0.3 deg/h"``, ``"2mA"`` or a plain number (SI), as a value in unit ``to``.

    per_g0: the quantity is a coefficient per power of (X, Y, Z) = -f/g0, whose SI unit is written without g;
    then ``0.9deg/h/g`` fits ``rad/s``.  Raises :class:`UnitError` for a non-number, an unknown unit, a wrong
    dimension.
    """
    match = _NUMBER.fullmatch(text.strip())
    if not match or not math.isfinite(float(match[1])):
        raise UnitError(
            f"'{shorten(text)}': a finite number with an optional unit is expected, such as 45.75deg, 0.3deg/h, 2mA"
        )
    value, name = float(match[1]), match[2]
    if comma := re.match(r",\d+", name):
        point = f"{match[1]}.{name[1:]}" if match[1].lstrip("+-").isdecimal() else ""
        said = f"; did you mean {shorten(point)}?" if point else ""
        raise UnitError(f"'{shorten(text.strip())}': a comma ({comma[0]}); the decimal sign is a point{said}")
    if not name:
        target = unit(to)
        return value if target.factor == 1.0 and not target.offset else (value - target.offset) / target.factor
    try:
        if per_g0 and not same_dimension(name, to):
            for power in (1, 2, 3):
                shifted = f"{name}.{'.'.join(['g'] * power)}"
                if same_dimension(shifted, to):
                    return convert(value, shifted, to)
        return convert(value, name, to)
    except UnitError as error:
        raise UnitError(f"'{shorten(text.strip())}': {error}") from None


def base_unit(name: str) -> tuple[dict[str, int], float] | None:
    """Exponents (non-zero ones, keys of FMI's BaseUnit) and factor of ``name``.

    None when FMI cannot express it: its exponents are integers, so ``rad/s/sqrt(Hz)`` has no BaseUnit element
    (the unit is then written by name only).  An offset (degC) is ``unit(name).offset``.
    """
    u = unit(name)
    if any(e.denominator != 1 for e in u.exponents):
        return None
    return {b: int(e) for b, e in zip(BASE, u.exponents, strict=True) if e}, u.factor


_SHOW = [
    (r"\bsqrt\((\w+)\)", r"√\1"),
    (r"\bdeg\b", "°"),
    (r"\barcsec\b", "″"),
    (r"\barcmin\b", "′"),
    (r"\bu(?=[A-Za-z])", "µ"),
    (r"(?<=[A-Za-z])2\b", "²"),
    (r"(?<=[A-Za-z])3\b", "³"),
    (r"\.", "·"),
    (r"\bOhm\b", "Ω"),
]


def display(name: str) -> str:
    """The printed form: ``deg/h/g2`` -> ``°/h/g²``."""
    text = _clean(name)
    for pattern, printed in _SHOW:
        text = re.sub(pattern, printed, text)
    return text


FAST = 0.01  # rad/s; above it rates are shown in degrees a second
#: SI unit -> units of the surface that other tools are offered
OFFERED = {
    "rad": ("deg", "arcmin", "arcsec"), "rad/s": ("deg/s", "deg/h", "ERU"), "rad/s2": ("deg/s2",), "m/s2": ("g", "mg"),
    "A": ("mA",), "N.m": ("g.cm",), "T": ("uT",),
}  # fmt: skip


def shown_in(value: float, unit: str) -> str:
    """Return the unit in which a person reads a value in SI: angles in degrees, rates in deg/h, fast ones in deg/s."""
    if unit == "rad/s":
        return "deg/s" if abs(value) > FAST else "deg/h"
    return {"rad": "deg", "rad/s2": "deg/s2"}.get(unit, unit)


def format_quantity(value: Any, unit: str) -> str:
    """Return a value in SI as a person writes it: angles in degrees, rates in degrees an hour or a second."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list | tuple):
        return f"[{', '.join(format_quantity(v, unit) for v in value)}]"
    if not isinstance(value, int | float) or unit in ("int", "str"):
        return str(value)
    if unit == "rad":
        return f"{convert(value, 'rad', 'deg'):.9g}°"
    if unit == "rad/s":
        name = shown_in(value, unit)
        return f"{convert(value, 'rad/s', name):.9g} {display(name)}"
    return f"{value:g}" if unit == "1" else f"{value:g} {unit}"
