"""Folders of runs have one writer, whatever ends a process; what a killed one left is found and finished."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from commanding import Command

from gyrobench import files
from gyrobench.engine import checkpoint
from gyrobench.engine.checkpoint import FILE
from gyrobench.engine.run_driver import Interrupts
from gyrobench.files import LOCK, FolderInUseError, FolderLock, sweep
from gyrobench.record.record import Record

SHORT = ("fixed_position", "--set", "dwell=16s", "--set", "readings=8", "--set", "settle=1s", "--set", "attitude=E U")


STEPPING = "stepping"  # file that a command leaves once its run is past its initialization
CODE = f"""
from pathlib import Path
from gyrobench.commands import cli, progress_display
progress_display.ProgressDisplay.__call__ = lambda self, status: Path({STEPPING!r}).touch()
cli.main()
"""


def started(*words: str, cwd: Path) -> subprocess.Popen[str]:
    """The command in a process of its own, without the nohup of the tests; the reference engine takes hours."""
    code = f"import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL); {CODE}"
    given = [sys.executable, "-c", code, "run", *words]
    return subprocess.Popen(given, cwd=cwd, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def wait_for(condition: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 300.0
    while not condition() and time.monotonic() < deadline:
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    assert condition()


def test_one_process_at_a_time(tmp_path: Path) -> None:
    """The lock ends with the process that has it, killed or not; its file may stay."""
    held = FolderLock(tmp_path / "r")
    code = "from pathlib import Path\nfrom gyrobench.files import FolderLock\n"
    other = subprocess.run(
        [sys.executable, "-c", f"{code}FolderLock(Path({str(tmp_path / 'r')!r}))"], capture_output=True, text=True
    )
    assert other.returncode and f"another run writes here (process {os.getpid()})" in other.stderr
    held.release()
    assert not (tmp_path / "r" / LOCK).exists()
    killed = f"{code}import os, signal\nFolderLock(Path({str(tmp_path / 'r')!r})); os.kill(os.getpid(), signal.SIGKILL)"
    assert subprocess.run([sys.executable, "-c", killed]).returncode == -signal.SIGKILL
    with FolderLock(tmp_path / "r"), pytest.raises(FolderInUseError):
        FolderLock(tmp_path / "r")


MAKING = """
import os, signal, sys, time
from pathlib import Path
from gyrobench import files

folder = Path(sys.argv[1])

def note(name):
    with (folder / name).open("a") as file:
        print(os.getpid(), file=file)

def telling(handle, wait=False, lock=files._lock):
    note("asked")
    lock(handle, wait)

def make(path):
    note("made")
    if "killed" in sys.argv:
        os.kill(os.getpid(), signal.SIGKILL)
    while not (folder / "go").exists():
        time.sleep(0.01)
    files.write_whole(path, b"content")

