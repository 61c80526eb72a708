"""Turn-on repeatability and warm-up: bias of a rate gyro over turn-ons and days, and from the switching on onwards."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.option_groups import SITE, type_b
from gyrobench.system.families.rate_reading import RATE_NOISES
from gyrobench.system.families.table_test import FACE, ON_TABLE, TableTest, sampled, surroundings
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import LIMIT, Phase, Plan
from gyrobench.system.system import OnRequest, Option, Slot, Windows
from gyrobench.units import DEG

from .measured import MEASURED

SWITCHED = Socket(
    "SwitchedGyro",
    "what a gyro reads after it was switched on: rate in, rate as read out",
    (
        inp("rate", "rad/s", "rate that the gyro measures", 2),
        inp("phase", "1", "running phase: another one is another turn-on", whole=True),
        inp("day", "1", "day of the turn-on", whole=True),
        out("rate_out", "rad/s", "rate along x as it is read"),
        out("since", "s", "time since it was switched on"),
    ),
)


class TurnOn(TableTest):
    """A rate gyro is switched on several times a day on several days, and read from then on.  An exponential or two
    describe how it warms up; the biases that are left show how well they repeat from one turn-on and from one day to
    the next.

    [TEST-TURN-ON; IEEE 952, IEEE 647, IEEE 1431: bias repeatability, warm-up time]
    """

    title = "Turn-on repeatability and warm-up of a rate gyro"
    spec = ("TEST-TURN-ON", "GYRO-FOG", "GYRO-MEMS")
    reduction = "reduction"
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot("Table", "table_rate"),
        "gyro": Slot("RateGyro", "gyro_fog"),
        "switched": Slot(SWITCHED, "turn_on_errors"),
        "sampler": Slot("Sampler", "sampler"),
        "clock": Slot("Sampler", "sampler"),
    }
    wires = f"""
        site -> table: f=f_local omega=omega_local
        sequencer -> table: mode target face
        table -> sequencer: angle_read=angle in_position
        table -> gyro: omega f
        gyro -> switched: rate
        sequencer -> switched: phase target_y=day
        switched -> sampler: rate_out=x
        gyro -> sampler: saturated=flag
        switched -> clock: since=x
        {sampled("sampler")}
        {sampled("clock")}
    """
    on_request: ClassVar[Mapping[str, OnRequest]] = surroundings()
    options = (
        SITE
        | {
            "days": Option(3, int, "days", 1, 30),
            "turn_ons": Option(5, int, "turn-ons of a day", 1, 60),
            "dwell": Option(900.0, "s", "time for which it is read after each turn-on", 1.0),
            "window": Option(15.0, "s", "time of a reading", 1e-2),
            "start": Option(1.0, "s", "time from the turn-on to the first reading", 0.0),
            "rate": Option(0.0, "rad/s", "rate of the table, in both senses by turns; 0: at rest", 0.0, 20.0),
            "limit": Option("1deg/h", "rad/s", "warm when the bias is within it of that in the end", 1e-12),
            "exponentials": Option(-1, int, "of the warm-up: 0, 1, 2; -1: as many as the record tells", -1, 2),
        }
        | type_b("time")
    )
    noises = ("switched.between_turn_ons", "switched.between_days", *RATE_NOISES)
    measured_data = MEASURED
    windows = Windows("sampler.count", {**Windows.of("sampler").columns, "since": "clock.mean"})
    channels = ("switched.rate_out", "switched.since")
    channel_period = 5.0
    step = 1e-2

    def plan(self) -> Plan:
        """Return a phase for each turn-on, the senses of the rate by turns."""
        times = {"settle": self["start"], "dwell": self["dwell"], "window": self["window"]}
        phases: list[Phase] = []
        for day in range(1, self["days"] + 1):
            for k in range(self["turn_ons"]):
                sense = 1.0 if (len(phases) + day) % 2 else -1.0
                label = f"day {day}, turn-on {k + 1}"
                if self["rate"]:
                    way = {"mode": "rate", "target": sense * self["rate"]}
                    label += f", {sense * self['rate'] / DEG:+.4g} deg/s".replace("-", "−")
                else:
                    way = {"mode": "hold"}
                phases.append(Phase(label, face=FACE, target_y=float(day), **way, **times))
        return Plan(phases, {FACE: ON_TABLE})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        fast = {"table.rate_max?": max(10.0, 1.1 * self["rate"]), "table.acceleration?": max(0.1, self["rate"])}
        return {**super().parameters(parts), **fast}

    def check(self) -> list[str]:
        problems = super().check()
        count = self["days"] * self["turn_ons"]
        if not 2 <= count <= LIMIT:
            problems.append(f"days times turn_ons = {count}: 2 to {LIMIT} turn-ons are possible")
        if self["dwell"] < 4.0 * self["window"]:
            problems.append(f"dwell = {self['dwell']:g} s: at least four readings of {self['window']:g} s are needed")
        return problems
