"""Logs in the formats of other programs as text: one table of a file becomes a CSV, which is then read as any other.

Parquet, Feather, NumPy and MATLAB 5 need no further package; MATLAB 7.3, HDF5, MDF4, TDMS, ULog, ROS bags, MCAP and
Excel those of ``gyrobench[logs]``.  Names carry their unit where the format has one (``gyro_x [rad/s]``); dates become
seconds since the first row.  Files of 8-byte numbers alone, a time first in each row, are told by their content.
The file is read by a process of its own (:mod:`gyrobench.record.log_contents`).

Not modelled: rows of several tables side by side; messages of more than 36 numbers in an array.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from gyrobench.bench import suggest_names
from gyrobench.files import temporary_folder
from gyrobench.reading import LARGEST
from gyrobench.record.csv_reader import DataError, regular
from gyrobench.record.log_contents import MISSING, READERS, flat_width

MOST = 32 * LARGEST  # bytes


def is_log(file: Path) -> bool:
    """Return whether a file is of one of the formats, by the end of its name, or nothing but numbers of 8 bytes."""
    return file.is_file() and (file.suffix.lower() in READERS or flat_width(file) > 0)


def tables_of(file: Path) -> list[str]:
    """Return the names of the tables of a log.  Raises DataError."""
    names: list[str] = json.loads(_read(file))
    if not names:
        raise DataError(file, ["no table of numbers in it"])
    return names


def heads_of(file: Path) -> dict[str, Path]:
    """Return the first rows of the first tables with numbers of a log, by their names, as CSV.  Raises DataError."""
    folder = temporary_folder()
    names: list[str] = json.loads(_read(file, str(folder)))
    return {n: head for k, n in enumerate(names) if (head := folder / f"{k}.csv").is_file()}


def as_text(file: Path, table: str = "") -> Path:
    """Return a CSV file of a table of a log; "": the only one.  It lasts as long as the process.  Raises DataError."""
    out = temporary_folder() / f"{file.stem}.csv"
    names: list[str] = json.loads(_read(file, table, str(out)))
    if not names:
        raise DataError(file, ["no table of numbers in it"])
    if not table and len(names) > 1:
        shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
        raise DataError(file, [f'several tables: {shown}; name one in a column map: table = "{names[0]}"'])
    if table and table not in names:
        raise DataError(file, [f"no table '{table}'; {suggest_names(table, names)}"])
    return out


def _read(file: Path, *more: str) -> bytes:
    """Return what the program of its own prints of a log.  Raises DataError with the reason where it cannot read it."""
    from gyrobench.record import log_contents

    if regular(file).stat().st_size > MOST:
        raise DataError(file, [f"larger than {MOST >> 30} GB"])
    program = [sys.executable, "-P", str(Path(log_contents.__file__)), str(file), *more]
    done = subprocess.run(program, capture_output=True, check=False)
    if done.returncode == 0:
        return done.stdout
    said = done.stderr.decode(errors="replace").strip().split("\n")[-1]
    if done.returncode == MISSING:
        raise DataError(file, [f"{file.suffix} files need a further package ({said}): pip install 'gyrobench[logs]'"])
    why = said if done.returncode == 1 else "it ended the program that read it"
    raise DataError(file, [f"cannot be read as {file.suffix}: {why}"])
