"""A first column map of a laboratory's file for a test."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

from gyrobench import units
from gyrobench.bench import UsageError
from gyrobench.files import missing
from gyrobench.record.circumstances import statement, values_of
from gyrobench.record.column_proposal import (
    CALLED,
    LONG,
    NUMBER,
    FileColumn,
    FileLayout,
    find_layout,
    match_columns,
    series_columns,
)
from gyrobench.record.drift_columns import OF_EACH
from gyrobench.record.log_files import as_text, heads_of, is_log, tables_of
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.workflow import axes_of_gravity
from gyrobench.workflow.empty_record import empty_record
from gyrobench.workflow.inputs import load_test

HEAD = 4096  # characters of a file that may state where it was recorded
OPTIONAL = ("std", "n", "flagged")
COUNTED = "counts"  # unit of readings that are whole numbers
COUNTS = "counts"  # option, of columns that are called as the angle or velocity of each sample
FOUND = (COUNTS, "attitudes")  # what the columns tell
KINDS = ("rad/s", "rad", "m/s2", "K")  # of the columns of a drift record, which has any names
BESIDE = ("s", "ms", "us", "ns", "K", "degC")  # units of what stands beside rates and forces
# what belongs to a rate or force and is none
OTHER = r"(?!.*(time|stamp|_dt\b|count|clip|covariance|_id\b|status|valid|accuracy|norm|temp|quat))"
TURN = r"(theta|th|ang\w*|rot\w*|phi)"
#: what columns without a unit are called -> unit that may be meant
LIKELY = {
    OTHER + rf"(.*delta|.*incr\w*|d)_?{TURN}(_?[xyz])?": "rad",
    OTHER + r"(.*delta|.*incr\w*|d)_?v(el\w*)?(_?[xyz])?": "m/s",
    OTHER + r"((\w+_)?gyr.*|omega.*|[gw]_?[xyz]|(dreh)?rat.*|rot\d|.*(angular|rotation)_?(rate|vel).*)": "deg/s",
    OTHER + r"((\w+_)?acc.*|.*accel.*|beschl.*|[af]_?[xyz])": "m/s2",
    r".*temp.*": "degC",
}


def wanted_columns(test: System | Suite) -> tuple[list[tuple[str, str]], dict[str, str]]:
    """Return names and units of the columns that a test reads, and its circumstances with an example each."""
    *comments, header = empty_record(test).strip().splitlines()
    stated = values_of(s for text in comments if (s := statement(text, 1)))
    return _of_header(header), stated


def _of_header(header: str) -> list[tuple[str, str]]:
    found = [re.fullmatch(r"(\S+)(?: \[(.*)\])?", text.strip()) for text in header.split(",")]
    return [(m[1], m[2] or "") for m in found if m]


@dataclass(frozen=True)
class ColumnProposal:
    """A first column map of a file for a test.

    found: column of the bench -> column of the file.  wanted: column of the bench -> unit, of those that the test
    reads.  stated: what the test needs to know, with an example each.
    """

    file: Path
    test: System | Suite
    layout: FileLayout
    found: Mapping[str, FileColumn]
    wanted: Mapping[str, str]
    stated: Mapping[str, str]
    table: str = ""  # of a log with several

    @property
    def text_file(self) -> Path:
        """The file as a text: itself, or the table of a log."""
        return as_text(self.file, self.table) if is_log(self.file) else self.file

    def text(self) -> tuple[str, list[str]]:
        """Return the text of the map, and what it lacks."""
        text, problems = map_text(self.file, self.test, self.layout, self.found, self.wanted, self.stated, self.table)
        for name in (n for n in self.wanted if n not in self.found and n.split("_")[0] not in OPTIONAL):
            if name == "t_end" and "t_start" in self.found:
                continue
            if name == "time" and "sampling" in self.stated:
                means = "; without both each row is the mean of a position" if "attitudes" in self.stated else ""
                problems.append(f'no column of times: write [columns.time], or sampling = "100Hz" below [set]{means}')
                continue
            unused = ", ".join(f"'{c.name}'" for c in self.layout.columns if c not in self.found.values()) or "none"
            source = '"ITS NAME"' if self.layout.names else "ITS NUMBER"
            wanted = self.wanted[name]
            unit = f' and unit = "{wanted}"{_counts(wanted)}' if wanted not in ("", "1") else ""
            entry = f"[columns.{name}] with from = {source}{unit}"
            none = f"column '{name}': none of the file fits by name and unit"
            problems.append(f"{none}; write {entry}; not used so far: {unused}")
        gyros = any(n[0] == "g" for n in self.wanted)
        places = {"latitude"} if gyros else {"latitude", "gravity"}
        if "attitudes" in self.stated and not places & _stated(self.text_file).keys():
            alone = "" if gyros else ", or the gravity there"
            problems.append(f'latitude of the place{alone}: write latitude = "45.75deg" below [set]')
        return text, problems


def _stated(file: Path) -> dict[str, str]:
    """Return what the comments at the beginning of a file state."""
    with file.open(encoding="latin-1") as text:
        lines = text.read(HEAD).splitlines()
    return values_of(s for line in lines if (s := statement(line, 1)))


def propose_columns(file: Path, system: str) -> ColumnProposal:
    """Return a first column map of a file.  Raises UsageError where there is no such file, and no table in it."""
    if not file.is_file():
        raise UsageError(f"{file}: {missing(file)}")
    test = load_test(system)
    tables = tables_of(file) if is_log(file) else []
    if len(tables) < 2:
        return _proposal(file, test, "", as_text(file) if tables else file)
    proposals = []
    for table, head in heads_of(file).items():
        with suppress(UsageError):
            proposals.append(_proposal(file, test, table, head))
    if not proposals:
        raise UsageError(f"{file}: no table of numbers with names in {', '.join(tables)}")
    known = {id(p): sum(bool(c.unit or c.time) for c in p.found.values()) for p in proposals}
    return max(proposals, key=lambda p: (known[id(p)], len(p.found), p.layout.rows))


def _proposal(file: Path, test: System | Suite, table: str, text: Path) -> ColumnProposal:
    """Return the map of a table of a file, "" of the only one.  text: its rows, or the first of them."""
    wanted, stated = wanted_columns(test)
    layout = find_layout(text)
    if "channel" in test.options:
        found, wanted = _any_names(layout, f"{file.stem} {table}")
    else:
        if layout.rows > LONG and "mean" in "".join(n for n, _ in wanted) and ("t_start", "s") in wanted:
            wanted = series_columns(wanted)
        found = match_columns(wanted, layout)
        samples = _of_header(test.measured_data.samples) if isinstance(test, System) and test.measured_data else []
        of_samples = _of_samples(samples, layout) if samples else {}
        if samples and (len(of_samples) > len(found) or not (found or layout.names)):
            found, wanted = of_samples, [(n, _unit_of_sample(n, u, of_samples)) for n, u in samples]
            if not any(n in found for n, _ in samples[1:4]) and any(n in found for n, _ in samples[-3:]):
                wanted = [(n, u) for n, u in wanted if n[0] != "g"]
            stated = {"attitudes": "unknown", **stated}
    if "sampling" in test.options and wanted[0] == ("time", "s") and "time" not in found:
        stated = {"sampling": "100Hz", **stated}
    if "channel" in test.options and any(OF_EACH.fullmatch(name) for name in found):
        stated = {COUNTS: "increments", **stated}
    others = [c for c in layout.columns if c not in found.values() and c.unit and _is(c, "K")]
    for k, c in enumerate(others):
        found[f"temperature {k + 1}" if k else "temperature"] = c
    return ColumnProposal(file, test, layout, found, dict(wanted), stated, table)


def write_columns(file: Path, system: str, out: Path | None) -> tuple[str, list[str]]:
    """Return a first column map of a file, written to ``out`` where given, and what it still lacks.

    Raises UsageError.
    """
    text, problems = propose_columns(file, system).text()
    if out is not None:
        if out.exists():
            raise UsageError(f"--out {out}: the file exists; choose another name")
        out.write_text(text, encoding="utf-8")
    return text, problems


def _is(column: FileColumn, unit: str) -> bool:
    return units.same_dimension(column.unit or "1", unit)


def _timed(column: FileColumn) -> bool:
    """Return whether a column has a form of times, their unit or, without a unit, their name."""
    called = re.fullmatch(CALLED["time"], re.sub(r"\W+", "_", column.name).strip("_"), re.I)
    return bool(column.time or _is(column, "s") or (called and not column.unit))


def _of_samples(samples: Sequence[tuple[str, str]], layout: FileLayout) -> dict[str, FileColumn]:
    """Return the columns of a logger's file; samples: time, three rates, three forces, with their units."""
    found = match_columns(samples, layout)
    if "time" not in found and (rising := [c for c in layout.columns if c.rises and not c.unit and not c.counts]):
        found["time"] = rising[0]
    left = [c for c in layout.columns if c not in found.values() and not c.unit]
    names = [n for n, _ in samples]
    found_triads = axes_of_gravity.triads(left)
    if len(left) == len(layout.columns) - ("time" in found) == 3:  # positions are of accelerometers at least
        found_triads = left, []
    for mine, triad in zip((names[-3:], names[1:4]), found_triads, strict=True):
        if not any(n in found for n in mine):
            found |= dict(zip(mine, triad, strict=False))
    return found


