"""The studio under load: open tabs, runs, a long record, hostile requests.

    python tests/benchmarks/studio_load.py [--rows 10000000] [--tabs 20] [--requests 2000] [--seconds 60]

A bench of its own with a record of 8 channels; tabs in Chromium, half of them on signals of the record, half on runs
under way; four runs asked for.  Meanwhile pages are fetched one after the other.  Printed: median and worst time of an
answer, the studio's processor time and memory, the time of a view of all channels at any zoom, and what hostile
requests got out of it.
Budgets: 0.3 s at the median, 1 GB, 150 ms, nothing.
"""

from __future__ import annotations

import argparse
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from studio_pages import CHROMIUM
from studio_requests import Door, wrong

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
    ask = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    ask.add_argument("--rows", type=int, default=10_000_000)
    ask.add_argument("--tabs", type=int, default=20)
    ask.add_argument("--requests", type=int, default=2000)
    ask.add_argument("--seconds", type=float, default=60.0)
    asked = ask.parse_args()
    with tempfile.TemporaryDirectory() as name:
        home = Path(name)
        record = home / "reports" / "out" / "fixed_position" / "long"
        long_record(record, asked.rows)
        first, again = views(record)
        print(f"{CHANNELS} channels of {asked.rows:,} rows: first look {first:.1f} s, views {1e3 * again:.1f} ms")
        command = [sys.executable, "-m", "gyrobench", "studio", "--no-browser", "--port", "0"]
        studio = subprocess.Popen(command, cwd=home, stdout=subprocess.PIPE, text=True)
        try:
            assert studio.stdout is not None
            address = re.search(r"http://\S+", studio.stdout.readline())
            assert address
            under_load(Door.of(address[0]), address[0], home, studio.pid, asked)
        finally:
            for key in (home / "reports" / "out" / FOLDER).glob("*"):
                subprocess.run([sys.executable, "-c", STOP, str(home), key.name], check=False)
            studio.terminate()
            studio.wait(20)


STOP = """import os, sys
from gyrobench.bench import Bench
from gyrobench.studio.jobs import StudioJobs
os.chdir(sys.argv[1])
StudioJobs(Bench.find()).stop(sys.argv[2])"""


def under_load(door: Door, address: str, home: Path, studio: int, asked: argparse.Namespace) -> None:
    """Open the tabs, fetch pages for a while, then send what is hostile."""
    from playwright.sync_api import sync_playwright

    keys = ask_for_runs(home, 4)
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        context = browser.new_context()
        base = address.partition("/?")[0]
        tabs = []
        for k in range(asked.tabs):
            tab = context.new_page()
            tab.set_default_timeout(120_000)
            tab.goto(address if k == 0 else base + "/")
            tab.goto(base + (f"/job/{keys[k % 4]}" if k % 2 else "/run/fixed_position/long"))
            if k % 2 == 0:
                tab.get_by_role("tab", name="Signals").click()
            tabs.append(tab)
        for path in FETCHED:  # the first look at a page loads what it shows
            door.get(path)
        times, end, used = [], time.monotonic() + asked.seconds, processor_time(studio)
        while time.monotonic() < end:
            status, took, _ = door.get(FETCHED[len(times) % len(FETCHED)])
            assert status == 200, status
            times.append(took)
            tabs[0].wait_for_timeout(200)
        print(f"{asked.tabs} tabs, 4 runs, {len(times)} answers: {np.median(times):.3f} s, worst {max(times):.2f} s")
        print(f"its processor time: {(processor_time(studio) - used) / asked.seconds:.2f} of a core")
        print(f"memory at most {memory(studio):.0f} MB")
        browser.close()
    rng, found = random.Random(3), []
    for _ in range(asked.requests):
        raw, whole = door.hostile(rng)
        if said := wrong(door.send(raw, whole)):
            found.append((said, raw[:120]))
    status, _, _ = door.get("/")
    print(f"{asked.requests} hostile requests: {len(found)} got something out; afterwards the studio answers {status}")
    print(*found[:10], sep="\n")


if __name__ == "__main__":
    main()
