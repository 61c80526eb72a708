"""Writes the files of a report: each whole or not at all, and each even when another fails."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from gyrobench.files import write_whole
from gyrobench.report import FORMATS, ReportError
from gyrobench.report.page_model import Page
from gyrobench.report.result_json import document
from gyrobench.result import Result


def write_all(
    result: Result, folder: Path, formats: Sequence[str], record: Mapping[str, Any] | None, bench: Path | None
) -> dict[str, Path]:
    doc = document(result)

    def view() -> Page:
        if doc["suite"]:
            from gyrobench.report import suite_page

            return suite_page.page(doc)
        from gyrobench.report.result_page import page

        return page(doc, record)

    return _write(
        doc, view, folder, formats, {"json": "result.json", "html": "report.html", "pdf": "report.pdf"}, bench
    )


def compare_all(
    results: Sequence[tuple[str, Result]], folder: Path, formats: Sequence[str], baseline: int, bench: Path | None
) -> dict[str, Path]:
    from gyrobench.report.comparison_page import comparison, page

    doc = comparison(results, baseline)
    names = {kind: f"comparison.{kind}" for kind in FORMATS}
    return _write(doc, lambda: page(doc), folder, formats, names, bench)


def _write(
    doc: dict[str, Any],
    view: Callable[[], Page],
    folder: Path,
    formats: Sequence[str],
    names: Mapping[str, str],
    bench: Path | None,
) -> dict[str, Path]:
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
            return (json.dumps(doc, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
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
