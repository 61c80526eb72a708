"""A file that was dropped is called by its own name, wherever the studio keeps it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from studio_pages import CHROMIUM, NONE, base_of
from studio_requests import Door

from gyrobench.bench import Bench
from gyrobench.files import temporary_folder
from gyrobench.studio.request import FILES
from gyrobench.studio.words import shown


def test_a_message_names_a_dropped_file_without_the_folders_that_keep_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the root, from the working folder, and where a log was made a text of; another file keeps its folders."""
    home = tmp_path / "my bench"
    (home / "reports").mkdir(parents=True)
    (home / "systems").mkdir()
    monkeypatch.chdir(home)
    kept = Bench.find().out / FILES / "0123456789ab" / "my data.csv"
    for path in (kept, os.path.relpath(kept), temporary_folder() / "my data.csv"):
        assert shown(f"{path}, row 3: {path}: no number") == "my data.csv, row 3: my data.csv: no number"
    other = Bench.find().out / "runs" / "0123456789ab" / "a.csv"
    assert shown(f"{other}: empty") == f"{other}: empty"


@pytest.mark.long
def test_no_page_of_a_dropped_file_has_its_folder(studio: tuple[str, Path]) -> None:
    """One that is no table; of a log that cannot be read."""
    door, files = Door.of(studio[0]), studio[1] / "reports" / "out" / FILES / "0123456789ab"
    files.mkdir(parents=True)
    for name, content, said in (
        ("bad.csv", b"hello\nworld\n", "bad.csv: no table of numbers"),
        ("bad.h5", b"\x89HDF\r\n\x1a\nxxxx", "bad.h5: not usable"),
    ):
        (files / name).write_bytes(content)
        answer = door.get(f"/data?file=0123456789ab/{name}&test=fixed_position")[2].decode()
        assert said in answer and str(files) not in answer and f"{FILES}/0123456789ab/{name}: " not in answer


@pytest.mark.skipif(CHROMIUM is None, reason=NONE)
@pytest.mark.long
def test_each_column_without_a_name_may_be_a_channel_of_a_drift_record(page: Any, studio: tuple[str, Path]) -> None:
    """One is the rate; another, by its unit, a second one, and a third the temperature; the fourth is left out."""
    files = studio[1] / "reports" / "out" / FILES / "00000000000a"
    files.mkdir(parents=True)
    rows = [f"{0.01 * k:.2f},{k % 7},{k % 5},{20 + k % 3},{k % 2}\n" for k in range(400)]
    (files / "bare.csv").write_text("".join(rows), encoding="utf-8")
    page.goto(base_of(studio) + "/data?file=00000000000a/bare.csv&test=drift_record")
    for name, unit in (("rate", "deg/s"), ("column_3", "deg/s"), ("column_4", "degC")):
        page.get_by_label(f"column for {name}", exact=True).click()
        chosen = "column_2" if name == "rate" else name
        page.get_by_role("option", name=chosen, exact=True).click()
        page.get_by_label(f"unit of {name}", exact=True).fill(unit)
    page.get_by_label("unit of time", exact=True).fill("s")
    page.get_by_role("button", name="Check the file").click()
    page.get_by_text("Nothing is wrong with the file").wait_for()
    text = (files / "drift_record.toml").read_text(encoding="utf-8")
    assert (
        '[columns.column_3]\nfrom = 3\nunit = "deg/s"' in text and '[columns.column_4]\nfrom = 4\nunit = "degC"' in text
    )
    assert "[columns.column_5]" not in text
    assert page.get_by_label("column for column_5", exact=True).count() == 1
