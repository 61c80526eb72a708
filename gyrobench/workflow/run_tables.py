"""The record of a run and the tables of its report for other programs: CSV files, or one workbook."""

from __future__ import annotations

from pathlib import Path

from gyrobench import reading
from gyrobench.record.record import Record
from gyrobench.record.run_document import RecordError
from gyrobench.report import load, table_files
from gyrobench.report.page_model import Page
from gyrobench.report.report_files import page
from gyrobench.report.result_json import Report
from gyrobench.workflow.inputs import require_run


def write_tables(run: Path, kind: str, out: Path | None = None) -> list[Path]:
    """Write the tables of a run, of its report too where it has a result; return the files.

    kind: "csv", files in ``out`` (default ``csv/`` in the run), those of the report in ``report/`` there; "xlsx",
    ``tables.xlsx`` in ``out`` (default: in the run).  Raises RecordError, and WorkbookError for more rows than it has.
    """
    record = Record.load(require_run(run))
    file = run / "result.json"
    made = page(Report.of(load(reading.read_text(file, RecordError)))) if file.is_file() else None
    if kind == "csv":
        folder = out or run / "csv"
        files = record.to_csv(folder)
        if made is not None:
            (folder / "report").mkdir(exist_ok=True)
            files += table_files.write_csv(made, folder / "report")
        return files
    folder = out or run
    folder.mkdir(parents=True, exist_ok=True)
    tables = []
    for name in ("windows", "channels"):
        columns, units = record.table(name)
        if columns:
            header = [f"{c} [{units[c]}]" if units[c] not in ("", "1") else c for c in columns]
            rows = list(zip(*(v.tolist() for v in columns.values()), strict=True))
            tables.append(table_files.Sheet(name, f"{name} of the record, SI", header, rows))
    nothing = made or Page(record.run.title or record.run.system, "without a report", [], [])
    return [table_files.write_workbook(tables, nothing, folder / "tables.xlsx")]
