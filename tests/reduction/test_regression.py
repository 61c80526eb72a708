"""Least squares against hand results and numpy; identifiability in names."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gyrobench import drift
from gyrobench.reduction.estimation import regression as R

rng = np.random.default_rng(11)


def test_line_by_hand() -> None:
    """y = 0, 1, 1 at x = 0, 1, 2: a = 1/6, b = 1/2, residual sum 1/6, s^2 = 1/6 with one degree of freedom."""
    X = np.array([[1.0, 0], [1, 1], [1, 2]])
    f = R.least_squares(X, np.array([0.0, 1, 1]), ("a", "b"))
    assert f.beta == pytest.approx([1 / 6, 1 / 2])
    assert f.s**2 == pytest.approx(1 / 6) and f.dof == 1
    assert f.covariance == pytest.approx(np.array([[5 / 36, -1 / 12], [-1 / 12, 1 / 12]]))
    assert f.t == pytest.approx(f.beta / f.u)
    assert f.p[1] == pytest.approx(2 / math.pi * math.atan(1 / f.t[1]))  # t with one degree of freedom is Cauchy
    assert f.half_width()[1] == pytest.approx(12.7062 * f.u[1], rel=1e-5)
    assert R.correlation(f.covariance)[0, 1] == pytest.approx(-math.sqrt(3 / 5))
    np.testing.assert_allclose(f.gain @ X, np.eye(2), atol=1e-14)


def test_weights_and_covariance_agree() -> None:
    """[RED-OLS] variances 1, 1, 1, 25: the mean has variance 1.75 by ordinary, 0.329 by weighted least squares."""
    X, v = np.ones((4, 1)), np.array([1.0, 1, 1, 25])
    y = rng.normal(size=4)
    plain, weighted = R.least_squares(X, y, ("m",)), R.least_squares(X, y, ("m",), 1 / v)
    assert (plain.gain**2 @ v)[0] == pytest.approx(1.75)
    assert (weighted.gain**2 @ v)[0] == pytest.approx(0.329, abs=1e-3)
    assert weighted.beta[0] == pytest.approx(np.sum(y / v) / np.sum(1 / v))
    # s^2 (X' w X)^-1, s^2 = v' w v/3
    assert weighted.u[0] ** 2 == pytest.approx(np.sum((y - weighted.beta[0]) ** 2 / v) / 3 / np.sum(1 / v))


def test_mean_in_equal_correlation() -> None:
    """[RED-GLS] var(mean) = s^2 (1/N + (N-1) rho/N)."""
    C = 0.3 + 0.7 * np.eye(10)
    f = R.least_squares(np.ones((10, 1)), np.arange(10.0), ("m",))  # equal correlation leaves the weights equal
    assert (f.gain @ C @ f.gain.T)[0, 0] == pytest.approx(0.1 + 0.9 * 0.3)


def test_lost_combinations_are_named() -> None:
    """At |g| = 1: X2 + Y2 + Z2 = 1, rank 9 of 10 whatever the attitudes.  [RANK-1g]"""
    xyz = rng.normal(size=(60, 3))
    xyz /= np.linalg.norm(xyz, axis=1)[:, None]
    d = R.examine(drift.regressors(xyz), drift.NAMES)
    assert d.rank == 9 and math.isinf(d.condition) and len(d.lost) == 1
    terms = d.lost[0].replace("+ ", "").replace("− ", "−").split(" ")
    assert sorted(t.lstrip("−") for t in terms) == ["D_F", "D_II", "D_OO", "D_SS"]
    assert ("−D_F" in terms) != any(t in terms for t in ("−D_II", "−D_OO", "−D_SS"))
    assert R.examine(drift.regressors(1.2 * xyz), drift.NAMES).lost[0].count("0.694") in (1, 3)  # 1/1.2^2
    nine = R.examine(drift.regressors(xyz, drift.terms(9)), drift.terms(9))
    assert nine.rank == 9 and nine.lost == () and nine.condition < 20


def test_two_separate_losses_are_two_short_sentences() -> None:
    a, b = rng.normal(size=20), rng.normal(size=20)
    d = R.examine(np.column_stack([a, 2 * a, b, np.zeros(20), b]), ("p", "q", "r", "zero", "s"))
    assert d.rank == 2
    assert sorted(d.lost) == sorted(["p − 0.5 q", "r − s", "zero"]) or len(d.lost) == 3
    joined = " ".join(d.lost)
    assert all(n in joined for n in ("p", "q", "r", "s", "zero"))


def test_condition_does_not_depend_on_units() -> None:
    X = rng.normal(size=(20, 3))
    a, b = R.examine(X, tuple("abc")), R.examine(X * [1.0, 1e3, 1e-6], tuple("abc"))
    assert a.condition == pytest.approx(b.condition) and b.rank == 3


def test_refusals() -> None:
    X, y = np.ones((5, 1)), np.arange(5.0)
    two = np.column_stack([np.ones(5), np.ones(5)])
    cases = [
        (lambda: R.least_squares(X, y[:4], ("a",)), "do not go with"),
        (lambda: R.least_squares(X[:1], y[:1], ("a",)), "at least 2 are needed"),
        (lambda: R.least_squares(X, np.r_[y[:4], np.inf], ("a",)), "non-finite"),
        (lambda: R.least_squares(two, y, ("a", "b")), "rank 1 for 2 coefficients; not estimable: . − ."),
        (lambda: R.least_squares(X, y, ("a",), np.zeros(5)), "weights must be finite and positive"),
        (
            lambda: R.check_data(np.vander(np.linspace(1, 1.01, 9), 3), np.zeros(9), tuple("abc")),
            "condition number .* least determined",
        ),
    ]
    for call, text in cases:
        with pytest.raises(R.RegressionError, match=text):
            call()
