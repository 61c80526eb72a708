"""Runs of the exported tumble in other tools, reduced from their files: the coefficients of the bench's own run."""

from __future__ import annotations

import json
import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from fmpy import simulate_fmu
from fmpy.util import write_csv
from scipy.io import savemat

import gyrobench as gb
from gyrobench.exchange.ssp_export import export_ssp
from gyrobench.exchange.system_fmu import export_fmu
from gyrobench.system.system import load_system

pytestmark = pytest.mark.long

NAME = "tumble_single_axis"
VALUES: dict[str, Any] = {
    "rate": "6000 ERU",
    "dwell": 3.0,
    "settle": 0.8,
    "windows": 12,
    "table.acceleration": 0.4,
    **{f"gyro.{n}": 0.0 for n in ("turn_on", "markov", "white", "pickoff")},
    "rebalance.meter": 0.0,
    "rebalance.resolution": 0.0,
}
SETTINGS = [word for n, v in VALUES.items() for word in ("--set", f"{n}={v}")]
COARSE = 0.1  # s between the rows: many steps, less than the shortest window
Array = np.ndarray[Any, Any]


@pytest.fixture(scope="module")
def own() -> gb.Run:
    return gb.load(NAME, VALUES).run(check_step=False)


@pytest.fixture(scope="module")
def elsewhere(own: gb.Run, tmp_path_factory: pytest.TempPathFactory) -> Array:
    """The system as one FMU in FMPy, which gives the bits of the bench."""
    file = tmp_path_factory.mktemp("fmu") / "tumble.fmu"
    export_fmu(load_system(NAME), file, values=VALUES)
    end = float(own.record.run.stopped_at or 0.0)
    found: Array = simulate_fmu(str(file), stop_time=end + COARSE, output_interval=COARSE)
    return found


def estimates(result: Any) -> dict[str, float]:
    return {c.name: c.estimate for c in result.coefficients}


def text(names: list[str], transposed: bool = False) -> Array:
    """Names as the character matrix of a .mat file, a row or a column each."""
    rows = [n.ljust(max(map(len, names))) for n in names]
    return np.array(["".join(column) for column in zip(*rows, strict=True)] if transposed else rows)


def modelica(series: Array, transposed: bool, constants: dict[str, float], prefix: str = "") -> dict[str, Array]:
    """The layout of trajectories; the last series is stored with the other sign."""
    names = ["Time", *(prefix + n for n in series.dtype.names[1:]), *(prefix + n for n in constants)]
    second = np.column_stack([series[n] for n in series.dtype.names])
    second[:, -1] *= -1.0
    first = np.array([[0.0, *constants.values()], [series["time"][-1], *constants.values()]])
    info = [[0 if k == 0 else 2, k + 1, 0, -1] for k in range(second.shape[1])]
    info[-1][1] *= -1
    info += [[1, k + 2, 0, -1] for k in range(len(constants))]
    turn = np.transpose if transposed else np.asarray
    form = text(["Atrajectory", "1.1", "", "binTrans" if transposed else "binNormal"])
    return {
        "Aclass": form,
        "name": text(names, transposed),
        "description": text(names, transposed),
        "dataInfo": turn(np.array(info, dtype=np.int32)),
        "data_1": turn(first),
        "data_2": turn(second),
    }


def nested(series: Array) -> dict[str, Any]:
    """A struct for each slot, as in MATLAB; an element of an array has no name there."""
    content: dict[str, Any] = {"time": series["time"]}
    for name in series.dtype.names[1:]:
        slot, _, variable = name.partition(".")
        if "[" not in variable:
            content.setdefault(slot, {})[variable] = series[name]
    return content


