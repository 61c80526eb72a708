"""Where a loop of a system is opened, driven and measured: found in its loops, wires and channels."""

from __future__ import annotations

import re
from dataclasses import dataclass

from gyrobench.system.system import System


@dataclass(frozen=True)
class LoopPorts:
    """One loop of ``System.loops``.  slot: of its stabilizer; axis: element of the exciter's signals; angle: channel of
    the angle that a load turns; kind: of the excitation that is added to its signal, test or command.
    """

    loop: str = "stabilizer"
    slot: str = "stabilizer"
    axis: int = 1
    angle: str = "platform.attitude"
    kind: str = "test"

    @property
    def opened(self) -> str:
        """Return the input at which the loop is opened."""
        return f"{self.slot}.u"

    @property
    def inside(self) -> str:
        """Return the channel with the signal behind the summing point."""
        return f"{self.slot}.e"

    @property
    def test(self) -> str:
        """Return the channel with what is added there."""
        return f"exciter.{self.kind}[{self.axis}]"


STABILIZER = LoopPorts()


def loops_of(system: System) -> dict[str, LoopPorts]:
    """Return the loops whose stabilizer drives a motor, or commands a rate, and which the plan can open, by name."""
    wires = "\n".join(line.strip() for line in system.wires.splitlines())
    found = {}
    for loop, at in system.loops.items():
        slot, _, port = at.partition(".")
        tested = re.search(rf"^exciter\.(test|command)\[(\d)\] -> {re.escape(slot)}\.test$", wires, re.M)
        to = r"(?: -> platform: v|\.v -> (?:platform\.v|decoupler\.command|commands\.u)(\[\d\]))"
        driven = re.search(rf"^{re.escape(slot)}{to}$", wires, re.M)
        if port != "u" or tested is None or driven is None:
            continue
        element = driven[1] or ""
        angles = [a for a in (f"platform.attitude{element}", f"platform.los{element}") if a in system.channels]
        ports = LoopPorts(loop, slot, int(tested[2]), angles[0] if angles else "", tested[1])
        if {ports.inside, ports.test} <= set(system.channels):
            found[loop] = ports
    return found
