"""Reduction: detection time of each kind of fault, missed and misnamed faults, false alarms, each with its interval.

Detection time: the earlier of the alarm of the monitor and the trip of the supervisor, less the time of the fault.
Closed: what the sampling of both gives on the average (:func:`expected`).  Fractions have exact (Clopper-Pearson)
intervals, the rate of false alarms that of a Poisson count.  [CTRL-SUPERVISION]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Coefficient, LoopResult, Specification, Table

from .system import KINDS

#: kind -> item of the monitor that names it, reason of the supervisor that does; 0: it does not see it
NAMED = {1: (3, 1), 2: (4, 2), 3: (2, 3), 4: (0, 4), 5: (1, 0), 6: (9, 0), 7: (10, 0), 8: (11, 0)}
COLUMNS = (
    "fault", "also", "t_fault", "alarm", "t_alarm", "first", "tripped", "t_trip", "reason", "rate", "false_alarms",
)  # fmt: skip


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """Return the result of a record; raises ReductionError where it has no turns with faults."""
    w = {n: np.asarray(v, dtype=float) for n, v in record.windows.items()}
    missing = [n for n in COLUMNS if n not in w]
    if missing:
        raise ReductionError([f"no column {', '.join(missing)}"])
    turns = w["t_fault"] >= 0.0
    if not turns.any():
        raise ReductionError(["no turn with a fault was completed"])
    run, limits = record.run, specification or {}
    t = {n: v[turns] for n, v in w.items()}
    found: list[Coefficient] = []

    def add(name: str, meaning: str, unit: str, value: float, u: float, low: float, high: float, **more: Any) -> None:
        limit = limits.get(name)
        verdict = uncertainty.assess_conformity(value, max(high - value, value - low), limit)
        k = (high - low) / 2.0 / u if u > 0.0 else uncertainty.NORMAL
        closed = more.get("closed")
        found.append(
            Coefficient(
                name, meaning, unit, value, u, k, (low, high), u_a=u, closed=closed, limit=limit, verdict=verdict
            )
        )

    when, named = detections(t)
    late = when - t["t_fault"]
    early = late < 0.0  # an alarm before the fault: false
    seen = np.isfinite(when) & ~early
    single = t["also"] == 0.0
    closed = expected(run.parameters)
    rows = []
    for kind, name in enumerate(KINDS, 1):
        mine = single & (t["fault"] == kind)
        times = late[mine & seen]
        rows.append([name, *_counts(mine, seen, named, late)])
        if times.size > 1:
            u = float(times.std(ddof=1) / math.sqrt(times.size))
            half = float(stats.t.ppf(0.975, times.size - 1)) * u
            value = float(times.mean())
            add(f"t {name}", "detection time", "s", value, u, value - half, value + half, closed=closed.get(kind))
    rows.append(["two at once", *_counts(~single, seen, named, late)])
    n = seen.size
    for name, meaning, count in (
        ("missed", "faults that neither monitor nor supervisor found", n - int(seen.sum())),
        ("misnamed", "faults found under another name", int((seen & ~named).sum())),
    ):
        low, high = fraction_interval(count, n)
        add(name, meaning, "%", 100.0 * count / n, 25.0 * (high - low), 100.0 * low, 100.0 * high)
    quiet = float(run.parameters.get("faults.quiet", 0.0))
    count = int(w["false_alarms"][0])
    hours = quiet / 3600.0
    low, high = poisson_interval(count)
    add(
        "false alarms", "alarms and trips of the time without faults", "1/h", count / hours,
        math.sqrt(max(count, 1)) / hours, low / hours, high / hours, closed=false_rate(run.parameters) * 3600.0,
    )  # fmt: skip
    stopped = t["tripped"] > 0.0
    moving = stopped & (np.abs(t["rate"]) > 1e-9)
    warnings = []
    if early.any():
        warnings.append(f"{int(early.sum())} turns had an alarm before the fault; they count as missed.")
    if moving.any():
        warnings.append(f"In {int(moving.sum())} turns the table was switched off and not at rest at the end.")
    by = {True: "all", False: f"{int(seen.sum())} of"}[bool(seen.all())]
    slowest = max((c for c in found if c.name.startswith("t ")), key=lambda c: c.estimate, default=None)
    summary = [f"Found: {by} {n} faults; named rightly: {int((seen & named).sum())}."]
    if slowest is not None:
        summary.append(f"Slowest to find: {slowest.name[2:]}, {slowest.estimate:.2g} s.")
    low, high = (float(f"{x / hours:.2g}") for x in (low, high))  # two digits, without a power of ten
    summary.append(f"False alarms: {count} in {quiet:.4g} s without faults (95 %: {low:g} to {high:g} 1/h).")
    result = LoopResult(
        system=run.system,
        title="Supervision of a table",
        method="Faults put in, one and two at once; earlier of alarm and trip less the time of the fault",
        sources=["CTRL-SUPERVISION, TABLE-MODES; Hu 1981, section 6.1 (items 1, 6)"],
        conventions=[
            "A fault is found when the monitor latches its alarm or the supervisor switches the motor off; it is named "
            "rightly when the one that was first names the item or the interlock of the fault (of two: of either).",
            "Closed: mean over the sampling instants; for pressure and temperature with their time constant.",
        ],
        coefficients=found,
        tables=[
            Table(
                "faults_by_kind",
                "Faults by kind",
                "Each kind by itself, and two at once; times from the fault to the first detection.",
                ["fault", "put in", "found", "named rightly", "shortest / s", "longest / s"],
                rows,
            )
        ],
        warnings=warnings,
        summary=summary,
        decision_rule=uncertainty.DECISION_RULE,
        verdict=uncertainty.worst_verdict(c.verdict for c in found),
        instrument=run.parts["monitor"].name if "monitor" in run.parts else "",
        ranked_by="false alarms",
        responses=[],
        simulated=not run.measured,
    )
    return run_metadata.finish(result, record)


def _counts(
    which: NDArray[np.bool_], seen: NDArray[np.bool_], named: NDArray[np.bool_], late: Array
) -> list[int | float | None]:
    """Return how many were put in, found and named rightly, and the shortest and longest time."""
    times = late[which & seen]
    ends: list[float | None] = [float(times.min()), float(times.max())] if times.size else [None, None]
    return [int(which.sum()), int((which & seen).sum()), int((which & seen & named).sum()), *ends]


def detections(t: Mapping[str, Array]) -> tuple[Array, NDArray[np.bool_]]:
    """Return the time of the first detection of each turn (inf: none), and whether it was named rightly."""
    alarm = np.where(t["alarm"] > 0.0, t["t_alarm"], np.inf)
    trip = np.where(t["tripped"] > 0.0, t["t_trip"], np.inf)
    rightly = []
    for j in range(alarm.size):
        kinds = [int(k) for k in (t["fault"][j], t["also"][j]) if k]
        by_monitor = any(NAMED[k][0] == t["first"][j] for k in kinds)
        by_supervisor = any(NAMED[k][1] == t["reason"][j] for k in kinds)
        rightly.append(by_monitor if alarm[j] < trip[j] else by_supervisor)
    return np.minimum(alarm, trip), np.array(rightly, dtype=bool)


def expected(p: Mapping[str, Any]) -> dict[int, float]:
    """Return the mean detection time of the kinds 1 to 5 from the sampling of the parts; {} for other parts.

    Supervisor: half a period until it sees the fault, and confirm - 1 more.  Monitor: a fault that begins anywhere in a
    period is seen by the look of the item in it or in the next, counts after hold_off - 1 more, and the alarm comes
    with the end of that period: hold_off + 1/2 periods.  A fault of the pulse train may be seen in the burst that it
    comes in: hold_off + 1/2 periods less up to the length of the burst, no closed value.
    """
    names = ("supervisor.period", "supervisor.confirm", "monitor.period", "monitor.hold_off", "faults.tau")
    if any(n not in p for n in names):
        return {}
    by_supervisor = (0.5 + p["supervisor.confirm"] - 1.0) * p["supervisor.period"]
    by_monitor = (0.5 + p["monitor.hold_off"]) * p["monitor.period"]
    falls = p["faults.tau"] * -math.log(1.0 - (6e5 - p["supervisor.pressure_min"]) / 4e5)
    heats = p["faults.tau"] * -math.log(1.0 - (p["supervisor.temperature_max"] - 308.0) / 75.0)
    reaches = (p["supervisor.rate_max"] - 0.5) / p["table.acceleration"]
    outside = (p["monitor.high"][3] - 0.5) / p["table.acceleration"]
    low = p["faults.tau"] * -math.log(1.0 - (6e5 - p["monitor.low"][2]) / 4e5)
    hot = p["faults.tau"] * -math.log(1.0 - (p["monitor.high"][1] - 308.0) / 75.0)
    return {
        1: min(falls + by_supervisor, low + by_monitor),
        2: min(reaches + by_supervisor, outside + by_monitor),
        3: min(heats + by_supervisor, hot + by_monitor),
        4: by_supervisor,
        5: by_monitor,
    }


def false_rate(p: Mapping[str, Any]) -> float:
    """Return the expected false alarms (1/s) of readings with normal noise about their nominal values."""
    if "monitor.reading" not in p or p["monitor.reading"] == 0.0:
        return 0.0
    nominal, total = (24.0, 308.0, 6e5, 0.5), 0.0
    for value, low, high in zip(nominal, p["monitor.low"], p["monitor.high"], strict=False):
        half = (high - low) / 2.0
        place = (value - low) / half - 1.0
        size, n = p["monitor.reading"], p["monitor.hold_off"]
        outside = stats.norm.sf((1.0 - place) / size) + stats.norm.cdf((-1.0 - place) / size)
        total += outside**n * (1.0 - outside) / (1.0 - outside**n)  # runs of n, counted anew after each
    return float(total / p["monitor.period"])


def fraction_interval(count: int, n: int) -> tuple[float, float]:
    """Return the 95 % interval of a fraction (Clopper and Pearson)."""
    low = float(stats.beta.ppf(0.025, count, n - count + 1)) if count else 0.0
    return low, float(stats.beta.ppf(0.975, count + 1, n - count)) if count < n else 1.0


def poisson_interval(count: int) -> tuple[float, float]:
    """Return the 95 % interval of the mean of a Poisson count (Garwood)."""
    low = float(stats.chi2.ppf(0.025, 2 * count) / 2.0) if count else 0.0
    return low, float(stats.chi2.ppf(0.975, 2 * count + 2) / 2.0)
