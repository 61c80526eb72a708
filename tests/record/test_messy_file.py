"""The file of a laboratory as it is, to its report in two commands."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from messy_file import messy
from typer.testing import CliRunner

from gyrobench.bench import UsageError
from gyrobench.campaign.execution.store import Campaign
from gyrobench.commands.cli import app
from gyrobench.record.record import Record
from gyrobench.workflow.certificate import write_certificate

pytestmark = pytest.mark.long

SETTINGS = ("latitude=45.75deg", "k=17.2deg/h/mA", "attitude=E U -N", "type_b=none")


def gyrobench(*words: str) -> str:
    done = CliRunner().invoke(app, list(words))
    assert done.exit_code == 0, done.output
    return done.output


def test_lot_of_one_layout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two files under one map, in one command: a row each.  One of the 46 readings is 1 mA more in the second, which is
    17.2 deg/h / 46 = 0.37 deg/h of the mean, less where the fit gives it less weight."""
    monkeypatch.chdir(tmp_path)
    data, mean = messy()
    Path("lot").mkdir()
    for k in range(2):
        text = data.decode("cp1252")
        if k == 1:
            text = text.replace(f";{mean[10]:.6f};".replace(".", ","), f";{mean[10] + 1.0:.6f};".replace(".", ","))
        Path(f"lot/kreisel{k}.csv").write_bytes(text.encode("cp1252"))
    gyrobench("fit", "lot/kreisel0.csv", "--system", "fixed_position", "--out", "map.toml")
    settings = [w for s in SETTINGS[:3] for w in ("--set", s)]
    gyrobench(
        "sweep", "fixed_position", "--data", "lot/*.csv", "--columns", "map.toml", *settings, "--workers", "1",
        "--keep", "none", "--out", "out",
    )  # fmt: skip
    table = Campaign.open("out").table()
    first, second = table.sort_values("data")["ω_d.estimate"]
    assert 0.3 < first - second < 0.4


def test_two_commands_to_the_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The map is used as it was proposed.  The row without a value and the last one, whose end is not told, are left
    out and named; the record holds the others, with their ends at the start of the next row, whatever it holds."""
    monkeypatch.chdir(tmp_path)
    data, mean = messy()
    Path("messung.csv").write_bytes(data)
    gyrobench("fit", "messung.csv", "--system", "fixed_position", "--out", "map.toml")
    settings = [w for s in SETTINGS for w in ("--set", s)]
    gyrobench("reduce", "fixed_position", "--data", "messung.csv", "--columns", "map.toml", *settings, "--out", "out")
    assert (tmp_path / "out/report.html").is_file() and (tmp_path / "out/report.pdf").is_file()
    run = json.loads((tmp_path / "out/run.json").read_text(encoding="utf-8"))
    assert run["data"]["file"] == "messung.csv" and run["data"]["columns"] == "map.toml"
    assert "Left out for an empty cell: row 18." in run["notes"]  # 9 lines, the names, the eighth row
    assert any("row 58" in note for note in run["notes"])
    w = Record.load(tmp_path / "out").windows
    kept = [k for k in range(47) if k != 7]
    np.testing.assert_allclose(w["mean"], mean[kept] * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(w["t_start"], [1800.0 * k for k in kept])
    np.testing.assert_allclose(w["t_end"], [1800.0 * (k + 1) for k in kept])
    np.testing.assert_allclose(w["temperature"], [294.15 + 0.1 * (k % 10) for k in kept])


PROFILE = 'name = "Prüflabor"\naddress = ["Beispielweg 1"]\ncountry = "DE"\n'


def test_two_commands_to_the_certificate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The map, and what the file does not say; nothing else."""
    monkeypatch.chdir(tmp_path)
    Path("messung.csv").write_bytes(messy()[0])
    Path("laboratory.toml").write_text(PROFILE, encoding="utf-8")
    gyrobench("fit", "messung.csv", "--system", "fixed_position", "--out", "map.toml")
    settings = [w for s in SETTINGS for w in ("--set", s)]
    files = ["--data", "messung.csv", "--columns", "map.toml", "--out", "out"]
    said = gyrobench("reduce", "fixed_position", *files, *settings, "--certificate")
    (page,) = tmp_path.glob("certificate-*.html")
    assert page.name in said and "Left out for an empty cell: row 18." in page.read_text("utf-8")
    assert "Prüflabor, Beispielweg 1" in page.read_text("utf-8") and "messung.csv" in page.read_text("utf-8")
    with pytest.raises(UsageError, match="out and out are one report; a lot names each once"):
        write_certificate([Path("out"), Path("out")])


def test_twenty_files_to_the_certificate_of_the_lot_in_one_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Twenty files under one map.  Each has its row, and the coefficient a control chart."""
    monkeypatch.chdir(tmp_path)
    text = messy()[0].decode("cp1252")
    Path("lot").mkdir()
    for k in range(20):
        numbered = text.replace(";0,0", f";0,0{k % 5}", 1 + k)
        Path(f"lot/kreisel{k:02d}.csv").write_bytes(numbered.encode("cp1252"))
    Path("laboratory.toml").write_text(PROFILE, encoding="utf-8")
    gyrobench("fit", "lot/kreisel00.csv", "--system", "fixed_position", "--out", "map.toml")
    settings = [w for s in SETTINGS[:3] for w in ("--set", s)]
    lot = ["--data", "lot/*.csv", "--columns", "map.toml", "--workers", "1", "--out", "out"]
    said = gyrobench("sweep", "fixed_position", *lot, *settings, "--certificate")
    (page,) = (tmp_path / "out").glob("certificate-*.html")
    shown = page.read_text("utf-8")
    assert page.name in said and "Control charts" in shown and "Control chart of ω_d" in shown
    assert len(list((tmp_path / "out" / "kept").iterdir())) == 20
    assert all(f"kreisel{k:02d}.csv" in shown for k in range(20)), "the file names what has no name"


def test_a_lot_is_certified_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("lot").mkdir()
    Path("lot/a.csv").write_bytes(messy()[0])
    Path("lot/b.csv").write_text("nothing of use\n1;2\n")
    Path("laboratory.toml").write_text(PROFILE, encoding="utf-8")
    gyrobench("fit", "lot/a.csv", "--system", "fixed_position", "--out", "map.toml")
    settings = [w for s in SETTINGS[:3] for w in ("--set", s)]
    lot = ["--data", "lot/*.csv", "--columns", "map.toml", "--workers", "1", "--out", "out"]
    done = CliRunner().invoke(app, ["sweep", "fixed_position", *lot, *settings, "--certificate"])
    assert done.exit_code != 0 and "no certificate: 1 of 2 files have no report: b.csv" in str(
        done.exception or done.output
    )
