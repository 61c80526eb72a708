"""Reports: what was found, whether it meets its specification, and why to believe it.

A :class:`gyrobench.result.Result` goes in; ``result.json``, ``report.html`` and ``report.pdf``
come out, rendered from one document, so that a number is the same number everywhere.  Nothing heavy is
imported before a report is written.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gyrobench.errors import GyrobenchError
from gyrobench.report.assets import content_dir
from gyrobench.report.result_json import ResultError, load, report_id
from gyrobench.report.specification import SpecificationError, check_units, load_specification

if TYPE_CHECKING:
    from gyrobench.result import Result

FORMATS = ("json", "html", "pdf")
NAMES = {"json": "result.json", "html": "report.html", "pdf": "report.pdf"}


class ReportError(GyrobenchError):
    """A report of which some file could not be written.

    ``failures``: file name -> its error; ``written``: format -> path of those that were written.
    """

    def __init__(self, failures: Mapping[str, Exception], written: Mapping[str, Path]) -> None:
        self.failures, self.written = dict(failures), dict(written)
        causes = [f"{name}: {type(error).__name__}: {error}" for name, error in failures.items()]
        super().__init__("report not complete: " + "; ".join(causes))


def write(
    result: Result,
    folder: str | Path,
    formats: Sequence[str] = FORMATS,
    record: Mapping[str, Any] | None = None,
    bench: Path | None = None,
) -> dict[str, Path]:
    """Write the report of a result into a folder; returns the path of each format.

    ``record`` may hold decimated channels to draw ("time" in s and "slot.variable" columns, equally long).
    ``bench`` is the bench whose ``reports/`` templates come first.  Files are replaced whole or not at all.
    Raises ValueError for an unknown format and :class:`ReportError`, after all others were written, when a
    format fails.
    """
    from gyrobench.report.report_files import write_all

    return write_all(result, Path(folder), formats, record, bench)


def compare(
    results: Sequence[tuple[str, Result]],
    folder: str | Path,
    formats: Sequence[str] = FORMATS,
    baseline: int = 0,
    bench: Path | None = None,
) -> dict[str, Path]:
    """Write a side-by-side report of named results: ``comparison.json``, ``.html`` and ``.pdf``.

    ``baseline`` is the index of the run the others are compared with.  Raises ValueError for fewer than two
    results, repeated names or an unknown baseline; otherwise as :func:`write`.
    """
    from gyrobench.report.report_files import compare_all

    return compare_all(results, Path(folder), formats, baseline, bench)


__all__ = [
    "FORMATS",
    "NAMES",
    "ReportError",
    "ResultError",
    "SpecificationError",
    "check_units",
    "compare",
    "content_dir",
    "load",
    "load_specification",
    "report_id",
    "write",
]
