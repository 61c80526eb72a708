"""Columns of plain numbers under a column map, all rows at once: the quick way of :mod:`gyrobench.record.column_map`.

What is not plain (dates, empty cells, remarks between rows, other signs, a row with more cells) is left to the way row
by row, which says what is wrong and where.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

BLOCK = 1 << 24
ASCII_LIKE = ("utf-8", "utf8", "cp1252", "latin-1", "iso-8859-1", "ascii")


def write_numbers(
    file: Path, head: int, places: Sequence[int], factors: Sequence[float], out: IO[bytes], *, encoding: str,
    delimiter: str, decimal: str,
) -> bool:  # fmt: skip
    """Write columns of a text file, times their factors, as CSV; return False where not every cell is a plain number.

    head: lines above the first row.  places: of the columns, from 0.  Nothing is written where False is returned.
    """
    import pyarrow as pa
    from pyarrow import csv

    if encoding.lower() not in ASCII_LIKE or delimiter == " ":
        return False
    with file.open("rb") as data:
        for _ in range(head):
            data.readline()
        start = data.tell()
        width = data.readline().count(delimiter.encode()) + 1
        data.seek(start)
        lines, last = 0, b"\n"
        while block := data.read(BLOCK):
            lines, last = lines + block.count(b"\n"), block[-1:]
        data.seek(start)
        names = [str(k) for k in range(width)]
        if not places or max(places) >= width:
            return False
        used = [names[k] for k in dict.fromkeys(places)]
        try:
            table = csv.read_csv(
                data,
                csv.ReadOptions(column_names=names, encoding=encoding),
                csv.ParseOptions(delimiter=delimiter, ignore_empty_lines=False),
                csv.ConvertOptions(
                    column_types=dict.fromkeys(used, pa.float64()), include_columns=used, null_values=[],
                    decimal_point=decimal,
                ),
            )  # fmt: skip
        except (pa.ArrowException, UnicodeError):
            return False
    if table.num_rows != lines + (last != b"\n"):  # a line break within quotes
        return False
    columns: dict[str, Any] = {}
    for k, (place, factor) in enumerate(zip(places, factors, strict=True)):
        values = table[names[place]].to_numpy()
        if not np.isfinite(values).all():
            return False
        columns[str(k)] = values * factor if factor != 1.0 else values
    csv.write_csv(pa.table(columns), out, csv.WriteOptions(include_header=False))
    return True
