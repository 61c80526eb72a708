"""The page of a part: its equations, ports, parameters, limits and sources, as its README has them."""

from __future__ import annotations

import re

from nicegui import ui

from gyrobench.bench import UsageError
from gyrobench.reading import read_text
from gyrobench.studio.frame import Studio, frame

LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?:)[^)\s]*\)")  # to files of the bench, which the studio does not serve


def add_part_page(studio: Studio) -> None:
    """Register the page."""

    @ui.page("/part/{name}", response_timeout=60)
    def part(name: str) -> None:
        with frame(studio, name):
            readme = studio.bench.part_folder(name) / "README.md"
            if not readme.is_file():
                raise UsageError(f"{name}: the part has no README.md that says what it does")
            text = LINK.sub(lambda m: "" if m[1] else m[2], read_text(readme, UsageError))
            extras = ["fenced-code-blocks", "tables", "code-friendly"]  # the last: D_F is no emphasis
            ui.markdown(text, extras=extras).classes("readme")
