"""The tumble test exported to other tools, on a shortened plan: the coefficients agree within the coupling error.

A container runs our order: equal bit for bit.  libcosim and FMPy couple all parts in parallel, so that the signal
reaches the sampler some steps after the angle; that error is of first order in the step.  With c(h) the coefficient
from libcosim at step h, it is 2 (c(h) - c(h/2)) + O(h^2); ours must lie there.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported import record_from_series
from masters import apart

import gyrobench as gb
from gyrobench.engine.session import run
from gyrobench.exchange.container import export_container
from gyrobench.exchange.ssp_export import export_ssp
from gyrobench.system.system import System, load_system

VALUES = {
    "rate": "6000 ERU",
    "dwell": 3.0,
    "settle": 0.8,
    "windows": 12,
    "table.acceleration": 0.4,  # rad/s2: as little time as possible goes by between the phases
    **{f"gyro.{n}": 0.0 for n in ("turn_on", "markov", "white", "pickoff")},
    "rebalance.meter": 0.0,
    "rebalance.resolution": 0.0,
}
STEP = 2e-3


@pytest.fixture(scope="module")
def system() -> System:
    return load_system("tumble_single_axis")


@pytest.fixture(scope="module")
def ours(system: System) -> dict[str, Any]:
    record = run(system, values=VALUES)
    return {"run": record.run, "coefficients": estimates(system, record), "end": record.run.stopped_at + 0.5}


@pytest.fixture(scope="module")
def archive(system: System, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("export") / "tumble.ssp"
    export_ssp(system, path, values=VALUES)
    return path


def estimates(system: System, record: Any) -> dict[str, float]:
    return {c.name: c.estimate for c in system.reduce(record).coefficients}


def names(system: System) -> list[str]:
    assert system.windows is not None
    return [system.windows.watch, *system.windows.columns.values()]


def libcosim(system: System, archive: Path, folder: Path, ours: dict[str, Any], step: float) -> dict[str, float]:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.WARNING)
    zipfile.ZipFile(archive).extractall(folder)
    execution = CosimExecution.from_ssp_file(str(folder), round(step * 1e9))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    slave = execution.slave_index_from_instance_name("sampler")
    references = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}
    wanted = [references[n.partition(".")[2]] for n in names(system)]
    rows = []
    for _ in range(round(ours["end"] / step)):
        execution.step()
        rows.append(observer.last_real_values(slave, wanted))
    series = dict(zip(names(system), np.array(rows).T, strict=True))
    return estimates(system, record_from_series(system, series, ours["run"].replace(step=step)))


@pytest.mark.long
def test_libcosim_and_fmpy(system: System, archive: Path, tmp_path: Path, ours: dict[str, Any]) -> None:
    pytest.importorskip("libcosimpy")
    from fmpy.ssp.simulation import simulate_ssp
    from fmpy.ssp.ssd import read_ssv

    double, single = (libcosim(system, archive, tmp_path / str(h), ours, h) for h in (2 * STEP, STEP))
    values = read_ssv(str(archive), "resources/parameters.ssv")
    found = simulate_ssp(str(archive), stop_time=ours["end"], step_size=2 * STEP, parameter_set=values)
    series = {n: found[n] for n in names(system)}
    record = record_from_series(system, series, ours["run"].replace(step=2 * STEP))
    fmpy = estimates(system, record)
    reduced = gb.load("tumble_single_axis", VALUES).reduce_result(found)  # by the names of the array
    assert {c.name: c.estimate for c in reduced.result.coefficients} == fmpy
    assert reduced.record.run.step == 2 * STEP and "0.004 s" in reduced.record.run.notes[-1]
    assert len(ours["coefficients"]) == 9
    for name, c in ours["coefficients"].items():
        coupling = 2.0 * (double[name] - single[name])  # of the double step
        assert abs(double[name] - coupling - c) < 0.05 * abs(coupling) + 2e-5, name  # deg/h
        assert abs(single[name] - c) < 1.0 * STEP, name  # deg/h a s; 600 times the rate of the test: 0.44 rad/s
        assert abs(fmpy[name] - double[name]) < 1e-7, name


@pytest.mark.long
def test_container(system: System, tmp_path: Path, ours: dict[str, Any]) -> None:
    pytest.importorskip("fmu_manipulation_toolbox")

    path = tmp_path / "tumble.fmu"
    export_container(system, path, values=VALUES)
    found, _ = apart(path, stop_time=ours["end"], step_size=STEP, output_interval=STEP, output=names(system))
    record = record_from_series(system, {n: found[n] for n in names(system)}, ours["run"])
    assert estimates(system, record) == ours["coefficients"]
