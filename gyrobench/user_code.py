"""Python files that people write, parts and systems: whatever is wrong in one ends in an error that names it.

An exception of the file itself passes: its traceback names the line.  What has no line in it, since it cannot be
compiled or what it declares is of another type, is a :class:`UserCodeError`, as is an end of the program and a loop
without an end.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib.util
import sys
import threading
import traceback
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

from gyrobench.bench import standard_folder
from gyrobench.errors import GyrobenchError
from gyrobench.reading import shorten

LONGEST = 60.0  # s that a file may take to be loaded; those of the bench take some ms


class UserCodeError(GyrobenchError):
    """A part or system that cannot be loaded; the text names the file and what is wrong in it."""


@contextlib.contextmanager
def blamed(file: Path) -> Iterator[None]:
    """While a file is loaded, or what it declares is used: raise UserCodeError for an error without a line in it."""
    try:
        with _deadline(file):
            yield
    except SystemExit as end:
        raise UserCodeError(f"{file}: ends the program (SystemExit: {end.code}) while it is loaded") from None
    except GyrobenchError:
        raise
    except Exception as error:
        lines = {frame.filename for frame in traceback.extract_tb(error.__traceback__)}
        folder = str(file.parent)
        own = isinstance(error, SyntaxError) and error.filename
        if own or any(name.startswith(folder) for name in lines) or file.is_relative_to(standard_folder()):
            raise
        many = (
            "; a sum of thousands of terms, or as many brackets? part it" if isinstance(error, RecursionError) else ""
        )
        raise UserCodeError(f"{file}: cannot be used: {type(error).__name__}: {error}{many}") from error


def import_file(path: Path, name: str) -> ModuleType:
    """Import one file under a module name of its own, so that parts of two benches do not mix."""
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        with blamed(path):
            spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


class _DeadlineError(GyrobenchError):
    """The file has taken too long."""


@contextlib.contextmanager
def _deadline(file: Path) -> Iterator[None]:
    """Raise UserCodeError where code of the file's folder still runs after LONGEST, in whatever thread."""
    thread, ended = threading.get_ident(), threading.Event()

    def watch() -> None:
        wait = LONGEST
        while not ended.wait(wait):
            if _place(sys._current_frames().get(thread), file):  # not while the bench compiles, however long that takes
                ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(_DeadlineError))
            wait = 1.0

    watching = threading.Thread(target=watch, daemon=True)
    watching.start()
    try:
        yield
    except _DeadlineError as late:
        frames = [f"{f.filename}:{f.lineno}" for f in traceback.extract_tb(late.__traceback__)]
        place = [f for f in frames if f.startswith(str(file.parent))][-1:] or [str(file)]
        raise UserCodeError(f"{place[0]}: still running after {LONGEST:g} s: a loop without an end?") from None
    finally:
        ended.set()
        watching.join()  # a run forks where there is no other thread


def _place(frame: FrameType | None, file: Path) -> bool:
    """Return whether a frame or one that called it is of the folder of the file."""
    while frame is not None:
        if frame.f_code.co_filename.startswith(str(file.parent)):
            return True
        frame = frame.f_back
    return False


def check_attributes(cls: type, base: type, file: Path, content: Mapping[str, type] | None = None) -> None:
    """Raise UserCodeError for an attribute of a class whose type is not that of the base's: ``version = 5``.

    content: attribute -> type of the values of this dictionary.
    """
    kinds: tuple[tuple[type, Any, str], ...] = (
        (str, str, "a text"), (tuple, Iterable, "a list of texts"), (Mapping, Mapping, "a dictionary"),
        (float, int | float, "a number"),
    )  # fmt: skip
    for name, value in vars(cls).items():
        standard = None if name == "__doc__" else getattr(base, name, None)
        if name.startswith("__") or callable(value) or hasattr(type(value), "__get__"):
            continue
        for of, admitted, words in kinds:
            text = isinstance(value, str) and admitted is not str
            if isinstance(standard, of) and (text or not isinstance(value, admitted)):
                raise UserCodeError(f"{file}: {cls.__name__}.{name} = {shorten(repr(value))}: {words} is expected")
        wanted = (content or {}).get(name, object)
        for key, entry in value.items() if isinstance(value, Mapping) else ():
            if not isinstance(entry, wanted):
                where = f"{file}: {cls.__name__}.{name}[{key!r}]"
                raise UserCodeError(f"{where} = {shorten(repr(entry))}: not a {wanted.__name__}")
    if cls.__doc__ is not None and not isinstance(cls.__doc__, str):
        raise UserCodeError(f"{file}: {cls.__name__}.__doc__ is no text")
