"""Errors of known size in the covariance of the data: dense generalized least squares, budgets, intervals that hold."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from finding import effect
from scipy import optimize

from gyrobench import units
from gyrobench.reduction.estimation import noise, noise_mixture_fit, outliers
from gyrobench.reduction.estimation.effects import standard_changes, with_set_up
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.setup.run_metadata import Remount
from gyrobench.reduction.setup.setups import Setup
from gyrobench.reduction.setup.sources import Effect, Source

DPH = units.factor("deg/h")
N = 120
T0 = 10.0 * np.arange(N)
ANGLE = 2.0 * np.pi * np.arange(N) / 40.0
X = np.column_stack([np.ones(N), np.cos(ANGLE)])
HALVES = np.array([np.arange(N) < 60, np.arange(N) >= 60]).astype(float)  # one constant of each mount


def test_the_size_of_a_source_is_what_its_option_states() -> None:
    """Of any set-up, without a field of its own; a mapping of options and a number do as well."""
    source = Source("mount.flip", "flip of the mount", "rad", "u_flip")
    for stated in (Setup(sizes={"u_flip": 2e-5, "u_other": 1.0}), {"u_flip": 2e-5}, 2e-5):
        assert source.effect(stated).size == 2e-5
    assert source.effect(Setup()).size == 0.0


def line(y: Any) -> Findings:
    wanted = [Quantity.of("a", "constant", "deg/h"), Quantity.of("b", "cosine", "deg/h")]
    return fit(wanted, X, DPH * y, T0, T0 + 10.0, [], "rate", "°/h", DPH)


def combined(found: Findings, effects: list[Effect]) -> tuple[Any, Any, Any]:
    """Type B, u and half width of the values, deg/h."""
    b2 = np.sum([np.sum(standard_changes(found, e) ** 2, axis=0) for e in effects], axis=0)
    u, half = np.sqrt(found.u**2 + b2), np.sqrt(found.reported.half_width**2 + NORMAL**2 * b2)
    return np.sqrt(b2) / DPH, u / DPH, half / DPH


@pytest.mark.parametrize("model", [(10.0, 0.0, 0.0), (60.0, 0.9, 0.0), (60.0, 0.5, 0.4), (300.0, 1.0, 0.0)])
def test_of_one_noise_model_it_is_dense_generalized_least_squares(
    monkeypatch: pytest.MonkeyPatch, model: tuple[float, float, float]
) -> None:
    """V = s^2 R + E E' of 120 x 120, s where the restricted likelihood of V is greatest, found without derivatives."""
    grid = noise.NoiseGrid(*(np.array([v]) for v in (*model[:2], 1.0, model[2])))
    monkeypatch.setattr(noise, "noise_grid", lambda *_: grid)
    W = noise.whiten(T0, T0 + 10.0, np.eye(N), grid.tau, grid.share, grid.reading)[0][:, 0, :]
    R, rng = np.linalg.inv(W.T @ W), np.random.default_rng(3)
    E = np.vstack([3.0 * np.sin(ANGLE) + 2.0 * np.cos(ANGLE), 5.0 * HALVES])
    y = X @ [1.0, 2.0] + rng.normal(size=3) @ E + 0.7 * np.linalg.cholesky(R) @ rng.normal(size=N)
    found = noise_mixture_fit.fit(X, y, ["a", "b"], T0, T0 + 10.0, 1e3, model[2] > 0.0, (), E)

    def dense(log_s: float) -> tuple[float, Any, Any]:
        inverse = np.linalg.inv(math.exp(2.0 * log_s) * R + E.T @ E)
        C = np.linalg.inv(X.T @ inverse @ X)
        v = y - X @ (C @ X.T @ inverse @ y)
        logs = -np.linalg.slogdet(inverse)[1] - np.linalg.slogdet(C)[1]
        return 0.5 * float(logs + v @ inverse @ v), C, C @ X.T @ inverse

    s = optimize.minimize_scalar(lambda x: dense(x)[0], bounds=(-3.0, 3.0), method="bounded", options={"xatol": 1e-10})
    _, C, gain = dense(s.x)
    assert found.likeliest.variance[0] == pytest.approx(math.exp(2.0 * s.x), rel=1e-6)
    np.testing.assert_allclose(found.gain, gain, atol=1e-8)
    np.testing.assert_allclose(found.beta, gain @ y, rtol=1e-8)
    b2 = np.sum((gain @ E.T) ** 2, axis=1)
    # type A and B make the covariance of generalized least squares, up to s: that of the residuals is within 3 % of
    # that of the greatest likelihood, as large or small as the three errors were drawn
    assert np.sqrt(found.u**2 + b2) == pytest.approx(np.sqrt(np.diag(C)), rel=0.03)
    whole = np.sqrt(found.half_width**2 + NORMAL**2 * b2)
    assert whole[0] == pytest.approx(NORMAL * math.sqrt(C[0, 0]), rel=1e-3)  # nearly all of it is known
    assert np.var(found.likeliest.whitened) == pytest.approx(1.0, abs=0.15)


