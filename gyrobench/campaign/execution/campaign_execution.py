"""Execution of a campaign on dask.distributed: what is stored is not run again, what is run is stored within seconds.

The process that calls is the only one that writes.  Chunks of runs (about a second of work each) go to the workers and
come back as rows; what was on its way when anything is killed is run again, and every run gives the same bits again.
"""

from __future__ import annotations

import contextlib
import errno
import queue
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gyrobench.campaign.execution.bundle import tool_digest
from gyrobench.campaign.execution.campaign_plan import MEASURED, CampaignPlan, PlannedRun, make_plan
from gyrobench.campaign.execution.clusters import connect, has_own_processes, is_local, is_temporary
from gyrobench.campaign.execution.definition import Definition
from gyrobench.campaign.execution.store import Campaign, CampaignError, CampaignStore
from gyrobench.notebook import MissingPackageError

if TYPE_CHECKING:
    from distributed import Client

    from gyrobench.campaign.execution.worker import Chunk, ChunkResult

SECONDS = 1.0  # of work in a chunk
WRITE = 2.0  # s between two writes
AHEAD = 2  # chunks for each worker: one it works on, one it has
UNSEEN = 20  # times that a worker with a run may vanish and leave no trace
PATIENCE = 60.0  # s until the machine of a worker that vanished is given up
RETRIED = ("crashed", "hung", "memory")  # states that --retry runs again


class CampaignStopped(CampaignError):
    """The user stopped a campaign."""

    exit_code = 130


@dataclass
class CampaignProgress:
    """Progress of a campaign.  total, stored: runs.  states: of those that were run now."""

    total: int
    stored: int
    states: Counter[str]
    workers: int
    elapsed: float

    @property
    def done(self) -> int:
        """Runs that were run now."""
        return sum(self.states.values())

    @property
    def fraction(self) -> float:
        return (self.stored + self.done) / self.total if self.total else 1.0

    @property
    def words(self) -> str:
        """Runs, rate, time left, failures, workers."""
        text = f"{self.stored + self.done:,} of {self.total:,} runs"
        if self.done and self.elapsed > 0.0:
            rate = self.done / self.elapsed
            left = (self.total - self.stored - self.done) / rate
            speed = f"{rate:.1f} runs/s" if rate >= 1.0 else f"{60.0 * rate:.1f} runs/min"
            text += f", {speed}, {left / 60.0:.0f} min left" if left > 90.0 else f", {speed}, {left:.0f} s left"
        failures = [f"{n} {state}" for state, n in sorted(self.states.items()) if state != "done"]
        return f"{text}; {', '.join([*failures, f'{self.workers} workers'])}"


@dataclass
class CampaignOutcome:
    """A campaign after its execution.  repeated: points of the plan that are the run of another point."""

    campaign: Campaign
    executed: int
    stored: int
    repeated: int
    notes: list[str] = field(default_factory=list)


