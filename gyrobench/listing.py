"""What a bench holds, read without importing it, so that ``gyrobench list`` answers at once; and new benches."""

from __future__ import annotations

import ast
import re
import shutil
import tomllib
from pathlib import Path
from typing import Any

from gyrobench.bench import ROOMS, Bench, BenchError


def _class_text(file: Path, base: str) -> tuple[str, dict[str, Any]]:
    """(first sentence of the docstring, literal class attributes) of the one class derived from ``base``."""
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef) and any(ast.unparse(b).endswith(base) for b in node.bases):
            attributes: dict[str, Any] = {}
            for s in node.body:
                if isinstance(s, ast.Assign) and isinstance(s.targets[0], ast.Name):
                    try:
                        attributes[s.targets[0].id] = ast.literal_eval(s.value)
                    except ValueError:
                        continue
            doc = ast.get_docstring(node) or ""
            return doc, attributes
    return "", {}


def _entry(name: str, file: Path, base: str) -> dict[str, Any]:
    doc, attributes = _class_text(file, base)
    first = doc.splitlines()[0] if doc else ""
    marks = re.search(r"\[([A-Z][A-Z0-9-]+(?:[,;] *[A-Z][A-Z0-9-]+)*)", first)
    spec = list(attributes.get("spec", ())) or (re.split(r"[,;] *", marks.group(1)) if marks else [])
    what = str(attributes.get("title") or re.sub(r"\s*\[.*", "", first)).rstrip(".")
    return {"name": name, "what": what, "spec": spec, "folder": str(file.parent)}


def _title(file: Path) -> str:
    try:
        return str(tomllib.loads(file.read_text(encoding="utf-8")).get("title", ""))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        return f"cannot be read: {error}"


def listing(bench: Bench) -> dict[str, list[dict[str, Any]]]:
    """Parts, systems, sockets and acceptance specifications: a list of {name, what, spec, folder} each."""
    from gyrobench.system.sockets import SOCKETS

    return {
        "parts": [_entry(n, f / "model.py", "Component") for n, f in bench.parts().items()],
        "systems": [_entry(n, f / "system.py", "System") for n, f in bench.systems().items()],
        "sockets": [{"name": s.name, "what": s.meaning} for s in SOCKETS.values()],
        "specifications": [{"name": n, "what": _title(f), "file": str(f)} for n, f in bench.specifications().items()],
    }


README = """# {name}

A bench for gyrobench: parts in `components/`, systems in `systems/`, acceptance specifications in
`reports/specs/`. What is not here is taken from the standard bench; a part or system of the same name
stands in for the standard one.

    gyrobench list
    gyrobench run tumble_single_axis
"""


def init_bench(folder: Path, copies: list[str]) -> list[str]:
    """Makes the rooms of a new bench and copies parts into it; returns what was made, a line each.

    Raises BenchError if the folder exists and is not empty, or a part does not exist.
    """
    if folder.exists() and any(folder.iterdir()):
        raise BenchError(f"{folder} exists and is not empty: choose another name")
    standard = Bench.find()
    sources = {name: standard.part_folder(name) for name in copies}
    for room in (*ROOMS, "fmus"):
        (folder / room).mkdir(parents=True, exist_ok=True)
    (folder / "README.md").write_text(README.format(name=folder.name), encoding="utf-8")
    (folder / ".gitignore").write_text("fmus/*.fmu\nreports/out/\n", encoding="utf-8")
    lines = [f"{folder}: a new bench"]
    for name, source in sources.items():
        shutil.copytree(source, folder / "components" / name, ignore=shutil.ignore_patterns("__pycache__"))
        lines.append(f"{folder / 'components' / name}: a copy of {name}; change model.py, then: gyrobench build {name}")
    return lines
