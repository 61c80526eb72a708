"""The numeric form of an assembled system: buffers, value references and gather lists, used by both engines.

All outputs that are needed live in one buffer ``out`` of doubles.  Each part has a slice of it for what is read in
every step (wired or watched), and further slices for what is read only when a row of the channels or of the windows
is due.  A ``VariableGroup`` is one FMI get or set call with its arrays.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gyrobench.system.binding import Bound
from gyrobench.system.wiring import Assembly

KINDS = ("Real", "Integer", "Boolean")


class VariableGroup:
    """The arrays of one fmi2GetXXX or fmi2SetXXX call.

    kind: Real, Integer or Boolean.  values: ctypes array the call reads or writes.  For a get, ``at`` is the place of
    the first value in ``out`` (a Real get writes there directly).  For a set, ``source[j]`` is the place in ``out``
    of value j and ``scaled`` lists the (j, factor) that are not 1.
    """

    def __init__(self, kind: str, references: Sequence[int]) -> None:
        self.kind = kind
        self.n = len(references)
        self.references = (ctypes.c_uint * self.n)(*references)
        self.values: Any = ((ctypes.c_double if kind == "Real" else ctypes.c_int) * self.n)()
        self.at = 0
        self.source: list[int] = []
        self.scaled: list[tuple[int, float]] = []


@dataclass
class PartProgram:
    """The calls of one part in a communication step: sets, doStep, gets; and the outputs read for rows only."""

    slot: str
    sets: list[VariableGroup] = field(default_factory=list)
    gets: list[VariableGroup] = field(default_factory=list)
    channel_gets: list[VariableGroup] = field(default_factory=list)
    window_gets: list[VariableGroup] = field(default_factory=list)


@dataclass
class RecordRow:
    """A row of the record: column names and the places and factors of their values in ``out``."""

    names: list[str] = field(default_factory=list)
    source: list[int] = field(default_factory=list)
    gain: list[float] = field(default_factory=list)


@dataclass
class Program:
    """Everything an engine needs; parts in execution order."""

    parts: list[PartProgram]
    out: np.ndarray[Any, np.dtype[np.float64]]
    channel: RecordRow
    window: RecordRow
    watch: int  # place in out, -1: none
    done: int

    @property
    def order(self) -> list[str]:
        """Slots in execution order."""
        return [p.slot for p in self.parts]


def _needed(names: Iterable[tuple[str, Bound]]) -> dict[str, dict[int, Bound]]:
    """Return the variables by slot, each once."""
    by_slot: dict[str, dict[int, Bound]] = {}
    for slot, b in names:
        by_slot.setdefault(slot, {})[_key(b)] = b
    return by_slot


def _key(b: Bound) -> int:
    return b.reference * 3 + KINDS.index(b.kind)


def build_program(assembly: Assembly) -> Program:
    """Return the program of an assembly, with its buffers.

    Raises WiringError for a channel or window column that does not exist.
    """
    system = assembly.system
    channels = {n: assembly.output(n) for n in system.channels if not _absent(assembly, n)}
    windows = system.windows
    columns = {k: assembly.output(n) for k, n in windows.columns.items()} if windows else {}
    watch = assembly.output(windows.watch) if windows else None
    done = assembly.output(system.done) if system.done else None
    every_step = _needed(
        [*((c.source, c.output) for c in assembly.connections), *(x for x in (watch, done) if x is not None)]
    )
    rare = (_needed(channels.values()), _needed(columns.values()))
    places: list[dict[tuple[str, int], int]] = [{}, {}, {}]  # read in every step, for channels, for windows
    size = 0
    programs = []
    for slot in assembly.order.order:
        p = PartProgram(slot)
        for which, groups in enumerate((p.gets, p.channel_gets, p.window_gets)):
            needed = (every_step, *rare)[which].get(slot, {})
            new = [b for k, b in needed.items() if which == 0 or (slot, k) not in places[0]]
            for kind in KINDS:
                bounds = [b for b in new if b.kind == kind]
                if bounds:
                    group = VariableGroup(kind, [b.reference for b in bounds])
                    group.at = size
                    for b in bounds:
                        places[which][(slot, _key(b))] = size
                        size += 1
                    groups.append(group)
        programs.append(p)
    out = np.zeros(max(size, 1))
    for p in programs:
        for g in (*p.gets, *p.channel_gets, *p.window_gets):
            if g.kind == "Real":
                g.values = (ctypes.c_double * g.n).from_buffer(out.data, g.at * 8)
        incoming = [c for c in assembly.connections if c.target == p.slot]
        for kind in KINDS:
            links = [c for c in incoming if c.input.kind == kind]
            if links:
                g = VariableGroup(kind, [c.input.reference for c in links])
                g.source = [places[0][(c.source, _key(c.output))] for c in links]
                g.scaled = [(j, c.gain) for j, c in enumerate(links) if c.gain != 1.0]
                p.sets.append(g)

    def at(where: tuple[str, Bound] | None, which: int = 0) -> int:
        if where is None:
            return -1
        key = (where[0], _key(where[1]))
        return places[0][key] if key in places[0] else places[which][key]

    def row(named: dict[str, tuple[str, Bound]], which: int) -> RecordRow:
        return RecordRow(list(named), [at(w, which) for w in named.values()], [w[1].gain for w in named.values()])

    return Program(programs, out, row(channels, 1), row(columns, 2), at(watch), at(done))


def _absent(assembly: Assembly, name: str) -> bool:
    """Return whether this is an optional output that the FMU in the slot does not have."""
    slot, _, element = name.partition(".")
    binding = assembly.bindings.get(slot)
    return binding is not None and element not in binding.outputs and element.split("[")[0] in binding.absent
