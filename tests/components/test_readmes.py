"""The README of each part lists every port and parameter with its unit, and says what belongs there."""

import re

import pytest
from wired import BENCH

from gyrobench.bench import Bench
from gyrobench.component import Input, Output, Parameter
from gyrobench.packaging import load_part

PARTS = sorted(Bench(BENCH).parts())


@pytest.mark.parametrize("name", PARTS)
def test_readme(name):
    text = (BENCH / "components" / name / "README.md").read_text(encoding="utf-8")
    rows = {}
    for line in text.splitlines():
        cells = [c.strip() for c in line.strip("|").split("|")]
        found = re.match(r"`(\w+)(\[.*\])?`$", cells[0])
        if found and len(cells) == 5:
            rows[found[1]] = cells
    declared = load_part(name, BENCH).declarations.values()
    for d in declared:
        if isinstance(d, Input | Output | Parameter):
            cells = rows.pop(d.name)
            unit = "int" if d.type is int else d.unit
            assert unit in cells[1:3], f"{d.name}: unit {unit} is not in its row"
            assert d.doc in cells[4], f"{d.name}: {d.doc!r} is not in its row"
    assert not rows, f"rows that describe nothing: {list(rows)}"
    for heading in ("## Ports", "## Parameters", "## Accuracy", "## Not modelled", "## Sources"):
        assert heading in text
