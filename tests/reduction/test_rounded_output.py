"""Noise of an output in steps whose filter has zeros: what is there is the rounding, not slow noise."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.noise_model.gap_completion import complete
from gyrobench.reduction.noise_model.ordinates import Ordinates, split
from gyrobench.reduction.noise_model.prior import Prior
from gyrobench.reduction.noise_model.sensor_filters import Grid
from gyrobench.reduction.noise_model.terms import NoiseTerm
from gyrobench.reduction.noise_model.treatment import output_step


def mean_of_two(n: int, step: float, seed: int) -> Array:
    """Return white noise of N = 1 through a mean of two samples, in steps."""
    x = np.convolve(np.random.default_rng(seed).normal(size=n + 1), [0.5, 0.5], "valid")
    return np.asarray(step * np.rint(x / step))


def test_the_step_of_an_output() -> None:
    counts = np.random.default_rng(1).integers(-40, 40, 5000).astype(float)
    assert output_step(0.7 + 0.05 * counts) == pytest.approx(0.05)
    assert output_step(np.append(np.round(counts / 7.0, 4), math.nan)) == pytest.approx(
        1.0 / 7.0, rel=1e-3
    )  # as printed
    assert output_step(0.05 * counts + 0.013 * (counts % 3)) == 0.0
    assert output_step(np.random.default_rng(1).normal(size=5000)) == 0.0
    assert output_step(np.repeat([1.0, 2.0], 100)) == 0.0  # two levels have no step


def test_a_zero_of_a_mean_within_a_bin() -> None:
    """Of a mean of two |H|^2 = cos^2(omega/2), (pi - omega)^2/4 at its zero: over a bin from pi - 2 d to pi the mean is
    d^2/3, four thirds of the d^2/4 in its middle.
    """
    d = 0.005
    term = NoiseTerm("white", "mean2")
    at = np.array([math.pi - d])
    assert term.spectrum(np.zeros(1), Grid(at, half_width=np.array([d])))[0] == pytest.approx(d**2 / 3.0, rel=1e-4)
    assert term.spectrum(np.zeros(1), Grid(at))[0] == pytest.approx(d**2 / 4.0, rel=1e-4)


def test_wild_samples_leave_the_zero_of_a_mean_as_it_is() -> None:
    """What is wild below the limit was read from residuals of which the zero makes 97 % dependent: up to half of the
    rounding was added or taken there.
    """
    x = mean_of_two(100_000, 0.04, 4)
    x[[900, 30_000, 71_000]] += 20.0
    done = complete(x)
    assert done.wild.tolist() == [900, 30_000, 71_000]
    assert abs(done.below) < 0.1 * 0.04**2 / 12.0


def test_rounding_is_readout_noise() -> None:
    """Where the step is known its errors are beside the filter, and no flicker stands for them."""
    step = 0.06
    x = mean_of_two(60_000, step, 3)
    model = fit_noise(x, 1.0, means=False)
    readout = [float(q[0]) for t, q in split(*model.shape) if t.name == "readout"]
    assert readout == pytest.approx([math.log(step**2 / 12.0 / model.scale.size**2)], abs=0.1)
    assert not model["B"].determined
    assert model["N"].low < 1.0 < model["N"].high < 1.02


def test_what_is_known_of_rounding() -> None:
    """A step beyond what the spectrum has anywhere is of a counter that carries its remainder: nothing is known then,
    nor where the errors are far below what shows.
    """
    x = mean_of_two(20_000, 0.06, 5)
    for step, known in ((0.06, True), (0.3, False), (1e-4, False)):
        prior = Prior(Ordinates([x], rounding=step**2 / 12.0))
        assert (prior.rounding is not None) == known
        filtered = prior.log((NoiseTerm("white", "mean2"),), np.zeros((1, 1)))[0]
        plain = prior.log((NoiseTerm("white"),), np.zeros((1, 1)))[0]
        assert filtered - plain == pytest.approx(math.log(0.05) if known else 0.0)
