"""Measures of a loop from its record: sine responses, steps, drift, coupling between axes.  Pure functions.

    for gate in gates(record):                       # one for each phase of the plan
        if gate.kind == "test":
            point = response(gate.t, gate["stabilizer.e"], gate["exciter.test[1]"] - gate["stabilizer.e"], gate.f)

All inside is SI; frequencies in Hz.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Table

SEGMENTS = 8  # of a sine, for scatter and coherence
UNSETTLED = 0.02  # of the change in the last tenth: more is no final value
AHEAD = 4.0  # at most, of what is moved in the last tenth, is still to come
MOVING = 10.0  # u of the change: the slope of noise moves by more in one of 300 records (3 sqrt(12) u of a mean)
PIECES = 5  # of a record at rest, each as long as a step, from which on their scatter is the noise of a step's change
SEEN = 1e-4  # of a change: a u below it is no noise
LAST = 0.1  # share of a step's record that is its end


@dataclass(frozen=True)
class Gate:
    """One phase of the plan while its gate was open.

    row: the phase, as in run.json.  t: s.  channels: the whole record; gate["slot.variable"] is the part in the gate.
    """

    row: PlanRow
    t: Array
    inside: slice
    before: slice  # the second half of the settling
    channels: Mapping[str, Array]

    def __getitem__(self, name: str) -> Array:
        if name not in self.channels:
            raise ReductionError(f"the record has no channel {name}; it has {', '.join(self.channels)}")
        return self.channels[name][self.inside]

    def rest(self, name: str) -> Array:
        """Return the channel in the second half of the settling, before the gate opened (empty without settling)."""
        return self.channels[name][self.before]

    @property
    def label(self) -> str:
        return self.row.label

    @property
    def kind(self) -> str:
        return self.row.mode

    @property
    def shape(self) -> str:
        return self.row.shape

    @property
    def axis(self) -> int:
        return self.row.axis

    @property
    def amplitude(self) -> float:
        return self.row.amplitude

    @property
    def f(self) -> float:
        """Return the frequency, Hz."""
        return self.row.frequency


def wrapped(angle: Array) -> Array:
    """Return angles in -pi to pi."""
    return np.asarray(angle - 2.0 * np.pi * np.floor(angle / (2.0 * np.pi) + 0.5))


def gates(record: Record, slot: str = "exciter") -> list[Gate]:
    """Return the phases of a record (gyrobench.record.record.Record) in their order, those that were run to their end.

    Raises ReductionError for a record without the channels phase and gate of the exciter in ``slot``, or without
    a single whole phase.
    """
    channels = record.channels
    for name in (f"{slot}.phase", f"{slot}.gate"):
        if name not in channels:
            raise ReductionError(f"the record has no channel {name}: the system must record it")
    phase, gate, time = channels[f"{slot}.phase"], channels[f"{slot}.gate"], channels["time"]
    complete = []
    for row in record.run.plan:
        in_phase = phase == row.phase
        inside = np.flatnonzero(in_phase & (gate > 0.5))
        if inside.size < 2:
            continue
        period = float(time[1] - time[0])
        if time[inside[-1]] - time[inside[0]] < row.dwell - 2.5 * period:
            continue  # the run stopped in this phase
        first = int(np.argmax(in_phase))
        middle = first + (int(inside[0]) - first) // 2
        span = slice(int(inside[0]), int(inside[-1]) + 1)
        complete.append(Gate(row, time[span], span, slice(middle, int(inside[0])), channels))
    if not complete:
        raise ReductionError("no phase of the plan is complete in this record")
    return complete


# ------------------------------------------------------------------------------------------- sines
@dataclass(frozen=True)
class Point:
    """Complex ratio of two signals at one frequency (Hz), with its uncertainty and coherence.

    u: standard uncertainty of the ratio, relative; that of the phase is u rad too.  None where it was not measured
    (a single period).  coherence: 1 when the ratio is the same in every segment.
    """

    f: float
    value: complex
    u: float | None
    coherence: float


def phasor(t: Array, y: Array, f: float) -> complex:
    """Return the complex amplitude A - jB of the sine A cos + B sin of f Hz in y, beside a mean and a slope."""
    return _phasors(t, f, y)[0]


def _phasors(t: Array, f: float, *signals: Array) -> list[complex]:
    w = 2.0 * np.pi * f
    columns = np.column_stack([np.cos(w * t), np.sin(w * t), np.ones(t.size), t - t.mean()])
    each = (np.linalg.lstsq(columns, y, rcond=None)[0] for y in signals)
    return [complex(a, -b) for a, b, *_ in each]


def response(t: Array, x: Array, y: Array, f: float, by_neighbours: bool = False) -> Point:
    """Return y over x at f Hz from a record of some whole periods.

    The record is cut into up to 8 segments of whole periods; their scatter gives the uncertainty (type A, independent
    segments) and the coherence |sum Y X*|^2 / (sum |X|^2 sum |Y|^2).  by_neighbours: the uncertainty is that of y at
    the lines beside f instead, for an x without noise.  Raises ReductionError for less than a period, for
    samples too coarse for the frequency (less than 4 a period), and for an x without that sine.
    """
    dt = float(t[1] - t[0])
    periods = int((t[-1] - t[0] + dt) * f + 1e-6)
    if periods < 1:
        raise ReductionError(f"{f:g} Hz: the record of {t[-1] - t[0]:g} s is shorter than one period")
    if f * dt > 0.25:
        raise ReductionError(f"{f:g} Hz: a sample every {dt:g} s is too coarse; record at least 4 a period")
    whole, moved = _phasors(t, f, x, y)
    if not abs(whole) > 1e-12 * float(np.max(np.abs(x)) or 1.0):
        raise ReductionError(f"{f:g} Hz: the reference signal has no component at this frequency")
    value = moved / whole
    if periods < 2:
        return Point(f, value, None, 1.0)
    xs, ys = segment_phasors(t, f, x, y)
    n = xs.size
    scatter = float(np.sum(np.abs(ys / xs - value) ** 2)) / (2.0 * n * (n - 1))
    noise = neighbour_noise(t, y, f) if by_neighbours else None
    own = noise / abs(whole) if noise is not None else math.sqrt(scatter)
    return Point(f, value, own / abs(value) if value else None, coherence(xs, ys))


def coherence(x: NDArray[np.complex128], y: NDArray[np.complex128]) -> float:
    """Return |sum y x*|^2 / (sum |x|^2 sum |y|^2) of phasors of segments; 0 where either has none."""
    power = float(np.sum(np.abs(x) ** 2) * np.sum(np.abs(y) ** 2))
    return float(np.abs(np.sum(y * np.conj(x))) ** 2) / power if power > 0.0 else 0.0


def neighbour_noise(t: Array, y: Array, f: float) -> float | None:
    """Return the standard deviation that noise gives each part of the phasor of y at f Hz, None for too short a record.

    From the phasors 2 to 4 lines of the record to either side, where its sine of whole periods has none; 12 numbers,
    so it is half of a 95 % interval over 1.96.  Noise that is larger at other frequencies reaches into short segments,
    whose scatter is too large then, and much less into these lines.
    """
    lines = [f + k / (t[-1] - t[0] + t[1] - t[0]) for k in (-4, -3, -2, 2, 3, 4)]
    if lines[0] < 0.5 * f:
        return None
    own = phasor(t, y, f)
    rest = y - (own * np.exp(2j * np.pi * f * t)).real  # the record may be a sample longer than whole periods
    power = float(np.mean([abs(phasor(t, rest, x)) ** 2 for x in lines])) / 2.0
    return float(special.stdtrit(2 * len(lines), 0.975)) / NORMAL * math.sqrt(power)


def segment_phasors(t: Array, f: float, *signals: Array) -> list[NDArray[np.complex128]]:
    """Return the phasors of each signal in up to 8 segments of whole periods."""
    dt = float(t[1] - t[0])
    periods = int((t[-1] - t[0] + dt) * f + 1e-6)
    n = min(SEGMENTS, periods)
    edges = [t[0] + (periods * k // n) / f for k in range(n + 1)]
    parts = [
        slice(int(np.searchsorted(t, a - 0.5 * dt)), int(np.searchsorted(t, b - 0.5 * dt))) for a, b in pairwise(edges)
    ]
    return [np.array(p) for p in zip(*(_phasors(t[s], f, *(y[s] for y in signals)) for s in parts), strict=True)]


# ------------------------------------------------------------------------------------------- steps
@dataclass(frozen=True)
class Step:
    """Measures of a step response: values in the unit of the signal, times in s after the gate opened.

    overshoot: share of the change beyond it.  settled_5, settled_2: time after which the signal stays within 5 or
    2 % of the change about the final value; None when it did not settle before the last tenth of the record.
    slope: of that last tenth, unit/s.  moves: by how much the signal moves in it beyond its noise, part of u_change.
    """

    initial: float
    final: float
    u_change: float
    overshoot: float
    settled_5: float | None
    settled_2: float | None
    u_settled: float
    slope: float
    moves: float = 0.0
    last: float = 0.0  # s, length of the last tenth
    ahead: float = 0.5  # of the last tenth's way: what its mean is short of the final value

    @property
    def unsettled(self) -> str:
        """Return why there is no final value, "" where there is one: it moves by less than 2 % of the change."""
        if self.moves <= UNSETTLED * abs(self.change):
            return ""
        share = f"{plain(100.0 * self.moves / abs(self.change))} % of the change" if self.change else "without a change"
        return f"not settled: in the last tenth of the step the signal still moves by {share}, more than its u"

    @property
    def restless(self) -> str:
        """Return why there is no settling time to 5 %, "" where there is one."""
        if self.unsettled or self.settled_5 is not None:
            return self.unsettled
        return "the signal does not stay within 5 % of the change before the last tenth of the step"

    def with_noise(self, u: float) -> Step:
        """Return the same with this uncertainty of the change from noise; what moves beyond it is added."""
        width = abs(self.slope) * self.last
        moves = width if width > MOVING * u else 0.0
        return replace(self, u_change=math.hypot(u, self.ahead * moves / math.sqrt(3.0)), moves=moves)

    @property
    def change(self) -> float:
        return self.final - self.initial


def step(t: Array, y: Array, rest: Array, start: float | None = None) -> Step:
    """Return the measures of a step response.

    rest: the signal before it (empty: 0).  start: time of the step, default t[0].
    The uncertainty of the change is that of two means of white noise, and what the signal still moves; that of the
    settling times is the sampling interval's, dt / sqrt(12).
    """
    t0 = float(t[0]) if start is None else start
    last = max(2, int(LAST * t.size))
    initial = float(np.mean(rest)) if rest.size else 0.0
    final = float(np.mean(y[-last:]))
    change = final - initial
    slope, _ = np.polyfit(t[-last:] - t[-1], y[-last:], 1)
    noise = float(np.std(y[-last:] - np.polyval(np.polyfit(t[-last:], y[-last:], 1), t[-last:])))
    u = noise * math.sqrt(1.0 / last + (1.0 / rest.size if rest.size else 0.0))
    peak = float(np.max((y - initial) * np.sign(change))) if change else 0.0

    def settled(band: float) -> float | None:
        outside = np.flatnonzero(np.abs(y - final) > band * abs(change))
        if outside.size == 0:
            return 0.0
        k = int(outside[-1])
        if k >= t.size - last:
            return None
        a, b = abs(y[k] - final), abs(y[k + 1] - final)
        share = (a - band * abs(change)) / (a - b) if a != b else 1.0
        return float(t[k] + share * (t[k + 1] - t[k])) - t0

    overshoot = max(0.0, peak / abs(change) - 1.0) if change else 0.0
    settled_5, settled_2 = (settled(band) if change else None for band in (0.05, 0.02))
    return Step(
        initial, final, u, overshoot, settled_5, settled_2, float(t[1] - t[0]) / math.sqrt(12.0), float(slope),
        last=float(t[-1] - t[-last]), ahead=_ahead(float(slope), y[-2 * last : -last], t[-2 * last : -last]),
    ).with_noise(u)  # fmt: skip


def _ahead(slope: float, before: Array, t: Array) -> float:
    """Return what the mean of the last tenth is short of the end of an exponential, over its way in that tenth.

    The ways of two tenths are as r = exp(last / T), so 1/(r - 1) of the last one is to come, and half of it is in the
    mean.  At most 4: a slower exponential that began with the step moves by more than 2 % of the change.
    """
    if before.size < 2 or slope == 0.0:
        return AHEAD
    earlier = float(np.polyfit(t - t[-1], before, 1)[0])
    ratio = earlier / slope
    return min(AHEAD, 0.5 + 1.0 / (ratio - 1.0)) if ratio > 1.0 else AHEAD


def step_noise_std(y: Array, before: int, gap: int, after: int) -> float | None:
    """Return the standard deviation that noise gives a change between two means, as half a 95 % interval over 1.96.

    y: a record at rest.  The change is that from the mean of ``before`` samples (0: none) to the mean of ``after``
    samples that end ``gap`` samples later; it is taken from every piece of the record without overlap, so noise of any
    colour is in it.  A record of fewer than PIECES pieces has at least sqrt(2) times the scatter of means of ``after``
    samples, which knows noise up to the record's own length alone.  None for fewer than 5 of these, too.
    """
    line = y - np.polyval(np.polyfit(np.arange(y.size), y, 1), np.arange(y.size))
    span = before + gap
    starts = range(0, y.size - span + 1, max(span, 1))
    found = []
    if len(starts) > 1:
        ends = [line[k + span - after : k + span].mean() for k in starts]
        begins = [line[k : k + before].mean() if before else line[k] for k in starts]
        found.append(_of_few(np.std(np.array(ends) - np.array(begins), ddof=1), len(starts) - 1))
    if len(starts) < PIECES:
        n = y.size // after
        if n < 5:
            return None
        means = line[: n * after].reshape(n, after).mean(axis=1)
        found.append(_of_few(math.sqrt(2.0) * np.std(means, ddof=2), n - 2))
    return max(found)


def short_rest(quiet: Gate, samples: int, measures: Step) -> str:
    """Return a warning of a phase at rest too short for what slow noise does to a step of so many samples, or ""."""
    length = samples * float(quiet.t[1] - quiet.t[0])
    time = float(quiet.t[-1] - quiet.t[0])
    if time >= PIECES * length or measures.u_change <= SEEN * abs(measures.change):
        return ""
    return (
        f"The phase {quiet.label} of {plain(time, 3)} s is shorter than {PIECES} steps of {plain(length, 3)} s: slower "
        f"noise is not in the u of the steps. Hold for {plain(PIECES * length, 3)} s or longer."
    )


def _of_few(std: float, dof: int) -> float:
    """Return a standard deviation of few numbers, wide enough for an interval of 1.96 of it."""
    return float(std * special.stdtrit(dof, 0.975) / NORMAL)


# ------------------------------------------------------------------------------------------- axes
def cross_axis(
    points: Mapping[tuple[int, int], complex], axes: Sequence[str], what: str, caption: str = ""
) -> Table:  # fmt: skip
    """Return the table of |response of axis j to excitation of axis k| over |response of k itself|, in percent.

    points: (k, j) -> complex ratio at one frequency, numbered from 1.  axes: their names.  A missing pair stays empty.
    """
    rows = []
    for k, name in enumerate(axes, 1):
        direct = points.get((k, k))
        cells: list[Any] = [name]
        for j in range(1, len(axes) + 1):
            coupled = points.get((k, j))
            cells.append(None if direct is None or coupled is None or not direct else 100.0 * abs(coupled / direct))
        rows.append(cells)
    columns = ["excited axis", *(f"{a} / %" for a in axes)]
    return Table("cross_axis", f"Cross-axis coupling, {what}", caption, columns, rows)
