"""The record of a run: one folder, in the same form for simulated and measured data.

``record.parquet``   one row for each completed window (columns in SI, see the Sampler socket)
``channels.parquet`` decimated signals: ``time`` and "slot.variable" columns
``run.json``         system, parts with SHA-256, parameters, seed, versions, order, step, complete, stopped_at,
                     SHA-256 of the tables and of itself: :mod:`gyrobench.record.run_document`

Without pyarrow the tables are CSV files of the same names; numbers are written so that they read back bit for bit.
Every file is written under a temporary name and renamed once it is on the disk, run.json last: a folder with it is
complete.  The digests are checked whenever a record is read.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gyrobench.arrays import AnyArray
from gyrobench.bench import UsageError
from gyrobench.boundary import checked
from gyrobench.files import sha256, write_whole
from gyrobench.notebook import Displayed, data_frame
from gyrobench.record.mapped_column import mapped
from gyrobench.record.run_document import RecordError, RunDocument, SuiteDocument, read_run

if TYPE_CHECKING:
    import pandas

WHOLE = ("phase", "n", "flagged")  # integer columns
SUFFIXES = (".parquet", ".csv")
LONG = 1 << 18  # rows: a longer column that is read on request stays on the disk
TURNED = 512  # rows that are made columns at a time


def _have_parquet() -> bool:
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        return False
    return True


def write_table(stem: Path, columns: dict[str, AnyArray]) -> Path:
    """Write ``stem``.parquet, or ``stem``.csv without pyarrow; remove the other form; return the path."""
    parquet, text = stem.with_suffix(".parquet"), stem.with_suffix(".csv")
    if _have_parquet():
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = pa.table([_arrow(c) for c in columns.values()], names=list(columns))

        def save(path: Path) -> None:
            with path.open("wb") as file:  # not by its name, which may not be UTF-8
                pq.write_table(table, file)

        write_whole(parquet, save)
        text.unlink(missing_ok=True)
        return parquet

    write_whole(text, partial(_write_csv, list(columns), list(columns.values())))
    parquet.unlink(missing_ok=True)
    return text


def _arrow(column: AnyArray) -> Any:
    """Return a column as Arrow has it.  pa.array() and pq.read_table() import pandas where it is there: 0.3 s."""
    import pyarrow as pa

    if column.dtype.kind not in "fiu":
        return pa.array(column)
    column = np.ascontiguousarray(column)
    return pa.Array.from_buffers(pa.from_numpy_dtype(column.dtype), len(column), [None, pa.py_buffer(column)])


def _numpy(column: Any) -> AnyArray:
    """Return a column of Arrow's, as :func:`_arrow` takes one: to_numpy() imports pandas, too."""
    dtype = np.dtype(column.type.to_pandas_dtype())
    if dtype.kind not in "fiu" or column.null_count or not column.num_chunks:
        return np.asarray(column.to_numpy())
    parts = (np.frombuffer(c.buffers()[1], dtype)[c.offset : c.offset + len(c)] for c in column.chunks)
    return np.concatenate(list(parts))


