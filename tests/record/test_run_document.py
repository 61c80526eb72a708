"""run.json: its typed form, its published schema, and the digests of the tables."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from gyrobench import reading
from gyrobench.bench import Bench, standard_folder
from gyrobench.engine.run_errors import RunInterrupted
from gyrobench.engine.session import run
from gyrobench.record.record import Record
from gyrobench.record.run_document import (
    LinearModel,
    OpenLoop,
    PlanRow,
    RecordError,
    RunDocument,
    SuiteDocument,
    SuiteTestRun,
    read_run,
    schema,
)
from gyrobench.system.suite import Suite, load_test
from gyrobench.system.system import load_system

SCHEMA_FILE = standard_folder() / "reports" / "run.schema.json"
SYSTEMS = sorted(n for n in Bench(standard_folder()).systems() if not isinstance(load_test(n), Suite))
MEASURED = [n for n in SYSTEMS if load_system(n).measured_data is not None]
WITH_LOOPS = [n for n in SYSTEMS if load_system(n).loops]


def published() -> Any:
    return jsonschema.Draft202012Validator(json.loads(SCHEMA_FILE.read_text(encoding="utf-8")))


def saved(folder: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    return document


# ------------------------------------------------------------------------------------------- schema
def test_the_published_schema_is_that_of_the_typed_form() -> None:
    """To renew it: write json.dumps(schema(), indent=2, ensure_ascii=False) and a line feed into the file."""
    jsonschema.Draft202012Validator.check_schema(schema())
    assert SCHEMA_FILE.read_text(encoding="utf-8") == json.dumps(schema(), indent=2, ensure_ascii=False) + "\n"


@pytest.mark.parametrize("name", [n for n in SYSTEMS if load_system(n).slots])
@pytest.mark.long
def test_a_run_of_every_system_follows_the_schema(name: str, tmp_path: Path) -> None:
    """A run that is stopped after ten steps: run.json has all that a run begins with, and what its end adds."""
    system = load_system(name)
    with pytest.raises(RunInterrupted):
        run(system, out=tmp_path, stop_at=10 * system.step, seed=3)
    document = saved(tmp_path)
    published().validate(document)
    assert {"parts", "plan", "order", "parameters", "tables", "problem", "steps"} <= set(document)
    assert set(document) <= {*RunDocument.model_fields, "sha256"}, "every key has a field"
    assert ("linear" in document) is (name in WITH_LOOPS)
    read = read_run(tmp_path)
    assert isinstance(read, RunDocument) and reading.sealed(read.as_dict()) == document
    assert [row.phase for row in read.plan] == list(range(1, len(document["plan"]) + 1))
    assert read.parts.keys() == system.slots.keys() and all(len(p.sha256) == 64 for p in read.parts.values())


CELLS = {"phase": "1", "n": "5", "flagged": "0", "day": "1", "cycle": "1", "position": "{k}"}


def rows(header: str, count: int) -> list[str]:
    """Rows that a reader takes, though nothing could be reduced from them: all numbers rise."""
    names = [c.partition("[")[0].strip() for c in header.split(",")]
    start = [float(n == "t_end") for n in names]
    return [
        ",".join(CELLS.get(n, f"{k + 1 + 0.5 * s}").format(k=k + 1) for n, s in zip(names, start, strict=True))
        for k in range(count)
    ]


#: their readers compare the columns of a row; tests/systems/test_table_measured.py has records that fit
COMPARED = {"angle_system_test", "table_position_test", "table_rate_test"}


@pytest.mark.parametrize("name", [n for n in MEASURED if n not in COMPARED])
def test_a_measured_record_of_every_test_follows_the_schema(name: str, tmp_path: Path) -> None:
    system = load_system(name)
    assert system.measured_data is not None
    *comments, header = system.measured_data.template.splitlines()
    file = tmp_path / "data.csv"
    file.write_text("\n".join([*comments, "# laboratory = L", header, *rows(header, 3)]) + "\n", encoding="utf-8")
    record = system.read_measured(file, {"operator": "A. Tester"})
    folder = record.save(tmp_path / "record")
    document = saved(folder)
    published().validate(document)
    assert set(document) <= {*RunDocument.model_fields, "sha256"}, "every key has a field"
    assert document["measured"] and document["laboratory"] == "L" and document["operator"] == "A. Tester"
    assert Record.load(folder).run == record.run


# -------------------------------------------------------------------------------------- typed form
def test_what_was_not_given_is_not_written() -> None:
    document = RunDocument(system="s", plan=[PlanRow(phase=1, face="up")], complete=True)
    assert document.as_dict() == {"system": "s", "plan": [{"phase": 1, "face": "up"}], "complete": True}
    document.stopped_at = 3.0
    document.notes.append("filled in place")
    assert document.as_dict()["stopped_at"] == 3.0 and document.as_dict()["notes"] == ["filled in place"]
    assert document.replace(seed=4).as_dict() == {**document.as_dict(), "seed": 4}
    assert document.seed is None


def test_numbers_that_json_lacks_become_text() -> None:
    assert RunDocument(parameters={"a.b": [1.0, float("inf")]}).as_dict() == {"parameters": {"a.b": [1.0, "inf"]}}


def test_a_key_of_python_is_a_name_in_json() -> None:
    model = LinearModel(A=[], B=[], C=[], D=[[2.0]], inputs=["a.u"], outputs=["L"], states=[], step=0.0)
    loop = OpenLoop.model_validate({"break": "a.u", "continuous": model})
    assert loop.as_dict()["break"] == "a.u" and loop.break_at == "a.u"
    assert loop.of("continuous") == model and loop.of("discrete") is None


def test_keys_of_a_newer_version_are_kept(tmp_path: Path) -> None:
    document = {"system": "s", "complete": True, "plan": [{"phase": 1, "colour": "red"}], "mood": {"a": [1]}}
    (tmp_path / "run.json").write_text(json.dumps(reading.sealed(document)), encoding="utf-8")
    read = read_run(tmp_path)
    assert read.as_dict() == document
    published().validate(document)
    published().validate(reading.sealed(document))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[1]", "not a JSON object"),
        ("{", "not a JSON file: Expecting property name"),
        ('{"plan": [{"phase": "first"}]}', r"not a run.json of gyrobench: plan.0.phase: .*integer"),
        ('{"step": "fast", "seed": 1.5, "order": 1, "cuts": 2}', r"step: .*; .*; and 1 more"),
    ],
)
def test_what_is_no_run_json_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "run.json").write_text(text, encoding="utf-8")
    with pytest.raises(RecordError, match=message):
        read_run(tmp_path)
    with pytest.raises(RecordError, match=r"nothing here/run\.json: No such file"):
        read_run(tmp_path / "nothing here")


def test_a_suite_is_told_from_a_run(tmp_path: Path) -> None:
    suite = SuiteDocument(system="s", tests={"a": SuiteTestRun(folder="a")}, complete=True)
    suite.write(tmp_path)
    published().validate(saved(tmp_path))
    assert read_run(tmp_path) == suite
    with pytest.raises(RecordError, match=r"the run of a suite; its tests have a record each: .*/a"):
        Record.load(tmp_path)


# ------------------------------------------------------------------------------------------ tables
@pytest.fixture
def folder(tmp_path: Path) -> Path:
    windows = {"phase": np.array([1, 1]), "mean": np.array([0.1, 0.2])}
    return Record(windows, {"time": np.arange(3.0)}, RunDocument(system="s")).save(tmp_path / "r")


def test_run_json_holds_the_digest_of_every_table(folder: Path) -> None:
    import hashlib

    tables = saved(folder)["tables"]
    assert set(tables) == {"record.parquet", "channels.parquet"}
    for name, digest in tables.items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest
    assert Record.load(folder).windows["mean"].tolist() == [0.1, 0.2]


def test_a_changed_table_is_refused(folder: Path) -> None:
    other = Record({"phase": np.array([1, 1]), "mean": np.array([0.1, 0.3])}).save(folder.parent / "other")
    shutil.copyfile(other / "record.parquet", folder / "record.parquet")
    with pytest.raises(RecordError) as caught:
        Record.load(folder)
    assert str(caught.value) == (
        f"{folder / 'record.parquet'}: changed after it was saved (its SHA-256 is not the one in run.json); restore it "
        "from a copy, or repeat the run; your own data are reduced by gyrobench reduce"
    )


def test_a_missing_table_and_one_too_many_are_refused(folder: Path) -> None:
    (folder / "channels.csv").write_text("time\n0\n", encoding="utf-8")
    with pytest.raises(RecordError, match=r"channels\.csv: not a table of this record"):
        Record.load(folder)
    (folder / "channels.csv").unlink()
    (folder / "channels.parquet").unlink()
    with pytest.raises(RecordError, match=r"channels\.parquet: missing, but named in run\.json; restore it"):
        Record.load(folder)


def test_a_record_without_channels_leaves_none_of_an_earlier_one(folder: Path) -> None:
    Record({"mean": np.zeros(1)}, {}, RunDocument(system="s")).save(folder)
    assert sorted(p.name for p in folder.iterdir()) == ["record.parquet", "run.json"]
    assert Record.load(folder).channels == {}


def test_an_old_run_json_names_no_tables_and_loads(folder: Path) -> None:
    document = saved(folder)
    del document["tables"], document["sha256"]
    (folder / "run.json").write_text(json.dumps(document), encoding="utf-8")
    (folder / "channels.parquet").unlink()
    record = Record.load(folder)
    assert record.windows["mean"].tolist() == [0.1, 0.2] and record.channels == {}


def test_tables_as_csv_have_digests_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gyrobench.record.record._have_parquet", lambda: False)
    folder = Record({"mean": np.array([0.1])}, {}, RunDocument(system="s")).save(tmp_path / "r")
    assert set(saved(folder)["tables"]) == {"record.csv"} and Record.load(folder).windows["mean"].tolist() == [0.1]
    (folder / "record.csv").write_text("mean\n0.2\n", encoding="utf-8")
    with pytest.raises(RecordError, match=r"record\.csv: changed after it was saved"):
        Record.load(folder)
