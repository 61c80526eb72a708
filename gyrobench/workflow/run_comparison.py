"""Results of several runs side by side."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gyrobench import reading
from gyrobench.bench import Bench, UsageError
from gyrobench.boundary import checked
from gyrobench.notebook import data_frame
from gyrobench.report import FORMATS, ResultError
from gyrobench.report.language import ENGLISH, require_reports
from gyrobench.result import Result
from gyrobench.workflow.run_folders import short_names

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, repr=False)
class Comparison:
    """Named results laid side by side; the first is the baseline.

    document: the content of comparison.json.  note: what to be aware of, "" where nothing.
    """

    results: Sequence[tuple[str, Result]]
    document: dict[str, Any]
    note: str = ""

    def __str__(self) -> str:
        from gyrobench.report.plain_text import format_comparison

        return format_comparison(self.document)

    def _repr_html_(self) -> str:
        from gyrobench.report.notebook_html import comparison_html

        return comparison_html(self.document, self.note)

    def frame(self) -> pandas.DataFrame:
        """Return a row for each coefficient of each run: estimate, u, and the difference to the baseline with its U.

        Raises MissingPackageError without pandas.
        """
        rows = []
        for m in self.document["measures"]:
            for run, value, difference in zip(self.document["runs"], m["runs"], m["differences"], strict=True):
                v, d = value or {}, difference or {}
                row = {"name": m["name"], "unit": m["unit"], "run": run["name"]}
                row |= {"estimate": v.get("estimate"), "u": v.get("u"), "difference": d.get("value")}
                rows.append(row | {"U": d.get("U"), "significant": d.get("significant")})
        return data_frame({key: [row[key] for row in rows] for key in rows[0]}, {})

    @checked
    def write(self, folder: Path, formats: Sequence[str] = FORMATS, language: str = ENGLISH) -> dict[str, Path]:
        """Write comparison.json, .html and .pdf into a folder; return their paths.

        language: of the pages, en or zh.  Raises UsageError, ReportError.
        """
        from gyrobench.report import compare

        bench = Bench.find().folder
        for _, result in self.results:
            require_reports(language, result.system, bench)
        return compare(self.results, folder, formats, bench=bench, language=language)


def compare_results(results: Sequence[tuple[str, Result]]) -> Comparison:
    """Return named results side by side.  Raises UsageError for fewer than two, and for runs with nothing in common."""
    from gyrobench.report.comparison_page import comparison

    _require_two(len(results))
    names = [name for name, _ in results]
    if len(set(names)) < len(names):
        raise UsageError(f"runs to compare: their names must differ: {', '.join(names)}")
    note = _common_ground(results)
    return Comparison(tuple(results), comparison(results), note)


def compare_folders(runs: Sequence[Path]) -> Comparison:
    """Return runs side by side, each by its result.json, measured ones by their instruments.  Raises UsageError."""
    _require_two(len(runs))
    for folder in runs:
        _require_folder(folder)
    results = [read_result(f) for f in runs]
    instruments = [r.instrument for r in results if not r.simulated and r.instrument]
    names = instruments if len(set(instruments)) == len(runs) else short_names(runs)
    return compare_results(list(zip(names, results, strict=True)))


def comparison_folder(runs: Sequence[Path]) -> Path:
    """Return where the comparison of these runs goes unless a folder is named."""
    digest = hashlib.sha256("".join(str(f.resolve()) for f in runs).encode()).hexdigest()[:8]
    return Bench.find().out / "comparison" / digest


def read_result(folder: Path) -> Result:
    """Return the result of a saved run.  Raises UsageError where there is none that can be read."""
    from gyrobench.report import load

    _require_folder(folder)
    file = folder / "result.json"
    if not file.is_file():
        raise UsageError(f"{folder}: no result.json; write it by gyrobench report {folder}")
    try:
        return load(reading.read_text(file, ResultError), file)
    except ResultError as error:
        raise UsageError(str(error)) from None


def _require_two(runs: int) -> None:
    if runs < 2:
        raise UsageError("comparison: two runs or more are needed; gyrobench compare RUN RUN")


def _require_folder(folder: Path) -> None:
    if not folder.is_dir():
        raise UsageError(f"{folder}: no such folder; runs are in {Bench.find().out}/SYSTEM/")


def _common_ground(results: Sequence[tuple[str, Result]]) -> str:
    """Return a note where systems differ.  Raises UsageError for a run without any coefficient of the baseline."""
    (base_name, base), *others = results
    known = {c.name for c in base.coefficients}
    for name, result in others:
        if known.isdisjoint(c.name for c in result.coefficients):
            raise UsageError(
                f"{name} ({result.system}) and {base_name} ({base.system}) have no coefficient in common: "
                "nothing to compare"
            )
    systems = dict.fromkeys(r.system for _, r in results)
    if len(systems) == 1:
        return ""
    return f"runs of different systems ({', '.join(systems)}): equal names may not mean equal quantities"
