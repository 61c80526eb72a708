"""The page of a part: its README, with the rows of what it shares with others as the part declares them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from nicegui import ui

from gyrobench.bench import UsageError
from gyrobench.component import Component, Input, Output, Parameter
from gyrobench.component.declarations import Declaration
from gyrobench.packaging import load_part
from gyrobench.reading import read_text
from gyrobench.studio.frame import Studio, frame

LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?:)[^)\s]*\)")  # to files of the bench, which the studio does not serve
SHARED = re.compile(r"^(As in .*\]\([^)]+\.md#[\w-]+\)\)?):([^.]+)\.", re.M)  # a link, and the names that a part shares
PORTS = ("port", "", "unit", "start", "meaning")
PARAMETERS = ("parameter", "unit", "default", "bounds", "meaning")
LIMITS = {"above": ">", "min": ">=", "below": "<", "max": "<="}


def readme_text(readme: Path, part: type[Component]) -> str:
    """Return the README of a part with the rows of what it shares with others; its links to files are text."""
    declared = {n: d for n, d in part.declarations.items() if isinstance(d, Input | Output | Parameter)}

    def rows(match: re.Match[str]) -> str:
        shared = [declared[n] for n in re.findall(r"`(\w+)", match[2]) if n in declared]
        return f"{match[1]}:\n\n{tables(shared)}" if shared else match[0]

    text = SHARED.sub(rows, read_text(readme, UsageError))
    if every := [d for n, d in declared.items() if not re.search(rf"^\| `{n}[`\[]", text, re.M)]:
        text = text.replace("\n## Accuracy", f"\nBesides, as declared:\n\n{tables(every)}\n\n## Accuracy", 1)
    return LINK.sub(lambda m: "" if m[1] else m[2], text)


def tables(declared: Iterable[Declaration]) -> str:
    """Return the tables of ports and of parameters, in the form of a README."""
    ports: list[tuple[str, ...]] = []
    parameters: list[tuple[str, ...]] = []
    for d in declared:
        name = f"`{d.name}{list(d.shape) or ''}`".replace(" ", "")
        unit = "int" if d.type is int else d.unit
        if isinstance(d, Parameter):
            bounds = ", ".join(f"{sign} {x:g}" for n, sign in LIMITS.items() if (x := getattr(d, n)) is not None)
            parameters.append((name, unit, start_text(d), bounds, d.doc))
        else:
            ways = ("in", start_text(d)) if isinstance(d, Input) else ("out", "")
            ports.append((name, ways[0], unit, ways[1], d.doc))
    filled = [(head, rows) for head, rows in ((PORTS, ports), (PARAMETERS, parameters)) if rows]
    return "\n\n".join("\n".join(f"| {' | '.join(row)} |" for row in (h, ("---",) * 5, *rows)) for h, rows in filled)


def start_text(d: Declaration) -> str:
    """Return a start value as a README writes it: 0.1, all 0, unit matrix."""
    start = np.array(d.start, dtype=float)
    if start.ndim == 2 and np.array_equal(start, np.eye(*start.shape)):
        return "unit matrix"
    if start.size > 1 and np.all(start == start.flat[0]):
        return f"all {start.flat[0]:g}"
    return ", ".join(f"{x:.9g}" for x in start.flat)


def add_part_page(studio: Studio) -> None:
    """Register the page."""

    @ui.page("/part/{name}", response_timeout=60)
    def part(name: str) -> None:
        with frame(studio, name):
            readme = studio.bench.part_folder(name) / "README.md"
            if not readme.is_file():
                raise UsageError(f"{name}: the part has no README.md that says what it does")
            text = readme_text(readme, load_part(name, studio.bench.folder))
            extras = ["fenced-code-blocks", "tables", "code-friendly"]  # the last: D_F is no emphasis
            ui.markdown(text, extras=extras).classes("readme")
