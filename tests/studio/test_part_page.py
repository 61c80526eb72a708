"""The page of a part has a row with its unit for each port and parameter, for those too that it shares with others."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gyrobench.bench import Bench, standard_folder
from gyrobench.component import Input, Output, Parameter
from gyrobench.packaging import load_part
from gyrobench.studio.part_page import readme_text

#: shares with its kind, with another part, with both, with nobody; has `steps` beside the `step` of every part
PARTS = ("estimator_aided", "compliant_gyro", "estimator_coloured", "cage", "sequencer")


@pytest.mark.parametrize("name", PARTS)
def test_shared_ports_and_parameters_have_their_rows(name: str) -> None:
    part = load_part(name, standard_folder())
    text = readme_text(Bench(standard_folder()).part_folder(name) / "README.md", part)
    rows = {m[0]: m[1] for m in re.findall(r"^\| `(\w+)[^|]*\|(.*)", text, re.M)}
    for d in part.declarations.values():
        if isinstance(d, Input | Output | Parameter):
            assert ("int" if d.type is int else d.unit) in [c.strip() for c in rows[d.name].split("|")], d.name
    assert "](../" not in text


def test_rows_are_what_the_part_declares() -> None:
    """compliant_gyro names mount, which the README of floated_gyro explains; seed no README explains."""
    text = readme_text(
        Bench(standard_folder()).part_folder("compliant_gyro") / "README.md", load_part("compliant_gyro")
    )
    rows = {m[1]: m[0] for m in re.finditer(r"^\| `(\w+).*$", text, re.M)}
    assert rows["mount"] == "| `mount[3,3]` | 1 | unit matrix |  | rows: gyro axes I, O, S in case axes |"
    assert rows["seed"] == "| `seed` | int | 1 | >= 0 | seed of the noise of this instance |"


def test_names_that_the_part_does_not_declare_stay_in_their_sentence(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("As in [another](../another/README.md#ports): in `zz`.\n", encoding="utf-8")
    assert readme_text(readme, load_part("cage", standard_folder())) == "As in another: in `zz`.\n"
