"""The values that the parameters of the parts in the slots have, before the system derives any: designs follow them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import System
from gyrobench.system.values import flatten, nest


class PartValues:
    """Values of the parts for ``System.parameters(parts)``: ``parts["gyro.k"]``, SI, arrays nested.

    A value is the user's where he set one, else ``raw`` of the system, else the FMU's own.  What the FMU in the slot
    does not have is taken from the part the system is made with, and ``notes`` says so.
    chosen: element by element, what user and ``raw`` set.  base: the FMUs' own start values; None: no FMU is known yet,
    and the values are those of the parts that the system is made with.
    """

    def __init__(
        self, system: System, base: Mapping[str, Any] | None = None, chosen: Mapping[str, Any] | None = None
    ) -> None:
        self.notes: list[str] = []
        self.read: set[str] = set()  # "slot.parameter" that a design has asked for
        self._system = system
        self._chosen = dict(chosen or {})
        self._values = nest({**(base or {}), **self._chosen})
        self._told = base is not None
        self._standard: dict[str, dict[str, Any]] = {}

    def __contains__(self, name: str) -> bool:
        """True where the FMU in the slot has this parameter."""
        return name in self._values

    def __getitem__(self, name: str) -> Any:
        """Return the value of "slot.parameter".  Raises InvalidConfigurationError where no part has it."""
        return self._value(name, self._missing)

    def get(self, name: str, default: Any) -> Any:
        """Return the value of "slot.parameter", or ``default``, with a note, where no part has it."""

        def missing(name: str, part: str) -> Any:
            self._note(name, default, "the system")
            return default

        return self._value(name, missing)

    def given(self, name: str, value: Any) -> Any:
        """Return the user's value of a parameter that the system sets, else ``value``."""
        elements = flatten(name, value)
        if not any(e in self._chosen for e in elements):
            return value
        return nest({e: self._chosen.get(e, v) for e, v in elements.items()})[name]

    def all_given(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return :meth:`given` of each of ``values``: "slot.parameter" -> value."""
        return {name: self.given(name, value) for name, value in values.items()}

    # ------------------------------------------------------------ what no FMU has
    def _value(self, name: str, missing: Callable[[str, str], Any]) -> Any:
        self.read.add(name)
        if name in self._values:
            return self._values[name]
        slot, _, parameter = name.partition(".")
        if slot not in self._system.slots:
            slots = ", ".join(self._system.slots)
            raise InvalidConfigurationError(self._system.name, [f"{name}: no slot '{slot}'; slots: {slots}"])
        part = self._system.slots[slot].part
        standard = self._of_part(slot, part)
        if parameter not in standard:
            return missing(name, part)
        self._note(name, standard[parameter], part)
        return standard[parameter]

    def _of_part(self, slot: str, part: str) -> dict[str, Any]:
        """Return the parameters of the part that the system is made with; none where it is not of this bench."""
        from gyrobench.bench import BenchError
        from gyrobench.packaging import load_part

        if slot not in self._standard:
            folder = self._system.folder
            try:
                layout = load_part(part, folder.parent.parent if folder else None).layout
            except BenchError:
                layout = []
            self._standard[slot] = nest({s.name: s.decl.type(s.start) for s in layout if s.section == "parameter"})
        return self._standard[slot]

    def _note(self, name: str, value: Any, part: str) -> None:
        slot, _, parameter = name.partition(".")
        shown = f"{value:g}" if isinstance(value, float) else str(value)
        text = (
            f"{slot} has no parameter '{parameter}': the design takes {shown} (SI), the value of {part}; where the FMU "
            f"has another, give it in the mapping file: [parameters.{parameter}] with name or value"
        )
        if self._told and text not in self.notes:
            self.notes.append(text)

    def _missing(self, name: str, part: str) -> Any:
        slot, _, parameter = name.partition(".")
        text = (
            f"{slot}: the FMU has no parameter '{parameter}', which the design of {self._system.name} needs, nor has "
            f"{part}; give it in the mapping file: [parameters.{parameter}] with name or value"
        )
        raise InvalidConfigurationError(self._system.name, [text])
