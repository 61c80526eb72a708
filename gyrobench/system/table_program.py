"""Programs of a table from a CSV or JSON file, checked before motion: automatic positions, or commands by the clock.

    kind,positions                                   or, by the clock:      kind,commands
    mode,target,rate,way,time                                               mode,target,rate,way,time
    index,30deg,2deg/s,shorter,1min                                         rate,10ERU,,,60s
    index,60deg,,up,90s                                                     index,0deg,5deg/s,cumulative,40s

JSON: {"kind": "positions", "entries": [{"target": "30deg", "time": "1min"}, ...]}.  mode (index), rate (that of the
table) and way (cumulative) may be left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gyrobench import reading, units
from gyrobench.record.csv_reader import DataError, cells_of

KINDS = ("positions", "commands")
WAYS = ("cumulative", "shorter", "up", "down")
MODES = {"index": 1, "rate": 2}
LIMITS = {"positions": (60.0, 99.0 * 60.0), "commands": (10.0, 100.0)}  # s
ENTRIES = 99
FIELDS = ("mode", "target", "rate", "way", "time")


@dataclass(frozen=True)
class ProgramEntry:
    """One command: mode "index" or "rate", target rad or rad/s, rate of the move rad/s (0: default), way, time s."""

    mode: str
    target: float
    rate: float
    way: str
    time: float


@dataclass(frozen=True)
class MotionProgram:
    """Entries of one kind: positions with their dwell, or commands with their step."""

    kind: str
    entries: tuple[ProgramEntry, ...]

    def parameters(self, slot: str = "sequencer") -> dict[str, Any]:
        """Return the parameters of the part table_program in ``slot`` that carry it."""
        e = self.entries
        return {
            f"{slot}.kind": KINDS.index(self.kind),
            f"{slot}.entries": len(e),
            f"{slot}.modes": [MODES[x.mode] for x in e],
            f"{slot}.targets": [x.target for x in e],
            f"{slot}.rates": [x.rate for x in e],
            f"{slot}.ways": [WAYS.index(x.way) for x in e],
            f"{slot}.times": [x.time for x in e],
        }


def read_program(file: Path) -> MotionProgram:
    """Return the program of a file.  Raises DataError with everything that is wrong, and OSError."""
    text = file.read_text(encoding="utf-8")
    kind, rows = _json(file, text) if file.suffix.lower() == ".json" else _csv(file, text)
    problems = [] if kind in KINDS else [f"kind '{kind}': must be {' or '.join(KINDS)}"]
    if not 1 <= len(rows) <= ENTRIES:
        problems.append(f"{len(rows)} entries: 1 to {ENTRIES} are possible")
    entries = [_entry(k, row, kind, problems) for k, row in enumerate(rows, 1)]
    if problems:
        raise DataError(file, problems)
    return MotionProgram(kind, tuple(e for e in entries if e is not None))


def _csv(file: Path, text: str) -> tuple[str, list[dict[str, str]]]:
    lines = [row for row in (cells_of(x) for x in text.splitlines() if not x.startswith("#")) if any(row)]
    if len(lines) < 2 or lines[0][0].strip() != "kind" or len(lines[0]) < 2:
        raise DataError(file, ["the first line must be 'kind,positions' or 'kind,commands', the second the columns"])
    names = [n.strip() for n in lines[1]]
    unknown = [n for n in names if n not in FIELDS]
    if unknown or "target" not in names or "time" not in names:
        raise DataError(file, [f"columns {', '.join(names)}: target and time are needed, of {', '.join(FIELDS)}"])
    wrong = [str(k) for k, row in enumerate(lines[2:], 1) if len(row) > len(names)]
    if wrong:
        raise DataError(file, [f"entry {', '.join(wrong)}: more cells than columns"])
    rows = [{n: x.strip() for n, x in zip(names, row, strict=False) if x.strip()} for row in lines[2:]]
    return lines[0][1].strip(), rows


def _json(file: Path, text: str) -> tuple[str, list[dict[str, str]]]:
    try:
        document = reading.json_value(text, file.name, ValueError)
        rows = [{str(n): str(x) for n, x in row.items()} for row in document["entries"]]
        kind = str(document["kind"])
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise DataError(file, [f"{error!r}: an object with kind and a list entries is expected"]) from None
    unknown = sorted({n for row in rows for n in row} - set(FIELDS))
    if unknown:
        raise DataError(file, [f"{', '.join(unknown)}: an entry has {', '.join(FIELDS)}"])
    return kind, rows


def _entry(k: int, row: dict[str, str], kind: str, problems: list[str]) -> ProgramEntry | None:
    """Return an entry; what is wrong with it goes to ``problems``."""
    found = len(problems)
    mode, way = row.get("mode", "index"), row.get("way", "cumulative")
    if mode not in MODES or (mode == "rate" and kind == "positions"):
        allowed = "index" if kind == "positions" else " or ".join(MODES)
        problems.append(f"entry {k}, mode '{mode}': must be {allowed}")
    if way not in WAYS:
        problems.append(f"entry {k}, way '{way}': must be one of {', '.join(WAYS)}")

    def value(name: str, unit: str, default: float | None = None) -> float:
        if name not in row and default is not None:
            return default
        try:
            return units.parse_quantity(row.get(name, ""), unit)
        except units.UnitError as error:
            problems.append(f"entry {k}, {name}: {error}")
            return 0.0

    target = value("target", "rad/s" if mode == "rate" else "rad")
    rate, time = value("rate", "rad/s", 0.0), value("time", "s")
    if rate < 0.0:
        problems.append(f"entry {k}, rate {row['rate']}: must be above 0; the way gives the sense")
    low, high = LIMITS.get(kind, (0.0, 1e9))
    if len(problems) == found and not low <= time <= high:
        what = "dwell" if kind == "positions" else "step"
        problems.append(f"entry {k}, time: a {what} must be {low:g} s to {high:g} s, not {time:g} s")
    return ProgramEntry(mode, target, rate, way, time) if len(problems) == found else None
