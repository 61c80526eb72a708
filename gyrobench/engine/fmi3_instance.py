"""One FMI 3.0 co-simulation FMU under FMPy.

Used: values of all types but binaries and clocks, arrays, early return.  Left out on purpose: intermediate update and
event mode, which a loop with fixed communication steps has no use for (the FMU handles its events itself); structural
parameters keep their start values.
"""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

from gyrobench.engine.fmu_instance import ENDED, NO_PROGRESS, FmuCallError, FmuInstance, status_text, with_signatures
from gyrobench.engine.program import VariableGroup, type_code
from gyrobench.engine.run_board import STEP, Status
from gyrobench.system.binding import Bound
from gyrobench.system.fmu_variables import variables

REST = 1e-9  # of a step: a remainder below it counts as done


def new_instance(slot: str, description: Any, folder: Path, status: Status | None = None, part: int = 0) -> FmuInstance:
    """Load an unzipped FMU of either FMI version; status, part: see FmuInstance."""
    version = FmuInstance3 if description.fmiVersion.startswith("3.") else FmuInstance
    return version(slot, description, folder, status, part)


class FmuInstance3(FmuInstance):
    """An FMI 3.0 co-simulation FMU in this process; the differences from FMI 2.0."""

    fmi3 = True
    prefix, state, restore = "fmi3", "FMUState", "deserializeFMUState"

    def new_slave(self) -> Any:
        """Return FMPy's class of such FMUs."""
        from fmpy.fmi3 import FMU3Slave

        return with_signatures(FMU3Slave)

    def create(self) -> None:
        """Instantiate; early return is allowed, event mode and intermediate update are not used."""

        def log(_environment: Any, status: int, _category: bytes, message: bytes) -> None:
            self.log.append((status, (message or b"").decode("utf-8", "replace").strip()))

        self.call("instantiate", self.fmu.instantiate, loggingOn=True, earlyReturnAllowed=True, logMessage=log)

    def set_start(self, values: list[tuple[Bound, Any]]) -> None:
        """Set parameters and start values; of an array all elements, those not given at their declared start values."""
        chosen: dict[int, dict[int, tuple[Bound, Any]]] = {}
        for b, v in values:
            chosen.setdefault(b.reference, {})[b.index] = (b, v)
        declared = variables(self.description).values()
        for reference, given in chosen.items():
            b = next(iter(given.values()))[0]
            if b.kind == "String":
                texts = [v for _, v in given.values()]
                self.call(f"setString of {b.variable}", self.fmu.setString, [reference], texts)
                continue
            group = VariableGroup(type_code(b.type, True), [reference], [max(1, b.size)])
            starts = {v.index: v.start for v in declared if v.reference == reference}
            for j in range(group.n):
                group.values[j] = given[j][1] if j in given else _number(starts.get(j), group)
            self.write(group, f"set{group.type.call} of {b.variable}")

    def initialize(self, t0: float) -> None:
        """Call enterInitializationMode."""
        self.call("enterInitializationMode", self.fmu.enterInitializationMode, startTime=t0)

    def do_step(self, t: float, h: float) -> None:
        """Do one communication step; where the FMU returns early, go on from there with the same inputs."""
        start, end, left = t, t + h, h
        self.status.part, self.status.call = self.part, STEP
        while True:
            try:
                _, ended, early, last = self.fmu.doStep(start, left)
            except Exception as error:
                self.time = t
                raise self.fail("doStep", error) from None
            if ended or (early and not last > start):
                self.time = t
                raise FmuCallError(
                    self.slot, "doStep", status_text(ENDED if ended else NO_PROGRESS), t, self.messages()
                )
            left = end - last
            if not early or not left > REST * h:
                return
            start = last


def _number(text: str | None, group: VariableGroup) -> Any:
    """Return a declared start value as a number of the group's type; 0 where none is declared."""
    if text is None:
        return 0
    if group.type.ctype is ctypes.c_bool:
        return text in ("true", "1")
    return float(text) if group.type.lowest is None else int(text)
