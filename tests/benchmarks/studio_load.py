"""The studio under load: open tabs, runs, a long record, hostile requests.

    python tests/benchmarks/studio_load.py [--rows 10000000] [--tabs 20] [--drawn 4] [--requests 2000] [--seconds 45]

A bench of its own with a record of 8 channels; tabs, half of them on signals of the record, half on runs under way;
four runs asked for.  Meanwhile pages are fetched one after the other.  Printed: median and worst time of an
answer, the studio's processor time and memory, the time of a view of all channels at any zoom, and what hostile
requests got out of it.
Budgets: 0.3 s at the median, 1 GB, 150 ms, nothing.

Before that, alone: s from the first page to a report by a new user's clicks (budget 60 s).

Measured is the studio, not the browser: so many tabs as ``--drawn`` are pages of Chromium, half of them zoomed all the
time; the others speak the same protocol with the studio, get and confirm every message of theirs, and draw nothing.
Twenty browsers of twenty people would not share two cores with the studio.
"""

from __future__ import annotations

import argparse
import itertools
import math
import os
import random
import re
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from asked import asked
from studio_pages import CHROMIUM
from studio_requests import Door, SocketTab, wrong

import gyrobench as gb
from gyrobench.studio.chart import RecordSignals, signals_of
from gyrobench.studio.job_process import REQUEST, store
from gyrobench.studio.jobs import FOLDER
from gyrobench.studio.request import JobRequest

CHANNELS = 8
FETCHED = (
    "/",
    "/system/tumble_single_axis",
    "/runs",
    "/run/fixed_position/long",
    "/learn",
    "/tune",
    "/part/floated_gyro",
)


def long_record(folder: Path, rows: int) -> None:
    """Write a record with so many rows of noise and sines, one sample of each channel standing out."""
    record = gb.load("fixed_position", {"dwell": "60s"}).run(check_step=False).record
    rng, time_ = np.random.default_rng(1), np.arange(rows) * 1e-3
    record.channels.clear()
    record.channels["time"] = time_
    for k in range(CHANNELS):
        values = np.sin(2e-3 * (k + 1) * time_) + 0.1 * rng.standard_normal(rows)
        values[rows // 3 + k] = 10.0
        record.channels[f"signal.y{k}"] = values
        record.run.units[f"signal.y{k}"] = "V"
    record.save(folder)


def views(folder: Path) -> tuple[float, float]:
    """Return s of the first look at all channels and the median s of further ones, at random zooms."""
    began = time.perf_counter()
    signals = signals_of(folder)
    every = [n for n in signals.names if n.startswith("signal.")]
    _look(signals, every, *signals.span)
    first, times, rng = time.perf_counter() - began, [], random.Random(2)
    low, high = signals.span
    for _ in range(40):
        width = (high - low) * 10.0 ** rng.uniform(-6, 0)
        begin = rng.uniform(low, high - width)
        began = time.perf_counter()
        assert _look(signals, every, begin, begin + width) < CHANNELS * 2200
        times.append(time.perf_counter() - began)
    return first, float(np.median(times))


def _look(signals: RecordSignals, names: list[str], begin: float, end: float) -> int:
    return sum(len(signals.points(n, begin, end, 1.0)) for n in names)


def memory(process: int) -> float:
    """Return the largest memory of a process so far, MB."""
    text = Path(f"/proc/{process}/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+)", text)[1]) / 1024.0  # type: ignore[index]


def processor_time(process: int) -> float:
    """Return s that a process has computed so far."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def ask_for_runs(home: Path, count: int) -> list[str]:
    """Put requests into the bench, which the studio finds and starts; return their keys."""
    keys = [f"20260101-00000{k}-load" for k in range(count)]
    for k, key in enumerate(keys):
        folder = home / "reports" / "out" / FOLDER / key
        folder.mkdir(parents=True)
        request = JobRequest("fixed_position", {"dwell": "20000000s"}, seed=k + 1)
        store(folder / REQUEST, {"request": request.as_dict(), "resume": False, "created": time.time()})
    return keys


def main() -> None:
    given = asked(__doc__, rows=10_000_000, tabs=20, drawn=4, requests=2000, seconds=45.0)
    home = Path(tempfile.mkdtemp())
    keeper = subprocess.Popen(
        [sys.executable, "-c", KEEPER, str(home)], stdin=subprocess.PIPE, text=True, start_new_session=True
    )
    assert keeper.stdin is not None
    try:
        record = home / "reports" / "out" / "fixed_position" / "long"
        long_record(record, given.rows)
        first, again = views(record)
        print(f"{CHANNELS} channels of {given.rows:,} rows: first look {first:.1f} s, views {1e3 * again:.1f} ms")
        command = [sys.executable, "-m", "gyrobench", "studio", "--no-browser", "--port", "0"]
        studio = subprocess.Popen(command, cwd=home, stdout=subprocess.PIPE, text=True)
        print(studio.pid, file=keeper.stdin, flush=True)
        assert studio.stdout is not None
        address = re.search(r"http://\S+", studio.stdout.readline())
        assert address
        under_load(Door.of(address[0]), address[0], home, studio.pid, given)
    finally:
        keeper.stdin.close()
        keeper.wait(60)


#: ends studio and runs and removes the bench when its input ends: then the benchmark has ended, or it was killed
KEEPER = """import os, shutil, signal, sys, time
from pathlib import Path
from gyrobench.bench import Bench
from gyrobench.studio.jobs import StudioJobs
started = [int(line) for line in sys.stdin]
for process in started:
    os.kill(process, signal.SIGTERM)
