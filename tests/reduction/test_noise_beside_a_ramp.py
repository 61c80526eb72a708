"""Noise model of a record with a ramp: no term and no step stands in its place."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import fft

from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.noise_model.steps import step_ratios


@pytest.mark.parametrize("rise", [1.0, 30.0])  # over the record, of a noise of 1
def test_a_ramp_is_no_flicker(rise: float) -> None:
    """The standard deviation of the slope over n samples is sqrt(12/n^3), over the record 0.08: both are far above."""
    n = 2000
    for seed in range(5):
        x = np.random.default_rng([31, seed]).normal(size=n) + rise / n * np.arange(n)
        found = fit_noise(x, 1.0)
        assert found.agrees and found.processes == () and not any(found[t].determined for t in "BKQ")
        assert found["N"].low < 1.0 < found["N"].high
        assert found["R"].determined and found["R"].value == pytest.approx(rise / n, abs=4.0 * math.sqrt(12.0 / n**3))


def test_a_step_on_a_ramp_is_one_step() -> None:
    """Of 3 under noise of 1 and a ramp of 30 over the record; it is told to 1/sqrt of the samples beside it."""
    n = 6000
    for seed in range(3):
        x = np.random.default_rng([32, seed]).normal(size=n) + 5e-3 * np.arange(n) + 3.0 * (np.arange(n) >= 2500)
        found = fit_noise(x, 1.0)
        (step,) = found.steps
        assert found.agrees and abs(step.at - 2500) < 5 and step.size == pytest.approx(3.0, abs=4.0 * step.u)
        assert step.u < 0.1 and found["R"].low < 5e-3 < found["R"].high
        assert found.processes == () and not any(found[t].determined for t in "BKQ")


def test_steps_are_weighed_beside_level_and_ramp() -> None:
    """Ratio, size and standard deviation of each step are those of generalized least squares with both."""
    n, rng = 60, np.random.default_rng(4)
    x = rng.normal(size=n)
    k = np.arange(1.0, n)
    S = np.concatenate([[1.0], 0.5 + 1.0 / k])
    C = fft.idct(fft.idct(np.diag(S), axis=0, norm="ortho"), axis=1, norm="ortho")
    P = np.linalg.inv(C)
    ratio, size, sd = step_ratios(x, S)
    for at in (16, 20, 33, 43):
        X = np.column_stack([np.arange(n) >= at, np.ones(n), np.arange(n)]).astype(float)
        cov = np.linalg.inv(X.T @ P @ X)
        beta = cov @ X.T @ P @ x
        found = (beta[0] ** 2 / cov[0, 0], beta[0], math.sqrt(cov[0, 0]))
        assert (ratio[at], size[at], sd[at]) == pytest.approx(found, rel=1e-9)


def test_the_least_deviation_is_as_uncertain_as_the_ramp_that_ends_its_fall() -> None:
    """N^2/tau + R^2 tau^2/2 is least at tau = (N/R)^(2/3), with 3/2 (N^2 R)^(2/3): of an R off by a tenth by 3 %.  Of
    12 intervals of 95 % less than 10 hold it in one case of 50."""
    n, R = 5000, 60.0 / 5000**1.5
    hits = 0
    for seed in range(12):
        found = fit_noise(np.random.default_rng(seed).normal(size=n) + R * np.arange(n), 1.0)
        least = found.minimum.deviation
        assert found.agrees and least.determined
        hits += least.low < math.sqrt(1.5) * R ** (1.0 / 3.0) < least.high
    assert hits >= 10
