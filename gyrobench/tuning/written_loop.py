"""A tuned loop with its page: what tuning returns."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gyrobench.tuning.tuned_loop import LoopTuning
from gyrobench.tuning.tuning_page import write_tuning


@dataclass(frozen=True)
class TunedLoop(LoopTuning):
    """Controller, wishes and what came of them, proof, reasons; ``print`` shows them as a text."""

    def write(self, folder: str | Path) -> dict[str, Path]:
        """Write tuning.json, tuning.html and tuning.pdf into a folder; return the path of each format."""
        return write_tuning(self, Path(folder))

    def __str__(self) -> str:
        return self.text()
