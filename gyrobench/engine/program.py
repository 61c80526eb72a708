"""The numeric form of an assembled system: buffers, value references and gather lists, used by both engines.

All outputs that are needed live in one buffer ``out`` of doubles.  Each part has a slice of it for what is read in
every step (wired or watched), and further slices for what is read only when a row of the channels or of the windows
is due.  A ``VariableGroup`` is one FMI get or set call with its arrays.  An array variable of FMI 3.0 is one reference
with as many values as it has elements.
"""

from __future__ import annotations

import ctypes
import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gyrobench.system.binding import Bound
from gyrobench.system.wiring import Assembly, Connection

WHOLE_BITS = 53  # a double holds every whole number up to 2^53


@dataclass(frozen=True)
class NumberType:
    """A type of variables: its get and set functions, its C type and its smallest and largest value (None: any)."""

    name: str
    call: str  # fmi2GetReal, fmi3SetInt8 ...
    ctype: Any
    lowest: int | None = None
    highest: int | None = None

    @property
    def refusal(self) -> str:
        """Return the message for a number that the type does not hold."""
        return f"a value that {self.name} does not hold ({self.lowest} to {self.highest})"


def _whole(name: str, ctype: Any, bits: int, signed: bool) -> NumberType:
    bits = min(bits, WHOLE_BITS + signed)
    lowest = -(2 ** (bits - 1)) if signed else 0
    return NumberType(name, name, ctype, lowest, 2 ** (bits - signed) - 1)


#: the types of FMI 2.0 and, from Float64 on, those of FMI 3.0; the places in this list are the codes of engine.c
TYPES = (
    NumberType("Real", "Real", ctypes.c_double),
    _whole("Integer", ctypes.c_int32, 32, True),
    _whole("Boolean", ctypes.c_int32, 32, True),
    NumberType("Float64", "Float64", ctypes.c_double),
    NumberType("Float32", "Float32", ctypes.c_float),
    _whole("Int8", ctypes.c_int8, 8, True),
    _whole("UInt8", ctypes.c_uint8, 8, False),
    _whole("Int16", ctypes.c_int16, 16, True),
    _whole("UInt16", ctypes.c_uint16, 16, False),
    _whole("Int32", ctypes.c_int32, 32, True),
    _whole("UInt32", ctypes.c_uint32, 32, False),
    _whole("Int64", ctypes.c_int64, 64, True),
    _whole("UInt64", ctypes.c_uint64, 64, False),
    NumberType("Boolean of FMI 3.0", "Boolean", ctypes.c_bool, -(2**31), 2**31 - 1),
)
CODES = {t.name: code for code, t in enumerate(TYPES)}


def type_code(type_name: str, fmi3: bool) -> int:
    """Return the place in TYPES of a type of a model description."""
    if type_name == "Enumeration":
        return CODES["Int64" if fmi3 else "Integer"]
    return CODES["Boolean of FMI 3.0" if fmi3 and type_name == "Boolean" else type_name]


PLACES = ("at", "source", "scaled", "shifted")


class VariableGroup:
    """The arrays of one call that gets or sets variables of one type.

    code: place in TYPES.  sizes: the number of values of each reference, 1 for a scalar.  values: ctypes array the call
    reads or writes.  numbers: the same as doubles (``values`` itself where it holds doubles).  For a get, ``at`` is the
    place of the first value in ``out`` (doubles are written there directly).  For a set, ``source[j]`` is the place in
    ``out`` of value j, ``scaled`` lists the (j, factor) that are not 1, ``shifted`` the (j, offset) that are not 0.
    """

    def __init__(self, code: int, references: Sequence[int], sizes: Sequence[int] = ()) -> None:
        self.code, self.type = code, TYPES[code]
        self.sizes = list(sizes) or [1] * len(references)
        self.n_references, self.n = len(references), sum(self.sizes)
        self.references = (ctypes.c_uint * self.n_references)(*references)
        self.doubles = self.type.ctype is ctypes.c_double
        self.values: Any = (self.type.ctype * self.n)()
        self.numbers: Any = self.values if self.doubles else (ctypes.c_double * self.n)()
        self.at = 0
        self.source: list[int] = []
        self.scaled: list[tuple[int, float]] = []
        self.shifted: list[tuple[int, float]] = []

    def __getstate__(self) -> dict[str, Any]:
        return {"references": list(self.references), **{n: getattr(self, n) for n in ("code", "sizes", *PLACES)}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["code"], state["references"], state["sizes"])  # type: ignore[misc]
        for name in PLACES:
            setattr(self, name, state[name])

    def bind(self, out: np.ndarray[Any, np.dtype[np.float64]]) -> None:
        """Let a get call of doubles write into ``out`` directly."""
        if self.doubles:
            self.values = self.numbers = (ctypes.c_double * self.n).from_buffer(out.data, self.at * 8)


