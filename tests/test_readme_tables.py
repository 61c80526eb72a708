"""The tables of the README: every part and every system stands in them, and once."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
ROWS = [line for line in README.splitlines() if line.startswith("| ")]


@pytest.mark.parametrize(("room", "file"), [("components", "model.py"), ("systems", "system.py")])
def test_each_stands_once(room: str, file: str) -> None:
    there = Counter(n for row in ROWS for n in re.findall(rf"\[\w+\]\({room}/(\w+)/README.md\)", row))
    wanted = {p.parent.name for p in (ROOT / room).glob(f"*/{file}")}
    assert set(there) == wanted
    assert [n for n, count in there.items() if count > 1] == []


def test_each_system_has_a_picture() -> None:
    there = Counter(n for row in ROWS for n in re.findall(r"\(reports/gallery/(\w+)\.svg\)", row))
    wanted = {p.parent.name for p in (ROOT / "systems").glob("*/system.py")}
    assert set(there) == wanted and set(there.values()) == {1}


def test_headings_of_rows_stand_once() -> None:
    heads = Counter(row.split("|")[1].strip() for row in ROWS if "(components/" in row)
    assert [h for h, count in heads.items() if count > 1] == []
