"""Margins of a measured loop with 95 % intervals.

A crossing counts where the curve on either side is told from the limit (by 3 u), so that the noise of single points
makes none.  With g = ln|L|, p = arg L, slopes over f, and equal and independent noise u of both:

    phase margin   u2(p at g = 0)    = u2 (1 + (p'/g')2)
    gain margin    u2(-g at p = -pi) = u2 (1 + (g'/p')2)
    peaks          u2(max)           = u2                      (the slope is 0 there)

Where the curve is flat at a crossing, all places at which it is not told from the limit may be it, and the interval
reaches over the values there.  So it does where the curve comes near the limit and goes back, and a crossing there
would be the smaller margin.

Source: Seiler 2020 (disk margin), Skogestad 2005, 2.4.5; the propagation is of first order.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.identification.loop_curve import BETWEEN, LoopCurve
from gyrobench.record.frequency_response import Complex
from gyrobench.reduction.estimation.uncertainty import NORMAL

TOLD = 3.0  # u, from the limit
LARGEST = 1e3  # factor of a gain margin that still counts
LARGEST_U = 0.3  # of L, relative: what is less certain tells no crossing
TURN = 2.0 * math.pi
SMALL = 0.1  # of |L|: what is not resolved below it has no margin


@dataclass(frozen=True)
class Margin:
    """A margin: value and 95 % interval, SI (rad, s, Hz, factors), at a frequency, Hz."""

    name: str
    value: float
    low: float
    high: float
    f: float
    unit: str

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high

    def shown(self, x: float) -> str:
        """Return a value of this margin as text."""
        match self.unit:
            case "rad":
                return f"{math.degrees(x):.3g}°"
            case "factor":
                return f"{20.0 * math.log10(max(x, 1e-15)):.3g} dB"
            case "s":
                return f"{1e3 * x:.3g} ms"
        return f"{x:.4g} Hz" if self.unit == "Hz" else f"{x:.3g}"


def margins(c: LoopCurve) -> tuple[list[Margin], list[str]]:
    """Return the margins of a loop, and why some are missing."""
    if not c.f.size:
        return [], ["no margins: too few frequencies have a response"]
    size = np.abs(c.L)
    if np.any(narrow := ~c.resolved & (size > SMALL)):
        at = float(np.exp(np.mean(np.log(c.f[narrow]))))
        return [], [
            f"no margins: about {at:.3g} Hz the loop changes faster than the frequencies can follow, and the smallest "
            "margin may lie between two of them; a longer period, or a longer record, brings them closer together"
        ]
    known = c.u_L < LARGEST_U
    why: list[str] = []
    found = [*_phase_margins(c, known, why), *_gain_margins(c, known, why)]
    names = {m.name for m in found}
    span = (
        f"between {c.f[known][0]:.3g} and {c.f[known][-1]:.3g} Hz, where it is known" if np.any(known) else "anywhere"
    )
    if "phase margin" not in names:
        why.append(f"no phase margin: |L| is not seen to cross 1 {span}")
    if "gain margin" not in names:
        why.append(f"no gain margin: the phase of L is not seen to cross −180° with |L| below 1 {span}")
    for name, of, value, invert in (
        ("disk margin", "S − 1/2", c.S - 0.5, True), ("peak S", "S", c.S, False), ("peak T", "T", 1.0 - c.S, False),
    ):  # fmt: skip
        peak = _peak(name, c, value, invert)
        if peak is None:
            why.append(f"no {name}: the largest |{of}| is at an end of the frequencies")
        elif name == "peak T" and peak.high < 1.0:  # with an integral action |T| is 1 at frequencies below
            why.append("no peak T: |T| stays below 1 between the frequencies")
        else:
            found.append(peak)
    return found, why


def _phase_margins(c: LoopCurve, known: NDArray[np.bool_], why: list[str]) -> Iterator[Margin]:
    size, turn = np.log(np.abs(c.L)), np.angle(-c.L)
    found = []
    for k, f in _crossings(size, c.u_L, known, c.f):
        slope, u = c.slope_L[k], c.u_L[k]
        phase = _wrapped(float(turn[k]) + slope.imag * (f - c.f[k]))
        late = phase % TURN / (TURN * f)
        by_gain = (1.0 / f - slope.imag / (phase % TURN)) / slope.real if phase else 0.0
        near = _near(size, c.u_L, known, k)
        phases = phase + np.unwrap(np.concatenate([[phase], turn[near]]))[1:] - phase
        of_f = _interval(f, NORMAL * u / abs(slope.real), c.f[near], 0.0)
        of_phase = _interval(phase, NORMAL * u * abs(slope.imag / slope.real), phases, NORMAL * u)
        lates = late + (phases - phase) / (TURN * c.f[near]) + phase % TURN / TURN * (1.0 / c.f[near] - 1.0 / f)
        of_late = _interval(late, NORMAL * u * late * abs(by_gain), lates, NORMAL * u * late / (phase % TURN or 1.0))
        found.append((f, phase, late, of_f, of_phase, of_late))
    if not found:
        return
    may = _touches(size, c.u_L, known)
    lates = turn % TURN / (TURN * c.f)
    f, phase, _, of_f, of_phase, _ = min(found, key=lambda m: abs(m[1]))
    smaller = may & (np.abs(turn) < abs(phase))
    of_f, of_phase = _reaching(of_f, c.f[smaller]), _reaching(of_phase, turn[smaller])
    yield Margin("phase margin", phase, *of_phase, f, "rad")
    yield Margin("crossover", f, *of_f, f, "Hz")
    f, _, late, _, _, of_late = min(found, key=lambda m: m[2])
    sooner = may & (lates < late)
    yield Margin("delay margin", late, *_reaching(of_late, lates[sooner]), f, "s")
    why += _doubt(c.f, smaller | sooner, "|L| is not told from 1", "phase and delay margin")


def _gain_margins(c: LoopCurve, known: NDArray[np.bool_], why: list[str]) -> Iterator[Margin]:
    size, turn = np.log(np.abs(c.L)), np.angle(-c.L)
    counts = known & (np.abs(turn) < 0.25 * TURN)
    found = []
    for k, f in _crossings(turn, c.u_L, counts, c.f):
        slope, u = c.slope_L[k], c.u_L[k]
        log = -float(size[k]) - slope.real * (f - c.f[k])
        if abs(log) < math.log(LARGEST):
            near = _near(turn, c.u_L, counts, k)
            found.append((abs(log), log, f, _interval(log, NORMAL * u * abs(slope.real / slope.imag), -size[near],
                                                      NORMAL * u)))  # fmt: skip
    may = _touches(turn, c.u_L, counts)
    for name, up in (("gain margin", True), ("gain-reduction margin", False)):
        if of_side := [m for m in found if (m[1] > 0.0) == up]:
            least, log, f, interval = min(of_side)
            smaller = may & ((size < 0.0) == up) & (np.abs(size) < least)
            low, high = _reaching(interval, -size[smaller])
            yield Margin(name, math.exp(log), math.exp(low), math.exp(high), f, "factor")
            why += _doubt(c.f, smaller, "the phase of L is not told from −180°", name)


def _touches(value: Array, u: Array, counts: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the places that may be a crossing of 0, at 95 %, between two that are told from it to the same side."""
    told = np.abs(value) >= TOLD * u
    side, place = np.where(counts & told, np.sign(value), 0.0), np.arange(value.size)
    stops = told | ~counts
    before = np.maximum.accumulate(np.where(stops, place, 0))
    after = np.minimum.accumulate(np.where(stops, place, value.size - 1)[::-1])[::-1]
    same = (side[before] == side[after]) & (side[before] != 0.0)
    return np.asarray(counts & same & (np.abs(value) <= NORMAL * u))


