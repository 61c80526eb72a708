"""Runs as a user meets them: what is printed and kept, reports, comparison, what is left of a run that fails."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from commanding import Command
from openpyxl import load_workbook
from processes import unhurried

from gyrobench.bench import Bench
from gyrobench.commands import cli, progress_display
from gyrobench.engine.run_driver import ProgressReport
from gyrobench.record.record import Record

NAME = "tumble_single_axis"
QUICK = ["--set", "rate=2deg/s", "--set", "dwell=60", "--set", "windows=36"]
PLAIN = ["--no-report", "--no-check-step"]
TINY = ["--set", "rate=30deg/s", "--set", "dwell=2", "--set", "settle=0.5", "--set", "windows=12"]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with a run ``a`` (checked step, judged) and a run ``b`` of a worse gyro."""
    folder = tmp_path_factory.mktemp("runs")
    base = [sys.executable, "-m", "gyrobench", "run", NAME, *QUICK, "--spec", "floated_gyro", "--strict"]
    env_path = str(Path(cli.__file__).parents[2])
    for name, more, code in (("a", ["--check-step"], 0), ("b", ["--set", "gyro.D_I=3deg/h/g", *PLAIN], 1)):
        done = subprocess.run(
            [*base, *more, "--out", name],
            cwd=folder,
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONPATH": env_path},
            check=False,
        )
        assert done.returncode == code, done.stderr
        (folder / f"{name}.txt").write_text(done.stdout, encoding="utf-8")
    yield folder


