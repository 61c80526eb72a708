"""Records of exported systems that other tools have run, and how far apart two results are."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from masters import Array, Names, PeerError, run_in

from gyrobench.engine.session import run
from gyrobench.errors import GyrobenchError
from gyrobench.exchange.ssp_export import prepare, recorded
from gyrobench.record.record import WHOLE, Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.step_effect import step_effects
from gyrobench.result import Coefficient, Result
from gyrobench.system.system import System, load_system

ROUNDING = 1e-12  # in the units of reports
#: systems that measure their noise: the same draws at the same step, others at another one
NOISY = {"drift_compensation", "drift_record", "estimator_bench"}
LATE = 200  # steps by which a tool that couples in parallel may come to the end later: some in each phase


def record_from_series(system: System, series: Mapping[str, Array], run: RunDocument | None = None) -> Record:
    """Return the record of a run that another tool did.

    series: "slot.output" -> samples at every communication step, for the watched output and all columns of
    ``system.windows``.  A window is complete where the watched output changes, as in runs of the bench.  Raises
    KeyError naming the series that are missing.
    """
    assert system.windows is not None, f"{system.name} has no windows"
    names = [system.windows.watch, *system.windows.columns.values()]
    missing = [n for n in names if n not in series]
    if missing:
        raise KeyError(f"series missing: {', '.join(missing)}")
    count = np.asarray(series[system.windows.watch], dtype=float)
    at = np.flatnonzero(np.diff(count) != 0.0) + 1
    columns = {}
    for name, source in system.windows.columns.items():
        column = np.asarray(series[source], dtype=float)[at]
        columns[name] = column.astype(np.int64) if name in WHOLE else column
    return Record(columns, {}, run or RunDocument())


def at_step(name: str, values: Mapping[str, Any], step: float | None = None, noise: bool = False) -> System:
    """Return a system with these values at a step; without noise, where it does not measure that."""
    system = load_system(name)
    bindings = prepare(system, None, None, None, 1, None)[0].bindings
    known = {f"{slot}.{n}" for slot, b in bindings.items() for n in b.parameters}
    off = {} if noise or name in NOISY else {n: 0.0 for n in system.noises if n in known}
    if "nuisances" in system.options:
        off["nuisances"] = "none"
    system = load_system(name).with_values({**off, **values})
    system.step = step or system.step
    return system


def names_of(system: System) -> Names:
    """Return the recorded outputs as (component, variable) of an archive of parts of the bench."""
    return {n: (slot, b.variable) for n, (slot, b) in recorded(prepare(system, None, None, None, 1, None)[0]).items()}


def rows_apart(system: System, own: Record) -> int:
    """Return how many steps two rows may be apart: samplers hold what they say of a window until the next one ends."""
    channels = max(1, round(system.channel_period / system.step))
    if system.windows is None:
        return channels
    slots = {n.partition(".")[0] for n in (system.windows.watch, *system.windows.columns.values())}
    if any(system.slots[s].socket != "Sampler" for s in slots):
        return 1
    shortest = float(np.min(own.windows["t_end"] - own.windows["t_start"])) / system.step
    return max(k for k in range(1, channels + 1) if channels % k == 0 and (k == 1 or k < shortest / 4))


def record_in(tool: str, file: Path, system: System, own: Record, timeout: float = 3600.0) -> tuple[Record, float]:
    """Return the record that a tool gives of an exported system, and seconds a step.

    own: the bench's, whose plan, parameters and initial channels it takes.  Raises PeerError.
    """
    every, names, h = rows_apart(system, own), names_of(system), system.step
    steps = every * math.ceil((float(own.run.stopped_at or 0.0) / h + LATE) / every)
    series, first, seconds = run_in(tool, file, names, h, steps, every, timeout)
    return record_of(system, series, first, every, own), seconds / steps


def record_of(system: System, series: Mapping[str, Array], first: int, every: int, own: Record) -> Record:
    """Return the record of series with a row each ``every`` steps from step ``first`` on, until the plan is over.

    Raises PeerError where it is not over in the last row: windows would lack.
    """
    number = first + every * np.arange(len(next(iter(series.values()))))
    if system.done is None:  # it ends with the time
        last = int(np.count_nonzero(number <= round(float(own.run.stopped_at or 0.0) / system.step)))
    else:
        over = np.flatnonzero(series[system.done] != 0.0)
        if not len(over):
            raise PeerError(f"the plan is not over after {number[-1]} steps")
        last = int(over[0]) + 1
    number, series = number[:last], {n: c[:last] for n, c in series.items()}
    run = own.run.replace(step=system.step)
    windows = record_from_series(system, series).windows if system.windows is not None else {}
    period = max(1, round(system.channel_period / system.step))
    rows = np.flatnonzero(number % period == 0)
    channels = {"time": number[rows] * system.step, **{n: series[n][rows] for n in system.channels if n in series}}
    if first > 0 and own.channels:  # a tool without outputs at t = 0
        channels = {n: np.concatenate([own.channels[n][:1], c]) for n, c in channels.items() if n in own.channels}
    return Record(windows, channels, run)


def same(found: Record, own: Record) -> bool:
    """Return whether a record holds the numbers of the bench's, but for a last row of the channels."""
    if any(getattr(found, t).keys() != getattr(own, t).keys() for t in ("windows", "channels")):
        return False
    n = len(own.channels.get("time", ()))
    rows = min(n, len(found.channels.get("time", ())))
    equal = [np.array_equal(found.windows[c], x) for c, x in own.windows.items()]
    equal += [np.array_equal(found.channels[c][:rows], x[:rows], equal_nan=True) for c, x in own.channels.items()]
    return rows >= n - 1 and all(equal)


