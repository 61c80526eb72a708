"""Predicted standard deviation of an alignment, and the windows and frequencies for a wanted one."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from gyrobench.arrays import Array

from .plans import TO_NORTH, History, Sensors, Settings, history, pieces

#: white noise of density 1 in the steady state: standard deviation of the heading times N, over w^1.5 (tilt) and w^0.5
#: (rates); Lyapunov equation, damping 0.7071
NOISE = {3: (1.2640, 0.9939), 2: (0.5746, 0.6139)}
FREQUENCIES = 20  # that a gyrocompass may fall to: those that are tried
SHARE = 0.3  # of a goal, noise of the gyrocompass at last


def window_noise(c: Settings, s: Sensors) -> float:
    """Return the standard deviation of the coarse heading by white noise and Gauss-Markov drift, rad."""
    lean, T = s.force / c.gravity, c.coarse_time
    wander = s.markov**2 * (1.0 if c.positions == 1 else 1.0 - math.exp(-(T + 200.0) / s.tau))
    white = 1.2 * s.white**2 / T + 12.0 * lean**2 / T**3
    return math.sqrt((white + wander) / c.positions) / c.north


@lru_cache(maxsize=64)
def designed(c: Settings, s: Sensors, wanted: float, psi: float, total: float) -> Settings:
    """Return the settings with what is not given (coarse_time, frequencies 0, fast_time below 0) chosen for ``wanted``.

    Those of :func:`prepared` with which the heading is predicted to be ready first; where none gets there in
    ``total``, those with the least standard deviation at the end.  What is tried does not depend on ``wanted``: a
    looser one is never ready later.
    """
    tried: list[tuple[float, float, Settings]] = []
    for begins, one in sorted(((begin(one, psi), one) for one in prepared(c, s)), key=lambda x: x[0]):
        if tried and begins > min(t for t, _, _ in tried):
            break  # none of the rest is ready before it is usable
        h, sigma = predicted(one, s, psi, total)
        ready = ready_after(h, sigma, wanted)
        tried.append((total if ready is None else ready, float(sigma[-1]), one))
    return min(tried, key=lambda x: x[:2])[2]


def begin(c: Settings, psi: float) -> float:
    """Return when the turn to north is at its end, s."""
    return sum(p.time for p in itertools.takewhile(lambda p: p.stage < TO_NORTH or p.turning, pieces(c, psi, 0.0)))


def prepared(c: Settings, s: Sensors) -> list[Settings]:
    """Return settings that are worth a try, with what is given kept: one goal after the other, tight to loose.

    A goal is a standard deviation whose :data:`SHARE` is the noise of the gyrocompass at last: it falls to that
    frequency.  It begins there, where its noise is that of the windows, or half way; windows of two positions are so
    long that their noise is 0.7 of the goal.
    """
    tilt, rate = NOISE[c.order]
    grid = np.geomspace(1e-3, 0.05, FREQUENCIES)
    noise = np.hypot(tilt * s.force / c.gravity * grid**1.5, rate * s.white * grid**0.5) / c.north
    times = np.geomspace(30.0, 600.0, 40) if c.positions == 2 else np.array([60.0])
    found: dict[Settings, None] = {}
    for lowest, at_last in zip(grid, noise, strict=True):
        goal = at_last / SHARE
        if c.coarse_time:
            window = c.coarse_time
        else:
            good = [T for T in times if window_noise(replace(c, coarse_time=float(T)), s) <= 0.7 * goal]
            window = float(round(good[0] if good else times[-1]))
        one = replace(c, coarse_time=window)
        slow = c.slow_frequency or float(f"{lowest:.3g}")
        below = grid[noise <= window_noise(one, s)]
        first = max(float(f"{below[-1] if below.size else grid[0]:.3g}"), slow)
        for fast in [c.fast_frequency] if c.fast_frequency else sorted({first, max(slow, 0.5 * first), slow}):
            time = c.fast_time if c.fast_time >= 0.0 else (3.0 / fast if c.positions == 1 else 0.0)
            settings = replace(one, slow_frequency=min(slow, fast), fast_frequency=fast, fast_time=float(round(time)))
            found[settings] = None
    return list(found)


@lru_cache(maxsize=512)
def predicted(c: Settings, s: Sensors, psi: float, total: float) -> tuple[History, Array]:
    """Return times and standard deviation of the heading (n,) of complete settings; the responses are left out.

    Constant errors count as at least :func:`lasting`: a slow gyrocompass may pass below that on its way.
    """
    h = history(c, psi, total, s.tau)
    sources = h.sources(c, s).values()
    constant = sum((v[:, 2] ** 2 for size, _, v in sources if size > 0.0), start=np.zeros(h.t.size))
    rest = sum((v[:, 2] ** 2 for size, _, v in sources if not size > 0.0), start=np.zeros(h.t.size))
    sigma = np.sqrt(np.maximum(constant, lasting(c, s) ** 2) + rest)
    return replace(h, response=h.response[:0], variance=h.variance[:0]), sigma


def lasting(c: Settings, s: Sensors) -> float:
    """Return the standard deviation of the heading that constant errors leave in the end, rad (README, Errors).

    Two positions take all of them out, but for what is left to settle.
    """
    if c.positions == 2:
        return 0.0
    azimuth = 2.0 * c.damping * s.bias / c.slow_frequency if c.order == 2 else 0.0
    return math.hypot(s.bias / c.north, azimuth, math.tan(c.latitude) * s.accelerometer / c.gravity)


def ready_after(h: History, sigma: Array, wanted: float) -> float | None:
    """Return when, at north, the standard deviation falls to what is wanted, for good; None: it does not."""
    bad = (h.usable == 0.0) | (sigma > wanted)
    if bad[-1]:
        return None
    return float(h.t[h.t.size - int(np.argmax(bad[::-1]))])
