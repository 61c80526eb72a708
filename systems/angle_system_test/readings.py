"""Readings of the angle system test as rows of one linear model: positions, rates, gates, degrees.

With E the error of the reader, R that of the reference, theta the table angle, w the rate of the table:

    two heads   r - r_2               = E(theta) - E(theta + head) - h
                (r + r_2) / 2 - ref   = (E(theta) + E(theta + head)) / 2 - R(theta) + c + h / 2
    reversal    r - ref               = E(theta) - R(theta) + c
                r_2 - ref             = E(theta + head) - R(theta) + c + h
    rates       r - ref - w (t - t_ref) = E(theta) - R(theta) + c - w delay + w ripple cos 2 p theta
    gates       sum of (rate - w) T   = E(theta_end) - E(theta_start) + ripple ... - clock_gate w T
    degrees     |w| T - intervals     = -+ (E(theta_end) - E(theta_start)) + clock_inverse |w| T

The noise of the two rows of a position is independent.  Variances are those of rounded counts.  The second turn of a
reversal takes other angles than the first: where a table repeats an angle better than a count, so does the rounding.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.setup.setups import Setup
from gyrobench.reduction.setup.window_checks import ReductionError

from .harmonics import LEAST, POLE_PAIRS, meanings, separation, waves

Mask = NDArray[np.bool_]
POSITIONS, MEANS, FIRST, TURNED = "two readings", "mean less reference", "first turn", "scale turned"
RATES, GATES, DEGREES = "at rates", "gates", "degrees"
SHOWN = {
    POSITIONS: "first minus second reading of the scale",
    MEANS: "mean of both readings minus reference",
    FIRST: "reader minus reference, first turn",
    TURNED: "reader minus reference, scale turned",
}
CLOCKS = {"clock_gate": GATES, "clock_inverse": DEGREES}
QUANTUM = 2.0 * math.pi / 7.2e6
OTHER = ("c", "h", "delay", "ripple", "clock_gate", "clock_inverse")


@dataclass(frozen=True, kw_only=True)
class AngleSystemSetup(Setup):
    """What the reduction knows of the set-up; angles in rad, rates in rad/s.

    parameters: of the parts.  target, rate: of the phases, 1-based; rate 0 at positions.  turned: phases with the scale
    turned on its shaft.  u_rate: relative.
    """

    parameters: Mapping[str, Any]
    target: Mapping[int, float]
    rate: Mapping[int, float]
    turned: frozenset[int]
    head: float
    reversal: bool = False

    @classmethod
    def of(cls, run: RunDocument, **own: Any) -> Self:
        return super().of(
            run,
            parameters=run.parameters,
            target={row.phase: row.target for row in run.plan if row.mode == "index"},
            rate={row.phase: row.target if row.mode == "rate" else 0.0 for row in run.plan},
            turned=frozenset(row.phase for row in run.plan if row.label.startswith("turned")),
            head=float(run.options["head"]),
            reversal=run.options.get("method") == "reversal",
            **own,
        )

    @property
    def pole_pairs(self) -> int:
        return int(self.parameters.get("reader.pole_pairs", POLE_PAIRS))

    @property
    def quanta(self) -> tuple[float, float]:
        """Return the angles of a count of reader and reference."""
        read, reference = (float(self.parameters.get(f"{n}.quantum", QUANTUM)) for n in ("reader", "reference"))
        return read, reference

    @property
    def lsb(self) -> float:
        """s, of the inverse rate"""
        return float(self.parameters.get("inverse.lsb", 1e-4))

    @property
    def interval(self) -> float:
        """Angle of a reading of the inverse rate."""
        return float(self.parameters.get("inverse.interval", math.pi / 180.0))

    @cached_property
    def causes(self) -> Mapping[int, str]:
        """Orders of the reader, and what makes each."""
        return meanings(self.parameters, "reader")

    @cached_property
    def orders(self) -> Sequence[int]:
        """Those of them that the two readings separate."""
        return [k for k in self.causes if separation(k, self.head) >= LEAST]

    @cached_property
    def reference_orders(self) -> Sequence[int]:
        return sorted({*meanings(self.parameters, "reference"), *self.causes})

    def shift(self, slot: str) -> float:
        """Return mean lag and ripple (s) by the phase shifter of one-phase excitation.  Raises KeyError."""
        p = {n: self.parameters[f"{slot}.{n}"] for n in ("phases", "shifter_slope", "f_0")}
        return float(p["shifter_slope"]) / (4.0 * math.pi * float(p["f_0"])) if p["phases"] == 1 else 0.0

    def delay_of(self, slot: str) -> float | None:
        """Return the mean lag (s) of a simulated inductosyn, None where its parameters do not say it."""
        p = self.parameters
        try:
            mode = p[f"{slot}.mode"]
            lag = 1.0 / float(p[f"{slot}.loop_K_v"]) if mode == 1 and p[f"{slot}.loop_type"] == 1 else 0.0
            late = mode == 2 or (mode == 0 and p[f"{slot}.stamp"] == 0)  # by an amount that changes with the angle
            return None if late else lag + self.shift(slot)
        except KeyError:
            return None


@dataclass(frozen=True)
class At:
    """When and where rows are: t (s), angle and rate of the table (rad, rad/s), each (n,)."""

    t: Array
    angle: Array
    rate: Array

    def __getitem__(self, rows: Any) -> At:
        return At(self.t[rows], self.angle[rows], self.rate[rows])


@dataclass
class Rows:
    """The linear model: design X, data y (rad), variances, the kind of each row, when and where it is."""

    X: list[Array] = field(default_factory=list)
    y: list[Array] = field(default_factory=list)
    variance: list[Array] = field(default_factory=list)
    kind: list[str] = field(default_factory=list)
    places: list[At] = field(default_factory=list)

    @property
    def at(self) -> At:
        return At(*(np.concatenate([getattr(p, n) for p in self.places]) for n in ("t", "angle", "rate")))

    def add(self, a: AngleSystemSetup, kind: str, y: Array, variance: float, at: At, **columns: Array) -> None:
        """Add rows; columns: E (n, 2 orders), R (n, 2 orders of the reference), and those of OTHER."""
        n = y.size
        parts = [
            columns.get("E", np.zeros((n, 2 * len(a.orders)))),
            columns.get("R", np.zeros((n, 2 * len(a.reference_orders)))),
            np.column_stack([columns.get(name, np.zeros(n)) for name in OTHER]),
        ]
        self.X.append(np.hstack(parts))
        self.y.append(y)
        self.variance.append(np.full(n, variance))
        self.kind += [kind] * n
        self.places.append(at)


def in_turn(x: Array) -> Array:
    """Return angles less whole turns, within half a turn."""
    return np.asarray(x - 2.0 * math.pi * np.round(x / (2.0 * math.pi)))


@dataclass(frozen=True)
class Slips:
    """Readings off by whole fine cycles: where (table angle, rad), by how many, at rest or turning."""

    angle: Array
    cycles: Array
    turning: Array


def unslipped(difference: Array, cycle: float, zero: float) -> tuple[Array, Array]:
    """Return the difference of two readings without whole fine cycles from ``zero``, and how many those are."""
    off = in_turn(difference - zero)
    n = np.round(off / cycle)
    return zero + off - n * cycle, n


def middle(difference: Array) -> float:
    """Return the zero between two readings: what most of them agree on."""
    start = float(difference[0])
    return start + float(np.median(in_turn(difference - start)))


def assemble(windows: Mapping[str, Array], a: AngleSystemSetup) -> tuple[Rows, Slips]:
    """Return the rows of the model, and the readings that are off by whole cycles.

    Gates and degrees need an angle that does not slip and all orders of the reader: else they are left out.
    """
    w = {k: np.asarray(v, dtype=float) for k, v in windows.items()}
    phase = w["phase"].astype(int)
    rate = np.array([a.rate[p] for p in phase])
    at_rest, turned = rate == 0.0, np.isin(phase, list(a.turned))
    first = at_rest & ~turned
    if np.count_nonzero(first) < 30:
        raise ReductionError(f"{np.count_nonzero(first)} positions: at least 30 are needed")
    theta = np.array([a.target.get(p, 0.0) for p in phase])
    cycle = math.pi / a.pole_pairs
    zero = middle((w["reading"] - w["reference"])[first])
    zero_2 = middle((w["reading_2"] - w["reference"])[turned if a.reversal else first])
    d, n = unslipped(w["reading"] - w["reference"], cycle, zero)
    d_2, n_2 = unslipped(w["reading_2"] - w["reference"], cycle, zero_2)
    use = np.where(turned | ((n == 0.0) & first), n_2, n)
    slipped = np.flatnonzero(use)
    mounted = middle((theta - w["reference"])[first])  # the scale may read from any zero, and so may the reference
    theta = np.where(at_rest, theta, w["reference"] + mounted)
    slips = Slips(theta[slipped] % (2.0 * math.pi), use[slipped], ~at_rest[slipped])
    rows, at = Rows(), At(w["t_end"], theta, rate)
    _positions(rows, a, at, d, d_2, first, turned)
    _rates(rows, a, w, at, d)
    whole = len(a.orders) == len(a.causes)
    for p in sorted(set(phase[~at_rest].tolist())) if whole and not slipped.size else ():
        _readouts(rows, a, {k: v[phase == p] for k, v in w.items()}, theta[phase == p], a.rate[p])
    return rows, slips


def _positions(rows: Rows, a: AngleSystemSetup, at: At, d: Array, d_2: Array, first: Mask, turned: Mask) -> None:
    q, q_ref = a.quanta
    angle, ones = at.angle[first], np.ones(np.count_nonzero(first))
    here, there, other = waves(a.orders, angle), waves(a.orders, angle + a.head), -waves(a.reference_orders, angle)
    if a.reversal:
        variance = (q * q + q_ref * q_ref) / 12.0
        rows.add(a, FIRST, d[first], variance, at[first], E=here, R=other, c=ones)
        angle, ones = at.angle[turned], np.ones(np.count_nonzero(turned))
        there, other = waves(a.orders, angle + a.head), -waves(a.reference_orders, angle)
        rows.add(a, TURNED, d_2[turned], variance, at[turned], E=there, R=other, c=ones, h=ones)
        return
    one, two = d[first], d_2[first]
    rows.add(a, POSITIONS, one - two, 2 * q * q / 12.0, at[first], E=here - there, h=-ones)
    variance = (0.5 * q * q + q_ref * q_ref) / 12.0
    rows.add(a, MEANS, 0.5 * (one + two), variance, at[first], E=0.5 * (here + there), R=other, c=ones, h=0.5 * ones)


def _rates(rows: Rows, a: AngleSystemSetup, w: Mapping[str, Array], at: At, d: Array) -> None:
    use = at.rate != 0.0
    if not np.any(use):
        return
    at = at[use]
    y = d[use] - at.rate * (w["t_reading"][use] - w["t_reference"][use])
    rows.add(
        a, RATES, y, (a.quanta[0] ** 2 + a.quanta[1] ** 2) / 12.0, at,
        E=waves(a.orders, at.angle), R=-waves(a.reference_orders, at.angle), c=np.ones_like(y), delay=-at.rate,
        ripple=at.rate * np.cos(2 * a.pole_pairs * at.angle),
    )  # fmt: skip


def _readouts(rows: Rows, a: AngleSystemSetup, w: Mapping[str, Array], theta: Array, rate: float) -> None:
    """Add the gates and degrees that lie within a phase of constant rate.

    Neighbours share a reading, and so its error: those that follow one another are added up to one row.
    """
    if theta.size < 3:
        return
    line = np.polyfit(w["t_reference"] - w["t_reference"][0], np.unwrap(theta), 1)

    def angle(t: Array) -> Array:
        return np.asarray(np.polyval(line, t - w["t_reference"][0]))

    q = a.quanta[0]
    for kind, name in ((GATES, "gate"), (DEGREES, "inverse")):
        seen, start, end = w[f"{name}_rate"], w[f"{name}_start"], w[f"{name}_end"]
        new = np.append(True, np.diff(w[f"{name}_number"]) != 0.0)
        use = new & (start >= w["t_start"][0]) & (end > start) & (seen != 0.0)
        number, seen, start, end = w[f"{name}_number"][use], seen[use], start[use], end[use]
        for chain in np.split(np.arange(number.size), np.flatnonzero(np.diff(number) != 1.0) + 1):
            if not chain.size:
                continue
            begin, t = angle(start[chain[:1]]), end[chain[-1:]]
            at = At(t, angle(t), np.full(1, rate))
            change = waves(a.orders, at.angle) - waves(a.orders, begin)
            ripple = rate * (np.cos(2 * a.pole_pairs * at.angle) - np.cos(2 * a.pole_pairs * begin))
            columns = {"E": change, "ripple": ripple}
            if kind == GATES:
                T = np.sum((end - start)[chain], keepdims=True)
                y = np.sum(((seen - rate) * (end - start))[chain], keepdims=True)
                rows.add(a, kind, y, 2 * q * q / 12.0, at, **columns, clock_gate=-rate * T)
            else:
                T = np.sum(a.interval / np.abs(seen[chain]), keepdims=True)
                y = abs(rate) * T - chain.size * a.interval
                # a mark is interpolated between two counts, f^2 + (1 - f)^2 of whose variance is 2/3 on average
                variance = (4 * q * q / 3 + 2 * (rate * a.lsb) ** 2) / 12.0
                columns = {name: -math.copysign(1.0, rate) * x for name, x in columns.items()}
                rows.add(a, kind, y, variance, at, **columns, clock_inverse=abs(rate) * T)
