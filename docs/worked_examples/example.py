"""A worked number of a source beside what the bench gives, and what follows from both."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any

from gyrobench.bench import standard_folder
from gyrobench.packaging import load_part
from gyrobench.system.system import load_system

NUMBER = re.compile(r"([<>≈]?)\s*(-?[\d.]+)(?:e([+-]?\d+))?")


class ContradictionError(Exception):
    """What is said of a number does not follow from it: the page cannot be made."""


@dataclass(frozen=True)
class Example:
    """place: chapter, equation or table.  printed: as it stands there; <, >: a bound, ≈: one digit less is meant.

    by: what computed ``found``, in the unit of ``printed``; nan where nothing can be computed.
    erratum: its id, with ``right`` what the errata page puts in the place of ``printed`` ("": only an input is
    misprinted, and with the right one the printed number comes out).  why: reason of a number that does not come out.
    within: what the rounding of the printed numbers that ``found`` is made of leaves open, in its unit.
    """

    place: str
    what: str
    printed: str
    unit: str
    by: str
    found: float
    erratum: str = ""
    right: str = ""
    why: str = ""
    within: float = 0.0

    def verdict(self) -> str:
        """Return the last column.  Raises ContradictionError where the numbers say something else."""
        agrees = compare(self.printed, self.found, self.within)
        if self.why:
            if agrees:
                raise ContradictionError(f"{self.place}, {self.what}: said not to come out, but it does")
            return f"not reproducible: {self.why}"
        if self.right:
            if agrees or not compare(self.right, self.found, self.within):
                raise ContradictionError(f"{self.place}, {self.what}: {self.found:.6g} is not {self.right}")
            return f"misprint {self.erratum}: {self.right}"
        if not agrees:
            raise ContradictionError(f"{self.place}, {self.what}: {self.found:.6g} for {self.printed}, unexplained")
        return f"{agrees}, input {self.erratum}" if self.erratum else agrees


def compare(printed: str, found: float, within: float = 0.0) -> str:
    """Return "agrees", "agrees, cut off" (within one unit of the last digit, as a number that is cut and not rounded)
    or "" for another number."""
    match = NUMBER.fullmatch(printed.replace("\N{MINUS SIGN}", "-"))
    if match is None or not math.isfinite(found):
        return ""
    relation, digits, power = match[1], match[2], int(match[3] or 0)
    value = float(digits) * 10.0**power
    if relation in ("<", ">"):
        return "agrees" if (found < value if relation == "<" else found > value) else ""
    unit = 10.0 ** (power - len(digits.partition(".")[2]))
    off = abs(found - value) / unit
    if off <= (1.0 if relation == "≈" else 0.5) + 1e-6 + within / unit:
        return "agrees"
    cut = len(digits.replace(".", "").strip("-0")) > 1 and off < 1.0 and abs(found) > abs(value)
    return "agrees, cut off" if cut else ""


@cache
def room(system: str, module: str) -> Any:
    """Return a module of a system's folder."""
    return import_module(f".{module}", type(load_system(system)).__module__)


def part(name: str, *, of: Callable[[Any], float], step: float = 1e-6, **values: Any) -> float:
    """Return ``of(part)`` after one step; ``values``: parameters and inputs."""
    made = load_part(name, standard_folder())
    inputs = {n: v for n, v in values.items() if n in INPUTS.get(name, ())}
    one = made(**{n: v for n, v in values.items() if n not in inputs})
    for n, v in inputs.items():
        setattr(one, n, v)
    one.initialize()
    one.do_step(0.0, step)
    return float(of(one))


INPUTS = {"bearing_air": ("rate", "angle"), "inductosyn": ("rate", "angle")}
