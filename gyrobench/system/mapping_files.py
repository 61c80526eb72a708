"""Mapping files: what the variables of a foreign FMU are called in a socket, with units and constants."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gyrobench import reading
from gyrobench.system.binding import SocketMismatchError


def load_mapping(file: Path | None) -> dict[str, Any]:
    """Reads a mapping file; None gives the empty mapping.  Raises SocketMismatchError when it is not readable."""
    if file is None:
        return {}
    return parse_mapping(reading.read_text(Path(file), _unreadable), str(file))


def parse_mapping(text: str, file: str) -> dict[str, Any]:
    """Return the mapping of a text.  Raises SocketMismatchError when it is not TOML."""
    return reading.toml(text, file, _unreadable)


def _unreadable(why: str) -> SocketMismatchError:
    return SocketMismatchError("mapping file", [why])
