"""Progress of a run on standard error: on a terminal one line that is updated, elsewhere a line from time to time."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Any

from gyrobench.workflow.progress_words import format_status

QUIET = 1.0  # s before the first output, so that short runs stay silent
PAUSE = 10.0  # s between two lines where there is no terminal


class ProgressDisplay:
    """The ``progress`` of a run; a context manager."""

    def __init__(self, label: str) -> None:
        self.label = label
        self.bar: Any = None
        self.task: Any = None
        self.last = time.monotonic()

    def __enter__(self) -> ProgressDisplay:
        return self

    def __call__(self, status: Any) -> None:
        if sys.stderr.isatty():
            if self.bar is None and status.elapsed >= QUIET:
                self._open()
            if self.bar is not None:
                self.bar.update(self.task, completed=status.fraction, words=format_status(status))
        elif time.monotonic() - self.last >= PAUSE:
            self.last = time.monotonic()
            print(
                f"{self.label}: {100.0 * status.fraction:.0f} %, {format_status(status)}", file=sys.stderr, flush=True
            )

    def _open(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

        columns = (
            TextColumn("{task.description}"),
            BarColumn(24),
            TaskProgressColumn(),
            TextColumn("{task.fields[words]}"),
        )
        self.bar = Progress(*columns, console=Console(stderr=True), transient=True)
        self.task = self.bar.add_task(self.label, total=1.0, words="")
        self.bar.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.bar is not None:
            self.bar.stop()
