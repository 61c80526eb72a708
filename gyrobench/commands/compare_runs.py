"""Reports of several runs side by side."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from gyrobench.bench import Bench, UsageError
from gyrobench.commands import console
from gyrobench.commands.run_folders import short_names
from gyrobench.result import Result


def compare(runs: list[Path], out: Path | None, as_json: bool = False) -> None:
    """Write and print the comparison of several runs; the first is the baseline.  Raises UsageError."""
    from gyrobench import report as reports

    if len(runs) < 2:
        raise UsageError("compare needs two runs or more: gyrobench compare RUN RUN")
    for folder in runs:
        if not folder.is_dir():
            raise UsageError(f"{folder}: no such folder; runs are in {Bench.find().out}/SYSTEM/")
    missing = [f for f in runs if not (f / "result.json").is_file()]
    if missing:
        raise UsageError(f"{missing[0]}: has no result.json; gyrobench report {missing[0]} makes it")
    results = []
    for folder, name in zip(runs, short_names(runs), strict=True):
        file = folder / "result.json"
        try:
            results.append((name, reports.load(file.read_text(encoding="utf-8"))))
        except reports.ResultError as error:
            raise UsageError(f"{file}: {error}") from None
    _require_common_coefficients(results)
    digest = hashlib.sha256("".join(str(f.resolve()) for f in runs).encode()).hexdigest()[:8]
    paths = reports.compare(results, out or Bench.find().out / "comparison" / digest, bench=Bench.find().folder)
    if as_json:
        console.print_report_files(paths, None)
    else:
        comparison = json.loads(paths["json"].read_text(encoding="utf-8"))
        console.print_report_files(paths, console.format_ranking(comparison))


def _require_common_coefficients(results: list[tuple[str, Result]]) -> None:
    """Raise UsageError for a run that shares no coefficient with the baseline; print a note where systems differ."""
    (first, base), *others = results
    known = {c.name for c in base.coefficients}
    for name, result in others:
        if known.isdisjoint(c.name for c in result.coefficients):
            raise UsageError(
                f"{name} ({result.system}) and {first} ({base.system}) have no coefficient in common: "
                "nothing to compare"
            )
    systems = dict.fromkeys(r.system for _, r in results)
    if len(systems) > 1:
        names = ", ".join(systems)
        console.print_note(f"note: runs of different systems ({names}): equal names may not mean equal quantities")
