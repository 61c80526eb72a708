"""Everything that is stored says when it was changed: records, results, campaigns, caches; tests/benchmarks/fuzz.py."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from commanding import Command
from fuzzing import CORPUS

from gyrobench import files
from gyrobench.campaign.execution.store import Campaign, CampaignError, CampaignStore
from gyrobench.packaging.fmu import build
from gyrobench.record.record import Record
from gyrobench.record.run_document import NO_DIGEST, RecordError, RunDocument, read_run
from gyrobench.system.system import load_system
from gyrobench.workflow.run_comparison import read_result


def flip(file: Path, old: bytes, new: bytes) -> None:
    """Change what stands in a file once or more."""
    content = file.read_bytes()
    assert content.count(old) >= 1 and len(old) == len(new)
    file.write_bytes(content.replace(old, new, 1))


def test_a_digit_of_run_json_is_not_changed_unseen(tmp_path: Path) -> None:
    Record({"mean": np.array([0.1])}, {}, RunDocument(system="s", options={"latitude": 0.8})).save(tmp_path)
    assert Record.load(tmp_path).run.notes == []
    flip(tmp_path / "run.json", b"0.8", b"0.9")
    with pytest.raises(RecordError, match=r"run\.json: changed after it was saved .*restore it from a copy, or repeat"):
        Record.load(tmp_path)


def test_a_record_of_0_1_0_is_read_with_a_note(tmp_path: Path) -> None:
    """Its run.json holds no digest."""
    Record({"mean": np.array([0.1])}, {}, RunDocument(system="s", notes=["one"])).save(tmp_path)
    document = json.loads((tmp_path / "run.json").read_text())
    del document["sha256"]
    (tmp_path / "run.json").write_text(json.dumps(document))
    record = Record.load(tmp_path)
    assert record.run.notes == ["one", NO_DIGEST] and record.windows["mean"].tolist() == [0.1]
    record.save(tmp_path)
    assert Record.load(tmp_path).run.notes == ["one", NO_DIGEST]  # what was not known then is not known now


@pytest.mark.long
def test_a_result_that_was_changed_is_refused(tmp_path: Path, gyrobench: Command) -> None:
    Path("m.csv").write_bytes(CORPUS["fixed_position"])
    gyrobench("reduce", "fixed_position", "--data", "m.csv", "--out", "r")
    result = read_result(Path("r"))
    estimate = repr(result.coefficients[0].estimate).encode()
    flip(Path("r/result.json"), estimate, estimate[:-1] + (b"2" if estimate[-1:] != b"2" else b"3"))
    shutil.copytree("r", "other")
    for words, end in ((("compare", "r", "other"), 2), (("report", "r"), 3)):
        code, _, err = gyrobench(*words)
        assert code == end and "r/result.json: changed after it was saved (its SHA-256 is not the one in it)" in err
    Path("r/result.json").unlink()
    gyrobench("report", "r", figures=False)
    assert read_result(Path("r")).coefficients == result.coefficients


def test_rows_and_description_of_a_campaign_that_were_changed_are_refused(tmp_path: Path) -> None:
    with CampaignStore(tmp_path / "c") as store:
        rows = [{"run": "0", "index": 0, "system": "toy", "seed": 1, "state": "done", "a.estimate": -0.396}]
        store.begin({"name": "lot", "axes": []}, {"0": {"index": 0}})
        store.append(rows, {"a.estimate": "°/h"})
    assert Campaign.open(tmp_path / "c").notes == []
    (file,) = (tmp_path / "c" / "runs").iterdir()
    content = file.read_bytes()
    flip(file, np.float64(-0.396).tobytes(), np.float64(-1.976).tobytes())
    with pytest.raises(
        CampaignError, match=r"changed after it was saved .*remove the file: the runs in it are run again"
    ):
        Campaign.open(tmp_path / "c")
    file.write_bytes(content)
    flip(tmp_path / "c" / "campaign.json", b'"lot"', b'"lob"')
    with pytest.raises(CampaignError, match=r"campaign\.json: changed after it was saved .*or remove it"):
        Campaign.open(tmp_path / "c")
    (tmp_path / "c" / "campaign.json").unlink()
    with CampaignStore(tmp_path / "c") as store:  # as the message says
        assert store.begin({"name": "lot", "axes": []}, {"0": {"index": 0}}) == {"0": "done"}
    document = json.loads((tmp_path / "c" / "campaign.json").read_text())
    del document["sha256"]
    (tmp_path / "c" / "campaign.json").write_text(json.dumps(document))
    assert "has no SHA-256 of its own" in Campaign.open(tmp_path / "c").notes[0]


@pytest.mark.long
def test_a_damaged_cache_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An FMU cut off, a library of the engine with other bytes, and the copy of an FMU that a run takes."""
    from gyrobench.engine.engine_library import SOURCE, library_path, make_library, open_library

    monkeypatch.setenv("GYROBENCH_CACHE", str(tmp_path))
    fmu = build("meter", out=tmp_path / "fmus")
    whole = fmu.read_bytes()
    (cached,) = (tmp_path / "gyrobench").glob("meter-*.fmu")
    cached.write_bytes(whole[:1000])
    fmu.write_bytes(whole[:1000])
    assert build("meter", out=tmp_path / "fmus").read_bytes() == cached.read_bytes() == whole
    fmu.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    assert build("meter", out=tmp_path / "fmus").read_bytes() == whole

    source = SOURCE.read_text(encoding="utf-8")
    library = library_path("engine", source)
    library.write_bytes(b"\x7fELF" + bytes(5000))
    open_library(make_library(library, source))


def test_the_content_is_on_the_disk_before_the_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A power cut between the two would leave a file of the right name without content."""
    events: list[str] = []
    replace = os.replace
    monkeypatch.setattr(files, "to_disk", lambda path: events.append(f"disk {path.suffix}"))
    monkeypatch.setattr(files.os, "replace", lambda a, b: (events.append("name"), replace(a, b)))
    Record({"mean": np.array([0.1])}, {}, RunDocument(system="s")).save(tmp_path / "r")
    assert events == ["disk .part", "name", "disk "] * 2  # table, run.json


@pytest.mark.long
def test_an_unzipped_archive_that_was_changed_is_unzipped_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from gyrobench.exchange.ssp_export import export_ssp
    from gyrobench.exchange.ssp_import import open_archive

    export_ssp(load_system("open_loop_drift"), tmp_path / "e.ssp")
    monkeypatch.setenv("GYROBENCH_CACHE", str(tmp_path / "cache"))
    folder, _ = open_archive(tmp_path / "e.ssp")
    fmu = next((folder / "resources").glob("*.fmu"))
    whole = fmu.read_bytes()
    fmu.write_bytes(whole[:-40])
    assert open_archive(tmp_path / "e.ssp")[0] == folder and fmu.read_bytes() == whole


def test_a_suite_says_that_its_document_was_changed(tmp_path: Path) -> None:
    from gyrobench.record.run_document import SuiteDocument

    SuiteDocument(system="drift_test_suite", runs=["a"], title="one").write(tmp_path)
    flip(tmp_path / "run.json", b"one", b"two")
    with pytest.raises(RecordError, match="changed after it was saved"):
        read_run(tmp_path)
