"""Units of what is recorded, as far as sockets, wires or FMUs name them."""

from __future__ import annotations

from collections.abc import Mapping

from gyrobench.system.wiring import Assembly


def recorded_units(assembly: Assembly, columns: Mapping[str, str]) -> dict[str, str]:
    """Return the SI unit of each column; columns: name -> "slot.output".  Raises WiringError."""
    return {name: _unit(assembly, output) for name, output in columns.items()}


def _unit(assembly: Assembly, output: str) -> str:
    """Return the unit by the socket; of a slot that passes a signal on, that of the signal; else by the FMU."""
    slot, bound = assembly.output(output)
    socket = assembly.bindings[slot].socket
    connector = socket.connector(bound.element.split("[")[0])
    if connector is not None and connector.unit:
        return connector.unit
    signal = next((c.name for c in socket.connectors if c.causality == "input" and not c.unit), None)
    if connector is not None:
        for wire in assembly.connections:
            if wire.target == slot and wire.input.element.split("[")[0] == signal:
                source = assembly.bindings[wire.source].socket.connector(wire.output.element.split("[")[0])
                return source.unit if source is not None and source.unit else wire.output.unit
    return bound.unit
