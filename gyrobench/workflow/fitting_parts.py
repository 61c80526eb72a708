"""Which parts of a bench fit into which slots, from their declarations: nothing is built."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from gyrobench.bench import Bench
from gyrobench.component import Component, Noise, Parameter
from gyrobench.component.declarations import Declaration
from gyrobench.packaging import load_part
from gyrobench.packaging.description import ATTRIBUTES, TYPES, number, unit_name
from gyrobench.system.binding import SocketMismatchError, fit
from gyrobench.system.sockets import Socket, socket
from gyrobench.system.system import System


def declared_description(part: type[Component]) -> Any:
    """Return what :func:`gyrobench.system.binding.fit` reads of the model description of a part, without its FMU."""
    found = []
    for s in part.layout:
        start = number(s.start, s.decl.type) if s.section in ("parameter", "input", "state") else None
        real = TYPES[s.decl.type] == "Real"
        found.append(
            SimpleNamespace(
                name=s.name, causality=ATTRIBUTES[s.section][0], variability=ATTRIBUTES[s.section][1],
                type=TYPES[s.decl.type], shape=(), declaredType=None, valueReference=s.reference, start=start,
                unit=unit_name(s) if real else None, quantity=s.decl.quantity if real else None,
                description=s.decl.doc, alias=None,
            )
        )  # fmt: skip
    return SimpleNamespace(modelName=part.__name__, modelVariables=found, unitDefinitions=[])


def mismatch(wanted: Socket, part: type[Component], slot: str = "") -> list[str]:
    """Return why a part does not fit a socket; nothing where it fits."""
    declared = {d.name for d in part.declarations.values()}
    missing = [c.name for c in wanted.connectors if not c.optional and c.name not in declared]
    if missing:  # said at once: most parts lack most connectors of a socket
        return [f"{wanted.name}.{name}: the part has no such variable" for name in missing]
    try:
        fit(wanted, declared_description(part), None, slot)
    except SocketMismatchError as error:
        return list(error.problems)
    return []


def load_parts(bench: Bench) -> dict[str, type[Component]]:
    """Return the parts of a bench that load, by name."""
    found = {}
    for name in bench.parts():
        try:
            found[name] = load_part(name, bench.folder)
        except Exception:  # of the user's code: the part itself says what is wrong when it is built
            continue
    return found


def fitting_parts(system: System, parts: Mapping[str, type[Component]]) -> dict[str, list[str]]:
    """Return the parts that fit each slot, those on request too; the slot's own part first."""
    found, every = {}, tuple(parts.items())
    for name, slot in system.all_slots().items():
        wanted = socket(slot.socket).standing_for(slot.quantities)
        found[name] = [slot.part, *(n for n in _fitting(wanted, every) if n != slot.part)]
    return found


@functools.lru_cache(maxsize=512)
def _fitting(wanted: Socket, parts: tuple[tuple[str, type[Component]], ...]) -> tuple[str, ...]:
    return tuple(n for n, p in parts if not mismatch(wanted, p))


def settable(part: type[Component]) -> dict[str, Declaration]:
    """Return the parameters of a part and the sizes of its noises, by name."""
    return {n: d for n, d in part.declarations.items() if isinstance(d, Parameter | Noise)}


def part_of(bench: Bench, name: str) -> type[Component] | None:
    """Return a part of the bench by name; None for an FMU file."""
    return None if name.endswith(".fmu") or Path(name).suffix else load_part(name, bench.folder)
