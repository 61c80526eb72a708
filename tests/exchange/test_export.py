"""Exported systems in other tools: the same windows, up to the delays of a parallel coupling."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from exported import record_from_series
from fmpy import read_model_description
from masters import apart

from gyrobench.engine.session import Session, run
from gyrobench.exchange.container import export_container
from gyrobench.exchange.ssp_export import export_ssp
from gyrobench.exchange.ssp_import import read_ssp
from gyrobench.record.record import Record
from gyrobench.system.system import InvalidConfigurationError, System

Foreign = Callable[[str], Path]
FOREIGN = Path(__file__).parents[1] / "foreign"
QUICK = {
    "dwell": 0.2,
    "turns": 0.02,
    "table.index_rate": 1.0,
    "gyro.white": 0.0,
    "gyro.markov": 0.0,
    "gyro.pickoff": 0.0,
    "rebalance.meter": 0.0,
}
END = 4.0  # s, after the end of the plan
MAPPED = {"gyro": FOREIGN / "vendor_gyro.toml"}


def names(system: System) -> list[str]:
    assert system.windows is not None
    return [system.windows.watch, *system.windows.columns.values()]


def close(a: Record, b: Record, samples: int) -> None:
    """Equal windows, later by at most ``samples`` steps."""
    assert a.windows["phase"].tolist() == b.windows["phase"].tolist()
    assert a.windows["n"].tolist() == b.windows["n"].tolist()
    np.testing.assert_allclose(a.windows["t_end"], b.windows["t_end"], atol=samples * 1.001e-3)
    np.testing.assert_allclose(a.windows["angle_end"], b.windows["angle_end"], atol=1e-3)
    np.testing.assert_allclose(a.windows["mean"], b.windows["mean"], rtol=2e-3, atol=1e-6)


@pytest.fixture
def archive(small: System, tmp_path: Path) -> Path:
    path = tmp_path / "small.ssp"
    assert export_ssp(small, path, values=QUICK) == []
    return path


@pytest.mark.long
def test_ssp_is_valid_and_reproducible(small: System, archive: Path, tmp_path: Path) -> None:
    from fmpy.ssp.ssd import read_ssd, read_ssv

    ssd = read_ssd(str(archive))  # validates against the SSP 1.0 schema
    assert [e.name for e in ssd.system.elements] == ["site", "sequencer", "table", "gyro", "rebalance", "sampler"]
    values = {p.name: float(p.value) for p in read_ssv(str(archive), "resources/parameters.ssv").parameters}
    assert values["site.latitude"] == pytest.approx(np.radians(45.75), rel=1e-15)
    assert values["sequencer.modes[2]"] == 2
    # start values of inputs: what the outputs give after initialization
    assert values["table.face[1,1]"] == 1.0
    assert values["gyro.f[3]"] == pytest.approx(9.8067, abs=1e-3)  # the output z of the table is up, 45.75 deg
    assert {"rad/s", "m/s2", "V", "A"} <= {u.name for u in ssd.units}
    export_ssp(small, tmp_path / "again.ssp", values=QUICK)
    assert (tmp_path / "again.ssp").read_bytes() == archive.read_bytes()
    with zipfile.ZipFile(archive) as z:
        text = z.read("SystemStructure.ssd").decode()
        names = {ET.fromstring(z.read(n)).get("name") for n in z.namelist() if n.endswith(".ssv")}
        z.extractall(tmp_path, ["resources/gyro.fmu", "resources/sampler.fmu"])
    assert '<oms:SimulationInformation name="solver1" method="oms_ma" fixedStepSize="0.001" />' in text
    assert names == {"smalltumble"}  # one name of all sets, which some importers look for
    sampler = text[text.index('<ssd:Component name="sampler"') :]
    x = sampler[sampler.index('<ssd:Connector name="x"') :]
    assert x[: x.index("</ssd:Connector>")].count("unit=") == 0  # any unit: others refuse "A" into "1"
    fmu = read_model_description(str(tmp_path / "resources" / "gyro.fmu"))
    assert float(fmu.defaultExperiment.stepSize) == 1e-3
    units = {v.name: v.unit for v in fmu.modelVariables}
    assert (units["omega[1]"], units["u"], units["k"]) == ("rad/s", "V", "rad/s/A")
    fmu = read_model_description(str(tmp_path / "resources" / "sampler.fmu"))  # its own unit would be "1"
    assert {v.unit for v in fmu.modelVariables if v.name in ("x", "mean")} == {None}


@pytest.mark.long
def test_ssp_reads_back(small: System, archive: Path, foreign: Foreign, tmp_path: Path) -> None:
    # the archive names no windows and no done output, so it runs to its stop time; the channels are comparable
    system = read_ssp(archive, step=1e-3)
    ours, theirs = run(small, values=QUICK), run(system)
    assert theirs.run.order == ours.run.order
    assert theirs.run.delays.keys() >= {"rebalance.i -> gyro.i"}
    assert theirs.channels["gyro.u"][0] == ours.channels["gyro.u"][0]
    steps = [np.rint(r.channels["time"] / 1e-3).astype(int) for r in (theirs, ours)]
    common, i, j = np.intersect1d(*steps, return_indices=True)
    assert len(common) > 1  # every 1.81 s: a row of the archive each 181 steps, of the system each 10
    np.testing.assert_array_equal(theirs.channels["gyro.u"][i], ours.channels["gyro.u"][j])
    # factors survive the way out and back
    parts = {"gyro": foreign("vendor_gyro")}
    export_ssp(small, tmp_path / "v.ssp", parts=parts, maps=MAPPED, values={"dwell": 0.2})
    with Session(small, parts, MAPPED) as a, Session(read_ssp(tmp_path / "v.ssp", 1e-3)) as b:
        gains = [{(c.source, c.output.variable, c.target, c.input.variable): c.gain for c in s.assembly.connections}
                 for s in (a, b)]  # fmt: skip
        assert gains[0] == pytest.approx(gains[1], rel=1e-15)


def test_ssp_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "bad.ssp").write_text("no archive")
    with pytest.raises(InvalidConfigurationError, match=r"bad\.ssp refuses to run:\n  - not an SSP archive"):
        read_ssp(tmp_path / "bad.ssp", 1e-3)


@pytest.mark.long
def test_ssp_in_fmpy(small: System, archive: Path) -> None:
    from fmpy.ssp.simulation import simulate_ssp
    from fmpy.ssp.ssd import read_ssv

    values = read_ssv(str(archive), "resources/parameters.ssv")
    found = simulate_ssp(str(archive), stop_time=END, step_size=1e-3, parameter_set=values)
    close(run(small, values=QUICK), record_from_series(small, {n: found[n] for n in names(small)}), 5)


@pytest.mark.long
def test_ssp_in_libcosim(small: System, archive: Path, tmp_path: Path) -> None:
    pytest.importorskip("libcosimpy")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.WARNING)
    zipfile.ZipFile(archive).extractall(tmp_path / "open")
    execution = CosimExecution.from_ssp_file(str(tmp_path / "open"), 1_000_000)  # ns
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    slave = execution.slave_index_from_instance_name("sampler")
    references = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}
    wanted = [references[n.partition(".")[2]] for n in names(small)]
    rows: list[Any] = []
    for _ in range(round(END / 1e-3)):
        execution.step()
        rows.append(observer.last_real_values(slave, wanted))
    series = dict(zip(names(small), np.array(rows).T, strict=True))
    close(run(small, values=QUICK), record_from_series(small, series), 5)


@pytest.mark.long
def test_container_is_bit_equal(small: System, tmp_path: Path) -> None:
    pytest.importorskip("fmu_manipulation_toolbox")
    from fmpy.validation import validate_fmu

    path = tmp_path / "small.fmu"
    noisy = dict(list(QUICK.items())[:3])
    export_container(small, path, values=noisy, seed=9)
    assert validate_fmu(str(path)) == []
    found, _ = apart(path, stop_time=END, step_size=1e-3, output_interval=1e-3, output=[*names(small), "gyro.u"])
    record = record_from_series(small, {n: found[n] for n in names(small)})
    assert record.windows.keys() == run(small, values=noisy, seed=9).windows.keys()
    for name, column in run(small, values=noisy, seed=9).windows.items():
        np.testing.assert_array_equal(record.windows[name], column, err_msg=name)


def test_series_that_are_missing(small: System) -> None:
    with pytest.raises(KeyError, match=r"sampler\.mean"):
        record_from_series(small, {"sampler.count": np.zeros(3)})
