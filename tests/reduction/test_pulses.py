"""Pulses of the rate: turns of the instrument that no sample shows.  [DRIFT-NOISE-MODEL]"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import fft

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.noise_model.rate_pulses import MOST, pulse
from gyrobench.reduction.series.channel_units import units_of
from systems.drift_record.noise_tables import jumps_text, pulses_text

N, Q, SAMPLES = 0.3, 1.0, 19_200


def record(seed: int, turns: dict[int, float]) -> Array:
    """Return white and angle noise with turns by an angle, each over 60 samples."""
    rng = np.random.default_rng([31, seed])
    x = N * rng.normal(size=SAMPLES) + np.diff(Q * rng.normal(size=SAMPLES + 1))
    for at, angle in turns.items():
        x[at : at + 60] += angle / 60.0
    return x


@pytest.mark.parametrize("q2", [0.0, 3.0])
def test_a_pulse_is_generalized_least_squares_beside_a_ramp(q2: float) -> None:
    n = 400
    omega = np.pi * np.arange(1, n + 1) / n
    S = 1.0 + 4.0 * omega**2 + 0.01 / omega**2
    x = fft.idct(np.sqrt(S) * np.random.default_rng(0).normal(size=n), norm="ortho")
    x[100:116] += 2.0
    found, ratio = pulse(x, S, q2)
    assert (found.width, abs(found.at - 100) <= 2) == (16, True)
    k = np.arange(n)
    ends = [np.where((k % 2 == odd) & (k > 0), math.sqrt(2.0 / n) * np.cos(0.5 * np.pi * k / n), 0.0) for odd in (1, 0)]
    covariance = np.diag(S) + sum(2.0 * q2 * np.outer(u, u) for u in ends)
    weight = np.linalg.inv(covariance[1:, 1:])
    A = fft.dct(np.array([found.curve(n) / found.size, k / n]), norm="ortho")[:, 1:].T
    inverse = np.linalg.inv(A.T @ weight @ A)
    size = (inverse @ A.T @ weight @ fft.dct(x, norm="ortho")[1:])[0]
    assert found.size == pytest.approx(size, rel=1e-9) and found.u == pytest.approx(inverse[0, 0] ** 0.5, rel=1e-9)
    assert ratio == pytest.approx(size**2 / inverse[0, 0], rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_turns_that_no_sample_shows_are_no_random_walk(seed: int) -> None:
    """Two turns by 30, a third of a sample's rms over 60 samples: N^2 is 0.09, 2 30^2/19200 = 0.094."""
    model = fit_noise(record(seed, {700: 30.0, 9_000: -30.0}), 1.0, means=False)
    assert model["N"].low <= N <= model["N"].high and model["N"].high < 0.35
    assert [abs(p[0] - at) < 60 for p, at in zip(sorted(model.pulses), (700, 9_000), strict=True)] == [True, True]
    for (_, _, angle, u), true in zip(sorted(model.pulses), (30.0, -30.0), strict=True):
        assert abs(angle - true) < 4.0 * u + 6.0  # the rectangle is not as long as the turn
    said = pulses_text(model, np.arange(SAMPLES), units_of("rad/s"))
    assert said.startswith("Pulses of ") and "″ at 9000 s, within 64 s, which no noise" in said


def test_noise_has_none() -> None:
    assert [fit_noise(record(seed, {}), 1.0, means=False).pulses for seed in range(3, 7)] == [[]] * 4


@pytest.mark.long
def test_more_of_them_than_can_be_taken_out_are_noise() -> None:
    """Thirty bumps of three rms of a sample, 40 samples each: none is taken out, a process stands for them.  It falls
    as omega^-2, they as omega^-6: white noise that a filter makes rise mends that, and its N of 0.5 is nowhere
    seen: the interval reaches to what is seen.
    """
    rng = np.random.default_rng([77, 3])
    x = rng.normal(size=20_000)
    for at in rng.choice(19_900, 30, replace=False):
        x[at : at + 40] += 3.0 * np.hanning(40)
    model = fit_noise(x, 1.0, means=False)
    assert model.treatment.jumps and not model.treatment.changes
    assert model["N"].low <= 1.0 <= model["N"].high
    assert jumps_text(model).startswith(f"The level jumps {MOST} times or more")


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_a_random_telegraph_is_a_process(seed: int) -> None:
    """0 and 2 in turn, each for 500 samples on average, in white noise of 1: autocovariance exp(-2 t/500), so a process
    of 1 and 250 samples.  With ten steps or pulses taken out of it tau was 1.4 times as long.
    """
    rng = np.random.default_rng([6, seed])
    x = rng.normal(size=40_000) + 2.0 * (np.cumsum(rng.random(40_000) < 1.0 / 500.0) % 2)
    model = fit_noise(x, 1.0, means=False)
    (found,) = model.processes
    assert model.agrees and not model.treatment.changes
    assert found.tau.low <= 250.0 <= found.tau.high and found.sigma.low <= 1.0 <= found.sigma.high
    assert model["N"].low <= 1.0 <= model["N"].high and not any(model[n].determined for n in "BKRQ")
