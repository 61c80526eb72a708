"""A program of its own that reads a log: readers of damaged or hostile files may end their process, or fill memory.

python log_contents.py FILE                 the tables of a log, JSON to standard output
python log_contents.py FILE TABLE OUT.csv   the same; one of them, "" the only one, as text: names with units, numbers
python log_contents.py FILE FOLDER          the first rows of the first tables, as FOLDER/0.csv, 1.csv ...

A table is what has common rows: a group, a topic, a sheet, arrays of one length.  Code 1 with the reason, the last line
of standard error, where the file cannot be read; code 4 with the name of a package that is missing.
"""

from __future__ import annotations

import contextlib
import datetime
import io
import json
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

MISSING = 4
HEADS, ROWS = 40, 3000  # tables and rows of each in a folder
#: topics of PX4 -> field -> name and unit of its message
PX4 = {
    "sensor_combined": {"gyro_rad": ("gyro", "rad/s"), "accelerometer_m_s2": ("acc", "m/s2")},
    "sensor_gyro": {a: (f"gyro_{a}", "rad/s") for a in "xyz"} | {"temperature": ("temperature", "degC")},
    "sensor_accel": {a: (f"acc_{a}", "m/s2") for a in "xyz"} | {"temperature": ("temperature", "degC")},
    "vehicle_angular_velocity": {"xyz": ("gyro", "rad/s")},
    "vehicle_acceleration": {"xyz": ("acc", "m/s2")},
}
#: beginning of a name in messages of ROS -> unit of their definition
ROS = {"angular_velocity.": "rad/s", "linear_acceleration.": "m/s2"}
OBJECTS = "objects of MATLAB ({}): in MATLAB write each as text: writetimetable(NAME, 'NAME.csv'), or writetable"
Columns = dict[str, Any]  # name, with its unit in brackets -> array of one dimension
Tables = Iterator[tuple[str, Callable[[], Columns]]]


def _named(name: object, unit: object) -> str:
    text = str(unit or "").strip()
    return f"{name} [{text}]" if text and text not in ("-", "1") else str(name)


def _by_length(arrays: Mapping[str, Any]) -> Tables:
    """Yield arrays that are equally long as tables; those of two dimensions as a column each."""
    groups: dict[int, Columns] = {}
    for name, array in arrays.items():
        if getattr(array, "ndim", 0) == 2 and 1 in array.shape:
            array = array.reshape(-1)
        if getattr(array, "ndim", 0) == 2 and array.shape[0] < array.shape[1]:  # a record is longer than it is wide
            array = array.T
        if getattr(array, "ndim", 0) not in (1, 2) or array.dtype.kind not in "biufM" or array.size == 0:
            continue
        several = {name: array} if array.ndim == 1 else {f"{name}_{k + 1}": array[:, k] for k in range(array.shape[1])}
        groups.setdefault(len(array), {}).update(several)
    for length, columns in sorted(groups.items(), key=lambda g: -g[0] * len(g[1])):
        yield f"{length} rows", lambda columns=columns: columns  # type: ignore[misc]


def _parquet(file: Path) -> Tables:
    from pyarrow import feather, parquet

    made = (feather.read_table if file.suffix.lower() in (".feather", ".arrow") else parquet.read_table)(str(file))
    yield "table", lambda: {n: made[n].to_numpy(zero_copy_only=False) for n in made.column_names}


def _numpy(file: Path) -> Tables:
    import numpy as np

    content: Any = np.load(file, allow_pickle=False)
    if isinstance(content, np.ndarray):
        content = {n: content[n] for n in content.dtype.names} if content.dtype.names else {"column": content}
    yield from _by_length(dict(content))


def _mat(file: Path) -> Tables:
    with file.open("rb") as data:
        if b"MATLAB 7.3" in data.read(128):
            yield from _hdf5(file)
            return
    from scipy.io import loadmat
    from scipy.io.matlab import MatlabOpaque

    flat: Columns = {}
    objects = set()

    def add(name: str, value: Any) -> None:
        if isinstance(value, MatlabOpaque):
            objects.add(value["s2"].item().decode(errors="replace"))
        elif getattr(value, "dtype", None) is not None and value.dtype.names and value.size == 1:
            for field in value.dtype.names:
                add(f"{name}.{field}", value[field].reshape(-1)[0])
        else:
            flat[name] = value

    for name, value in loadmat(file).items():
        if not name.startswith("__"):
            add(name, value)
    if objects and not flat:
        sys.exit(OBJECTS.format(", ".join(sorted(objects))))
    yield from _by_length(flat)


