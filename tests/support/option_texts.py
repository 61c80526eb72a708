"""What the options of a system say, for the tests of its lines in other languages."""

from __future__ import annotations

from pathlib import Path

from gyrobench.bench import standard_folder
from gyrobench.workflow.inputs import load_test


def option_texts(file: Path) -> set[str]:
    """Return the texts of the options of the system beside whose code a catalogue lies; none of another catalogue."""
    if file.parent.parent != standard_folder() / "systems":
        return set()
    return {option.doc for option in load_test(file.parent.name).options.values()}
