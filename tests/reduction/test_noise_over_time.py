"""Terms of a noise model over the quarters of a record."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from scipy.signal import lfilter

from gyrobench.reduction.noise_model.constancy import changing, over_time
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.noise_model.ordinates import Model
from gyrobench.reduction.noise_model.terms import NoiseTerm
from gyrobench.reduction.noise_model.treatment import treat

WHITE = NoiseTerm("white")


def of(x: np.ndarray, model: Model = (WHITE,), p: tuple[float, ...] = (0.0,)):
    return over_time(treat(x, remove_lines=False, find_wild=False), (model, np.array(p)), False)


def test_a_quarter_of_less_noise_by_hand() -> None:
    """White noise of 0.9 in the first quarter, 1 in the others, 20,000 samples each.

    u of log v is sqrt(2/20,000) = 0.01 in all, the mean of log v is log(0.81)/4, the ratio of rms
    0.9/0.9^(1/4) = 0.9240 and 1/0.9^(1/4) = 1.0267.
    """
    rng = np.random.default_rng(5)
    x = rng.normal(size=80_000) * np.where(np.arange(80_000) < 20_000, 0.9, 1.0)
    (white,) = of(x)
    assert white.u == pytest.approx(0.005 * white.rms, rel=0.01)
    assert np.all(np.abs(white.rms - [0.9240, 1.0267, 1.0267, 1.0267]) < 4.0 * white.u)
    assert changing((white,)) == [white]


@pytest.mark.long
def test_even_noise_does_not_change() -> None:
    """p of white noise beside Gauss-Markov drift, 100 records: even between 0 and 1."""
    p, model = [], (WHITE, NoiseTerm("gauss_markov"))
    for seed in range(100):
        rng = np.random.default_rng(seed)
        drift = lfilter([math.sqrt(1.0 - math.exp(-0.1))], [1.0, -math.exp(-0.05)], rng.normal(size=4096))
        p += [t.p for t in of(rng.normal(size=4096) + drift, model, (0.0, 0.0, math.log(20.0)))]
    assert len(p) == 200 and stats.kstest(p, "uniform").pvalue > 1e-3


def test_a_narrow_band_is_no_change() -> None:
    """A band of tau of 2,000 samples has a power of its own in each quarter of 5,000: it is not judged."""
    rng = np.random.default_rng(2)
    r, omega = math.exp(-1.0 / 2000.0), 1.0
    band = lfilter([math.sqrt(2.0 * (1.0 - r * r))], [1.0, -2.0 * r * math.cos(omega), r * r], rng.normal(size=20_000))
    band /= band.std()
    model = (WHITE, NoiseTerm("resonance"))
    assert [t.term for t in of(rng.normal(size=20_000) + band, model, (0.0, 0.0, math.log(2000.0), 0.0))] == [WHITE]


@pytest.mark.long
def test_it_is_found_with_the_model_of_the_record() -> None:
    x = np.random.default_rng(1).normal(size=8000) * np.where(np.arange(8000) < 2000, 0.8, 1.0)
    (white,) = changing(fit_noise(x, 0.01).over_time)
    assert white.term == WHITE and white.rms[0] < 0.9 < white.rms[1]
    assert not fit_noise(x[:2000], 0.01).over_time  # a quarter of 500 samples says nothing
