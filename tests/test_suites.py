"""Suites by command: what they leave, one failed or stopped test, runs that exist, refusals."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from commanding import Command
from processes import unhurried

from gyrobench.bench import standard_folder
from gyrobench.commands import cli, progress_display
from gyrobench.engine.run_driver import ProgressReport
from gyrobench.engine.session import run
from gyrobench.record.record import Record
from gyrobench.system.suite import Suite, load_test

NAME = "drift_test_suite"
PLANS = {
    "tumble_single_axis": ["rate=30deg/s", "dwell=20", "settle=0.5", "windows=12"],
    "fixed_position": ["dwell=40", "readings=20", "settle=1"],
    "servo_vertical_level": ["dwell=40", "windows=8", "cycles=1", "settle=1"],
}


def words(*tests: str, sets: tuple[str, ...] = ()) -> list[str]:
    values = [f"tests={' '.join(tests)}", *(f"{t}.{v}" for t in tests for v in PLANS[t]), "gyro.markov_tau=3", *sets]
    return [w for v in values for w in ("--set", v)]


TWO = words("tumble_single_axis", "fixed_position")


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A suite that ran: three tests, with a name for the signature."""
    folder = tmp_path_factory.mktemp("suite")
    more = [
        "--set",
        "operator=A. B.",
        "--set",
        "instrument=gyro 17",
        "--set",
        "u_scale_factor=1e-3",
        "--set",
        "u_latitude=1arcsec",
    ]
    made = subprocess.run(
        [sys.executable, "-m", "gyrobench", "run", NAME, *words(*PLANS), *more, "--seed", "3", "--out", "s"],
        cwd=folder, capture_output=True, text=True, check=False, env=_env(),
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    (folder / "out.txt").write_text(made.stdout, encoding="utf-8")
    return folder / "s"


def _env() -> dict[str, str]:
    import os

    return {**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[2])}


