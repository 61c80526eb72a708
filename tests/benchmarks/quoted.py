"""Measured figures, into docs/figures.toml; ``python docs/figures.py --write`` then puts them into the pages."""

from __future__ import annotations

import importlib.metadata
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))
import figures


def record(key: str, value: str | dict[str, str], unit: str, *words: str) -> None:
    """Write one figure, as it is to be printed, with this version of gyrobench.

    value: a text, or texts by the name of their column.  words: of the command that repeats it, after "python".
    """
    found = figures.load()
    version = importlib.metadata.version("gyrobench")
    found[key] = {"value": value, "unit": unit, "command": " ".join(("python", *words)), "version": version}
    figures.dump(found)
