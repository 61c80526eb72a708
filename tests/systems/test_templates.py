"""Templates of every system that takes a laboratory's record: `gyrobench reduce SYSTEM --template`, and back.

An empty template is understood as it stands: its options, attitudes, columns and units pass; all that is missing is
rows.  Rows that were measured: the tests of each system (laboratory_file, measured_data).
"""

from __future__ import annotations

from pathlib import Path

import pytest
from commanding import Command

from gyrobench.bench import Bench, standard_folder
from gyrobench.system.suite import load_test

SYSTEMS = sorted(Bench(standard_folder()).systems())
TAKING = [n for n in SYSTEMS if getattr(load_test(n), "measured_data", None)]


def test_every_test_method_takes_records() -> None:
    assert {n for n in SYSTEMS if n.startswith(("tumble_", "servo_")) or n.endswith("_scale_factor")} <= set(TAKING)
    assert {"accelerometer_multipoint", "eight_position", "fixed_position", "open_loop_drift"} <= set(TAKING)


@pytest.mark.parametrize("name", TAKING)
def test_template_is_understood(name: str, command: Command, tmp_path: Path) -> None:
    code, text, said = command("reduce", name, "--template")
    assert code == 0 and not said
    lines = text.splitlines()
    header = lines[-1]
    assert all(line.startswith("#") for line in lines[:-1]) and "," in header
    file = tmp_path / "record.csv"
    file.write_text(text, encoding="utf-8")
    code, _, said = command("reduce", name, "--data", file, "--out", tmp_path / "out")
    assert code == 2
    told = [line.strip() for line in said.splitlines() if line.strip().startswith("- ")]
    assert told == ["- no rows below the header"], said


@pytest.mark.parametrize("name", TAKING)
def test_wrong_columns_are_refused(name: str, command: Command, tmp_path: Path) -> None:
    """A unit that does not fit, a column that is missing, a number that is none: named, nothing reduced."""
    text = command("reduce", name, "--template")[1]
    *comments, header = text.splitlines()
    columns = header.split(",")
    file = tmp_path / "record.csv"
    k = next(i for i, c in enumerate(columns) if "[" in c)
    wrong = [*columns[:k], columns[k].partition("[")[0] + "[kg]", *columns[k + 1 :]]
    zeros = ",".join("0" for _ in columns)
    for head, row, word in ((wrong, zeros, "kg"), (columns[1:], zeros.partition(",")[2], columns[0].partition(" ")[0])):
        file.write_text("\n".join([*comments, ",".join(head), row, ""]), encoding="utf-8")
        code, _, said = command("reduce", name, "--data", file, "--out", tmp_path / "out")
        assert code == 2 and word in said and "Traceback" not in said, said
    row = ["0"] * len(columns)
    row[k] = "nan"
    file.write_text("\n".join([*comments, header, ",".join(row), ""]), encoding="utf-8")
    code, _, said = command("reduce", name, "--data", file, "--out", tmp_path / "out")
    assert code == 2 and "Traceback" not in said, said
    assert not (tmp_path / "out").exists() or not any((tmp_path / "out").iterdir())
