"""Variables that a system that is one FMU exposes: those of its parts, and options that stand for them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from gyrobench.bench import near_names, suggest_names
from gyrobench.errors import GyrobenchError
from gyrobench.exchange.ssp_export import ExportError
from gyrobench.system.parameters import defaults, resolve
from gyrobench.system.system import System
from gyrobench.system.wiring import Assembly

PROBES = (1.0 + 2.0**-10, 1.0 - 2.0**-10)  # an option times these
SECTIONS = ("parameter", "input", "output")


@dataclass(frozen=True)
class ExposedVariable:
    """A variable to expose.  section: its causality.  ends: (slot, variable) of what it stands for.

    unit, doc: of an option; else those of the part's variable.
    """

    name: str
    section: str
    ends: tuple[tuple[str, str], ...]
    unit: str = ""
    doc: str = ""


class _Chooser:
    def __init__(self, system: System, assembly: Assembly, seed: int) -> None:
        self.system, self.assembly, self.seed = system, assembly, seed
        self.causality = {
            f"{slot}.{v.name}": v.causality for slot, d in assembly.descriptions.items() for v in d.modelVariables
        }
        self.wired = {f"{c.target}.{c.input.variable}": c.wire for c in assembly.connections}

    def elements(self, name: str) -> list[str]:
        """Return a variable of a part, or the elements of an array.  Raises ExportError."""
        found = [n for n in self.causality if n == name or n.startswith(f"{name}[")]
        if not found:
            slot = name.partition(".")[0]
            if slot not in self.assembly.paths:
                raise ExportError(f"--expose {name}: no slot '{slot}'; {suggest_names(slot, self.assembly.paths)}")
            near = near_names(name, [n for n in self.causality if n.startswith(f"{slot}.")])
            meant = f"; did you mean {' or '.join(near)}?" if near else ""
            raise ExportError(f"--expose {name}: {slot} has no such variable{meant}")
        return found

    def of_part(self, name: str) -> ExposedVariable:
        """Return a variable of a part.  Raises ExportError for one that cannot be exposed."""
        slot, _, variable = name.partition(".")
        if name in self.wired:
            raise ExportError(f"--expose {name}: this input is wired: {self.wired[name]}")
        if self.causality[name] not in SECTIONS:
            raise ExportError(f"--expose {name}: it is internal; parameters, inputs and outputs can be exposed")
        return ExposedVariable(name, self.causality[name], ((slot, variable),))

    def option(self, name: str) -> ExposedVariable | None:
        """Return an option whose only effect is that parameters or inputs of parts take its value, else None."""
        value, kind = self.system[name], self.system.options[name].kind
        if kind is float and isinstance(value, float | int):
            probes: list[Any] = [value * p if value else p - 1.0 for p in PROBES]
        elif kind is int and isinstance(value, int):
            probes = [value + 1, value - 1]
        elif kind is bool:
            probes = [not value]
        else:
            return None
        before = self.settings(self.system)
        ends: set[tuple[str, str]] | None = None
        for probe in probes:
            try:
                after = self.settings(self.system.with_values({name: probe}))
            except GyrobenchError:
                continue  # outside its bounds
            changed = {k for k in {**before, **after} if before.get(k) != after.get(k)}
            if any(before.get(k) != value or after.get(k) != probe for k in changed):
                return None
            if ends is not None and changed != ends:
                return None
            ends = changed
        if not ends or any(not slot or f"{slot}.{variable}" in self.wired for slot, variable in ends):
            return None  # it changes nothing, a time of the run, or an input with a wire
        o = self.system.options[name]
        return ExposedVariable(name, "parameter", tuple(sorted(ends)), o.unit if isinstance(o.unit, str) else "", o.doc)

    def settings(self, system: System) -> dict[tuple[str, str], Any]:
        """Return what is set in the parts, the factors of wires and the times of a system, by (slot, variable)."""
        connections = self.assembly.connections[:]
        starts, _, _ = resolve(self.assembly, system, self.seed, defaults(self.assembly))
        found: dict[tuple[str, str], Any] = {(s, b.variable): v for s, given in starts.items() for b, v in given}
        found |= {("", c.wire): (c.gain, c.offset) for c in self.assembly.connections}
        self.assembly.connections[:] = connections
        found[("", "step")], found[("", "stop")] = system.step, system.stop
        return found


def choose(system: System, assembly: Assembly, seed: int, asked: Iterable[str]) -> list[ExposedVariable]:
    """Return the variables to expose.

    asked: "slot.variable" (a parameter, an input without a wire, an output; all elements of an array) and names of
    options; none: the options that set values of parts and do nothing else, which small changes of them show.
    Raises ExportError.
    """
    chooser, names = _Chooser(system, assembly, seed), list(asked)
    options = [n for n in names if "." not in n]
    of_parts = [chooser.of_part(e) for n in names if "." in n for e in chooser.elements(n)]
    if unknown := [n for n in options if n not in system.options]:
        raise ExportError(f"--expose {unknown[0]}: neither 'slot.variable' nor an option of {system.name}")
    found = {} if of_parts and not options else {n: chooser.option(n) for n in options or system.options}
    if lost := [n for n in options if found[n] is None]:
        raise ExportError(
            f"--expose {lost[0]}: the option does more than set values of parts, so it is built in; "
            f"set it with --set {lost[0]}=..."
        )
    return [c for c in found.values() if c is not None] + of_parts
