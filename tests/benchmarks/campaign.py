"""Throughput of a campaign against a bare loop, in one go: runs a second, share of cores times one core, memory.

    python tests/benchmarks/campaign.py [--runs 10000] [--workers 2] [--rounds 5] [--write]

A run is a tumble on a short plan, some 50 ms with its reduction.  Bare: processes that do nothing but Session.run and
reduce, one alone and one for each worker at a time (what the machine gives several processes is no matter of the
campaign).  The campaign is timed from its first row to its last, and as a whole.  Bare loop and campaign take turns,
and the medians over the rounds count: other work on the machine meets both.  Memory is watched in one more campaign,
which is not timed: a look at all pages of all processes stops them for a tenth of a second.
"""

from __future__ import annotations

import multiprocessing
import os
import statistics
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import quoted
from asked import asked

SYSTEM = "tumble_single_axis"
VALUES = {"rate": 0.3, "windows": 24, "dwell": 5.0, "settle": 1.0}
BARE = 60  # runs of a process in the bare loop


def bare(start: Any, out: Any) -> None:
    """Run and reduce in one process; put the seconds a run into the queue."""
    from gyrobench.engine.session import Session
    from gyrobench.system.system import load_system

    system = load_system(SYSTEM)
    with Session(SYSTEM) as session:

        def run(seed: int) -> None:
            values = {**VALUES, "latitude": 0.5 + 1e-4 * seed}
            system.with_values(values).reduce(session.run(values, seed=seed))

        run(0)
        start.wait()
        begun = time.perf_counter()
        for seed in range(BARE):
            run(seed)
        out.put((time.perf_counter() - begun) / BARE)


def bare_rate(processes: int) -> float:
    """Runs a second of so many bare processes at a time."""
    context = multiprocessing.get_context("spawn")
    start, out = context.Barrier(processes), context.Queue()
    running = [context.Process(target=bare, args=(start, out)) for _ in range(processes)]
    for p in running:
        p.start()
    rate = sum(1.0 / out.get() for _ in running)
    for p in running:
        p.join()
    return float(rate)


class Memory:
    """Largest memory of this process and its children together."""

    def __init__(self) -> None:
        import psutil

        self.process, self.largest, self.stop = psutil.Process(os.getpid()), 0, False
        self.thread = threading.Thread(target=self.watch, daemon=True)
        self.thread.start()

    def watch(self) -> None:
        import psutil

        while not self.stop:
            total = 0
            for p in [self.process, *self.process.children(recursive=True)]:
                try:
                    total += p.memory_full_info().uss
                except psutil.Error:
                    continue
            self.largest = max(self.largest, total)
            time.sleep(1.0)


def campaign(runs: int, workers: int) -> tuple[float, float]:
    """Seconds of the whole, runs a second from the first row to the last."""
    import gyrobench as gb
    from gyrobench.campaign.execution.store import Campaign

    rows = [{**VALUES, "latitude": 0.5 + 1e-4 * k, "seed": k} for k in range(runs)]
    asked = {"system": SYSTEM, "table": rows, "check_step": False, "keep": "none"}
    with tempfile.TemporaryDirectory() as folder:
        begun = time.perf_counter()
        frame = gb.campaign(asked, out=Path(folder) / "c", workers=workers)
        whole = time.perf_counter() - begun
        assert set(frame["state"]) == {"done"} and len(frame) == runs
        ends = sorted(
            Campaign.open(Path(folder) / "c")
            .log()["finished_at"]
            .map(lambda t: __import__("datetime").datetime.fromisoformat(t).timestamp())
        )
    skipped = min(20 * workers, runs // 4)  # until all have loaded the system
    return whole, (runs - 1 - skipped) / (ends[-1] - ends[skipped])


def main() -> None:
    given = asked(
        __doc__, runs=10000, workers=os.cpu_count(), rounds=5, write=(False, "write the share into docs/figures.toml")
    )
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):  # as dask sets them for its workers
        os.environ[threads] = "1"
    one, many, whole, rates = [], [], [], []
    for _ in range(given.rounds):
        one.append(bare_rate(1))
        many.append(bare_rate(given.workers))
        seconds, rate = campaign(given.runs // given.rounds, given.workers)
        whole.append(given.runs // given.rounds / seconds)
        rates.append(rate)
    memory = Memory()
    campaign(given.runs // given.rounds, given.workers)
    memory.stop = True
    a, b, c, d = (statistics.median(x) for x in (one, many, rates, whole))
    print(f"bare loop, one process         {a:8.1f} runs/s")
    print(f"bare loop, {given.workers} processes         {b:8.1f} runs/s")
    print(f"campaign, {given.workers} workers            {c:8.1f} runs/s, with its start {d:.1f}")
    shares = [x / y for x, y in zip(rates, many, strict=True)]
    rounds = ", ".join(f"{x:.2f}" for x in shares)
    print(f"campaign over {given.workers} bare processes  {statistics.median(shares):8.2f}   (rounds: {rounds})")
    print(f"campaign over {given.workers} x one process   {c / (given.workers * a):8.2f}")
    print(f"memory of all processes        {memory.largest / 1e6:8.0f} MB")
    if given.write:
        words = ("tests/benchmarks/campaign.py", f"--runs {given.runs}", f"--rounds {given.rounds}")
        unit = f"runs a second of a campaign over those of {given.workers} bare processes"
        quoted.record("campaign.efficiency", f"{statistics.median(shares):.2f}", unit, *words)


if __name__ == "__main__":
    main()