# ------------------------------------------------------------------------------------------ run, report
@pytest.mark.long
def test_run_prints_table_verdict_step_check_and_paths(runs: Path) -> None:
    text = (runs / "a.txt").read_text(encoding="utf-8")
    assert text.startswith("Single-axis tumble test")
    names = ["D_F", "D_I", "D_O", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS"]
    rows = [line.split() for line in text.splitlines() if line.startswith("D_")]
    assert [r[0] for r in rows] == names and all("pass" in r for r in rows)
    assert "the effect of the communication step is in u, at most" in text
    assert text.endswith("verdict: pass\na/result.json\na/report.html\na/report.pdf\n")
    assert {p.name for p in (runs / "a").iterdir()} == {
        "run.json", "record.parquet", "channels.parquet", "result.json", "report.html", "report.pdf",
        "manifest.json",
    }  # fmt: skip
    assert "verdict: fail" in (runs / "b.txt").read_text(encoding="utf-8")


@pytest.mark.long
def test_step_check_changes_less_than_a_tenth_of_u(runs: Path) -> None:
    check = json.loads((runs / "a" / "result.json").read_text(encoding="utf-8"))["step_check"]
    assert len(check["rows"]) == 9
    assert check["worst"] == max(r["ratio"] for r in check["rows"]) < 0.1


def test_a_report_verifies_signed_and_no_more_once_a_file_is_changed(gyrobench: Command) -> None:
    assert gyrobench("run", NAME, *TINY, "--out", "b")[0] == 0
    code, out, _ = gyrobench("verify", "b")  # without pages
    assert code == 0 and "all 4 files as they were written" in out
    assert gyrobench("sign", "--new-key", "lab.key") == (
        0,
        "lab.pub: give it to those who verify; keep lab.key to yourself\n",
        "",
    )
    assert gyrobench("sign", "b", "--key", "lab.key")[0] == 0
    assert "signed by lab.pub" in gyrobench("verify", "b", "--key", "lab.pub")[1]
    result = Path("b/result.json")
    kept = result.read_bytes()
    result.write_bytes(kept.replace(b'"verdict": "', b'"verdict": "not '))
    code, _, err = gyrobench("verify", "b")
    assert code == 1 and "- result.json: changed after the report was written" in err
    result.write_bytes(kept)
    code, _, err = gyrobench("sign", "b")
    assert code == 2 and "name a folder and the --key that signs it" in err


@pytest.mark.long
def test_report_again_keeps_the_step_check(gyrobench: Command, runs: Path) -> None:
    code, out, _ = gyrobench("report", runs / "a", "--spec", "floated_gyro", "--strict", figures=False)
    assert code == 0 and "step check (" in out and "verdict: pass" in out
    code, out, _ = gyrobench("report", runs / "b", "--spec", "floated_gyro", "--strict", "--json", figures=False)
    assert code == 1 and json.loads(out)["verdict"] == "fail"


@pytest.mark.long
def test_json_is_the_only_thing_on_standard_output(gyrobench: Command, tmp_path: Path) -> None:
    code, out, err = gyrobench("run", NAME, *TINY, "--json", pages=True, figures=False)
    assert code == 0
    (folder,) = (tmp_path / "reports" / "out" / NAME).iterdir()
    assert json.loads(out) == json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert f"reports/out/{NAME}/{folder.name}/report.html" in err
    assert not (tmp_path / "fmus").exists()


@pytest.mark.long
def test_the_same_run_has_the_same_folder_and_another_one_another(gyrobench: Command, tmp_path: Path) -> None:
    for more in ([], ["--set", "latitude=2745arcmin"], ["--seed", "2"]):  # 2745' = 45.75°, the default
        assert gyrobench("run", NAME, *TINY, *more, "--json")[0] == 0
    assert len(list((tmp_path / "reports" / "out" / NAME).iterdir())) == 2


@pytest.mark.long
def test_out_keeps_another_run_unless_forced(gyrobench: Command, tmp_path: Path) -> None:
    run = ["run", NAME, *TINY, "--out", "here"]
    assert gyrobench(*run)[0] == 0
    assert gyrobench(*run)[0] == 0  # the same run again
    code, _, err = gyrobench(*run, "--seed", "2", "--set", "gyro.D_I=0")
    assert code == 2
    assert "here: holds another run (its parameters, seed differ); name another folder, or replace it: --force" in err
    assert Record.load(tmp_path / "here").run.seed == 1
    assert gyrobench(*run, "--seed", "2", "--force")[0] == 0
    assert Record.load(tmp_path / "here").run.seed == 2


@pytest.mark.long
def test_without_a_report_the_result_is_kept_and_no_older_page_stays(gyrobench: Command, tmp_path: Path) -> None:
    run = ["run", NAME, *TINY, "--out", "r"]
    assert gyrobench(*run, pages=True, figures=False)[0] == 0
    assert (tmp_path / "r" / "report.html").is_file() and (tmp_path / "r" / "report.pdf").is_file()
    before = (tmp_path / "r" / "result.json").read_bytes()
    code, out, _ = gyrobench(*run, "--no-report", pages=True)
    assert code == 0 and out.rstrip().endswith("r/result.json") and "D_I" in out
    assert {f.name for f in (tmp_path / "r").iterdir()} == {
        "run.json", "record.parquet", "channels.parquet", "result.json", "manifest.json",
    }  # fmt: skip
    again = json.loads((tmp_path / "r" / "result.json").read_bytes())
    assert again["coefficients"] == json.loads(before)["coefficients"]
    assert gyrobench("report", "r", figures=False)[0] == 0 and (tmp_path / "r" / "report.html").is_file()


@pytest.mark.long
def test_a_record_is_written_as_csv(gyrobench: Command, runs: Path, tmp_path: Path) -> None:
    shutil.copytree(runs / "a", tmp_path / "a")
    code, out, _ = gyrobench("record", "a", "--to", "csv", "--out", "t")
    assert (code, out.split()[:2]) == (0, ["t/windows.csv", "t/channels.csv"])
    record = Record.load(tmp_path / "a")
    for name, columns in (("windows", record.windows), ("channels", record.channels)):
        head, *rows = (tmp_path / "t" / f"{name}.csv").read_text(encoding="utf-8").splitlines()
        assert [h.split(" [")[0] for h in head.split(",")] == list(columns)
        table = np.array([[float(x) for x in r.split(",")] for r in rows])
        assert all(np.array_equal(table[:, k], v) for k, v in enumerate(columns.values()))  # bit for bit
        assert {"mean [A]", "phase", "angle_end [rad]"} <= set(head.split(",")) or "gyro.u [V]" in head.split(",")
    assert gyrobench("record", "a", "--to", "csv")[1].split()[:2] == ["a/csv/windows.csv", "a/csv/channels.csv"]
    assert Record.load(tmp_path / "a").same_data(record)  # the run stays a record
    code, _, err = gyrobench("record", "nothing", "--to", "csv")
    assert code == 2 and "nothing: no run there" in err


@pytest.mark.long
def test_the_tables_of_a_report_are_written_with_all_digits(gyrobench: Command, runs: Path, tmp_path: Path) -> None:
    shutil.copytree(runs / "a", tmp_path / "a")
    result = json.loads((runs / "a" / "result.json").read_text(encoding="utf-8"))
    files = gyrobench("record", "a", "--to", "csv", figures=False)[1].split()[2:]
    (coefficients,) = (f for f in files if "Coefficients" in f)
    rows = list(csv.DictReader((tmp_path / coefficients).read_text(encoding="utf-8-sig").splitlines()))
    for row, c in zip(rows, result["coefficients"], strict=True):
        assert (row["name"], float(row["estimate"]), float(row["u"])) == (c["name"], c["estimate"], c["u"])
        assert row["group"] == f"in {c['unit']}"
    assert gyrobench("record", "a", "--to", "xlsx", figures=False)[:2] == (0, "a/tables.xlsx\n")
    book = load_workbook(tmp_path / "a" / "tables.xlsx")
    assert book.sheetnames[:3] == ["contents", "windows", "channels"] and len(book.sheetnames) == 3 + len(files)
    sheet = book[next(n for n in book.sheetnames if "Coefficients" in n)]
    estimates = [c["estimate"] for c in result["coefficients"]]
    assert [r[3] for r in sheet.iter_rows(min_row=2, values_only=True)] == pytest.approx(estimates, rel=1e-15)
    windows = [r[0] for r in book["windows"].iter_rows(min_row=2, values_only=True)]
    assert windows == Record.load(tmp_path / "a").windows["phase"].tolist()


@pytest.mark.long
def test_a_specification_that_does_not_fit_keeps_the_record(gyrobench: Command, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text('[coefficients.D_I]\nunit = "mA"\nmin = -1\n', encoding="utf-8")
    code, _, err = gyrobench("run", NAME, *TINY, "--out", "r", "--spec", "s.toml")
    assert code == 3
    assert "D_I is given in 'mA'; the report uses '°/h/g'" in err
    assert "the record is kept in r\nafter correcting the cause: gyrobench report r" in err
    assert gyrobench("report", "r", figures=False)[0] == 0


@pytest.mark.long
def test_engines_give_the_same_record(gyrobench: Command, tmp_path: Path) -> None:
    short = [TINY[0], "rate=60deg/s", *TINY[2:], "--set", "table.index_rate=2"]
    for name, more in (("n", []), ("r", ["--engine", "reference"])):
        assert gyrobench("run", NAME, *short, *more, "--out", name)[0] == 0
    assert Record.load(tmp_path / "n").same_data(Record.load(tmp_path / "r"))


@pytest.mark.long
def test_compare(gyrobench: Command, runs: Path, tmp_path: Path) -> None:
    code, out, _ = gyrobench("compare", runs / "a", runs / "b", "--out", "c")
    assert code == 0 and out.startswith("B (b) ") and "Set differently: " in out.splitlines()[-5]
    assert out.endswith("\n\nc/comparison.json\nc/comparison.html\nc/comparison.pdf\n")
    code, out, _ = gyrobench("compare", runs / "a", runs / "b", "--json", figures=False)
    assert code == 0 and json.loads(out)
    code, _, err = gyrobench("compare", runs / "a", runs / "a")
    assert code == 2 and "given twice" in err


# ---------------------------------------------------------------------------- interrupted and failed runs
@pytest.mark.long
def test_interrupted_run_keeps_its_record_and_says_what_it_lacks(
    gyrobench: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(self: progress_display.ProgressDisplay, status: ProgressReport) -> None:
        if status.windows >= 2:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(progress_display.ProgressDisplay, "__call__", interrupt)
    run = ["run", NAME, "--set", "rate=2deg/s", "--set", "windows=36", "--out", "r"]
    with unhurried():
        code, out, err = gyrobench(*run)
    assert code == 130 and out == ""
    assert "interrupted at t = " in err and "the record until then is kept in r" in err
    record = Record.load(tmp_path / "r")
    assert not record.complete and len(record.windows["phase"]) >= 2
    code, out, err = gyrobench("report", "r")
    assert code == 3 and out == ""
    assert "r: the record is not complete, so there is no report\n  - interrupted at t = " in err
    assert "  - phase 4 (mount 2, against the Earth): " in err and "of 36 windows" in err


@pytest.mark.long
def test_interrupt_does_not_replace_a_whole_record(
    gyrobench: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = ["run", NAME, *TINY, "--out", "r"]
    assert gyrobench(*run)[0] == 0
    monkeypatch.setattr(
        progress_display.ProgressDisplay, "__call__", lambda self, status: signal.raise_signal(signal.SIGINT)
    )
    with unhurried():
        code, _, err = gyrobench(*run)
    assert code == 130 and "is kept in r-incomplete" in err
    assert Record.load(tmp_path / "r").complete and not Record.load(tmp_path / "r-incomplete").complete


@pytest.mark.long
def test_interrupted_step_check_still_gives_the_report(
    gyrobench: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(self: progress_display.ProgressDisplay, status: ProgressReport) -> None:
        if "step check" in self.label:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(progress_display.ProgressDisplay, "__call__", interrupt)
    with unhurried():
        code, out, err = gyrobench("run", NAME, *TINY, "--check-step", "--out", "r", pages=True, figures=False)
    assert code == 130
    assert "r/report.html" in out and "the report is without it" in err
    assert json.loads((tmp_path / "r" / "result.json").read_text(encoding="utf-8"))["step_check"] == {}


@pytest.fixture
def faulty(foreign: Callable[..., Path]) -> Path:
    """A gyro FMU that crashes, see tests/foreign/faulty.c."""
    return foreign("faulty")


@pytest.mark.long
def test_crash_of_a_part_ends_in_a_message(gyrobench: Command, tmp_path: Path, faulty: Path) -> None:
    code, out, err = gyrobench(
        "run", NAME, *TINY, "--part", f"gyro={faulty}", "--out", "r",
        "--set", "gyro.fault=1", "--set", "gyro.at=150", "--set", "rebalance.K_p=0", "--set", "rebalance.K_i=0",
    )  # fmt: skip
    assert code == 3 and out == ""
    assert "gyro: doStep failed at t = 0.15 s: its process crashed (SIGSEGV)" in err
    assert "the record until then is kept in r" in err and "Traceback" not in err
    assert Record.load(tmp_path / "r").run.stopped_at == pytest.approx(0.15)


def test_faults_of_a_part_are_shown_with_file_and_line(gyrobench: Command, tmp_path: Path) -> None:
    assert gyrobench("init", "mine", "--copy", "site")[0] == 0
    model = tmp_path / "mine" / "components" / "site" / "model.py"
    good = model.read_text(encoding="utf-8")
    last = len(good.splitlines()) + 1
    for wrong, message in (("def x(:", "SyntaxError"), ("undefined_name", "NameError: name 'undefined_name'")):
        model.write_text(good + wrong + "\n", encoding="utf-8")
        bench = Bench.find(tmp_path / "mine")
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(bench.folder)
            code, _, err = gyrobench("build", "site")
        assert code == 2
        assert f"{model}:{last}: {message}" in err and "Traceback" not in err
