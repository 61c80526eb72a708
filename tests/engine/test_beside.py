"""What is worked out beside a run: when it begins, in which thread its result is taken, what its errors do."""

from __future__ import annotations

import threading

import pytest

from gyrobench.engine.beside import beside
from gyrobench.engine.run_driver import ProgressReport
from gyrobench.engine.run_errors import RunError
from gyrobench.engine.session import Session

REPORT = ProgressReport(0.0, 1.0, 1, 0, 1.0, 1.0)


def test_the_work_goes_on_beside_the_run_and_is_taken_by_it() -> None:
    here, reports = threading.get_ident(), []
    goes_on, done = threading.Event(), threading.Event()
    taken: list[tuple[int, int]] = []

    def work() -> int:
        assert goes_on.wait(10.0)  # set by the run, after the work has begun
        done.set()
        return threading.get_ident()

    with beside(work, lambda thread: taken.append((thread, threading.get_ident())), reports.append) as reported:
        threads = threading.active_count()  # a run forks only where there is no other
        reported(REPORT)
        assert threading.active_count() == threads + 1 and not taken
        goes_on.set()
        assert done.wait(10.0)
        while not taken:  # the future is done a moment after the work
            reported(REPORT)
        reported(REPORT)
    assert len(taken) == 1 and taken[0][0] != here and taken[0][1] == here
    assert len(reports) >= 3 and threading.active_count() == threads


def test_a_run_without_a_report_has_its_work_done_at_the_end() -> None:
    taken: list[int] = []
    with beside(threading.get_ident, taken.append, None):
        assert not taken
    assert taken == [threading.get_ident()]


def test_an_error_of_the_work_ends_the_run() -> None:
    def work() -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), beside(work, print, None) as reported:
        for _ in range(1000):
            reported(REPORT)
            threading.Event().wait(0.01)
        raise AssertionError("the run went on")


@pytest.mark.parametrize("child", [False, True])
def test_a_run_has_the_linear_models_and_notes_that_prepare_finds(
    child: bool, caplog: pytest.LogCaptureFixture
) -> None:
    """Of a loop that grows until a gimbal is at its stop: the record as far as it comes, and the warning once."""
    values = {"hold": 1.0, "K_m": 2e4, "allow_unstable": True}
    with Session("stabilizer_power_2dof", child=child) as s:
        before = s.prepare(values)[2]
    with Session("stabilizer_power_2dof", child=child) as s:
        caplog.clear()
        with pytest.raises(RunError, match="gimbal has reached its stop") as failed:
            s.run(values)
    run = failed.value.record.run
    assert before.linear is not None and run.linear == before.linear
    assert [w.partition(":")[0] for w in run.linear.warnings] == ["the linear loop is unstable"]
    assert run.notes == before.notes and run.notes.count(run.linear.warnings[0]) == 1
    assert caplog.text.count("the linear loop is unstable") == 1
