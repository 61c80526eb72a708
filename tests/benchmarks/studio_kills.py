"""The studio and its runs under SIGKILL, in every phase of a run.

    python tests/benchmarks/studio_kills.py [rounds]

A round kills at each of PHASES, by what is on disk, up to 0.3 s later: the studio, the process of the run, or both.
Then a studio is there again; what is lost is resumed, as its button does.  Counted: rounds by phase and by what was
killed; runs that do not end, that differ from the whole run (record by its digests, coefficients, warnings), files and
folders that it does not have, and processes that live on.
"""

from __future__ import annotations

import contextlib
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench
from gyrobench.studio.job_process import REQUEST, STARTED, STATE, store
from gyrobench.studio.jobs import StudioJobs
from gyrobench.studio.request import JobRequest

NAME = "tumble_single_axis"
VALUES = {"rate": "10deg/s", "dwell": "6s", "windows": "12"}
#: phase -> what is there when it begins, of the job or of the run
PHASES = {
    "waiting": ("job", REQUEST), "starting": ("job", STARTED), "running": ("job", STATE), "record": ("run", "run.json"),
    "result": ("run", "result.json"), "page": ("run", "report.html"),
}  # fmt: skip
WHOM = ("studio", "run", "both")
LIMIT = 120.0  # s


class Studio:
    """A studio that is started anew when it was killed."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.process = self._begun()

    def _begun(self) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "gyrobench", "studio", "--no-browser", "--port", "0"]
        process = subprocess.Popen(command, cwd=self.home, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None and re.search(r"http://\S+", process.stdout.readline())
        return process

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def there(self) -> None:
        """Start it where it is not."""
        if self.process.poll() is not None:
            self.process = self._begun()


def until(there: Any, what: str) -> Any:
    """Return what ``there()`` gives once it is true.  Raises TimeoutError."""
    end = time.monotonic() + LIMIT
    while not (found := there()):
        if time.monotonic() > end:
            raise TimeoutError(what)
        time.sleep(0.002)
    return found


def run_folder(out: Path) -> Path | None:
    """Return the folder of the one run of the bench."""
    return next((f for f in (out / NAME).glob("*") if f.is_dir()), None)


def told(out: Path) -> tuple[object, ...]:
    """Return what a run has: digests of its tables, coefficients and warnings, names of its files."""
    folder = run_folder(out)
    assert folder is not None
    run, result = (json.loads((folder / f).read_text(encoding="utf-8")) for f in ("run.json", "result.json"))
    names = sorted(f.name for f in folder.iterdir())
    return run["tables"], result["coefficients"], result["warnings"], names, len(list((out / NAME).iterdir()))


def asked_for(jobs: StudioJobs) -> str:
    """Put a request into the bench, which its studio finds; return its key."""
    key = "20260101-000000-kill"
    folder = jobs.folder / key
    folder.mkdir(parents=True)
    request = JobRequest(NAME, VALUES, seed=1).as_dict()
    store(folder / REQUEST, {"request": request, "resume": False, "created": time.time()})
    return key


def ended(jobs: StudioJobs, key: str) -> str:
    """Return the state of a job once it has come to an end."""
    return str(until(lambda: "" if (job := jobs.find(key)).active else job.state, f"job {key} to end"))


def kill(jobs: StudioJobs, key: str, studio: Studio, whom: str) -> bool:
    """Kill; return whether the process of the run was alive."""
    lived = False
    if whom in ("run", "both") and (process := jobs._process(key)):
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
            lived = True
    if whom in ("studio", "both"):
        studio.kill()
    return lived


def living(home: Path) -> list[str]:
    """Return the processes that work in a bench."""
    found = []
    for link in Path("/proc").glob("[0-9]*/cwd"):
        with contextlib.suppress(OSError):
            if int(link.parent.name) != os.getpid() and link.resolve() == home.resolve():
                found.append(link.parent.name)
    return found


def once(home: Path, phase: str, whom: str, wait: float, studio: Studio) -> tuple[str, tuple[object, ...]]:
    """Kill once; return the way that the run went, and what it has in the end."""
    jobs = StudioJobs(Bench.find(), read_only=False)
    out = jobs.folder.parents[1]
    key = asked_for(jobs)
    kind, name = PHASES[phase]

    def begun() -> bool:
        folder = jobs.folder / key if kind == "job" else run_folder(out)
        return folder is not None and (folder / name).exists()

    until(begun, f"the phase {phase}")
    time.sleep(wait)
    kill(jobs, key, studio, whom)
    studio.there()
    way = [state := ended(jobs, key)]
    while state == "lost":  # the button of its page
        jobs.most = 0  # the studio starts it
        key = jobs.resume(key)
        way.append(state := ended(jobs, key))
    return " -> ".join(way), told(out) if state == "done" else ()


def main(rounds: int = 2) -> int:
    moments, ways, wrong = random.Random(5), Counter[str](), Counter[str]()
    with tempfile.TemporaryDirectory(prefix="studio-kills-") as place:
        whole: tuple[object, ...] = ()
        for k in range(-1, rounds * len(PHASES) * len(WHOM)):
            home = Path(place) / f"bench{k}"
            home.mkdir()
            os.chdir(home)
            studio = Studio(home)
            phase = [*PHASES][k // len(WHOM) % len(PHASES)]
            whom = WHOM[k % len(WHOM)] if k >= 0 else ""
            try:
                way, has = once(home, phase if whom else "waiting", whom, moments.uniform(0.0, 0.3), studio)
                whole = whole or has
                wrong["differ from the whole run"] += has != whole
            except (TimeoutError, AssertionError, ValueError) as error:
                way = f"{type(error).__name__}: {error}"
                wrong["do not end"] += 1
            finally:
                studio.process.terminate()
                studio.process.wait(20)
            wrong["processes live on"] += len(living(home))
            ways[f"{phase}, {whom or 'nothing'} killed: {way}"] += 1
            print(f"{k + 1}: {phase}, {whom or 'nothing'} killed: {way}", flush=True)
    print(*(f"{count} x {way}" for way, count in sorted(ways.items())), sep="\n")
    print(f"{ways.total() - 1} kills; wrong: {dict(+wrong) or 'nothing'}")
    return len(+wrong)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
