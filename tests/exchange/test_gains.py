"""Factors and offsets of wires in exports: small FMUs that other tools apply, and that become factors again here."""

from __future__ import annotations

import math
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from exported import record_from_series
from fmpy import read_model_description
from masters import apart

from gyrobench.engine.session import run
from gyrobench.exchange.container import export_container
from gyrobench.exchange.external_record import find_series
from gyrobench.exchange.result_files import ResultFile
from gyrobench.exchange.ssp_export import ExportError, export_ssp
from gyrobench.exchange.ssp_import import read_ssp
from gyrobench.system.binding import Bound
from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.system import Slot, System, load_system

Foreign = Callable[[str], Path]
FOREIGN = Path(__file__).parents[1] / "foreign"
VENDOR = {"gyro": FOREIGN / "vendor_gyro.toml"}
LAG = Socket("Lag", "a lag", (inp("u", "1", "in", whole=False), out("y", "1", "out")))
WIRE = "a.y -> b.u"


class Pair(System):
    """a -> b with y' = (u - y) / T each: b gets 2.5 a.y - 3."""

    title = "pair"
    slots: ClassVar = {n: Slot(LAG, "lag") for n in "ab"}
    open: ClassVar = ("a.u",)
    wires = WIRE
    factors: ClassVar = {WIRE: 2.5}
    offsets: ClassVar = {WIRE: -3.0}
    step = 0.02
    stop = 1.0
    channels = ("a.y", "b.y")
    channel_period = 0.02


@pytest.fixture
def parts(foreign: Foreign) -> dict[str, Path]:
    return {n: foreign("lag") for n in "ab"}


@pytest.fixture
def archive(parts: dict[str, Path], tmp_path: Path) -> Path:
    assert export_ssp(Pair(), tmp_path / "pair.ssp", parts, values={"a.y0": 20.0}) == []
    return tmp_path / "pair.ssp"


def by_hand(late: int) -> list[float]:
    """b.y after each step, if it gets what a had ``late`` steps before; until then 0, as FMPy begins."""
    e = -math.expm1(-0.02 / 0.1)
    a, b, values = [20.0], 0.0, []
    for k in range(50):
        a.append(a[-1] * (1.0 - e))
        source = k + 1 - late
        u = 2.5 * a[source] - 3.0 if source > 0 else (-3.0 if late == 2 and source == 0 else 0.0)
        b += (u - b) * e
        values.append(b)
    return values


@pytest.mark.long
def test_fmpy_applies_the_factor_a_step_later(archive: Path) -> None:
    """In parallel coupling the gain takes one step, the wire to it another; its input is 0 in the first one."""
    from fmpy.ssp.simulation import simulate_ssp
    from fmpy.ssp.ssd import read_ssv

    values = read_ssv(str(archive), "resources/parameters.ssv")
    found = simulate_ssp(str(archive), stop_time=0.99, step_size=0.02, parameter_set=values)
    np.testing.assert_allclose(found["b.y"], by_hand(late=2), rtol=1e-12)


def test_container_is_bit_equal(parts: dict[str, Path], tmp_path: Path) -> None:
    pytest.importorskip("fmu_manipulation_toolbox")
    export_container(Pair(), tmp_path / "pair.fmu", parts, values={"a.y0": 20.0})
    own = run(Pair(), parts, values={"a.y0": 20.0}).channels
    np.testing.assert_allclose(own["b.y"][1:], by_hand(late=0), rtol=1e-12)
    found, _ = apart(tmp_path / "pair.fmu", stop_time=1.0, step_size=0.02, output_interval=0.02, output=["b.y"])
    np.testing.assert_array_equal(found["b.y"][1:], own["b.y"][1:])


@pytest.mark.long
def test_gains_become_factors_again(archive: Path, parts: dict[str, Path], tmp_path: Path) -> None:
    own = run(Pair(), parts, values={"a.y0": 20.0}).channels
    system = read_ssp(archive)
    assert (list(system.slots), system.step) == (["a", "b"], 0.02)
    assert (system.factors, system.offsets) == ({WIRE: 2.5}, {WIRE: -3.0})

    def changed(name: str, pattern: str, new: str) -> System:
        with zipfile.ZipFile(archive) as z:
            entries = {n: z.read(n) for n in z.namelist()}
        text = re.sub(pattern, new, entries[name].decode(), flags=re.S)
        assert text != entries[name].decode()
        with zipfile.ZipFile(tmp_path / "changed.ssp", "w") as z:
            for n, data in (entries | {name: text.encode()}).items():
                z.writestr(n, data)
        return read_ssp(tmp_path / "changed.ssp")

    other = changed("resources/gain_01.ssv", r'(name="factor">\s*<ssv:Real value=")[^"]*', r"\g<1>7.0")
    assert (other.factors, other.offsets) == ({WIRE: 7.0}, {WIRE: -3.0})  # the archive's own values count
    plain = changed("SystemStructure.ssd", r"<gyrobench:Gains [^>]*>", "")  # another tool has dropped the annotation
    assert list(plain.slots) == ["a", "gain_01", "b"] and not plain.factors
    for s in (system, plain):
        type(s).channels, type(s).channel_period, s.stop = ("a.y", "b.y"), 0.02, 1.0
        found = run(s).channels
        for name, column in own.items():
            np.testing.assert_array_equal(found[name], column, err_msg=name)


