"""Stretches of a record at rest in which the instrument was moved."""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench.arrays import Array
from gyrobench.reduction.series.motion import MOST, moved, turned

N, STEP = 40_000, 0.01


def noise(kind: str) -> Array:
    """Noise and faults that are none of a motion."""
    rng = np.random.default_rng(3)
    x, k = rng.normal(size=N), np.arange(N)
    return {
        "white": x,
        "walk": np.cumsum(x),
        "angle": np.diff(x, prepend=0.0),
        "wild": x + 50.0 * (rng.random(N) < 0.01),
        "steps": x + 1000.0 * (k // 1000 % 2),
        "line": x + 20.0 * np.sin(0.31 * k),
        "warm-up": x + 1e4 * np.exp(-k / 3000.0),
        "coarse": np.rint(0.3 * x),
        "gaps": np.where(k % 5000 < 900, np.nan, x),
    }[kind]


@pytest.mark.parametrize("kind", ["white", "walk", "angle", "wild", "steps", "line", "warm-up", "coarse", "gaps"])
def test_noise_and_its_faults_are_no_motion(kind: str) -> None:
    assert not moved({"x": noise(kind)}, STEP).any()


def test_taken_up_knocked_and_put_down() -> None:
    """A swing of 100 at 1 Hz: 0.12 s later it has changed by 37, noise of 1 by sqrt(2).  One channel of two tells.

    Blocks of 50 samples, and their neighbors: 200 to 300 of the knock are blocks 4 and 5 -> 150 to 350.  The end from
    block 790 on is too short for a record of its own.
    """
    x, y = noise("white"), noise("white")[::-1].copy()
    swing = 100.0 * np.sin(2.0 * np.pi * STEP * np.arange(N))
    x[20_200:20_300] += swing[:100]
    x[39_500:39_700] += swing[:200]
    found = np.flatnonzero(moved({"x": x, "y": y}, STEP))
    assert found.tolist() == [*range(20_150, 20_350), *range(39_450, N)]


def test_a_record_that_is_louder_for_a_third_of_it() -> None:
    """Thirty times from 0.7 on, blocks 560 to 800: found, with the block beside them, and too much to leave out."""
    found = moved({"x": noise("white") * np.where(np.arange(N) < 0.7 * N, 1.0, 30.0)}, STEP)
    assert found.mean() == pytest.approx(241 / 800) and found.mean() > MOST


def test_turned_smoothly_for_most_of_the_record() -> None:
    """A turntable at 1 rad/s and back, each for a third: no block stands out by its scatter, two thirds by their level.
    A bias that changes by 9 degrees a second (0.157 rad/s) is one, however odd."""
    third = np.arange(N) * 3 // N
    rate = 1e-3 * noise("white") + np.array([0.0, 1.0, -1.0])[third]
    assert moved({"x": rate}, STEP).mean() < 0.01
    assert turned([1e-3 * noise("white"), rate], STEP).mean() == pytest.approx(2.0 / 3.0, abs=0.01)
    assert not turned([1e-3 * noise("white") + 0.157 * np.arange(N) / N], STEP).any()