def _write_csv(header: list[str], columns: list[AnyArray], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as f:
        writer = csv.writer(f)
        writer.writerow(header)
        writer.writerows(zip(*([repr(x) for x in c.tolist()] for c in columns), strict=True))


def remove_table(stem: Path) -> None:
    """Remove ``stem``.parquet and ``stem``.csv."""
    for suffix in SUFFIXES:
        stem.with_suffix(suffix).unlink(missing_ok=True)


def read_table(stem: Path) -> dict[str, AnyArray] | None:
    """Return the columns of ``stem``.parquet or ``stem``.csv; None if there is neither."""
    parquet, text = stem.with_suffix(".parquet"), stem.with_suffix(".csv")
    if parquet.exists():
        import pyarrow.parquet as pq

        with parquet.open("rb") as data, pq.ParquetFile(data) as file:
            table = file.read()
        return {name: _numpy(table.column(name)) for name in table.column_names}
    if text.exists():
        with text.open(newline="", encoding="utf-8") as f:
            names, *rows = list(csv.reader(f))
        columns = [np.array([float(r[k]) for r in rows]) for k in range(len(names))]
        if wrong := [n for n, c in zip(names, columns, strict=True) if n in WHOLE and not np.all(np.abs(c) < 2.0**53)]:
            raise ValueError(f"column '{wrong[0]}' holds numbers that are not whole")
        return {n: c.astype(np.int64) if n in WHOLE else c for n, c in zip(names, columns, strict=True)}
    return None


class ColumnsOnRequest(Mapping[str, AnyArray]):
    """Columns of a Parquet table by name, each read when it is first asked for."""

    def __init__(self, file: Path) -> None:
        import pyarrow.parquet as pq

        self.file = file
        self.read: dict[str, AnyArray] = {}
        with file.open("rb") as data, pq.ParquetFile(data) as table:
            self.names = list(table.schema_arrow.names)

    def __getitem__(self, name: str) -> AnyArray:
        if name not in self.names:
            raise KeyError(name)
        if name not in self.read:
            import pyarrow.parquet as pq

            with self.file.open("rb") as data, pq.ParquetFile(data) as table:
                if table.metadata.num_rows > LONG:
                    blocks = (b.column(0) for b in table.iter_batches(LONG, columns=[name]))
                    self.read[name] = mapped(np.asarray(b.to_numpy(zero_copy_only=False)) for b in blocks)
                else:
                    self.read[name] = _numpy(table.read(columns=[name]).column(0))
        return self.read[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


@dataclass(repr=False)
class Record(Displayed):
    """The record of a run: windows, channels and their provenance (run.json).

    record.windows["mean"], record.channels["gyro.u"]    numpy arrays, SI
    record.frame("windows"), record.frame("channels")    pandas data frames, units in attrs["units"]
    record.to_csv(folder)                                windows.csv and channels.csv, units in the header
    """

    windows: dict[str, AnyArray] = field(default_factory=dict)
    channels: dict[str, AnyArray] = field(default_factory=dict)
    run: RunDocument = field(default_factory=lambda: RunDocument())
    folder: Path | None = None

    @checked
    def save(self, folder: Path) -> Path:
        """Write the folder (see the module) and return it."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        files = [write_table(folder / "record", self.windows)]
        if self.channels:
            files.append(write_table(folder / "channels", self.channels))
        else:
            remove_table(folder / "channels")
        self.run.tables = {file.name: sha256(file) for file in files}
        self.run.write(folder)
        self.folder = folder
        return folder

    @classmethod
    @checked
    def load(cls, folder: Path, on_request: bool = False) -> Record:
        """Read a folder.  Raises RecordError when it is not a record, or when a table is not the one that was saved.

        on_request: a channel is read when it is first asked for by ``channels[name]``, to look at long records.
        """
        folder = Path(folder)
        run = read_run(folder)
        if isinstance(run, SuiteDocument):
            tests = ", ".join(str(folder / test.folder) for test in run.tests.values()) or "none yet"
            raise RecordError(f"{folder}: the run of a suite; its tests have a record each: {tests}")
        _check_tables(folder, run)
        try:
            windows = read_table(folder / "record")
            long = on_request and (folder / "channels.parquet").is_file()
            channels: Any = ColumnsOnRequest(folder / "channels.parquet") if long else read_table(folder / "channels")
        except (OSError, ValueError, IndexError, NotImplementedError, csv.Error) as error:
            raise RecordError(f"{folder}: not a readable record: {error}") from None
        if windows is None:
            raise RecordError(f"{folder}: has run.json but neither record.parquet nor record.csv")
        return cls(windows, channels or {}, run, folder)

    def __repr__(self) -> str:
        samples = len(next(iter(self.channels.values()), ()))
        windows = len(next(iter(self.windows.values()), ()))
        signals = max(0, len(self.channels) - 1)
        state = "" if self.complete else ", incomplete"
        return f"<Record of {self.run.system}: {windows} windows, {signals} channels of {samples} samples{state}>"

    @checked
    def table(self, name: str) -> tuple[dict[str, AnyArray], dict[str, str]]:
        """Return the columns of "windows" or "channels" and their SI units, "" where not known.  Raises UsageError."""
        tables = {"windows": (self.windows, self.run.window_units), "channels": (self.channels, self.run.units)}
        if name not in tables:
            raise UsageError(f"{name}: not a table of a record; available: {', '.join(tables)}")
        columns, units = tables[name]
        return columns, {c: "s" if c == "time" else units.get(c, "") for c in columns}

    @checked
    def frame(self, table: str = "windows") -> pandas.DataFrame:
        """Return "windows" or "channels" as a data frame, SI; its ``attrs["units"]`` says the units.

        Raises MissingPackageError without pandas, and UsageError for another table.
        """
        return data_frame(*self.table(table))

    @checked
    def to_csv(self, folder: Path) -> list[Path]:
        """Write windows.csv and channels.csv into a folder, those that have rows; return the files.

        SI, "name [unit]" in the header (no unit where it is 1 or not known); numbers read back bit for bit.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        files = []
        for name in ("windows", "channels"):
            columns, units = self.table(name)
            if columns:
                header = [f"{c} [{units[c]}]" if units[c] not in ("", "1") else c for c in columns]
                write_whole(folder / f"{name}.csv", partial(_write_csv, header, list(columns.values())))
                files.append(folder / f"{name}.csv")
        return files

    def same_data(self, other: Record) -> bool:
        """True when windows and channels are equal bit for bit."""
        for a, b in ((self.windows, other.windows), (self.channels, other.channels)):
            if list(a) != list(b) or any(a[k].tobytes() != b[k].tobytes() for k in a):
                return False
        return True

    @property
    def complete(self) -> bool:
        """Return True if the run came to its end; False where it was interrupted or failed."""
        return self.run.complete


def _check_tables(folder: Path, run: RunDocument) -> None:
    """Raise RecordError for a table that is missing, was changed or was added after the record was saved.

    An old run.json names no tables: then none is checked.
    """
    if not run.tables:
        return
    remedy = "restore it from a copy, or repeat the run; your own data are reduced by gyrobench reduce"
    for name, digest in run.tables.items():
        file = folder / name
        if not file.is_file():
            raise RecordError(f"{file}: missing, but named in run.json; {remedy}")
        if sha256(file) != digest:
            raise RecordError(f"{file}: changed after it was saved (its SHA-256 is not the one in run.json); {remedy}")
    for file in (folder / (stem + suffix) for stem in ("record", "channels") for suffix in SUFFIXES):
        if file.is_file() and file.name not in run.tables:
            raise RecordError(f"{file}: not a table of this record (run.json does not name it); remove it")


def rows_to_columns(rows: list[AnyArray], names: list[str], time: bool) -> dict[str, AnyArray]:
    """Return blocks of rows [t, columns...] as named columns; with ``time`` the first one is kept as "time".

    A few rows are turned while they are in the processor's cache: a column of a block would fetch the block.
    """
    blocks = [r if r.ndim == 2 else r[None, :] for r in rows]
    if len(blocks) > 1 and max(len(b) for b in blocks) == 1:  # of the reference engine
        blocks = [np.concatenate(blocks)]
    table, at = np.empty((1 + len(names), sum(len(b) for b in blocks))), 0
    for few in (b[k : k + TURNED] for b in blocks for k in range(0, len(b), TURNED)):
        table[:, at : at + len(few)] = few.T
        at += len(few)
    columns: dict[str, AnyArray] = {"time": table[0]} if time else {}
    for name, column in zip(names, table[1:], strict=True):
        columns[name] = column.astype(np.int64) if name in WHOLE and not time else column
    return columns
