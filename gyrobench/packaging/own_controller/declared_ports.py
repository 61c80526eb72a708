"""Declarations of a controller in a file of its own: ports, parameters and states, a line each in its comments.

    @input     u             [V]       gyro signal
    @output    v             [V]       voltage of the torque motor
    @parameter K = 2         [1]       gain
    @state     past[2] = 0   [V]       the last two values

NAME or NAME[n], for a parameter or a state its start (one number, or [a, b] for each element), the SI unit in brackets,
and what it is.  The lines are the same in a comment of C and in the docstring of a Python class.
"""

from __future__ import annotations

import difflib
import keyword
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

from gyrobench import units
from gyrobench.component import Component
from gyrobench.user_code import UserCodeError

KINDS = ("input", "output", "parameter", "state")
TAG = re.compile(r"^[\s/*]*@(\w+)\b(.*)$")
DECLARATION = re.compile(
    r"\s*(?P<name>\w+)(?:\[(?P<n>\d+)\])?\s*(?:=\s*(?P<start>\[[^\]]*\]|[^\s\[\]]+))?\s*(?:\[(?P<unit>[^\]]*)\])?(?P<doc>.*)"
)
FOREIGN = {"param", "return", "returns", "brief", "file", "author", "date", "note", "warning", "see"}  # of doxygen
TAKEN = {
    "step", "seed", "Ts", "clock", "held", "tick", "law", "LAW", "vector", "sampled", "Component", "Discrete", "Input",
    "Output", "Parameter", "ControllerClock", "PythonLaw",
}  # fmt: skip
LARGEST = 200  # numbers of a kind


@dataclass(frozen=True)
class Declared:
    """One declaration; n: elements of an array, 0 for a number.  start: of each element."""

    kind: str
    name: str
    n: int
    unit: str
    start: tuple[float, ...]
    doc: str

    @property
    def elements(self) -> list[str]:
        """Return the names of the elements in the language of parts, counted from 0: ``u`` or ``u[0]``, ``u[1]``."""
        return [f"{self.name}[{k}]" for k in range(self.n)] or [self.name]

    @property
    def shown(self) -> list[str]:
        """Return the names of the elements as the bench writes them, counted from 1."""
        return [f"{self.name}[{k + 1}]" for k in range(self.n)] or [self.name]


@dataclass(frozen=True)
class Declarations:
    """All of a file, in the order of their lines."""

    items: tuple[Declared, ...]

    def of(self, kind: str) -> list[Declared]:
        return [d for d in self.items if d.kind == kind]

    def shown(self, kind: str) -> list[str]:
        """Return the names of all numbers of a kind, in their order in the array that the controller gets."""
        return [e for d in self.of(kind) for e in d.shown]


def read_declarations(lines: Iterable[tuple[int, str]], file: str) -> Declarations:
    """Return what numbered lines declare.  Raises UserCodeError with file, line and what to write instead."""
    items: list[Declared] = []
    for number, line in lines:
        tag = TAG.match(line)
        if tag is None:
            continue
        where = f"{file}:{number}: @{tag[1]}"
        if tag[1] in KINDS:
            items.append(_declared(tag[1], tag[2].removesuffix("*/"), where))
            if any(d.name == items[-1].name for d in items[:-1]):
                raise UserCodeError(f"{where} {items[-1].name}: declared twice")
        elif tag[1] not in FOREIGN and (near := difflib.get_close_matches(tag[1], KINDS, n=1, cutoff=0.7)):
            raise UserCodeError(f"{where}: did you mean @{near[0]}? there are: {', '.join('@' + k for k in KINDS)}")
    found = Declarations(tuple(items))
    if not found.of("output"):
        raise UserCodeError(
            f"{file}: no output is declared; write a line for each in a comment: @output v [V] voltage of the motor"
        )
    for kind in KINDS:
        if (many := len(found.shown(kind))) > LARGEST:
            raise UserCodeError(f"{file}: {many} numbers in @{kind}; {LARGEST} are allowed")
    return found


def _declared(kind: str, text: str, where: str) -> Declared:
    m = DECLARATION.fullmatch(text)
    example = f"@{kind} {'K = 2 [1] gain' if kind == 'parameter' else 'u [V] what it is'}"
    if m is None or not m["name"].isidentifier():
        raise UserCodeError(f"{where}{text.rstrip()}: not a declaration; write for example {example}")
    name, where = m["name"], f"{where} {m['name']}"
    if name in TAKEN or name.startswith("clock_") or hasattr(Component, name) or keyword.iskeyword(name):
        raise UserCodeError(f"{where}: the name is taken; choose another")
    if m["unit"] is None:
        raise UserCodeError(f"{where}: its unit is missing; write {example} ([1] for a plain number)")
    n = int(m["n"] or 0)
    if m["n"] == "0":
        raise UserCodeError(f"{where}[0]: an array has one element or more")
    if m["start"] is not None and kind in ("input", "output"):
        raise UserCodeError(f"{where} = {m['start']}: only parameters and states have a start")
    if m["start"] is None and kind == "parameter":
        raise UserCodeError(f"{where}: its value is missing; write {example}")
    start = _numbers(m["start"] or "0", max(n, 1), where)
    return Declared(kind, name, n, _si(m["unit"].strip(), where), start, m["doc"].strip() or name)


def _numbers(text: str, n: int, where: str) -> tuple[float, ...]:
    try:
        values = [float(x) for x in text.strip("[]").split(",")]
    except ValueError:
        raise UserCodeError(f"{where} = {text}: not a number in SI, nor a list [a, b] of them") from None
    if not all(map(math.isfinite, values)):
        raise UserCodeError(f"{where} = {text}: must be finite")
    if len(values) not in (1, n):
        raise UserCodeError(f"{where} = {text}: {len(values)} numbers for {n}")
    return tuple(values * n if len(values) == 1 else values)


def _si(name: str, where: str) -> str:
    """Return a unit of SI by its name.  Raises UserCodeError for one that is not known, or is a multiple."""
    try:
        of = units.unit(name)
    except units.UnitError as error:
        raise UserCodeError(f"{where}: {error}") from None
    if of.factor != 1.0 or of.offset != 0.0:
        fits = [u for u in units.fitting(name) if units.unit(u).factor == 1.0 and units.unit(u).offset == 0.0]
        raise UserCodeError(f"{where}: [{name}] is not SI; a controller computes in SI: write [{min(fits, key=len)}]")
    return name
