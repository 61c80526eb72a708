"""Means over whole numbers of samples: their odds against an average of any width, drift behind them, N."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.noise_model.maximum import WIDEST, by_chance
from gyrobench.reduction.noise_model.noise_model import NoiseModel
from gyrobench.reduction.noise_model.terms import NoiseTerm

COVERAGE = Path(__file__).parents[1] / "benchmarks" / "noise_model_coverage.py"


def model_of(name: str, seed: int) -> NoiseModel:
    """Return the model of a record of 10,000 samples of the coverage benchmark."""
    spec = importlib.util.spec_from_file_location("noise_model_coverage", COVERAGE)
    assert spec is not None and spec.loader is not None
    coverage = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(coverage)
    record = coverage.simulated(10_000, coverage.TRUTHS[name], [], np.random.default_rng([11, seed, 10_000]))
    return fit_noise(record, 1.0, means=False)


def test_the_width_of_an_average_beside_a_whole_number() -> None:
    """Known to s = 0.003 of itself it is as near to 3 by chance in sqrt(2 pi) 0.003 of log(3.5/2.5) = 0.33647."""
    term, info = NoiseTerm("white", "average"), np.diag([0.0, 0.003**-2 - WIDEST])
    cost = math.log(0.33647 / (0.003 * 2.50663))
    assert by_chance((term,), np.array([0.0, math.log(2.99)]), info) == pytest.approx(cost, rel=1e-4)
    assert by_chance((term,), np.array([0.0, math.log(2.9)]), info) == 0.0  # no whole number is near
    assert by_chance((term,), np.array([0.0, math.log(2.99)]), np.diag([0.0, 1.0])) == 0.0  # nor told


@pytest.mark.long
def test_drift_under_a_mean_over_whole_samples() -> None:
    """Processes of 12, 150 and 1500 samples behind a mean of three: an average of 2.99 fills the zero that the fastest
    one is seen in, and its tau was 13.0 to 34.7, by a walk in the place of the others.
    """
    model = model_of("mean of 3, three processes", 12)
    assert model.filter_words() == "mean over 3 samples"
    tau = model.processes[0].tau  # may stand for the first two: its upper end is no sign of the average
    assert tau.low < 12.0 and tau.value < 20.0


@pytest.mark.long
def test_flicker_under_a_mean_over_whole_samples() -> None:
    """B = 0.12 behind a mean of three, which a process beside one behind it as well hid: B was at most 0.009."""
    model = model_of("all noise through a mean of 3, flicker", 2)
    assert model.filter_words() == "mean over 3 samples" and model.slow_filtered
    assert model["B"].low <= 0.12 <= model["B"].high


@pytest.mark.long
def test_flicker_under_a_recursive_low_pass() -> None:
    """B = 0.15 behind two poles (natural frequency 0.5, damping 0.5): flicker that passes none fills what they hold
    back, and was 0.08 to 0.10.
    """
    model = model_of("recursive low-pass, flicker", 1)
    assert model.filter_words().startswith("recursive digital low-pass of second order, 0.079") and model.slow_filtered
    assert model["B"].low <= 0.15 <= model["B"].high and model["N"].low <= 1.0 <= model["N"].high


@pytest.mark.long
def test_white_noise_through_two_means() -> None:
    """A Bartlett window over four and four samples: smooth roll-offs in its place left N = 1 at 0.89 to 0.98."""
    white = np.random.default_rng([45, 1]).normal(size=10_008)
    model = fit_noise(np.convolve(white, np.convolve(np.ones(4), np.ones(4)) / 16.0)[8:-8], 1.0, means=False)
    assert model.filter_words().startswith("two means over 4 samples") and model["N"].low <= 1.0 <= model["N"].high


@pytest.mark.long
def test_a_mean_of_five_after_a_low_pass() -> None:
    """A logger that takes running means of a sensor with a low-pass of its own, N = 1: before, N was 0.79 (0.78 to
    0.81), with a step near an end, or below 0.33 with ten bands; and the least deviation was that of a sample.  Seed 7:
    two means over five after a smooth shape were found, N 0.863 to 0.959.
    """
    a = math.exp(-1.0 / 0.56)
    for seed in (3, 7):
        x = lfilter([1.0 - a], [1.0, -a], np.random.default_rng([31, seed]).normal(size=8504))[500:]
        model = fit_noise(np.convolve(x, np.full(5, 0.2), "valid"), 1.0, means=False)
        assert model.agrees and model["N"].determined and model["N"].low < 1.0 < model["N"].high < 1.1
        assert model.filter_words().startswith("mean over 5") and not model.steps and not model.peaks()
        assert model.minimum.tau.value > 100.0
