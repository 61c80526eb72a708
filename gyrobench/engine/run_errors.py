"""Errors that stop a run: of its parts, of the user, of what was set."""

from __future__ import annotations

from gyrobench.errors import GyrobenchError
from gyrobench.record.record import Record


class RunError(GyrobenchError):
    """A run that did not end as it should; ``record`` holds what was recorded until then (or None)."""

    exit_code = 3

    def __init__(self, message: str, record: Record | None = None) -> None:
        self.record = record
        kept = "" if record is None or record.folder is None else f"\nthe record until then is kept in {record.folder}"
        super().__init__(message + kept)


class RunInterrupted(RunError):
    """The user stopped the run."""


class ParameterRefusedError(RunError):
    """A part refuses its parameters, before the first step."""

    exit_code = 2
