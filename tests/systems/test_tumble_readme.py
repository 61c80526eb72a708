"""The README of the tumble lists every option with its unit and meaning, and its headings are there."""

from __future__ import annotations

import re

from tumbling import NAME, load

from gyrobench.bench import Bench


def test_options_of_the_readme() -> None:
    text = (Bench.find().system_folder(NAME) / "README.md").read_text("utf-8")
    rows = {m[1]: m[0] for m in re.finditer(r"^\| `(\w+)` \| [^|]+ \| [^|]+ \| .*$", text, re.M)}
    system = load()
    for name, option in system.options.items():
        unit = option.unit if isinstance(option.unit, str) else option.unit.__name__
        cells = [c.strip() for c in rows.pop(name).strip("|").split("|")]
        assert cells[2:] == [unit, option.doc], name
        assert option.parse(name, cells[1]) == option.parse(name, option.default), name
    # the table of phases has the same form; every name in it is a mount of the plan
    assert set(rows) <= {p.face.replace(" ", "_") for p in system.plan().phases}
    for heading in ("Principle", "Geometry", "Model", "Plan", "Reduction", "Accuracy", "Not modelled", "Sources"):
        assert f"\n## {heading}\n" in text
