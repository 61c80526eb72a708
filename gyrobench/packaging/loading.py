"""Loading of parts: the class of a folder of components/, with what it imports from other parts and from blocks.

``from components.floated_gyro.model import FloatedGyro`` in a part finds the bench at hand first, then the standard
bench, whether gyrobench is a checkout or an installed wheel.  A part may be made of the standard part of its own name.
"""

from __future__ import annotations

import hashlib
import inspect
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from gyrobench.bench import Bench, standard_folder
from gyrobench.component import Component
from gyrobench.errors import GyrobenchError
from gyrobench.packaging.own_controller import is_controller, load_controller
from gyrobench.user_code import check_attributes, import_file

ROOM = "components"
_loaded: dict[str, tuple[type[Component], dict[Path, str]]] = {}  # by file: the class, and the hashes of its sources

_loading = threading.RLock()  # the modules of one part stand for ``components`` at a time; parts may load others


class BuildError(GyrobenchError):
    """A part that cannot be built; the text says which and why."""


@contextmanager
def content_imports(folder: Path, part: Path | None = None) -> Iterator[dict[str, Path]]:
    """While active, ``components`` is that of the bench ``folder``, then that of the standard bench.

    Yields a dictionary that holds the files imported so, by module name, at the end.  part: the folder being loaded,
    which is not found by its own imports.
    """
    before = {n: m for n, m in sys.modules.items() if n == ROOM or n.startswith(f"{ROOM}.")}
    for n in before:
        del sys.modules[n]
    roots = list(dict.fromkeys([folder / ROOM, standard_folder() / ROOM]))
    package = ModuleType(ROOM)
    package.__path__ = [str(r) for r in roots]
    sys.modules[ROOM] = package
    if part is not None:
        package_of_part = ModuleType(f"{ROOM}.{part.name}")
        package_of_part.__path__ = [str(r / part.name) for r in roots if r / part.name != part]
        sys.modules[package_of_part.__name__] = package_of_part
    files: dict[str, Path] = {}
    try:
        yield files
    finally:
        for n in [n for n in sys.modules if n == ROOM or n.startswith(f"{ROOM}.")]:
            file = getattr(sys.modules.pop(n), "__file__", None)
            if file:
                files[n] = Path(file)
        sys.modules.update(before)


def load_part(name: str, bench: Path | None = None) -> type[Component]:
    """Return the Component class of components/<name>/model.py, or of a controller in a file of its own.

    Raises BuildError if there is none, or two.
    """
    with _loading:
        if is_controller(name):
            return load_controller(name)
        return _load(name, bench)


def _load(name: str, bench: Path | None) -> type[Component]:
    home = Bench.find(bench)
    path = home.part_folder(name) / "model.py"
    known = _loaded.get(f"{home.folder}:{path.resolve()}")
    if known is not None and all(f.exists() and _digest(f) == h for f, h in known[1].items()):
        return known[0]
    key = "gyrobench_part_" + hashlib.sha256(f"{home.folder}:{path.resolve()}".encode()).hexdigest()[:16]
    with content_imports(home.folder, path.parent) as files:
        module = import_file(path, key)
    classes = [
        c
        for c in vars(module).values()
        if inspect.isclass(c) and issubclass(c, Component) and c.__module__ == module.__name__
    ]
    if len(classes) != 1:
        raise BuildError(f"{path}: one Component class is expected, found {len(classes)}")
    cls: type[Component] = classes[0]
    check_attributes(cls, Component, path)
    cls.sources = {"model": str(path), **{n: str(f) for n, f in files.items()}}
    _loaded[f"{home.folder}:{path.resolve()}"] = cls, {f: _digest(f) for f in (path, *files.values())}
    return cls


def sources(cls: type[Component]) -> dict[str, Path]:
    """Return the files that a part consists of by module name, its own as "model" first."""
    files: dict[str, str] = vars(cls).get("sources", {})
    return {n: Path(f) for n, f in files.items()} or {"model": Path(inspect.getfile(cls))}


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
