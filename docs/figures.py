"""Measured figures that the pages quote:  python docs/figures.py [--write]

docs/figures.toml holds them, each with unit, command and the version it was measured at; the benchmarks write it
(tests/benchmarks/quoted.py).  A page quotes a figure between marks, or a row of a table whose columns bear the
names of the values:

    a day takes <!--fig speed.day-->209<!--/--> s of CPU
    | coverage <!--row coverage.servo_polar--> | 0.948 | 0.951 |

Without --write: names the pages whose figures differ from the file, exit code 1.
"""

from __future__ import annotations

import json
import re
import sys
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
FILE = ROOT / "docs" / "figures.toml"
FIELDS = ("value", "unit", "command", "version")
INLINE = re.compile(r"<!--fig ([\w.-]+)-->(.*?)<!--/-->", re.S)
ROW = re.compile(r"^\|[^|\n]*<!--row ([\w.-]+)-->[^|\n]*\|.*$", re.M)

Entry = dict[str, Any]  # value: a text as it is printed, or texts by the name of their column


def load(file: Path = FILE) -> dict[str, Entry]:
    """Return the figures by key, "speed.day"."""
    found: dict[str, Entry] = {}
    for group, entries in tomllib.loads(file.read_text(encoding="utf-8")).items():
        found |= {f"{group}.{name}": entry for name, entry in entries.items()}
    return found


def dump(figures: dict[str, Entry], file: Path = FILE) -> None:
    """Write the figures; the comment at the head of the file stays."""
    head = re.match(r"(?:#.*\n)*", file.read_text(encoding="utf-8") if file.is_file() else "")
    text = [head[0] if head else ""]
    for key, entry in figures.items():
        text += [f"\n[{key}]\n"]
        for name in FIELDS:
            value = entry[name]
            if isinstance(value, dict):
                inside = ", ".join(f"{json.dumps(k, ensure_ascii=False)} = {json.dumps(v)}" for k, v in value.items())
                text += [f"{name} = {{ {inside} }}\n"]
            else:
                text += [f"{name} = {json.dumps(value, ensure_ascii=False)}\n"]
    file.write_text("".join(text), encoding="utf-8")


def keys(page: str) -> list[str]:
    """Return the keys that a page quotes."""
    return [m[1] for pattern in (INLINE, ROW) for m in pattern.finditer(page)]


def put(page: str, figures: dict[str, Entry]) -> str:
    """Return a page with the figures of the file in their places.  Raises KeyError: no such figure in the file."""

    def value(key: str) -> Any:
        if key not in figures:
            raise KeyError(f"{key}: no such figure in docs/figures.toml")
        return figures[key]["value"]

    def inline(match: re.Match[str]) -> str:
        return f"<!--fig {match[1]}-->{value(match[1])}<!--/-->"

    def row(match: re.Match[str]) -> str:
        values = value(match[1])
        table = page[: match.start()].rsplit("\n\n", 1)[-1]
        names = [cell.strip() for cell in table.splitlines()[0].strip("|").split("|")]
        if not isinstance(values, dict) or not {*names[1:]} <= values.keys():
            raise KeyError(f"{match[1]}: its values in docs/figures.toml have other names than the columns {names[1:]}")
        cells = match[0].strip("|").split("|")
        return "|" + "|".join([cells[0], *(f" {values[name]} " for name in names[1:])]) + "|"

    return ROW.sub(row, INLINE.sub(inline, page))


def main() -> int:
    sys.path.insert(0, str(ROOT / "docs" / "site"))
    from links import pages

    figures, wrong = load(), 0
    for file in pages(ROOT):
        page = file.read_text(encoding="utf-8")
        right = put(page, figures)
        if right != page:
            wrong += 1
            print(file.relative_to(ROOT))
            if "--write" in sys.argv[1:]:
                file.write_text(right, encoding="utf-8")
    return 1 if wrong and "--write" not in sys.argv[1:] else 0


if __name__ == "__main__":
    sys.exit(main())
