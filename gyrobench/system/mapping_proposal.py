"""A first mapping of an FMU into a socket, from names, units and descriptions: lines of TOML, each with its reason.

A connector is proposed the variable (or the array, or the run of variables of one kind) of its causality that scores
best: a declared unit of its dimension counts most, then likeness of names, then words that its description shares with
the connector's meaning.  What is unsure, units and signs above all, is said in comments: the user decides.
"""

from __future__ import annotations

import difflib
import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gyrobench import units
from gyrobench.system.connectors import Connector, Socket
from gyrobench.system.fmu_variables import Variable, variables

SAME_DIMENSION, SAME_NAME, LIKE, WORDS = 3.0, 4.0, 2.0, 1.5
ENOUGH = 1.5  # score below which nothing is proposed
#: letters and words that engineers use for the quantities of connectors and parameters, by the start of the name
USUAL = {
    "omega": ("w", "rate", "gyr", "omega", "ang_vel"),
    "alpha": ("alpha", "ang_acc"),
    "f": ("acc", "a", "sf", "force", "load"),
    "i": ("i", "cur", "current", "torque"),
    "u": ("u", "v", "pickoff", "signal", "sg"),
    "angle": ("angle", "phi", "theta", "pos"),
    "k": ("k", "scale", "torquer", "sf"),
    "K_sg": ("pickoff", "sens", "sg"),
    "D_F": ("bias", "fixed"),
    "H": ("momentum",),
}


@dataclass(frozen=True)
class Proposal:
    """Lines of a mapping file for one connector; found: variables of the FMU are named in them."""

    connector: Connector
    lines: tuple[str, ...]
    found: bool


def dimension(unit: str, declared: Mapping[str, Any]) -> tuple[Any, ...] | None:
    """Return the exponents of a unit, by the FMU or by its name; None where it is not understood."""
    definition = declared.get(unit)
    if definition is not None and definition.baseUnit is not None:
        return tuple(int(getattr(definition.baseUnit, s) or 0) for s in units.BASE)
    try:
        return tuple(units.unit(unit).exponents)
    except units.UnitError:
        return None


def _common(names: Sequence[str]) -> str:
    same = itertools.takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
    return "".join(letters[0] for letters in same)


def _stem(names: Sequence[str]) -> str:
    """Return what names of components have in common, as "ACC_#"; empty where they are not those of one vector."""
    head = _common(names)
    tail = _common([n[len(head) :][::-1] for n in names])[::-1]
    parts = [n[len(head) : len(n) - len(tail)] for n in names]
    tell = all(parts) and not any(re.search(r"[_.\]]", x) for x in parts)
    return f"{head}#{tail}" if tell and head + tail else ""


def _groups(free: Sequence[Variable], n: int) -> list[list[Variable]]:
    """Return the scalars, or the runs of n successive variables that are one vector by their names."""
    if n == 1:
        return [[v] for v in free]
    runs = [list(free[k : k + n]) for k in range(len(free) - n + 1)]
    return [run for run in runs if len({(v.unit, v.kind) for v in run}) == 1 and _stem([v.name for v in run])]


def likeness(c: Connector, group: Sequence[Variable], declared: Mapping[str, Any]) -> float:
    """Return how much names, units and descriptions speak for variables of an FMU to be a connector."""
    first = group[0]
    own = re.sub(r"[#\[\]_]", "", _stem([v.name for v in group]) if len(group) > 1 else first.name).lower()
    name = c.name.lower().replace("_", "")
    score = SAME_NAME if own == name else LIKE * difflib.SequenceMatcher(None, own, name).ratio()
    usual = next((words for start, words in USUAL.items() if c.name == start or c.name.startswith(start + "_")), ())
    score += 1.5 * LIKE if own in usual else LIKE if any(len(w) > 1 and w in own for w in usual) else 0.0
    words = set(re.findall(r"[a-z]{4,}", f"{own} {first.description}".lower()))
    score += WORDS * min(1, len(words & set(re.findall(r"[a-z]{4,}", c.meaning.lower()))))
    if first.unit and c.unit:
        exponents = dimension(first.unit, declared)
        if exponents is not None:
            wanted = tuple(units.unit(c.unit).exponents)
            same = exponents[:-1] == wanted[:-1]  # rad may be left out
            score += SAME_DIMENSION if same else -2.0 * SAME_DIMENSION
    return score


def propose(socket: Socket, description: Any, mapping: Mapping[str, Any] | None = None) -> list[Proposal]:
    """Return lines for the connectors that ``mapping`` does not name and the FMU does not offer under their names.

    Optional connectors are proposed where something fits; required ones always, as comments where nothing does.
    """
    mapping = mapping or {}
    own = variables(description)
    declared = {u.name: u for u in description.unitDefinitions}
    named = {key.split("[")[0] for key in mapping}
    there = [c for c in socket.connectors if c.name not in named and all(e in own for e in c.elements)]
    wanted = [c for c in socket.connectors if c.name not in named and c not in there]
    used = {e for c in there for e in c.elements} | _named_variables(mapping, own)
    free = {
        causality: [
            v
            for v in own.values()
            if v.causality == causality and v.kind in ("Real", "Integer", "Boolean") and v.name not in used
        ]
        for causality in ("input", "output")
    }
    offers = [
        (likeness(c, group, declared) - (0.5 if c.optional else 0.0), -order, c, group)
        for order, c in enumerate(wanted)
        for group in _groups(free[c.causality], len(c.elements))
        if all(v.kind == "Real" or c.whole for v in group) and not (c.unit == "1" and group[0].unit not in ("", "1"))
    ]
    taken: dict[str, list[Variable]] = {}
    for score, _, c, group in sorted(offers, key=lambda o: (o[0], o[1]), reverse=True):
        enough = ENOUGH + SAME_DIMENSION if c.optional else ENOUGH
        if score >= enough and c.name not in taken and not any(v in g for g in taken.values() for v in group):
            taken[c.name] = group
    taken |= _only_ones_left([c for c in wanted if not c.optional and c.name not in taken], free, taken, declared)
    found = [_lines(c, taken[c.name]) for c in wanted if c.name in taken]
    return found + [_missing(c) for c in wanted if c.name not in taken and not c.optional]


