"""Records of a control loop under excitation: time, excitation, plant input, plant output.

    # excitation enters at = plant input
    time [s],excitation [A],input [A],output [deg/s]

``controller`` [unit] instead of ``input``: what the controller gives, before the excitation is added to it.  Where the
excitation enters, and what the loop then is:

    plant input     u = v + r,  v = -C y
    reference       u = C (r - y)
    plant output    u = -C (y + r)       added to what is measured, behind the summing point of the bench's loop tests

Units tell the first from the others; an excitation with the unit of both must be stated.  All inside is SI.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.errors import Advice, GyrobenchError
from gyrobench.record.circumstances import MISPRINT, Keys
from gyrobench.record.column_proposal import find_layout
from gyrobench.record.csv_reader import CsvColumn, DataError, read_head
from gyrobench.record.drift_columns import open_table
from gyrobench.record.log_files import as_text, is_log

PLANT_INPUT, REFERENCE, PLANT_OUTPUT = "plant input", "reference", "plant output"
PLACES = (PLANT_INPUT, REFERENCE, PLANT_OUTPUT)
AT, PERIOD = "excitation enters at", "period"
LEAST = 200  # samples
UNEVEN = 0.5  # of a step: a time further off its even grid is a gap, less is rounding

MEANINGS = {
    "time": "time of the sample",
    "excitation": "the test signal r, as the loop gets it",
    "input": "input of the plant, with the excitation where that is added there",
    "controller": "output of the controller, before the excitation is added",
    "output": "output of the plant, as the controller gets it",
}


@dataclass(frozen=True)
class LoopRecord:
    """Samples of a loop at an even step, s: excitation r, plant input u, plant output y, SI; at: one of PLACES.

    shown: signal -> unit of the file.  period: s, as stated; 0: to be found.
    """

    name: str
    step: float
    r: Array
    u: Array
    y: Array
    at: str
    shown: Mapping[str, str]
    period: float = 0.0

    @property
    def length(self) -> float:
        """Return the length, s."""
        return self.r.size * self.step

    @property
    def closed(self) -> bool:
        """Return whether there is a loop: without one the input is the excitation itself."""
        return not np.array_equal(self.u, self.r)


def read_loop(file: Path, at: str = "", period: str = "", columns: Path | None = None) -> LoopRecord:
    """Return the record of a file; at, period: replace what its comments state.  columns: a column map.

    CSV, Parquet and the logs that ``gyrobench reduce`` reads.  Raises DataError with all that is wrong.
    """
    if columns is not None:
        return _mapped(file, at, period, columns)
    text = as_text(file) if is_log(file) and file.suffix.lower() != ".parquet" else file
    try:
        return _read(text, file.name, at, period)
    except DataError as error:
        raise error.advised(*_of_own_layout(file, text)) from None


def _of_own_layout(file: Path, text: Path) -> list[Advice]:
    """Return the first lines of a column map for a file with other names, or with rows above or below them."""
    with suppress(GyrobenchError, ValueError):
        found = find_layout(text)
        names = {str(c.sources[0]).partition("[")[0].strip() for c in found.columns}
        if (
            "excitation" not in names
            or found.below
            or found.encoding != "utf-8"
            or read_head(text).line != found.skip + 1
        ):
            source = '"ITS NAME"' if found.names else "ITS NUMBER"
            lines = [*found.keys(not is_log(file)), "[columns.time]", f"from = {source}", 'unit = "s"']
            begins = "\n  ".join([*lines, "and so on for excitation, input (or controller) and output"])
            return [
                Advice("columns", f"the file has a layout of its own; --columns MAP reads it, a file of:\n  {begins}")
            ]
    return []


def _mapped(file: Path, at: str, period: str, columns: Path) -> LoopRecord:
    from gyrobench.record.column_map import read_map, translate

    found = read_map(columns)
    stated = found.values()
    with TemporaryDirectory() as folder:
        text = Path(folder) / "columns.csv"
        done = translate(file, found, text)
        try:
            record = _read(text, file.name, at or stated.get(AT, ""), period or stated.get(PERIOD, ""))
        except DataError as error:
            raise DataError(file, done.problems(error.problems)) from None
    if done.problems():
        raise DataError(file, done.problems())
    return record


def _read(source: Path, name: str, at: str, period: str) -> LoopRecord:
    table = open_table(source)
    expected, unit, problems = _columns(table.head.names)
    if problems:
        raise DataError(name, problems)
    blocks = list(table.blocks(expected))
    data = {c.name: np.concatenate([b[c.name] for b in blocks]) for c in expected}
    step, problems = _step(data)
    stated = table.head.comments
    known = Keys((AT, PERIOD))
    problems += [
        f"row {s.line}: '{s.key}' is not known; did you mean '{near[0]}'?"
        for s in table.head.statements
        if s.key not in known and (near := known.nearest(s.key, MISPRINT))
    ]
    place, why = _place(at or stated.get(AT, ""), unit)
    seconds, wrong = _period(period or stated.get(PERIOD, ""))
    problems += why + wrong
    if problems:
        raise DataError(name, problems)
    r = data["excitation"]
    u = data["input"] if "input" in data else data["controller"] + (r if place == PLANT_INPUT else 0.0)
    return LoopRecord(name, step, r, u, data["output"], place, unit, seconds)


def _columns(header: list[str]) -> tuple[list[CsvColumn], dict[str, str], list[str]]:
    """Return the columns to read, the unit of each, and what is wrong with the header."""
    unit: dict[str, str] = {}
    problems = []
    for text in header:
        found = re.fullmatch(r"([^\[\]]+?)\s*(?:\[(.*)\])?", text)
        if found and found[1] in MEANINGS:
            if found[1] in unit:
                problems.append(f"column '{found[1]}': appears twice")
            unit[found[1]] = found[2] or ""
    if "input" in unit and "controller" in unit:
        del unit["controller"]  # the plant's input says more
    asked = ["time", "excitation", "controller" if "controller" in unit else "input", "output"]
    for name in asked:
        other = ", or 'controller', " + MEANINGS["controller"] if name == "input" else ""
        if name not in unit:
            problems.append(
                f"column '{name} [{'s' if name == 'time' else 'unit'}]' is missing ({MEANINGS[name]}{other}); columns "
                f"of the file: {', '.join(header)}"
            )
            continue
        if not unit[name]:
            problems.append(
                f"column '{name}': no unit; write '{name} [{'s' if name == 'time' else 'N.m'}]', [1] for none"
            )
            continue
        try:
            of = units.unit(unit[name])
            if name == "time" and not units.same_dimension(unit[name], "s"):
                problems.append(f"column 'time': wrong unit [{unit[name]}]: s, ms, min ...")
            if of.offset:
                problems.append(f"column '{name}': [{unit[name]}] has an offset; a loop needs a unit without")
        except units.UnitError as error:
            problems.append(f"column '{name}': {error}")
    return (
        [CsvColumn(n, unit.get(n, "1"), MEANINGS[n]) for n in asked],
        {n: unit[n] for n in asked if n in unit},
        problems,
    )


def _step(data: Mapping[str, Array]) -> tuple[float, list[str]]:
    """Return the step of the samples, s, and what is wrong with them."""
    t = data["time"]
    for name, values in data.items():
        if lost := int(np.sum(~np.isfinite(values))):
            first = int(np.flatnonzero(~np.isfinite(values))[0])
            return 0.0, [f"column '{name}': {lost} of {t.size} cells without a number, the first in sample {first + 1}"]
    if t.size < LEAST:
        return 0.0, [f"{t.size} samples; at least {LEAST} are needed"]
    if not np.all(np.diff(t) > 0.0):
        k = int(np.flatnonzero(np.diff(t) <= 0.0)[0])
        return 0.0, [f"time does not increase: {t[k + 1]:.9g} s after {t[k]:.9g} s, sample {k + 2}"]
    step = float(np.median(np.diff(t)))
    count = round((t[-1] - t[0]) / step)
    even = float(t[-1] - t[0]) / max(count, 1)
    off = np.abs(t - t[0] - even * np.arange(t.size))
    if count == t.size - 1 and float(off.max()) <= UNEVEN * even:
        return even, []
    k = int(np.argmax(np.diff(t)))
    return 0.0, [
        f"the time steps are not even: {step:.6g} s is the usual one, {t[k + 1] - t[k]:.6g} s the longest (after "
        f"{t[k]:.9g} s). A frequency response needs every sample: cut the record to a stretch without gaps"
    ]


def _place(stated: str, unit: Mapping[str, str]) -> tuple[str, list[str]]:
    """Return where the excitation enters, by what is stated or by its unit."""
    column = "input" if "input" in unit else "controller"
    fits = [units.same_dimension(unit["excitation"], unit[n]) for n in (column, "output")]
    if stated:
        if stated not in PLACES:
            return "", [f"{AT} = {stated}: one of {', '.join(PLACES)}"]
        if not fits[0 if stated == PLANT_INPUT else 1]:
            other = column if stated == PLANT_INPUT else "output"
            return "", [
                f"the excitation enters at the {stated}, so it has the unit of the {other}: [{unit['excitation']}] and "
                f"[{unit[other]}] do not add"
            ]
        return stated, []
    if fits == [True, False]:
        return PLANT_INPUT, []
    why = (
        f"its unit [{unit['excitation']}] fits input and output"
        if fits == [True, True]
        else f"its unit [{unit['excitation']}] is that of the output, which the reference and the measured value share"
        if fits == [False, True]
        else f"its unit [{unit['excitation']}] is neither that of the {column} [{unit[column]}] nor of the output "
        f"[{unit['output']}]; an excitation that is not added to one of them (a shaker, a load) is a disturbance, from "
        "which L cannot be had"
    )
    return "", [f"where the excitation enters is not stated: {why}. Write '# {AT} = {' | '.join(PLACES)}'"]


def _period(text: str) -> tuple[float, list[str]]:
    if not text:
        return 0.0, []
    try:
        seconds = units.parse_quantity(text, "s")
    except units.UnitError as error:
        return 0.0, [f"{PERIOD} = {text}: {error}"]
    return (seconds, []) if seconds > 0.0 else (0.0, [f"{PERIOD} = {text}: must be above 0"])
