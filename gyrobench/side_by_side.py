"""The same task for each of several, side by side in forked processes, one a core."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")
#: of the environment: threads of the linear algebra.  On matrices as small as these they cost more than they give
ONE_THREAD = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
_task: Callable[[int], Any] | None = None  # of a process that was started here


def each(task: Callable[[int], T], count: int, long: bool) -> list[T]:
    """Return task(0) ... task(count - 1).  long: whether they are worth the start of processes.

    One after the other where the system cannot fork, and in a process that is one of several or must not have children.
    """
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import current_process, get_all_start_methods, get_context

    forks = "fork" in get_all_start_methods() and hasattr(os, "sched_getaffinity")
    cores = len(os.sched_getaffinity(0)) if forks else 1
    if count < 2 or cores < 2 or not long or _task or current_process().daemon:
        return [task(k) for k in range(count)]
    # the task and its data come along with the fork; what comes back is small
    with ProcessPoolExecutor(min(cores, count), get_context("fork"), _take, (task,)) as pool:
        return list(pool.map(_done, range(count)))


def _take(task: Callable[[int], Any]) -> None:
    from threadpoolctl import threadpool_limits

    global _task
    _task = task
    threadpool_limits(1)  # each has a core


def _done(k: int) -> Any:
    assert _task is not None
    return _task(k)
