"""A first mapping file of an FMU for a slot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gyrobench.bench import Bench, UsageError, suggest_names
from gyrobench.system.sockets import SOCKETS, Socket, socket
from gyrobench.workflow.inputs import check_fmu_files
from gyrobench.workflow.settings import load_system


def find_socket(slot: str) -> Socket:
    """Return the socket of "SYSTEM.slot", or the socket of that name.  Raises UsageError."""
    system, dot, name = slot.partition(".")
    if not dot:
        if slot not in SOCKETS:
            near = suggest_names(slot, [*SOCKETS, *Bench.find().systems()])
            raise UsageError(f"--slot {slot}: name SYSTEM.slot, as tumble_single_axis.gyro, or a socket; {near}")
        return SOCKETS[slot]
    slots = load_system(system, {}).all_slots()
    if name not in slots:
        raise UsageError(f"--slot {slot}: {system} has no slot '{name}'; {suggest_names(name, slots)}")
    return socket(slots[name].socket).standing_for(slots[name].quantities)


def _parameters(slot: str, description: Any) -> list[str]:
    """Return the lines of the table [parameters] for "SYSTEM.slot"; none for a socket, of which no design is known."""
    from gyrobench.packaging import load_part
    from gyrobench.system.parameter_proposal import parameter_lines, wanted_parameters

    name, dot, place = slot.partition(".")
    if not dot:
        return []
    system = load_system(name, {})
    system.request(place)
    part = load_part(system.slots[place].part, Bench.find().folder)
    return parameter_lines(description, wanted_parameters(system, place, part))


def write_mapping(fmu: Path, slot: str, out: Path | None) -> tuple[str, list[str]]:
    """Return a first mapping file of the FMU, written to ``out`` where given, and what it still lacks."""
    from gyrobench.system.binding import SocketMismatchError, fit
    from gyrobench.system.fmu_variables import read_description
    from gyrobench.system.mapping_files import parse_mapping
    from gyrobench.system.mapping_proposal import mapping_text

    check_fmu_files({slot: fmu})
    wanted = find_socket(slot)
    description: Any = read_description(fmu)
    head = f"# Mapping of {description.modelName} ({fmu.name}) into the socket {wanted.name}."
    text = mapping_text(wanted, description, head, parameters=_parameters(slot, description))
    if out is not None:
        if out.exists():
            raise UsageError(f"--out {out}: the file exists; choose another name")
        out.write_text(text, encoding="utf-8")
    try:
        fit(wanted, description, parse_mapping(text, "the proposal"), slot)
    except SocketMismatchError as error:
        return text, error.problems
    return text, []