def execute_campaign(
    definition: Definition,
    out: str | Path,
    *,
    client: Client | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    retry: bool = False,
    notes: Callable[[Iterable[str]], None] = lambda _: None,
    progress: Callable[[CampaignProgress], None] | None = None,
) -> CampaignOutcome:
    """Run what the store at ``out`` does not have of a campaign; return what it has then.

    client: of dask, else one for the scheduler at an address, else local processes.  retry: run again what crashed,
    hung or had no memory.  Raises UsageError, CampaignError, CampaignStopped (the same call goes on).
    """
    try:
        import cryptography  # noqa: F401
        import psutil  # noqa: F401
        from distributed.comm.core import CommClosedError
    except ImportError:
        raise MissingPackageError("campaigns need further packages: pip install 'gyrobench[campaign]'") from None
    with CampaignStore(out) as store:
        plan = make_plan(definition)
        notes(plan.notes)
        stored = store.begin(plan.document(), plan.columns(), plan.units)
        if retry:
            for run in store.forget(RETRIED):
                stored.pop(run)
        wanted = [r for r in plan.runs if r.run not in stored]
        outcome = CampaignOutcome(store, len(wanted), len(stored), plan.repeated)
        keep = definition.keep
        if wanted or (keep == "extremes" and stored):
            try:
                with connect(client, scheduler, workers, len(wanted) or 1, notes) as connected:
                    execution = _Execution(plan, store, connected, len(stored), progress)
                    execution.run(wanted)
                    if keep == "extremes":
                        outcome.notes += execution.keep_extremes()
            except KeyboardInterrupt:
                raise CampaignStopped(_goes_on(store, plan, "interrupted")) from None
            except OSError as error:
                if isinstance(error, CommClosedError | TimeoutError):
                    raise CampaignError(_goes_on(store, plan, "the scheduler is gone")) from None
                if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                    raise
                raise CampaignError(_goes_on(store, plan, f"{error.strerror}: make room")) from None
        with contextlib.suppress(FileNotFoundError):
            store.consolidate()
    return outcome


def _goes_on(store: CampaignStore, plan: CampaignPlan, why: str) -> str:
    done = store.arrow().num_rows
    return f"{why}; {done:,} of {len(plan.runs):,} runs are stored in {store.url}: the same command runs the others"


