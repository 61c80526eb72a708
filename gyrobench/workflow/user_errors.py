"""Errors for the user: one message and an exit code; after a run also the location of its record."""

from __future__ import annotations

import os
import shlex
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from gyrobench.bench import Bench, display_path, standard_folder
from gyrobench.errors import Advice, GyrobenchError
from gyrobench.files import missing

if TYPE_CHECKING:
    from gyrobench.record.record import Record

CONTENT = ("components", "systems", str(Path("reports", "templates")))
TOOL = Path(__file__).parents[1]


class PostRunError(GyrobenchError):
    """A failure after the run: its record is on disk, and the text says where, or in memory: attribute ``record``."""

    exit_code = 3

    def __init__(self, message: str, record: Record | None = None) -> None:
        self.record = record
        super().__init__(message)


class CommandInterrupted(PostRunError):
    """The user stopped a command: what was recorded is kept."""

    exit_code = 130


def _frames(error: BaseException) -> list[tuple[str, int | None]]:
    """Return file and line of every call on the way to an error, the innermost last."""
    frames = [(f.filename, f.lineno) for f in traceback.extract_tb(error.__traceback__)]
    if isinstance(error, SyntaxError) and error.filename:  # the file that cannot be compiled has no frame
        frames.append((error.filename, error.lineno))
    return frames


def content_location(error: BaseException) -> str | None:
    """Return ``file:line`` of the innermost call in the user's own bench, else in the standard one; None if in neither.

    An OSError that gyrobench itself met on the user's behalf (a file named in an option) has no location.
    """
    frames = _frames(error)
    benches = (Bench.find().folder, standard_folder())
    user, standard = (tuple(f"{bench / room}{os.sep}" for room in CONTENT) for bench in benches)
    if isinstance(error, OSError):
        known = [file for file, _ in frames if file.startswith((*user, *standard, str(TOOL) + os.sep))]
        if not known or not known[-1].startswith((*user, *standard)):
            return None
    for folders in (user, standard):
        lines = [f"{file}:{line}" for file, line in frames if file.startswith(folders)]
        if lines:
            return lines[-1]
    return None


def user_message(error: BaseException, at_shell: bool = True) -> str:
    """Return the message of an error for the user: its text; of errors that are not gyrobench's also type and place.

    at_shell: with the advice for a shell.
    """
    if isinstance(error, GyrobenchError):
        from gyrobench.report import ReportError  # after an error only: every command starts with this module

        if isinstance(error, ReportError):
            lines = [f"  - {name}: {user_message(cause, at_shell)}" for name, cause in error.failures.items()]
            return "\n".join(["report not complete:", *lines])
        return str(error) if at_shell else error.text
    place = content_location(error)
    if isinstance(error, OSError) and place is None:
        said = missing(Path(error.filename)) if isinstance(error, IsADirectoryError) else error.strerror
        return f"{error.filename}: {said}" if error.filename else said or str(error)
    if place is None:
        inside = [f"{file}:{line}" for file, line in _frames(error) if file.startswith(str(TOOL) + os.sep)]
        place = inside[-1] if inside else "unknown place"
    return f"{place}: {type(error).__name__}: {getattr(error, 'msg', error)}"


def exit_code(error: Exception) -> int | None:
    """Return the exit code of a command that ends with this error; None for a fault of gyrobench itself."""
    if isinstance(error, GyrobenchError):
        return error.exit_code
    return 2 if isinstance(error, OSError) or content_location(error) else None


@contextmanager
def record_kept(
    folder: Path | None, record: Record | None = None, save: Callable[[], object] | None = None
) -> Iterator[None]:
    """Turn any failure after a run into a PostRunError that names the folder of the record and the next step.

    folder: None for a record in memory, which the error then holds.
    save: writes the record of measured data, unless the failure is a GyrobenchError: those concern the data, and pass.
    """
    try:
        yield
    except PostRunError:
        raise
    except (Exception, KeyboardInterrupt) as error:
        if save is not None:
            if isinstance(error, GyrobenchError):
                raise
            save()
        kind: type[PostRunError]
        if isinstance(error, KeyboardInterrupt):
            kind, said, when = CommandInterrupted, "interrupted; ", "to reduce it"
        else:
            kind, said, when = PostRunError, f"{user_message(error, at_shell=False)}\n", "after correcting the cause"
        advice = getattr(error, "advice", ())
        if folder is None:
            kept = "in memory, in the attribute 'record' of this error"
        else:
            kept = f"in {display_path(folder)}"
            advice += (Advice("reduce", f"{when}: gyrobench report {shlex.quote(display_path(folder))}"),)
        raise kind(f"{said}the record is kept {kept}", record).advised(*advice) from error