@dataclass
class PartProgram:
    """The calls of one part in a communication step: sets, doStep, gets; and the outputs read for rows only.

    A set gives all elements of an array.  Those that no wire feeds keep what they have after initialization began.
    """

    slot: str
    sets: list[VariableGroup] = field(default_factory=list)
    gets: list[VariableGroup] = field(default_factory=list)
    channel_gets: list[VariableGroup] = field(default_factory=list)
    window_gets: list[VariableGroup] = field(default_factory=list)
    holds: list[VariableGroup] = field(default_factory=list)  # input arrays that are wired in part, read once


@dataclass
class RecordRow:
    """A row of the record: column names and the places, factors and offsets of their values in ``out``."""

    names: list[str] = field(default_factory=list)
    source: list[int] = field(default_factory=list)
    gain: list[float] = field(default_factory=list)
    offset: list[float] = field(default_factory=list)


@dataclass
class Program:
    """Everything an engine needs; parts in execution order."""

    parts: list[PartProgram]
    out: np.ndarray[Any, np.dtype[np.float64]]
    channel: RecordRow
    window: RecordRow
    watch: int  # place in out, -1: none
    done: int
    delays: list[tuple[int, int]] = field(default_factory=list)  # (to, from): copied before each step
    constants: list[tuple[int, float]] = field(default_factory=list)  # (place, value) of outputs that no FMU has

    def reset(self) -> None:
        """Set the buffer to what it is before a run."""
        self.out[:] = 0.0
        for at, value in self.constants:
            self.out[at] = value

    def __post_init__(self) -> None:
        for p in self.parts:
            for g in (*p.gets, *p.channel_gets, *p.window_gets, *p.holds):
                g.bind(self.out)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.__post_init__()

    @property
    def order(self) -> list[str]:
        """Slots in execution order."""
        return [p.slot for p in self.parts]


Key = tuple[int, int]  # code of the type, value reference


def _needed(names: Iterable[tuple[str, Bound]], codes: Callable[[str, Bound], int]) -> dict[str, dict[Key, Bound]]:
    """Return the variables by slot, each once; an array is one variable."""
    by_slot: dict[str, dict[Key, Bound]] = {}
    for slot, b in names:
        if b.constant is not None:
            continue
        by_slot.setdefault(slot, {}).setdefault((codes(slot, b), b.reference), b)
    return by_slot


