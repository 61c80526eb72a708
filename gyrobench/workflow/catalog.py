"""Contents of a bench, read without importing them, so that ``gyrobench list`` is fast; and new benches."""

from __future__ import annotations

import ast
import contextlib
import re
import shlex
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gyrobench import reading
from gyrobench.bench import ROOMS, Bench, BenchError, UsageError, suggest_names

#: a class that derives from another: what its docstring is indented by, and the docstring
CLASS = re.compile(r'^class \w+\([^)]*\w[^)]*\):[^\n]*\n\s*?([ \t]+)[rR]?"""\s*(.*?)"""', re.MULTILINE | re.DOTALL)
OUTSIDE = re.compile(r"^\S", re.MULTILINE)


def _class_text(file: Path) -> tuple[str, dict[str, Any]]:
    """Return (docstring, title and spec) of the class that a file is about: its last one with a docstring.

    The text is searched: parsing it would take as long as all else that ``gyrobench list`` does.  A title or spec that
    is not written out is left out.
    """
    text = file.read_text(encoding="utf-8")
    found: tuple[str, dict[str, Any]] = ("", {})
    for match in CLASS.finditer(text):
        end = OUTSIDE.search(text, match.end())
        body = text[match.end() : end.start() if end else len(text)]
        attributes = {}
        form = rf"^{match[1]}(title|spec) = (\(.*?\)(?: +#[^\n]*)?|[^\n]*)$"
        for name, value in re.findall(form, body, re.MULTILINE | re.DOTALL):
            with contextlib.suppress(ValueError, SyntaxError, RecursionError, MemoryError):
                attributes[name] = ast.literal_eval(value)
        found = match[2], attributes
    return found


def _entry(name: str, file: Path) -> dict[str, Any]:
    doc, attributes = _class_text(file)
    first = doc.splitlines()[0] if doc else ""
    marks = re.search(r"\[([A-Z][A-Z0-9-]+(?:[,;] *[A-Z][A-Z0-9-]+)*)", first)
    spec = list(attributes.get("spec", ())) or (re.split(r"[,;] *", marks.group(1)) if marks else [])
    what = str(attributes.get("title") or re.sub(r"\s*\[.*", "", first)).rstrip(".")
    return {"name": name, "what": what, "spec": spec, "folder": str(file.parent)}


def _title(file: Path) -> str:
    try:
        return str(reading.toml(reading.read_text(file, ValueError), file.name, ValueError).get("title", ""))
    except ValueError as error:
        return f"cannot be read: {error}"


def list_contents(bench: Bench) -> dict[str, list[dict[str, Any]]]:
    """Return parts, systems, sockets, specifications, data sheets: a list of {name, what, spec, folder} each."""
    from gyrobench.system.sockets import SOCKETS

    return {
        "parts": [_entry(n, f / "model.py") for n, f in bench.parts().items()],
        "systems": [_entry(n, f / "system.py") for n, f in bench.systems().items()],
        "sockets": [{"name": s.name, "what": s.meaning} for s in SOCKETS.values()],
        "specifications": [{"name": n, "what": _title(f), "file": str(f)} for n, f in bench.specifications().items()],
        "instruments": [{"name": n, "what": _title(f), "file": str(f)} for n, f in bench.instruments().items()],
    }


def with_words(
    contents: Mapping[str, Sequence[Mapping[str, Any]]], words: Sequence[str]
) -> dict[str, list[Mapping[str, Any]]]:
    """Return the entries that have every word in name, text or method, whatever its case.

    Raises UsageError where none has.
    """
    wanted = [word.lower() for word in words]

    def fits(row: Mapping[str, Any]) -> bool:
        said = " ".join([row["name"], row["what"], *row.get("spec", ())]).lower()
        return all(word in said for word in wanted)

    found = {kind: [row for row in rows if fits(row)] for kind, rows in contents.items()}
    if wanted and not any(found.values()):
        names = [row["name"] for rows in contents.values() for row in rows]
        raise UsageError(
            f"nothing has '{' '.join(words)}' in its name, title or method; {suggest_names(words[0], names)}"
        )
    return found


README = """# {name}

A bench for gyrobench: parts in `components/`, systems in `systems/`, acceptance specifications in
`reports/specs/`, templates of reports in `reports/templates/`. What is not here is taken from the standard
bench; a part, system, specification or template of the same name stands in for the standard one.

    gyrobench list
    gyrobench build --all
    gyrobench run tumble_single_axis

Records and reports go to `reports/out/<system>/<id>/`, built FMUs to `fmus/`.
"""


def init_bench(folder: Path, copies: list[str]) -> list[str]:
    """Create the folders of a new bench and copy parts and systems into it; return what was made, a line each.

    Raises BenchError if the folder exists and is not empty, or there is no such part or system.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BenchError(f"{folder} exists and is not empty: choose another name")
    bench = Bench.find()
    parts, systems = bench.parts(), bench.systems()
    for name in copies:
        if name not in parts and name not in systems:
            raise BenchError(f"--copy {name}: no such part or system; {suggest_names(name, [*parts, *systems])}")
    for room in (*ROOMS, "fmus"):
        (folder / room).mkdir(parents=True, exist_ok=True)
    for room in ("systems", "components", "reports/specs"):
        (folder / room).mkdir(exist_ok=True)
        (folder / room / ".gitkeep").touch()  # git does not keep empty folders, and these make the bench
    (folder / "README.md").write_text(README.format(name=folder.resolve().name), encoding="utf-8")
    (folder / ".gitignore").write_text("fmus/\nreports/out/\n", encoding="utf-8")
    lines = [f"{folder}: a new bench; cd {shlex.quote(str(folder))} and gyrobench list"]
    copied = [(room, name) for name in dict.fromkeys(copies) for room in ("components", "systems")]
    for room, name in copied:  # a part and a system may have the same name: then both
        source = (parts if room == "components" else systems).get(name)
        if source is None:
            continue
        target = folder / room / name
        shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
        if room == "components":
            lines.append(f"{target}: a copy; change its model.py, then: gyrobench build {name}")
        else:
            lines.append(f"{target}: a copy; change its system.py, then: gyrobench run {name}")
    return lines