os.chdir(sys.argv[1])
jobs, end = StudioJobs(Bench.find()), time.monotonic() + 20.0
while (active := [j for j in jobs.all() if j.active]) and time.monotonic() < end:
    for job in active:
        jobs.stop(job.key)
    time.sleep(0.3)
os.chdir('/')
shutil.rmtree(sys.argv[1], ignore_errors=True)"""


def fetch(door: Door, end: float, times: list[float]) -> None:
    """Fetch pages one after the other until then; put s of each answer into ``times``, infinity for a refused one."""
    while time.monotonic() < end:
        status, took, _ = door.get(FETCHED[len(times) % len(FETCHED)])
        times.append(took if status == 200 else math.inf)
        time.sleep(0.2)


def first_report(page: Any, address: str) -> float:
    """Return s from the first page to a report: a system is searched, chosen, set and run."""
    began = time.monotonic()
    page.goto(address)
    page.get_by_label("Search").fill("fixed-position")
    page.get_by_text("Fixed-position test", exact=True).click()
    page.get_by_label("dwell", exact=True).fill("60s")
    page.get_by_role("button", name="Run").click()
    page.wait_for_url("**/run/**")
    page.frame_locator("iframe.report").get_by_text("Coefficients", exact=False).first.wait_for()
    page.close()
    return time.monotonic() - began


def under_load(door: Door, address: str, home: Path, studio: int, given: argparse.Namespace) -> None:
    """Open the tabs, fetch pages for a while, then send what is hostile."""
    from playwright.sync_api import sync_playwright

    base = address.partition("/?")[0]
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        context = browser.new_context()
        print(f"from the first page to a report: {first_report(context.new_page(), address):.1f} s")
        keys = ask_for_runs(home, 4)
        paths = [f"/job/{keys[k // 2 % 4]}" if k % 2 else "/run/fixed_position/long" for k in range(given.tabs)]
        tabs, zoomed = [], []
        for k, path in enumerate(paths[: given.drawn]):
            tab = context.new_page()
            tab.set_default_timeout(60_000)
            tab.goto(address if k == 0 else base + "/")
            tab.goto(base + path)
            if k % 2 == 0:
                tab.get_by_role("tab", name="Signals").click()
                tab.locator(".chart canvas").first.wait_for()
                tab.locator(".chart").hover()
                zoomed.append(tab)
            tabs.append(tab)
        others = [SocketTab(door, path) for path in paths[given.drawn :]]
        for path in FETCHED:  # the first look at a page loads what it shows
            door.get(path)
        times: list[float] = []
        end, used = time.monotonic() + given.seconds, processor_time(studio)
        fetching = threading.Thread(target=fetch, args=(door, end, times))
        fetching.start()
        for k in itertools.takewhile(lambda _: time.monotonic() < end, itertools.count()):
            zoomed[k % len(zoomed)].mouse.wheel(0, -120 if k % 40 < 20 else 120)
            tabs[0].wait_for_timeout(200)
        fetching.join()
        share = (processor_time(studio) - used) / given.seconds
        print(f"{given.tabs} tabs, {given.drawn} of them drawn; 4 runs asked for; {len(times)} answers:")
        print(f"median {np.median(times):.3f} s, worst {max(times):.2f} s")
        got = [tab.messages for tab in others if tab.path.startswith("/job/")]
        print(f"its processor time: {share:.2f} of a core; messages to a tab of a run: {min(got)} to {max(got)}")
        print(f"memory at most {memory(studio):.0f} MB")
        for tab in others:
            tab.close()
        browser.close()
    rng, found = random.Random(3), []
    for _ in range(given.requests):
        raw, whole = door.hostile(rng)
        if said := wrong(door.send(raw, whole)):
            found.append((said, raw[:120]))
    status, _, _ = door.get("/")
    print(f"{given.requests} hostile requests: {len(found)} got something out; afterwards the studio answers {status}")
    print(*found[:10], sep="\n")


if __name__ == "__main__":
    main()
