"""Factors and offsets of wires as small FMUs of their own, for tools that cannot apply them.

Importers of SSP archives ignore the LinearTransformation of a connection (FMPy, OMSimulator), and a container FMU only
copies values.  So each connection with a factor or an offset leads through a part ``gain_01``, ``gain_02``, ... before
its target (:mod:`gyrobench.exchange.gain.model`).  In a tool that couples its FMUs in parallel such a connection is one
communication step later than the others.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gyrobench.exchange.gain.model import Gain
from gyrobench.system.binding import Bound
from gyrobench.system.parameters import Starts
from gyrobench.system.wiring import Assembly, Connection

FACTOR, OFFSET, INPUT, OUTPUT = (
    Bound(s.name, s.name, s.reference, "Real", unit=s.decl.unit) for s in map(Gain.layout.__getitem__, range(4))
)


@dataclass(frozen=True)
class ExportedLink:
    """A connection that copies: of a system, or one of the two that a gain lies between."""

    source: str
    output: Bound
    target: str
    input: Bound
    gain: bool


@dataclass(frozen=True)
class Gains:
    """The gains of an assembly by name, and what becomes of its execution order and connections."""

    parts: Mapping[str, Connection]
    order: list[str]  # slots and gains, each gain right before its target
    links: list[ExportedLink]

    def starts(self) -> Starts:
        """Return what is set in the gains."""
        return {name: [(FACTOR, c.gain), (OFFSET, c.offset)] for name, c in self.parts.items()}


def varying(assembly: Assembly) -> list[Connection]:
    """Return the connections whose source is no constant of a mapping file."""
    return [c for c in assembly.connections if c.output.constant is None]


def gains_of(assembly: Assembly) -> Gains:
    """Return the gains that an assembly needs outside of the bench; call it after the values are known."""
    factors = assembly.system.factors  # of 1 too: such a wire turns one quantity into another, which importers refuse
    scaled = [c for c in varying(assembly) if c.gain != 1.0 or c.offset or c.wire in factors]
    stem = "gain"
    while any(slot.startswith(stem) for slot in assembly.paths):
        stem += "_of_wire"
    digits = max(2, len(str(len(scaled))))  # of one length: to FMPy gain_1 would have the parameters of gain_10 too
    parts = {f"{stem}_{k:0{digits}}": c for k, c in enumerate(scaled, 1)}
    before = {slot: [name for name, c in parts.items() if c.target == slot] for slot in assembly.order.order}
    order = [name for slot, names in before.items() for name in (*names, slot)]
    named = {id(c): name for name, c in parts.items()}
    links: list[ExportedLink] = []
    for c in varying(assembly):
        name = named.get(id(c))
        if name is None:
            links.append(ExportedLink(c.source, c.output, c.target, c.input, False))
        else:
            links.append(ExportedLink(c.source, c.output, name, INPUT, True))
            links.append(ExportedLink(name, OUTPUT, c.target, c.input, True))
    return Gains(parts, order, links)


def gain_fmu(bench: Path | None) -> bytes:
    """Return the file of a gain's FMU, native or, without a compiler, in Python."""
    from gyrobench.packaging import CompilerError, build

    with tempfile.TemporaryDirectory(prefix="gyrobench-") as folder:
        try:
            return build(Gain, "native", bench=bench, out=Path(folder)).read_bytes()
        except CompilerError:
            return build(Gain, "python", bench=bench, out=Path(folder)).read_bytes()


def is_gain(description: Any) -> bool:
    """Return whether a model description is that of a gain."""
    return bool(description.generationTool == "gyrobench" and description.modelName == Gain.__name__)
