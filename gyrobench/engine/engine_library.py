"""The native engine's library: compiled once for each version of its source, into the user's cache."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import os
import tempfile
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench
from gyrobench.packaging import compiler

SOURCE = Path(__file__).with_name("engine.c")


@functools.cache
def engine_library() -> Any:
    """Return the loaded library (ctypes).  Raises CompilerError when there is no compiler or it fails."""
    platform = compiler.this_platform()
    key = hashlib.sha256(SOURCE.read_bytes() + compiler.identity(platform).encode()).hexdigest()[:20]
    path = Bench.find().cache / f"engine-{key}{compiler.PLATFORMS[platform][0]}"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            compiled = Path(folder) / path.name
            compiler.compile_library(SOURCE, compiled, (), platform)
            os.replace(compiled, path)
    library = ctypes.CDLL(str(path))
    library.gyrobench_run.restype = ctypes.c_int
    return library