def test_constants_of_two_mounts_are_counted_once() -> None:
    """Two mounts alike, constants of t = 0.1 deg/h, white noise of 0.01 deg/h: the constant is the mean of all data,
    u_B = t/sqrt(2), and u_A is that of the noise, 0.01/sqrt(120): the step between the mounts is not drift.  Without
    the statement it is, and type A is fifty times as large.
    """
    y = X @ [0.3, -0.2] + np.array([0.1, -0.1]) @ HALVES + 0.01 * np.random.default_rng(1).normal(size=N)
    step = [effect("constant", 0.1 * DPH, "rad/s", HALVES)]
    plain = line(y)
    found = with_set_up(plain, lambda _: step)
    b, u, half = combined(found, step)
    assert b[0] == pytest.approx(0.1 / math.sqrt(2.0), rel=0.01)
    assert found.u[0] < 0.03 * plain.u[0]
    assert u[0] == pytest.approx(b[0], rel=0.01) and half[0] == pytest.approx(NORMAL * b[0], rel=0.02)
    assert found.u[1] / DPH == pytest.approx(0.01 / math.sqrt(60.0), rel=0.35)  # the cosine is not of the mounts
    assert np.linalg.norm(found.est.residual - found.est.likeliest.set_up) < 0.15 * np.linalg.norm(found.est.residual)
    assert outliers.find(found) is None and not found.warnings()


def test_what_is_stated_too_small_to_see_changes_nothing() -> None:
    y = X @ [0.3, -0.2] + 0.01 * np.random.default_rng(1).normal(size=N)
    faint = [effect("constant", 1e-9 * DPH, "rad/s", HALVES)]
    found, plain = with_set_up(line(y), lambda _: faint), line(y)
    np.testing.assert_array_equal(found.value, plain.value)
    np.testing.assert_array_equal(found.reported.half_width, plain.reported.half_width)
    assert with_set_up(plain, lambda _: [], remount=Remount()) is plain


def test_test_of_the_residuals_knows_what_is_stated() -> None:
    """Sine of an encoder that is stated: an F test of the sine finds it in a fit without the statement only."""
    y = X @ [0.3, -0.2] + 0.05 * np.sin(ANGLE) + 0.01 * np.random.default_rng(2).normal(size=N)
    sine = [effect("angle error", 0.05 * DPH, "rad", np.sin(ANGLE))]
    p = []
    for found in (line(y), with_set_up(line(y), lambda _: sine)):
        found.f_test("sine", "sine", np.sin(ANGLE)[:, None], "what", "there", "not there")
        p.append(next(t.p for t in found.tests if t.name == "sine"))
    assert p[0] < 1e-6 and p[1] > 0.05


@pytest.mark.long
def test_intervals_hold_where_the_errors_are_of_the_stated_size() -> None:
    """100 records: sine and cosine of an encoder and constants of two mounts, white noise; 0.95 +- 0.022.  Counted
    twice, as noise and as type B, the constant was held by 0.990.
    """
    rng = np.random.default_rng(5)
    encoder = np.array([np.sin(ANGLE), np.cos(ANGLE) * HALVES[0]])
    stated = [effect("encoder", 0.03 * DPH, "rad", encoder), effect("constant", 0.03 * DPH, "rad/s", HALVES)]
    held = np.zeros(2)
    for _ in range(100):
        y = X @ [0.3, -0.2] + 0.03 * (rng.normal(size=2) @ encoder + rng.normal(size=2) @ HALVES)
        found = with_set_up(line(y + 0.01 * rng.normal(size=N)), lambda _: stated)
        held += np.abs(found.value / DPH - [0.3, -0.2]) <= combined(found, stated)[2]
    assert np.all(held >= 91) and np.all(held <= 98)


def test_an_error_relative_to_the_reading_stays_outside() -> None:
    """A scale factor stated to 20 %: its error is the drift itself with its noise, and a covariance with it would find
    the factor in that noise and move the constant.  The estimates are those without it.
    """
    y = X @ [0.3, -0.2] + 0.01 * np.random.default_rng(1).normal(size=N)
    plain = line(y)
    found = with_set_up(plain, lambda _: [effect("scale factor", 0.2, "1", -DPH * y)])
    np.testing.assert_array_equal(found.value, plain.value)


@pytest.mark.parametrize("size", [1.0, 1e3, 1e6, 1e9])
def test_errors_far_above_the_noise_leave_estimate_and_type_a_alone(size: float) -> None:
    """A constant error of 1 to 1e9 times the noise, which looks like the constant: the gain still adds up to one, the
    estimate is that without, type A that of the noise.  (With the square of 1e6 times it the gain lost 0.5 %,
    and type A was that of rounding.)
    """
    y = X @ [0.3, -0.2] + 1e-6 * np.random.default_rng(4).normal(size=N)
    plain = line(y)
    stated = [effect("constant", size * 1e-6 * DPH, "rad/s", np.ones(N))]
    found = with_set_up(plain, lambda _: stated)
    np.testing.assert_allclose(found.gain @ X, np.eye(2), atol=1e-6)
    np.testing.assert_allclose(found.value, plain.value, atol=0.1 * plain.u.min())
    np.testing.assert_allclose(found.u, plain.u, rtol=0.02)  # its own part is taken out by the likeliest noise alone
    np.testing.assert_allclose(found.reported.half_width, plain.reported.half_width, rtol=0.1)
