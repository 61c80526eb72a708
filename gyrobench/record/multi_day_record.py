"""Several runs of one system as one record, a day each: repetitions with a new turn-on bias each.

A CSV file with the one column ``run`` names their folders (from where the file is, or from the working folder):

    run
    reports/out/eight_position/1a2b3c4d
    reports/out/eight_position/5e6f7a8b
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from gyrobench.record.csv_reader import DataError, read_head, read_lines, read_statements
from gyrobench.record.record import Record
from gyrobench.record.run_document import Day, RecordError

DAY = 86400.0  # s
MAY_DIFFER = ("seed", "date", "operator", "note")  # may differ from day to day


def combine(records: Sequence[Record], names: Sequence[str], source: Path | str = "runs") -> Record:
    """Return one record: its plan rows carry ``day``, phase numbers continue, days start one or more days apart.

    Raises DataError for records of different systems, options or true parameters, or incomplete ones.
    """
    first = records[0]
    problems, plan, blocks = [], [], []
    phase, start = 0, 0.0
    for record, name in zip(records, names, strict=True):
        problems += [f"{name}: {text}" for text in _differences(first, record)]
        w = record.windows
        if "t_end" not in w or not len(w["t_end"]):
            problems.append(f"{name}: holds no windows")
            continue
        rows = [row.model_copy(update={"phase": row.phase + phase, "day": row.day or name}) for row in record.run.plan]
        moved = {n: np.asarray(v) + start if n in ("t_start", "t_end") else np.asarray(v) for n, v in w.items()}
        blocks.append({**moved, "phase": np.asarray(w["phase"]) + phase})
        plan += rows
        phase = max(row.phase for row in rows)
        start = DAY * np.ceil((float(np.max(moved["t_end"])) + 1.0) / DAY)
    if problems:
        raise DataError(source, problems)
    common = [n for n in blocks[0] if all(n in b for b in blocks)]
    windows = {n: np.concatenate([b[n] for b in blocks]) for n in common}
    days = [
        Day(run=name, **{k: getattr(r.run, k) for k in MAY_DIFFER if k in r.run.model_fields_set})
        for r, name in zip(records, names, strict=True)
    ]
    return Record(windows, {}, first.run.model_copy(update={"plan": plan, "days": days}))


def _differences(first: Record, other: Record) -> list[str]:
    a, b = first.run, other.run
    if a.system != b.system:
        return [f"is a run of {b.system}, the first is one of {a.system}"]
    problems = [] if other.complete else ["the run is not complete"]
    for kind, x, y in (("options", a.options, b.options), ("parameters", a.parameters, b.parameters)):
        names = [n for n in sorted(x.keys() | y.keys()) if x.get(n) != y.get(n) and not n.endswith(".seed")]
        if names:
            shown = ", ".join(f"{n} = {y.get(n)} (first: {x.get(n)})" for n in names[:4])
            problems.append(f"other {kind}: {shown}" + (f" and {len(names) - 4} more" if len(names) > 4 else ""))
    return problems


def read_runs(file: Path, system: str, values: Mapping[str, str]) -> Record | None:
    """Return the runs that ``file`` lists as one record; None when it is not a list of runs.

    values: as given to --set; each run has its own, so that none may be given here.  Raises DataError for folders that
    are not runs of ``system``, a run named twice, fewer than two, and values in the file or in ``values``.
    """
    if read_head(file).names != ["run"]:
        return None
    lines = [t.strip() for t in read_lines(file)]
    lines = [t for t in lines if t and not t.startswith("#")]
    names = [t.strip('"') for t in lines[1:]]
    stated = [f"'{s.key}' (row {s.line})" for s in read_statements(file) if not s.remark]
    problems = [f"{n} is given: a list of runs states nothing, each run has its own values; reduce the runs with it"
                for n in (*stated, *(f"--set {v}" for v in values))]  # fmt: skip
    problems += [f"{n}: named twice" for n in sorted({n for n in names if names.count(n) > 1})]
    if len(names) < 2:
        problems.append(f"{len(names)} run: at least two are needed, a day each")
    records = []
    for n in names:
        folder = Path(file).parent / n
        try:
            records.append(Record.load(folder if folder.exists() else Path(n)))
        except RecordError as error:
            problems.append(str(error))
            continue
        if records[-1].run.system != system:
            problems.append(f"{n}: is a run of {records[-1].run.system}, not of {system}")
    if problems:
        raise DataError(file, problems)
    return combine(records, [Path(n).name for n in names], file)
