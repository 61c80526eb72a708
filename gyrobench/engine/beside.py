"""Work in a thread beside a run, whose steps are native code or go on in another process: on a core of its own."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from gyrobench.engine.run_driver import ProgressReport

T = TypeVar("T")


@contextlib.contextmanager
def beside(
    work: Callable[[], T], take: Callable[[T], None], progress: Callable[[ProgressReport], None] | None
) -> Iterator[Callable[[ProgressReport], None]]:
    """Yield the progress of a run beside which ``work`` goes on; what it returns is given to ``take``, in this thread,
    at the first report that finds it, at the latest when the run is over.

    It begins at the first report, not before: a run is forked off where there is no other thread.
    """
    begun: list[Future[T]] = []
    waiting = True

    def reported(report: ProgressReport) -> None:
        nonlocal waiting
        if progress is not None:
            progress(report)
        if not begun:
            begun.append(pool.submit(work))
        elif waiting and begun[0].done():
            waiting = False
            take(begun[0].result())

    with ThreadPoolExecutor(1) as pool:
        yield reported
        if waiting:
            take(begun[0].result() if begun else work())