class _Execution:
    """The state of an execution: which runs wait, which are on their way, how often each was tried."""

    def __init__(
        self, plan: CampaignPlan, store: CampaignStore, client: Client, stored: int,
        progress: Callable[[CampaignProgress], None] | None,
    ) -> None:  # fmt: skip
        from gyrobench.campaign.execution.worker import BundlePlugin, ExecutionSettings

        d = plan.definition
        self.plan, self.store, self.client, self.progress = plan, store, client, progress
        self.stored, self.start, self.looked, self.written = stored, time.monotonic(), 0.0, time.monotonic()
        self.name = uuid.uuid4().hex[:12]
        self.own = has_own_processes(client)
        settings = ExecutionSettings(
            self.name, tool_digest(), d.system, tuple(plan.setups), plan.spec, plan.columns_map,
            d.step, d.check_step, plan.nominal, d.keep, d.time_limit, d.memory_limit, self.own,
        )  # fmt: skip
        _add_engine(plan)
        self.plugin = BundlePlugin(settings, plan.bundle.packed())
        self.waiting: deque[PlannedRun] = deque()
        self.alone: deque[PlannedRun] = deque()  # that have ended a worker
        self.lost: list[tuple[Chunk, str, float]] = []  # whose worker vanished: its machine, when
        self.flying: dict[Any, Chunk] = {}
        self.finished: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.tries: dict[str, list[str]] = {}
        self.spent: dict[str, tuple[str, str]] = {}  # runs with no try left: state and reason
        self.vanished: Counter[str] = Counter()
        self.final: set[str] = set()
        self.states: Counter[str] = Counter()
        self.cost: dict[int, float] = {}  # s a run, by setup
        self.rows: list[dict[str, Any]] = []
        self.log: list[dict[str, Any]] = []
        self.units: dict[str, str] = {}
        self.workers = 1
        self.keep: str | None = None
        self.seen: dict[str, dict[str, Any]] = {}

    def run(self, runs: Iterable[PlannedRun]) -> None:
        """Execute runs and store their rows."""
        self.client.register_plugin(self.plugin)
        self.waiting.extend(sorted(runs, key=lambda r: (r.setup, r.index)))
        stopped = True
        try:
            self._look()
            while self.waiting or self.alone or self.flying or self.lost:
                self._submit()
                self._collect()
                if time.monotonic() - self.written > WRITE:
                    self._write()
                if time.monotonic() - self.looked > 0.5:
                    self._look()
                    if self.lost:
                        self._inquire()
            stopped = False
        finally:
            try:
                self._write()
            finally:
                for future in self.flying:
                    future.release()
                self.flying.clear()
                if not (stopped and is_temporary(self.client)):  # it would wait for the runs under way
                    with contextlib.suppress(Exception):  # the scheduler may be gone
                        self.client.unregister_worker_plugin(self.plugin.name)

    def keep_extremes(self) -> list[str]:
        """Run again, with record and report, the runs with the smallest and largest estimate of each coefficient."""
        frame = self.store.table()
        wanted: set[str] = set()
        for column in [c for c in frame.columns if c.endswith(".estimate")]:
            values = frame.set_index("run")[column].dropna()
            if len(values):
                wanted |= {values.idxmin(), values.idxmax()}
        kept = {run for run, path in zip(frame["run"], frame["report"], strict=True) if isinstance(path, str)}
        runs = [r for r in self.plan.runs if r.run in wanted - kept]
        before = {r["run"]: r for r in self.store.arrow().to_pylist()}
        self.keep, self.final = "all", set()
        self.run(runs)
        same = [
            run for run, row in self.seen.items() if all(row.get(k) == before[run].get(k) for k in ("state", "reason"))
        ]
        odd = [r.run for r in runs if r.run not in same]
        return [f"{run}: gave another result the second time" for run in odd]

    # ------------------------------------------------------------------------------------------ chunks
    def _submit(self) -> None:
        """Give the workers what they can work on."""
        from gyrobench.campaign.execution.worker import run_chunk

        # a run that may end its worker has no neighbour waiting there
        while len(self.flying) < (1 if self.alone else AHEAD) * self.workers and (self.waiting or self.alone):
            chunk = self._chunk()
            future = self.client.submit(
                run_chunk, self.name, chunk, key=f"campaign-{self.name}-{uuid.uuid4().hex[:8]}", pure=False
            )
            self.flying[future] = chunk
            future.add_done_callback(self.finished.put)

    def _chunk(self) -> Chunk:
        """Return the next runs: one that has ended a worker, else of one setup about a second of work."""
        from gyrobench.campaign.execution.worker import Chunk

        if self.alone:
            runs = [self.alone.popleft()]
        else:
            setup = self.waiting[0].setup
            cost = self.cost.get(setup)
            fair = len(self.waiting) / (AHEAD * self.workers)  # at the end nobody waits for one with many
            count = 1 if cost is None else max(1, int(min(SECONDS / max(cost, 1e-4), fair)))
            runs = []
            while self.waiting and len(runs) < count and self.waiting[0].setup == setup:
                runs.append(self.waiting.popleft())
        content = {}
        if not self.own or not is_local(self.client):
            content = {r.data: Path(r.data).read_bytes() for r in runs if r.data is not None}
        return Chunk(runs, content, self.keep)

    def _collect(self) -> None:
        """Take what has come back."""
        from distributed import KilledWorker

        from gyrobench.campaign.execution.worker import MachineError

        try:
            future = self.finished.get(timeout=0.2)
        except queue.Empty:
            if self.client.status not in ("running", "connecting"):
                raise CampaignError(_goes_on(self.store, self.plan, "the scheduler is gone")) from None
            return
        chunk = self.flying.pop(future)
        try:
            self._take(chunk, future.result())
        except KilledWorker as error:
            worker = getattr(error.last_worker, "address", "")
            self.lost.append((chunk, _machine(worker), time.monotonic()))
        except CancelledError:
            raise CampaignError(_goes_on(self.store, self.plan, "the scheduler is gone")) from None
        except MachineError as error:
            self._write()
            raise CampaignError(_goes_on(self.store, self.plan, str(error))) from None
        finally:
            future.release()

    def _inquire(self) -> None:
        """Ask the workers which runs have ended a worker; what was only beside them waits again."""
        from gyrobench.campaign.execution.worker import find_lost_runs

        answers = self.client.run(find_lost_runs, self.name, on_error="ignore") if self.own else {}
        tries_allowed = self.plan.definition.retries + 1
        for lost in [c for found in answers.values() for c in found or ()]:
            tries = self.tries.setdefault(lost.run, [])
            tries.append(f"{lost.reason} {lost.detail}".strip())
            if len(tries) >= tries_allowed:
                times = f", {tries_allowed} times" if tries_allowed > 1 else ""
                self.spent[lost.run] = lost.state, f"{lost.reason}{times}"
        machines = {_machine(address) for address in answers}
        late = time.monotonic() - PATIENCE
        for entry in [e for e in self.lost if e[1] in machines or e[2] < late]:
            self.lost.remove(entry)
            for run in reversed(entry[0].runs):
                if run.run in self.spent:  # told, perhaps, before its chunk was known to be lost
                    self._end(run, *self.spent[run.run])
                    continue
                self.vanished[run.run] += 1
                if self.vanished[run.run] > UNSEEN:
                    self._end(run, "crashed", f"its worker vanished {UNSEEN} times")
                elif run.run not in self.final:
                    (self.alone if run.run in self.tries else self.waiting).appendleft(run)

    def _take(self, chunk: Chunk, done: ChunkResult) -> None:
        """Take rows."""
        for kept, files in done.kept.items():
            self.store.keep(kept, files)
        self.units |= done.units
        for row, log in zip(done.rows, done.log, strict=True):
            if row["run"] in self.final:
                continue
            self.final.add(row["run"])
            self.states[row["state"]] += 1
            if self.keep is None:
                self.rows.append(row)
                self.log.append(self._logged(log))
            else:
                self.seen[row["run"]] = row
        if done.log:
            setup = chunk.runs[0].setup
            cost = sum(entry["seconds"] for entry in done.log) / len(done.log)
            self.cost[setup] = 0.5 * (self.cost.get(setup, cost) + cost)

    def _end(self, run: PlannedRun, state: str, reason: str) -> None:
        """Store a run that has no result."""
        if run.run in self.final:
            return
        self.final.add(run.run)
        self.states[state] += 1
        self.rows.append({**run.columns(self.plan.definition.system), "state": state, "reason": reason})
        self.log.append(
            self._logged({"run": run.run, "worker": None, "seconds": None, "finished_at": None, "detail": ""})
        )

    def _logged(self, entry: dict[str, Any]) -> dict[str, Any]:
        tries = self.tries.get(entry["run"], [])
        texts = [*tries, *filter(None, [entry["detail"]])]
        kept = {k: v for k, v in entry.items() if k != "detail"}
        return {**kept, "attempts": len(tries) + (entry["worker"] is not None), "tries": "\n".join(texts) or None}

    def _write(self) -> None:
        """Store the rows that have come."""
        self.written = time.monotonic()
        if self.rows:
            self.store.append(self.rows, self.units, self.log)
            self.rows, self.log = [], []

    def _look(self) -> None:
        """See how many workers there are, and say how far the campaign is."""
        self.looked = time.monotonic()
        threads = self.client.nthreads()
        self.workers = max(1, len(threads))  # runs of a process are made one after the other
        if self.progress is not None:
            elapsed = time.monotonic() - self.start
            total = len(self.plan.runs) if self.keep is None else len(self.plan.runs) + len(self.final)
            self.progress(CampaignProgress(total, self.stored, self.states.copy(), len(threads), elapsed))


def _machine(address: str) -> str:
    """Return the machine in an address: tcp://10.0.0.1:4000."""
    return address.rpartition(":")[0].rpartition("/")[2]


def _add_engine(plan: CampaignPlan) -> None:
    """Put the native engine into the bundle, where there is one."""
    from gyrobench.engine.engine_library import engine_library
    from gyrobench.packaging import CompilerError

    if all(r.setup == MEASURED for r in plan.runs):
        return
    with contextlib.suppress(CompilerError):
        file = engine_library()
        plan.bundle.add(file, f"engine/{file.name}")
