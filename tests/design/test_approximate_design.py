"""Approximate designs: known optima come out, and the bound holds for whatever shares there are."""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench.design.approximate_design import CRITERIA, SingularDesignError, approximate_design, evaluate


def information(X: np.ndarray) -> np.ndarray:
    return np.einsum("mi,mj->mij", X, X)


def harmonics(t: np.ndarray, order: int) -> np.ndarray:
    return np.column_stack([np.ones_like(t), *(f(k * t) for k in range(1, order + 1) for f in (np.cos, np.sin))])


@pytest.mark.parametrize("criterion", CRITERIA)
def test_harmonic_regression_is_best_at_equal_spacing(criterion: str) -> None:
    """M = diag(1, 1/2, ...): variances 1 and 2, det(M^-1)^(1/7) = 2^(6/7).  [Pukelsheim 1993, section 9.16]"""
    found = approximate_design(information(harmonics(np.arange(24) * 2 * np.pi / 24, 3)), np.eye(7), criterion)
    expected = {"minimax": 2.0, "A": 13.0, "D": 2.0 ** (6.0 / 7.0)}[criterion]
    assert found.value == pytest.approx(expected, rel=1e-9)
    assert found.efficiency == pytest.approx(1.0, abs=2e-4)
    if criterion != "minimax":  # of minimax the constant may be worse
        assert found.shares == pytest.approx(np.full(24, 1 / 24), abs=1e-9)


def test_unequal_candidates_give_equal_spacing() -> None:
    """48 angles at random and 8 equally spaced: the D-optimum of order 2 is 2^(4/5), that of equal spacing."""
    t = np.concatenate([np.random.default_rng(1).uniform(0, 2 * np.pi, 48), np.arange(8) * np.pi / 4 + 0.1])
    found = approximate_design(information(harmonics(t, 2)), np.eye(5), "D", rounds=5000)
    assert found.value == pytest.approx(2.0**0.8, rel=1e-3) and found.efficiency > 0.999


def test_quadratic_regression_on_an_interval() -> None:
    """D: a third each at -1, 0, 1, det M = 4/27.  A: 1/4, 1/2, 1/4, trace 8.  Slope alone: half each at -1 and 1."""
    x = np.linspace(-1.0, 1.0, 21)
    M = information(np.column_stack([np.ones(21), x, x * x]))
    D, A = (approximate_design(M, np.eye(3), c, rounds=5000) for c in ("D", "A"))
    assert D.value == pytest.approx((27.0 / 4.0) ** (1.0 / 3.0), rel=2e-4)
    assert D.shares[[0, 10, 20]] == pytest.approx([1 / 3] * 3, abs=0.01)
    assert A.value == pytest.approx(8.0, rel=1e-3) and A.shares[[0, 10, 20]] == pytest.approx(
        [0.25, 0.5, 0.25], abs=0.01
    )
    slope = approximate_design(M, np.array([[0.0, 1.0, 0.0]]), "minimax")
    assert slope.value == pytest.approx(1.0, rel=1e-3) and slope.shares[[0, 20]].sum() > 0.98


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.long
def test_no_shares_are_better_than_the_bound(criterion: str) -> None:
    rng = np.random.default_rng(7)
    X, wanted = rng.normal(size=(12, 4)), rng.normal(size=(3, 4))
    found = approximate_design(
        information(X), wanted, criterion, rounds=30
    )  # not converged: the bound holds all the same
    for shares in rng.dirichlet(np.full(12, 0.5), 2000):
        try:
            phi, _, v = evaluate(information(X), wanted, shares, criterion)
        except SingularDesignError:
            continue
        assert (v.max() if criterion == "minimax" else phi) >= found.bound * (1.0 - 1e-9)


def test_what_is_not_determined_is_refused() -> None:
    X = np.column_stack([np.ones(5), np.ones(5)])
    with pytest.raises(SingularDesignError):
        approximate_design(information(X), np.eye(2))
    assert approximate_design(information(X), np.array([[1.0, 1.0]])).value == pytest.approx(1.0)
