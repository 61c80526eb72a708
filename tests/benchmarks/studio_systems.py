"""Every system in the studio: its page, its shortest plan as a job, the page of its run.

    python tests/benchmarks/studio_systems.py [system ...]

A studio on a bench of its own; each system's page is fetched, its run is asked for in the bench's folder, as a form
does, and started by the studio (as many at a time as it has cores); then the page of the run and its report are
fetched.  Printed for each: s of its page, s of the run with its report, verdict, the bodies of its moving picture, and
what is wrong.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
import numpy as np
from short_plans import SHORT
from studio_requests import Door

from gyrobench.bench import Bench, standard_folder
from gyrobench.record.record import Record
from gyrobench.studio.job_process import REQUEST, JobReport, read_report, store
from gyrobench.studio.jobs import ENDED, FOLDER
from gyrobench.studio.request import JobRequest
from gyrobench.system.moving_bodies import attitudes, parse_bodies
from gyrobench.system.suite import Suite
from gyrobench.workflow.inputs import load_test

LIMIT = 600.0  # s, without any run that ends


def page(door: Door, path: str) -> tuple[float, str]:
    """Return s of a page, and what is wrong with it."""
    status, took, answer = door.get(path)
    text = answer.decode("utf-8", "replace")
    return took, "" if status == 200 and '"role":"alert"' not in text else f"{path}: {status}, a problem is said"


def asked_for(home: Path, name: str) -> Path:
    """Put the request for a run into the bench; return the folder of its job."""
    folder = home / "reports" / "out" / FOLDER / f"20260101-000000-{name}"
    folder.mkdir(parents=True)
    request = JobRequest(name, SHORT.get(name, {}), seed=1)
    store(folder / REQUEST, {"request": request.as_dict(), "resume": False, "created": time.time()})
    return folder


def end_of(folder: Path) -> JobReport | None:
    """Return the account of a job that has ended."""
    report = read_report(folder)
    return report if report is not None and report.state in ENDED else None


def moving(folder: Path, name: str) -> str:
    """Return the bodies of the moving picture of a run."""
    test = load_test(name)
    if isinstance(test, Suite) or not (bodies := parse_bodies(getattr(test, "bodies", ""))):
        return ""
    record = Record.load(folder)
    return ", ".join(attitudes(bodies, record, np.arange(min(1, len(record.channels.get("time", ()))))))


def shown(door: Door, home: Path, report: JobReport) -> str:
    """Return what is wrong with the pages of a run."""
    place = Path(report.folder).relative_to(home.resolve() / "reports" / "out").as_posix()
    said = page(door, f"/run/{place}")[1]
    status, _, answer = door.get(f"/files/{place}/report.html")
    return said or ("" if status == 200 and b"</html>" in answer else f"report: {status}")


def walk(door: Door, home: Path, names: list[str]) -> int:
    """Walk the pages, run the systems, look at the runs; print and return how many are wrong."""
    print(f"| system | page / s | run / s | state | verdict | moving | wrong |\n|{'---|' * 7}", flush=True)
    pages = {name: page(door, f"/system/{name}") for name in names}
    left, wrong, last = {name: asked_for(home, name) for name in names}, 0, time.monotonic()
    while left and time.monotonic() < last + LIMIT:
        time.sleep(0.2)
        for name in [*left]:
            if (report := end_of(left[name])) is None:
                continue
            last, folder = time.monotonic(), left.pop(name)
            took = (folder / "state.json").stat().st_mtime - (folder / "started").stat().st_mtime
            said = [pages[name][1], "" if report.state == "done" else report.message]
            said += [shown(door, home, report)] if report.folder else ["" if said[1] else "no folder"]
            wrong += any(said)
            bodies = moving(Path(report.folder), name) if report.folder else ""
            words = "; ".join(filter(None, said)).replace("\n", " ")
            seconds = f"{pages[name][0]:.2f} | {took:.1f}"
            print(f"| `{name}` | {seconds} | {report.state} | {report.verdict} | {bodies} | {words} |", flush=True)
    print(f"{len(names)} systems, {wrong} wrong, {len(left)} without an end: {' '.join(left)}")
    return wrong + len(left)


def main(*names: str) -> int:
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        command = [sys.executable, "-m", "gyrobench", "studio", "--no-browser", "--port", "0"]
        studio = subprocess.Popen(command, cwd=home, stdout=subprocess.PIPE, text=True)
        try:
            assert studio.stdout is not None
            address = re.search(r"http://\S+", studio.stdout.readline())
            assert address
            return walk(Door.of(address[0]), home, list(names or Bench(standard_folder()).systems()))
        finally:
            studio.terminate()
            studio.wait(20)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
