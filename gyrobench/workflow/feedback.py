"""Feedback of a run to the user: notes before it, progress during it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gyrobench.engine.run_driver import ProgressReport

Progress = Callable[["ProgressReport"], None]


def _no_notes(notes: Iterable[str]) -> None:
    pass


def _no_progress(label: str) -> contextlib.AbstractContextManager[Progress | None]:
    return contextlib.nullcontext()


@dataclass(frozen=True)
class Feedback:
    """Receiver of notes, and of progress as a context manager for each run; by default both are dropped.

    The notes are in run.json and in the report all the same.
    """

    notes: Callable[[Iterable[str]], None] = _no_notes
    progress: Callable[[str], contextlib.AbstractContextManager[Progress | None]] = _no_progress


SILENT = Feedback()
