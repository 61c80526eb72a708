"""Doubts about one linear loop behind a record: two halves that differ, L that does not fall.

**Halves.** Of the response to each period, at the n lines of the excitation, the means of the first and of the
second half of the periods differ by d_1, those of every other one by d_2; at the m harmonics between the lines, where
the output has noise and drift alone, by d_3.  Of one loop |d_1|^2 is as large as the larger of |d_2|^2 and |d_3|^2:
F of 2 n and 2 m degrees of freedom.  The mean over periods hides what has changed in between.

Of a random excitation the responses of both halves are compared, band by band.

**End of L.** With S = u/r of an excitation at the plant input, an input in another unit or of another scale (S c),
taken a sample late (S e^(-iwh)), or before the excitation is added (-T) makes of L, which falls, 1/c - 1 + L/c,
e^(iwh) - 1 + ... or -2 - 1/L: none of them falls.  The other places of the excitation have the like.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.arrays import Array
from gyrobench.identification.line_spectrum import broadband_lines, periods_used
from gyrobench.identification.loop_record import LoopRecord
from gyrobench.identification.ratios import MeasuredResponse, loop_responses

Complex = NDArray[np.complexfloating[Any, Any]]
Rows = NDArray[np.bool_]
LEVEL = 1e-6  # of the test of the halves
MOVED = 0.02  # relative change of the response that counts, rms over the lines
PERIODS = 4  # after the transient
FALLS = 0.7  # of |L| from an octave to the next, at least: a slope of -1 has 0.5
SEEN, STRONG = 0.05, 0.3  # |L| at the highest frequencies that is said, with which nothing passes
FEW = 4  # lines, of an octave or more
CHANGED = "the loop changed while it was recorded"
CHANGE = CHANGED + (
    ": the responses of its first and second half differ by {:.2g} %, more than noise and drift explain; the figures "
    "are of neither"
)
LEVEL_END = "|L| does not fall towards the highest frequencies"


def halves(record: LoopRecord, period: int, f: Array) -> str:
    """Return that first and second half of the periods are of different loops, or "".

    period: samples.  f: frequencies of the excitation, Hz.
    """
    count = periods_used(record.r.size, period)
    if count < PERIODS or f.size < FEW:
        return ""
    lines = np.round(f * period * record.step).astype(int)
    start = record.r.size - count * period
    r, y = (np.fft.rfft(x[start:].reshape(count, period)) for x in (record.r, record.y))
    response = y[:, lines] / r[:, lines]
    size = np.abs(response.mean(axis=0))
    middle, even = count // 2, np.arange(count) % 2 == 0

    def apart(z: Complex, scale: Array, one: Rows, other: Rows) -> float:
        """Return the mean square of what two means of periods differ by."""
        return float(np.mean(np.abs((z[one].mean(axis=0) - z[other].mean(axis=0)) / scale) ** 2))

    first, last = np.arange(count) < middle, np.arange(count) >= count - middle
    slow, quick, dof = apart(response, size, first, last), apart(response, size, even, ~even), f.size
    between = np.setdiff1d(np.arange(lines.min(), lines.max()), lines)
    if between.size >= FEW:  # a drift of the output that bends is in the harmonics between the lines, too
        near = np.interp(between, lines, size * np.abs(r[:, lines]).mean(axis=0))
        quick, dof = max(quick, apart(y[:, between], near, first, last)), min(f.size, between.size)
    moved = math.sqrt(max(slow - quick, 0.0))
    if moved < MOVED or special.fdtrc(2.0 * f.size, 2.0 * dof, slow / max(quick, 1e-300)) > LEVEL:
        return ""
    return CHANGE.format(100.0 * moved)


def halves_of_bands(record: LoopRecord, low: float, high: float) -> str:
    """Return that first and second half of a record of random excitation are of different loops, or "".

    low, high: Hz.  The S of both halves differ by chi-squared of 2 degrees of freedom in each band, of noise that is
    known with those of F; Fisher's sum of the logarithms of their p is chi-squared of 2 n.
    """
    middle = record.r.size // 2
    parts = [replace(record, r=record.r[k], u=record.u[k], y=record.y[k])
             for k in (slice(middle), slice(middle, 2 * middle))]  # fmt: skip
    a, b = (loop_responses(broadband_lines(p, low, high), record.at)["S"] for p in parts)
    _, i, j = np.intersect1d(a.f, b.f, return_indices=True)
    noise = 2.0 * ((a.u[i] * np.abs(a.value[i])) ** 2 + (b.u[j] * np.abs(b.value[j])) ** 2)
    size, change = np.abs(a.value[i] + b.value[j]) ** 2 / 4.0, np.abs(a.value[i] - b.value[j]) ** 2
    if i.size < FEW:
        return ""
    p = special.fdtrc(2.0, a.dof[i] + b.dof[j], change / np.maximum(noise, 1e-300))
    moved = math.sqrt(max(float(np.sum(change - noise) / np.sum(size)), 0.0))
    if moved < MOVED or special.chdtrc(2.0 * i.size, -2.0 * float(np.sum(np.log(np.maximum(p, 1e-300))))) > LEVEL:
        return ""
    return CHANGE.format(100.0 * moved)


def level_end(s: MeasuredResponse) -> tuple[str, bool]:
    """Return that |L| does not fall at the end of a response S, or "", and whether its margins are in doubt for it."""
    if s.f.size < 2 * FEW:
        return "", False
    order = np.argsort(s.f)
    f, size = s.f[order], np.abs(1.0 / s.value[order] - 1.0)
    top = float(f[-1])
    edge = min(int(np.searchsorted(f, 0.5 * top, side="right")), f.size - FEW)  # an octave, of few lines more
    start = min(int(np.searchsorted(f, 0.5 * f[edge], side="right")), edge - FEW)
    if start < 0:
        return "", False
    end, was = float(np.median(size[edge:])), float(np.median(size[start:edge]))
    if end < SEEN or end < FALLS * was:
        return "", False
    text = (
        f"{LEVEL_END}: {end:.2g} in the octave up to {top:.4g} Hz, {was:.2g} in the one below. Unless a resonance is "
        "there: are excitation and input of one scale and unit and of the same instants, and is 'input' behind the "
        "point where the excitation is added ('controller' before it)?"
    )
    return text, end > STRONG