def _unit_of_sample(name: str, unit: str, found: Mapping[str, FileColumn]) -> str:
    """Return the unit that a column of a logger's file may be in, if it has none; found: name -> column."""
    if name == "time":
        return found[name].of_times if name in found else unit
    triad = [found[name[0] + a] for a in "xyz" if name[0] + a in found]
    gravity = axes_of_gravity.unit_of([found["a" + a] for a in "xyz" if "a" + a in found])
    if triad and all(c.whole for c in triad) and gravity not in ("g", "m/s2"):
        return COUNTED
    return gravity if gravity and name[0] == "a" else unit


def _any_names(layout: FileLayout, called: str) -> tuple[dict[str, FileColumn], list[tuple[str, str]]]:
    """Return the columns of a drift record, and their names with units that fit: time, then rates, angles and
    temperatures under their own names, those without a unit by what they, or the file, are called and by gravity."""
    found: dict[str, FileColumn] = {}
    wanted = []
    times = sorted((c for c in layout.columns if _timed(c)), key=lambda c: not (c.rises or c.time))
    words = len([*takewhile(lambda c: c.shown and not NUMBER.match(c.shown), layout.columns)])  # "gyro" in every row
    if not times and words + 1 < len(layout.columns):
        first = layout.columns[words]
        times = [first] if first.rises and first.name.endswith(f"_{words + 1}") else []  # a matrix has no names
    for c in layout.columns:
        name = re.sub(r"\W+", "_", c.name).strip("_") or f"column_{len(found) + 1}"
        likely = next((u for pattern, u in LIKELY.items() if re.fullmatch(pattern, name, re.I)), "")
        kinds = (*KINDS, "m/s") if OF_EACH.fullmatch(name) else KINDS
        kind = next((k for k in kinds if c.unit and _is(c, k)), likely if not c.unit else "")
        if c in times[:1]:
            name, kind = "time", c.of_times
        if kind and name not in found:
            found[name] = c
            wanted.append((name, kind))
    forces = [n for n, u in wanted if u == "m/s2" and not found[n].unit]
    for three in (forces[k : k + 3] for k in range(0, len(forces), 3)):
        unit = axes_of_gravity.unit_of([found[n] for n in three])
        wanted = [(n, unit if unit and n in three else u) for n, u in wanted]
    if all(u in BESIDE for _, u in wanted):
        axes = {c.name: c for c in layout.columns if c.name.casefold() in ("x", "y", "z") and not c.unit}
        if len(axes) == 3:
            found |= axes
            of_rates = re.search("gyr|angular|rate", called, re.I)
            unit = "" if of_rates else axes_of_gravity.unit_of([*axes.values()])
            wanted += [(name, unit or "deg/s") for name in axes]
    if all(u in BESIDE for _, u in wanted):
        left = [c for c in layout.columns if c not in found.values() and not c.unit]
        for name, triad in zip(("acc", "gyro"), axes_of_gravity.triads(left), strict=True):
            unit = axes_of_gravity.unit_of(triad) if name == "acc" else "deg/s"
            found |= {f"{name}_{a}": c for a, c in zip("xyz", triad, strict=False)}
            wanted += [(f"{name}_{a}", unit) for a, _ in zip("xyz", triad, strict=False)]
    if all(u in BESIDE for _, u in wanted):
        wanted.append(("rate", "deg/s"))
        if len(rest := [c for c in layout.columns if c not in found.values()]) == 1:
            found["rate"] = rest[0]
    return found, wanted if "time" in found else [("time", "s"), *wanted]


