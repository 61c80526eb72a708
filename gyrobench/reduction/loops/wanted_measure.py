"""A wanted measure of a loop as a person writes it: "phase margin=40deg", "peak S<6dB"; SI, ratios as factors."""

from __future__ import annotations

import re
from collections.abc import Callable

from gyrobench import units
from gyrobench.bench import UsageError

FACTOR = ""  # unit of a ratio of amplitudes: a number, or dB


def wanted_measure(
    text: str, kind: Callable[[str, str], tuple[str, bool]], known: str
) -> tuple[str, float, str, bool]:  # fmt: skip
    """Return name, value, unit and whether more is better.  Raises UsageError.

    kind: text and name of a measure -> its unit and whether more is better; known: all of them, as text.
    """
    found = re.fullmatch(r"\s*([^<>=]+?)\s*(<=|>=|<|>|=)\s*(.+?)\s*", text)
    if not found:
        raise UsageError(f'--want {text}: write MEASURE=VALUE, for example "phase margin=40deg"; there are: {known}')
    name, sign, value = " ".join(found[1].split()), found[2], found[3]
    unit, least = kind(text, name)
    if sign[0] in "<>" and (sign[0] == ">") is not least:
        better, right = ("more", ">") if least else ("less", "<")
        raise UsageError(f"--want {text}: of {name} {better} is better; write {right} or =")
    return name, _factor(text, value) if unit == FACTOR else positive(text, value, unit), unit, least


def positive(text: str, value: str, unit: str) -> float:
    """Return a number above 0, SI.  Raises UsageError."""
    try:
        number = units.parse_quantity(value, unit)
    except units.UnitError as error:
        raise UsageError(f"--want {text}: {error}") from None
    if not number > 0.0:
        raise UsageError(f"--want {text}: must be above 0")
    return number


def _factor(text: str, value: str) -> float:
    """Return a ratio of amplitudes, given as a factor or in dB."""
    bare = value.removesuffix("dB").strip()
    try:
        number = units.parse_quantity(bare, "1")
    except units.UnitError:
        raise UsageError(f"--want {text}: a factor, or dB, is expected, such as 2 or 6dB") from None
    factor = 10.0 ** (number / 20.0) if value.endswith("dB") else number
    if not factor > 0.0:
        raise UsageError(f"--want {text}: must be > 0 as a factor; did you mean dB?")
    return factor
