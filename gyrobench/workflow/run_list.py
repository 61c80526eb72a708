"""The runs of a bench, from what each folder says of itself."""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gyrobench.record.run_document import FILE

FOLDERS = 4  # below the folder of results: SUITE/ID/TEST is the deepest


@dataclass(frozen=True)
class RunEntry:
    """A run as a list shows it.

    place: its folder below that of the results.  verdict: of its result, "" where there is none.  changed: options,
    parameters and slots that were set.
    """

    place: str
    system: str
    title: str
    date: str
    seed: int | None
    complete: bool
    measured: bool
    verdict: str
    instrument: str
    changed: list[str] = field(default_factory=list)
    report: bool = False


def list_runs(out: Path) -> list[RunEntry]:
    """Return the runs below a folder of results, the newest first; one that cannot be read is left out."""
    found = []
    for depth in range(1, FOLDERS):
        for file in out.glob("/".join([*["*"] * depth, FILE])):
            try:
                content = _read(file, file.stat().st_mtime_ns)
                result = file.with_name("result.json")
                verdict = _read(result, result.stat().st_mtime_ns).get("verdict", "") if result.is_file() else ""
                found.append(_entry(file.parent, out, content, str(verdict)))
            except (OSError, ValueError, TypeError, AttributeError):
                continue
    return sorted(found, key=lambda r: r.date, reverse=True)


@functools.lru_cache(maxsize=4096)
def _read(file: Path, _changed: int) -> dict[str, Any]:
    """Return the part of a run.json or result.json that lists show; read again when the file was changed."""
    content = json.loads(file.read_text(encoding="utf-8"))
    kept = ("system", "title", "date", "seed", "complete", "measured", "instrument", "changed", "verdict")
    return {k: content[k] for k in kept if k in content}


def _entry(folder: Path, out: Path, content: dict[str, Any], verdict: str) -> RunEntry:
    return RunEntry(
        place=folder.relative_to(out).as_posix(),
        system=str(content.get("system", "")),
        title=str(content.get("title", "")),
        date=str(content.get("date", "")),
        seed=content.get("seed"),
        complete=bool(content.get("complete", True)),
        measured=bool(content.get("measured", False)),
        verdict=verdict,
        instrument=str(content.get("instrument", "")),
        changed=[str(c) for c in content.get("changed", [])],
        report=(folder / "report.html").is_file(),
    )
