"""The tables of a report for other programs: a CSV file each, or a workbook with the record beside them.

Numbers have all their digits in CSV, 16 in a workbook (whose format has no more); units stand in the header.  Tables
are numbered as in the report.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from gyrobench.errors import GyrobenchError
from gyrobench.files import write_whole
from gyrobench.report.page_model import Cell, Column, Page, PageTable, walk

Value = str | float
ROWS = 1_048_576  # of a sheet


class WorkbookError(GyrobenchError):
    """A workbook that cannot be written."""


@dataclass(frozen=True)
class Sheet:
    """A table: its name, the caption in the report, header and rows."""

    name: str
    caption: str
    header: list[str]
    rows: Sequence[Sequence[Value]]


def sheets(page: Page) -> Iterator[Sheet]:
    """Yield the tables of a page; what heads a group of rows there is the first column here."""
    for section in page.sections:
        for table in (b for b in walk(section.blocks) if isinstance(b, PageTable)):
            grouped = any(row.group for row in table.rows)
            rows, group = [], ""
            for row in table.rows:
                if row.group:
                    group = row.group
                else:
                    rows.append([*([group] if grouped else []), *map(_value, row.cells)])
            header = [*(["group"] if grouped else []), *map(_head, table.columns)]
            words = re.sub(r"[^\w-]+", "_", table.caption.split(".")[0].split(";")[0])[:22].strip("_")
            yield Sheet(f"table_{table.number:02}_{words}", table.caption, header, rows)


def _head(column: Column) -> str:
    return f"{column.head} [{column.unit}]" if column.unit else column.head


def _value(cell: Cell) -> Value:
    return float(cell.full) if cell.full else cell.text


def write_csv(page: Page, folder: Path) -> list[Path]:
    """Write each table of a page as a CSV file into a folder; return the files."""
    files = []
    for sheet in sheets(page):
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([sheet.header, *(map(_shown, row) for row in sheet.rows)])
        files.append(folder / f"{sheet.name}.csv")
        write_whole(files[-1], text.getvalue().encode("utf-8-sig"))  # with the mark that spreadsheets know UTF-8 by
    return files


def write_workbook(record: Sequence[Sheet], page: Page, file: Path) -> Path:
    """Write the tables of a record, then those of a page, as sheets of a workbook; the first one lists them.

    Raises WorkbookError for more rows than a sheet has, and without the package.
    """
    try:
        from openpyxl import Workbook
    except ImportError:
        raise WorkbookError("workbooks need a further package: pip install 'gyrobench[logs]'") from None
    every = [*record, *sheets(page)]
    for sheet in every:
        if len(sheet.rows) >= ROWS:
            raise WorkbookError(f"{sheet.name}: {len(sheet.rows):,} rows, a sheet has {ROWS:,}; write --to csv")
    book = Workbook(write_only=True)
    contents = book.create_sheet("contents")
    for line in ([page.title], [f"{page.what} {page.report_id}"], [], ["sheet", "what"]):
        contents.append(line)
    for sheet in every:
        contents.append([sheet.name[:31], sheet.caption])
        target = book.create_sheet(sheet.name[:31])
        target.append(sheet.header)
        for row in sheet.rows:
            target.append([_shown(v) for v in row])
    write_whole(file, lambda path: book.save(path))
    return file


def _shown(value: Value) -> Value:
    """Return a cell of a sheet: no control characters, and a text that a spreadsheet would calculate as a text."""
    if not isinstance(value, str):
        return value
    text = re.sub(r"[\x00-\x08\x0b-\x1f]", "", value)
    return f"'{text}" if text[:1] in "=+@" and text[1:] else text
