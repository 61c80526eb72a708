"""Errors as one message and an exit code, without a traceback, where the user can do something about them."""

from __future__ import annotations

import os
import traceback

from gyrobench.bench import Bench


def content_line(error: BaseException) -> str | None:
    """``file:line`` in a part or a system of a bench where an error comes from, if that is where it comes from."""
    rooms = tuple(str(Bench.find().folder / room) + os.sep for room in ("components", "systems"))
    if isinstance(error, SyntaxError) and str(error.filename).startswith(rooms):
        return f"{error.filename}:{error.lineno}"
    places = [f"{f.filename}:{f.lineno}" for f in traceback.extract_tb(error.__traceback__)]
    found = [p for p in places if p.startswith(rooms)]
    return found[-1] if found and found[-1] == places[-1] else None


def explain(error: Exception) -> tuple[str, int] | None:
    """Message and exit code of an error that the user can do something about; None for a fault of this program."""
    code = int(getattr(error, "exit_code", 2))
    if isinstance(error, FileNotFoundError | NotADirectoryError | IsADirectoryError | PermissionError):
        return f"{error.filename}: {error.strerror}", code
    if type(error).__module__.startswith(("gyrobench", "_gyrobench")) or isinstance(error, OSError):
        return str(error), code
    place = content_line(error)
    return (f"{place}: {type(error).__name__}: {getattr(error, 'msg', error)}", 2) if place else None