def build_program(assembly: Assembly) -> Program:
    """Return the program of an assembly, with its buffers.

    Raises WiringError for a channel or window column that does not exist.
    """
    system = assembly.system
    three = {slot: d.fmiVersion.startswith("3.") for slot, d in assembly.descriptions.items()}

    def code(slot: str, b: Bound) -> int:
        return type_code(b.type, three[slot])

    channels = {n: assembly.output(n) for n in system.channels if not _absent(assembly, n)}
    windows = system.windows
    columns = {k: assembly.output(n) for k, n in windows.columns.items()} if windows else {}
    watch = assembly.output(windows.watch) if windows else None
    done = assembly.output(system.done) if system.done else None
    every_step = _needed(
        [*((c.source, c.output) for c in assembly.connections), *(x for x in (watch, done) if x is not None)], code
    )
    rare = (_needed(channels.values(), code), _needed(columns.values(), code))
    places: list[dict[tuple[str, Key], int]] = [{}, {}, {}]  # read in every step, for channels, for windows
    size = 0

    def place(group: VariableGroup) -> VariableGroup:
        nonlocal size
        group.at = size
        size += group.n
        return group

    programs = []
    for slot in assembly.order.order:
        p = PartProgram(slot)
        for which, groups in enumerate((p.gets, p.channel_gets, p.window_gets)):
            needed = (every_step, *rare)[which].get(slot, {})
            new = {k: b for k, b in needed.items() if which == 0 or (slot, k) not in places[0]}
            for of_type in sorted({k[0] for k in new}):
                keys = [k for k in new if k[0] == of_type]
                group = place(VariableGroup(of_type, [k[1] for k in keys], [max(1, new[k].size) for k in keys]))
                starts = itertools.accumulate(group.sizes, initial=group.at)
                places[which] |= {(slot, k): at for k, at in zip(keys, starts, strict=False)}
                groups.append(group)
        incoming: dict[Key, list[Connection]] = {}
        for c in assembly.connections:
            if c.target == slot:
                incoming.setdefault((code(slot, c.input), c.input.reference), []).append(c)
        for of_type, reference in incoming:
            links = incoming[of_type, reference]
            if links[0].input.size > len(links):
                p.holds.append(place(VariableGroup(of_type, [reference], [links[0].input.size])))
        programs.append(p)
    of_record = [x for x in (*channels.values(), *columns.values(), watch, done) if x is not None]
    said = {(c.source, c.output) for c in assembly.connections} | set(of_record)
    stated = {(slot, b.element): b.constant for slot, b in said if b.constant is not None}
    fixed = {key: size + k for k, key in enumerate(sorted(stated))}
    size += len(fixed)

    def at(slot: str, b: Bound, which: int = 0) -> int:
        """Return the place of an output that is read in every step, or for rows."""
        if b.constant is not None:
            return fixed[slot, b.element]
        key = (slot, (code(slot, b), b.reference))
        return (places[0][key] if key in places[0] else places[which][key]) + b.index

    late = list(dict.fromkeys(at(c.source, c.output) for c in assembly.connections if c.delayed))
    delayed = {source: size + k for k, source in enumerate(late)}
    size += len(delayed)

    def source(c: Connection) -> int:
        place = at(c.source, c.output)
        return delayed[place] if c.delayed else place

    out = np.zeros(max(size, 1))
    for p in programs:
        p.sets += _sets(p, [c for c in assembly.connections if c.target == p.slot], code, source)

    def row(named: dict[str, tuple[str, Bound]], which: int) -> RecordRow:
        return RecordRow(
            list(named),
            [at(*w, which) for w in named.values()],
            [w[1].gain for w in named.values()],
            [w[1].offset for w in named.values()],
        )

    return Program(
        programs,
        out,
        row(channels, 1),
        row(columns, 2),
        -1 if watch is None else at(*watch),
        -1 if done is None else at(*done),
        [(to, place) for place, to in delayed.items()],
        [(fixed[key], float(value)) for key, value in stated.items()],
    )


def _sets(
    p: PartProgram, incoming: list[Connection], code: Callable[[str, Bound], int], source: Callable[[Connection], int]
) -> list[VariableGroup]:
    """Return the calls that set the inputs of a part, one for each type."""
    held = {(g.code, g.references[0]): g.at for g in p.holds}
    groups = []
    for of_type in sorted({code(p.slot, c.input) for c in incoming}):
        by_reference: dict[int, list[Connection]] = {}
        for c in incoming:
            if code(p.slot, c.input) == of_type:
                by_reference.setdefault(c.input.reference, []).append(c)
        g = VariableGroup(of_type, list(by_reference), [max(1, of[0].input.size) for of in by_reference.values()])
        first = 0
        for reference, size in zip(by_reference, g.sizes, strict=True):
            at = held.get((of_type, reference), 0)
            g.source += range(at, at + size)
            for c in by_reference[reference]:
                g.source[first + c.input.index] = source(c)
                if c.gain != 1.0:
                    g.scaled.append((first + c.input.index, c.gain))
                if c.offset != 0.0:
                    g.shifted.append((first + c.input.index, c.offset))
            first += size
        groups.append(g)
    return groups


def _absent(assembly: Assembly, name: str) -> bool:
    """Return whether this is an optional output that the FMU in the slot does not have."""
    slot, _, element = name.partition(".")
    binding = assembly.bindings.get(slot)
    return binding is not None and element not in binding.outputs and element.split("[")[0] in binding.absent
