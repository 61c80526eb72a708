"""Tasks in processes of their own: results in their order, errors, and when there are no processes."""

from __future__ import annotations

import os

import pytest

from gyrobench.engine.fmu_instance import FmuCallError
from gyrobench.errors import Advice
from gyrobench.side_by_side import each


def test_results_come_in_the_order_of_the_tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    held = {"from": "this process"}  # comes along with the fork
    found = each(lambda k: (k, held["from"], os.getpid()), 5, True)
    assert [(k, text) for k, text, _ in found] == [(k, "this process") for k in range(5)]
    assert os.getpid() not in {pid for _, _, pid in found}


@pytest.mark.parametrize(("count", "long", "cores"), [(1, True, 2), (3, False, 2), (3, True, 1)])
def test_without_gain_no_process_is_started(
    count: int, long: bool, cores: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(cores)))
    assert each(lambda k: os.getpid(), count, long) == [os.getpid()] * count


def test_an_error_of_a_task_is_raised_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    with pytest.raises(ZeroDivisionError):
        each(lambda k: 1 // (k - 1), 3, True)


def test_an_error_for_a_person_keeps_what_it_knows_on_its_way_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})

    def fails(k: int) -> None:
        raise FmuCallError("gyro", "doStep", "error", 1.5).advised(Advice("fit", "fit it"))

    with pytest.raises(FmuCallError, match=r"^gyro: doStep failed at t = 1.5 s: error\nfit it$") as caught:
        each(fails, 2, True)
    assert (caught.value.slot, caught.value.time, caught.value.text) == ("gyro", 1.5, str(caught.value).split("\n")[0])
