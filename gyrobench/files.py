"""Files that are written whole or not at all, their digests, and the files of an FMU."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path


def write_whole(path: Path, content: bytes | Callable[[Path], object]) -> None:
    """Write a file under a temporary name beside ``path`` and rename it; a failure leaves the old file as it was.

    content: of the file, or a function that writes it to the path it is given.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".part")
    os.close(handle)
    temporary = Path(name)
    try:
        if isinstance(content, bytes):
            temporary.write_bytes(content)
        else:
            content(temporary)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file as hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def unzip_fmu(path: Path, folder: Path) -> None:
    """Unzip what a run needs of an FMU: all but its sources and its documentation, which are most of its files."""
    from fmpy import extract

    extract(str(path), str(folder), include=lambda name: not name.startswith(("sources/", "documentation/")))
