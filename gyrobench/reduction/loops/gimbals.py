"""Measures of a gimballed platform in a flight: its error over time, and when its gimbals were locked.

flight = Flight(gates, "platform.attitude", rest)
flight.error                                                      # rad, at flight.t
lock_table(flight, {"lock": flight["platform.lock"]}, pitch, "pitch")   # one row for each time of lock

SI inside, degrees where people read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Table

DEG = math.pi / 180.0


class Flight:
    """The part of a record in which the base flew.

    gates: its phases, in their order.  rest: a phase in which the base rested and nothing acted, None: there is none.
    t: s of the record; error: angle (rad) by which the platform has turned since the flight began, less the drift that
    the rest phase showed; noise: rad, standard deviation of the attitude in the rest phase about its drift.

    The error is the size of the integral of the platform's rate in its own axes: the angle of the rotation where it
    is small or about one axis.  Raises ReductionError for a record without a gate.
    """

    def __init__(self, gates: Sequence[Gate], attitude: str, rest: Gate | None = None) -> None:
        if not gates:
            raise ReductionError("no leg of the flight is complete in this record")
        self.gates = list(gates)
        self.channels = gates[0].channels
        self.first, self.last = gates[0].inside.start, gates[-1].inside.stop
        self.t = self["time"]
        names = [f"{attitude}[{k}]" for k in (1, 2, 3)]
        turned = np.column_stack([self[n] - self[n][0] for n in names])
        self.drift, self.noise = np.zeros(3), 0.0
        if rest is not None:
            fits = [np.polyfit(rest.t, rest[n], 1) for n in names]
            self.drift = np.array([f[0] for f in fits])
            residuals = [rest[n] - np.polyval(f, rest.t) for n, f in zip(names, fits, strict=True)]
            self.noise = math.sqrt(sum(float(np.var(x)) for x in residuals))
        self.axes = turned - np.outer(self.t - self.t[0], self.drift)
        self.error = np.linalg.norm(self.axes, axis=1)

    def __getitem__(self, name: str) -> Array:
        """Return a channel over the flight, the rests between the legs included."""
        if name not in self.channels:
            raise ReductionError(f"the record has no channel {name}; it has {', '.join(self.channels)}")
        return self.channels[name][self.first : self.last]

    def u(self, step: float) -> float:
        """Return u of the largest error, rad: the noise, and what the platform turns in a step at most."""
        moves = float(np.abs(np.gradient(self.error, self.t)).max()) * step if self.t.size > 1 else 0.0
        return math.hypot(self.noise, moves / math.sqrt(12.0))

    def leg(self, gate: Gate) -> slice:
        """Return where a phase lies in the arrays of the flight."""
        return slice(gate.inside.start - self.first, gate.inside.stop - self.first)

    def leg_at(self, k: int) -> str:
        """Return the label of the phase in which sample k lies, or the one before it."""
        return next((g.label for g in reversed(self.gates) if g.inside.start - self.first <= k), self.gates[0].label)


def rate_servo_limits(flight: Flight, rates: Sequence[str], rate_max: float | None) -> list[str]:
    """Return what lets the base's motion through to a platform of rate servos, which else take it out exactly.

    rates: channels of the gimbal rates, rad/s; the sentence names the largest and since when it was at its limit.
    """
    if rate_max is None:
        return []
    sizes = np.max(np.abs([flight[n] for n in rates]), axis=0)
    limit = rate_max * (1.0 - 1e-9)
    text = (
        "The servos take the motion of the base out exactly; it reaches the platform only in gimbal lock or with a "
        f"gimbal at its largest rate, {plain(rate_max / DEG, 3)}°/s: "
    )
    if sizes.max() < limit:
        return [f"{text}in the flight the gimbals turned by up to {plain(sizes.max() / DEG, 3)}°/s."]
    first = int(np.argmax(sizes >= limit))
    return [f"{text}reached in the flight at t = {plain(flight.t[first], 4)} s (leg “{flight.leg_at(first)}”)."]


def spans(flag: Array | NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first and last sample of each stretch in which a flag is 1."""
    on = np.concatenate([[False], np.asarray(flag, dtype=float) > 0.5, [False]])
    edges = np.flatnonzero(np.diff(on.astype(int)))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def lock_table(flight: Flight, kinds: Mapping[str, Array], angle: Array, name: str) -> Table:
    """Return the table of the stretches of locked gimbals.  kinds: what it is -> flag; angle: rad, called ``name``."""
    rows = []
    for kind, flag in kinds.items():
        for a, b in spans(flag):
            numbers = [flight.t[a], flight.t[b], angle[a] / DEG, angle[b] / DEG, flight.error[a] / DEG]
            worst = float(np.max(flight.error[a : b + 1])) / DEG
            rows.append([kind, flight.leg_at(a), *map(float, numbers), worst])
    return Table(
        "flight.lock",
        "Gimbal lock",
        "Intervals in which the gimbals were locked or close to lock; times are those of the record",
        [
            "event",
            "leg",
            "from / s",
            "to / s",
            f"{name} at the start / °",
            "at the end / °",
            "platform error at the start / °",
            "largest / °",
        ],
        sorted(rows, key=lambda r: float(r[2])),
    )


def legs_table(flight: Flight, caption: str, columns: Mapping[str, Callable[[slice], float]]) -> Table:
    """Return the table of what each leg did.  columns: name -> value in the stretch of the flight that is the leg."""
    rows = []
    for gate in flight.gates:
        s = flight.leg(gate)
        base = np.linalg.norm([flight[f"motion.omega[{k}]"][s] for k in (1, 2, 3)], axis=0)
        error = flight.error[s] / DEG
        known = [gate.label, float(gate.t[-1] - gate.t[0]), float(base.max()) / DEG]
        rows.append([*known, *(float(value(s)) for value in columns.values()), float(error.max()), float(error[-1])])
    return Table(
        "flight.legs", "Legs of the flight", caption,
        ["leg", "time / s", "base rate / (°/s)", *columns, "largest error / °", "at the end / °"], rows,
    )  # fmt: skip
