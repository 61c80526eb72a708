"""north_finder exported: a container FMU in FMPy and the SSP in libcosim find the heading of the bench's own run."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported import record_from_series

from gyrobench.engine.session import run
from gyrobench.exchange.container import export_container
from gyrobench.exchange.ssp_export import export_ssp
from gyrobench.record.record import Record
from gyrobench.system.system import System, load_system

HEADING = math.radians(100.0)
VALUES = {"time": 14.0, "heading": HEADING, "windows": 8}
QUIET = {f"gyro.{n}_{a}": 0.0 for n in ("white", "markov", "turn_on") for a in "xy"} | {
    f"accelerometers.white_{a}": 0.0 for a in "xyz"
}
SHOWN = ("finder.heading", "finder.sigma", "finder.status")
STEP = 1e-3


def loaded(noise: bool) -> tuple[System, dict[str, Any], Record]:
    system = load_system("north_finder")
    values = VALUES if noise else VALUES | QUIET
    return system, values, run(system, values=values, seed=5)


def names(system: System) -> list[str]:
    assert system.windows is not None
    return [system.windows.watch, *system.windows.columns.values()]


@pytest.mark.long
def test_container_in_fmpy_is_the_run_of_the_bench(tmp_path: Path) -> None:
    """With all noise: windows, what the finder says and the heading of the reduction, bit for bit."""
    pytest.importorskip("fmu_manipulation_toolbox")
    from fmpy import simulate_fmu

    system, values, ours = loaded(noise=True)
    path = tmp_path / "north.fmu"
    export_container(system, path, values=values, seed=5)
    end = float(ours.run.stopped_at or 0.0)
    wanted = [*names(system), *SHOWN]
    found = simulate_fmu(str(path), stop_time=end + 0.1, step_size=STEP, output_interval=STEP, output=wanted)
    record = record_from_series(system, {n: found[n] for n in names(system)}, ours.run)
    for name, column in ours.windows.items():
        assert np.array_equal(record.windows[name], column), name
    for name in SHOWN:
        assert found[name][-1] == ours.channels[name][-1], name
    assert system.reduce(record)["ψ"].estimate == system.reduce(ours)["ψ"].estimate
    assert abs(found["finder.heading"][-1] - HEADING) < 6.0 * found["finder.sigma"][-1]


@pytest.mark.long
def test_ssp_in_libcosim_finds_the_same_heading(tmp_path: Path) -> None:
    """Without noise.  libcosim couples all parts in parallel, a step late: at rest that changes nothing."""
    pytest.importorskip("libcosimpy")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    system, values, ours = loaded(noise=False)
    export_ssp(system, tmp_path / "north.ssp", values=values, seed=5)
    zipfile.ZipFile(tmp_path / "north.ssp").extractall(tmp_path / "north")
    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_ssp_file(str(tmp_path / "north"), round(STEP * 1e9))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    finder = execution.slave_index_from_instance_name("finder")
    references = {v.name.decode(): v.reference for v in execution.slave_variables(finder)}
    execution.step(step_count=round((float(ours.run.stopped_at or 0.0) + 0.1) / STEP))
    heading, done = observer.last_real_values(finder, [references["heading"], references["done"]])
    assert done == 1.0
    assert heading == pytest.approx(ours.channels["finder.heading"][-1], abs=1e-7)
    assert heading == pytest.approx(HEADING, abs=1e-6)
