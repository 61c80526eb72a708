"""Kills at random moments: does a campaign end with the same bits, nothing lost and nothing done twice?

    python tests/benchmarks/campaign_faults.py [--kills 200] [--runs 4000] [--pause 6] [--seed 1]

A scheduler and two workers started by hand, and the command ``gyrobench campaign``, on the bench of tests/campaign:
runs of some 30 ms; a tenth is refused, a tenth fails, one crashes, one ends the process, one uses up the memory.  One
of campaign, scheduler and workers gets SIGKILL after up to --pause seconds and is started again, until the
kills are made; then the campaign is left alone to its end.  Whenever the campaign starts again the stored rows are
read: no run may be missing that was there before, none may have another row; a run stands in two files only where a
merge was under way.  At the end the file of the runs is compared with that of an undisturbed campaign, bit for bit.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from asked import asked

BENCH = Path(__file__).parents[1] / "campaign" / "bench"
ROOT = Path(__file__).parents[2]
ENV = {**os.environ, "PYTHONPATH": str(ROOT), "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
FILE = """
system = "weighing"
table = "rows.csv"
time_limit = "60s"
memory_limit = "900MB"
keep = "none"
[set]
duration = "20s"
"""


class Cluster:
    """A scheduler and workers as processes of the command line."""

    def __init__(self, folder: Path, port: int) -> None:
        self.folder, self.address = folder, f"tcp://127.0.0.1:{port}"
        self.port, self.scheduler, self.workers = port, None, []  # type: ignore[var-annotated]
        self.start()

    def _start(self, *words: str) -> subprocess.Popen[bytes]:
        log = (self.folder / f"{words[0].rpartition('.')[2]}.log").open("ab")
        command = [sys.executable, "-m", *words]
        return subprocess.Popen(command, env=ENV, cwd=self.folder, stdout=log, stderr=log, start_new_session=True)

    def start(self) -> None:
        """Start what is not there."""
        if self.scheduler is None or self.scheduler.poll() is not None:
            port = ["--port", str(self.port), "--host", "127.0.0.1", "--no-dashboard"]
            self.scheduler = self._start("distributed.cli.dask_scheduler", *port)
        self.workers = [w for w in self.workers if w.poll() is None]
        while len(self.workers) < 2:
            more = ["--nthreads", "1", "--no-dashboard", "--local-directory", str(self.folder)]
            self.workers.append(self._start("distributed.cli.dask_worker", self.address, *more))

    def stop(self) -> None:
        for process in [*self.workers, self.scheduler]:
            kill_tree(process)


def kill_tree(process: subprocess.Popen[bytes]) -> None:
    """Kill a process that this program has started, with its children."""
    import psutil

    try:
        own = psutil.Process(process.pid)
        for p in [*own.children(recursive=True), own]:
            p.kill()
    except psutil.Error:
        pass
    process.wait()


def stored(folder: Path) -> tuple[Counter[str], dict[str, tuple[object, ...]]]:
    """How often each run stands in a file, and its row without its place."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    count: Counter[str] = Counter()
    rows: dict[str, tuple[object, ...]] = {}
    for file in list((folder / "runs").glob("*.parquet")):
        try:
            table = pq.read_table(file)
        except (FileNotFoundError, pa.ArrowInvalid):  # merged in between
            continue
        for row in table.to_pylist():
            count[row["run"]] += 1
            rows[row["run"]] = tuple(str(row.get(k)) for k in ("state", "reason", "mean.estimate", "mean.u"))
    return count, rows


def campaign(file: Path, out: Path, address: str, log: Path) -> subprocess.Popen[bytes]:
    words = [sys.executable, "-m", "gyrobench", "campaign", str(file), "--out", str(out), "--scheduler", address]
    output = log.open("ab")
    return subprocess.Popen(words, env=ENV, cwd=BENCH, stdout=output, stderr=output, start_new_session=True)


def whole(folder: Path) -> bytes:
    (file,) = (folder / "runs").iterdir()
    return file.read_bytes()


def main() -> None:
    given = asked(__doc__, kills=200, runs=4000, seed=1, pause=(6.0, "s, longest time between two kills"))
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # what was started is ended
    rng = random.Random(given.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / "faults.toml"
        file.write_text(FILE)
        odd = {given.runs // 3: "exit", given.runs // 2: "crash", 2 * given.runs // 3: "memory"}
        faults = [odd.get(k) or ("refused", "failed", *[""] * 8)[k % 10] for k in range(given.runs)]
        lines = [f"{k / given.runs},{fault},{k}" for k, fault in enumerate(faults)]
        (folder / "rows.csv").write_text("\n".join(["source.offset,fault,seed", *lines]) + "\n")
        log = folder / "campaign.log"
        cluster = Cluster(folder, 20000 + os.getpid() % 20000)
        process = campaign(file, folder / "disturbed", cluster.address, log)
        before: dict[str, tuple[object, ...]] = {}
        made: Counter[str] = Counter()
        twice = restarts = 0
        try:
            while sum(made.values()) < given.kills:
                time.sleep(rng.uniform(0.0, given.pause))
                ended = process.poll() is not None
                whom = rng.choice(["campaign"] * 4 + ["worker"] * 4 + ["scheduler"])
                if whom == "campaign" and not ended:
                    process.send_signal(signal.SIGKILL)
                    process.wait()
                elif whom == "worker":
                    import psutil

                    chosen = rng.choice(cluster.workers)
                    children = [] if chosen.poll() is not None else psutil.Process(chosen.pid).children(recursive=True)
                    (rng.choice(children) if children and rng.random() < 0.7 else chosen).send_signal(signal.SIGKILL)
                elif whom == "scheduler":
                    cluster.scheduler.kill()
                    cluster.scheduler.wait()
                else:
                    whom = ""
                if whom:
                    made[whom] += 1
                cluster.start()
                if process.poll() is not None:
                    count, rows = stored(folder / "disturbed")
                    lost = before.keys() - rows.keys()
                    assert not lost, f"{len(lost)} runs are lost"
                    assert all(rows[run] == row for run, row in before.items()), "a row has changed"
                    twice += any(n > 1 for n in count.values())
                    before = rows
                    if process.returncode == 0 and len(rows) == given.runs:
                        break
                    process = campaign(file, folder / "disturbed", cluster.address, log)
                    restarts += 1
            print(f"kills: {dict(made)}; {len(before)} runs stored, campaign started {restarts + 1} times, ", end="")
            print(f"{twice} times with a merge under way", flush=True)
            while process.wait():
                cluster.start()
                process = campaign(file, folder / "disturbed", cluster.address, log)
            process = campaign(file, folder / "undisturbed", cluster.address, log)
            while process.poll() is None:
                cluster.start()  # a worker that was killed last, or whose scheduler was
                time.sleep(0.5)
            assert process.returncode == 0, log.read_text()[-2000:]
            same = whole(folder / "disturbed") == whole(folder / "undisturbed")
            print("bit-equal to the undisturbed campaign" if same else "NOT EQUAL to the undisturbed campaign")
        finally:
            kill_tree(process)
            cluster.stop()
    sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