def map_text(
    file: Path, test: System | Suite, layout: FileLayout, found: Mapping[str, FileColumn], wanted: Mapping[str, str],
    stated: Mapping[str, str], table: str = "",
) -> tuple[str, list[str]]:  # fmt: skip
    """Return the text of a map, and what it lacks: units that the file does not tell.  table: of a log."""
    problems: list[str] = []
    empty = sum(c.empty for c in found.values())
    series = "t_start" not in wanted
    lines = [
        f"# Column map of {file.name}: gyrobench reduce {test.name} --data {shlex.quote(file.name)} --columns MAP",
        "# Check columns, units and signs (factor = -1 reverses one): names do not tell them all.",
        *([f"table = {_quoted(table)}"] if table else []),
        *layout.keys(not is_log(file)),
        "# no value: missing (refused; a gap in time series), skip (leaves the row out), previous (as above)",
        f"empty = {_quoted('skip' if empty and not series else 'missing')}  # {empty} in the columns below",
    ]
    for name in sorted(found, key=lambda n: list(wanted).index(n) if n in wanted else len(wanted)):
        lines += _entry(name, found[name], wanted.get(name, ""), problems)
        if name == "t_start" and "t_end" in wanted and "t_end" not in found:
            lines += ["", "[columns.t_end]  # readings without a pause; else from = the column with their end",
                      'next = "t_start"', '# last = "60s"  # length of the last one, else left out']  # fmt: skip
    for c in found.values():
        if c.name and (others := [o for o in layout.columns if o.name == c.name and o != c]):
            numbers = ", ".join(str(o.sources[0]) for o in others)
            problems.append(f"column {c.sources[0]} is taken for '{c.name}'; others are called so, too: {numbers}")
    used = {s for c in found.values() for s in c.sources}
    unused = [c for c in layout.columns if not used & {*c.sources}]
    lines += [
        "",
        f"# Not used: {', '.join(c.name for c in unused) or 'none'}",
        *(f"# {c.name}: {c.shown} ..." for c in unused if c.shown),
        "#",
        f"{'' if any(n in stated for n in FOUND) else '# '}[set]  # what the test needs to know, here or by --set",
    ]
    lines += [
        f"{'' if n in FOUND else '# '}{n} = {_quoted(v)}" for n, v in stated.items() if not n.startswith("phase ")
    ]
    return "\n".join(lines) + "\n", problems


