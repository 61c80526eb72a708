"""A laboratory's CSV file of a test as a record, with the circumstances in its comments.

    # latitude = 45.75deg
    # k = 17.2deg/h/mA
    # phase 1 = static 3
    phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA]

Comments named like an option set it; ``phase N`` names the attitude the rows with this number were taken in.  A file
with the column ``time`` instead of t_start and t_end holds time series, see :mod:`gyrobench.system.lab_series`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from gyrobench.record.circumstances import Keys, Statement, faults, values_of
from gyrobench.record.csv_reader import (
    WINDOW_COLUMNS,
    CsvColumn,
    DataError,
    Head,
    read_head,
    read_measured,
    read_statements,
)
from gyrobench.record.record import Record
from gyrobench.record.run_document import ABOUT, PlanRow, RunDocument
from gyrobench.record.time_series import read_blocks
from gyrobench.system.lab_series import faults_of_series, is_time_series, windows_of_series
from gyrobench.system.system import MeasuredData, System
from gyrobench.system.values import InvalidValueError

SERIES = """\
Time series may stand here instead of windows: columns `time [s]`, `current` for `mean` of a current (`current_x` for
#   `mean_x`), `voltage` of a voltage, else `mean` itself, one `angle` for its two, and `flag`; `phase` numbers the
#   phases, 0 while moving or settling.  Without it they are found in the motion of the table, where there is an angle,
#   and must fit the plan.  '# window = 60s': their length.
#   Samples that may be aliased are warned of: say what they are by '# samples = means' (each since the one before) or
#   points, and how far the signal reaches by '# bandwidth = 14Hz'."""
TEXTS = ("title", "source", "made", "note", "instrument", "operator", *ABOUT, "date", "report", "type_b", "arrangement")
ARRANGED = ("phase", "cycle", "current", "t_start")  # first columns of what is arranged by attitudes or settings
POLARITY = "polarity"  # read by the tumbles alone: RebalanceSetup
WITH_POLARITY = (*TEXTS, POLARITY)
ELSEWHERE = {
    POLARITY: "this test does not turn its readings round; give them with the sign that its template asks for "
    "(gyrobench reduce NAME --template) and leave this key out"
}
OF_SERIES = ("window", "samples", "bandwidth")  # keys of time series
STATED = (*WITH_POLARITY, *OF_SERIES)  # what a record may say beside the options of its test


def explained(template: str, options: Iterable[str] = ()) -> str:
    """Return a template with words, before its header, about what any record may say for its report.

    options: of the system; those of type B (u_...) are named.
    """
    lines = template.splitlines()
    head = next((k for k, line in enumerate(lines) if not line.startswith("#")), 0)
    names = ", ".join(n for n in options if n.startswith("u_"))
    text = (
        f"type B: {names} (standard uncertainties; gyrobench show has their meanings): those that apply, a comment "
        "each or by --set; where there is none, 'type_b = none'. Without a statement no verdict is pass."
    )
    checked = (
        "arrangement: attitudes, signs, zeros of the angles, latitude and scales may be mistaken without a sign "
        "in the residuals; the report names such mistakes.  'arrangement = checked': they were looked at once more; "
        "without this statement nothing that rests on them passes."
    )
    notes = [
        *(wrap(checked, 116, subsequent_indent="  ") if names and lines[-1].startswith(ARRANGED) else []),
        *(wrap(text, 116, subsequent_indent="  ") if names else []),
        f"{', '.join(ABOUT)} (its calibration): optional, a comment each like instrument; the report prints them.",
    ]
    if "t_start" in lines[-1] and "mean" in lines[-1]:
        notes.append(SERIES)
    return "\n".join([*lines[:head], *(f"# {note}" for note in notes), *lines[head:]]) + "\n"  # fmt: skip


def of_positions(record: Record) -> Record:
    """Return a record of readings on a head with a plan of the positions that its rows name."""
    numbers = dict.fromkeys(np.asarray(record.windows["phase"]).astype(int).tolist())
    plan = [PlanRow(phase=p, label=f"position {p}", mode="hold", face="head") for p in numbers]
    return Record(record.windows, {}, record.run.replace(plan=plan))


def laboratory_rows(template: str, **reading: Any) -> MeasuredData:
    """Return the template of a laboratory's record and its reader; reading: the keywords of :func:`read_record`."""
    return MeasuredData(template, partial(read_record, **reading))


def read_record(
    system: System, data: Path, values: Mapping[str, str], *, needed: Mapping[str, str] | None = None,
    attitudes: Callable[[System], Mapping[str, str]] | None = None, columns: tuple[CsvColumn, ...] = WINDOW_COLUMNS,
    time: str | None = "t_start", texts: Sequence[str] = TEXTS,
) -> Record:  # fmt: skip
    """Return the CSV as a record in SI, with the circumstances in its comments and in ``values`` (which win).

    needed: options that must be given, with an example: {"latitude": "45.75deg", "k": "..."}.  attitudes: what a
    phase may be called -> mode "hold", "index" or "rate", asked once the options are set; None: a record without
    phases.  columns, time: as of read_measured; where windows are expected, std, n and flagged are filled in.  texts:
    comments that are kept as they are.  Raises DataError, and InvalidValueError for an option that does not fit.
    """
    for name in values:
        if name in ELSEWHERE and name not in texts:
            raise InvalidValueError(f"{name}: {ELSEWHERE[name]}")
        if name not in system.options and name not in texts and not (attitudes and name.startswith("phase ")):
            system.set(name, values[name])  # says which options there are
    head = read_head(data)
    windows: dict[str, np.ndarray[Any, Any]] = {}
    series, notes, doubts, problems = is_time_series(head, columns), list[str](), list[str](), list[str]()
    known = (*system.options, *texts, *(OF_SERIES if series else ()))
    keys = Keys(known, phases=attitudes is not None or series, elsewhere=ELSEWHERE)
    stated = head.statements if series else read_statements(data)
    if series:
        problems += faults(stated, keys)
    else:
        try:
            windows, _ = read_measured(data, columns, time, keys)
        except DataError as error:
            problems += error.problems
            windows = {"phase": _phases_there(data, head)}
    said = {**values_of(stated), **values}
    problems += set_options(system, stated, values)
    for name, example in (needed or {}).items():
        default = system.options[name].default
        if name not in system.given or (not system[name] and not default):
            problems.append(
                f"'{name}' is not given: write '# {name} = {example}' in the file or --set {name}={example}"
            )
    problems += _type_b_problems(system, said.get("type_b", ""))
    if said.get("arrangement", "checked") != "checked":
        problems.append(f"arrangement = {said['arrangement']}: 'checked' or nothing is expected")
    if series and problems:
        problems += faults_of_series(data, head, columns)
        windows = {"phase": _phases_there(data, head)}
    elif series:
        named = attitudes(system) if attitudes else None
        try:
            windows, said, notes, doubts = windows_of_series(system, data, head, columns, said, named)
        except DataError as error:
            problems += error.problems
            windows = {"phase": _phases_there(data, head)}
    plan: list[PlanRow] = []
    if attitudes is not None:
        plan, unclear = _plan(windows.get("phase", np.empty(0)), said, attitudes(system))
        problems += unclear
    if problems:
        raise DataError(data, problems)
    if columns is WINDOW_COLUMNS or {"std", "n", "flagged"} <= {c.name for c in columns}:
        count = len(next(iter(windows.values())))
        windows.setdefault("std", np.full(count, np.nan))
        windows.setdefault("n", np.ones(count, dtype=np.int64))
        windows.setdefault("flagged", np.zeros(count, dtype=np.int64))
    run = measured_run(system, plan, {n: said[n] for n in texts if n in said})
    run.window_units = {c.name: c.unit for c in columns if c.name in windows}
    run.notes, run.doubts = notes, doubts
    return Record(windows, {}, run)


def set_options(system: System, stated: Sequence[Statement], values: Mapping[str, str]) -> list[str]:
    """Set the options that a file or ``values`` say, which win; return what is wrong with those of the file.

    Raises InvalidValueError for a wrong one of ``values``.
    """
    rows = {s.key: f"row {s.line}: " if s.line else "" for s in stated}
    problems = []
    for name, value in {**values_of(stated), **values}.items():
        if name not in system.options:
            continue
        try:
            system.set(name, value)
        except InvalidValueError as error:
            if name in values:
                raise
            problems.append(f"{rows[name]}{error}")
    return problems


def _type_b_problems(system: System, said: str) -> list[str]:
    given = [n for n in system.given if n.startswith("u_") and system[n]]
    if said not in ("", "none"):
        return [f"type_b = {said}: 'none' or nothing is expected; sizes are given by the options u_..."]
    return [f"type_b = none, but {', '.join(given)} given: leave one of them out"] if said and given else []


def measured_run(system: System, plan: Sequence[PlanRow], texts: Mapping[str, str]) -> RunDocument:
    """Return the run.json of measured data; ``texts``: circumstances, which may replace the title of the system."""
    circumstances: dict[str, Any] = {"title": system.title, **texts}
    return RunDocument(
        system=system.name, spec=list(system.spec), measured=True, complete=True, options=dict(system.values),
        parameters={}, plan=list(plan), **circumstances,
    )  # fmt: skip


def _phases_there(file: Path, head: Head) -> np.ndarray[Any, Any]:
    """Return the phases that the rows of a file name, as far as it can be read: 0 is none."""
    found = set[float]()
    with suppress(DataError):
        for block in read_blocks(file, head, [CsvColumn("phase", "1")]):
            found |= {p for p in np.unique(block["phase"]).tolist() if p > 0.0 and p.is_integer()}
    return np.array(sorted(found))


def _plan(
    phase: np.ndarray[Any, Any], said: Mapping[str, str], modes: Mapping[str, str]
) -> tuple[list[PlanRow], list[str]]:
    plan, problems = [], []
    for p in sorted({int(p) for p in phase}):
        face = said.get(f"phase {p}", "")
        if face not in modes:
            there = f"{face!r} is no attitude" if face else "its attitude is not given"
            problems.append(f"phase {p}: {there}: write '# phase {p} = ...' with one of {', '.join(modes)}")
            continue
        plan.append(PlanRow(phase=p, label=face, mode=modes[face], face=face))
    return plan, problems
