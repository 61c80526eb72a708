"""Exported systems in other tools, one run a process:  python tests/masters.py TOOL FILE JOB OUT

JOB is a JSON file: {"names": {name: [component, variable]}, "step": s, "steps": n, "every": k}; OUT gets an array for
each name, a row each k steps from t = 0 (or from k steps on, where a tool has no outputs at t = 0), the first row's
number of steps as "first", and the seconds of the stepping as "seconds".
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
Names = Mapping[str, tuple[str, str]]
Series = tuple[dict[str, Array], int, float]  # columns, steps before the first row, seconds


class PeerError(Exception):
    """A tool did not come to an end; the text is its last words."""


def fmpy_ssp(file: Path, names: Names, step: float, steps: int, every: int) -> Series:
    """FMPy's simulate_ssp: all FMUs in parallel, inputs 0 in the first step."""
    from fmpy.ssp.simulation import simulate_ssp
    from fmpy.ssp.ssd import read_ssv

    values = read_ssv(str(file), "resources/parameters.ssv")
    began = time.perf_counter()
    found = simulate_ssp(str(file), stop_time=(steps - 0.5) * step, step_size=step, parameter_set=values)
    seconds = time.perf_counter() - began
    return {n: found[f"{c}.{v}"][every - 1 :: every] for n, (c, v) in names.items()}, every, seconds


def libcosimpy(file: Path, names: Names, step: float, steps: int, every: int) -> Series:
    """libcosim's fixed-step algorithm: all FMUs in parallel."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.WARNING)
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(file).extractall(folder)
        execution = CosimExecution.from_ssp_file(folder, round(step * 1e9))
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer)
        of: dict[int, tuple[list[str], list[int]]] = {}
        for name, (component, variable) in names.items():
            slave = execution.slave_index_from_instance_name(component)
            references = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}
            there = of.setdefault(slave, ([], []))
            there[0].append(name)
            there[1].append(references[variable])
        rows: dict[int, list[Any]] = {slave: [] for slave in of}
        began = time.perf_counter()
        for _ in range(steps // every):
            if not execution.step(every):
                raise PeerError("libcosim: a step failed")
            for slave, (_, wanted) in of.items():
                rows[slave].append(observer.last_real_values(slave, wanted))
        seconds = time.perf_counter() - began
    found: dict[str, Array] = {}
    for slave, (columns, _) in of.items():
        found |= dict(zip(columns, np.array(rows[slave]).T, strict=True))
    return found, every, seconds


def ecospy(file: Path, names: Names, step: float, steps: int, every: int) -> Series:
    """ecos: all FMUs in parallel; the set of parameters by its name."""
    from ecospy import EcosSimulation

    with zipfile.ZipFile(file) as z:
        set_name = z.read("resources/parameters.ssv").decode().partition(' name="')[2].partition('"')[0]
    places = [f"{c}::{v}" for c, v in names.values()]
    with EcosSimulation(ssp_path=str(file), step_size=step) as sim:
        sim.init(parameter_set=set_name)
        rows = [[sim.get_real(p) for p in places]]
        began = time.perf_counter()
        for _ in range(steps // every):
            sim.step(every)
            rows.append([sim.get_real(p) for p in places])
        seconds = time.perf_counter() - began
        sim.terminate()
    return dict(zip(names, np.array(rows).T, strict=True)), 0, seconds


#: what the library of fmu-manipulation-toolbox logs as an error of every container
NO_ERROR = "Solver configure...."


def logged(run: Callable[..., Any], *args: Any, **options: Any) -> tuple[Any, list[str]]:
    """Return what a function of FMPy gives, and the errors that the FMU logs."""
    errors: list[str] = []

    def logger(_environment: Any, _name: Any, status: int, _category: Any, message: bytes) -> None:
        text = (message or b"").decode(errors="replace")
        if status > 1 and text != NO_ERROR:
            errors.append(text)

    return run(*args, **options, logger=logger), errors


def apart(file: Path, **options: Any) -> tuple[Any, list[str]]:
    """Return what FMPy gives of a container, and the errors that it logs, from a process of its own.

    A container is a foreign library that loads others; where it crashes it would take the tests' process with it.
    """
    from fmpy import simulate_fmu

    with ProcessPoolExecutor(1, get_context("spawn")) as process:
        return process.submit(logged, simulate_fmu, str(file), **options).result()


def one_fmu(file: Path, names: Names, step: float, steps: int, every: int) -> Series:
    """One FMU in FMPy, a container or the linked one, with the outputs that it gives by itself.

    ``every`` steps of the system are one communication step.
    """
    from fmpy import simulate_fmu

    interval = every * step
    began = time.perf_counter()
    found, errors = logged(simulate_fmu, str(file), stop_time=steps * step, output_interval=interval)
    if errors or (missing := [n for n in names if n not in found.dtype.names]):
        raise PeerError(f"logged as errors: {errors}" if errors else f"no outputs: {missing}")
    return {n: found[n] for n in names}, 0, time.perf_counter() - began


TOOLS = {"FMPy simulate_ssp": fmpy_ssp, "libcosimpy": libcosimpy, "ecospy": ecospy, "FMU in FMPy": one_fmu}


def run_in(
    tool: str, file: Path, names: Names, step: float, steps: int, every: int = 1, timeout: float = 600.0
) -> Series:
    """Run an exported system in a process of its own.  Raises PeerError."""
    with tempfile.TemporaryDirectory() as name:
        job, out = Path(name) / "job.json", Path(name) / "out.npz"
        job.write_text(json.dumps({"names": dict(names), "step": step, "steps": steps, "every": every}))
        libraries = [str(Path(sys.prefix) / "lib"), *filter(None, [os.environ.get("LD_LIBRARY_PATH", "")])]
        environment = {**os.environ, "LD_LIBRARY_PATH": os.pathsep.join(libraries)}  # of ecospy: libtbb is there
        command = [sys.executable, __file__, tool, str(file), str(job), str(out)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=timeout, env=environment, cwd=name)
        except subprocess.TimeoutExpired:
            raise PeerError(f"not at its end after {timeout:g} s") from None
        if not out.is_file():
            lines = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
            told = [line for line in lines if "[ERROR]" in line][:1] + lines[-1:]  # of an FMU, of the tool
            raise PeerError(" / ".join(told)[-400:] or f"exit code {done.returncode}")
        with np.load(out) as found:
            columns = {n: found[n] for n in names}
            return columns, int(found["first"]), float(found["seconds"])


if __name__ == "__main__":
    given = json.loads(Path(sys.argv[3]).read_text())
    given["names"] = {n: tuple(v) for n, v in given["names"].items()}
    columns, first, seconds = TOOLS[sys.argv[1]](Path(sys.argv[2]), **given)
    np.savez(sys.argv[4], first=first, seconds=seconds, **columns)
