"""Runs that are to be interrupted or killed, and the processes that they may have left."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from gyrobench.engine import child, run_driver, supervision


def processes_in(folder: Path) -> list[str]:
    """Return the processes but this one that have files below a folder mapped."""
    found = []
    for maps in Path("/proc").glob("[0-9]*/maps"):
        try:
            if int(maps.parent.name) != os.getpid() and str(folder) in maps.read_text():
                found.append(maps.parent.name)
        except OSError:
            continue
    return found


@contextlib.contextmanager
def unhurried() -> Iterator[None]:
    """Runs that pause after each thousand steps or so, for an interrupt that comes before the end of a short one."""
    execute = child.execute

    def pausing(job: Any, instances: Any, board: Any, progress: Any, stopped: Callable[[], bool]) -> Any:
        return execute(job, instances, board, progress, lambda: time.sleep(0.05) or stopped())

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(child, "execute", pausing)
        patch.setattr(run_driver, "CHUNK", 0.001)
        patch.setattr(supervision, "REPORT", 0.0)
        # a child that is no fork would not have these; the threads that other tests have left hold no lock
        patch.setattr(supervision, "can_fork", lambda: True)
        yield
