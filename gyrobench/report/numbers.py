"""Text of numbers: the one place where HTML and PDF get their digits from.

An estimate is rounded to the second significant digit of its standard uncertainty; the uncertainty
itself to two significant digits.  Where there is no uncertainty, four significant digits.  The full
value travels beside the rounded one (:class:`FormattedNumber`), so that a reader, and a test, can go from
the page back to ``result.json``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

MINUS = "\N{MINUS SIGN}"
NOTHING = "\N{EN DASH}"  # stands where there is no number; never "0" and never "nan"
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class FormattedNumber:
    """A number as it stands on the page, cut at its decimal sign, with the full value behind it."""

    whole: str  # "−12"
    rest: str  # ".345", "" or ".2·10⁻⁷"
    full: str  # repr of the float; "" where there is no number

    @property
    def text(self) -> str:
        return self.whole + self.rest


def decimals(u: float) -> int:
    """Return the digits after the decimal sign that show ``u`` with two significant digits (negative: tens ...)."""
    return 1 - int(f"{abs(u):.1e}".split("e")[1])


def write_number(
    value: float | int | None, u: float | None = None, significant: int = 4, trim: bool = True
) -> FormattedNumber:
    """Round ``value`` to the second significant digit of ``u``, or to ``significant`` digits without one.

    ``u`` that is None, zero or not finite counts as none.  A value that is None or not finite gives a
    dash.  Very small and very large numbers are written with a power of ten, unless a number of at
    most six decimals (nine from 0.01 on) would do.
    """
    if value is None or isinstance(value, str) or not math.isfinite(value):
        return FormattedNumber(NOTHING, "", "")
    full = repr(int(value)) if isinstance(value, bool | int) else repr(float(value))
    if isinstance(value, int):
        return FormattedNumber(str(value).replace("-", MINUS), "", full)
    digits: int | None = None
    if u is not None and math.isfinite(u) and u != 0.0:
        digits = decimals(u)
        size = max(abs(value), abs(u))
        significant = max(1, digits + _exponent(size) + 1)
        if (digits <= 6 or (digits <= 9 and size >= 0.01)) and size < 1e7:
            return _fixed(value, digits, full)
        return _power(value, significant, _exponent(size), full)
    if value == 0.0:
        return FormattedNumber("0", "", full)
    exponent = _exponent(float(f"{value:.{significant - 1}e}"))
    if -4 <= exponent < 6:
        return _fixed(value, significant - 1 - exponent, full, trim or value.is_integer())
    return _power(value, significant, exponent, full, trim)


def minus(text: str) -> str:
    """Return a number's text with the sign of print."""
    return text.replace("-", "−")


def write_p(p: float | None) -> FormattedNumber:
    """Return a probability: three decimals, or "< 0.001"."""
    if p is None or not math.isfinite(p):
        return FormattedNumber(NOTHING, "", "")
    if p < 0.001:
        return FormattedNumber("< 0", ".001", repr(float(p)))
    return _fixed(p, 3, repr(float(p)))


def superscript(number: int) -> str:
    """-6 as ⁻⁶."""
    return str(number).translate(_SUPERSCRIPT)


def _exponent(value: float) -> int:
    return math.floor(math.log10(abs(value))) if value else 0


def _fixed(value: float, digits: int, full: str, strip: bool = False) -> FormattedNumber:
    rounded = round(value, digits)
    text = f"{rounded + 0.0:.{max(digits, 0)}f}"  # + 0.0: no negative zero
    if rounded == 0.0:
        text = text.lstrip("-")
    whole, dot, rest = text.partition(".")
    if strip and dot:
        rest = rest.rstrip("0")
        dot = "." if rest else ""
    return FormattedNumber(whole.replace("-", MINUS), dot + rest, full)


def _power(value: float, significant: int, exponent: int, full: str, strip: bool = False) -> FormattedNumber:
    mantissa = _fixed(value / 10.0**exponent, significant - 1, full, strip)
    if mantissa.text == "0":
        return mantissa
    return FormattedNumber(mantissa.whole, f"{mantissa.rest}·10{superscript(exponent)}", full)
