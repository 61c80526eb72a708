"""The files of a report: each is written whole or not at all, and each even when another fails."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from gyrobench.errors import GyrobenchError
from gyrobench.files import write_whole
from gyrobench.record.run_document import ABOUT
from gyrobench.report.language import ENGLISH, system_folder, used
from gyrobench.report.page_model import Page
from gyrobench.report.result_json import Report
from gyrobench.result import DriftRecordResult, Result, SuiteResult

FORMATS = ("json", "html", "pdf")
NAMES = {"json": "result.json", "html": "report.html", "pdf": "report.pdf"}
COMPARISON_NAMES = {kind: f"comparison.{kind}" for kind in FORMATS}


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
    language: str = ENGLISH,
) -> dict[str, Path]:
    """Write the report of a result into a folder; return the path of each format.

    ``record`` may hold decimated channels to draw ("time" in s and "slot.variable" columns, equally long).
    ``bench`` is the bench whose ``reports/`` templates and catalogues of systems come first.  Files are replaced whole
    or not at all.  Raises ValueError for an unknown format and :class:`ReportError`, after all others were written,
    when a format fails; UntranslatedError, before any page is written, where the page would be half English.
    """
    report = Report.of(result)
    folder, document = Path(folder), dict(report.document)
    if language == ENGLISH or set(formats) == {"json"}:
        return write_files(document, lambda: page(report, record), folder, formats, NAMES, bench)
    translated = page_in(language, report, record, bench)
    return write_files(document, lambda: translated, folder, formats, NAMES, bench)


def page_in(code: str, report: Report[Any], record: Mapping[str, Any] | None = None, bench: Path | None = None) -> Page:
    """Return the page of a report in another language.  Raises UntranslatedError where it would be half English."""
    return _said(code, [report], lambda: page(report, record), f"the report of {report.result.system}", bench)


def _said(
    code: str, reports: Sequence[Report[Any]], draw: Callable[[], Page], what: str, bench: Path | None, *own: str
) -> Page:
    """Return a page of one or several results as :func:`page_in` does; own: texts of the user on it."""
    texts, names = (set[str]().union(*each) for each in zip(*map(own_texts, reports), strict=True))
    tests = {m.system for r in reports if isinstance(r.result, SuiteResult) for m in r.result.suite.members}
    first, *others = dict.fromkeys([*(r.result.system for r in reports), *sorted(tests)])
    folders = [folder for name in others if (folder := system_folder(name, bench))]
    with used(code, system_folder(first, bench), {*texts, *own}, names, folders) as language:
        made = draw()
        return language.page(made, what) if language else made


def own_texts(report: Report[Any]) -> tuple[set[str], set[str]]:
    """Return what is the same in every language: texts of the user, and names of parts, slots and options."""
    about, result = report.about, report.result
    own = {str(getattr(about, n, "")) for n in ("operator", *ABOUT)}
    names = {result.system, *(c.name for c in result.coefficients), result.instrument.removesuffix(", simulated")}
    if not result.simulated:
        own |= {result.instrument}
    if isinstance(result, SuiteResult):
        names |= {m.label for m in result.suite.members}
    else:
        run = report.run
        own |= {run.data.file, run.data.sha256, run.data.columns, run.data.columns_sha256} if run.data else set()
        names |= {*run.parts, *(part.name for part in run.parts.values()), *run.options, *run.parameters, *run.versions}
        names |= {f"{k} {slot}" for k, slot in enumerate(run.order, 1)}  # as they stand in the drawing of the system
        ends = {part for wire in run.wires for end in wire.split(" -> ") for part in end.split(".")}
        names |= ends | {end.partition("[")[0] for end in ends}
        for column in getattr(result, "columns", []):  # of a drift record: as the file of the user calls them
            tables = [t for section in column.tables.values() for t in section if t.columns[0] == "column"]
            names |= {column.name, *(str(row[0]) for t in tables for row in t.rows)}
    return own - {""}, names - {""}


def page(report: Report[Any], record: Mapping[str, Any] | None = None) -> Page:
    """Return the page of the report of a result of any kind; record: as in :func:`write`."""
    if isinstance(report.result, SuiteResult):
        from gyrobench.report import suite_page

        return suite_page.page(report)
    if isinstance(report.result, DriftRecordResult):
        from gyrobench.report import drift_record_page

        return drift_record_page.page(report)
    from gyrobench.report import result_page

    return result_page.page(report, record)


def compare(
    results: Sequence[tuple[str, Result]],
    folder: str | Path,
    formats: Sequence[str] = FORMATS,
    baseline: int = 0,
    bench: Path | None = None,
    language: str = ENGLISH,
) -> dict[str, Path]:
    """Write a side-by-side report of named results: ``comparison.json``, ``.html`` and ``.pdf``.

    ``baseline`` is the index of the run the others are compared with.  Raises ValueError for fewer than two
    results, repeated names or an unknown baseline; otherwise as :func:`write`.
    """
    from gyrobench.report import comparison_page

    doc = comparison_page.comparison(results, baseline)
    made, own = None, comparison_page.own_texts(doc)
    if language != ENGLISH and set(formats) != {"json"}:
        reports = [Report.of(result) for _, result in results]
        made = _said(language, reports, lambda: comparison_page.page(doc), "the comparison", bench, *own)
    return write_files(doc, lambda: made or comparison_page.page(doc), Path(folder), formats, COMPARISON_NAMES, bench)


def write_files(
    doc: dict[str, Any],
    view: Callable[[], Page],
    folder: Path,
    formats: Sequence[str],
    names: Mapping[str, str],
    bench: Path | None,
) -> dict[str, Path]:
    """Write a document and its page into a folder; as :func:`write`.  view: the page, made where it is needed."""
    unknown = [f for f in formats if f not in FORMATS]
    if unknown:
        raise ValueError(f"unknown report format {unknown[0]!r}; there are {', '.join(FORMATS)}")
    folder.mkdir(parents=True, exist_ok=True)
    written: dict[str, Path] = {}
    failures: dict[str, Exception] = {}
    built: list[Page] = []

    def page() -> Page:
        if not built:
            from gyrobench.report.render import equations

            built.append(view())
            equations(built[0])
        return built[0]

    def make(kind: str) -> bytes:
        if kind == "json":
            return (json.dumps(doc, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode(
                "utf-8", "backslashreplace"
            )
        from gyrobench.report import render

        return render.html(page(), bench).encode() if kind == "html" else render.pdf(page(), bench)

    for kind in sorted(formats, key=FORMATS.index):
        try:
            write_whole(folder / names[kind], make(kind))
            written[kind] = folder / names[kind]
        except Exception as error:  # the other formats must still be written
            failures[names[kind]] = error
    if failures:
        raise ReportError(failures, written) from next(iter(failures.values()))
    return written
