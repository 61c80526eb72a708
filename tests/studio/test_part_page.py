"""The page of a part has a row with its unit for each port and parameter, for those too that it shares with others."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gyrobench.bench import Bench, standard_folder
from gyrobench.component import Input, Output, Parameter
from gyrobench.packaging import load_part
from gyrobench.studio.part_page import readme_text

#: shares with its kind, with another part, with both, with nobody
PARTS = ("estimator_aided", "compliant_gyro", "estimator_coloured", "cage")


@pytest.mark.parametrize("name", PARTS)
def test_shared_ports_and_parameters_have_their_rows(name: str) -> None:
    text = readme_text(Bench(standard_folder()).part_folder(name) / "README.md")
    rows = {m[0]: m[1] for m in re.findall(r"^\| `(\w+)[^|]*\|(.*)", text, re.M)}
    for d in load_part(name, standard_folder()).declarations.values():
        if isinstance(d, Input | Output | Parameter):
            assert ("int" if d.type is int else d.unit) in [c.strip() for c in rows[d.name].split("|")], d.name
    assert "](../" not in text


def test_a_part_whose_source_is_not_there_keeps_the_sentence(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("As in [another](../another/README.md#ports): in `z`.\n", encoding="utf-8")
    assert readme_text(readme) == "As in another: in `z`.\n"
