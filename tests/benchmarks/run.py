"""All budgets in one table, each against a rival measured in the same run.

    python tests/benchmarks/run.py [--quick] [--write]

Prints what, measured, budget, and the ratio to the rival; --write: into docs/figures.toml, too.  Times are wall times
of this machine now unless CPU time is said; read the ratios.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

import peers
import quoted

HERE = Path(__file__).parent
ROUNDS = 3
STEPS = {
    "one hand-written C loop": 10_000_000,
    "gyrobench, native engine on FMI calls": 1_000_000,
    "gyrobench, native engine, linked form": 1_000_000,
    "gyrobench, one FMU in FMPy": 1_000_000,
    "toolbox container, sequential": 300_000,
    "ecospy": 100_000,
}
OURS = "gyrobench, native engine on FMI calls"
ROWS: list[tuple[str, str, str, str]] = []
QUOTED: list[tuple[str, str | dict[str, str], str]] = []  # figures of docs/figures.toml: key, value, unit
KEYS = {
    "one hand-written C loop": "c_loop",
    "gyrobench, native engine, linked form": "linked",
    OURS: "fmi_calls",
    "gyrobench, one FMU in FMPy": "one_fmu",
    "toolbox container, sequential": "container",
    "ecospy": "ecospy",
    "gyrobench, reference engine": "reference",
    "FMPy, loop of its API": "fmpy_loop",
    "FMPy, simulate_ssp": "fmpy_ssp",
    "libcosimpy": "libcosimpy",
}


def row(what: str, measured: str, budget: str = "", ratio: str = "") -> None:
    ROWS.append((what, measured, budget, ratio))
    print("  ".join(x.ljust(w) for x, w in zip(ROWS[-1], (58, 16, 14, 40), strict=True)).rstrip(), flush=True)


def environment() -> dict[str, str]:
    """ecospy's library needs libtbb, which its package puts into the environment's lib folder."""
    lib = str(Path(sys.prefix) / "lib")
    path = os.pathsep.join(filter(None, (lib, os.environ.get("LD_LIBRARY_PATH", ""))))
    return {**os.environ, "LD_LIBRARY_PATH": path}


def one(name: str, folder: Path, quick: bool) -> dict[str, float] | str:
    steps = STEPS.get(name, 10_000) // (10 if quick else 1)
    command = [sys.executable, str(HERE / "peers.py"), name, str(folder), str(steps)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), timeout=300, check=False)
    for line in reversed(done.stdout.splitlines()):
        if line.startswith('{"us"'):
            return dict(json.loads(line))
    missing = "No module named" in done.stderr
    return "not installed" if missing else f"failed: {(done.stderr.strip().splitlines() or ['no output'])[-1][:60]}"


def masters(quick: bool) -> None:
    """The engine against its peers, in turn, ROUNDS times; medians."""
    from gyrobench.exchange.container import export_container
    from gyrobench.exchange.ssp_export import export_ssp
    from gyrobench.exchange.system_fmu import export_fmu
    from gyrobench.packaging import build
    from gyrobench.system.system import load_system

    print("\nFour trivial FMUs in a loop, 1 ms step, two channels each 10 ms: microseconds a step (peers.py)")
    folder = Path(tempfile.mkdtemp(prefix="gyrobench-bench-"))
    try:
        for name in peers.ORDER:
            build(name, bench=peers.BENCH, out=folder)
        subprocess.run(["cc", "-O2", str(HERE / "four_parts.c"), "-o", str(folder / "four_parts"), "-lm"], check=True)
        export_ssp(load_system("loop", peers.BENCH), folder / "loop.ssp", bench=peers.BENCH)
        with zipfile.ZipFile(folder / "loop.ssp") as z:
            z.extractall(folder / "loop")
        export_fmu(load_system("loop", peers.BENCH), folder / "one.fmu", bench=peers.BENCH)
        try:
            export_container(load_system("loop", peers.BENCH), folder / "loop.fmu", bench=peers.BENCH)
        except Exception as error:
            print(f"no container: {error}")
        found: dict[str, list[dict[str, float]]] = {}
        for _ in range(1 if quick else ROUNDS):
            for name in peers.PEERS:
                got = one(name, folder, quick)
                if isinstance(got, str):
                    row(name, got)
                else:
                    found.setdefault(name, []).append(got)
        base = statistics.median(g["us"] for g in found[OURS])
        for name, got in found.items():
            us = statistics.median(g["us"] for g in got)
            budget = "0.07 us" if name == OURS else ""
            row(name, f"{us:.3f} us", budget, f"{us / base:.1f} x ours; plant at 1 s: {got[-1]['at_1s']:.7f}")
            value = {
                "µs a step": f"{us:.{3 if us >= 0.1 else 2}g}",
                "ratio": f"{us / base:.{3 if us > 99 * base else 2}g}",
            }
            unit = "µs of four trivial FMUs, 1 ms step; ratio to gyrobench on FMI calls"
            QUOTED.append((f"speed.{KEYS[name]}", value, unit))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


RUN = """
import hashlib, os, sys
from pathlib import Path
from gyrobench.bench import standard_folder
from gyrobench.engine.session import Session
from gyrobench.system.system import load_system
system = load_system("tumble_single_axis", standard_folder())
with Session(system, bench=standard_folder(), engine=sys.argv[1]) as session:
    session.run({"rate": "2deg/s", "dwell": "30s"})
    began = sum(os.times()[:4])  # of this process and of its children, in which runs happen
    record = session.run()
    took = sum(os.times()[:4]) - began
    data = b"".join(c.tobytes() for table in (record.windows, record.channels) for c in table.values())
    print(took, hashlib.sha256(data).hexdigest())
