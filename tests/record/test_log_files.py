"""Logs of other programs, written here by the libraries of their formats, become the text that the bench reads."""

from __future__ import annotations

import datetime
import json
import struct
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from commanding import Command
from pyarrow import csv as arrow
from pyarrow import feather, parquet

from gyrobench.record import log_contents
from gyrobench.record.csv_reader import DataError
from gyrobench.record.log_files import as_text, is_log, tables_of

T = np.arange(5) * 0.01
RATE = np.array([0.1, -0.2, 1.0 / 3.0, 0.4, -1e-7])
TEMPERATURE = np.array([20.0, 20.5])


def write_parquet(file: Path) -> None:
    parquet.write_table(pa.table({"time": T, "rate": RATE}), file)


def write_feather(file: Path) -> None:
    feather.write_feather(pa.table({"time": T, "rate": RATE}), str(file))


def write_npz(file: Path) -> None:
    np.savez(file, time=T, rate=RATE, temperature=TEMPERATURE)


def write_npy(file: Path) -> None:
    np.save(file, np.array(list(zip(T, RATE, strict=True)), dtype=[("time", "f8"), ("rate", "f8")]))


def write_mat(file: Path) -> None:
    from scipy.io import savemat

    savemat(file, {"log": {"time": T, "rate": RATE[:, None]}, "temperature": TEMPERATURE})


def write_hdf5(file: Path) -> None:
    import h5py

    with h5py.File(file, "w") as content:
        content["imu/time"], content["imu/rate"] = T, RATE
        content["imu/time"].attrs["units"], content["imu/rate"].attrs["units"] = "s", "rad/s"
        content["climate/temperature"] = TEMPERATURE


def write_mat73(file: Path) -> None:
    """Write as MATLAB 7.3 does: HDF5 behind 512 bytes that say so, vectors as rows."""
    import h5py

    with h5py.File(file, "w", userblock_size=512) as content:
        content["time"], content["rate"] = T[None, :], RATE[None, :]
    with file.open("r+b") as data:
        data.write(b"MATLAB 7.3 MAT-file".ljust(512))


def write_mdf(file: Path) -> None:
    from asammdf import MDF, Signal

    with MDF() as log:
        log.append([Signal(RATE, T, unit="rad/s", name="rate")])
        log.append([Signal(TEMPERATURE, T[:2], unit="degC", name="temperature")])
        log.save(file)


