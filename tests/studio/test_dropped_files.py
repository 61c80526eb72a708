"""A file that was dropped is called by its own name, wherever the studio keeps it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from studio_requests import Door

from gyrobench.bench import Bench
from gyrobench.files import temporary_folder
from gyrobench.studio.frame import FILES, shown


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