"""

ONE = """
import sys, time
from fmpy import extract, read_model_description, instantiate_fmu
d = read_model_description(sys.argv[1])
fmu = instantiate_fmu(extract(sys.argv[1]), d, "CoSimulation")
done = [v.valueReference for v in d.modelVariables if v.name == "sequencer.done"]
fmu.setupExperiment(startTime=0.0)
fmu.enterInitializationMode()
fmu.exitInitializationMode()
began, k = time.process_time(), 0
while not fmu.getReal(done)[0]:
    fmu.doStep(10.0 * k, 10.0)
    k += 1
print(time.process_time() - began)
"""


def printed(program: str, *words: str) -> str:
    """Return what a Python program prints."""
    return subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True, check=True).stdout


def tumble(quick: bool) -> None:
    """The tumble, stepping alone and from command to report, against the same equations in one C loop."""
    print("\nSingle-axis tumble, full plan, 1 ms, about 20 million steps, noise on")
    folder = Path(tempfile.mkdtemp(prefix="gyrobench-bench-"))
    try:
        loop = folder / "tumble_loop"
        subprocess.run(["cc", "-O2", str(HERE / "tumble_loop.c"), "-o", str(loop), "-lm"], check=True)
        options = ["--force", "--out", str(folder / "run")]
        command = [sys.executable, "-m", "gyrobench", "run", "tumble_single_axis", *options]
        subprocess.run([*command, "--set", "rate=2deg/s", "--set", "dwell=30s"], capture_output=True, check=True)
        export = [sys.executable, "-m", "gyrobench", "export", "tumble_single_axis", "--to", "fmu"]
        subprocess.run([*export, "--out", str(folder / "one.fmu")], capture_output=True, check=True)
        whole, floor, one = [], [], []
        stepping: dict[str, list[float]] = {"native": [], "linked": []}
        digests = set()
        for _ in range(1 if quick else ROUNDS):
            floor.append(json.loads(subprocess.run([loop], capture_output=True, check=True).stdout)["seconds"])
            for engine, times in stepping.items():
                took, digest = printed(RUN, engine).split()
                times.append(float(took))
                digests.add(digest)
            one.append(float(printed(ONE, str(folder / "one.fmu"))))
            began = time.perf_counter()
            subprocess.run(command, capture_output=True, check=True)
            whole.append(time.perf_counter() - began)
        meta = json.loads((folder / "run" / "run.json").read_text())
        steps = meta["steps"]
        w, f = statistics.median(whole), min(floor)  # processor time: others only make it longer
        row("one hand-written C loop, CPU time", f"{f:.2f} s", "", f"{1e9 * f / steps:.0f} ns a step")
        unit = f"s of CPU of the tumble of {steps / 1e6:.1f} million steps; ratio to the C loop"
        QUOTED.append(("speed.tumble_c_loop", {"s of CPU": f"{f:.2f}", "over the loop": "1"}, unit))
        forms = {"linked form": stepping["linked"], "FMI calls": stepping["native"], "one FMU, FMPy": one}
        for what, took in forms.items():
            r = min(took)
            budget = "2.0 x" if what == "linked form" else ""
            row(f"the six parts, {what}, CPU time", f"{r:.2f} s", budget, f"{r / f:.2f} x the C loop")
            key = what.partition(",")[0].lower().replace(" ", "_").removesuffix("_form")
            QUOTED.append((f"speed.tumble_{key}", {"s of CPU": f"{r:.2f}", "over the loop": f"{r / f:.2f}"}, unit))
        row("records of both forms", "bit-equal" if len(digests) == 1 else "DIFFERENT", "bit-equal")
        row("command to report, wall time", f"{w:.2f} s", "4 s")
        QUOTED.append(("speed.tumble_report", f"{w:.1f}", "s from the command to the report, tumble_single_axis"))
        for slot, seconds in meta["timing"].items():
            row(f"  {slot}", f"{1e6 * seconds / steps:.3f} us", "0.06 us", "a step, in the run, timer included")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


PLATFORM = """
import os, sys, time
from gyrobench.system.loop_plan import LoopPhase, LoopPlan
from gyrobench.engine.session import Session
with Session("platform_three_axis", engine=sys.argv[1]) as s:
    type(s.system).plan = lambda self: LoopPlan([LoopPhase("hold", dwell=float(sys.argv[2]))])
    began, wall = sum(os.times()[:4]), time.perf_counter()
    record = s.run({"motion.preset": 2})
    print(sum(os.times()[:4]) - began, time.perf_counter() - wall, record.run.steps)