files._lock = telling
print(files.make_once(folder / "cache" / "library.so", make).read_text())
"""


def test_a_file_of_the_cache_is_made_once(tmp_path: Path) -> None:
    """Six processes want a file: one makes it, and ends only when all others have asked for their turn.

    A process that was killed in its turn has left it to them.
    """
    words = [sys.executable, "-c", MAKING, str(tmp_path)]
    assert subprocess.run([*words, "killed"]).returncode == -signal.SIGKILL
    made, asked = tmp_path / "made", tmp_path / "asked"
    assert len(made.read_text().split()) == 1 and not (tmp_path / "cache" / "library.so").exists()
    asked.unlink()
    six = [subprocess.Popen(words, stdout=subprocess.PIPE, text=True) for _ in range(6)]
    wait_for(lambda: asked.is_file() and len(set(asked.read_text().split())) == 6, six[0])
    (tmp_path / "go").touch()
    assert [p.communicate()[0] for p in six] == ["content\n"] * 6
    assert len(made.read_text().split()) == 2
    found = sorted(p.name for p in (tmp_path / "cache").iterdir())
    assert found == ["library.so", "library.so.sha256"]  # and no lock


@pytest.mark.long
def test_two_runs_into_one_folder(command: Command, tmp_path: Path) -> None:
    long = ("fixed_position", "--engine", "reference", "--out", str(tmp_path / "r"))
    process = started(*long, cwd=tmp_path)
    try:
        wait_for(lambda: (tmp_path / "r" / LOCK).is_file(), process)
        code, _, err = command("run", *long)
        assert code == 2 and f"another run writes here (process {process.pid})" in err
    finally:
        process.send_signal(signal.SIGTERM)  # as Ctrl-C: the record until then is kept
        _, said = process.communicate(timeout=300)
    assert process.returncode not in (0, -signal.SIGTERM)
    if (tmp_path / "r" / "run.json").is_file():
        assert "the same command with --resume continues it" in said
        assert not Record.load(tmp_path / "r").complete and (tmp_path / "r" / FILE).is_file()


@pytest.mark.long
def test_a_hangup_keeps_the_record(tmp_path: Path) -> None:
    process = started("fixed_position", "--engine", "reference", "--out", "r", cwd=tmp_path)
    wait_for((tmp_path / STEPPING).is_file, process)
    process.send_signal(signal.SIGHUP)
    _, said = process.communicate(timeout=300)
    assert "interrupted at t = " in said and "--resume continues it" in said
    assert (tmp_path / "r" / FILE).is_file() and not (tmp_path / "r" / LOCK).exists()


@pytest.mark.long
def test_resume_finishes_a_missing_report(command: Command, tmp_path: Path) -> None:
    """Killed between record and report: --resume makes the report, and nothing runs again."""
    out = tmp_path / "r"
    assert command("run", *SHORT, "--out", out)[0] == 0
    whole = json.loads((out / "result.json").read_text("utf-8"))
    stamp = (out / "run.json").read_bytes()
    (out / "result.json").unlink()
    code, _, err = command("run", *SHORT, "--out", out, "--resume")
    assert code == 0, err
    assert json.loads((out / "result.json").read_text("utf-8"))["coefficients"] == whole["coefficients"]
    assert (out / "run.json").read_bytes() == stamp
    code, _, err = command("run", *SHORT, "--out", out, "--resume")
    assert code == 2 and "the run is complete" in err
    (out / "result.json").unlink()
    code, _, err = command("run", *SHORT, "--out", out, "--resume", "--seed", "2")
    assert code == 2 and "holds another run" in err


def test_the_first_checkpoint_comes_after_seconds() -> None:
    assert checkpoint.FIRST <= 10.0 < checkpoint.PERIOD


def test_files_of_killed_processes_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that ends removes its own; what a killed one left goes, what a living one has and a user's run stay."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    code = "import os, signal, tempfile\n"
    code += f"tempfile.tempdir = {str(tmp_path)!r}\nfrom gyrobench.files import temporary_folder\n"
    code += "print(temporary_folder(), flush=True)\n"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    assert list(tmp_path.iterdir()) == []
    living = subprocess.Popen([sys.executable, "-c", f"{code}input()"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert living.stdout is not None
    his = Path(living.stdout.readline().decode().strip())
    killed = f"{code}os.kill(os.getpid(), signal.SIGKILL)"
    left = Path(subprocess.run([sys.executable, "-c", killed], capture_output=True, text=True).stdout.strip())
    mine = tmp_path / "gyrobench-run"  # of a run that was killed: a lock that nobody holds
    mine.mkdir()
    (mine / LOCK).touch()
    assert left.is_dir() and his.is_dir()
    sweep()
    assert not left.exists() and his.is_dir() and mine.is_dir()
    living.communicate(b"\n")
    assert not his.exists()


def test_an_ignored_hangup_stays_ignored() -> None:
    """nohup: the end of the terminal is no end of the run."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Interrupts() as ended:
            signal.raise_signal(signal.SIGHUP)
            assert not ended.pressed and signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
            signal.raise_signal(signal.SIGTERM)
            assert ended.pressed
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_folder_that_takes_no_file_is_told_by_the_name_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not by that of the temporary one; what was there stays, and nothing is left beside it."""
    (tmp_path / "a.csv").write_text("old")

    def full(path: Path, *_: object, **how: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    for name in ("touch", "write_bytes"):
        with monkeypatch.context() as patch:
            patch.setattr(Path, name, full)
            with pytest.raises(OSError, match="No space left") as stopped:
                files.write_whole(tmp_path / "a.csv", b"new")
        assert stopped.value.filename == str(tmp_path / "a.csv")
    assert [f.name for f in tmp_path.iterdir()] == ["a.csv"] and (tmp_path / "a.csv").read_text() == "old"
