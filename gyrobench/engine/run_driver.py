"""Execution of an engine in chunks: progress, interruption, the end of the plan."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

from gyrobench.arrays import Array
from gyrobench.engine.checkpoint import CheckpointManager
from gyrobench.engine.reference_engine import RunState
from gyrobench.errors import GyrobenchError
from gyrobench.system.system import System

CHUNK = 0.2  # s of wall time per engine call; progress and Ctrl-C are handled between calls
PATIENCE = 3.0  # a plan may take this many times its own duration
GRACE = 3600.0  # s, and this much longer


@dataclass(frozen=True)
class ProgressReport:
    """Progress of a run.

    total: s, expected end of the simulated time; rate: steps per second of wall time; steps, elapsed (s of wall time):
    since the run was started or resumed, which was at the simulated time ``since``, s.  rows: gives the rows of the
    channels since its last call, names and [time, values ...], to look at: they may be torn while they are read.
    units: theirs, SI.
    """

    time: float
    total: float
    steps: int
    windows: int
    rate: float
    elapsed: float
    since: float = 0.0
    rows: Callable[[], tuple[Sequence[str], Array]] | None = None
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def fraction(self) -> float:
        """Completed fraction, 0 to 1; an estimate: the transitions between phases are not known beforehand."""
        return min(1.0, self.time / self.total) if self.total > 0.0 else 0.0

    @property
    def eta(self) -> float:
        """Estimated wall time left, s."""
        done = self.time - self.since
        return self.elapsed * max(0.0, self.total - self.time) / done if done > 0.0 else float("inf")


class EngineStopped(GyrobenchError):
    """The run stopped before its end: by the user, or because the plan does not come to an end."""

    def __init__(self, message: str, by_user: bool) -> None:
        self.by_user = by_user
        super().__init__(message)


#: what asks a run to end: Ctrl-C, the end of a job or of a terminal
SIGNALS = tuple(s for name in ("SIGINT", "SIGTERM", "SIGHUP") if (s := getattr(signal, name, None)) is not None)


class Interrupts:
    """While active, the first such signal only raises a flag, so that no step or row is lost; the second one kills."""

    def __init__(self) -> None:
        self.pressed = False
        self.previous: dict[Any, Any] = {}

    def __enter__(self) -> Interrupts:
        if threading.current_thread() is threading.main_thread():
            # what is ignored stays so: nohup, a job in the background
            heard = [s for s in SIGNALS if signal.getsignal(s) != signal.SIG_IGN]
            self.previous = {s: signal.signal(s, self._handle) for s in heard}
        return self

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self.pressed = True
        self._restore()

    def _restore(self) -> None:
        for s, handler in self.previous.items():
            signal.signal(s, handler if handler is not None else signal.SIG_DFL)

    def __exit__(self, *_: object) -> None:
        self._restore()


@dataclass(frozen=True)
class Schedule:
    """Steps of a run and their end.

    step: s.  every: steps between two rows of the channels.  planned: s, duration of the plan.  stop: s, end of the
    simulated time, None where the plan ends the run; ``done`` is the output that says so.
    """

    step: float
    every: int
    planned: float
    stop: float | None
    done: str | None

    @classmethod
    def of(cls, system: System) -> Schedule:
        """Return the schedule of a system."""
        every = max(1, round(system.channel_period / system.step))
        return cls(system.step, every, system.plan().duration(), system.stop, system.done)

    @property
    def total(self) -> float:
        """Expected end of the simulated time, s."""
        return self.planned if self.stop is None else self.stop

    @property
    def limit(self) -> int:
        """Steps after which the run ends, whatever the plan says."""
        longest = PATIENCE * self.planned + GRACE if self.stop is None else self.stop
        return max(1, round(longest / self.step))


def run_to_end(
    engine: Any,
    state: RunState,
    schedule: Schedule,
    progress: Callable[[ProgressReport], None] | None,
    stopped: Callable[[], bool],
    checkpoints: CheckpointManager | None = None,
) -> None:
    """Run the engine to the end; ``stopped`` says whether the user wants it to end before.

    Raises FmuCallError from the engine, EngineStopped when stopped or when the plan never ends.
    """
    h, k_limit = schedule.step, schedule.limit
    k_asked = checkpoints.last_step(h) if checkpoints is not None else None
    k_stop = k_limit if k_asked is None else min(k_limit, max(k_asked, state.k))
    chunk, k_first = 256, state.k
    began = time.perf_counter()
    while not state.finished and state.k < k_stop:
        chunk_began, k_before = time.perf_counter(), state.k
        engine.advance(state, min(k_stop, state.k + chunk), 0.0, h, schedule.every)
        now = time.perf_counter()
        rate = (state.k - k_before) / max(now - chunk_began, 1e-9)
        chunk = max(16, min(8 * chunk, int(rate * CHUNK)))
        if progress is not None:
            windows = sum(len(r) if r.ndim == 2 else 1 for r in state.window_rows)
            progress(
                ProgressReport(state.k * h, schedule.total, state.k - k_first, windows, rate, now - began, k_first * h)
            )
        if stopped():
            raise EngineStopped(f"interrupted at t = {state.k * h:.9g} s", by_user=True)
        if checkpoints is not None:
            checkpoints.save_if_due(state)
    if not state.finished and state.k < k_limit:
        raise EngineStopped(f"stopped at t = {state.k * h:.9g} s, as asked for", by_user=True)
    if not state.finished and schedule.stop is None:
        raise EngineStopped(
            f"the plan has not ended at t = {state.k * h:.9g} s, {PATIENCE:g} times its duration of "
            f"{schedule.planned:.6g} s: "
            f"does the table reach its targets? (last values of {schedule.done} stayed 0)",
            by_user=False,
        )
