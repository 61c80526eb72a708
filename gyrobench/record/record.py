"""The record of a run: one folder, in the same form for simulated and measured data.

``record.parquet``   one row for each completed window (columns in SI, see the Sampler socket)
``channels.parquet`` decimated signals: ``time`` and "slot.variable" columns
``run.json``         system, parts with SHA-256, parameters, seed, versions, order, step, complete, stopped_at

Without pyarrow the tables are CSV files of the same names; numbers are written so that they read back bit for bit.
Every file is written under a temporary name and renamed, run.json last: a folder with run.json is whole.
"""

from __future__ import annotations

import csv
import json
import math
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.errors import GyrobenchError

Array = np.ndarray[Any, Any]
#: what a record may say of its circumstances, beside instrument and operator, for a report that is signed
ABOUT = ("laboratory", "customer", "conditions", "equipment")
WHOLE = ("phase", "n", "flagged")  # integer columns


class RecordError(GyrobenchError):
    """A record that cannot be read; the text says which file and why."""


def _replace(path: Path, write: Callable[[Path], object]) -> None:
    """Writes a file under a temporary name beside ``path`` and renames it."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".part")
    os.close(handle)
    temporary = Path(name)
    try:
        write(temporary)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _have_parquet() -> bool:
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        return False
    return True


def write_table(stem: Path, columns: dict[str, Array]) -> Path:
    """Writes ``stem``.parquet, or ``stem``.csv without pyarrow; the other form is removed.  Returns the path."""
    parquet, text = stem.with_suffix(".parquet"), stem.with_suffix(".csv")
    if _have_parquet():
        import pyarrow as pa
        import pyarrow.parquet as pq

        _replace(parquet, lambda p: pq.write_table(pa.table(columns), p))
        text.unlink(missing_ok=True)
        return parquet

    def write(p: Path) -> None:
        with p.open("w", newline="", encoding="utf-8") as f:
            writer = csv.writer(f)
            writer.writerow(columns)
            writer.writerows(zip(*([repr(x) for x in c.tolist()] for c in columns.values()), strict=True))

    _replace(text, write)
    parquet.unlink(missing_ok=True)
    return text


def read_table(stem: Path) -> dict[str, Array] | None:
    """The columns of ``stem``.parquet or ``stem``.csv; None if there is neither."""
    parquet, text = stem.with_suffix(".parquet"), stem.with_suffix(".csv")
    if parquet.exists():
        import pyarrow.parquet as pq

        table = pq.read_table(parquet)
        return {name: table.column(name).to_numpy() for name in table.column_names}
    if text.exists():
        with text.open(newline="", encoding="utf-8") as f:
            names, *rows = list(csv.reader(f))
        columns = [np.array([float(r[k]) for r in rows]) for k in range(len(names))]
        return {n: c.astype(np.int64) if n in WHOLE else c for n, c in zip(names, columns, strict=True)}
    return None


def _plain(value: Any) -> Any:
    """The same without numbers that JSON lacks: an infinite bound or parameter of a foreign FMU becomes text."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


@dataclass
class Record:
    """What a run left: windows, channels and where they come from."""

    windows: dict[str, Array] = field(default_factory=dict)
    channels: dict[str, Array] = field(default_factory=dict)
    meta: dict[str, Any] = field(default_factory=dict)
    folder: Path | None = None

    def save(self, folder: Path) -> Path:
        """Writes the folder (see the module) and returns it."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        write_table(folder / "record", self.windows)
        if self.channels:
            write_table(folder / "channels", self.channels)
        text = json.dumps(_plain(self.meta), indent=1, ensure_ascii=False, allow_nan=False)
        _replace(folder / "run.json", lambda p: p.write_text(text + "\n", encoding="utf-8"))
        self.folder = folder
        return folder

    @classmethod
    def load(cls, folder: Path) -> Record:
        """Reads a folder.  Raises RecordError when it is not a record."""
        folder = Path(folder)
        try:
            meta = json.loads((folder / "run.json").read_text("utf-8"))
            windows = read_table(folder / "record")
            channels = read_table(folder / "channels")
        except (OSError, ValueError, IndexError) as error:
            raise RecordError(f"{folder}: not a readable record: {error}") from None
        if windows is None:
            raise RecordError(f"{folder}: has run.json but neither record.parquet nor record.csv")
        return cls(windows, channels or {}, meta, folder)

    def same_data(self, other: Record) -> bool:
        """True when windows and channels are equal bit for bit."""
        for a, b in ((self.windows, other.windows), (self.channels, other.channels)):
            if list(a) != list(b) or any(a[k].tobytes() != b[k].tobytes() for k in a):
                return False
        return True

    @property
    def complete(self) -> bool:
        """False when the run was interrupted or failed."""
        return bool(self.meta.get("complete", True))


def rows_to_columns(rows: list[Array], names: list[str], time: bool) -> dict[str, Array]:
    """Blocks of rows [t, columns...] -> named columns; with ``time`` the first one is kept as "time"."""
    blocks = [r if r.ndim == 2 else r[None, :] for r in rows]
    table = np.concatenate(blocks) if blocks else np.empty((0, 1 + len(names)))
    found = {"time": np.ascontiguousarray(table[:, 0])} if time else {}
    for k, name in enumerate(names, 1):
        column = np.ascontiguousarray(table[:, k])
        found[name] = column.astype(np.int64) if name in WHOLE and not time else column
    return found
