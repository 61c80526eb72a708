"""A system as one native FMU: valid, and in FMPy the same record as the bench's own run, bit for bit."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported import record_from_series
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

from gyrobench.engine.session import run
from gyrobench.exchange.ssp_export import ExportError
from gyrobench.exchange.system_fmu import export_fmu
from gyrobench.system.system import System, load_system

QUICK = {"dwell": 0.2, "turns": 0.02, "table.index_rate": 1.0}
EXPOSED = ["gyro.D_F", "gyro.temperature", "gyro.b"]
FOREIGN = Path(__file__).parents[1] / "foreign"
Write = Callable[..., Path]


@pytest.fixture(scope="module")
def write(tmp_path_factory: pytest.TempPathFactory) -> Write:
    """Export the small system once in each version."""
    folder, done = tmp_path_factory.mktemp("fmu"), {}

    def written(small: System, fmi: int = 2) -> Path:
        if fmi not in done:
            done[fmi] = folder / f"small{fmi}.fmu"
            assert export_fmu(small, done[fmi], values=QUICK, seed=5, expose=EXPOSED, fmi=fmi) == []
        return done[fmi]

    return written


def simulated(file: Path, stop: float, interval: float = 1e-3, **values: Any) -> dict[str, Any]:
    found = simulate_fmu(str(file), stop_time=stop, output_interval=interval, start_values=values)
    return {n: found[n] for n in found.dtype.names}


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.long
def test_fmpy_gives_the_record_of_the_bench(small: System, write: Write, fmi: int) -> None:
    file = write(small, fmi)
    assert validate_fmu(str(file)) == []
    own = run(small, values=QUICK, seed=5)
    assert own.run.stopped_at is not None
    series = simulated(file, own.run.stopped_at)
    found = record_from_series(small, series)
    assert len(found.windows["mean"]) > 4
    assert {n: c.tobytes() for n, c in found.windows.items()} == {n: c.tobytes() for n, c in own.windows.items()}
    rows = len(own.channels["time"])
    for name in ("gyro.u", "rebalance.i", "table.angle"):  # a row of the channels each 10 steps
        np.testing.assert_array_equal(series[name][::10][:rows], own.channels[name])
    coarse = simulated(file, 1.0, interval=0.01)  # ten steps of the system in a communication step
    np.testing.assert_array_equal(coarse["gyro.u"][:100], own.channels["gyro.u"][:100])


@pytest.mark.long
def test_parameters_and_inputs_that_were_exposed(small: System, write: Write) -> None:
    file = write(small)
    variables = {v.name: v for v in read_model_description(str(file)).modelVariables}
    kinds = {n: v.causality for n, v in variables.items() if v.causality != "output"}
    assert kinds == {"gyro.D_F": "parameter", "gyro.temperature": "input"}
    assert (variables["gyro.D_F"].unit, variables["gyro.temperature"].unit) == ("rad/s", "K")
    assert float(variables["gyro.D_F"].start) == pytest.approx(np.radians(-0.3 / 3600.0), rel=1e-12)
    own = run(small, values={**QUICK, "gyro.D_F": 1e-3, "gyro.temperature": 2.0}, seed=5)
    series = simulated(file, 0.5, **{"gyro.D_F": 1e-3, "gyro.temperature": 2.0})
    np.testing.assert_array_equal(series["gyro.u"][::10][:50], own.channels["gyro.u"][:50])
    assert not np.array_equal(series["gyro.u"], simulated(file, 0.5)["gyro.u"])


@pytest.mark.long
def test_the_options_that_stand_for_values_of_parts_are_the_default(tmp_path: Path) -> None:
    # latitude shapes the mounts of a tumble as well, terms is of the reduction; height is that of the site alone,
    # settle that of every phase
    file = tmp_path / "tumble.fmu"
    export_fmu(load_system("tumble_single_axis"), file, values={"height": "120m"})
    variables = {v.name: v for v in read_model_description(str(file)).modelVariables}
    assert float(variables["height"].start) == 120.0
    assert not {"latitude", "terms", "turns"} & variables.keys()
    assert {n for n, v in variables.items() if v.causality == "parameter"} == {"height", "gravity", "settle"}
    times = read_model_description(str(file)).defaultExperiment
    assert float(times.stopTime).is_integer() and float(times.stepSize) == 10.0  # a row of the channels
    names = zipfile.ZipFile(file).namelist()
    assert {"sources/fmi2.c", "sources/part_floated_gyro.c", "documentation/README.md", "model.png"} <= set(names)


@pytest.mark.long
def test_an_option_that_is_the_time_of_the_run_is_built_in(tmp_path: Path) -> None:
    bench = Path(__file__).parents[1] / "benchmarks" / "bench"
    export_fmu(load_system("loop", bench), tmp_path / "loop.fmu", values={"duration": 2.0}, bench=bench)
    description = read_model_description(str(tmp_path / "loop.fmu"))
    assert {v.name: v.causality for v in description.modelVariables if v.causality != "independent"} == {
        "plant.position": "output",
        "controller.u": "output",
    }
    assert float(description.defaultExperiment.stopTime) == 2.0


class Instance:
    """The FMU by FMI calls."""

    def __init__(self, file: Path) -> None:
        self.description = read_model_description(str(file))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.messages: list[str] = []
        self.fmu = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=extract(str(file)),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="one",
        )
        self.fmu.instantiate()

    def start(self, **values: float) -> None:
        for name, value in values.items():
            self.fmu.setReal([self.references[name]], [value])
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def outputs(self) -> list[float]:
        return list(self.fmu.getReal([r for n, r in self.references.items() if n != "time"]))


def test_states_instances_and_reset(small: System, write: Write) -> None:
    one, other = Instance(write(small)), Instance(write(small))
    one.start()
    initial = one.outputs()
    for k in range(100):
        one.fmu.doStep(k * 1e-3, 1e-3)
    state = one.fmu.serializeFMUstate(one.fmu.getFMUstate())
    for k in range(100, 200):
        one.fmu.doStep(k * 1e-3, 1e-3)
    last = one.outputs()
    other.start()
    assert other.outputs() == initial
    other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(state))
    other.fmu.doStep(0.1, 0.1)  # a hundred steps in one
    assert other.outputs() == last
    one.fmu.reset()
    one.start()
    assert one.outputs() == initial
    one.fmu.doStep(0.0, 0.1)
    outputs = one.outputs()
    one.fmu.doStep(0.1, 1e-12)  # of a master that sums up the time
    assert one.outputs() == outputs
    one.fmu.doStep(0.1 + 1e-12, 0.1)
    assert one.outputs() == last


def test_what_is_wrong_is_refused(small: System, write: Write, capfd: pytest.CaptureFixture[str]) -> None:
    one = Instance(write(small))
    with pytest.raises(Exception, match="fmi2ExitInitializationMode"):
        one.start(**{"gyro.temperature": float("nan")})
    one.fmu.reset()
    one.start()
    with pytest.raises(Exception, match="fmi2DoStep"):
        one.fmu.doStep(0.0, 1.5e-3)
    said = capfd.readouterr().out
    assert "one: input gyro.temperature is nan at t = 0 s" in said
    assert "one: a step of 0.0015 s: it must be a multiple of the system's step of 0.001 s" in said
    for when in (0.0, 0.002):  # the step before ended at 0.001 s
        one.fmu.reset()
        one.start()
        one.fmu.doStep(0.0, 1e-3)
        with pytest.raises(Exception, match="fmi2DoStep"):
            one.fmu.doStep(when, 1e-3)
        assert f"one: a step from t = {when:g} s, but the last one ended at 0.001 s" in capfd.readouterr().out


@pytest.mark.long
def test_what_cannot_be_exposed(small: System, tmp_path: Path, foreign: Callable[[str], Path]) -> None:
    for name, why in {
        "gyro.omega": r"--expose gyro.omega\[1\]: this input is wired: table.omega -> gyro.omega",
        "gyro.float_angle": "it is internal; parameters, inputs and outputs can be exposed",
        "gyro.d_i": "gyro has no such variable; did you mean gyro.D_I?",
        "giro.D_I": "no slot 'giro'; did you mean gyro?",
        "nothing": "neither 'slot.variable' nor an option",
    }.items():
        with pytest.raises(ExportError, match=why):
            export_fmu(small, tmp_path / "x.fmu", expose=[name])
    with pytest.raises(ExportError, match="latitude: the option does more than set values of parts, so it is built in"):
        export_fmu(load_system("tumble_single_axis"), tmp_path / "x.fmu", expose=["latitude"])
    setup: dict[str, Any] = {"parts": {"gyro": foreign("vendor_gyro")}, "maps": {"gyro": FOREIGN / "vendor_gyro.toml"}}
    with pytest.raises(ExportError, match="gyro: not a native part of this bench; one library"):
        export_fmu(small, tmp_path / "x.fmu", **setup)
    assert not list(tmp_path.glob("*.fmu"))


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_parameter_is_set_between_steps(small: System, write: Write, fmi: int) -> None:
    """From 0.5 s on a drift D of 1e-5 rad/s more; set to what it is, nothing changes; nan is refused.

    J b'' + C b' = -H D with J / C = 1 ms = h, H / C = 1: one step later b is less by D h / e, before the loop answers;
    u = K_sg b, K_sg = 10 V/rad.
    """
    file = write(small, fmi)
    variables = {v.name: v for v in read_model_description(str(file)).modelVariables}
    assert variables["gyro.D_F"].variability == "tunable"
    before = float(variables["gyro.D_F"].start)
    plain = simulated(file, 1.5)

    def changed(to: float) -> Any:
        series = np.array([(0.0, before), (0.5, before), (0.5, to), (9.0, to)], [("time", float), ("gyro.D_F", float)])
        return simulate_fmu(str(file), stop_time=1.5, output_interval=1e-3, input=series)

    np.testing.assert_array_equal(changed(before)["gyro.u"], plain["gyro.u"])
    apart = changed(before + 1e-5)["gyro.u"][:502] - plain["gyro.u"][:502]
    assert not apart[:501].any()
    assert apart[501] == pytest.approx(
        -10.0 * 1e-5 * 1e-3 / np.e, rel=1e-3
    )  # the coefficients of its step are made anew, too
    with pytest.raises(Exception, match=r"fmi[23]Set"):
        changed(np.nan)