def _hdf5(file: Path) -> Tables:
    import h5py

    groups: dict[str, Columns] = {}
    objects = set()

    def visit(path: str, found: Any) -> None:
        if not isinstance(found, h5py.Dataset) or path.startswith("#"):
            return
        if "MATLAB_object_decode" in found.attrs:
            objects.add(found.attrs["MATLAB_class"].decode(errors="replace"))
            return
        unit = found.attrs.get("units", found.attrs.get("unit", ""))
        unit = unit.decode() if isinstance(unit, bytes) else unit if isinstance(unit, str) else ""
        group, _, name = path.rpartition("/")
        if found.dtype.names:  # a table of its own
            groups[path] = {n: found[n] for n in found.dtype.names}
        elif found.ndim in (1, 2) and found.attrs.get("MATLAB_class") != b"char":
            # MATLAB writes column by column, so that what is there are the rows of its matrix
            groups.setdefault(group, {})[_named(name, unit)] = (
                found[()].T if "MATLAB_class" in found.attrs else found[()]
            )

    content = h5py.File(file, "r")
    content.visititems(visit)
    if objects and not groups:
        sys.exit(OBJECTS.format(", ".join(sorted(objects))))
    for group, arrays in groups.items():
        several = list(_by_length(arrays))
        for name, columns in several:
            yield group if group and len(several) == 1 else f"{group}: {name}" if group else name, columns


def _mdf(file: Path) -> Tables:
    from asammdf import MDF

    log: Any = MDF(file)
    for k, group in enumerate(log.groups):

        def columns(k: int = k, group: Any = group) -> Columns:
            found: Columns = {}
            for channel in group.channels:
                if channel.channel_type in (2, 3):  # the master: its times come with every other channel
                    continue
                signal = log.get(channel.name, group=k)
                found["time [s]"] = signal.timestamps
                found[_named(signal.name, signal.unit)] = signal.samples
            return found

        name = getattr(group.channel_group, "acq_name", None) or group.channel_group.comment or ""
        yield f"{k + 1} {name}".strip(), columns


def _tdms(file: Path) -> Tables:
    from nptdms import TdmsFile

    for group in TdmsFile.read(file).groups():
        found: Columns = {}
        for channel in group.channels():
            unit = channel.properties.get("unit_string") or channel.properties.get("NI_UnitDescription")
            if "wf_increment" in channel.properties:
                found.setdefault("time [s]", channel.time_track())
            found[_named(channel.name, unit)] = channel[:]
        several = list(_by_length(found))
        for name, columns in several:
            yield group.name if len(several) == 1 else f"{group.name}: {name}", columns


def _ulog(file: Path) -> Tables:
    from pyulog import ULog

    topics = ULog(str(file)).data_list
    many = {t.name for t in topics if t.multi_id}

    def named(field: str, topic: Any) -> str:
        name, _, index = field.rstrip("]").partition("[")  # an element of an array: gyro_rad[0]
        name, unit = PX4.get(topic.name, {}).get(name, (name, "us" if name == "timestamp" else ""))
        of_three = f"{field.partition('[')[0]}[2]" in topic.data and f"{field.partition('[')[0]}[3]" not in topic.data
        ending = "_xyz"[1 + int(index)] if index and of_three else index
        return _named(f"{name}_{ending}" if ending else name, unit)

    for topic in topics:
        name = f"{topic.name} {topic.multi_id}" if topic.name in many else topic.name
        yield name, lambda t=topic: {named(n, t): v for n, v in t.data.items()}  # type: ignore[misc]


