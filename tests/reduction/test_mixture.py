"""Half widths of mixtures of t distributions; a reduction that is asked for its residuals alone."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from finding import judged
from scipy import stats
from test_outliers import record

from gyrobench.reduction.estimation import asked
from gyrobench.reduction.estimation.mixture import Mixture


@pytest.mark.parametrize("dof", [1, 4, 30, 300])
@pytest.mark.parametrize("seed", range(5))
def test_a_twentieth_lies_outside(seed: int, dof: int) -> None:
    """By scipy's t distribution, of 20 candidates whose means differ by up to some of their standard deviations."""
    rng = np.random.default_rng(seed)
    w, off, sd = rng.dirichlet(np.ones(20)), rng.normal(size=(20, 3)), 10.0 ** rng.uniform(-0.5, 0.5, (20, 3))
    off -= w @ off
    covariance = np.array([np.diag(s**2) for s in sd])
    half = Mixture(w, off, covariance, dof).spread(np.eye(3))[1]
    outside = w @ (stats.t.sf((half - off) / sd, dof) + stats.t.sf((half + off) / sd, dof))
    assert outside == pytest.approx(0.05, rel=1e-11)


def test_one_candidate_is_a_t_distribution() -> None:
    """Half width of one standard deviation 2 with 7 degrees of freedom: 2 x 2.364624251592785 (97.5 % point)."""
    half = Mixture(np.ones(1), np.zeros((1, 1)), np.full((1, 1, 1), 4.0), 7).spread(np.eye(1))[1]
    assert half[0] == pytest.approx(2.0 * 2.364624251592785, rel=1e-14)


def test_residuals_alone_are_those_of_the_whole_result() -> None:
    """A row that is off is in the whole result, with Allan deviation and spectrum; all else is the same in both."""
    found = record({40: 60.0})
    whole = judged(found)
    with asked.residuals_alone():
        alone = judged(found)
    assert whole.allan and whole.psd and not alone.allan and not alone.psd
    assert any("outside the noise" in w for w in whole.warnings)
    for name in ("coefficients", "tests", "acf", "noise", "dof", "rank", "residual_std", "residual_unit", "withheld"):
        assert getattr(alone, name) == getattr(whole, name), name
    left_out = {"allan", "psd", "tables", "reasons"}
    differ = {f.name for f in dataclasses.fields(whole) if getattr(alone, f.name) != getattr(whole, f.name)}
    assert differ == left_out
    assert judged(found).allan == whole.allan  # afterwards all is asked for again
