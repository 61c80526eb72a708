"""Sentences with coefficients in them, whose numbers are those of the result in the end.

    Sentence("Constant drift D_F = {D_F}.", coefficients)

A name in braces is printed with its expanded uncertainty; what the communication step does to u is found after the
reduction, so :func:`gyrobench.reduction.estimation.verdict.conclude` puts the numbers in once more.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace

from gyrobench.result import Coefficient, Result

ROUNDING = 1e-9  # of an estimate: a smaller U is that of data without noise
SAID = {"arcsec": "″", "1e-6": "ppm"}  # units as a sentence has them
SUPERSCRIPT = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
ONE_SIDED = 0.1  # of its width: how far the middle of an interval is off its estimate, and it is written by its ends
PLAIN = 6  # digits before the decimal sign that are written without a power of ten, as in tables
FIELD = re.compile(r"\{(-?)([^{}]+)\}")


def p_text(p: float) -> str:
    """Return a probability as the tables write it: "p < 0.001" or "p = 0.23"."""
    return "p < 0.001" if p < 0.001 else f"p = {plain(p)}"


def plain(x: float, digits: int = 2, sign: str = "") -> str:
    """Return "1.7", "190", "1.7·10⁷": a number with so many digits, a large one as tables write it; sign: "+"."""
    text = f"{x:{sign}.{digits}g}"
    number, large, power = text.partition("e+")
    if not large:
        return text
    return f"{float(text):{sign}.0f}" if int(power) < PLAIN else f"{number}·10{str(int(power)).translate(SUPERSCRIPT)}"


def seconds(t: float, digits: int = 3) -> str:
    """Return "15.4 s", "13510 s"."""
    return f"{plain(t, digits)} s"


def _is_uncertain(c: Coefficient) -> bool:
    """Return whether a coefficient has an uncertainty that is more than rounding."""
    return ROUNDING * abs(c.estimate) < c.k * c.u < math.inf


def plus_minus(c: Coefficient) -> str:
    """Return "−0.3001 ± 0.0023 °/h (95 %)": estimate and expanded uncertainty, two digits; the two ends, "0.19 (0.00
    to 1.72) °/h (95 %)", of an interval that lies to one side of the estimate.

    Six digits of an estimate whose uncertainty is rounding.
    """
    U = c.k * c.u
    if not _is_uncertain(c):
        return f"{c.estimate:.6g} {c.unit}".replace("-", "−")
    digits = 1 - math.floor(math.log10(U))

    def rounded(x: float) -> str:
        return f"{round(x, digits) + 0.0:.{max(0, digits)}f}"  # no negative zero

    low, high = c.interval
    one_sided = abs(low + high - 2.0 * c.estimate) > ONE_SIDED * (high - low)
    size = f"({rounded(low)} to {rounded(high)})" if one_sided else f"± {rounded(U)}"
    return f"{rounded(c.estimate)} {size} {c.unit} (95 %)".replace("-", "−")


class Sentence(str):
    """A sentence with numbers, and the template that they were put in; a copy is plain text."""

    template: str

    def __reduce__(self) -> tuple[type[str], tuple[str]]:
        return str, (str(self),)

    def __new__(cls, template: str, coefficients: Sequence[Coefficient]) -> Sentence:
        """Put coefficients into a template: {name}, or {-name} for the value with the other sign."""
        known = {c.name: c for c in coefficients}
        texts = {m[0]: with_u(known[m[2]], negated=bool(m[1])) for m in FIELD.finditer(template)}
        uncertain = [m[0] for m in FIELD.finditer(template) if _is_uncertain(known[m[2]])]
        if uncertain:  # said once, behind the last of them
            texts[uncertain[-1]] += " (95 %)"
        made = super().__new__(cls, FIELD.sub(lambda m: texts[m[0]], template))
        made.template = template
        return made


def with_u(c: Coefficient, negated: bool = False) -> str:
    """Return "10.151 ± 0.046 Hz"; six digits of an estimate without u; whether it may be zero."""
    low, high = c.interval
    zero = ", not distinguishable from zero" if low <= 0.0 <= high and low < high else ""
    shown = replace(c, unit=SAID.get(c.unit, c.unit))
    if negated:
        shown = replace(shown, estimate=-c.estimate, interval=(-high, -low))
    text = plus_minus(shown).removesuffix(" (95 %)")
    return re.sub(r" (?=[°″′]$)| 1$", "", text) + zero


def told(coefficients: Sequence[Coefficient], *templates: str) -> list[str]:
    """Return the sentences of whose coefficients all have a value; none of ""."""
    measured = {c.name for c in coefficients if not c.no_value}
    return [Sentence(t, coefficients) for t in templates if t and measured >= {name for _, name in FIELD.findall(t)}]


def renewed(result: Result) -> list[str]:
    """Return the summary of a result with its present estimates and uncertainties in the sentences."""
    return [Sentence(s.template, result.coefficients) if isinstance(s, Sentence) else s for s in result.summary]