def _entry(name: str, c: FileColumn, unit: str, problems: list[str]) -> list[str]:
    sources: Sequence[str | int] = c.sources
    shown = ", ".join(_quoted(s) for s in sources)
    key = name if re.fullmatch(r"[\w-]+", name, re.ASCII) else _quoted(name)
    lines = ["", f"[columns.{key}]", f"from = {shown}" if len(sources) == 1 else f"from = [{shown}]"]
    if c.time:
        lines.append(f"time = {_quoted(c.time)}")
        if c.exchangeable:
            problems.append(f"column '{name}': day and month may be exchanged in {c.time}")
    elif c.unit:
        lines.append(f"unit = {_quoted(c.unit)}")
    elif unit == COUNTED:
        lines.append(f"unit = {_quoted(unit)}")
    elif unit not in ("", "1"):
        lines.append(f"# unit = {_quoted(unit)}")
        said = f"'{c.written}' is unknown" if c.written else "the file tells none"
        problems.append(
            f"column '{name}': its unit: {said}; write unit = {_quoted(unit)}, or what it is{_counts(unit)}"
        )
    return lines


def _counts(unit: str) -> str:
    return "" if unit in BESIDE else " (of counts: unit and factor = the size of one)"


def _quoted(value: str | int) -> str:
    return json.dumps(value, ensure_ascii=False)
