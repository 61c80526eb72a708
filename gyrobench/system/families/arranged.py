"""Tests of which the value of one option says what slots and wires they have."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from gyrobench.system.system import System


class Arranged(System):
    """A test that is arranged anew when the option ``arranged_by`` is set; what was asked for stays.

    arranged: the attributes that follow from its value.
    """

    arranged_by: ClassVar[str]
    arranged: ClassVar[tuple[str, ...]]

    def set(self, name: str, value: Any) -> None:
        super().set(name, value)
        if name != self.arranged_by:
            return
        asked = [slot for slot in self.on_request if slot in self.slots]
        for changed in self.arranged:
            vars(self).pop(changed, None)
        self.arrange()
        for slot in asked:
            self.request(slot)

    @abstractmethod
    def arrange(self) -> None:
        """Give the system the slots and wires of the value that is set."""
