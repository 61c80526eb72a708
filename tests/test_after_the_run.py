"""Whatever goes wrong after a run, in a user's own code too: no traceback, the place, and where the record is."""

from __future__ import annotations

import ast
import builtins
import json
from pathlib import Path

import pytest
from commanding import Command

from gyrobench.bench import standard_folder
from gyrobench.record.record import Record
from gyrobench.workflow.catalog import init_bench

SYSTEM = '''
import numpy as np

from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.result import Coefficient, DriftTestResult, Series
from gyrobench.system.system import MeasuredData, Option, Slot, System


def read(system, file, values):
    for name, value in values.items():
        system.set(name, value)
    return Record({"t": np.zeros(2)}, {}, RunDocument(system="own", options=dict(system.values), measured=True))


class Own(System):
    """A site, read once."""

    title = "Own test"
    slots = {"site": Slot("Site", "site")}
    options = {"raises": Option("nothing", str, "what goes wrong")}
    measured_data = MeasuredData("time [s]\\n", read)
    channels = ("site.f[3]",)
    stop = 3.0
    step = 0.1

    def findings(self, record):
        raises = record.run.options["raises"]
        gravity = 9.8
        if raises == "key":
            record.run.options["nothing"]
        if raises == "zero":
            gravity / 0
        if raises == "singular":
            np.linalg.inv(np.zeros((2, 2)))
        if raises == "stop":
            raise KeyboardInterrupt
        y = [gravity, gravity]
        series = Series("site", [0.0, 1.0], "time", "s", y, y, y, "gravity", "m/s²")
        return DriftTestResult(
            system="own", title=self.title, method="reading", sources=[], conventions=[],
            coefficients=[Coefficient("g", "gravity", "m/s²", gravity, 0.1, 2.0, (9.6, 10.0))], series=[series],
            correlation=[[1.0]], condition=1.0, rank=1, dof=1.0, noise={}, residual_std=0.0,
            residual_unit="m/s²", acf={"lag": [1.0]} if raises == "figure" else {},
        )
'''
LINES = {
    text: number for number, line in enumerate(SYSTEM.splitlines(), 1) for text in (
        'options["nothing"]', "gravity / 0", "np.linalg.inv",
    ) if text in line
}  # fmt: skip
FAILURES = {
    "key": (LINES['options["nothing"]'], "KeyError: 'nothing'"),
    "zero": (LINES["gravity / 0"], "ZeroDivisionError: float division by zero"),
    "singular": (LINES["np.linalg.inv"], "LinAlgError: Singular matrix"),
}


@pytest.fixture
def gyrobench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command) -> Command:
    """Runs a command in a bench with a system ``own``: exit code, standard output, standard error."""
    init_bench(tmp_path / "mine", [])
    folder = tmp_path / "mine" / "systems" / "own"
    folder.mkdir()
    (folder / "system.py").write_text(SYSTEM, encoding="utf-8")
    monkeypatch.chdir(tmp_path / "mine")
    monkeypatch.delenv("GYROBENCH_TRACEBACK", raising=False)
    return command


@pytest.mark.parametrize("raises", FAILURES)
@pytest.mark.long
def test_an_exception_in_the_reduction_names_its_line_and_the_record(gyrobench: Command, raises: str) -> None:
    line, message = FAILURES[raises]
    place = f"{Path('systems/own/system.py').resolve()}:{line}: {message}"
    next_step = "the record is kept in {0}\nafter correcting the cause: gyrobench report {0}"
    code, out, err = gyrobench("run", "own", "--set", f"raises={raises}", "--out", "r")
    assert (code, out) == (3, "")
    assert place in err and next_step.format("r") in err and "Traceback" not in err
    record = Record.load(Path("r"))
    assert record.complete and len(record.channels["time"]) == 4

    code, out, err = gyrobench("report", "r")
    assert (code, out) == (3, "")
    assert place in err and next_step.format("r") in err and "Traceback" not in err

    Path("data.csv").write_text("time\n0\n", encoding="utf-8")
    code, out, err = gyrobench("reduce", "own", "--data", "data.csv", "--set", f"raises={raises}", "--out", "m")
    assert (code, out) == (3, "")
    assert place in err and next_step.format("m") in err
    assert "Traceback" not in err and Record.load(Path("m")).run.options["raises"] == raises

    # the cause corrected, the same command writes the report
    file = Path("systems/own/system.py")
    file.write_text(file.read_text(encoding="utf-8").replace('["raises"]', '["raises"] and ""'), encoding="utf-8")
    for folder in ("r", "m"):
        assert gyrobench("report", folder)[0] == 0
        assert json.loads(Path(folder, "result.json").read_text(encoding="utf-8"))["coefficients"][0]["name"] == "g"


