"""Reading of a gain margin from measured points: limits at low gain, limits that drown in noise."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.reduction.loops.loop_measures import Point
from gyrobench.tuning.proof import _gain_margin, sine_frequencies
from gyrobench.tuning.robustness import gain_limits
from gyrobench.tuning.wishes import parse_wishes

WISHES = parse_wishes(["gain margin=6dB", "S at 1Hz<-10dB"])
F = np.geomspace(1e-3, 2000.0, 4000)


def loop(f: np.ndarray) -> np.ndarray:
    """Return 1/s3 at first, crossing near 20 Hz, with a delay of 0.3 ms.

    Limits: down where atan(6/w) + atan(5/w) = 90 degrees, w = sqrt 30, 0.87 Hz; up near 830 Hz.
    """
    s = 2j * np.pi * f
    return 126.0 / s * (1.0 + 6.0 / s) * (1.0 + 5.0 / s) * np.exp(-3e-4 * s)


def test_a_slow_limit_that_counts_has_sines() -> None:
    """Down at 0.87 Hz, 23 times slower than the crossover, by 33 dB, and up by 32 dB: both are measured."""
    L = loop(F)
    slow, fast = gain_limits(F, L)
    assert abs(slow[0] - math.sqrt(30.0) / (2.0 * math.pi)) < 0.02 and fast[1] < 1.0 / slow[1] < 1.5 * fast[1]
    sines = sine_frequencies(F, L, WISHES, 1e-4)
    assert sum(abs(math.log(x / slow[0])) < 0.1 for x in sines) >= 3
    without = [w for w in WISHES if w.name != "gain margin"]
    assert not any(abs(math.log(x / slow[0])) < 0.1 for x in sine_frequencies(F, L, without, 1e-4))


def test_a_limit_in_noise_is_a_bound() -> None:
    """The sines beyond 250 Hz are lost: all that is sure is 1/|L| there, 126/(2 pi 250) = 1/12.5, 21.9 dB, or more."""
    L = loop(F)
    f = np.array([1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 250.0])
    points = [Point(x, complex(v), 1e-4, 1.0) for x, v in zip(f, loop(f), strict=True)]
    got = _gain_margin(WISHES[0], points, [400.0, 830.0], F, L)
    assert got.bound and got.agrees and got.kept
    assert abs(got.value / 12.47 - 1.0) < 0.01
    turned = [*points, Point(700.0, complex(-abs(loop(np.array([700.0]))[0]) * np.exp(-0.3j)), 0.6, 0.9)]
    noisy = _gain_margin(WISHES[0], turned, [830.0], F, L)
    assert noisy.agrees and 0.3 * noisy.value < noisy.U


def test_limits_that_are_measured_are_no_bound() -> None:
    """Both limits within the points: the smaller one, of its own two sides, within 2 % of the loop's."""
    L = loop(F)
    slow, fast = gain_limits(F, L)
    f = [*(slow[0] * q for q in (0.8, 0.93, 1.0, 1.07, 1.2)), 2.0, 5.0, 10.0, 20.0, 60.0, 150.0, 300.0,
         *(fast[0] * q for q in (0.93, 1.0, 1.07))]  # fmt: skip
    points = [Point(x, complex(v), 1e-5, 1.0) for x, v in zip(f, loop(np.array(f)), strict=True)]
    got = _gain_margin(WISHES[0], points, [], F, L)
    assert not got.bound and abs(got.value / min(1.0 / slow[1], fast[1]) - 1.0) < 0.02
