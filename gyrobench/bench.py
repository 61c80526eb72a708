"""A bench is a folder with components/, systems/, reports/ and fmus/; the standard bench ships inside."""

from __future__ import annotations

import difflib
import errno
import functools
import hashlib
import os
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gyrobench import reading
from gyrobench.errors import GyrobenchError
from gyrobench.files import missing, temporary_folder

ROOMS = ("components", "systems", "reports")


class BenchError(GyrobenchError):
    """There is no such bench, part or system; the text lists what there is."""


class UsageError(GyrobenchError):
    """The user asks for something that does not exist or does not fit; the text says what would."""


MANY = 30  # names that nobody reads in a message


def near_names(name: str, known: Sequence[str]) -> list[str]:
    """Return names like ``name`` (in other letters, a misprint, a part of them), the nearest first."""
    return (
        [k for k in known if k.casefold() == name.casefold()]
        or difflib.get_close_matches(name, known, n=1, cutoff=0.85)
        or difflib.get_close_matches(name, known, n=3, cutoff=0.5)
        or [k for k in known if name and name in k]
    )


def suggest_names(name: str, known: Iterable[str]) -> str:
    """Return names like ``name`` (a misprint), else all there are, as the end of a message."""
    known = list(known)
    if near := near_names(name, known):
        return f"did you mean {' or '.join(near)}?"
    return f"gyrobench list shows all {len(known)}" if len(known) > MANY else f"there are: {', '.join(known) or 'none'}"


def display_path(path: Path) -> str:
    """Return a path from the working folder, where it lies in it."""
    path, here = path.resolve(), working_folder()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)


def working_folder() -> Path:
    """Return the working folder.  Raises UsageError where it was removed."""
    try:
        return Path.cwd()
    except FileNotFoundError:
        raise UsageError("the working folder does not exist any more: change into one that does") from None


@functools.cache
def _writable(folder: Path) -> Path:
    """Return a folder of files that can be made again, and can be written to: this one, else one of the process."""
    try:
        if folder.parts[:1] == ("~",):  # which nothing could expand
            raise FileNotFoundError(errno.ENOENT, "no home folder")
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        instead = temporary_folder()
        print(
            f"note: {folder}: {error.strerror}: what is built is kept until this command ends; "
            "GYROBENCH_CACHE names a folder that stays",
            file=sys.stderr,
        )
        return instead


def standard_folder() -> Path:
    """The bench that ships with gyrobench: in the wheel, or the checkout this file stands in."""
    here = Path(__file__).parent
    packed = here / "_bench"
    return packed if packed.is_dir() else here.parent


@dataclass(frozen=True)
class Bench:
    """Folders of a bench.  A part or system that the own bench lacks is taken from the standard one."""

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
        for here in (working_folder(), *working_folder().parents):
            if all((here / room).is_dir() for room in ROOMS):
                return Bench(here.resolve())
        return Bench(standard_folder())

    @property
    def packed(self) -> bool:
        """True for the bench inside an installed wheel, which is not written to."""
        return self.folder.resolve() == (Path(__file__).parent / "_bench").resolve()

    @property
    def home(self) -> Path:
        """Return the folder for results: the bench the user stands in, else the working folder."""
        here = working_folder()
        return self.folder if not self.packed and here.is_relative_to(self.folder) else here

    @property
    def fmus(self) -> Path:
        """FMUs that were built on the way, for a run; those of the packed bench stay out of the user's folders."""
        if not self.packed:
            return self.folder / "fmus"
        return self.cache / f"fmus-{hashlib.sha256(str(self.folder).encode()).hexdigest()[:8]}"

    @property
    def products(self) -> Path:
        """Return the folder of products asked for by name (FMUs, SSP archives, containers)."""
        return self.home / "fmus"

    @property
    def cache(self) -> Path:
        """Return the user's folder of built files; one of this process where that cannot be written to."""
        base = os.environ.get("GYROBENCH_CACHE") or os.environ.get("XDG_CACHE_HOME")
        return _writable(Path(base or os.path.expanduser("~/.cache")) / "gyrobench")

    @property
    def out(self) -> Path:
        """Records and reports: ``reports/out``."""
        return self.home / "reports" / "out"

    def _listing(self, room: str, file: str) -> dict[str, Path]:
        found: dict[str, Path] = {}
        for root in dict.fromkeys((standard_folder(), self.folder)):
            for f in sorted((root / room).glob(f"*/{file}")):
                found[f.parent.name] = f.parent
        return found

    def parts(self) -> dict[str, Path]:
        return self._listing("components", "model.py")

    def systems(self) -> dict[str, Path]:
        return self._listing("systems", "system.py")

    def specifications(self) -> dict[str, Path]:
        """Acceptance specifications: name -> file."""
        found: dict[str, Path] = {}
        for root in (standard_folder(), self.folder):
            found.update({f.stem: f for f in sorted((root / "reports" / "specs").glob("*.toml"))})
        return found

    def instruments(self) -> dict[str, Path]:
        """Data sheets of instruments: name -> file."""
        roots = (standard_folder(), self.folder)
        return {f.stem: f for root in roots for f in sorted((root / "instruments").glob("*.toml"))}

    def existing(self, file: Path) -> Path:
        """Return a file as the user names it where it is there, else of that path in the bench (systems/X/FILE)."""
        candidates = (root / file for root in (Path(), self.folder, standard_folder()))
        return next((f for f in candidates if f.exists()), file)

    def part_folder(self, name: str) -> Path:
        """Raises BenchError, naming the parts that are like it."""
        return self._folder("part", "components", "model.py", name)

    def system_folder(self, name: str) -> Path:
        """Raises BenchError, naming the systems that are like it."""
        return self._folder("system", "systems", "system.py", name)

    def _folder(self, kind: str, room: str, file: str, name: str) -> Path:
        for root in (self.folder, standard_folder()):
            if name not in ("", "..") and Path(name).name == name and (root / room / name / file).is_file():
                return root / room / name
        if Path(name).is_dir():
            raise BenchError(f"no {kind} '{name}', which is {missing(Path(name))}")
        known = self._listing(room, file)
        part_of = standard_folder() / "systems" / "part_of.toml"
        whole = reading.toml(reading.read_text(part_of, BenchError), part_of, BenchError).get(name)
        hint = f"that is part of {whole}" if whole in known else suggest_names(name, known)
        raise BenchError(f"no {kind} '{name}'; {hint}")