def _reaching(interval: tuple[float, float], values: Array) -> tuple[float, float]:
    """Return the interval with values that the margin may have, too."""
    return min(interval[0], float(values.min(initial=math.inf))), max(interval[1], float(values.max(initial=-math.inf)))


def _doubt(f: Array, where: NDArray[np.bool_], what: str, margin: str) -> list[str]:
    if not np.any(where):
        return []
    at = float(np.exp(np.mean(np.log(f[where]))))
    return [f"about {at:.3g} Hz {what}: it may cross there, and the interval of the {margin} reaches to that"]


def _near(value: Array, u: Array, counts: NDArray[np.bool_], k: int) -> slice:
    """Return the places about a crossing of 0 at k that may be it, at 95 %: more than one where the curve is flat."""
    may = counts & (np.abs(value) <= NORMAL * u)
    may[k] = True
    first = k - int(np.argmin(np.append(may[k::-1], False))) + 1
    return slice(first, k + int(np.argmin(np.append(may[k:], False))))


def _interval(value: float, U: float, near: Array, own: float) -> tuple[float, float]:
    """Return the interval of a value by the slope, U, or by values near the crossing; own: U of the value itself."""
    down, up = max(U, value - float(near.min())), max(U, float(near.max()) - value)
    return value - math.hypot(down, own), value + math.hypot(up, own)


def _crossings(value: Array, u: Array, counts: NDArray[np.bool_], f: Array) -> Iterator[tuple[int, float]]:
    """Yield place and frequency of each crossing of 0 that is told from noise; in the middle of several in one."""
    before = -1
    for k in range(value.size):
        if not counts[k]:
            before = -1
            continue
        if abs(value[k]) < TOLD * u[k]:
            continue
        if before >= 0 and (value[k] > 0.0) != (value[before] > 0.0):
            positive = value[before : k + 1] > 0.0
            changes = before + np.flatnonzero(positive[1:] != positive[:-1])
            i = int(changes[changes.size // 2])
            share = value[i] / (value[i] - value[i + 1])
            yield (i if share < 0.5 else i + 1), float(f[i] + share * (f[i + 1] - f[i]))
        before = k


def _peak(name: str, c: LoopCurve, value: Complex, invert: bool) -> Margin | None:
    """Return the largest size of a response; None where it is at an end.

    The largest of noisy values is too large: by how much, and how it scatters, is seen by adding the noise once more;
    this correction is as uncertain as it is large.
    """
    counts = (c.u < LARGEST_U * np.abs(value)) & c.sound
    inside = counts.copy()
    inside[:BETWEEN] = inside[-BETWEEN:] = False
    if not np.any(inside):
        return None
    size = np.where(inside, np.abs(value), 0.0)
    k = int(np.argmax(size))
    if np.abs(value)[[0, -1]].max() >= size[k]:
        return None
    again = np.where(counts, np.abs(value + c.noise), 0.0).max(axis=1)
    excess = float(again.mean()) - float(size[k])
    peak, U = float(size[k]) - excess, NORMAL * math.hypot(max(float(again.std(ddof=1)), float(c.u[k])), excess)
    limits = [peak - U, peak, peak + U]
    low, at, high = (1.0 / x for x in reversed(limits)) if invert else limits
    return Margin(name, at, low, high, float(c.f[k]), "1" if invert else "factor")


def _wrapped(angle: float) -> float:
    return angle - TURN * math.floor(angle / TURN + 0.5)
