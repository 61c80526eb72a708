"""The library of a native FMU: its model is compiled once for both FMI versions, the face of a version once for all."""

from __future__ import annotations

import hashlib
import re
import tempfile
from collections.abc import Mapping
from pathlib import Path

from gyrobench.bench import Bench
from gyrobench.files import make_once
from gyrobench.packaging import compiler
from gyrobench.packaging.own_controller.c_law import UNIT

GUID = re.compile(r"^#define MODEL_GUID (.*)\n", re.MULTILINE)


def make_library(files: Mapping[str, str], name: str, fmi: int, platform: str, library: Path) -> None:
    """Compile the sources of an FMU, which are one unit there, in two: see instance.h.  Raises CompilerError.

    files: by name.  name: of the component.  library: the file that is written; others may be left beside it.
    """
    guid = GUID.search(files["model.c"])
    assert guid is not None
    face = {n: text for n, text in files.items() if n.startswith("fmi") or n == "instance.h"}
    model = {n: text for n, text in files.items() if not n.startswith("fmi") and n != UNIT}
    model["model.c"] = GUID.sub("", files["model.c"])
    objects = [_object(name, "instance.c", model, platform), _object(f"fmi{fmi}", f"fmi{fmi}.c", face, platform)]
    if UNIT in files:
        objects.append(_object(f"{name}-{Path(UNIT).stem}", UNIT, {UNIT: files[UNIT]}, platform))
    own = library.with_suffix(".c")
    own.write_text(f"const char guid[40] = {guid[1]};\n", encoding="utf-8")
    compiler.compile_library(own, library, (), platform, tuple(objects))


def _object(name: str, unit: str, files: Mapping[str, str], platform: str) -> Path:
    """Return the object of a unit, from the cache where its files, the compiler and its flags are the same."""
    content = "\0".join((compiler.identity(platform), unit, *(f"{n}\0{files[n]}" for n in sorted(files))))
    key = hashlib.sha256(content.encode()).hexdigest()[:20]

    def write(path: Path) -> None:
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            for n, text in files.items():
                (Path(folder) / n).write_text(text, encoding="utf-8")
            made = Path(folder) / path.name
            compiler.compile_object(Path(folder) / unit, made, (Path(folder),), platform)
            made.replace(path)

    return make_once(Bench.find().cache / f"{name}-{key}.o", write)
