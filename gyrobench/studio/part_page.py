"""The page of a part: its equations, ports, parameters, limits and sources, as its README has them."""

from __future__ import annotations

import re
from pathlib import Path

from nicegui import ui

from gyrobench.bench import UsageError
from gyrobench.reading import read_text
from gyrobench.studio.frame import Studio, frame

LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?:)[^)\s]*\)")  # to files of the bench, which the studio does not serve
#: ports or parameters that a part shares: names, and the table that has their rows
SHARED = re.compile(r"^(As in .*\]\(([^)#]+\.md)#([\w-]+)\)\)?):([^.]+)\.", re.M)
HEADS = ("| port |", "| parameter |")


def readme_text(readme: Path) -> str:
    """Return the README of a part with the rows of what it shares in its own tables; its links to files are text."""

    def rows(match: re.Match[str]) -> str:
        source = readme.parent / match[2]
        if not source.is_file():
            return match[0]
        text, names = read_text(source, UsageError), re.findall(r"`(\w+)", match[4])
        if source.name != "README.md":  # of several kinds of parts
            title = match[3].replace("-", " ")
            text = next((s for s in text.split("\n## ") if s.partition("\n")[0].lower() == title), "")
        tables: dict[str, list[str]] = {}
        for line in text.splitlines():
            if line.startswith(HEADS):
                head = tables.setdefault(line, [])
            elif line.startswith("| `") and re.findall(r"\w+", line)[0] in names:
                head.append(line)
        filled = ["\n".join([h, re.sub("[^|]+", "---", h), *t]) for h, t in tables.items() if t]
        return "\n\n".join([f"{match[1]}:", *filled]) if filled else match[0]

    text = SHARED.sub(rows, read_text(readme, UsageError))
    return LINK.sub(lambda m: "" if m[1] else m[2], text)


def add_part_page(studio: Studio) -> None:
    """Register the page."""

    @ui.page("/part/{name}", response_timeout=60)
    def part(name: str) -> None:
        with frame(studio, name):
            readme = studio.bench.part_folder(name) / "README.md"
            if not readme.is_file():
                raise UsageError(f"{name}: the part has no README.md that says what it does")
            text = readme_text(readme)
            extras = ["fenced-code-blocks", "tables", "code-friendly"]  # the last: D_F is no emphasis
            ui.markdown(text, extras=extras).classes("readme")
