"""Exports in FMPy with no option of step, stop or output: they run, and what they give by themselves can be reduced."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu
from masters import apart

import gyrobench as gb
from gyrobench.exchange.container import export_container
from gyrobench.exchange.ssp_export import prepare, recorded
from gyrobench.exchange.system_fmu import export_fmu
from gyrobench.system.system import load_system

pytestmark = pytest.mark.long

LOOP, SHORT = "stabilizer_sdf", {"time": 2.0, "command": 1e-4}


def estimates(run: gb.Run) -> dict[str, float]:
    return {c.name: c.estimate for c in run.result.coefficients if not c.no_value}


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_stop_time_that_is_no_multiple_of_the_step(tmp_path: Path, fmi: int) -> None:
    """The capture of a table may last 11.05450094... s, the step is 0.1 ms: the last one would be shorter."""
    system = load_system("table_capture")
    assert system.stop is not None and abs(system.stop / system.step - round(system.stop / system.step)) > 1e-3
    export_fmu(system, tmp_path / "capture.fmu", fmi=fmi)
    times = read_model_description(str(tmp_path / "capture.fmu")).defaultExperiment
    assert (float(times.stopTime), float(times.stepSize)) == (11.0545, 1e-3)  # a row of the channels each 1 ms
    found = simulate_fmu(str(tmp_path / "capture.fmu"))
    assert found["time"][-1] == 11.0545
    if fmi == 2:  # a thousand rows, FMPy's most where it is not told otherwise, are too few for the channels
        with pytest.raises(gb.GyrobenchError, match=r"of the \d+ rows at multiples of 0\.001 s"):
            gb.load("table_capture").reduce_result(found)


def test_windows_need_no_option(tmp_path: Path) -> None:
    values = {"readings": 8, "dwell": 80.0, "settle": 2.0}
    export_fmu(load_system("fixed_position"), tmp_path / "one.fmu", values=values)
    test = gb.load("fixed_position", values)
    found = test.reduce_result(simulate_fmu(str(tmp_path / "one.fmu")))
    assert estimates(found) == estimates(test.run(check_step=False))


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_option_has_its_unit_and_meaning_in_the_fmu(tmp_path: Path, fmi: int) -> None:
    """A torque and a rate, which set sizes of phases that may be anything: "1" in the part."""
    system = load_system("platform_single_axis")
    export_fmu(system, tmp_path / "p.fmu", fmi=fmi)
    variables = read_model_description(str(tmp_path / "p.fmu")).modelVariables
    found = {v.name: (v.unit, v.description, float(v.start)) for v in variables if v.causality == "parameter"}
    assert found["load_step"] == ("N.m", system.options["load_step"].doc, 1.0)
    assert found["command"] == ("rad/s", system.options["command"].doc, 1e-3)


def test_a_loop_test_stops_where_its_plan_ends(tmp_path: Path) -> None:
    """A stage is rounded to a step, so that the plan of 3 phases may take 9 steps of 1 ms more; then whole seconds."""
    system = load_system(LOOP).with_values(SHORT)
    export_fmu(system, tmp_path / "loop.fmu")
    found = simulate_fmu(str(tmp_path / "loop.fmu"))
    planned = system.plan().duration()
    assert planned <= found["time"][-1] <= planned + 1.012
    assert found["exciter.done"][-1] == 1.0 and found["exciter.done"][found["time"] < planned - 0.5].max() == 0.0


def test_another_load_than_that_of_the_reduction_is_refused(tmp_path: Path) -> None:
    """The tool doubles the load of the step, its file does not say so: its angle over 1 N.m would be twice as large.

    With the same value here the torque over the largest angle, N.m/rad, is the one of the run with 1 N.m: the loop is
    linear, and beside it the gyro's own drift of 0.42 °/h = 0.42″/s moves the 75″ by less than 1 % until the largest.
    """
    values = {"hold": "10s"}
    export_fmu(load_system("platform_single_axis"), tmp_path / "p.fmu", values=values)
    runs = [simulate_fmu(str(tmp_path / "p.fmu"), stop_time=17.0, output_interval=1e-3, start_values=start)
            for start in ({}, {"load_step": 2.0})]  # fmt: skip
    test = gb.load("platform_single_axis", values)
    one = estimates(test.reduce_result(runs[0]))
    with pytest.raises(gb.GyrobenchError, match=r"phase 1 'load step': exciter.torque\[1\] has 2 N.m, here it is 1"):
        test.reduce_result(runs[1])
    two = estimates(gb.load("platform_single_axis", {**values, "load_step": 2.0}).reduce_result(runs[1]))
    assert two["load/peak"] == pytest.approx(one["load/peak"], rel=1e-2)
    sine = runs[0].copy()
    sine["exciter.test[1]"] *= 1.5
    with pytest.raises(gb.GyrobenchError, match=r"'loop 2 Hz': exciter.test\[1\] has 0.03 V, here it is 0.02"):
        test.reduce_result(sine)


def test_a_container_gives_all_that_a_record_needs(tmp_path: Path) -> None:
    """What is wired inside is an output too, with its unit; its order in the structure is that of the variables."""
    if importlib.util.find_spec("fmu_manipulation_toolbox") is None:
        pytest.skip("fmu-manipulation-toolbox is not installed")
    file, system = tmp_path / "loop.fmu", load_system(LOOP).with_values(SHORT)
    export_container(system, file)
    assert validate_fmu(str(file)) == []
    description = read_model_description(str(file))
    given = {v.name: v.unit for v in description.modelVariables if v.causality == "output"}
    needed = recorded(prepare(system, None, None, None, 1, None)[0])
    assert needed.keys() <= given.keys()
    assert (given["stabilizer.e"], given["platform.omega[1]"], given["gyro.b"]) == ("V", "rad/s", "rad")
    assert {u.variable.name for u in description.outputs} == set(given)
    assert {u.variable.name for u in description.initialUnknowns} == set(given)
    assert description.author is None  # the toolbox states who made it
    found, errors = apart(file, output_interval=float(description.defaultExperiment.stepSize))
    assert errors == []
    own = gb.load(LOOP, SHORT).run(check_step=False)
    assert len(estimates(own)) >= 8
    assert estimates(gb.load(LOOP, SHORT).reduce_result(found)) == estimates(own)
