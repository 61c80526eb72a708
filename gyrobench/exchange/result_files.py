"""Result files of other tools as named series, whatever the format.

CSV (FMPy, OpenModelica), a folder or a file of libcosim's file observer, a structured numpy array (FMPy; .npy),
MATLAB .mat up to version 7 (arrays, structs of arrays, or the trajectory layout of Modelica tools), Parquet.  The
format is told from the content of the file.  Raises DataError for what cannot be read, with the remedy.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from gyrobench.arrays import AnyArray
from gyrobench.exchange.mat_files import SEVEN_THREE, is_mat, read_mat
from gyrobench.record.csv_reader import CsvColumn, DataError, Head, for_arrow, read_head, regular

Block = dict[str, AnyArray]
ROWS = 1 << 16  # of a block
TIME = ("time", "simulation_time", "tout", "t")
LIBCOSIM = re.compile(r"(.+)_\d{8}_\d{6}_\d+\.csv")  # slot, date, time, microseconds
TYPE_OF_COLUMN = re.compile(r"\s*\[\d+ \w+ \w+\]$")  # "count [8 real output]", of older versions of libcosim


@dataclass(frozen=True)
class ResultFile:
    """The series of a run.

    read: names -> blocks of rows with these columns, one for each name.  time: name of the independent variable.
    constants: what the file states once, the parameters of a Modelica tool.
    """

    name: str
    names: Sequence[str]
    time: str
    read: Callable[[Sequence[str]], Iterator[Block]]
    constants: Mapping[str, float] = field(default_factory=dict)


def open_result(source: Path | AnyArray) -> ResultFile:
    """Return the series of a file, of a folder of libcosim, or of a structured array.  Raises DataError."""
    if isinstance(source, np.ndarray):
        return _of_array("the array", source)
    if source.is_dir():
        return _of_folder(source)
    try:
        with regular(source).open("rb") as file:
            begin = file.read(128)
    except OSError as error:
        raise DataError(source, [f"cannot be read: {error.strerror}"]) from None
    if begin.startswith(b"\x93NUMPY"):
        return _of_npy(source)
    if begin.startswith(b"PAR1"):
        return _of_parquet(source)
    if begin.startswith((b"MATLAB 7.3", b"\x89HDF")):
        raise DataError(source, [SEVEN_THREE])
    if begin.startswith(b"PK"):
        raise DataError(source, ["an archive (zip), no result file; unpack it, and name the file with the series"])
    if is_mat(begin):
        columns, constants = read_mat(source)
        return _of_columns(source, columns, constants)
    if b"\0" in begin:
        raise DataError(source, ["neither CSV nor .npy, .mat or Parquet"])
    return _of_csv(source)


def _time_of(file: Path | str, names: Sequence[str]) -> str:
    lower = {n.lower(): n for n in reversed(names)}
    for name in TIME:
        if name in lower:
            return lower[name]
    measured = " (units in its head: a measured file goes with --data)" if any("[" in n for n in names) else ""
    raise DataError(file, [f"no column 'time'; columns: {listed(names)}{measured}"])


def listed(names: Sequence[str], most: int = 12) -> str:
    """Return names for a message, the first ones of many."""
    text = ", ".join(n[:60] for n in names[:most])
    return text + (f" and {len(names) - most} more" if len(names) > most else "")


# ------------------------------------------------------------------------------------------------- CSV, libcosim
def _of_csv(file: Path) -> ResultFile:
    head = read_head(file)
    head = replace(head, names=_whole_names(head.names, head.delimiter))
    names = [TYPE_OF_COLUMN.sub("", n) for n in head.names]
    time = _time_of(file, names)
    if match := LIBCOSIM.fullmatch(file.name):  # the variables of one slot
        names = [n if n == time else f"{match[1]}.{n}" for n in names]
    return ResultFile(str(file), names, time, lambda wanted: _csv_blocks(file, head, names, wanted))


def _whole_names(cells: Sequence[str], delimiter: str) -> list[str]:
    """Return the names of a header, "face[1,2]" of libcosim in one, which does not quote it."""
    names: list[str] = []
    for cell in cells:
        if names and names[-1].count("[") > names[-1].count("]"):
            names[-1] += delimiter + cell
        else:
            names.append(cell)
    return names


def _csv_blocks(file: Path, head: Head, names: Sequence[str], wanted: Sequence[str]) -> Iterator[Block]:
    from gyrobench.record.time_series import read_blocks

    plain = [n.replace("[", "(").replace("]", ")") for n in names]  # brackets would be units
    at = {n: plain[names.index(n)] for n in dict.fromkeys(wanted)}
    for block in read_blocks(file, replace(head, names=plain), [CsvColumn(n, "1") for n in at.values()]):
        yield {n: block[column] for n, column in at.items()}


def _of_folder(folder: Path) -> ResultFile:
    """Return the series of all slots: libcosim writes a file for each."""
    files = sorted(f for f in folder.glob("*.csv") if LIBCOSIM.fullmatch(f.name))
    if not files:
        raise DataError(folder, ["no files SLOT_DATE_TIME.csv of libcosim in this folder; name the result file itself"])
    slots = [LIBCOSIM.fullmatch(f.name)[1] for f in files]  # type: ignore[index]
    if twice := sorted({s for s in slots if slots.count(s) > 1}):
        raise DataError(folder, [f"results of several runs (more than one file of {twice[0]}); keep those of one run"])
    results = [_of_csv(f) for f in files]
    owner = {n: r for r in results for n in r.names if n != r.time}

    def read(wanted: Sequence[str]) -> Iterator[Block]:
        used = list({owner[n].name: owner[n] for n in wanted if n in owner}.values()) or results[:1]
        streams = [_rebatched(r.read([r.time, *(n for n in wanted if owner.get(n) is r)])) for r in used]
        for blocks in itertools.zip_longest(*streams, fillvalue={}):
            times = [b.get(r.time, np.zeros(0)) for b, r in zip(blocks, used, strict=True)]
            if not all(np.array_equal(t, times[0]) for t in times):
                files = listed([Path(r.name).name for r in used])
                raise DataError(folder, [f"rows at different times in {files}; write all of them at the same ones"])
            yield {n: v for b in blocks for n, v in b.items()} | {"time": times[0]}

    return ResultFile(str(folder), ["time", *owner], "time", read)


def _rebatched(blocks: Iterator[Block]) -> Iterator[Block]:
    """Yield the same rows in blocks of ROWS."""
    rest: Block = {}
    for block in blocks:
        rest = {n: np.concatenate([rest[n], v]) for n, v in block.items()} if rest else block
        while len(next(iter(rest.values()))) >= ROWS:
            yield {n: v[:ROWS] for n, v in rest.items()}
            rest = {n: v[ROWS:] for n, v in rest.items()}
    if rest:
        yield rest


# ------------------------------------------------------------------------------------------------- binary formats
def _of_columns(file: Path | str, columns: Mapping[str, AnyArray], constants: Mapping[str, float]) -> ResultFile:
    time = _time_of(file, list(columns))
    rows = len(columns[time])
    columns = {
        n: c for n, c in columns.items() if (len(c) == rows and np.issubdtype(c.dtype, np.number)) or c.dtype == bool
    }
    return ResultFile(str(file), list(columns), time, lambda wanted: _parts(columns, wanted, rows), constants)


def _parts(columns: Mapping[str, AnyArray], wanted: Sequence[str], rows: int) -> Iterator[Block]:
    for first in range(0, rows, ROWS):
        yield {n: np.asarray(columns[n][first : first + ROWS]) for n in dict.fromkeys(wanted)}


def _of_npy(file: Path) -> ResultFile:
    try:  # mapped: a header that promises more than the file holds is refused
        array = np.load(file, mmap_mode="r", allow_pickle=False)
    except Exception as error:  # of any kind, from the parser of its header too
        raise DataError(file, [f"not a numpy array that can be read: {str(error)[:200]}"]) from None
    return _of_array(str(file), array)


def _of_array(name: str, array: AnyArray) -> ResultFile:
    if array.dtype.names is None or array.ndim != 1:
        raise DataError(
            name, ["an array without names of columns; save the structured array that simulate_fmu returns"]
        )
    columns: dict[str, AnyArray] = {}
    for n in array.dtype.names:
        column = array[n]
        for element in np.ndindex(column.shape[1:]):  # an array variable of FMI 3
            index = ",".join(str(i + 1) for i in element)
            columns[f"{n}[{index}]" if index else n] = column[(slice(None), *element)]
    return _of_columns(name, columns, {})


def _of_parquet(file: Path) -> ResultFile:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.ParquetFile(for_arrow(file))
        names = table.schema_arrow.names
    except (pa.ArrowException, OSError, ValueError) as error:
        raise DataError(file, [f"not a Parquet file that can be read: {str(error)[:200]}"]) from None

    def read(wanted: Sequence[str]) -> Iterator[Block]:
        chosen = list(dict.fromkeys(wanted))
        kinds = {n: table.schema_arrow.field(n).type for n in chosen}
        isnt = [
            n
            for n, k in kinds.items()
            if not (pa.types.is_floating(k) or pa.types.is_integer(k) or pa.types.is_boolean(k))
        ]
        if isnt:
            raise DataError(file, [f"column '{isnt[0]}': {kinds[isnt[0]]}, no numbers"])
        try:
            for batch in table.iter_batches(ROWS, columns=chosen):
                yield {n: batch.column(n).to_numpy(zero_copy_only=False) for n in chosen}
        except (pa.ArrowException, OSError) as error:
            raise DataError(file, [f"damaged: {str(error)[:200]}"]) from None

    return ResultFile(str(file), names, _time_of(file, names), read)
