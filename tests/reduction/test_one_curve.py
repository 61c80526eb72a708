"""A drift that is a smooth curve falls faster with frequency than a walk: that is told from walks; a bend from none."""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench.reduction.noise_model.fit import fit_noise


@pytest.mark.long
def test_a_polynomial_is_no_random_walk() -> None:
    """White noise of 1 and a curve of Legendre polynomials to the fifth: K is stated, 0.0047 to 0.0072, though no walk
    is there; of a curve without a jump the powers fall as the fourth power of frequency, of a walk as the second.
    """
    n, rng = 20_000, np.random.default_rng([78, 4])
    white = rng.normal(size=n)
    curve = 1.5 * np.polynomial.legendre.legval(2.0 * np.arange(n) / n - 1.0, np.append([0.0, 0.0], rng.normal(size=4)))
    model = fit_noise(white + curve, 1.0, means=False)
    assert model["K"].determined and model.chances["steep"] < 0.005


@pytest.mark.long
def test_a_random_walk_is_no_curve() -> None:
    """0.03, below which it is said, is rare: of 16 records two or more in 0.08."""
    n, said = 10_000, 0
    for seed in range(8):
        for K in (0.01, 0.1):
            rng = np.random.default_rng([80, seed])
            x = rng.normal(size=n) + np.cumsum(K * rng.normal(size=n))
            said += fit_noise(x, 1.0, means=False).chances["steep"] < 0.03
    assert said <= 1


def test_white_noise_has_no_slow_drift() -> None:
    x = np.random.default_rng([80, 1]).normal(size=2000)
    assert fit_noise(x, 1.0, means=False).chances["steep"] == 1.0
