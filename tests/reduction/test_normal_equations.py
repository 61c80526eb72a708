"""Normal equations with the common columns eliminated, against those of all columns solved at once."""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench.reduction.estimation.normal_equations import NormalEquations


def moments(rng: np.random.Generator, models: int, c: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """X'X, X'y and y'y of 40 windows made white otherwise in each model."""
    Z = rng.standard_normal((models, 40, c + 1)) * rng.uniform(0.1, 10.0, (1, 1, c + 1))
    M = Z.transpose(0, 2, 1) @ Z
    return M[:, :-1, :-1], M[:, :-1, -1], M[:, -1, -1]


@pytest.mark.parametrize("extra", [[], [0], [3, 1], [0, 1, 2, 3]])
def test_every_choice_of_columns_is_that_of_all_columns_at_once(extra: list[int]) -> None:
    """Solution, what it leaves of y'y, determinant and inverse of (A + D), D on the chosen columns alone."""
    rng = np.random.default_rng(len(extra))
    A, c, yy = moments(rng, 5, 7)
    equations = NormalEquations.of(A, c, yy, 3)
    index = [0, 1, 2, *(3 + e for e in extra)]
    precision = rng.uniform(0.0, 50.0, (5, len(extra)))
    models = np.array([True, False, True, True, False])
    b, rss, logdet = equations.solve(extra, precision)
    inverse = equations.cofactors(extra, precision, models)
    for g in range(5):
        own = A[g][np.ix_(index, index)] + np.diag([0.0, 0.0, 0.0, *precision[g]])
        expected = np.zeros(7)
        expected[index] = np.linalg.solve(own, c[g, index])
        np.testing.assert_allclose(b[g], expected, rtol=1e-10, atol=1e-13)
        assert rss[g] == pytest.approx(yy[g] - c[g] @ expected, rel=1e-11)
        assert logdet[g] == pytest.approx(np.linalg.slogdet(own)[1], rel=1e-12)
    for g, found in zip(np.flatnonzero(models), inverse, strict=True):
        own = A[g][np.ix_(index, index)] + np.diag([0.0, 0.0, 0.0, *precision[g]])
        whole = np.zeros((7, 7))
        whole[np.ix_(index, index)] = np.linalg.inv(own)
        np.testing.assert_allclose(found, whole, rtol=1e-9, atol=1e-14)


def test_columns_that_are_none_are_refused() -> None:
    A, c, yy = moments(np.random.default_rng(1), 2, 4)
    for k in (1, 3):  # among the common ones; among the others
        other = A.copy()
        other[:, k] = other[:, :, k] = 0.0
        with pytest.raises(np.linalg.LinAlgError):
            NormalEquations.of(other, c, yy, 2).solve([0, 1])