def write(series: Array, form: str, folder: Path) -> Path:
    file = folder / f"run.{form.partition(' ')[0]}"
    match form:
        case "csv":
            write_csv(str(file), series)
        case "npy":
            np.save(file, series)
        case "parquet":
            import pyarrow as pa
            import pyarrow.parquet as pq

            pq.write_table(pa.table({n: series[n] for n in series.dtype.names}), file)
        case "mat 5":
            savemat(file, nested(series), do_compression=True)
        case "mat 4":
            savemat(file, modelica(series, True, {"gyro.H": 0.2}, "model.root."), format="4")
        case "mat normal":
            savemat(file, modelica(series, False, {}))
    return file


@pytest.mark.parametrize("form", ["csv", "npy", "parquet", "mat 5", "mat 4", "mat normal"])
def test_each_format_gives_the_coefficients_of_the_own_run(
    form: str, own: gb.Run, elsewhere: Array, command: Command, tmp_path: Path
) -> None:
    file = write(elsewhere, form, tmp_path)
    code, out, err = command("reduce", NAME, "--from", file, *SETTINGS, "--out", tmp_path / "out", "--json")
    assert code == 0, err
    found = {c["name"]: (c["estimate"], c["u"]) for c in json.loads(out)["coefficients"]}
    assert found == {c.name: (c.estimate, c.u) for c in own.result.coefficients}
    assert len(found) == 9
    run = gb.open_run(tmp_path / "out")
    assert run.record.windows.keys() == own.record.windows.keys()
    for name, column in own.record.windows.items():
        np.testing.assert_array_equal(run.record.windows[name], column, err_msg=name)
    assert (run.record.run.engine, run.record.run.seed) == ("another tool", None)
    assert run.record.run.data is not None and run.record.run.data.file == file.name
    assert "the effect of the step is not in u" in run.result.warnings[0]
    assumed = any("those given here are assumed" in w for w in run.result.warnings)
    assert assumed == (form != "mat 4")  # this file states a parameter


def test_channels_of_the_array(own: gb.Run, elsewhere: Array) -> None:
    run = gb.load(NAME, VALUES).reduce_result(elsewhere)
    assert estimates(run.result) == estimates(own.result)
    period = own.record.channels["time"][1]
    rows = np.searchsorted(elsewhere["time"] + 1e-6, own.record.channels["time"])
    assert period >= COARSE  # else there are none
    for name, column in run.record.channels.items():
        if name != "time":
            np.testing.assert_array_equal(column[: len(rows)], elsewhere[name][rows[: len(column)]], err_msg=name)


def test_what_comes_after_the_end_of_the_plan_is_left_out(own: gb.Run, elsewhere: Array) -> None:
    """An importer goes on to its stop time; a run of the bench, and its channels, end with the plan."""
    longer = np.concatenate([elsewhere, np.repeat(elsewhere[-1:], 300)])
    longer["time"][len(elsewhere) :] += COARSE * np.arange(1, 301)  # 30 s: three rows of the channels
    longer["table.angle"][len(elsewhere) :] = 7.0
    run = gb.load(NAME, VALUES).reduce_result(longer)
    assert estimates(run.result) == estimates(own.result)
    assert run.record.run.stopped_at == pytest.approx(own.record.run.stopped_at, abs=COARSE)
    assert 0 <= len(own.record.channels["time"]) - len(run.record.channels["time"]) <= 1
    assert 7.0 not in run.record.channels["table.angle"]


def file_observer(folder: Path, **slots: str) -> Any:
    """libcosim's observer that writes a CSV file a slot, of these variables, every 50 steps."""
    from ctypes import POINTER, c_char_p

    from libcosimpy._internal import libcosimc, wrap_function
    from libcosimpy.CosimObserver import CosimObserver

    chosen = "".join(
        f'<simulator name="{slot}" decimationFactor="50">'
        + "".join(f'<variable name="{n}"/>' for n in names.split())
        + "</simulator>"
        for slot, names in slots.items()
    )
    (folder / "log.xml").write_text(f"<simulators>{chosen}</simulators>")
    create = wrap_function(
        lib=libcosimc(), funcname="cosim_file_observer_create_from_cfg",
        argtypes=[c_char_p, c_char_p], restype=POINTER(CosimObserver),
    )  # fmt: skip
    pointer = create(str(folder).encode(), str(folder / "log.xml").encode())
    return CosimObserver(CosimObserver._CosimObserver__create_key, pointer)  # the wrapper lacks this one