def _only_ones_left(
    wanted: Sequence[Connector],
    free: Mapping[str, Sequence[Variable]],
    taken: Mapping[str, Sequence[Variable]],
    declared: Mapping[str, Any],
) -> dict[str, list[Variable]]:
    """Return the connector that alone is left of its causality, with the variables that alone are left for it.

    Whatever their names, unless a unit speaks against them.
    """
    found = {}
    for causality, variables_of_it in free.items():
        lacking = [c for c in wanted if c.causality == causality]
        left = [v for v in variables_of_it if not any(v in g for g in taken.values())]
        if len(lacking) != 1 or len(left) != len(lacking[0].elements):
            continue
        (c,) = lacking
        of_kind = all(v.kind == "Real" or c.whole for v in left)
        if of_kind and all(_dimension_fits(v.unit, c.unit, declared) for v in left):
            found[c.name] = left
    return found


def _dimension_fits(unit: str, wanted: str, declared: Mapping[str, Any]) -> bool:
    own = dimension(unit, declared) if unit else None
    return own is None or not wanted or own[:-1] == tuple(units.unit(wanted).exponents)[:-1]


def _named_variables(mapping: Mapping[str, Any], own: Mapping[str, Variable]) -> set[str]:
    names: set[str] = set()
    for entry in mapping.values():
        if isinstance(entry, str):
            entry = {"name": entry}
        if isinstance(entry, Mapping):
            given = [entry.get("name"), *(entry.get("names") or ())]
            names |= {n for n, v in own.items() if n in given or v.array in given}
    return names


def _list(names: Sequence[str]) -> str:
    return "[" + ", ".join(f'"{n}"' for n in names) + "]"


def _lines(c: Connector, group: Sequence[Variable]) -> Proposal:
    first = group[0]
    if len(group) == first.size and all(v.array == first.array for v in group):
        line = f'name = "{first.array}"'
    elif len(group) > 1:
        line = f"names = {_list([v.name for v in group])}"
    else:
        line = f'name = "{first.name}"'
    unit = f"in {first.unit}, as the FMU declares" if first.unit else ""
    what = "; ".join(x for x in (first.description, unit) if x)
    lines = [f"[{c.name}]{' ' * max(1, 24 - len(c.name))}# {c.meaning}", line + (f"  # {what}" if what else "")]
    if c.unit not in ("", "1") and not first.unit and first.kind == "Real":
        others = [u for u in units.fitting(c.unit) if u != c.unit]
        lines.append(f'unit = "{c.unit}"  # the FMU declares none: check it; {", ".join(others[:4])}')
    return Proposal(c, tuple(lines), True)


def _missing(c: Connector) -> Proposal:
    unit = f", {c.unit}" if c.unit else ""
    if c.causality == "output":
        remedy = "name the FMU's output, or state the value that it stands for"
    else:
        remedy = "name the FMU's input; if it has none, state the value at which it works"
    names = f"names = {_list(['...'] * len(c.elements))}" if c.shape else 'name = "..."'
    lines = (f"# [{c.name}]  # {c.meaning}{unit}: {remedy}", f"# {names}", "# constant = 0")
    return Proposal(c, lines, False)


def undeclared(description: Any) -> list[str]:
    """Return the comment on outputs without declared dependencies; empty where all declare them."""
    known = {u.variable.name for u in description.outputs if u.variable is not None and u.dependencies is not None}
    without = [v.name for v in description.modelVariables if v.causality == "output" and v.name not in known]
    if not without:
        return []
    return [
        f"# {', '.join(without[:6])}{' ...' if len(without) > 6 else ''}: no dependencies are declared, so each",
        "# counts as following every input at once.  Where an output follows its inputs with the next step only, write",
        "# feedthrough = false under its connector; else a loop through it is refused as algebraic.",
    ]


def mapping_text(socket: Socket, description: Any, head: str, parameters: Sequence[str] = ()) -> str:
    """Return a first mapping file (TOML).  parameters: the lines of its table [parameters]."""
    proposals = propose(socket, description)
    blocks = ["\n".join(p.lines) for p in proposals]
    notes = undeclared(description)
    fits = [] if blocks else ["# Every connector has a variable of its name: no mapping is needed for them."]
    signs = (
        ["# Check units, signs and axes: names do not tell them.  A factor of -1 reverses a sign."] if blocks else []
    )
    ends = ["\n".join(lines) for lines in (notes, parameters) if lines]
    return "\n\n".join(["\n".join([head, *fits, *signs]), *blocks, *ends]) + "\n"
