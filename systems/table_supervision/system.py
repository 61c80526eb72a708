"""Faults put into a table one after the other: which of them are found, how soon, by whom; false alarms counted."""

from __future__ import annotations

from itertools import combinations
from typing import Any

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, System, Windows

PAIRS = tuple(combinations(range(1, 9), 2))
TURNS = 60
GOLDEN = 0.6180339887498949

SOURCE = Socket(
    "FaultSource",
    "signals of a table's electronics with faults put in",
    (
        inp("alarm", "1", "alarm of the monitor"),
        inp("tripped", "1", "trip of the supervisor"),
        inp("rate", "rad/s", "rate of the table"),
        out("x", "1", "scalars, each in its own SI unit", 8),
        out("pulse", "V", "pulse train"),
        out("pressure", "Pa", "air pressure"),
        out("temperature", "K", "motor temperature"),
        out("lost", "1", "1: the encoder has lost its count"),
        out("target", "rad/s", "rate command"),
        out("request", "1", "requests of the five modes", 5),
        out("clear", "1", "1: alarms and trips are taken back"),
        out("count", "1", "turns that are done", whole=True),
        out("fault", "1", "fault of the turn", whole=True),
        out("also", "1", "second fault of the turn", whole=True),
        out("t_fault", "s", "time of the fault"),
        out("false_alarms", "1", "alarms and trips of the quiet time"),
        out("done", "1", "1 at the end", whole=True),
    ),
)
MONITOR = Socket(
    "FaultMonitor",
    "watches scalars and a pulse train",
    (
        inp("x", "1", "scalars, each in its own SI unit", 8),
        inp("pulse", "V", "pulse train"),
        inp("clear", "1", "other than 0: the alarm is taken back"),
        out("alarm", "1", "1 from the first fault until it is cleared"),
        out("first", "1", "item that raised the alarm", whole=True),
        out("t_alarm", "s", "time of the alarm"),
        out("outside", "1", "items that are outside now", optional=True),
    ),
)
SUPERVISOR = Socket(
    "ModeSupervisor",
    "chooses the mode of a table, with interlocks",
    (
        inp("request", "1", "requests of the five modes", 5),
        inp("pressure", "Pa", "air pressure"),
        inp("rate", "rad/s", "rate of the table"),
        inp("temperature", "K", "motor temperature"),
        inp("lost", "1", "other than 0: the encoder has lost its count"),
        inp("clear", "1", "other than 0: a trip is taken back"),
        out("enable", "1", "1: motor on", whole=True),
        out("mode", "1", "mode that is on", optional=True),
        out("reason", "1", "why the motor was switched off", whole=True),
        out("tripped", "1", "1 from a trip until it is taken back"),
        out("t_trip", "s", "time of the last trip"),
    ),
)


class TableSupervision(System):
    """Every kind of fault by itself and two at once are put into a table that turns at a synchronous rate; monitor and
    supervisor find them, and the supervisor stops the table.  A quiet time counts the false alarms.

    [CTRL-SUPERVISION, TABLE-MODES; Hu 1981, section 6.1]
    """

    title = "Supervision of a table"
    spec = ("CTRL-SUPERVISION", "TABLE-MODES")
    slots = {
        "faults": Slot(SOURCE, "fault_source"),
        "monitor": Slot(MONITOR, "fault_monitor"),
        "supervisor": Slot(SUPERVISOR, "mode_supervisor"),
        "table": Slot("Table", "table_rate"),
    }
    wires = """
        faults -> monitor: x pulse clear
        faults -> supervisor: request pressure temperature lost clear
        table -> supervisor: rate
        supervisor.enable -> table.mode
        faults -> table: target
        table -> faults: rate
        monitor -> faults: alarm
        supervisor -> faults: tripped
    """
    factors = {"supervisor.enable -> table.mode": 2.0}  # mode 2 of the table: rate
    open = ("table.f_local", "table.omega_local", "table.face")
    options = {
        "repeats": Option(4, int, "how often each kind of fault is put in", 1, 7),
        "pairs": Option(28, int, "pairs of faults, spread over the 28 there are", 0, 52),
        "quiet": Option("2min", "s", "time without faults, for the false alarms", 1.0),
        "reading": Option(0.25, "1", "noise of a scalar's reading, in half widths of its range", 0.0, 1.0),
        "hold_off": Option(2, int, "looks in a row outside before an item counts", 1, 5),
    }
    windows = Windows(
        "faults.count",
        {
            "fault": "faults.fault",
            "also": "faults.also",
            "t_fault": "faults.t_fault",
            "alarm": "monitor.alarm",
            "t_alarm": "monitor.t_alarm",
            "first": "monitor.first",
            "tripped": "supervisor.tripped",
            "t_trip": "supervisor.t_trip",
            "reason": "supervisor.reason",
            "rate": "table.rate",
            "false_alarms": "faults.false_alarms",
        },
    )
    done = "faults.done"
    channels = (
        "table.rate", "monitor.alarm", "monitor.outside", "supervisor.tripped", "supervisor.mode", "faults.pressure",
        "table.angle",
    )  # fmt: skip
    bodies = "table: base table.base, x table.tilt[1], y table.tilt[2], z table.angle"
    shown = ("table.rate", "monitor.alarm supervisor.tripped", "monitor.outside", "faults.pressure")
    channel_period = 0.05
    step = 5e-4
    noises = ("monitor.reading", "monitor.wave")

    def schedule(self) -> list[tuple[int, int]]:
        """Return the faults of the turns: (kind, second kind or 0)."""
        single = [(k, 0) for _ in range(self["repeats"]) for k in range(1, 9)]
        return single + [PAIRS[(5 * j) % len(PAIRS)] for j in range(self["pairs"])]  # 5 and 28 have no common factor

    def instants(self) -> list[float]:
        """Return where in a period of the monitor each fault comes, 0 to 1: for each kind evenly spread."""
        n = self["repeats"]
        single = [(m + GOLDEN * k % 1.0) / n for m in range(n) for k in range(1, 9)]
        return single + [GOLDEN * (j + 1) % 1.0 for j in range(self["pairs"])]

    @property
    def stop(self) -> float:  # type: ignore[override]
        return float(self["quiet"] + 3.0 * (len(self.schedule()) + 1))

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        turns = self.schedule()[:TURNS]
        rest = [0.0] * (TURNS - len(turns))
        return {
            "faults.n": len(turns),
            "faults.quiet": self["quiet"],
            "faults.kind": [*(float(a) for a, _ in turns), *rest],
            "faults.second": [*(float(b) for _, b in turns), *rest],
            "faults.at": [*(0.8 + 0.1 * x for x in self.instants()), *(1.0 for _ in rest)],
            "monitor.n": 4,
            "monitor.pulses?": True,
            "monitor.low": [22.0, 273.15, 4.5e5, -1.0, 0.0, 0.0, 0.0, 0.0],
            "monitor.high": [26.0, 343.15, 7.5e5, 2.0, 1.0, 1.0, 1.0, 1.0],
            "monitor.reading": self["reading"],
            "monitor.wave": 0.05,
            "monitor.hold_off": self["hold_off"],
            "table.rate_max": 20.0,
            "table.acceleration": 20.0,
        }

    def check(self) -> list[str]:
        turns = len(self.schedule())
        if turns > TURNS:
            given = f"repeats = {self['repeats']}, pairs = {self['pairs']}"
            return [f"{given}: {turns} turns; at most {TURNS} are possible"]
        return []
