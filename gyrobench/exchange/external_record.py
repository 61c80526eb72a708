"""A record from series that another tool has produced with an exported system.

A row of the windows is taken where the watched output (the number of completed windows) has changed, as in runs of the
bench.  The sampler holds what it says of a window until the next one ends, so the rows may be as far apart as the
shortest window; what other parts say is needed in the very step.

What would be wrong without being seen is refused: a file that begins late, windows between two rows, numbers that a
tool has interpolated or rounded, windows that are not those of the plan.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gyrobench.arrays import AnyArray
from gyrobench.exchange.result_files import Block, ResultFile, listed
from gyrobench.record.csv_reader import DataError
from gyrobench.record.record import WHOLE, Record
from gyrobench.record.run_document import RunDocument
from gyrobench.system.binding import Binding, Bound
from gyrobench.system.system import System
from gyrobench.system.values import flatten

DIGITS = 6  # of the numbers in the CSV of libcosim
COARSE = 1e-3  # of a window: an error of its ends by rounding that is refused
FINE = 1e-7  # that is not told
ROUNDED = 1e-5  # relative, of parameters as a tool writes them
MOST = 6  # parameters that a message names
LENGTH = 1e-2  # of a window, by which its length may differ from that of the plan
TURN = 0.1  # of a window by angle: the angle is a reading


def shortest_window(system: System) -> float:
    """Return the length of the shortest window of the plan, s; the step where the plan has none."""
    phases = [p for p in getattr(system.plan(), "phases", ()) if getattr(p, "window", 0.0) > 0.0]
    lengths = [p.window / abs(p.target) if p.mode == "rate" and p.target else p.window for p in phases]
    return min(lengths, default=system.step)


def row_steps(system: System) -> int:
    """Return how many steps two rows of a result may be apart: a whole part of the channels' period.

    At most a quarter of the shortest window where samplers alone make the windows, for they hold what they say until
    the next one ends; 1 where other parts say something of a window.
    """
    channels = max(1, round(system.channel_period / system.step))
    if system.windows is None:
        return channels
    slots = {n.partition(".")[0] for n in (system.windows.watch, *system.windows.columns.values())}
    if any(system.slots[s].socket != "Sampler" for s in slots):
        return 1
    most = max(1.0, 0.25 * shortest_window(system) / system.step)
    return max(k for k in range(1, channels + 1) if channels % k == 0 and k <= most)


@dataclass(frozen=True)
class RecordedOutput:
    """Recorded output in a file: its name there, None for a constant; how it becomes SI; whether it is held."""

    name: str | None
    bound: Bound
    held: bool = True

    def si(self, block: Block, rows: AnyArray) -> AnyArray:
        if self.name is None:
            return np.full(len(rows), self.bound.constant, dtype=float)
        return np.asarray(self.bound.si(np.asarray(block[self.name][rows], dtype=float)), dtype=float)


def find_series(
    result: ResultFile, recorded: Mapping[str, tuple[str, Bound]], needed: set[str], held: set[str]
) -> tuple[dict[str, RecordedOutput], list[str]]:
    """Return the series of the recorded outputs by their names, and the names of those that are not in the file.

    In the file an output is "slot.variable" with the name that its FMU gives it and in the FMU's unit, "slot.output" in
    SI, as containers have it, or either behind the names of what holds the system, "root.slot.variable".  held: slots
    whose outputs hold what they say of a window.
    Raises DataError where one that is ``needed`` is missing, or one is there twice.
    """
    found: dict[str, RecordedOutput] = {}
    missing, problems = [], []
    ends: dict[str, list[str]] = {}
    for name in result.names:
        parts = name.split(".")
        for k in range(max(0, len(parts) - 4), len(parts) - 1):
            ends.setdefault(".".join(parts[k:]), []).append(name)
    for output, (slot, bound) in recorded.items():
        if bound.constant is not None:
            found[output] = RecordedOutput(None, bound)
            continue
        own = f"{slot}.{bound.variable}"
        fits = list(dict.fromkeys([*ends.get(own, ()), *ends.get(output, ())]))
        exact = [n for n in (own, output) if n in fits]
        if len(fits) > 1 and not exact:
            problems.append(f"{own} appears as {listed(fits)}; one system in a file")
        elif fits:
            name = (exact or fits)[0]
            si = name not in ends.get(own, ())
            found[output] = RecordedOutput(name, replace(bound, gain=1.0, offset=0.0) if si else bound, slot in held)
        elif own in result.constants or output in result.constants:
            problems.append(f"{own} is constant in the file: nothing ran, or its outputs were not stored")
        else:
            missing.append(own)
            if output in needed:
                problems.append(f"{own} is missing")
    if problems:
        problems.append(f"series of the file: {listed([n for n in result.names if n != result.time])}")
        raise DataError(result.name, problems)
    return found, missing


@dataclass
class ResultReader:
    """Windows and channels of a file, block by block."""

    system: System
    result: ResultFile
    series: Mapping[str, RecordedOutput]
    step: float  # s, of the system
    windows: dict[str, list[AnyArray]] = field(default_factory=dict)
    channels: dict[str, list[AnyArray]] = field(default_factory=dict)
    last: tuple[float, float] | None = None  # time and count of the row before
    until: float = 0.0  # s, the last row of the channels
    done: bool | None = None  # None: the file does not have the end of the plan
    single: bool = False  # numbers of single precision

    def read(self) -> None:
        """Take the whole file.  Raises DataError."""
        names = [self.result.time, *(s.name for s in self.series.values() if s.name is not None)]
        windows = self.system.windows
        shown = [n for n in self.system.channels if n in self.series]
        for block in self.result.read(names):
            time = np.asarray(block[self.result.time], dtype=float)
            if not len(time):
                continue
            self._check_time(time)
            time = time[: self._until_done(block, time)]
            if not len(time):  # after the end of the plan
                continue
            block = {n: c[: len(time)] for n, c in block.items()}
            if windows is not None:
                self.single = self.single or any(c.dtype == np.float32 for c in block.values())
                self._windows(block, time)
            before = time[-2] if len(time) > 1 else self.until
            late = self.done and time[-1] - before > 1.5 * self.step  # it goes on after the end of the plan
            self._channels(block, time[:-1] if late else time, shown)
            self.until = float(before if late else time[-1])
            count = (
                0.0 if windows is None else float(self.series[windows.watch].si(block, np.array([len(time) - 1]))[0])
            )
            self.last = float(time[-1]), count
        if self.last is None:
            raise DataError(self.result.name, ["no rows"])

    def _until_done(self, block: Block, time: AnyArray) -> int:
        """Return the number of rows until the plan is over: a run of the bench ends there.  Raises DataError."""
        end = self.series.get(self.system.done or "")
        if end is None:
            return len(time)
        over = end.si(block, np.arange(len(time))) != 0.0
        first = 0 if self.done else int(np.argmax(over)) if np.any(over) else len(time)
        if not np.all(over[first:]):
            again = time[first + int(np.argmin(over[first:]))]
            raise self._fail(f"{self.system.done} goes back to 0 at t = {again:.9g} s: more than one run in the file")
        rows = 0 if self.done else min(first + 1, len(time))
        self.done = self.done or first < len(time)
        return rows

    def _fail(self, problem: str) -> DataError:
        return DataError(self.result.name, [problem])

    def _check_time(self, time: AnyArray) -> None:
        before = self.last[0] if self.last else time[0]
        steps = np.diff(time, prepend=before)
        if not np.all(np.isfinite(time)) or np.any(steps < 0.0):
            k = int(np.argmax(~np.isfinite(time) | (steps < 0.0)))
            raise self._fail(f"the time {time[k]:.9g} s comes after {time[k] - steps[k]:.9g} s")

    def _windows(self, block: Block, time: AnyArray) -> None:
        windows = self.system.windows
        assert windows is not None
        all_rows = np.arange(len(time))
        count = self.series[windows.watch].si(block, all_rows)
        before = self.last or (float(time[0]), 0.0)
        if self.last is None and count[0] != 0.0:
            raise self._fail(
                f"{windows.watch} is {count[0]:g} in the first row (t = {time[0]:.6g} s): the file must begin "
                "with the run, before the first window ends"
            )
        steps = np.diff(count, prepend=before[1])
        at = np.flatnonzero(steps != 0.0)
        whole = np.round(count)
        if np.any(bad := ~np.isfinite(count) | (count != whole)):
            k = int(np.argmax(bad))
            raise self._fail(
                f"{windows.watch} is {count[k]:g} at t = {time[k]:.9g} s, no whole number: the tool has interpolated "
                "between communication points; let it write their values"
            )
        if np.any(steps < 0.0):
            k = int(np.argmax(steps < 0.0))
            raise self._fail(f"{windows.watch} goes back at t = {time[k]:.9g} s: more than one run in the file")
        gap = np.diff(time, prepend=before[0])
        if np.any(steps > 1.0):
            k = int(np.argmax(steps))
            raise self._fail(
                f"{steps[k]:g} windows end between the rows at t = {time[k] - gap[k]:.9g} s and {time[k]:.9g} s: the "
                f"output is too coarse; write a row at least every {shortest_window(self.system):.4g} s"
            )
        late = gap[at] > 1.5 * self.step if len(at) else np.zeros(0, dtype=bool)
        of_the_step = [n for n, o in windows.columns.items() if not self.series[o].held and self.series[o].name]
        if of_the_step and np.any(late):
            raise self._fail(
                f"rows every {float(np.median(gap[at])):.4g} s: {', '.join(of_the_step)} of a window are needed in the "
                f"step in which it ends; write a row every {self.step:g} s"
            )
        for name, output in windows.columns.items():
            values = self.series[output].si(block, at)
            if not np.all(np.isfinite(values)):
                k = int(np.argmax(~np.isfinite(values)))
                raise self._fail(f"{output} is {values[k]:g} at t = {time[at[k]]:.9g} s")
            self.windows.setdefault(name, []).append(values)

    def _channels(self, block: Block, time: AnyArray, names: list[str]) -> None:
        """Take the rows at whole multiples of the channels' period, the last of those of one time."""
        if not names:
            return
        period = max(1, round(self.system.channel_period / self.step)) * self.step
        number = np.round(time / period)
        on = np.abs(time - number * period) < 0.25 * self.step
        on &= np.append(time[1:] != time[:-1], True)
        rows = np.flatnonzero(on)
        self.channels.setdefault("time", []).append(number[rows] * period)
        for name in names:
            self.channels.setdefault(name, []).append(self.series[name].si(block, rows))

    def record(self, run: RunDocument) -> Record:
        """Return the record.  Raises DataError where its windows are not those of the plan in ``run``."""
        assert self.last is not None
        windows = {n: np.concatenate(v) for n, v in self.windows.items()}
        if windows:
            self._step_of(windows, run)
            self._check_plan(windows, run)
            self._check_digits(windows, run)
        windows = {n: c.astype(np.int64) if n in WHOLE else c for n, c in windows.items()}
        channels = {n: np.concatenate(v) for n, v in self.channels.items()}
        if channels:
            _, first = np.unique(channels["time"][::-1], return_index=True)
            channels = {n: c[::-1][first] for n, c in channels.items()}
            period = max(1, round(self.system.channel_period / self.step)) * self.step
            wanted = int(self.until / period + 1e-6) + 1
            if len(channels["time"]) != wanted:
                problem = (
                    f"the file has {len(channels['time'])} of the {wanted} rows at multiples of {period:g} s that the "
                    "channels are recorded at"
                )
                if not windows:
                    row = f"write a row every {period:g} s, from t = 0"
                    raise self._fail(f"{problem}; {row}; by FMPy: fmpy simulate --output-interval {period:g}")
                run.notes.append(f"No channels: {problem}.")
                channels = {}
        run.stopped_at = self.last[0]
        run.steps = round(self.last[0] / run.step)
        return Record(windows, channels, run)

    def _step_of(self, windows: Mapping[str, AnyArray], run: RunDocument) -> None:
        """Take the communication step from the numbers of samples in the windows."""
        if not {"t_start", "t_end", "n"} <= windows.keys() or not np.all(windows["n"] > 0.0):
            return
        step = float(np.median((windows["t_end"] - windows["t_start"]) / windows["n"]))
        if step > 0.0 and abs(step / run.step - 1.0) > 1e-3:
            run.notes.append(
                f"The communication step of the run was {step:.4g} s; that of the system is {run.step:g} s."
            )
            run.step = float(f"{step:.6g}")

    def _check_plan(self, windows: Mapping[str, AnyArray], run: RunDocument) -> None:
        if not {"phase", "t_start", "t_end"} <= windows.keys():
            return
        plan = {row.phase: row for row in run.plan}
        hint = f"the run was exported with other values (give the same --set) or is not one of {self.system.name}"
        for k, phase in enumerate(windows["phase"]):
            row = plan.get(int(phase))
            if row is None:
                raise self._fail(f"window {k + 1} is of phase {phase:g}, the plan has {len(plan)} phases; {hint}")
            length = float(windows["t_end"][k] - windows["t_start"][k])
            unit, wanted, off = "s", row.window, 1.5 * run.step + LENGTH * row.window
            if row.mode == "rate":
                if "angle_end" not in windows:
                    continue
                unit = "rad"
                turned = float(abs(windows["angle_end"][k] - windows["angle_start"][k]))
                off = TURN * wanted + 1.5 * run.step * turned / length
                length = turned
            if wanted > 0.0 and abs(length - wanted) > off:
                raise self._fail(
                    f"window {k + 1}, of phase {row.phase} ({row.label}), has {length:.6g} {unit}, those of the plan "
                    f"{wanted:.6g} {unit}; {hint}"
                )

    def _check_digits(self, windows: Mapping[str, AnyArray], run: RunDocument) -> None:
        """Refuse ends of windows that rounding moves by much of a window; tell of less."""
        numbers = np.concatenate([c for n, c in windows.items() if n not in WHOLE])
        few = all(float(f"{x:.{DIGITS}g}") == x for x in numbers.tolist())
        if not (few or self.single):
            return
        what = f"numbers of {DIGITS} digits" if few else "numbers of single precision"
        moved = []
        for begin, end in ((n, n.replace("start", "end")) for n in windows if n.endswith("_start")):
            length = np.abs(windows[end] - windows[begin])
            most = np.maximum(np.abs(windows[end]), np.abs(windows[begin]))
            spacing = 10.0 ** (np.floor(np.log10(np.maximum(most, 1e-300))) + 1 - DIGITS)
            spacing = spacing if few else np.spacing(most.astype(np.float32)).astype(float)
            turning = length > 10.0 * spacing
            if np.any(turning):
                moved.append(float(np.max(spacing[turning] / length[turning])))
        share = max(moved, default=0.0)
        text = f"{what}: the ends of the windows are known to {share:.1g} of a window"
        if share > COARSE:
            raise self._fail(
                f"{text}; let the tool write 16 digits, or double precision (the CSV of libcosim has {DIGITS} digits: "
                "save its values from Python)"
            )
        if share > FINE:
            run.notes.append(f"The file holds {text}, which is not in u.")