def test_libcosim_by_its_csv_files(own: gb.Run, command: Command, tmp_path: Path) -> None:
    """Coupled in parallel, six digits.  The SSP repeats the values of its export, so none is given."""
    pytest.importorskip("libcosimpy")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level

    archive, folder = tmp_path / "tumble.ssp", tmp_path / "csv"
    export_ssp(load_system(NAME), archive, values=VALUES)
    zipfile.ZipFile(archive).extractall(tmp_path / "open")
    folder.mkdir()
    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_ssp_file(str(tmp_path / "open"), 1_000_000)
    windows = "count mean std n flagged window_phase t_start t_end angle_start angle_end"
    observer = file_observer(folder, sampler=windows, table="face[1,1] face[1,2]", gyro="u H D_I")
    execution.add_observer(observer)
    execution.step(step_count=round((float(own.record.run.stopped_at or 0.0) + 0.5) / 1e-3))
    del execution, observer  # closes the files
    code, out, err = command("reduce", archive, "--from", folder, "--out", tmp_path / "out", "--json")
    assert code == 0, err
    found = {c["name"]: c["estimate"] for c in json.loads(out)["coefficients"]}
    for name, estimate in estimates(own.result).items():
        assert abs(found[name] - estimate) < 1e-3, name  # deg/h, of 90,000: as in test_export_tumble
    warnings = gb.open_run(tmp_path / "out").result.warnings
    assert not any("assumed" in w for w in warnings)  # H of the gyro is in its file
    (file,) = folder.glob("sampler_*.csv")
    code, out, err = command("reduce", archive, "--from", file, "--out", tmp_path / "one", "--json")
    assert {c["name"]: c["estimate"] for c in json.loads(out)["coefficients"]} == found, err
    code, _, err = command("reduce", NAME, "--from", file, "--out", tmp_path / "two")  # values of the default test
    assert code == 2 and "those of the plan" in err
    code, _, err = command("reduce", archive, "--from", folder, "--set", "gyro.H=0.4", "--out", tmp_path / "three")
    assert code == 2 and "gyro.H: 0.2 in the file, 0.4 here N.m.s" in err
    shutil.copy(file, folder / file.name.replace("_2", "_1", 1))
    code, _, err = command("reduce", archive, "--from", folder, "--out", tmp_path / "four")
    assert code == 2 and "results of several runs (more than one file of sampler)" in err


def changed(series: Array, **columns: Array) -> Array:
    series = series.copy()
    for name, values in columns.items():
        series[name.replace("__", ".")] = values
    return series


def without(series: Array, *names: str) -> Array:
    import numpy.lib.recfunctions as rf

    return np.asarray(rf.repack_fields(series[[n for n in series.dtype.names if n not in names]]))


def refusals(series: Array) -> dict[str, tuple[Array, str]]:
    """What is wrong -> the array, and the words."""
    count = series["sampler.count"]
    half = 0.5 * (count + np.append(count[1:], count[-1]))
    late = int(np.argmax(count > 2.0))
    far = {f"sampler__angle_{e}": series[f"sampler.angle_{e}"] + 1e4 for e in ("start", "end")}
    return {
        "a series": (without(series, "sampler.mean"), "sampler.mean is missing"),
        "the time": (without(series, "time"), "no column 'time'"),
        "a coarse output": (series[::40], "windows end between the rows at t = "),
        "a late begin": (series[late:], "the file must begin with the run"),
        "interpolation": (changed(series, sampler__count=half), "the tool has interpolated between"),
        "two runs": (
            np.concatenate([series, changed(series, time=series["time"] + series["time"][-1])]),
            "goes back to 0 at t = ",
        ),
        "order": (series[::-1], "comes after"),
        "not a number": (changed(series, sampler__mean=np.full(len(series), np.nan)), "sampler.mean is nan at t = "),
        "single precision": (
            changed(series, **far).astype([(n, "f4") for n in series.dtype.names]),
            "numbers of single precision: the ends of the windows are known to",
        ),
    }


