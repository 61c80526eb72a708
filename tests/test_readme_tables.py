"""The tables of docs/: every part, every system and its picture stands in them, and once."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def rows(page: str) -> list[str]:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return [line for line in text.splitlines() if line.startswith("| ")]


@pytest.mark.parametrize(
    ("page", "room", "file"), [("parts.md", "components", "model.py"), ("tests_and_loops.md", "systems", "system.py")]
)
def test_each_stands_once(page: str, room: str, file: str) -> None:
    there = Counter(n for row in rows(page) for n in re.findall(rf"\[\w+\]\(\.\./{room}/(\w+)/README.md\)", row))
    wanted = {p.parent.name for p in (ROOT / room).glob(f"*/{file}")}
    assert set(there) == wanted
    assert [n for n, count in there.items() if count > 1] == []


def test_each_system_has_a_picture() -> None:
    there = Counter(n for row in rows("gallery.md") for n in re.findall(r"\(\.\./reports/gallery/(\w+)\.svg\)", row))
    wanted = {p.parent.name for p in (ROOT / "systems").glob("*/system.py")}
    assert set(there) == wanted and set(there.values()) == {1}


def test_headings_of_rows_stand_once() -> None:
    heads = Counter(row.split("|")[1].strip() for row in rows("parts.md"))
    assert [h for h, count in heads.items() if count > 1] == []


def test_the_readme_is_short() -> None:
    """Doors, not an inventory: that is what docs/ is for."""
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 130
