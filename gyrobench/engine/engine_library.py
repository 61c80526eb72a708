"""Libraries of the native engine: compiled once for each source, into the user's cache."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
import tempfile
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench
from gyrobench.files import make_once
from gyrobench.packaging import compiler

SOURCE = Path(__file__).with_name("engine.c")
_provided: list[Path] = []


def provide(file: Path) -> None:
    """Let this process, which has no compiler, use a library of the loop that was compiled elsewhere."""
    _provided.append(file)


def library_path(name: str, source: str) -> Path:
    """Return the place of a library in the cache: by its source, the compiler and its flags."""
    platform = compiler.this_platform()
    key = hashlib.sha256(source.encode() + compiler.identity(platform).encode()).hexdigest()[:20]
    return Bench.find().cache / f"{name}-{key}{compiler.PLATFORMS[platform][0]}"


def make_library(path: Path, source: str) -> Path:
    """Compile a library where it is not there, and return its path.  Raises CompilerError."""

    def compiled(path: Path) -> None:
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            file, library = Path(folder) / "engine.c", Path(folder) / path.name
            file.write_text(source, encoding="utf-8")
            compiler.compile_library(file, library, (), compiler.this_platform())
            os.replace(library, path)

    return make_once(path, compiled)


def open_library(path: Path) -> Any:
    """Return a loaded library (ctypes)."""
    library = ctypes.CDLL(str(path))
    library.gyrobench_run.restype = ctypes.c_int
    return library


@functools.cache
def engine_library() -> Path:
    """Return the library of the loop on FMI calls.  Raises CompilerError when there is no compiler or it fails."""
    if _provided:
        return _provided[0]
    source = SOURCE.read_text(encoding="utf-8")
    return make_library(library_path("engine", source), source)
