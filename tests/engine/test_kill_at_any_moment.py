"""A process that is killed (SIGKILL) somewhere between its first step and the last file of its report.

``--resume`` ends with the record and the result of a run in one piece, and with nothing left over.
tests/benchmarks/kill_at_any_moment.py does the same at random times.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from commanding import Command
from processes import processes_in, unhurried

from gyrobench.commands import cli
from gyrobench.engine import checkpoint, supervision
from gyrobench.files import TEMPORARY, FolderLock, sweep
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.workflow import run_execution

NAME = "tumble_single_axis"
TINY = ["--set", "rate=60deg/s", "--set", "windows=6", "--set", "dwell=2s", "--set", "table.index_rate=2"]


def die(*_: Any, **__: Any) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def once_there(file: Path) -> Callable[[Any], None]:
    look = supervision._Supervisor._look

    def looking(supervisor: Any) -> None:
        look(supervisor)
        if file.is_file():
            die()

    return looking


#: moment -> what is replaced by a kill
MOMENTS: dict[str, Any] = {
    "while the FMUs are loaded": (supervision._Supervisor, "_look", die),
    "after a checkpoint": None,
    "between the tables and run.json": (RunDocument, "write", die),
    "between the record and the end of its run": (checkpoint.CheckpointManager, "remove", die),
    "before the report": (run_execution, "write_report", die),
    "after the report": (FolderLock, "release", die),
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run in one piece."""
    folder = tmp_path_factory.mktemp("whole") / "r"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["gyrobench", "run", NAME, *TINY, "--no-report", "--out", str(folder)])
        with pytest.raises(SystemExit, match="0"):
            cli.main()
    return folder


def killed(words: list[str], folder: Path, moment: str, patch: pytest.MonkeyPatch) -> None:
    """Run a command in a fork of this process, which is killed at the moment."""
    for owner, name, replacement in [
        MOMENTS[moment] or (supervision._Supervisor, "_look", once_there(folder / checkpoint.FILE)),
        *[(checkpoint, name, 0.0) for name in ("FIRST", "PERIOD", "SHARE")],
    ]:
        patch.setattr(owner, name, replacement)
    patch.setattr(sys, "argv", ["gyrobench", *words])
    pid = os.fork()
    if pid == 0:
        try:
            nothing = os.open(os.devnull, os.O_RDWR)
            os.dup2(nothing, 1)
            os.dup2(nothing, 2)
            cli.main()
        finally:
            os._exit(1)
    _, status = os.waitpid(pid, 0)
    assert os.waitstatus_to_exitcode(status) == -signal.SIGKILL


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.long
def test_killed_and_resumed(
    command: Command, tmp_path: Path, whole: Path, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    (tmp_path / "tmp").mkdir()
    out = tmp_path / "r"
    with monkeypatch.context() as patch, unhurried():
        killed(["run", NAME, *TINY, "--no-report", "--out", str(out)], out, moment, patch)
    end = time.monotonic() + 60.0
    while processes_in(tmp_path / "tmp") and time.monotonic() < end:
        time.sleep(0.01)
    assert processes_in(tmp_path / "tmp") == []
    # on a busy machine the run may have a checkpoint before it is looked at for the first time
    loading = moment == "while the FMUs are loaded" and not (out / checkpoint.FILE).is_file()
    code, _, err = command("run", NAME, *TINY, "--out", out, "--resume")
    assert code == 0, err
    record = Record.load(out)
    assert record.complete and record.same_data(Record.load(whole))
    from_checkpoint = moment in (*list(MOMENTS)[:2], "between the tables and run.json") and not loading
    assert bool(record.run.resumed_at) == from_checkpoint
    assert ("this one begins at t = 0" in err) == loading
    results = [json.loads((folder / "result.json").read_text(encoding="utf-8")) for folder in (out, whole)]
    assert results[0]["coefficients"] == results[1]["coefficients"]
    assert sorted(p.name for p in out.iterdir()) == sorted(p.name for p in whole.iterdir())
    assert sorted(p.name for p in tmp_path.iterdir()) == ["r", "tmp"]
    sweep()
    kept = list((tmp_path / "tmp").glob(f"{TEMPORARY}*"))
    assert all((p / ".lock").read_text() == str(os.getpid()) for p in kept)


def test_a_mistyped_folder_is_not_taken_for_a_killed_run(command: Command, tmp_path: Path) -> None:
    code, _, err = command("run", NAME, *TINY, "--out", tmp_path / "r", "--resume")
    assert code == 2 and "nothing to continue in" in err
