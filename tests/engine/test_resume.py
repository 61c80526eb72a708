"""A run that is stopped and continued leaves the record of a run in one piece, bit for bit."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processes import unhurried

from gyrobench.commands import cli, progress_display
from gyrobench.engine import checkpoint
from gyrobench.engine.checkpoint import FILE, CheckpointManager, ResumeError
from gyrobench.engine.fmu_instance import FmuInstance
from gyrobench.engine.run_driver import ProgressReport
from gyrobench.engine.run_errors import RunInterrupted
from gyrobench.engine.session import Session, run
from gyrobench.packaging import build
from gyrobench.record.record import Record
from gyrobench.system.system import System
from gyrobench.system.values import InvalidValueError
from gyrobench.workflow.progress_words import format_status

Foreign = Callable[[str], Path]
QUICK = {"dwell": 0.2, "turns": 0.02, "table.index_rate": 1.0, "gyro.white": 1e-7, "gyro.markov": 1e-7}
FOREIGN = Path(__file__).parents[1] / "foreign"


def stop(system: System, out: Path, at: float, **more: Any) -> RunInterrupted:
    with pytest.raises(RunInterrupted) as caught:
        run(system, out=out, stop_at=at, **{"values": QUICK, "seed": 5, **more})
    return caught.value


@pytest.mark.parametrize("engine", ["native", "reference"])
@pytest.mark.long
def test_stopped_at_many_times_the_record_is_that_of_a_whole_run(small: System, tmp_path: Path, engine: str) -> None:
    """Stops before the first step, in settling, in a window, at the end of one, in the turn, just before the end."""
    whole = run(small, values=QUICK, seed=5, engine=engine)
    windows, end = whole.windows, whole.run.stopped_at
    inside = [(a + b) / 2 for a, b in zip(windows["t_start"], windows["t_end"], strict=True)]
    times = sorted([0.0, 0.001, 0.05, *inside, windows["t_end"][1], end - 0.001])
    out = tmp_path / "r"
    for k, t in enumerate(times):
        error = stop(small, out, t, engine=engine, resume=k > 0)
        assert str(error).startswith("stopped at t = ")
        assert "the same command with --resume continues it" in str(error)
        part = Record.load(out)
        assert not part.complete and part.run.stopped_at == pytest.approx(t, abs=6e-4)
        rows = int((windows["t_end"] <= part.run.stopped_at - 1e-3).sum())
        assert rows <= len(part.windows["mean"]) <= rows + 1
        assert (out / FILE).is_file()
    found = run(small, values=QUICK, seed=5, engine=engine, out=out, resume=True)
    assert found.same_data(whole) and Record.load(out).same_data(whole)
    assert found.complete and found.run.steps == whole.run.steps
    assert found.run.resumed_at == pytest.approx(times, abs=6e-4)
    assert set(found.run.timing) == set(whole.run.timing)
    assert [p.name for p in out.iterdir() if p.name.startswith(FILE)] == []


@pytest.mark.long
def test_one_engine_continues_what_the_other_began(small: System, tmp_path: Path) -> None:
    whole = run(small, values=QUICK, seed=5)
    stop(small, tmp_path / "r", 0.233, engine="native")
    stop(small, tmp_path / "r", 0.5, engine="reference", resume=True)
    assert run(small, values=QUICK, seed=5, engine="native", out=tmp_path / "r", resume=True).same_data(whole)


@pytest.mark.long
def test_python_parts_save_their_state_too(small: System, tmp_path: Path) -> None:
    setup: dict[str, Any] = {"target": "python", "engine": "reference"}
    whole = run(small, values=QUICK, seed=5, engine="native")
    stop(small, tmp_path / "r", 0.333, **setup)
    assert run(small, values=QUICK, seed=5, out=tmp_path / "r", resume=True, **setup).same_data(whole)


def test_a_resumed_run_names_the_foreign_fmus_whose_state_it_trusts(small: System, tmp_path: Path) -> None:
    """PythonFMU saves registered variables alone: what else a step needs is lost, and no output shows it."""
    setup: dict[str, Any] = {"parts": {"gyro": build("floated_gyro")}}
    stop(small, tmp_path / "r", 0.333, **setup)
    found = run(small, values=QUICK, seed=5, out=tmp_path / "r", resume=True, **setup)
    assert [n for n in found.run.notes if n.startswith("gyro: the run goes on from what the FMU saves")]


def test_a_session_resumes_among_other_runs(small: System, tmp_path: Path) -> None:
    """A session keeps its libraries and buffers between runs: nothing of another run is left in the resumed one."""
    with Session(small) as session:
        whole = session.run(QUICK, seed=5)
        with pytest.raises(RunInterrupted):
            session.run(QUICK, seed=5, checkpoints=CheckpointManager(tmp_path, stop_at=0.3))
        session.run(QUICK, seed=6)
        found = session.run(QUICK, seed=5, out=tmp_path, checkpoints=CheckpointManager(tmp_path, resume=True))
    assert found.same_data(whole)
    assert not (tmp_path / FILE).exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"seed": 6}, ["seed: 5 there, 6 here"]),
        (
            {"step": 5e-4},
            ["step (s): 0.001 there, 0.0005 here", "steps between two rows of the channels: 10 there, 20"],
        ),
        ({"values": {**QUICK, "gyro.H": 0.3}}, ["gyro.H: 0.2 there, 0.3 here"]),
        ({"values": {**QUICK, "latitude": "10deg"}}, ["latitude: 0.798", "site.latitude: 0.798"]),
    ],
)
def test_another_job_is_refused_and_named(
    small: System, tmp_path: Path, change: dict[str, Any], words: list[str]
) -> None:
    stop(small, tmp_path, 0.1)
    before = (tmp_path / FILE).read_bytes()
    with pytest.raises(
        ResumeError, match=r"--resume: the interrupted run in .* is another one; what differs:"
    ) as caught:
        run(small, out=tmp_path, resume=True, **{"values": QUICK, "seed": 5, **change})
    lines = str(caught.value).splitlines()[1:]
    assert len(lines) == len(words)
    for line, word in zip(lines, words, strict=True):
        assert line.startswith(f"  - {word}")
    assert caught.value.exit_code == 2
    assert (tmp_path / FILE).read_bytes() == before


@pytest.mark.long
def test_another_part_or_wiring_is_refused(small: System, tmp_path: Path) -> None:
    stop(small, tmp_path, 0.1)
    with pytest.raises(ResumeError, match=r"the part in slot gyro \(its FMU\)"):
        run(small, values=QUICK, seed=5, out=tmp_path, resume=True, target="python", engine="reference")

    class Other(type(small)):  # type: ignore[misc]
        name = small.name
        channels = ("gyro.u",)

    other = Other()
    other.name = small.name
    with pytest.raises(ResumeError, match=r"what differs:\n  - wires, mapping or recorded channels$"):
        run(other, values=QUICK, seed=5, out=tmp_path, resume=True)


@pytest.mark.long
def test_nothing_or_a_damaged_file_is_refused(small: System, tmp_path: Path) -> None:
    again: dict[str, Any] = {"values": QUICK, "seed": 5, "out": tmp_path / "r", "resume": True}
    with pytest.raises(ResumeError, match=r"no interrupted run to continue in .*/r \(there is no checkpoint.npz\)"):
        run(small, **again)
    with pytest.raises(InvalidValueError, match="name the folder of the run"):
        run(small, resume=True)
    stop(small, tmp_path / "r", 0.1)
    file = tmp_path / "r" / FILE
    data = file.read_bytes()
    for bad in (b"", data[: len(data) // 2], b"PK" + bytes(100), data.replace(b'"format": 2', b'"format": 9')):
        file.write_bytes(bad)
        with pytest.raises(ResumeError, match=r"checkpoint.npz: not a checkpoint that can be read"):
            run(small, **again)


def test_a_part_that_cannot_save_its_state(small: System, foreign: Foreign, tmp_path: Path) -> None:
    setup: dict[str, Any] = {"parts": {"gyro": foreign("vendor_gyro")}, "maps": {"gyro": FOREIGN / "vendor_gyro.toml"}}
    setup["values"] = {n: v for n, v in QUICK.items() if not n.startswith("gyro")}
    why = r"gyro: the FMU cannot save its state \(canSerializeFMUstate is not true"
    assert f"it cannot be resumed: {why[:30]}" in str(stop(small, tmp_path, 0.1, **setup))
    assert not (tmp_path / FILE).exists() and Record.load(tmp_path).run.stopped_at == 0.1
    with pytest.raises(ResumeError, match=f"--resume: {why}"):
        run(small, seed=5, out=tmp_path, resume=True, **setup)


@pytest.mark.long
def test_a_child_resumes(small: System, tmp_path: Path) -> None:
    """Stopped and resumed in one process or another: the checkpoint is the same, and its times come back."""
    whole = run(small, values=QUICK, seed=5)
    stop(small, tmp_path / "r", 0.2, child=True)
    stop(small, tmp_path / "r", 0.4, resume=True)
    found = run(small, values=QUICK, seed=5, out=tmp_path / "r", resume=True, child=True)
    assert found.same_data(whole) and found.run.resumed_at == pytest.approx([0.2, 0.4])
    assert not (tmp_path / "r" / FILE).exists()


def test_an_fmu_that_saves_only_half_of_its_state(
    small: System, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stop(small, tmp_path, 0.3)
    whole = FmuInstance.load_state

    def forgetful(instance: FmuInstance, data: bytes) -> None:
        if instance.slot != "gyro":
            whole(instance, data)

    monkeypatch.setattr(FmuInstance, "load_state", forgetful)
    with pytest.raises(ResumeError, match="gyro: the outputs of the FMU are not those it had when its state was saved"):
        run(small, values=QUICK, seed=5, out=tmp_path, resume=True)


def test_a_full_disk_does_not_cost_the_run(small: System, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    monkeypatch.setattr(checkpoint, "PERIOD", 0.0)
    assert run(small, values=QUICK, seed=5, out=tmp_path / "a").complete
    assert "it cannot be resumed: [Errno 28] No space left" in str(stop(small, tmp_path / "b", 0.1))


def test_time_left_is_that_of_this_process() -> None:
    # resumed at 800 of 1000 s; 100 s of simulated time took 5 s, so the other 100 s take 5 s
    status = ProgressReport(time=900.0, total=1000.0, steps=100_000, windows=0, rate=2e4, elapsed=5.0, since=800.0)
    assert status.eta == pytest.approx(5.0)
    assert format_status(status) == "t = 900 of 1,000 s, 20,000 steps/s, 5 s left"


# ------------------------------------------------------------------------------- the command, killed processes
NAME = "tumble_single_axis"
WORDS = ["run", NAME, "--set", "rate=2deg/s", "--set", "dwell=20", "--set", "windows=36", "--json"]
PLAIN = ["--no-report", "--no-check-step"]  # of the runs whose record alone is of interest
CODE = """
import sys, time
from pathlib import Path
from gyrobench.commands import cli
from gyrobench.engine import checkpoint
checkpoint.PERIOD, checkpoint.SHARE = 0.0, 0.0
write, written = checkpoint.CheckpointManager.write, []
def write_four(manager, state):
    written.append(write(manager, state))
    if len(written) == 4:
        Path("four").touch()
        time.sleep(3600.0)  # until it is killed
