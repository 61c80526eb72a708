"""Controllers in a file of the user's own, C or Python, as parts: declarations, the part's source, the law in C.

A file is compiled, or its Python executed, only where the user himself has named it: on the command line or in a call
of the library.  What comes from elsewhere (a campaign, the browser, a stored run) names parts of the bench and FMUs.
"""

from __future__ import annotations

import ast
import dataclasses
import hashlib
from pathlib import Path

from gyrobench.bench import Bench, UsageError, display_path
from gyrobench.component import Component
from gyrobench.files import make_once, missing, write_whole
from gyrobench.packaging import compiler
from gyrobench.packaging.own_controller import c_law
from gyrobench.packaging.own_controller.declared_ports import Declarations, read_declarations
from gyrobench.packaging.own_controller.part_source import class_name, part_text
from gyrobench.user_code import UserCodeError, blamed, import_file

ENDINGS = (".c", ".py")
_named: set[Path] = set()  # files that the user has named
_loaded: dict[str, type[Component]] = {}  # by file and content


@dataclasses.dataclass(frozen=True)
class Outside:
    """The law in C that the class of a part has beside its model.py.

    unit: the C file to be compiled with the part.  glue: the function of the part that calls it.  size: of its answer.
    """

    unit: str
    glue: str
    size: int


def is_controller(part: object) -> bool:
    """Return whether the name of a part is that of such a file."""
    return str(part).endswith(ENDINGS)


def allow(part: object) -> None:
    """Note that the user has named this part: a file of a controller may be compiled.  Raises UsageError."""
    if is_controller(part):
        path = Path(str(part))
        if not path.is_file():
            raise UsageError(f"{part}: {missing(path)}")
        _named.add(path.resolve())


def load_controller(name: str) -> type[Component]:
    """Return the class of the part that a file is.  Raises UserCodeError with the line of the file."""
    path = Path(name)
    if path.resolve() not in _named:
        raise UserCodeError(
            f"{name}: a controller in a file is compiled only where you name it yourself: by --part on the command "
            f"line or in gyrobench.load; elsewhere name its FMU (gyrobench build {name})"
        )
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UserCodeError(f"{name}: cannot be read: {error}") from None
    key = hashlib.sha256(f"{path.resolve()}\0{text}".encode()).hexdigest()
    if key not in _loaded:
        _loaded[key] = _of_c(path, text) if path.suffix == ".c" else _of_python(path, text)
    return _loaded[key]


def _of_c(path: Path, text: str) -> type[Component]:
    declared = read_declarations(enumerate(text.splitlines(), 1), display_path(path))
    c_law.check_text(text, path)
    cls = _part(path, part_text(path.name, declared, None))
    unit = c_law.c_unit(text, path.name)
    key = hashlib.sha256(f"{unit}\0{declared}\0{compiler.identity(compiler.this_platform())}".encode()).hexdigest()[:20]
    suffix = compiler.PLATFORMS[compiler.this_platform()][0]
    library = make_once(
        Bench.find().cache / "controllers" / f"{path.stem}-{key}{suffix}",
        lambda made: c_law.compile_alone(text, path, declared, made),
    )
    size = len(declared.shown("output")) + len(declared.shown("state"))
    law = cls.pieces["sampled"][0].function.__globals__
    law["LAW"] = c_law.CLaw(library, path.name, declared)
    cls._outside = law["law"].outside = Outside(unit, c_law.glue(path.name, declared), size)
    return cls


def _of_python(path: Path, text: str) -> type[Component]:
    shown = display_path(path)
    try:
        tree = ast.parse(text, path.name)
    except SyntaxError as error:
        raise UserCodeError(f"{shown}:{error.lineno}: {error.msg}") from None
    classes = [c for c in tree.body if isinstance(c, ast.ClassDef)]
    found = [(c, f) for c in classes for f in c.body if isinstance(f, ast.FunctionDef) and f.name == "step"]
    if len(found) != 1:
        raise UserCodeError(f"{shown}: {len(found)} classes with a method step(self, inputs, dt); one is expected")
    cls, step = found[0]
    if any(ast.unparse(b).split(".")[-1] == "Component" for b in cls.bases):
        raise UserCodeError(
            f"{shown}: {cls.name} is a part in the language of equations: its place is components/NAME/model.py of a "
            "bench"
        )
    if [a.arg for a in step.args.args][1:] != ["inputs", "dt"]:
        raise UserCodeError(f"{shown}:{step.lineno}: write step(self, inputs, dt)")
    docstring = cls.body[0] if ast.get_docstring(cls) is not None else None
    lines = text.splitlines()[docstring.lineno - 1 : docstring.end_lineno] if docstring else []
    first = docstring.lineno if docstring else 0
    declared = read_declarations(((first + k, line.strip().strip('"')) for k, line in enumerate(lines)), shown)
    part = _part(path, part_text(path.name, declared, (text, cls.name)))
    law = part.pieces["sampled"][0].function.__globals__["LAW"]
    start, parameters = ([x for d in declared.of(k) for x in d.start] for k in ("state", "parameter"))
    first, *_, again = (law([u] * len(declared.shown("input")), start, parameters, 1e-3) for u in c_law.TRIED)
    if first != again:
        raise UserCodeError(
            f"{shown}: step() gives different outputs for the same inputs and state: it keeps something outside of its "
            "object, or draws random numbers; declare what it keeps as @state"
        )
    return part


def _part(path: Path, model: str) -> type[Component]:
    """Return the class of a model.py that is written into the cache: equations are read from files."""
    key = hashlib.sha256(model.encode()).hexdigest()[:20]
    stem = "".join(c if c.isalnum() or c == "_" else "_" for c in path.stem)
    stem = stem if stem[:1].isalpha() else f"controller_{stem}"
    folder = Bench.find().cache / "controllers" / key / stem
    file = make_once(folder / "model.py", lambda to: write_whole(to, model.encode(), durable=False))
    with blamed(path):
        module = import_file(file, f"gyrobench_controller_{key}")
    cls: type[Component] = getattr(module, class_name(path.name.rsplit(".", 1)[0]))
    cls.sources = {"model": str(file)}
    return cls


__all__ = ["Declarations", "Outside", "allow", "is_controller", "load_controller"]