def write_tdms(file: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    stamped = {"wf_increment": 0.01, "wf_start_offset": 0.0, "unit_string": "rad/s"}
    with TdmsWriter(file) as log:
        log.write_segment([ChannelObject("imu", "rate", RATE, stamped)])
        log.write_segment([ChannelObject("climate", "temperature", TEMPERATURE)])


def message(kind: bytes, body: bytes) -> bytes:
    return struct.pack("<H", len(body)) + kind + body


def write_ulog(file: Path) -> None:
    """Write the header, two formats, a subscription each, and the data, by the format's description."""
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    out += message(b"F", b"sensor_gyro:uint64_t timestamp;double rate;")
    out += message(b"F", b"climate:uint64_t timestamp;double temperature;")
    out += message(b"A", b"\0" + struct.pack("<H", 0) + b"sensor_gyro")
    out += message(b"A", b"\0" + struct.pack("<H", 1) + b"climate")
    for t, rate in zip(T, RATE, strict=True):
        out += message(b"D", struct.pack("<HQd", 0, round(t * 1e6), rate))
    for t, temperature in zip(T, TEMPERATURE, strict=False):
        out += message(b"D", struct.pack("<HQd", 1, round(t * 1e6), temperature))
    file.write_bytes(out)


def write_flight_log(file: Path) -> None:
    """Write a log of PX4: a status, and gyros and accelerometers as arrays of three beside what is no rate."""
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    out += message(b"F", b"status:uint64_t timestamp;float[4] gyro_priority;")
    out += message(b"F", b"sensor_combined:uint64_t timestamp;float[3] gyro_rad;float gyro_integral_dt;"
                         b"float[3] accelerometer_m_s2;")  # fmt: skip
    out += message(b"A", b"\0" + struct.pack("<H", 0) + b"status")
    out += message(b"A", b"\0" + struct.pack("<H", 1) + b"sensor_combined")
    for k in range(600):
        out += message(b"D", struct.pack("<HQ4f", 0, 4000 * k, 1, 2, 3, 4))
        out += message(b"D", struct.pack("<HQ7f", 1, 4000 * k, 0.25, 0.5, k / 1024, 4000, 1, 2, 9.75))
    file.write_bytes(out)


def write_mcap(file: Path) -> None:
    """Write a ROS 2 bag: a topic with Imu messages, sampled every 10 ms, that arrive in bursts."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    folder = file.parent / "bag"
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as log:
        connection = log.add_connection("/imu", "sensor_msgs/msg/Imu", typestore=store)
        vector, zeros = types["geometry_msgs/msg/Vector3"], np.zeros(9)
        for k, rate in enumerate(RATE):
            stamp = types["builtin_interfaces/msg/Time"](5, k * 10_000_000)
            made = types["sensor_msgs/msg/Imu"](
                types["std_msgs/msg/Header"](stamp, "imu"), types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
                zeros, vector(rate, 0.0, 0.0), zeros, vector(0.0, 0.0, 9.8), zeros,
            )  # fmt: skip
            log.write(connection, 5_100_000_000 + k // 2 * 20_000_000, store.serialize_cdr(made, "sensor_msgs/msg/Imu"))
    (found,) = folder.glob("*.mcap")
    found.rename(file)


def write_excel(file: Path) -> None:
    from openpyxl import Workbook

    book = Workbook()
    sheet = book.active
    sheet.title = "Messung"
    sheet.append(["Laborbuch 7"])
    sheet.append(["time [s]", "rate [rad/s]"])
    for row in zip(T.tolist(), RATE.tolist(), strict=True):
        sheet.append(row)
    climate = book.create_sheet("Klima")
    climate.append(["Datum", "temperature [degC]"])
    for k, value in enumerate(TEMPERATURE.tolist()):
        climate.append([datetime.datetime(2026, 3, 1, 8, k), value])
    book.save(file)


#: end of the name -> writer, the table that is read (""; the only one), how time and rate are called in the text
FORMATS: dict[str, tuple[Callable[[Path], None], str, tuple[str, str]]] = {
    ".parquet": (write_parquet, "", ("time", "rate")),
    ".feather": (write_feather, "", ("time", "rate")),
    ".npy": (write_npy, "", ("time", "rate")),
    ".npz": (write_npz, "5 rows", ("time", "rate")),
    ".mat": (write_mat, "5 rows", ("log.time", "log.rate")),
    ".h5": (write_hdf5, "imu", ("time [s]", "rate [rad/s]")),
    "-7.3.mat": (write_mat73, "", ("time", "rate")),
    ".mf4": (write_mdf, "1 Python", ("time [s]", "rate [rad/s]")),
    ".tdms": (write_tdms, "imu", ("time [s]", "rate [rad/s]")),
    ".ulg": (write_ulog, "sensor_gyro", ("timestamp [us]", "rate")),
    ".mcap": (write_mcap, "", ("time [s]", "angular_velocity.x [rad/s]")),
}


@pytest.mark.parametrize("end", FORMATS)
@pytest.mark.long
def test_every_number_comes_back_as_it_was_written(end: str, tmp_path: Path) -> None:
    write, table, (time, rate) = FORMATS[end]
    file = tmp_path / f"log{end}"
    write(file)
    assert is_log(file)
    read = arrow.read_csv(as_text(file, table))
    factor = 1e-6 if time.endswith("[us]") else 1.0
    assert np.allclose(read[time].to_numpy() * factor, T, rtol=0, atol=1e-12)
    assert read[rate].to_numpy().tolist() == RATE.tolist()  # every bit
    if table:
        with pytest.raises(DataError, match=r"several tables: .*name one in a column map: table = "):
            as_text(file)
        with pytest.raises(DataError, match=r"no table 'x'; there are: |no table 'x'; did you mean"):
            as_text(file, "x")
    else:
        assert len(tables_of(file)) == 1


@pytest.mark.parametrize("shape", [(90, 4), (4, 90)])
def test_a_matrix_of_matlab_has_a_column_for_each_channel(shape: tuple[int, int], tmp_path: Path) -> None:
    """MATLAB 7.3 writes column by column: HDF5 holds the transpose.  Channels may be its columns or its rows."""
    import h5py

    channels = np.arange(360.0).reshape(90, 4)
    file = tmp_path / "log.mat"
    with h5py.File(file, "w", userblock_size=512) as content:
        content["imu"], content["note"] = (
            (channels if shape == (90, 4) else channels.T).T,
            np.array([[72, 105]], dtype=np.uint16),
        )
        content["imu"].attrs["MATLAB_class"] = np.bytes_(b"double")
        content["note"].attrs["MATLAB_class"] = np.bytes_(b"char")
    with file.open("r+b") as data:
        data.write(b"MATLAB 7.3 MAT-file".ljust(512))
    assert tables_of(file) == ["90 rows"]
    assert as_text(file).read_text(encoding="utf-8").splitlines()[:2] == ["imu_1,imu_2,imu_3,imu_4", "0,1,2,3"]


@pytest.mark.long
def test_a_sheet_is_read_as_it_stands(tmp_path: Path) -> None:
    file = tmp_path / "log.xlsx"
    write_excel(file)
    assert tables_of(file) == ["Messung", "Klima"]
    lines = as_text(file, "Messung").read_text(encoding="utf-8").splitlines()
    assert lines[:3] == ["Laborbuch 7,", "time [s],rate [rad/s]", "0,0.1"]
    assert as_text(file, "Klima").read_text(encoding="utf-8").splitlines()[1] == "2026-03-01 08:00:00.000000,20"


def test_formulas_that_no_spreadsheet_has_evaluated_are_named(tmp_path: Path) -> None:
    """A program writes =2*A2 and no value beside it: not an empty cell, which a map may leave out."""
    from openpyxl import Workbook

    book = Workbook()
    for row in (["time [s]", "rate [deg/h]", "note"], [0, "=A2*2", None], [1, "=A3*2", None]):
        book.active.append(row)
    book.save(tmp_path / "log.xlsx")
    with pytest.raises(DataError, match="sheet Sheet: 2 formulas without a value; open and save the file"):
        as_text(tmp_path / "log.xlsx")


@pytest.mark.long
def test_dates_are_seconds_since_the_first_and_gaps_are_empty(tmp_path: Path) -> None:
    file = tmp_path / "log.parquet"
    stamps = np.datetime64("2026-03-01T08:00:00") + np.array([0, 10, 25]) * np.timedelta64(1, "ms")
    parquet.write_table(pa.table({"stamp": stamps, "rate": [1.0, None, 3.0], "note": ["a", "b", "c"]}), file)
    assert as_text(file).read_text().split() == ["stamp", "[s],rate", "0,1", "0.01,", "0.025,3"]


@pytest.mark.parametrize("end", [e for e in FORMATS if e != "-7.3.mat"] + [".xlsx"])
@pytest.mark.long
def test_a_damaged_file_ends_in_a_message(end: str, tmp_path: Path) -> None:
    file = tmp_path / f"log{end}"
    file.write_bytes(b"nothing of the kind" * 50)
    with pytest.raises(DataError, match=r"cannot be read as|no table of numbers"):
        as_text(file)


def test_objects_of_matlab_are_named(tmp_path: Path) -> None:
    """A timetable is a variable of class 17: three texts of 8 bits, and an array that says where its values are."""
    import h5py
    from scipy.io import savemat

    savemat(tmp_path / "array.mat", {"a": np.zeros((6, 1), dtype=np.uint32)})
    data = (tmp_path / "array.mat").read_bytes()

    def element(kind: int, content: bytes) -> bytes:
        return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)

    texts = b"".join(element(1, t) for t in (b"Acceleration", b"MCOS", b"timetable"))
    (tmp_path / "log.mat").write_bytes(data[:128] + element(14, element(6, bytes([17, *[0] * 7])) + texts + data[128:]))
    with pytest.raises(DataError, match=r"objects of MATLAB \(timetable\).*writetimetable"):
        tables_of(tmp_path / "log.mat")
    with h5py.File(tmp_path / "new.mat", "w", userblock_size=512) as log:
        log["Acceleration"] = np.zeros((1, 6), dtype=np.uint32)
        log["Acceleration"].attrs.update({"MATLAB_class": np.bytes_("table"), "MATLAB_object_decode": 3})
    with (tmp_path / "new.mat").open("r+b") as log:
        log.write(b"MATLAB 7.3 MAT-file")
    with pytest.raises(DataError, match=r"objects of MATLAB \(table\)"):
        tables_of(tmp_path / "new.mat")


def test_a_missing_package_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "h5py.py").write_text("raise ImportError('none', name='h5py')")
    file = tmp_path / "log.h5"
    write_hdf5(file)
    program = tmp_path / "log_contents.py"  # beside a h5py that is not there
    program.write_text(Path(log_contents.__file__).read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.setattr(log_contents, "__file__", str(program))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(DataError, match=r"\.h5 files need a further package \(h5py\): pip install 'gyrobench\[logs\]'"):
        tables_of(file)


@pytest.mark.long
def test_fit_finds_the_table_and_reduce_reads_it(gyrobench: Command, tmp_path: Path) -> None:
    """A drift record of white noise 0.01 °/s at 100 Hz: N = 0.01·60/√100 = 0.06 °/√h, from the table that has rates."""
    import h5py

    random = np.random.default_rng(4)
    with h5py.File(tmp_path / "log.h5", "w") as content:
        content["imu/time"], content["imu/gyro"] = np.arange(20_000) * 0.01, 0.01 * random.normal(size=20_000)
        content["imu/time"].attrs["units"], content["imu/gyro"].attrs["units"] = "s", "deg/s"
        content["climate/temperature"] = TEMPERATURE
    assert gyrobench("fit", "log.h5", "--system", "drift_record", "--out", "map.toml")[0] == 0
    assert 'table = "imu"' in Path("map.toml").read_text(encoding="utf-8")
    code, out, err = gyrobench("reduce", "drift_record", "--data", "log.h5", "--columns", "map.toml", "--json")
    assert code == 0, err
    n = next(c for c in json.loads(out)["coefficients"] if c["name"].startswith("N"))
    assert n["estimate"] == pytest.approx(0.06, rel=0.02)


@pytest.mark.long
def test_columns_of_the_bench_need_no_map(gyrobench: Command, tmp_path: Path) -> None:
    made = {"time [s]": np.arange(2000) * 0.01, "rate [deg/s]": 0.01 * np.random.default_rng(4).normal(size=2000)}
    parquet.write_table(pa.table(made), tmp_path / "log.parquet")
    code, out, err = gyrobench("reduce", "drift_record", "--data", "log.parquet", "--json")
    assert code == 0 and json.loads(out)["provenance"]["data"]["file"] == "log.parquet", err
    fields = [pa.field("time", pa.float64(), metadata={"unit": "ms"}), pa.field("rate [deg/s]", pa.float64())]
    stated = pa.schema(fields, metadata={"instrument": "gyro 17"})
    content = [1e3 * made["time [s]"], made["rate [deg/s]"]]
    parquet.write_table(pa.table(content, schema=stated), tmp_path / "stated.parquet")
    code, again, err = gyrobench("reduce", "drift_record", "--data", "stated.parquet", "--json")
    assert code == 0, err  # units and statements in the metadata, which a table of text has not
    first, second = (json.loads(t) for t in (out, again))
    assert second["provenance"]["instrument"] == "gyro 17"
    n = first["coefficients"][0]["estimate"]
    assert second["coefficients"][0]["estimate"] == pytest.approx(n, rel=1e-6)
    days = np.datetime64("2026-03-01T08:00:00") + np.arange(2000) * np.timedelta64(10, "ms")
    parquet.write_table(pa.table({"time": days, "rate [deg/s]": made["rate [deg/s]"]}), tmp_path / "days.parquet")
    code, again, err = gyrobench("reduce", "drift_record", "--data", "days.parquet", "--json")
    assert code == 0 and json.loads(again)["coefficients"][0]["estimate"] == pytest.approx(n, rel=1e-6), err
    code, _, err = gyrobench("reduce", "drift_record", "--data", "log.parquet", "--columns", "none.toml")
    assert code == 2 and "none.toml" in err
    parquet.write_table(
        pa.table({"time [s]": made["time [s]"], "rate": made["rate [deg/s]"]}), tmp_path / "bare.parquet"
    )
    code, _, err = gyrobench("reduce", "drift_record", "--data", "bare.parquet")
    assert code == 2 and "bare.parquet: not usable" in err and "gyrobench-temporary" not in err


def test_a_flight_log_needs_no_hand(gyrobench: Command, tmp_path: Path) -> None:
    """Of two topics the one whose messages tell units; time of integration is no rate.  gyro_z of row 7: 7/1024."""
    write_flight_log(tmp_path / "log.ulg")
    code, text, err = gyrobench("fit", "log.ulg", "--system", "drift_record")
    assert code == 0 and "by hand" not in err, err
    made = tomllib.loads(text)
    assert made["table"] == "sensor_combined"
    assert {n: c["unit"] for n, c in made["columns"].items()} == {
        "time": "us", **{f"gyro_{a}": "rad/s" for a in "xyz"}, **{f"acc_{a}": "m/s2" for a in "xyz"}
    }  # fmt: skip
    assert arrow.read_csv(as_text(tmp_path / "log.ulg", "sensor_combined"))["gyro_z [rad/s]"][7].as_py() == 7 / 1024


@pytest.mark.long
def test_the_first_column_of_a_matrix_may_be_its_time(gyrobench: Command, tmp_path: Path) -> None:
    random = np.random.default_rng(4)
    for name, first in (("stamped", np.arange(600) * 0.01), ("bare", random.normal(size=600))):
        np.savez(tmp_path / f"{name}.npz", gyro=np.column_stack([first, random.normal(size=(600, 2))]))
        _, text, _ = gyrobench("fit", f"{name}.npz", "--system", "drift_record")
        assert ('[columns.time]\nfrom = "gyro_1"' in text) == (name == "stamped"), text
        assert '[columns.gyro_2]\nfrom = "gyro_2"' in text
