"""Tasks in processes of their own: results in their order, errors, and when there are no processes."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy import linalg
from threadpoolctl import threadpool_info, threadpool_limits

from gyrobench.engine.fmu_instance import FmuCallError
from gyrobench.errors import Advice
from gyrobench.side_by_side import ONE_THREAD, each


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


def test_each_task_has_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    linalg.solve(np.eye(2), np.eye(2))  # the libraries are there before the fork
    with threadpool_limits(2):
        found = each(lambda k: [pool["num_threads"] for pool in threadpool_info()], 2, True)
    assert found[0] and all(set(threads) == {1} for threads in found)


def test_commands_have_one_thread() -> None:
    code = (
        "import os, sys; sys.argv = ['gyrobench', '--version']\n"
        "from gyrobench.commands.cli import main\n"
        "try: main()\nexcept SystemExit: print(os.environ['OMP_NUM_THREADS'], os.environ['OPENBLAS_NUM_THREADS'])"
    )
    own = {n: v for n, v in os.environ.items() if n not in ONE_THREAD} | {"OMP_NUM_THREADS": "2"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=own)
    assert done.stdout.splitlines()[-1] == "2 1"
