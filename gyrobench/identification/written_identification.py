"""An identified loop with its page: the result of identification."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gyrobench.identification.identification import LoopIdentification


@dataclass(frozen=True)
class Identification(LoopIdentification):
    """Responses with intervals, margins, nonlinearity; ``print`` shows them as a text."""

    def write(self, folder: str | Path) -> dict[str, Path]:
        """Write identification.json, identification.html and identification.pdf; return the path of each format."""
        from gyrobench.identification.identification_page import write_identification

        return write_identification(self, Path(folder))

    def __str__(self) -> str:
        return self.text()