checkpoint.CheckpointManager.write = write_four
sys.argv = ["gyrobench", *sys.argv[1:]]
cli.main()
"""


def command(words: list[str], capture: Any, patch: pytest.MonkeyPatch) -> tuple[int, str, str]:
    patch.setattr(sys, "argv", ["gyrobench", *words])
    capture.readouterr()
    try:
        cli.main()
        code = 0
    except SystemExit as end:
        code = int(end.code or 0)
    out, err = capture.readouterr()
    return code, out, err


@pytest.mark.long
def test_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)

    def interrupt(self: progress_display.ProgressDisplay, status: ProgressReport) -> None:
        if status.windows >= 2:
            signal.raise_signal(signal.SIGINT)

    code, out, err = command([*WORDS, "--resume", "--out", "r"], capsys, monkeypatch)
    assert code == 2 and "--resume: nothing to continue in r: no checkpoint of a run with these parts and values" in err
    with monkeypatch.context() as patch, unhurried():
        patch.setattr(progress_display.ProgressDisplay, "__call__", interrupt)
        code, out, err = command([*WORDS, "--out", "r"], capsys, monkeypatch)
    assert code == 130 and out == "" and "the same command with --resume continues it" in err
    assert not Record.load(tmp_path / "r").complete
    code, out, err = command([*WORDS, "--seed", "2", "--out", "r", "--resume"], capsys, monkeypatch)
    assert code == 2 and "the interrupted run in r is another one; what differs:\n  - seed: 1 there, 2 here\n" in err
    code, whole, err = command([*WORDS, *PLAIN, "--out", "whole"], capsys, monkeypatch)
    assert code == 0
    code, out, err = command([*WORDS, "--out", "r", "--resume"], capsys, monkeypatch)
    assert code == 0, err
    assert Record.load(tmp_path / "r").same_data(Record.load(tmp_path / "whole"))
    assert json.loads(out)["coefficients"] == json.loads(whole)["coefficients"]
    assert not (tmp_path / "r" / FILE).exists()
    code, _, err = command([*WORDS, "--out", "r", "--resume"], capsys, monkeypatch)
    assert code == 2 and "--resume: nothing to continue in r: the run is complete" in err

    # a whole record is never replaced by half of one: the checkpoint is beside it too, and found there
    with monkeypatch.context() as patch, unhurried():
        patch.setattr(progress_display.ProgressDisplay, "__call__", interrupt)
        assert command([*WORDS, "--out", "r"], capsys, monkeypatch)[0] == 130
    assert (tmp_path / "r-incomplete" / FILE).is_file() and Record.load(tmp_path / "r").complete
    assert command([*WORDS, *PLAIN, "--out", "r", "--resume"], capsys, monkeypatch)[0] == 0
    assert not (tmp_path / "r-incomplete" / FILE).exists()
    assert Record.load(tmp_path / "r").run.resumed_at


@pytest.mark.long
def test_a_killed_process_is_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = [*WORDS, "--engine", "reference", "--out", "k"]
    process = subprocess.Popen([sys.executable, "-c", CODE, *words], cwd=tmp_path)
    file = tmp_path / "k" / FILE
    deadline = time.monotonic() + 300.0
    while not (tmp_path / "four").is_file() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL and file.is_file()
    assert not (tmp_path / "k" / "run.json").exists()
    code, _, err = command([*WORDS, "--out", "k", "--seed", "2"], capsys, monkeypatch)
    assert code == 2 and "k: holds another run (its parameters, seed differ)" in err
    code, _, err = command([*WORDS, *PLAIN, "--out", "k", "--resume"], capsys, monkeypatch)  # the native engine goes on
    assert code == 0, err
    found = Record.load(tmp_path / "k")
    assert 0.0 < found.run.resumed_at[0] < found.run.stopped_at
    assert command([*WORDS, *PLAIN, "--out", "whole"], capsys, monkeypatch)[0] == 0
    assert found.same_data(Record.load(tmp_path / "whole"))
    assert not file.exists()
