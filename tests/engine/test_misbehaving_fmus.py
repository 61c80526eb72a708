"""Foreign FMUs that crash, end the process, hang or take what is not theirs: a message and the record until then."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import foreign_fmus
import numpy as np
import pytest

from gyrobench.engine import supervision
from gyrobench.engine.run_errors import RunError
from gyrobench.engine.session import Session, run
from gyrobench.record.record import Record
from gyrobench.system.execution_order import AlgebraicLoopError
from gyrobench.system.system import System

Foreign = Callable[..., Path]
QUIET = {"rebalance.K_p": 0.0, "rebalance.K_i": 0.0}
SHORT = {"dwell": 0.2, "turns": 0.02, "table.index_rate": 1.0}
SOURCE = (Path(__file__).parents[1] / "foreign" / "faulty.c").read_text(encoding="utf-8")
FAULTS = {name: n for n, name in enumerate(re.findall(r"\w+", SOURCE.split("enum FAULTS {")[1].split("}")[0]))}


@pytest.fixture(autouse=True)
def limit_of_the_gyro_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a second is asked of the calls of the faulty FMU only: loading others may take longer on a slow machine."""
    patience = supervision._Supervisor._patience
    monkeypatch.setattr(
        supervision._Supervisor, "_patience", lambda s: patience(s) if s._call()[0] == "gyro" else supervision.START
    )


STEP = [
    ("CRASH", "its process crashed (SIGSEGV)"),
    ("HANG", "no answer within 0.5 s; its process was stopped"),
    ("ERROR", "status 3 (Error)\n  FMU log: the wheel has stopped after 150 steps"),
    ("EXIT_0", "its process ended with exit code 0"),
    ("EXIT_7", "its process ended with exit code 7"),
    ("ABORT", "its process crashed (SIGABRT)\n  FMU log: assertion failed: wheel > 0"),
    ("RECURSION", "its process crashed (SIGSEGV)"),
    ("ARITHMETIC", "its process crashed (SIGFPE)"),
    ("MEMORY", "of memory, 50% of this machine's; its process was stopped"),
    ("KILL_ITSELF", "its process crashed (SIGKILL)"),
    ("LEAVE_A_PROCESS", "its process crashed (SIGSEGV)"),
    ("UNKNOWN_STATUS", "status -1 (not one of the standard)"),
    ("END_THE_THREAD", "no answer within 0.5 s; its process was stopped"),
    ("PRINT_WITHOUT_END", "no answer within 0.5 s; its process was stopped\n  FMU log: the wheel turns"),
    ("ALARM", "its process crashed (SIGALRM)"),
]


@pytest.mark.parametrize(("fault", "words"), STEP)
@pytest.mark.long
def test_a_fault_in_a_step(
    small: System, foreign: Foreign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: str, words: str
) -> None:
    # step 150 begins at t = 0.15 s: the channels every 10 ms then have rows at 0, 0.01 ... 0.15, and the rest of the
    # plan's first phase, gate from 0.1 s, has no window of 0.1 s yet
    if fault == "MEMORY":
        monkeypatch.setattr(supervision, "memory_limit", lambda: 700_000_000)
    values = {"gyro.fault": FAULTS[fault], "gyro.at": 150, **QUIET}
    timeout = 0.5 if "no answer" in words else 60.0  # the others end by themselves, on a slow machine too
    with pytest.raises(RunError) as caught:
        run(small, {"gyro": foreign("faulty")}, values=values, child=True, timeout=timeout, out=tmp_path / "run")
    text = str(caught.value)
    assert f"gyro: doStep failed at t = 0.15 s: {words}" in text or (fault == "MEMORY" and words in text)
    assert str(tmp_path / "run") in text and caught.value.exit_code == 3
    record = Record.load(tmp_path / "run")
    assert not record.complete and record.run.stopped_at == pytest.approx(0.15)
    assert record.run.problem in text
    assert record.channels["time"].tolist() == [k * 10 * 1e-3 for k in range(16)]
    assert len(record.windows["mean"]) == 0


