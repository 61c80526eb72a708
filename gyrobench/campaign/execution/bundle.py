"""Bundle of what workers need, by content: sources of the bench's systems and parts, built FMUs, the native engine.

A worker that has it needs no bench, no compiler and no common file system; only gyrobench itself, of the same source.
"""

from __future__ import annotations

import functools
import hashlib
import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from gyrobench.bench import Bench
from gyrobench.files import sha256, temporary_folder

#: rooms of the tool whose text does not determine a result
OTHER_ROOMS = ("campaign", "design", "commands", "library", "workflow", "exchange", "_bench")
SOURCES = (".py", ".toml", ".j2", ".css", ".js", ".typ", ".json")


@dataclass(frozen=True)
class Assigned:
    """The parts of a system: how a session gets them.

    parts: slot -> part of the bench or "fmus/SHA/NAME.fmu" of the bundle.  prebuilt: part of the bench -> its FMU in
    the bundle.  maps: slot -> mapping file in the bundle.
    """

    parts: Mapping[str, str]
    prebuilt: Mapping[str, str]
    maps: Mapping[str, str]


@dataclass
class Bundle:
    """The files by their path in it."""

    files: dict[str, bytes] = field(default_factory=dict)

    def add(self, file: Path, name: str = "") -> str:
        """Add a file, by default under its content, and return its path in the bundle."""
        name = name or f"fmus/{sha256(file)[:16]}/{file.name}"
        if name not in self.files:
            self.files[name] = file.read_bytes()
        return name

    def add_bench(self, bench: Bench) -> None:
        """Add the sources of all parts and systems at hand, and the templates of reports."""
        for room, folders in (("components", bench.parts()), ("systems", bench.systems())):
            for name, folder in folders.items():
                for file in sorted(folder.rglob("*")):
                    if file.suffix in SOURCES and "__pycache__" not in file.parts:
                        self.add(file, f"bench/{room}/{name}/{file.relative_to(folder)}")
        for file in sorted((bench.folder / "reports" / "templates").rglob("*")):
            if file.is_file():
                self.add(file, f"bench/reports/templates/{file.relative_to(bench.folder / 'reports' / 'templates')}")

    def packed(self) -> bytes:
        """Return the bundle as bytes; equal files give equal bytes."""
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for name in sorted(self.files):
                archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), self.files[name], zipfile.ZIP_DEFLATED)
        return buffer.getvalue()


@functools.lru_cache(maxsize=4)
def unpack(content: bytes) -> Path:
    """Return the folder of a bundle in this process."""
    folder = temporary_folder()
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(folder)
    (folder / "bench" / "components").mkdir(parents=True, exist_ok=True)
    return folder


def digest_of(files: Mapping[str, Path]) -> str:
    """Return a hash of files and their names."""
    digest = hashlib.sha256()
    for name, file in sorted(files.items()):
        digest.update(f"{name}\0{sha256(file)}\0".encode())
    return digest.hexdigest()


@functools.cache
def tool_digest() -> str:
    """Return a hash of the part of gyrobench that determines results; it stays as it is while the process runs."""
    tool = Path(__file__).parents[2]
    files = {str(f.relative_to(tool)): f for f in tool.rglob("*") if f.suffix in (".py", ".c", ".h")}
    return digest_of({n: f for n, f in files.items() if Path(n).parts[0] not in OTHER_ROOMS})
