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
from scipy import special

from gyrobench.packaging.loading import load_part
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.estimation.uncertainty import clopper_pearson, poisson_interval
from gyrobench.reduction.loops.loop_toolkit import Account, Array, MeasureReduction, ReductionError, Table, told

from .system import TableSupervision

#: of each kind, from 1: its name, the item of the monitor and the reason of the supervisor that name it; 0: not seen
KINDS = (
    ("air pressure low", 3, 1),
    ("over-rate", 4, 2),
    ("over-temperature", 2, 3),
    ("encoder lost", 0, 4),
    ("supply voltage low", 1, 0),
    ("pulse frequency high", 9, 0),
    ("pulse duty high", 10, 0),
    ("pulse amplitude low", 11, 0),
)
HOUR = 3600.0


class Reduction(MeasureReduction):
    """Faults found and named, how soon, and alarms without a fault."""

    part, ranked_by = "monitor", "false alarms"

    def measure(self) -> Account:
        w = {n: np.asarray(v, dtype=float) for n, v in self.record.windows.items()}
        if missing := [n for n in TableSupervision.windows.columns if n not in w]:
            raise ReductionError([f"no column {', '.join(missing)}"])
        turns = w["t_fault"] >= 0.0
        if not turns.any():
            raise ReductionError(["no turn with a fault was completed"])
        t = {n: v[turns] for n, v in w.items()}
        when, self.named = detections(t)
        self.late = when - t["t_fault"]
        early = int(np.sum(self.late < 0.0))  # an alarm before the fault: false
        self.seen = np.isfinite(when) & (self.late >= 0.0)
        table = self._by_kind(t)
        self._fraction("missed", "faults that neither monitor nor supervisor found", ~self.seen)
        self._fraction("misnamed", "faults found under another name", self.seen & ~self.named)
        self._false_alarms(int(w["false_alarms"][0]))
        moving = int(np.sum((t["tripped"] > 0.0) & (np.abs(t["rate"]) > 1e-9)))
        if early:
            self.found.warn("fault.early", f"{early} turns had an alarm before the fault; they count as missed.")
        if moving:
            text = f"In {moving} turns the table was switched off and not at rest at the end."
            self.found.warn("table.moving", text)
        return Account(
            method="Faults put in, one and two at once; earlier of alarm and trip less the time of the fault",
            sources=["CTRL-SUPERVISION, TABLE-MODES; Hu 1981, section 6.1 (items 1, 6)"],
            equation="",
            conventions=[
                "A fault is found when the monitor latches its alarm or the supervisor switches the motor off; it is "
                "named rightly when the one that was first names the item or the interlock of the fault (of two: of "
                "either).",
                "Closed: mean over the sampling instants; for pressure and temperature with their time constant.",
            ],
            tables=[table],
        )

    def _by_kind(self, t: Mapping[str, Array]) -> Table:
        """Measure the detection time of each kind by itself; return the table of the kinds and of two at once."""
        single, closed, rows = t["also"] == 0.0, expected(self.run.parameters), []
        self.times: dict[str, float] = {}
        for kind, (name, *_) in enumerate(KINDS, 1):
            mine = single & (t["fault"] == kind)
            rows.append([name, *self._counts(mine)])
            times = self.late[mine & self.seen]
            if times.size > 1:
                u, value = float(times.std(ddof=1) / math.sqrt(times.size)), float(times.mean())
                half = float(special.stdtrit(times.size - 1, 0.975)) * u
                interval, self.times[f"t {name}"] = (value - half, value + half), value
                self.found.measure(f"t {name}", "detection time", "s", value, u, closed=closed.get(kind),
                                   interval=interval)  # fmt: skip
        rows.append(["two at once", *self._counts(~single)])
        caption = "Each kind by itself, and two at once; times from the fault to the first detection."
        head = ["fault", "put in", "found", "named rightly", "shortest / s", "longest / s"]
        return Table("faults", "Faults by kind", caption, head, rows)

    def _counts(self, which: NDArray[np.bool_]) -> list[int | float | None]:
        """Return how many were put in, found and named rightly, and the shortest and longest time."""
        times = self.late[which & self.seen]
        ends: list[float | None] = [float(times.min()), float(times.max())] if times.size else [None, None]
        return [int(which.sum()), times.size, int((which & self.seen & self.named).sum()), *ends]

    def _fraction(self, name: str, meaning: str, which: NDArray[np.bool_]) -> None:
        count, n = int(which.sum()), which.size
        low, high = clopper_pearson(count, n)
        self.found.measure(name, meaning, "%", 100.0 * count / n, 25.0 * (high - low),
                           interval=(100.0 * low, 100.0 * high))  # fmt: skip

    def _false_alarms(self, count: int) -> None:
        self.quiet, self.count = float(self.run.parameters.get("faults.quiet", 0.0)), count
        hours = self.quiet / HOUR
        low, high = (x / hours for x in poisson_interval(count))
        self.found.measure("false alarms", "alarms and trips of the time without faults", "1/h", count / hours,
                           math.sqrt(max(count, 1)) / hours, closed=false_rate(self.run.parameters) * HOUR,
                           interval=(low, high))  # fmt: skip

    def summary(self) -> list[str]:
        n, seen = self.seen.size, int(self.seen.sum())
        slowest = max(self.times, key=lambda name: self.times[name], default="")
        low, high = (float(f"{x:.2g}") for x in self.found["false alarms"].interval)  # without a power of ten
        return [
            f"Found: {'all' if seen == n else f'{seen} of'} {n} faults; named rightly: "
            f"{int((self.seen & self.named).sum())}.",
            *told(self.found.coefficients, f"Slowest to find: {slowest[2:]}, {{{slowest}}}." if slowest else ""),
            f"False alarms: {self.count} in {plain(self.quiet, 4)} s without faults (95 %: {low:g} to {high:g} 1/h).",
        ]


