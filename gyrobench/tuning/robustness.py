"""Measures of loops on a grid of frequencies: margins, peaks of S and T, bandwidth; many loops at once.

    S = 1/(1 + L)      T = L/(1 + L)      disk margin 1 / max |S - 1/2|  (skew 0)

Crossings lie between neighbours of the grid, linear in log |L| and phase over log f; peaks on a parabola through three
points.  Limits of the gain beyond a factor of 1000 do not count.  Source: Seiler 2020 (disk margin), Skogestad 2005,
sections 2.4.5 and 2.8.2 (bandwidth, and the bound on |S| below it).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.frequency_response import Complex
from gyrobench.tuning.wishes import Wish

LARGEST = 1e3  # factor of a gain margin that still counts
REAL = 1e-6  # rad from -180 degrees: L is real
FLAT, ALMOST = 0.05, 0.15  # slope of ln |L| over ln f and rad from -180 degrees at the lowest frequency: L(0) < 0
HALF_POWER = 0.5**0.5
FLOOR = 0.01  # of |S|: two decades below a bandwidth no more is asked for


def peak(f: Array, size: Array) -> float:
    """Return the largest value of a curve over log f, on a parabola through its largest point and the two beside it."""
    k = int(np.argmax(size))
    if k in (0, size.size - 1):
        return float(size[k])
    x, y = np.log(f[k - 1 : k + 2]), np.log(np.maximum(size[k - 1 : k + 2], 1e-300))
    left, right = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
    curve = (right - left) / (x[2] - x[0])
    if curve >= 0.0:
        return float(size[k])
    slope = left + curve * (x[1] - x[0])
    return float(np.exp(min(y[1] - slope**2 / (4.0 * curve), y[1] + 0.05)))


def crossovers(f: Array, L: Complex) -> list[tuple[float, float]]:
    """Return where |L| = 1: (Hz, phase margin, rad, between -pi and pi)."""
    size, phase = np.log(np.abs(L)), np.angle(-L)
    found = []
    for k in np.flatnonzero((size[:-1] >= 0.0) != (size[1:] >= 0.0)):
        share = size[k] / (size[k] - size[k + 1])
        turn = _wrapped(phase[k + 1] - phase[k])
        found.append((float(f[k] * (f[k + 1] / f[k]) ** share), float(_wrapped(phase[k] + share * turn))))
    return found


def gain_limits(f: Array, L: Complex) -> list[tuple[float, float]]:
    """Return where the phase of L is -180 degrees: (Hz, factor on the gain to the limit).

    At rest and at half the frequency of the steps L is real: where the phase ends there, no crossing shows the limit.
    """
    size, phase = np.log(np.abs(L)), np.angle(-L)
    turn = _wrapped(np.diff(phase))
    after = phase[:-1] + turn
    flat = abs(size[1] - size[0]) < FLAT * np.log(f[1] / f[0])
    ends = [0] if flat and abs(phase[0]) < ALMOST else []
    ends += [-1] if abs(phase[-1]) < REAL else []
    found = [(float(f[k]), float(np.exp(-size[k]))) for k in ends]
    for k in np.flatnonzero(((phase[:-1] >= 0.0) != (after >= 0.0)) & (np.abs(phase[:-1]) < 1.5)):
        share = phase[k] / (phase[k] - after[k])
        factor = float(np.exp(-(size[k] + share * (size[k + 1] - size[k]))))
        found.append((float(f[k] * (f[k + 1] / f[k]) ** share), factor))
    return [(at, factor) for at, factor in found if 1.0 / LARGEST < factor < LARGEST]


def _wrapped(angle: Array) -> Array:
    return angle - 2.0 * np.pi * np.floor(angle / (2.0 * np.pi) + 0.5)


def bandwidth(f: Array, S: Array) -> float:
    """Return the largest b, Hz, with |S| <= f / sqrt(f2 + b2), up to where |S| first crosses -3 dB from below.

    That is |S| of the loop b/(jf): at b it is -3 dB, below b it falls by 20 dB a decade.  Where |S| is below FLOOR no
    more is asked.  0 where it does not cross.
    """
    return bandwidth_limit(f, S)[0]


def bandwidth_limit(f: Array, S: Array) -> tuple[float, float]:
    """Return the bandwidth, and the frequency at which |S| limits it, Hz; 0, 0 where there is none."""
    above = S >= HALF_POWER
    rises = np.flatnonzero(~above[:-1] & above[1:])
    if not rises.size:
        return 0.0, 0.0
    k = rises[0]
    share = np.log(HALF_POWER / S[k]) / np.log(S[k + 1] / S[k])
    crossing = float(f[k] * (f[k + 1] / f[k]) ** share)
    counts = S[: k + 1] > FLOOR
    at = f[: k + 1][counts]
    bound = at * np.sqrt(np.maximum(S[: k + 1][counts] ** -2.0 - 1.0, 0.0))
    if not bound.size or crossing <= bound.min():
        return crossing, crossing
    return float(bound.min()), float(at[np.argmin(bound)])


def measure(wish: Wish, f: Array, L: Complex) -> float:
    """Return a measure of a stable loop, SI."""
    S = 1.0 / (1.0 + L)
    match wish.name:
        case "jitter":  # not of the loop alone: sight_jitter
            return np.nan
        case "phase margin":
            return min((abs(p) for _, p in crossovers(f, L)), default=np.inf)
        case "delay margin":
            return min((p % (2.0 * np.pi) / (2.0 * np.pi * at) for at, p in crossovers(f, L)), default=np.inf)
        case "gain margin":
            return min((max(g, 1.0 / g) for _, g in gain_limits(f, L)), default=np.inf)
        case "disk margin":
            return 1.0 / peak(f, np.abs(S - 0.5))
        case "bandwidth":
            return bandwidth(f, np.abs(S))
        case "peak S":
            return peak(f, np.abs(S))
        case "peak T":
            return peak(f, np.abs(L * S))
    return float(np.exp(np.interp(np.log(wish.f), np.log(f), np.log(np.abs(S)))))


def measured(wishes: Sequence[Wish], f: Array, loops: Complex) -> Array:
    """Return each wish's measure (loops, wishes) of loops (loops, frequencies)."""
    return np.array([[measure(w, f, L) for w in wishes] for L in loops])


def grid(step: float, f: float, modes: Sequence[float] = (), count: int = 400) -> Array:
    """Return frequencies, Hz, up to half a step's: three decades below f and more, closer about modes."""
    top = 0.5 / step
    whole = np.geomspace(min(1e-3 * f, 1e-3 * top), top, count)
    close = [m * np.geomspace(0.8, 1.25, 41) for m in modes if whole[0] < 0.8 * m and 1.25 * m < top]
    return np.unique(np.concatenate([whole, *close]))