@pytest.mark.long
def test_a_figure_that_cannot_be_drawn(gyrobench: Command) -> None:
    """The failure is in gyrobench's drawing: its line is named, as there is none of the user's."""
    code, out, err = gyrobench("run", "own", "--set", "raises=figure", "--out", "r", pages=True)
    assert (code, out) == (3, "") and "Traceback" not in err
    assert "gyrobench: report not complete:\n  - report.html: " in err and "gyrobench/report/" in err
    assert "  - report.pdf: " in err and "after correcting the cause: gyrobench report r" in err
    assert not Path("r/report.html").exists() and Path("r/result.json").is_file() and Path("r/run.json").is_file()


@pytest.mark.long
def test_a_template_of_the_users_own_that_fails(gyrobench: Command) -> None:
    Path("reports/templates").mkdir()
    template = Path("reports/templates/report.html.j2").resolve()
    template.write_text("<p>\n{{ nothing.there }}", encoding="utf-8")
    code, _, err = gyrobench("run", "own", "--out", "r", pages=True)
    assert code == 3 and "Traceback" not in err
    assert f"  - report.html: {template}:2: UndefinedError: 'nothing' is undefined\n" in err
    assert "report.pdf" not in err and Path("r/report.pdf").is_file()


def test_the_user_stops_the_reduction(gyrobench: Command) -> None:
    code, _, err = gyrobench("run", "own", "--set", "raises=stop", "--out", "r")
    assert code == 130
    assert err == "gyrobench: interrupted; the record is kept in r\nto reduce it: gyrobench report r\n"


@pytest.mark.long
def test_the_traceback_on_request(gyrobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GYROBENCH_TRACEBACK", "1")
    code, _, err = gyrobench("run", "own", "--set", "raises=zero", "--out", "r")
    assert code == 3 and "Traceback" in err and "in findings\n" in err and "the record is kept in r" in err


def test_an_exception_before_the_run_names_its_line_too(gyrobench: Command) -> None:
    """Also one that is raised further in, by a library that the user's code calls."""
    file = Path("systems/own/system.py")
    text = SYSTEM + "\n    def check(self):\n        return [np.linalg.inv(np.zeros((2, 2)))]\n"
    file.write_text(text, encoding="utf-8")
    code, out, err = gyrobench("run", "own", "--out", "r")
    assert (code, out) == (2, "") and "Traceback" not in err
    assert err == f"gyrobench: {file.resolve()}:{len(text.splitlines())}: LinAlgError: Singular matrix\n"
    assert not Path("r").exists()


def test_a_slot_with_an_unknown_socket(gyrobench: Command) -> None:
    file = Path("systems/own/system.py")
    file.write_text(SYSTEM.replace('Slot("Site"', 'Slot("Sit"'), encoding="utf-8")
    code, _, err = gyrobench("show", "own")
    assert (code, err) == (2, "gyrobench: no socket 'Sit'; did you mean Site?\n")


@pytest.mark.long
def test_every_exception_class_is_a_gyrobench_error() -> None:
    """Of gyrobench and of the standard content: an error that is not one would be shown as a fault of the program."""
    builtin = {name for name, value in vars(builtins).items() if isinstance(value, type)}
    exceptions = {name for name in builtin if issubclass(getattr(builtins, name), BaseException)}
    bases: dict[str, set[str]] = {}
    for folder in ("gyrobench", "systems", "components"):
        for file in (standard_folder() / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ClassDef):
                    bases[node.name] = {ast.unparse(b).split(".")[-1] for b in node.bases}
    derived = {"GyrobenchError"}
    while more := {name for name, of in bases.items() if of & derived} - derived:
        derived |= more
    assert len(derived) >= 30
    assert {name for name, of in bases.items() if of & exceptions} <= derived
    assert all(name.endswith(("Error", "Stopped", "Interrupted")) for name in derived)