def check_parameters(result: ResultFile, bindings: Mapping[str, Binding], parameters: Mapping[str, Any]) -> int:
    """Return how many parameters the file states, all with the values of this run.  Raises DataError where one differs.

    Modelica tools and libcosim store parameters; seeds do not count.  parameters: "slot.name" -> SI value.
    """
    values = {
        k: v for n, nested in parameters.items() for k, v in flatten(n, nested).items() if not n.endswith(".seed")
    }
    expected: dict[str, tuple[str, Bound]] = {}
    for name in values:
        slot, _, element = name.partition(".")
        bound = bindings[slot].parameters.get(element)
        if bound is not None and bound.kind != "String":
            expected[name] = slot, bound
    there = ResultFile(result.name, [*result.names, *result.constants], result.time, result.read)
    found, _ = find_series(there, expected, set(), set())
    columns = [s.name for s in found.values() if s.name is not None and s.name not in result.constants]
    first: dict[str, float] = dict(result.constants)
    block = next(iter(result.read([result.time, *columns])), {}) if columns else {}
    first |= {n: float(v[0]) for n, v in block.items() if len(v)}
    wrong = []
    for name, series in found.items():
        stated = first.get(series.name or "", math.nan)
        wanted = float(expected[name][1].own(values[name]))
        if not math.isclose(stated, wanted, rel_tol=ROUNDED, abs_tol=1e-30):
            wrong.append(f"{name}: {stated:.9g} in the file, {wanted:.9g} here {expected[name][1].unit}".rstrip())
    if wrong:
        more = f"and {len(wrong) - MOST} more parameters" if len(wrong) > MOST else ""
        raise DataError(
            result.name,
            [*wrong[:MOST], *([more] if more else []), "the run had other values; give the same with --set as there"],
        )
    return len(found)
