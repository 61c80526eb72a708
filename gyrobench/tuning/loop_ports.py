"""Where a loop of a system is opened, driven and measured: found in its loops, wires and channels."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from gyrobench.record.record import Record
from gyrobench.system.system import System

#: of an axis that is held, the channels of its angle; {}: element
ANGLES = ("platform.attitude{}", "platform.los{}", "gyro.alpha", "table.angle")
LESS = " - "


@dataclass(frozen=True)
class LoopPorts:
    """One loop of ``System.loops``.  slot: of its stabilizer; axis: element of the exciter's signals; angle: channel of
    the angle that a load turns; kind: of the excitation that is added to its signal, test or command.

    port: input of the slot.  added, behind: channels of what is added to the signal, and of the signal behind the
    summing point, "a - b" where it is the difference of two; "": those of a stabilizer.  flag: output of the slot that
    is 1 while its output is at its limit.
    """

    loop: str = "stabilizer"
    slot: str = "stabilizer"
    axis: int = 1
    angle: str = "platform.attitude"
    kind: str = "test"
    port: str = "u"
    added: str = ""
    behind: str = ""
    flag: str = "saturated"

    @property
    def opened(self) -> str:
        """Return the input at which the loop is opened."""
        return f"{self.slot}.{self.port}"

    @property
    def inside(self) -> str:
        """Return the channel with the signal behind the summing point."""
        return self.behind or f"{self.slot}.e"

    @property
    def test(self) -> str:
        """Return the channel with what is added there."""
        return self.added or f"exciter.{self.kind}[{self.axis}]"

    @property
    def channels(self) -> tuple[str, ...]:
        """Return what a run must record to measure the loop."""
        return (self.test, *self.inside.split(LESS), self.limited)

    @property
    def limited(self) -> str:
        """Return the channel that is 1 at the limit of the controller's output."""
        return f"{self.slot}.{self.flag}"

    def measured(self, record: Record) -> Record:
        """Return a record that has the signal behind the summing point, and the limit by the name that others have."""
        found = dict(record.channels)
        if LESS in self.inside:
            a, b = self.inside.split(LESS)
            found[self.inside] = found[a] - found[b]
        if self.limited in found:
            found[f"{self.slot}.saturated"] = found[self.limited]
        return replace(record, channels=found)


STABILIZER = LoopPorts()


def loops_of(system: System) -> dict[str, LoopPorts]:
    """Return the loops that the plan can open by name: of stabilizers, of a table, of a compass that is slaved.

    A stabilizer drives a motor, commands a rate or has a motor of its own.
    """
    wires = "\n".join(line.strip() for line in system.wires.splitlines())
    found = {}
    for loop, at in system.loops.items():
        slot, _, port = at.partition(".")
        ports = next(_ports(system, wires, LoopPorts(loop, slot, angle="", port=port)), None)
        if ports is not None:
            found[loop] = ports
    return found


def _ports(system: System, wires: str, start: LoopPorts) -> Iterator[LoopPorts]:
    """Yield the loop by what is wired to it."""
    slot, port = re.escape(start.slot), start.port

    def wired(pattern: str) -> re.Match[str] | None:
        return re.search(rf"^{pattern}$", wires, re.M)

    def angle(element: str) -> str:
        return next((a for a in (t.format(element) for t in ANGLES) if a in system.channels), "")

    to = r"(?: -> platform: v|\.v -> (?:platform\.v|decoupler\.command|commands\.u)(\[\d\])|\.M -> \w+\.M\w*(\[\d\])?)"
    tested, driven = wired(rf"exciter\.(test|command)\[(\d)\] -> {slot}\.test"), wired(slot + to)
    if port == "u" and tested and driven:
        element = driven[1] or driven[2] or ""
        yield replace(start, axis=int(tested[2]), angle=angle(element), kind=tested[1])
    # the torquer of the gyro on a table adds a rate to what the table does
    turned, felt = wired(r"exciter\.command\[(\d)\] -> (\w+)\.i"), wired(rf"{slot} -> (\w+): omega\b.*")
    if port == "u" and turned and felt and felt[1] == turned[2] and wired(rf"{turned[2]}\.u -> {slot}\.u"):
        added, axis = f"exciter.command[{turned[1]}]", int(turned[1])
        yield replace(start, axis=axis, angle=angle(""), kind="command", added=added,
                      behind=f"{added}{LESS}{start.slot}.omega[1]")  # fmt: skip
    disturbed, magnetic = wired(r"exciter\.test\[(\d)\] -> (\w+)\.disturbance"), wired(rf"(\w+)\.psi -> {slot}\.psi_m")
    if port == "psi" and disturbed and magnetic and magnetic[1] == disturbed[2]:
        yield replace(start, axis=int(disturbed[1]), added=f"{disturbed[2]}.psi", behind=f"{start.slot}.error",
                      flag="limited")  # fmt: skip