def _bag(file: Path) -> Tables:
    """Yield topics: the time of each message in s since the first, and every number in it."""
    import numpy as np
    from rosbags.highlevel import AnyReader

    reader = AnyReader([file if file.suffix != ".db3" else file.parent])
    reader.open()

    def numbers(message: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
        for name, value in vars(message).items():
            if isinstance(value, bool | int | float):
                yield prefix + name, float(value)
            elif isinstance(value, np.ndarray) and value.size <= 36 and value.dtype.kind in "biuf":
                yield from ((f"{prefix}{name}_{k + 1}", float(v)) for k, v in enumerate(value))
            elif hasattr(value, "__dataclass_fields__"):
                yield from numbers(value, f"{prefix}{name}.")

    for connection in reader.connections:

        def columns(connection: Any = connection) -> Columns:
            rows, times = [], []
            for _, stamp, raw in reader.messages([connection]):
                message = reader.deserialize(raw, connection.msgtype)
                rows.append(dict(numbers(message)))
                sampled = getattr(getattr(message, "header", None), "stamp", None)  # else when it was received
                times.append(
                    sampled.sec * 10**9 + sampled.nanosec if sampled and (sampled.sec or sampled.nanosec) else stamp
                )
            ns = np.asarray(times, dtype=np.int64)
            units = {n: next((u for k, u in ROS.items() if n.startswith(k)), "") for n in (rows[0] if rows else {})}
            made = {_named(n, u): np.array([r.get(n, np.nan) for r in rows]) for n, u in units.items()}
            return {"time [s]": (ns - ns[0]) / 1e9, **made} if rows else {}

        yield connection.topic, columns


def _excel(file: Path) -> Tables:
    from openpyxl import load_workbook

    for sheet in load_workbook(file, read_only=True, data_only=True).worksheets:
        yield sheet.title, lambda sheet=sheet: {"": _sheet_rows(file, sheet)}  # type: ignore[misc]


def _sheet_rows(file: Path, sheet: Any) -> list[list[Any]]:
    """Return the cells of a sheet.  Exits where a program wrote formulas into it and no spreadsheet their values."""
    from openpyxl import load_workbook

    rows = [list(r) for r in sheet.iter_rows(values_only=True)]
    if any(None in row for row in rows):
        written = load_workbook(file, read_only=True)[sheet.title].iter_rows(values_only=True)
        pairs = (
            (value, cell)
            for row, cells in zip(rows, written, strict=False)
            for value, cell in zip(row, cells, strict=False)
        )
        if bare := sum(value is None and str(cell).startswith("=") for value, cell in pairs):
            sys.exit(f"sheet {sheet.title}: {bare} formulas without a value; open and save the file in a spreadsheet")
    return rows


def flat_width(file: Path) -> int:
    """Return how many numbers a row has of a file of 8-byte numbers, the first of each row a time; 0 of any other."""
    import numpy as np

    size = file.stat().st_size
    with file.open("rb") as data:
        begin = data.read(1 << 16)
    if size % 8 or b"\0" not in begin:
        return 0
    values = np.frombuffer(begin[: len(begin) // 8 * 8], "<f8")
    if not (np.abs(values) < 1e12).all():
        return 0
    for width in (w for w in range(2, 33) if size % (8 * w) == 0 and len(values) >= 20 * w):
        steps = np.diff(values[: len(values) // width * width : width])
        if steps.min() > 0.0 and steps.max() < 10.0 * np.median(steps):
            return width
    return 0


def _flat(file: Path) -> Tables:
    import numpy as np

    rows = np.fromfile(file, "<f8").reshape(-1, flat_width(file))
    yield "rows", lambda: {f"column_{k + 1}": rows[:, k] for k in range(rows.shape[1])}


READERS: dict[str, Callable[[Path], Tables]] = {
    ".parquet": _parquet, ".feather": _parquet, ".arrow": _parquet, ".npy": _numpy, ".npz": _numpy, ".mat": _mat,
    ".h5": _hdf5, ".hdf5": _hdf5, ".mf4": _mdf, ".mdf": _mdf, ".tdms": _tdms, ".ulg": _ulog, ".bag": _bag,
    ".mcap": _bag, ".db3": _bag, ".xlsx": _excel, ".xlsm": _excel,
}  # fmt: skip


def _cell(value: Any) -> str:
    if isinstance(value, datetime.datetime):
        return f"{value:%Y-%m-%d %H:%M:%S.%f}"
    return "" if value is None else str(value)


def _write(columns: Columns, out: Path) -> None:
    import csv

    import numpy as np

    if "" in columns:  # a sheet: rows of cells as they are, no empty ones at the end
        with out.open("w", encoding="utf-8", newline="") as text:
            csv.writer(text, lineterminator="\n").writerows([_cell(c) for c in row] for row in columns[""])
        return
    import pyarrow as pa
    from pyarrow import csv as arrow

    arrays = {}
    for name, values in columns.items():
        array = np.asarray(values)
        if array.dtype.kind == "M":  # a date: seconds since the first
            since = (array - array[0]) / np.timedelta64(1, "ns") / 1e9
            name, array = f"{re.sub(r' *[[].*', '', name)} [s]", np.asarray(since, dtype=float)
        if array.dtype.kind in "biuf" and array.ndim == 1:
            arrays[name] = pa.array(array.astype(float) if array.dtype.kind in "bf" else array, from_pandas=True)
    if not arrays:
        sys.exit("no column of numbers")
    header = io.StringIO()
    csv.writer(header, lineterminator="\n").writerow(arrays)
    with out.open("wb") as text:  # the header apart: pyarrow would put every name in quotes
        text.write(header.getvalue().encode())
        arrow.write_csv(pa.table(arrays), text, arrow.WriteOptions(include_header=False))


def main() -> None:
    file = Path(sys.argv[1])
    try:
        with contextlib.redirect_stdout(sys.stderr):  # what readers say of their own
            tables = list(READERS.get(file.suffix.lower(), _flat)(file))
            wanted = sys.argv[2] if len(sys.argv) == 4 else None
            for name, columns in tables:
                if name == wanted or (wanted == "" and len(tables) == 1):
                    _write(columns(), Path(sys.argv[3]))
            for k, (_, columns) in enumerate(tables[:HEADS] if len(sys.argv) == 3 else []):
                with contextlib.suppress(SystemExit):  # no column of numbers
                    _write({n: v[:ROWS] for n, v in columns().items()}, Path(sys.argv[2]) / f"{k}.csv")
    except ImportError as error:
        print(error.name or error, file=sys.stderr)
        sys.exit(MISSING)
    except Exception as error:  # of any kind, where the file is damaged
        sys.exit(f"{type(error).__name__}: {str(error)[:200]}")
    print(json.dumps([name for name, _ in tables]))


if __name__ == "__main__":
    main()