def result(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return found


# ------------------------------------------------------------------------------------------- what it leaves
@pytest.mark.long
def test_each_test_leaves_a_run_of_its_own(done: Path) -> None:
    for name in PLANS:
        assert Record.load(done / name).complete
        for file in ("result.json", "report.html", "report.pdf"):
            assert (done / name / file).stat().st_size > 1000
    run_schema = json.loads((standard_folder() / "reports" / "run.schema.json").read_text(encoding="utf-8"))
    document = json.loads((done / "run.json").read_text(encoding="utf-8"))
    jsonschema.validate(document, run_schema)
    assert document["complete"] and list(document["tests"]) == list(PLANS)
    for name, test in document["tests"].items():
        assert test["report_id"] == result(done / name)["report_id"]
        jsonschema.validate(json.loads((done / name / "run.json").read_text(encoding="utf-8")), run_schema)


@pytest.mark.long
def test_a_test_alone_with_the_seed_of_the_suite_gives_the_same_record(done: Path) -> None:
    suite = load_test(NAME)
    assert isinstance(suite, Suite)
    values: dict[str, Any] = dict(v.split("=") for v in PLANS["fixed_position"]) | {"gyro.markov_tau": 3.0}
    alone = run("fixed_position", values=values, seed=suite.seed_of(3, "fixed_position"))
    assert alone.windows["mean"].tolist() == Record.load(done / "fixed_position").windows["mean"].tolist()


@pytest.mark.long
def test_the_result_follows_the_schema_and_the_page_the_result(done: Path) -> None:
    from html.parser import HTMLParser

    found = result(done)
    schema = json.loads((standard_folder() / "reports" / "result.schema.json").read_text(encoding="utf-8"))
    jsonschema.validate(found, schema)
    page = (done / "report.html").read_text(encoding="utf-8")
    checked = 0

    class Reader(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            nonlocal checked
            a = dict(attrs)
            if tag == "data" and a.get("data-pointer"):
                value: Any = found
                for part in str(a["data-pointer"]).split("/")[1:]:
                    part = part.replace("~1", "/").replace("~0", "~")
                    value = value[int(part)] if isinstance(value, list) else value[part]
                assert float(str(a["data-value"])) == value
                checked += 1

    Reader().feed(page)
    assert checked > 200
    for text in (
        "Normalized errors between methods",
        "Statements and signatures",
        "A. B.",
        "gyro 17",
        "All data are simulated",
    ):
        assert text in page
    for m in found["suite"]["members"]:
        assert m["report_id"] in page and m["record_sha256"] in page


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="no pdftotext")
@pytest.mark.long
def test_the_pdf_says_the_same(done: Path) -> None:
    text = subprocess.run(
        ["pdftotext", "-layout", done / "report.pdf", "-"], capture_output=True, text=True, check=True
    )
    for words_ in ("Tested by", "Approved by", "A. B.", "weighted mean", "end of report", result(done)["report_id"]):
        assert words_ in text.stdout


@pytest.mark.long
def test_the_terminal_gives_the_answer(done: Path) -> None:
    said = (done.parent / "out.txt").read_text(encoding="utf-8")
    assert "methods: consistent" in said and "largest E_n" in said and "ω_d" in said


@pytest.mark.long
def test_the_shared_scale_factor_is_named(done: Path) -> None:
    """Two tests have a torquer in their loop; the latitude is a source of one alone."""
    found = result(done)["suite"]
    assert found["shared"] == ["torquer scale factor"]
    drift = next(q for q in found["quantities"] if q["name"] == "ω_d")
    assert [v["u_shared"] > 0.0 for v in drift["values"]] == [True, True, False]


@pytest.mark.long
def test_report_again_and_from_the_runs(done: Path, gyrobench: Command) -> None:
    """The same numbers from the suite's folder, and from the folders of its tests as if they came from elsewhere."""
    before = result(done)
    assert gyrobench("report", done, figures=False)[0] == 0
    again = result(done)
    assert again["coefficients"] == before["coefficients"] and again["suite"] == before["suite"]
    code, out, _ = gyrobench("reduce", NAME, *(w for n in PLANS for w in ("--data", done / n)), "--out", "r", "--json")
    assert code == 0 and json.loads(out)["coefficients"] == before["coefficients"]
    assert [q["words"] for q in json.loads(out)["suite"]["quantities"]] == [
        q["words"] for q in before["suite"]["quantities"]
    ]


@pytest.mark.long
def test_specification_and_strict(done: Path, gyrobench: Command, tmp_path: Path) -> None:
    spec = tmp_path / "limits.toml"
    for limit, code, verdict in ((5.0, 0, "pass"), (0.001, 1, "fail")):
        spec.write_text(f'[coefficients.D_F]\nunit = "deg/h"\nmin = {-limit}\nmax = {limit}\n', encoding="utf-8")
        assert gyrobench("report", done, "--spec", spec, "--strict", figures=False)[0] == code
        assert result(done)["verdict"] == verdict


@pytest.mark.long
def test_disagreement_fails_strict(done: Path, gyrobench: Command) -> None:
    """The fixed position of another gyro: the run says so, and names the parameter."""
    other = words("fixed_position", "servo_vertical_level", sets=("fixed_position.gyro.D_F=0.5deg/h",))
    code, out, _ = gyrobench("run", NAME, *other, "--strict", "--out", "o")
    assert code == 1 and "methods: inconsistent" in out and "gyro.D_F" in out
    assert result(Path("o"))["suite"]["disagreeing"] == ["ω_d"]


# ------------------------------------------------------------------------------------ stopped and failed
@pytest.mark.long
def test_a_stopped_suite_goes_on(gyrobench: Command, done: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second test is stopped in the middle; --resume ends it, bit-equal, and leaves the first as it is."""
    run = ["run", NAME, *words("fixed_position", "tumble_single_axis"), "--seed", "3", "--out", "s"]

    def interrupt(self: progress_display.ProgressDisplay, status: ProgressReport) -> None:
        if self.label == "tumble_single_axis" and status.windows >= 2:
            signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as patch, unhurried():
        patch.setattr(progress_display.ProgressDisplay, "__call__", interrupt)
        code, _, err = gyrobench(*run)
    assert code == 130 and "the same command with --resume continues the suite" in err
    assert not Path("s/result.json").exists() and not Record.load(Path("s/tumble_single_axis")).complete
    code, _, err = gyrobench("report", "s")
    assert code == 2 and "the suite is not complete" in err
    first = Path("s/fixed_position/run.json").stat().st_mtime_ns
    code, _, err = gyrobench(*run, "--resume")
    assert (
        code == 0
        and "fixed_position (1 of 2): already complete; kept" in err
        and "tumble_single_axis (2 of 2): resuming" in err
    )
    assert Path("s/fixed_position/run.json").stat().st_mtime_ns == first
    whole, stopped = (Record.load(f / "tumble_single_axis").windows for f in (done, Path("s")))
    assert all(whole[n].tolist() == stopped[n].tolist() for n in whole)
    assert gyrobench(*run, "--seed", "2")[2].count("holds another run") == 1


@pytest.mark.long
def test_one_failed_test_does_not_stop_the_others(gyrobench: Command) -> None:
    """A current limit that saturates: the reduction of this one test refuses, the report is of the others."""
    three = words(*PLANS, sets=("fixed_position.rebalance.i_max=1e-9",))
    code, out, err = gyrobench("run", NAME, *three, "--out", "s")
    assert code == 3 and "fixed_position failed; the report in s covers the others" in err
    found = result(Path("s"))
    assert [m["label"] for m in found["suite"]["members"]] == ["tumble_single_axis", "servo_vertical_level"]
    assert found["suite"]["failed"][0]["label"] == "fixed_position"
    assert any(w.startswith("fixed_position gave no result") for w in found["warnings"])
    assert "flagged" in found["suite"]["failed"][0]["reason"]
    assert Record.load(Path("s/fixed_position")).complete  # what it recorded is there
    assert "methods: " in out
    code, _, err = gyrobench("run", NAME, *three, "--out", "s", "--resume")  # nothing runs again
    assert code == 3 and "fixed_position (2 of 3): reducing again" in err and err.count(": already complete; kept") == 2


# ------------------------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["run", NAME, "--set", "tests=servo_polar eight_position"], "are not of one gyro"),
        (["run", NAME, "--set", "tests=servo_polar,fixed_position", "--set", "gyro.D_X=1"], "has no parameter 'D_X'"),
        (["run", NAME, "--set", "latitude=5deg"], "servo_polar: latitude 5"),
        (["run", NAME, "--set", "gyr.D_I=1"], "no slot 'gyr'; did you mean gyro"),
        (["run", NAME, "--part", "wheel=x"], "no test of the suite has a slot 'wheel'"),
        (["run", NAME, "--resume", "--set", "tests=nothing"], "no test 'nothing'"),
        (["run", NAME, "--resume", "--set", "tests=servo_polar,fixed_position"], "--resume: nothing to continue"),
        (["show", NAME, "--picture", "x.svg"], "a suite has no wiring of its own"),
        (["export", NAME, "--to", "ssp"], "is a suite"),
        (["reduce", NAME, "--template"], "reduce each record by its own test"),
        (["reduce", NAME, "--data", "a"], "name two runs or more"),
        (["reduce", NAME, "--data", "a", "--data", "b"], "a: no result.json"),
        (["reduce", NAME, "--data", "a", "--data", "b", "--set", "gyro.D_I=1"], "the tests have been run"),
        (["reduce", "fixed_position", "--data", "a", "--data", "b"], "one record at a time"),
    ],
)  # fmt: skip
def test_refused(gyrobench: Command, arguments: list[str], text: str) -> None:
    code, _, err = gyrobench(*arguments)
    assert code == 2 and text in err
    assert not Path("reports").exists()


def test_show_and_list(gyrobench: Command) -> None:
    code, out, _ = gyrobench("show", NAME, "--json")
    found = json.loads(out)
    assert code == 0 and [t["name"] for t in found["tests"]] == found["sets"]["floated"].split()
    assert all(t["duration"] > 0.0 and t["plan"] for t in found["tests"])
    assert "--seed" in gyrobench("show", NAME)[1]
    assert NAME in gyrobench("list")[1]


# ------------------------------------------------------------------------------------- measured records
@pytest.mark.long
def test_measured_records_become_a_suite(gyrobench: Command, done: Path) -> None:
    """The simulated windows as a laboratory would write them down: same numbers, no truth; what it does not state and a
    signature wants is said.
    """
    w = Record.load(done / "fixed_position").windows
    about = ["latitude = 45.75deg", "instrument = gyro 17", "operator = A. B.", "conditions = 22 °C, warm for 4 h"]
    columns = (w["t_start"].tolist(), w["t_end"].tolist(), (w["mean"] * 1e3).tolist())
    rows = [",".join(map(repr, row)) for row in zip(*columns, strict=True)]
    runs = []
    for k, number in enumerate((17, 17, 18)):
        text = [f"# {x}".replace("gyro 17", f"gyro {number}") for x in (*about, "k = 17.2deg/h/mA", "attitude = E U")]
        Path(f"{k}.csv").write_text("\n".join([*text, "t_start [s],t_end [s],mean [mA]", *rows]), encoding="utf-8")
        assert gyrobench("reduce", "fixed_position", "--data", f"{k}.csv", "--out", f"run{k}", pages=not k)[0] == 0
        runs.append(f"run{k}")
    page = Path("run0/report.html").read_text(encoding="utf-8")
    assert "22 °C, warm for 4 h" in page and "Missing before signature: laboratory, equipment" in page
    code, out, _ = gyrobench("reduce", NAME, "--data", "run0", "--data", "run1", "--set", "laboratory=L", "--json")
    found = json.loads(out)
    assert code == 0 and found["instrument"] == "gyro 17" and not found["simulated"]
    assert found["provenance"]["conditions"] == "22 °C, warm for 4 h" and found["provenance"]["laboratory"] == "L"
    (q,) = found["suite"]["quantities"]
    assert q["truth"] is None and [v["label"] for v in q["values"]] == ["fixed_position run0", "fixed_position run1"]
    assert q["p"] == 1.0 and q["mean"]["estimate"] == pytest.approx(q["values"][0]["estimate"])
    code, _, err = gyrobench("reduce", NAME, "--data", "run0", "--data", "run2")
    assert code == 2 and "different instruments: gyro 17: fixed_position run0; gyro 18: fixed_position run2" in err
    code, _, err = gyrobench("reduce", NAME, "--data", "run0", "--data", done / "tumble_single_axis")
    assert code == 2 and "not of one gyro" in err
