"""Masters that run the loop of four trivial parts: ours and its peers, one a process.

    python tests/benchmarks/peers.py NAME FOLDER STEPS

FOLDER holds loop.ssp, loop.fmu (container), one.fmu (linked), the four FMUs and four_parts (the loop in C).  Prints
{"us": microseconds of processor time a step, "at_1s": plant position at t = 1 s}; of masters with threads, which wait
for one another on a machine with idle cores, wall time where that is less.  Only the stepping is timed; every master
reads two channels each 10 ms.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

H = 1e-3
EVERY = 10
AT_1S = 99  # the row of t = 1 s
BENCH = Path(__file__).parent / "bench"
WIRES = (
    ("controller", "u", "actuator", "u"),
    ("actuator", "force", "plant", "force"),
    ("plant", "position", "sensor", "x"),
    ("sensor", "y", "controller", "y"),
)
ORDER = ("actuator", "plant", "sensor", "controller")


def ours(folder: Path, steps: int, engine: str = "native") -> tuple[float, float]:
    from gyrobench.engine.session import Session
    from gyrobench.system.system import load_system

    with Session(load_system("loop", BENCH), bench=BENCH, engine=engine) as session:
        session.run({"duration": 1.0})
        t = time.process_time()
        record = session.run({"duration": steps * H})
        return time.process_time() - t, float(record.channels["plant.position"][AT_1S + 1])


def linked(folder: Path, steps: int) -> tuple[float, float]:
    return ours(folder, steps, "linked")


def by_hand(folder: Path, steps: int) -> tuple[float, float]:
    """The same equations in one C loop: four_parts.c."""
    done = subprocess.run([folder / "four_parts", str(steps)], capture_output=True, check=True)
    found = json.loads(done.stdout)
    return 1e-6 * found["us"] * steps, found["at_1s"]


def reference(folder: Path, steps: int) -> tuple[float, float]:
    return ours(folder, steps, "reference")


def fmpy_loop(folder: Path, steps: int) -> tuple[float, float]:
    """The loop as FMPy's documentation writes it: setReal, doStep, getReal with Python lists."""
    import fmpy

    fmus, vrs = {}, {}
    for name in ORDER:
        description = fmpy.read_model_description(str(folder / f"{name}.fmu"))
        unzipped = fmpy.extract(str(folder / f"{name}.fmu"))
        fmus[name] = fmpy.instantiate_fmu(unzipped, description, "CoSimulation")
        vrs[name] = {v.name: v.valueReference for v in description.modelVariables}
        fmus[name].setupExperiment(startTime=0.0)
        fmus[name].enterInitializationMode()
        fmus[name].exitInitializationMode()
    source = {b: (fmus[a], [vrs[a][x]], [vrs[b][y]]) for a, x, b, y in WIRES}
    rows = []
    t = time.process_time()
    for k in range(steps):
        for name in ORDER:
            fmu, out, into = source[name]
            fmus[name].setReal(into, fmu.getReal(out))
            fmus[name].doStep(k * H, H)
        if (k + 1) % EVERY == 0:
            rows.append(
                (
                    k * H,
                    fmus["plant"].getReal([vrs["plant"]["position"]]),
                    fmus["controller"].getReal([vrs["controller"]["u"]]),
                )
            )
    return time.process_time() - t, float(rows[AT_1S][1][0])


def fmpy_ssp(folder: Path, steps: int) -> tuple[float, float]:
    from fmpy.ssp.simulation import simulate_ssp

    t = time.process_time()
    result = simulate_ssp(str(folder / "loop.ssp"), stop_time=steps * H, step_size=H)
    seconds = time.process_time() - t
    name = next(n for n in result.dtype.names if n.endswith("position"))
    row = min(1000, len(result) - 1)  # it records t = 0 too
    return seconds, float(result[name][row])


def one_fmu(folder: Path, steps: int) -> tuple[float, float]:
    return container(folder, steps, "one.fmu")


def container(folder: Path, steps: int, name: str = "loop.fmu") -> tuple[float, float]:
    """One FMU in FMPy, of the toolbox around the four or the linked one, stepped 10 ms at a time and read each time."""
    import fmpy

    path = str(folder / name)
    description = fmpy.read_model_description(path)
    fmu = fmpy.instantiate_fmu(fmpy.extract(path), description, "CoSimulation")
    vr = {v.name: v.valueReference for v in description.modelVariables}
    names = [next(n for n in vr if n.endswith(s)) for s in ("plant.position", "controller.u")]
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    rows = []
    t = time.process_time()
    for k in range(0, steps, EVERY):
        fmu.doStep(k * H, EVERY * H)
        rows.append(fmu.getReal([vr[n] for n in names]))
    return time.process_time() - t, float(rows[AT_1S][0])


def clocks() -> tuple[float, float]:
    return time.process_time(), time.perf_counter()


def since(then: tuple[float, float]) -> float:
    """Return the less of processor time, of all threads, and wall time."""
    return min(now - was for now, was in zip(clocks(), then, strict=True))


def ecospy(folder: Path, steps: int) -> tuple[float, float]:
    from ecospy import EcosSimulation

    with EcosSimulation(ssp_path=str(folder / "loop.ssp"), step_size=H) as sim:
        sim.init()
        rows = []
        t = clocks()
        for _ in range(0, steps, EVERY):
            sim.step(EVERY)
            rows.append((sim.get_real("plant::position"), sim.get_real("controller::u")))
        seconds = since(t)
        sim.terminate()
    return seconds, float(rows[AT_1S][0])


def libcosimpy(folder: Path, steps: int) -> tuple[float, float]:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.WARNING)
    unpacked = folder / "loop"
    execution = CosimExecution.from_ssp_file(str(unpacked), int(H * 1e9))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    index = execution.slave_index_from_instance_name("plant")
    reference = next(v.reference for v in execution.slave_variables(index) if v.name == b"position")
    other = execution.slave_index_from_instance_name("controller")
    command = next(v.reference for v in execution.slave_variables(other) if v.name == b"u")
    rows = []
    t = clocks()
    for _ in range(0, steps, EVERY):
        execution.step(EVERY)
        rows.append((observer.last_real_values(index, [reference])[0], observer.last_real_values(other, [command])[0]))
    return since(t), float(rows[AT_1S][0])


PEERS = {
    "one hand-written C loop": by_hand,
    "gyrobench, native engine on FMI calls": ours,
    "gyrobench, native engine, linked form": linked,
    "gyrobench, one FMU in FMPy": one_fmu,
    "gyrobench, reference engine": reference,
    "FMPy, loop of its API": fmpy_loop,
    "FMPy, simulate_ssp": fmpy_ssp,
    "toolbox container, sequential": container,
    "ecospy": ecospy,
    "libcosimpy": libcosimpy,
}

if __name__ == "__main__":
    name, folder, steps = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
    seconds, end = PEERS[name](folder, steps)
    print(json.dumps({"us": 1e6 * seconds / steps, "at_1s": end}), flush=True)
