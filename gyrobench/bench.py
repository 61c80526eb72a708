"""A bench is a folder with components/, systems/, reports/ and fmus/; the standard bench ships inside."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

ROOMS = ("components", "systems", "reports")


class BenchError(Exception):
    """There is no such bench, part or system; the text lists what there is."""


def standard_folder() -> Path:
    """The bench that ships with gyrobench: in the wheel, or the checkout this file stands in."""
    here = Path(__file__).parent
    packed = here / "_bench"
    return packed if packed.is_dir() else here.parent


@dataclass(frozen=True)
class Bench:
    """Where things are.  A part or system that the own bench lacks is taken from the standard one."""

    folder: Path

    @staticmethod
    def find(folder: Path | None = None) -> Bench:
        """The given folder, else the nearest parent of the working folder that is a bench, else the standard.

        Raises BenchError if the given folder is no bench.
        """
        if folder is not None:
            if not (folder / "components").is_dir():
                raise BenchError(f"{folder} is no bench: it has no folder components/ (make one: gyrobench init NAME)")
            return Bench(folder.resolve())
        for here in (Path.cwd(), *Path.cwd().parents):
            if all((here / room).is_dir() for room in ROOMS):
                return Bench(here)
        return Bench(standard_folder())

    @property
    def own(self) -> bool:
        """False for the bench inside an installed wheel, which is not written to."""
        return self.folder != Path(__file__).parent / "_bench"

    @property
    def fmus(self) -> Path:
        return self.folder / "fmus" if self.own else Path.cwd() / "fmus"

    @property
    def cache(self) -> Path:
        base = os.environ.get("GYROBENCH_CACHE") or os.environ.get("XDG_CACHE_HOME")
        return Path(base) / "gyrobench" if base else Path.home() / ".cache" / "gyrobench"

    @property
    def out(self) -> Path:
        return (self.folder if self.own else Path.cwd()) / "reports" / "out"

    def _listing(self, room: str, file: str) -> dict[str, Path]:
        found: dict[str, Path] = {}
        for root in (standard_folder(), self.folder):
            for f in sorted((root / room).glob(f"*/{file}")):
                found[f.parent.name] = f.parent
        return found

    def parts(self) -> dict[str, Path]:
        return self._listing("components", "model.py")

    def systems(self) -> dict[str, Path]:
        return self._listing("systems", "system.py")

    def part_folder(self, name: str) -> Path:
        """Raises BenchError, naming the parts there are."""
        found = self.parts()
        if name not in found:
            raise BenchError(f"no part {name!r} in {self.folder}; there are: {', '.join(found)}")
        return found[name]

    def system_folder(self, name: str) -> Path:
        """Raises BenchError, naming the systems there are."""
        found = self.systems()
        if name not in found:
            raise BenchError(f"no system {name!r} in {self.folder}; there are: {', '.join(found)}")
        return found[name]
