"""A laboratory's time series as the windows of a test: which columns are asked for, and where the phases are.

Phases are the rows that the column ``phase`` numbers (0 or empty: none), or are recognised by the motion of the table
(:mod:`gyrobench.system.table_motion`).  The length of the windows is the plan's, or a comment ``# window = 60s``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gyrobench import units
from gyrobench.arrays import AnyArray
from gyrobench.record import sampling
from gyrobench.record.csv_reader import CsvColumn, DataError, Head, conditions, header_places
from gyrobench.record.row_faults import ROWS, row_faults
from gyrobench.record.time_series import Averager, Averaging, average, read_blocks
from gyrobench.system import table_motion
from gyrobench.system.plan import Phase

if TYPE_CHECKING:
    from gyrobench.system.system import System

SHOWN = {"A": "mA", "rad/s": "deg/h"}  # unit of a column -> in warnings
NO_PHASE = (
    "the phases of this test are not recognised by the motion of the table: add a column 'phase' (their number in each "
    "row, 0 while moving or settling)"
)
FLAG = CsvColumn("flag", "1", "other than 0: the sample is suspect", required=False)


def is_time_series(head: Head, columns: Sequence[CsvColumn]) -> bool:
    """True for a file with the column ``time``, of a test whose windows are means: time series may be averaged."""
    names = {n.split("[")[0].strip() for n in head.names}
    known = {c.name for c in columns}
    return "time" in names and "t_start" not in names and "t_start" in known and any("mean" in n for n in known)


def faults_of_series(file: Path, head: Head, columns: Sequence[CsvColumn]) -> list[str]:
    """Return what is wrong with the columns and rows of a file whose circumstances are wrong already."""
    asked = _Names.of((*columns, *conditions(head.names))).asked(head)
    places, problems = header_places(head.names, {c.name: c for c in asked})
    return problems + row_faults(file, head, places, "time", ROWS)


@dataclass(frozen=True)
class _Names:
    """Columns of the time series for columns of windows: mean_x -> current_x, angle_start -> angle."""

    signals: dict[str, str]  # column of the windows -> of the series
    optional: dict[str, str]
    angles: list[str]
    keys: list[str]
    columns: list[CsvColumn]

    @classmethod
    def of(cls, windows: Sequence[CsvColumn]) -> _Names:
        signals: dict[str, str] = {}
        optional: dict[str, str] = {}
        angles: list[str] = []
        keys: list[str] = []
        columns = [CsvColumn("time", "s", "time of the sample")]
        for c in windows:
            base, _, end = c.name.rpartition("_")
            if c.name in ("t_start", "t_end", "n") or c.name.startswith(("std", "flagged")):
                continue
            if end in ("start", "end") and base:
                if base not in angles:
                    angles.append(base)
                    columns.append(CsvColumn(base, c.unit, c.meaning.partition(" at the ")[0], c.required))
                continue
            if c.whole:
                keys.append(c.name)
                columns.append(CsvColumn(c.name, c.unit, c.meaning, required=c.required and c.name != "phase"))
                continue
            name = c.name.replace("mean", {"A": "current", "V": "voltage"}.get(c.unit, "mean"))
            (signals if c.required else optional)[c.name] = name
            columns.append(CsvColumn(name, c.unit, c.meaning.removeprefix("mean "), c.required))
        return cls(signals, optional, angles, keys, [*columns, FLAG])

    def asked(self, head: Head) -> list[CsvColumn]:
        """Return the columns to read: those that must be there, and those that are."""
        there = {n.split("[")[0].strip() for n in head.names}
        return [c for c in self.columns if c.required or c.name in there]


def windows_of_series(
    system: System, file: Path, head: Head, columns: Sequence[CsvColumn], said: Mapping[str, str],
    attitudes: Mapping[str, str] | None,
) -> tuple[dict[str, AnyArray], dict[str, str], list[str], list[str]]:  # fmt: skip
    """Return the windows, the comments ``phase N`` (those found by the motion too), warnings: what was left out,
    samples that may be aliased; and what no verdict rests on: coarse words, the end of a range.

    attitudes: what a phase may be called.  Raises DataError.
    """
    columns = (*columns, *conditions(head.names))
    names = _Names.of(columns)
    there = {n.split("[")[0].strip() for n in head.names}
    keys = [k for k in names.keys if k in there]
    asked = names.asked(head)
    phases = [p for p in system.plan().phases if isinstance(p, Phase)]
    by_motion = "phase" in names.keys and not keys
    try:
        kind, bandwidth = sampling.stated(said)
        if by_motion and not names.angles:
            raise ValueError(NO_PHASE)
        if by_motion:
            phases = _expected(phases, said, attitudes or {})
            step, stretches = _recognise(file, head, asked, names, phases)
            keys = ["phase"]
            said = {**said, **{f"phase {k}": _name(p, attitudes or {}) for k, p in enumerate(phases, 1)}}
            rule = _rule_of_motion(phases)
        else:
            rule = _rule_of_columns(phases, said, keys)
        averager = Averager(
            list(names.signals.values()), [a for a in names.angles if a in there], keys, rule,
            optional=[n for n in names.optional.values() if n in there],
        )  # fmt: skip
        blocks = read_blocks(file, head, asked)
        if by_motion:
            blocks = (_numbered(b, stretches, phases, step) for b in blocks)
        series = average(blocks, averager)
    except ValueError as error:
        places, _ = header_places(head.names, {c.name: c for c in asked})
        raise DataError(file, [str(error), *row_faults(file, head, places)]) from None
    if not series:
        raise DataError(file, [f"no window is complete; {averager.sentence() or 'the time series is too short'}"])
    problems = _short(averager, phases) if by_motion else []
    if problems:
        raise DataError(file, problems)
    units_of = {c.name: SHOWN.get(c.unit, c.unit) for c in names.columns}
    notes, doubts = [averager.sentence()], [averager.lost_sentence()]
    readings = [name for column, name in names.signals.items() if "mean" in column]
    for s in readings:
        seen = averager.successive[s]
        notes.append(sampling.warning(s, units_of[s], averager.step, seen, kind, bandwidth))
        doubts += [sampling.coarse(s, units_of[s], seen), sampling.ended(s, seen)]
    notes, doubts = ([t for t in texts if t] for texts in (notes, doubts))
    return _as_windows(series, names, keys, columns), dict(said), notes, doubts


def _as_windows(
    series: Mapping[str, AnyArray], names: _Names, keys: Sequence[str], columns: Sequence[CsvColumn]
) -> dict[str, AnyArray]:
    """Return the columns named as those of a file of windows, in their order."""
    made: dict[str, AnyArray] = {k: series[k].astype(np.int64) for k in keys}
    for column, name in {**names.signals, **names.optional}.items():
        if name in series:
            there = np.isfinite(series[name])
            if not there.any():
                continue
            made[column] = np.interp(series["t_end"], series["t_end"][there], series[name][there])  # logged less often
        if f"std {name}" in series and "mean" in column:  # of readings alone
            made[column.replace("mean", "std")] = series[f"std {name}"]
    for n in ("n", *(c.name for c in columns if c.name.startswith("flagged"))):
        made[n] = series[n.partition("_")[0]].astype(np.int64)
    return {c.name: v for c in columns if (v := made.get(c.name, series.get(c.name))) is not None}


def _name(phase: Phase, attitudes: Mapping[str, str]) -> str:
    return phase.label if phase.label in attitudes else phase.face


def _expected(plan: Sequence[Phase], said: Mapping[str, str], attitudes: Mapping[str, str]) -> list[Phase]:
    """Return the phases in the order of the comments ``phase N = ...``, or of the plan.  Raises ValueError."""
    numbers = sorted(int(k[6:]) for k in said if k.startswith("phase ") and k[6:].isdigit())
    if numbers:
        of: dict[str, Phase] = {}
        for p in plan:
            of.setdefault(_name(p, attitudes), p)
        unknown = [said[f"phase {n}"] for n in numbers if said[f"phase {n}"] not in of]
        if unknown:
            raise ValueError(f"phase {', '.join(unknown)} is not in the plan; it has {', '.join(of)}")
        plan = [of[said[f"phase {n}"]] for n in numbers]
    if not plan or any(p.mode in ("servo", "step") or p.target_y for p in plan):
        raise ValueError(f"{NO_PHASE} and comments '# phase 1 = ...'")
    return list(plan)


def _recognise(
    file: Path, head: Head, asked: Sequence[CsvColumn], names: _Names, phases: Sequence[Phase]
) -> tuple[float, list[table_motion.Stretch]]:
    """Return the usual step (s) and the stretch of each phase."""
    columns = [c for c in asked if c.name in ("time", *names.angles)]
    first = next(iter(read_blocks(file, head, columns)))["time"]
    step = float(np.nanmedian(np.diff(first))) if first.size > 1 else 0.0
    width = table_motion.cell_width(phases, step)
    t, angle = table_motion.cells(read_blocks(file, head, columns), width)
    try:
        found = table_motion.match(t, angle, phases, width)
    except ValueError as error:
        raise ValueError(
            f"the motion of the table does not fit the plan: {error}. Set the options of the plan as the test was run, "
            "give the order by comments '# phase 1 = ...', or add a column 'phase'"
        ) from None
    return step, table_motion.refine(read_blocks(file, head, columns), found, width)


def _numbered(
    block: dict[str, AnyArray], stretches: Sequence[table_motion.Stretch], phases: Sequence[Phase], step: float
) -> dict[str, AnyArray]:
    """Add the column phase: of each stretch what is left after settling, which began up to a step before it."""
    t, phase = block["time"], np.zeros_like(block["time"])
    for k, (s, p) in enumerate(zip(stretches, phases, strict=True), 1):
        phase[(t >= s.start + p.settle - 1.001 * step) & (t <= s.end)] = k
    return {**block, "phase": phase}


def _count(p: Phase) -> int:
    return int((p.travel if p.by_angle else p.dwell) / p.window + 1e-6)


def _rule_of_motion(phases: Sequence[Phase]) -> Callable[[tuple[int, ...]], Averaging]:
    rules = [Averaging(p.window, p.by_angle, _count(p)) for p in phases]
    return lambda key: rules[key[0] - 1]


def _rule_of_columns(
    plan: Sequence[Phase], said: Mapping[str, str], keys: Sequence[str]
) -> Callable[[tuple[int, ...]], Averaging]:
    """Windows of the plan's phase of that name; of the plan, where all are alike; or of the comment ``window``."""
    given = units.parse_quantity(said["window"], "s") if "window" in said else 0.0
    alike = {(p.by_angle, p.window) for p in plan}

    def rule(key: tuple[int, ...]) -> Averaging:
        name = said.get(f"phase {key[keys.index('phase')]}", "") if "phase" in keys else ""
        mine = [p for p in plan if name in (p.label, p.face)]
        turning = bool(mine) and mine[0].by_angle
        if given > 0.0 and not turning:
            return Averaging(given)
        if mine or len(alike) == 1:
            by_angle, window = (turning, mine[0].window) if mine else next(iter(alike))
            return Averaging(window, by_angle)
        where = f"phase {key[0]}" if "phase" in keys else "the series"
        raise ValueError(f"{where}: the length of the windows is not known; write '# window = 60s'")

    return rule


def _short(averager: Averager, phases: Sequence[Phase]) -> list[str]:
    counts = [(k, p, averager.counted.get((k,), 0)) for k, p in enumerate(phases, 1)]
    short = [(k, p, n) for k, p, n in counts if n < max(_count(p) - 1, 1)]
    if not short:
        return []
    k, p, n = short[0]
    others = f", and {len(short) - 1} more phases alike" if len(short) > 1 else ""
    return [
        f"phase {k} '{p.label}': {n} windows instead of {_count(p)} between settling and the next motion{others}; set "
        "settle, dwell or the number of windows as the test was run"
    ]