def detections(t: Mapping[str, Array]) -> tuple[Array, NDArray[np.bool_]]:
    """Return the time of the first detection of each turn (inf: none), and whether it was named rightly."""
    alarm = np.where(t["alarm"] > 0.0, t["t_alarm"], np.inf)
    trip = np.where(t["tripped"] > 0.0, t["t_trip"], np.inf)
    _, item, reason = (np.array([0, *column]) for column in zip(*KINDS, strict=True))
    rightly = np.zeros(alarm.size, dtype=bool)
    for kind in (t["fault"].astype(int), t["also"].astype(int)):
        named = np.where(alarm < trip, item[kind] == t["first"], reason[kind] == t["reason"])
        rightly |= (kind > 0) & named
    return np.minimum(alarm, trip), rightly


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
    source = signals()
    by_supervisor = (0.5 + p["supervisor.confirm"] - 1.0) * p["supervisor.period"]
    by_monitor = (0.5 + p["monitor.hold_off"]) * p["monitor.period"]

    def falls(pressure: float) -> float:
        return float(p["faults.tau"] * -math.log(1.0 - (source.PRESSURE - pressure) / source.FALL))

    def heats(temperature: float) -> float:
        return float(p["faults.tau"] * -math.log(1.0 - (temperature - source.TEMPERATURE) / source.RISE))

    def reaches(rate: float) -> float:
        return float((rate - source.RATE) / p["table.acceleration"])

    low, high = p["monitor.low"], p["monitor.high"]
    return {
        1: min(falls(p["supervisor.pressure_min"]) + by_supervisor, falls(low[2]) + by_monitor),
        2: min(reaches(p["supervisor.rate_max"]) + by_supervisor, reaches(high[3]) + by_monitor),
        3: min(heats(p["supervisor.temperature_max"]) + by_supervisor, heats(high[1]) + by_monitor),
        4: by_supervisor,
        5: by_monitor,
    }


def false_rate(p: Mapping[str, Any]) -> float:
    """Return the expected false alarms (1/s) of readings with normal noise about their nominal values."""
    if "monitor.reading" not in p or p["monitor.reading"] == 0.0:
        return 0.0
    source, total = signals(), 0.0
    nominal = (source.SUPPLY, source.TEMPERATURE, source.PRESSURE, source.RATE)
    for value, low, high in zip(nominal, p["monitor.low"], p["monitor.high"], strict=False):
        half = (high - low) / 2.0
        place = (value - low) / half - 1.0
        size, n = p["monitor.reading"], p["monitor.hold_off"]
        outside = special.ndtr((place - 1.0) / size) + special.ndtr((-1.0 - place) / size)
        total += outside**n * (1.0 - outside) / (1.0 - outside**n)  # runs of n, counted anew after each
    return float(total / p["monitor.period"])


def signals() -> Any:
    """Return the source of the signals, which states their nominal values and the sizes of its faults, SI."""
    return load_part("fault_source")