def numbers(result: Result) -> dict[str, Coefficient]:
    return {c.name: c for c in result.coefficients if not c.no_value and math.isfinite(c.estimate)}


def scales(result: Result, noisy: System) -> dict[str, float]:
    """Return u of each measure in a run with noise; where it has none, the largest measure of the unit.

    A measure of rounding size beside none larger has the scale 1.
    """
    try:
        found = {n: c.u for n, c in numbers(noisy.reduce(run(noisy))).items()}
    except GyrobenchError:
        found = {}
    ours = numbers(result)
    largest = {n: max(abs(c.estimate) for c in ours.values() if c.unit == o.unit) for n, o in ours.items()}
    without = {n: x if x > ROUNDING else 1.0 for n, x in largest.items()}
    return {n: u if math.isfinite(u := found.get(n, 0.0)) and u > ROUNDING else without[n] for n in ours}


def differences(
    found: Mapping[str, Coefficient], reference: Mapping[str, Coefficient], scale: Mapping[str, float]
) -> list[Any]:
    """Return the largest difference over its scale, and of which measure."""
    if missing := sorted(reference.keys() - found.keys()):
        return [math.inf, missing[0]]
    off = {n: abs(found[n].estimate - c.estimate) / scale[n] for n, c in reference.items() if n in scale}
    name = max(off, key=lambda n: off[n], default="")
    return [off.get(name, 0.0), name]


def left_over(
    ours: Mapping[str, Coefficient],
    own: Mapping[str, float],
    found: Mapping[str, Coefficient],
    of_tool: Mapping[str, float],
    scale: Mapping[str, float],
) -> list[Any]:
    """Return how much of a difference the effects of the step in both runs leave, over these effects.

    Differences below 1 % of the scale do not count.
    """
    share = {}
    for n in ours.keys() & own.keys() & found.keys() & of_tool.keys():
        left = abs(found[n].estimate - ours[n].estimate - of_tool[n] + own[n])
        share[n] = left / max(abs(own[n]) + abs(of_tool[n]), 0.01 * scale[n])
    name = max(share, key=lambda n: share[n], default="")
    return [share.get(name, 0.0), name]


def effects(at_h: Result, at_half: Result) -> dict[str, float]:
    """Return what the step does to each measure, from runs at the step and at half of it."""
    rows = step_effects(at_h.coefficients, at_half.coefficients, 0.5)
    return {r.name: r.change for r in rows}


#: systems that FMPy's simulate_ssp cannot run, by the word of docs/guides/run_elsewhere.md for the reason
CANNOT = {
    "KeyError": {
        "accelerometer_four", "angle_system_test", "north_finder", "table_environment", "table_position_test",
        "tumble_two_axis",
    },
    "first step": {"gyro_magnetic_compass", "servo_polar", "servo_two_axis", "servo_vertical_level"},
}  # fmt: skip


def prefixes(system: System) -> list[tuple[str, str]]:
    """Return slots whose name begins with that of another: FMPy sets the parameters of one in both."""
    return [(a, b) for a in system.slots for b in system.slots if a != b and b.startswith(a)]