"""

GIMBAL = """
import os, sys, time
from gyrobench.system.loop_plan import LoopPhase, LoopPlan
from gyrobench.engine.session import Session
with Session("gimbal_stabilization", engine=sys.argv[1]) as s:
    type(s.system).plan = lambda self: LoopPlan([LoopPhase("ride", "hold", dwell=float(sys.argv[2]))])
    began, wall = sum(os.times()[:4]), time.perf_counter()
    record = s.run(step=1e-4)
    print(sum(os.times()[:4]) - began, time.perf_counter() - wall, record.run.steps)
"""


def platform(quick: bool) -> None:
    """The three-axis platform in a seaway, against the same FMUs stepped by a loop on FMPy's API in Python; the gimbal
    of two axes on a vehicle.
    """
    print("\nThree-axis platform, three gyros, T2, three loops (11 FMUs), 0.1 ms, noise on")

    def cost(engine: str, seconds: float, script: str = PLATFORM) -> tuple[float, float, float]:
        command = [sys.executable, "-c", script, engine, str(seconds)]
        found = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
        return float(found[0]), float(found[1]), float(found[2])

    cpu, wall, steps = cost("linked", 60.0 if quick else 600.0)  # the form that long runs take by themselves
    other, _, few = cost("reference", 1.0)
    ratio = f"{other / few / (cpu / steps):.0f} x slower by FMPy's API"
    row(f"{60 if quick else 600} s of platform, CPU time", f"{cpu:.1f} s", "0.5 s" if quick else "5 s")
    row("  wall time, linear models beside it", f"{wall:.1f} s", "0.5 s" if quick else "5 s")
    QUOTED.append(("speed.platform", f"{cpu:.1f}", "s of CPU, 600 s of platform_three_axis at 0.1 ms, linked form"))
    row("  a step, CPU time", f"{1e6 * cpu / steps:.2f} us", "", ratio)
    cpu, wall, steps = cost("linked", 60.0 if quick else 600.0, GIMBAL)
    row(f"{60 if quick else 600} s of gimbal, 9 FMUs, CPU time", f"{cpu:.1f} s", "0.5 s" if quick else "5 s")
    row("  wall time, linear models beside it", f"{wall:.1f} s", "0.5 s" if quick else "5 s")
    QUOTED.append(("speed.gimbal", f"{cpu:.1f}", "s of CPU, 600 s of gimbal_stabilization at 0.1 ms, linked form"))
    row("  a step, CPU time", f"{1e6 * cpu / steps:.2f} us", "")


def builds() -> None:
    """Cold and warm build of all native FMUs, and the light commands."""
    print("\nBuild and commands")
    cache = tempfile.mkdtemp(prefix="gyrobench-bench-")
    env = {**os.environ, "GYROBENCH_CACHE": cache}
    try:
        for what, budget in (("cold build of all native FMUs", "20 s"), ("warm build", "0.5 s")):
            began = time.perf_counter()
            command = [sys.executable, "-m", "gyrobench", "build", "--all", "--out", cache]
            subprocess.run(command, capture_output=True, check=True, env=env)
            took = time.perf_counter() - began
            row(what, f"{took:.2f} s", budget)
            if what.startswith("cold"):
                QUOTED.append(("build.cold", f"{took:.1f}", "s, all native FMUs without a cache, two cores"))
                QUOTED.append(("build.parts", str(len(list(Path(cache).glob("*.fmu")))), "parts built"))
        for command in (["list"], ["--help"]):
            times = []
            for _ in range(5):
                began = time.perf_counter()
                subprocess.run([sys.executable, "-m", "gyrobench", *command], capture_output=True, check=True)
                times.append(time.perf_counter() - began)
            row(f"gyrobench {command[0]}", f"{statistics.median(times):.2f} s", "0.2 s")
            if command == ["list"]:
                QUOTED.append(("speed.list", f"{statistics.median(times):.2f}", "s, gyrobench list"))
    finally:
        shutil.rmtree(cache, ignore_errors=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="one round, a tenth of the steps")
    parser.add_argument("--write", action="store_true", help="write the figures that the pages quote")
    given = parser.parse_args()
    quick = given.quick
    if quick and given.write:
        parser.error("--write needs a whole measurement, without --quick")
    packages = ("gyrobench", "fmpy", "fmu-manipulation-toolbox", "ecospy", "libcosimpy")
    found = {d.metadata["Name"].lower().replace("_", "-"): d.version for d in importlib.metadata.distributions()}
    print(", ".join(f"{p} {found.get(p, '-')}" for p in packages), f"on {os.cpu_count()} cores")
    masters(quick)
    tumble(quick)
    platform(quick)
    builds()
    for key, value, unit in QUOTED if given.write else ():
        quoted.record(key, value, unit, "tests/benchmarks/run.py")


if __name__ == "__main__":
    main()
