"""The README of each part lists every port and parameter with its unit, and says what belongs there."""

import re

import pytest
from wired import BENCH

from gyrobench.bench import Bench
from gyrobench.component import Input, Output, Parameter
from gyrobench.packaging import load_part

PARTS = sorted(Bench(BENCH).parts())
SHARED = (BENCH / "docs" / "shared_ports.md").read_text(encoding="utf-8")
#: to a kind of parts, or to another part
LINK = re.compile(r"\(\.\./(?:\.\./docs/shared_ports\.md#([\w-]+)|(\w+)/README\.md#\w+)\)\)?:([^.]+)\.")


def rows_of(text):
    """Return the rows of the tables of ports and parameters in a text, by name."""
    rows = {}
    for line in text.splitlines():
        cells = [c.strip() for c in line.strip("|").split("|")]
        found = re.match(r"`(\w+)(\[.*\])?`$", cells[0])
        if found and len(cells) == 5:
            rows[found[1]] = cells
    return rows


#: of each kind of parts: title -> rows
KINDS = {title.lower().replace(" ", "-"): rows_of(text)
         for title, text in re.findall(r"^## (.+)\n((?:(?!## ).*\n)+)", SHARED, re.M)}  # fmt: skip

#: parameters that docs/shared_ports.md has for every part, with their values there
COMMON = {"step": (1e-3, 1e9), "seed": (1.0,)}


@pytest.mark.parametrize("name", PARTS)
def test_readme(name):
    text = (BENCH / "components" / name / "README.md").read_text(encoding="utf-8")
    rows = rows_of(text)
    for kind, part, names in LINK.findall(text):
        there = KINDS[kind] if kind else rows_of((BENCH / "components" / part / "README.md").read_text("utf-8"))
        for each, shape in re.findall(r"`(\w+)(\[[^`]*\])?`", names):
            assert each not in rows, f"{each} stands twice"
            rows[each] = there[each]
            assert rows[each][0] == f"`{each}{shape}`"
    declared = load_part(name, BENCH).declarations.values()
    for d in declared:
        if d.name in COMMON and d.name not in rows and d.start in COMMON[d.name]:
            continue
        if isinstance(d, Input | Output | Parameter):
            cells = rows.pop(d.name)
            unit = "int" if d.type is int else d.unit
            assert unit in cells[1:3], f"{d.name}: unit {unit} is not in its row"
            assert d.doc in cells[4], f"{d.name}: {d.doc!r} is not in its row"
    assert not rows, f"rows that describe nothing: {list(rows)}"
    for heading in ("## Ports", "## Parameters", "## Accuracy", "## Not modelled", "## Sources"):
        assert heading in text
