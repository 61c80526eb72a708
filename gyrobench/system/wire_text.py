"""The text of a system's wires, line by line."""

from __future__ import annotations

from gyrobench.errors import GyrobenchError


class WiringError(GyrobenchError):
    """A wire that cannot be laid; ``problems`` lists each."""

    def __init__(self, system: str, problems: list[str]) -> None:
        self.problems = problems
        super().__init__("\n".join([f"wires of {system}:", *(f"  - {p}" for p in problems)]))


def parse_wires(text: str) -> list[tuple[str, str, str, str]]:
    """Return the single wires of a text as (slot, output, slot, input), in its order; # begins a comment.

    A line is one wire, ``site.f -> table.f_local``, or a bundle between two slots, ``table -> gyro: omega alpha f``,
    where ``f=f_local`` gives the name of the output and of the input if they differ.  Raises WiringError.
    """
    wires: list[tuple[str, str, str, str]] = []
    problems = []
    for raw in text.splitlines():
        line = " ".join(raw.partition("#")[0].split())
        if not line:
            continue
        ends, colon, names = line.partition(":")
        source, _, target = (e.strip() for e in ends.partition("->"))
        if colon:
            pairs = [(x, y if equals else x) for x, equals, y in (n.partition("=") for n in names.split())]
            laid = [(source, x, target, y) for x, y in pairs]
            correct = bool(pairs) and "." not in source + target
        else:
            laid = [(*_end(source), *_end(target))]
            correct = True
        if correct and all(n and not set(n) & set(" :=") and "->" not in n for wire in laid for n in wire):
            wires += laid
        else:
            problems.append(
                f"'{line}': must read 'slot.output -> slot.input' or 'slot -> slot: connector output=input ...'"
            )
    if problems:
        raise WiringError("the system", problems)
    return wires


def _end(text: str) -> tuple[str, str]:
    slot, _, name = text.partition(".")
    return slot, name
