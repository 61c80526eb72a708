"""Spectra that several models have, or nearly: which one is named, and what is not stated.  [DRIFT-NOISE-MODEL]"""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.filter_starts import FIRST, GM, N, Q
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.noise_model.maximum import volume
from gyrobench.reduction.noise_model.prior import Prior
from gyrobench.reduction.noise_model.search import ModelSearch
from gyrobench.reduction.noise_model.terms import NoiseTerm
from gyrobench.reduction.noise_model.treatment import treat

COVERAGE = Path(__file__).parents[1] / "benchmarks" / "noise_model_coverage.py"


def process(n: int, sigma: float, tau: float, rng: np.random.Generator) -> Array:
    """Return a Gauss-Markov process (n,)."""
    a = math.exp(-1.0 / tau)
    return np.asarray(lfilter([sigma * math.sqrt(1.0 - a * a)], [1.0, -a], rng.normal(size=n + 5000))[5000:])


@pytest.mark.parametrize("seed", range(3))
def test_a_mean_whose_zeros_a_process_fills(seed: int) -> None:
    """White noise behind a mean of eight samples and a process of 19: a low-pass of 16 samples stood for both, with N
    of 5 instead of 1.
    """
    rng = np.random.default_rng([6, seed])
    white = np.convolve(rng.normal(size=10_007), np.full(8, 0.125), "valid")
    model = fit_noise(white + process(10_000, 0.898, 19.0, rng), 1.0, means=False)
    assert model.filter_words() == "mean over 8 samples" and 0.9 < model["N"].value < 1.1
    (found,) = model.processes
    assert found.tau.determined and found.tau.low <= 19.0 <= found.tau.high


@pytest.mark.parametrize("seed", range(3))
def test_a_process_beside_white_noise_is_no_low_pass(seed: int) -> None:
    """N = 1 and 5 over 15 samples: white noise of 27 (2 sigma^2 tau = 27^2) behind a low-pass of 15 samples and readout
    noise of 1 have that spectrum too, and N was stated as 27.
    """
    rng = np.random.default_rng([7, seed])
    model = fit_noise(rng.normal(size=15_000) + process(15_000, 5.0, 15.0, rng), 1.0, means=False)
    assert model.filter_words() == "" and model["N"].low <= 1.0 and 0.8 < model["N"].value < 1.2
    (found,) = model.processes
    assert found.tau.value == pytest.approx(15.0, rel=0.2) and found.sigma.value == pytest.approx(5.0, rel=0.1)


@pytest.mark.parametrize("seed", [97, 100])
def test_flicker_that_two_processes_may_be(seed: int) -> None:
    """Processes of 46 and 829 samples; of 124 and 1,994 with less flicker: one term is likelier than two, which fit as
    well.  B was stated as 0.13 to 0.19 (none is there) and 0.12 to 0.24 (0.036).
    """
    spec = importlib.util.spec_from_file_location("noise_model_coverage", COVERAGE)
    assert spec is not None and spec.loader is not None
    coverage = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(coverage)
    truth = coverage.drawn(10_000, np.random.default_rng([14, seed]))
    model = fit_noise(
        coverage.simulated(10_000, truth, [], np.random.default_rng([11, seed, 10_000])), 1.0, means=False
    )
    assert not model["B"].determined and model["B"].low <= truth.get("B", 0.0) <= model["B"].high


@pytest.mark.parametrize("tau", [math.inf, 15_000.0])
def test_a_process_slower_than_a_tenth_of_the_record_is_a_walk(tau: float) -> None:
    """K = 0.063 of a walk that meets white noise of 1 at 300 cycles of the record, and sigma^2 = K^2 tau/2 over half of
    it: no K was stated, as the record does not tell one from the other.
    """
    n, K, stated = 30_000, 0.063, 0
    for seed in range(3):
        rng = np.random.default_rng([5, seed])
        drift = np.cumsum(K * rng.normal(size=n)) if math.isinf(tau) else process(n, K * math.sqrt(0.5 * tau), tau, rng)
        found = fit_noise(rng.normal(size=n) + drift, 1.0, means=False)["K"]
        assert found.low <= K <= found.high < 1.3 * K
        stated += found.determined
    assert stated


def test_a_filter_that_leaves_angle_noise_open_is_not_likelier_for_it() -> None:
    """Two terms known to 1/a and 1/d with the filter given: volume 2 pi/(a d), less 2.5 for the filter's parameter,
    however much that one and the angle noise stand for each other.
    """
    model, a, d = (NoiseTerm("white", "first"), Q), 100.0, 50.0
    for b, correlation in ((10.0, 0.0), (10.0, 0.99), (1e3, -0.99)):
        c = correlation * b * d
        information = np.array([[a * a, 0.0, 0.0], [0.0, b * b, c], [0.0, c, d * d]])
        assert volume(model, information) == pytest.approx(math.log(2.0 * math.pi / (a * d)) - 2.5, abs=1e-3)


@pytest.mark.parametrize("seed", [1, 3, 5])
def test_angle_noise_beside_white_noise_that_passed_no_filter(seed: int) -> None:
    """N = 1, Q = 0.5: a roll-off of the white noise is worth a little more of Q.  Models with one had 0.54 to 0.63
    of the posterior, as they leave Q open, and of random truths Q was missed for it.
    """
    rng = np.random.default_rng(seed)
    model = fit_noise(rng.normal(size=30_000) + np.diff(0.5 * rng.normal(size=30_001)), 1.0, means=False)
    assert model["Q"].low <= 0.5 <= model["Q"].high and model.chances["filtered"] < 0.3


def test_every_instrument_has_white_noise() -> None:
    """Angle noise of 1 and a process of 0.1 over 12 samples, without white noise: N^2 = sigma^2 (1 + a)/(1 - a) = 0.24,
    a = exp(-1/12), behind a low-pass of 12 samples has that spectrum, and is called that.  White noise is tried beside
    the process, too.
    """
    rng = np.random.default_rng(4)
    record = np.diff(rng.normal(size=20_001)) + process(20_000, 0.1, 12.0, rng)
    data = treat(record, 0.0, False, False).ordinates(False)
    search = ModelSearch(data, Prior(data))
    without = search.fit((Q, GM), np.array([0.0, math.log(0.01), math.log(12.0)]))
    steps = dict(search.neighbours(without))
    low_pass = search.fit((Q, FIRST), steps[Q, FIRST][0])
    assert low_pass.value == pytest.approx(without.value, abs=0.3)
    assert math.exp(low_pass.p[0]) == pytest.approx(0.24, rel=0.3)
    assert low_pass.evidence > without.evidence + 90.0
    assert (Q, GM, N) in steps
