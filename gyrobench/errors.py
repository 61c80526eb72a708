"""The base class of all errors meant for people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

#: the way on from a stopped run at a shell
RESUMING = "the same command with --resume"


@dataclass(frozen=True)
class Advice:
    """The way on from an error.

    action: "resume", "reduce", "fit" or "columns", for a face that has a button for it; shell: a clause for all others.
    """

    action: str
    shell: str


class GyrobenchError(Exception):
    """An error whose text says what is wrong and what to do; a command shows the text and no traceback.

    advice: what goes on from here; ``str`` has it behind the text, as a shell shows them, ``text`` is without it.
    """

    exit_code = 2  # of the command that ends with it
    advice: tuple[Advice, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:  # whatever its __init__ takes: it may come from another process
        return Exception.__new__, (type(self), *self.args), self.__dict__

    def advised(self, *advice: Advice) -> Self:
        """Return the error, with this advice."""
        self.advice = advice
        return self

    @property
    def text(self) -> str:
        """Return what is wrong, without the advice."""
        return super().__str__()

    def __str__(self) -> str:
        return "\n".join(filter(None, (self.text, "; ".join(a.shell for a in self.advice))))