def test_what_cannot_be_a_run_of_the_system_is_refused(own: gb.Run, elsewhere: Array, tmp_path: Path) -> None:
    test = gb.load(NAME, VALUES)
    for what, (series, words) in refusals(elsewhere).items():
        with pytest.raises(gb.GyrobenchError, match=words):
            test.reduce_result(series)
            pytest.fail(what)
    for values, words in {
        "windows": r"window 1, of phase 1 \(.*\), has [\d.]+ s, those of the plan [\d.]+ s; the run was exported",
        "dwell": "those of the plan",
    }.items():
        with pytest.raises(gb.GyrobenchError, match=words):
            gb.load(NAME, {**VALUES, values: 6}).reduce_result(elsewhere)
    with pytest.raises(gb.GyrobenchError, match=r"sampler_x\.count is missing"):
        gb.load("tumble_two_channel").reduce_result(elsewhere)
    end = int(0.7 * len(elsewhere))
    with pytest.raises(
        gb.GyrobenchError, match=r"the file ends before the plan\n.*recorded until t = [\s\S]*of \d+ windows"
    ):
        test.reduce_result(elsewhere[:end])
    file = tmp_path / "other.mat"  # made with another value of a parameter
    savemat(file, modelica(elsewhere, True, {"gyro.H": 0.3, "gyro.seed": 4.0}), format="4")
    with pytest.raises(
        gb.GyrobenchError, match=r"gyro.H: 0.3 in the file, 0.2 here N.m.s[\s\S]*give the same with --set"
    ):
        test.reduce_result(file)


def test_files_that_are_none(command: Command, tmp_path: Path) -> None:
    for name, content, words in (
        ("a.mat", b"MATLAB 7.3 MAT-file, Platform: GLNXA64" + b" " * 200, "save it with save"),
        ("b.mat", b"MATLAB 5.0 MAT-file" + b"\xff" * 300, "not a MATLAB file that can be read"),
        ("c.npy", b"\x93NUMPY\x01\x00", "not a numpy array that can be read"),
        ("d.parquet", b"PAR1PAR1", "not a Parquet file that can be read"),
        ("e.fmu", b"PK\x03\x04" + b"\0" * 40, "an archive"),
        ("f.csv", b"", "no header line"),
        ("g.csv", b"a,b\n1,2\n", "no column 'time'; columns: a, b"),
        ("m.csv", b"time [s],rate [deg/h]\n1,2\n", "a measured file goes with --data"),
        ("h.bin", b"\x01\x00\x02" * 9, "neither CSV nor .npy, .mat or Parquet"),
    ):
        (tmp_path / name).write_bytes(content)
        code, _, err = command("reduce", NAME, "--from", tmp_path / name)
        assert code == 2 and words in err, (name, err)
    for words, said in (
        (("--from", tmp_path / "none.csv"), "no such file"),
        (("--from", tmp_path), "no files SLOT_DATE_TIME.csv of libcosim"),
        (("--from", tmp_path / "g.csv", "--data", tmp_path / "g.csv"), "name one of them"),
        (("--part", "gyro=gyro_2dof"), "measured data have no FMUs"),
    ):
        code, _, err = command("reduce", NAME, *words)
        assert code == 2 and said in err, err
    code, _, err = command("reduce", "drift_test_suite", "--from", tmp_path / "g.csv")
    assert code == 2 and "is a suite" in err
