"""A text file of a laboratory as cells, line for line."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from pathlib import Path

from gyrobench.record.csv_reader import DataError, regular

BINARY_KINDS = {b"PK": "a spreadsheet or an archive", b"PA": "a Parquet file", b"\xd0\xcf": "an old spreadsheet"}
BINARY = tuple(BINARY_KINDS)
CHECKSUM = re.compile(r"\*[0-9A-Fa-f]{2,4}\s*$")  # of a sentence of NMEA 0183: $VNYMR,...*6F


def without_mark(names: list[str]) -> list[str]:
    """Return a row of names without the mark of a comment before the first."""
    return names[1:] if names[:1] in (["#"], ["%"]) else names


def cells_of_file(file: Path, encoding: str, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Yield number and cells of each line.  Raises DataError for text in another encoding."""
    codec = "utf-8-sig" if encoding.lower().replace("_", "-") in ("utf-8", "utf8") else encoding
    number = 0
    if file.is_dir():
        raise DataError(file, ["a folder; a column map is of a text file"])
    with regular(file).open("rb") as data:
        if (begin := data.read(4)).startswith(BINARY):
            raise DataError(file, [f"{BINARY_KINDS[begin[:2]]}; save the table as CSV"])
    try:
        with file.open(encoding=codec) as lines:
            for number, line in enumerate(lines, 1):
                text = line.rstrip("\n")
                if text.startswith("$"):
                    text = CHECKSUM.sub("", text)
                if delimiter == " ":
                    yield number, text.split()
                elif '"' in text:
                    yield number, [c.strip() for c in next(csv.reader([text], delimiter=delimiter), [])]
                else:
                    yield number, [c.strip() for c in text.split(delimiter)]
    except (UnicodeError, csv.Error) as error:
        raise DataError(file, [f"after row {number}: not text in {encoding} ({error}); give its encoding"]) from None