def test_the_gain_is_an_fmu_as_all(archive: Path, tmp_path: Path) -> None:
    from fmpy.ssp.ssd import read_ssv
    from fmpy.validation import validate_fmu

    values = {p.name: float(p.value) for p in read_ssv(str(archive), "resources/parameters.ssv").parameters}
    assert {n: v for n, v in values.items() if n.startswith("gain")} == {
        "gain_01.factor": 2.5, "gain_01.offset": -3.0, "gain_01.u": 20.0,
    }  # fmt: skip
    assert values["b.u"] == 47.0
    with zipfile.ZipFile(archive) as z:
        text = z.read("SystemStructure.ssd").decode()
        file = Path(z.extract("resources/gain_01.fmu", tmp_path))
    assert "LinearTransformation" not in text
    assert text.count('suppressUnitConversion="true"') == 2
    assert validate_fmu(str(file)) == []
    description = read_model_description(str(file))
    assert [(u.variable.name, [d.name for d in u.dependencies]) for u in description.outputs] == [("y", ["u"])]
    assert (description.defaultExperiment.stepSize, description.defaultExperiment.stopTime) == ("0.02", "1.0")


@pytest.mark.long
def test_a_mapped_gyro_in_other_tools(small: System, foreign: Foreign, tmp_path: Path) -> None:
    """Units and signs of a mapping file: the container's windows are those of the bench bit for bit, outputs in SI."""
    pytest.importorskip("fmu_manipulation_toolbox")
    parts, values = {"gyro": foreign("vendor_gyro")}, {"dwell": 0.2, "turns": 0.01, "table.index_rate": 2.0}
    notes = export_ssp(small, tmp_path / "v.ssp", parts, VENDOR, values)
    assert notes == ["table.alpha -> gyro.alpha: gyro has no 'alpha' (optional); not connected"]
    with zipfile.ZipFile(tmp_path / "v.ssp") as z:
        gains = sorted(n for n in z.namelist() if n.startswith("resources/gain_") and n.endswith(".fmu"))
        load = z.read("resources/gain_04.ssv").decode()
    assert len(gains) == 3 + 3 + 1 + 1  # omega, f, i, u
    assert f'value="{1.0 / -9.80665!r}"' in load  # table.f -> ACC_IA: load in g = -f / g0
    file = tmp_path / "v.fmu"
    export_container(small, file, parts, VENDOR, values, seed=2)
    own = run(small, parts, VENDOR, values, seed=2)
    assert small.windows is not None
    names = [small.windows.watch, *small.windows.columns.values(), "gyro.u"]
    end = own.run.stopped_at
    found, _ = apart(file, stop_time=end, step_size=1e-3, output_interval=1e-3, output=names)
    record = record_from_series(small, {n: found[n] for n in names})
    assert len(own.windows["mean"]) > 3
    for name, column in own.windows.items():
        np.testing.assert_array_equal(record.windows[name], column, err_msg=name)
    rows = len(own.channels["time"])
    np.testing.assert_array_equal(found["gyro.u"][::10][1:rows], own.channels["gyro.u"][1:])  # V, not mV
    # a result file is read alike: the name of the connector is SI, that of the FMU's variable its own unit
    recorded = {"gyro.u": ("gyro", Bound("u", "V_PICKOFF", 0, "Real", 1e-3))}
    for name, value in (("gyro.u", 2.0), ("gyro.V_PICKOFF", 2e-3)):
        block = {"time": np.zeros(1), name: np.full(1, 2.0)}
        series = find_series(
            ResultFile("x", list(block), "time", lambda names, b=block: iter([b])), recorded, set(), set()
        )
        assert series[0]["gyro.u"].si(block, np.array([0])) == [value]


@pytest.mark.long
def test_parameters_of_a_container(small: System, tmp_path: Path) -> None:
    pytest.importorskip("fmu_manipulation_toolbox")
    file, values = tmp_path / "c.fmu", {"dwell": 0.2, "turns": 0.01, "table.index_rate": 2.0}
    export_container(small, file, values=values, expose=["gyro.D_F", "gyro.temperature", "gyro.b"])
    kinds = {v.name: v.causality for v in read_model_description(str(file)).modelVariables}
    assert (kinds["gyro.D_F"], kinds["gyro.temperature"], kinds["gyro.b"]) == ("parameter", "input", "output")
    own = run(small, values={**values, "gyro.D_F": 1e-3, "gyro.temperature": 2.0}).channels
    set_here = {"gyro.D_F": 1e-3, "gyro.temperature": 2.0}
    for given, equal in ((set_here, True), ({}, False)):
        found, _ = apart(
            file, stop_time=0.5, step_size=1e-3, output_interval=1e-3, output=["gyro.u"], start_values=given
        )
        assert np.array_equal(found["gyro.u"][::10][1:50], own["gyro.u"][1:50]) == equal
    options = tmp_path / "d.fmu"
    export_container(small, options, values=values)
    parameters = {v.name: v for v in read_model_description(str(options)).modelVariables if v.causality == "parameter"}
    assert list(parameters) == ["latitude", "dwell"]  # of the plan and of parts at once: turns
    assert float(parameters["latitude"].start) == math.radians(45.75)


@pytest.mark.long
def test_an_option_called_time_stays_built_in(tmp_path: Path) -> None:
    """The container has a variable ``time`` of its own."""
    pytest.importorskip("fmu_manipulation_toolbox")
    system = load_system("attitude_estimator")
    export_container(system, tmp_path / "c.fmu")
    names = [v.name for v in read_model_description(str(tmp_path / "c.fmu")).modelVariables]
    assert names.count("time") == 1 and "heading_period" in names
    with pytest.raises(ExportError, match="--expose time: a container has a variable of that name"):
        export_container(system, tmp_path / "d.fmu", expose=["time"])