@pytest.mark.parametrize(
    ("fault", "flags", "words"),
    [
        ("CRASH_IN_INITIALIZATION", (), "gyro: enterInitializationMode failed: its process crashed (SIGSEGV)"),
        ("HANG_IN_INITIALIZATION", (), "gyro: enterInitializationMode failed: no answer within 0.5 s"),
        ("NONE", ("-DON_LOADING",), "gyro: loading failed: its process ended with exit code 0"),
        ("NONE", ("-DNO_INSTANCE",), "gyro: instantiate failed"),
    ],
)
@pytest.mark.long
def test_a_fault_before_the_first_step(
    small: System, foreign: Foreign, tmp_path: Path, fault: str, flags: tuple[str, ...], words: str
) -> None:
    with pytest.raises(RunError) as caught:
        run(
            small,
            {"gyro": foreign("faulty", *flags)},
            values={"gyro.fault": FAULTS[fault]},
            child=True,
            timeout=0.5 if "no answer" in words else 60.0,
            out=tmp_path / "run",
        )
    assert words in str(caught.value) and caught.value.exit_code == 3
    record = Record.load(tmp_path / "run")
    assert not record.complete and words in record.run.problem and record.run.steps == 0


@pytest.mark.long
def test_a_library_outside_of_the_archive(small: System, foreign: Foreign, tmp_path: Path) -> None:
    """The identifier leads to a library that would end the process: it is not loaded."""
    outside = foreign("faulty", "-DON_LOADING").with_suffix("")
    for way in (f"../../../../../../../../../..{outside}", str(outside), "..\\faulty"):
        fmu = foreign_fmus.make("faulty", tmp_path, identifier=way)
        with pytest.raises(RunError, match=r"gyro: loading failed: modelIdentifier '.*' is not the name of a file"):
            run(small, {"gyro": fmu}, child=True, out=tmp_path / "run")
        assert not Record.load(tmp_path / "run").complete


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("CHANGE_DIRECTORY", "changed the working directory to /; the run was not affected"),
        ("WRITE_TO_DESCRIPTORS", "FMUs printed, last: ####"),
        ("CLOSE_DESCRIPTORS", ""),
        ("SIGNAL_THE_GROUP", ""),
        ("CRASH_IN_TERMINATE", "gyro: terminate after the end of the run: its process crashed (SIGSEGV)"),
        ("HANG_IN_TERMINATE", "gyro: terminate after the end of the run: no answer within 0.5 s"),
    ],
)
@pytest.mark.long
def test_what_does_not_touch_the_run(
    small: System, foreign: Foreign, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: str, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    values = {"gyro.at": 150, **QUIET, **SHORT}
    good = run(small, {"gyro": foreign("faulty")}, values=values)
    found = run(
        small, {"gyro": foreign("faulty")}, values={**values, "gyro.fault": FAULTS[fault]}, child=True,
        timeout=0.5 if "no answer" in words else 60.0, out=Path("run"),
    )  # fmt: skip
    assert found.complete and found.same_data(good) and Record.load(tmp_path / "run").same_data(good)
    assert any(words in n for n in found.run.notes)
    assert Path.cwd() == tmp_path


@pytest.mark.long
def test_memory_of_the_caller_is_not_the_runs(small: System, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A notebook that holds more data than a run may take: its fork shares them and is not stopped for them."""
    held = np.ones(25_000_000)  # 200 MB
    monkeypatch.setattr(supervision, "memory_limit", lambda: held.nbytes)
    monkeypatch.setattr(supervision, "CHECK", 0.0)
    assert run(small, values=SHORT, child=True, progress=lambda _: None).complete


def test_nothing_is_left_of_a_process_that_an_fmu_started(small: System, foreign: Foreign) -> None:
    """A process that the FMU has forked ends with the run, although it waits for a signal for ever."""
    before = set(os.listdir("/proc"))
    with pytest.raises(RunError):
        run(small, {"gyro": foreign("faulty")}, values={"gyro.fault": FAULTS["LEAVE_A_PROCESS"], **QUIET}, child=True)

    def ours() -> list[str]:
        found = []
        for number in set(os.listdir("/proc")) - before:
            try:
                if number.isdigit() and "faulty" in Path("/proc", number, "maps").read_text():
                    found.append(number)
            except OSError:
                continue
        return found

    end = time.monotonic() + 60.0
    while ours() and time.monotonic() < end:
        time.sleep(0.01)
    assert ours() == []


@pytest.mark.parametrize("fork", [True, False])
@pytest.mark.parametrize("engine", ["native", "reference"])
@pytest.mark.long
def test_the_record_of_a_child_is_bit_equal(
    small: System, monkeypatch: pytest.MonkeyPatch, engine: str, fork: bool
) -> None:
    inside = run(small, values=SHORT, engine="native", seed=4)
    if not fork:
        monkeypatch.setattr(supervision, "can_fork", lambda: False)
    seen: list[Any] = []
    outside = run(small, values=SHORT, engine=engine, child=True, seed=4, progress=seen.append)
    assert inside.same_data(outside) and outside.run.steps == inside.run.steps
    assert set(outside.run.timing) == set(inside.run.timing)
    assert seen[-1].time == pytest.approx(outside.run.stopped_at)
    assert seen[-1].windows == len(outside.windows["mean"])


def test_a_crash_without_fork_is_told_too(small: System, foreign: Foreign, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(supervision, "can_fork", lambda: False)
    values = {"gyro.fault": FAULTS["CRASH"], "gyro.at": 150, **QUIET}
    with pytest.raises(RunError, match=r"gyro: doStep failed at t = 0.15 s: its process crashed \(SIGSEGV\)") as caught:
        run(small, {"gyro": foreign("faulty")}, values=values, child=True)
    assert caught.value.record is not None and len(caught.value.record.channels["time"]) == 16


def test_rows_of_many_blocks_survive_a_crash(small: System, foreign: Foreign, monkeypatch: pytest.MonkeyPatch) -> None:
    """The blocks are emptied some twenty times before the crash: each row is there once."""
    from gyrobench.engine import native_engine, run_board

    monkeypatch.setattr(supervision, "can_fork", lambda: True)  # a child that is no fork has blocks of the usual size
    for module in (run_board, native_engine):
        monkeypatch.setattr(module, "BLOCK", 7)
    values = {"gyro.fault": FAULTS["CRASH"], "gyro.at": 1500, **QUIET}
    with pytest.raises(RunError, match=r"at t = 1.5 s: its process crashed") as caught:
        run(small, {"gyro": foreign("faulty")}, values=values, child=True)
    assert caught.value.record is not None
    assert caught.value.record.channels["time"].tolist() == [k * 10 * 1e-3 for k in range(151)]


def test_a_foreign_fmu_is_named_with_its_digest_before_it_runs(small: System, foreign: Foreign) -> None:
    import hashlib

    fmu = foreign("faulty", "-DON_LOADING")
    digest = hashlib.sha256(fmu.read_bytes()).hexdigest()
    with Session(small, {"gyro": fmu}, child=True) as session:
        assert f"gyro: faulty.fmu is not of this bench: SHA-256 {digest}" in session.notes
        with pytest.raises(RunError, match="loading failed"):
            session.run()


@pytest.mark.parametrize("engine", ["native", "reference"])
def test_error_with_message_in_process(small: System, foreign: Foreign, engine: str) -> None:
    with pytest.raises(
        RunError, match=r"gyro: doStep failed at t = 0.15 s: status 3 \(Error\)\n.*the wheel has stopped"
    ):
        run(
            small,
            parts={"gyro": foreign("faulty")},
            values={"gyro.fault": 3, "gyro.at": 150, "rebalance.K_p": 0.0},
            engine=engine,
        )


def test_undeclared_dependencies_make_an_algebraic_loop(small: System, foreign: Foreign) -> None:
    with pytest.raises(AlgebraicLoopError, match=r"gyro\.u -> rebalance\.u -> rebalance\.i -> gyro\.i -> gyro\.u"):
        run(small, parts={"gyro": foreign("loose")})


def test_time_that_others_took_on_a_busy_machine_is_no_silence(
    small: System, foreign: Foreign, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a process that has waited half of the time for a processor, half a second of silence is a second."""
    monkeypatch.setattr(supervision, "_waited", lambda _: 0.5 * time.monotonic())
    values = {"gyro.fault": FAULTS["HANG"], "gyro.at": 150, **QUIET}
    began = time.monotonic()
    with pytest.raises(RunError, match=r"no answer within 0\.5 s"):
        run(small, {"gyro": foreign("faulty")}, values=values, child=True, timeout=0.5)
    assert time.monotonic() - began > 1.0


@pytest.mark.skipif(not Path("/proc/self/schedstat").exists(), reason="the system does not say who waits")
def test_two_on_one_processor_wait_for_each_other() -> None:
    one = min(os.sched_getaffinity(0))
    busy = f"import os; os.sched_setaffinity(0, [{one}])\nwhile True: pass"
    pair = [subprocess.Popen([sys.executable, "-c", busy]) for _ in range(2)]
    try:
        end = time.monotonic() + 30.0
        while not all(supervision._waited(p.pid) > 0.05 for p in pair) and time.monotonic() < end:
            time.sleep(0.01)
        assert all(supervision._waited(p.pid) > 0.05 for p in pair)
        assert supervision._waited(0) == 0.0
    finally:
        for p in pair:
            p.kill()
            p.wait()
