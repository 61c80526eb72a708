"""Processes that a killed run may have left."""

from __future__ import annotations

import os
from pathlib import Path


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
