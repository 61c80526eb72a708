"""Rates from angles, quantization, harmonics, orthogonal and stepwise regression, smoothing, wavelets of a series."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import pywt
from numpy.polynomial import legendre
from scipy import linalg, signal

from gyrobench.reduction.estimation.regression import RegressionError
from gyrobench.reduction.series import harmonics, quantization, rates, wavelets
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.gauss_markov import GaussMarkov, _Likelihood, settling
from gyrobench.reduction.series.orthogonal import orthogonal_fit, orthonormal
from gyrobench.reduction.series.smoothing import LinearModel, smooth, smooth_drift
from gyrobench.reduction.series.stepwise import eliminate

ARCSEC = math.pi / 648_000


# ------------------------------------------------------------------------------------------------ rates
def test_gain_of_a_mean() -> None:
    """omega dT/2 = 1.7: 0.583332; -3 dB at 0.4429, worst negative value -0.2172; day harmonics."""
    assert rates.gain(1.7 / math.pi, 1.0) == pytest.approx(0.583332, abs=5e-7)
    assert rates.gain(0.4429, 1.0) == pytest.approx(math.sqrt(0.5), abs=1e-4)
    assert rates.gain(np.linspace(1, 2, 2001), 1.0).min() == pytest.approx(-0.2172, abs=1e-4)
    day = 7.292115e-5 / math.pi  # second harmonic of the table angle at earth rate, Hz
    assert 1 - rates.gain(day, 3600.0) == pytest.approx(0.01145, abs=5e-6)
    assert 1 - rates.gain(day, 100.0) == pytest.approx(8.9e-6, abs=5e-8)
    assert rates.gain(4 * 0.6 / (2 * math.pi), 1.0) == pytest.approx(0.776699, abs=5e-7)
    assert rates.corrected_amplitude(0.5, 1.7 / math.pi, 1.0) == pytest.approx(0.5 / 0.583332, rel=1e-5)
    with pytest.raises(SeriesError, match="shorten the interval"):
        rates.corrected_amplitude(1.0, 0.98, 1.0)


def test_rates_belong_to_the_midpoint() -> None:
    """ER2: angle 0.004 t^3, dT = 2: exact error theta''' dT^2/24 = 0.004 at the midpoint."""
    t = np.arange(0.0, 11.0, 2.0)
    found = rates.from_angles(0.004 * t**3, 2.0)
    assert found.t == pytest.approx(t[:-1] + 1.0)
    assert found.rate - 0.012 * found.t**2 == pytest.approx(np.full(5, 0.004), abs=1e-12)


def test_noise_of_rates() -> None:
    """ER1: 0.1 arcsec over 100 s is 0.00141 deg/h; neighbours -1/2; the mean of M has 1/M."""
    rng = np.random.default_rng(1)
    theta = 0.1 * ARCSEC * rng.normal(size=200_001)
    found = rates.from_angles(theta, 100.0, u_angle=0.1 * ARCSEC)
    assert found.u[0] / ARCSEC == pytest.approx(0.00141, abs=1e-5)  # arcsec/s is deg/h
    r = found.rate
    assert r.std() == pytest.approx(found.u[0], rel=0.01) and r[1:] @ r[:-1] / (r @ r) == pytest.approx(-0.5, abs=0.01)
    assert found.u_mean() == pytest.approx(found.u[0] / 200_000)
    over = rates.from_angles(theta, 10.0, 10, overlapping=True)
    o = over.rate
    assert over.lag == 10 and o[10:] @ o[:-10] / (o @ o) == pytest.approx(-0.5, abs=0.02)
    assert abs(o[5:] @ o[:-5] / (o @ o)) < 0.02
    with pytest.raises(SeriesError, match="repeats readings"):
        over.u_mean()


def test_the_shortest_interval_is_not_the_best() -> None:
    """ER4: errors of the rate of sin t with noise: least near sqrt2 s/dT = dT^2/24, not at the shortest interval."""
    rng = np.random.default_rng(13)
    t, s = np.arange(0.0, 2000.0, 0.05), 1e-3
    theta = np.sin(t) + s * rng.normal(size=t.size)
    rms = []
    for n in (1, 8, 40):
        found = rates.from_angles(theta, 0.05, n)
        rms.append(float(np.sqrt(np.mean((found.rate - np.cos(found.t)) ** 2))))
    assert rms[1] < rms[0] / 3 and rms[1] < rms[2] / 3
    assert rms[0] == pytest.approx(math.sqrt(2) * s / 0.05, rel=0.03)
    # the mean of cos over dT is sinc(dT/2) of it
    assert rms[2] == pytest.approx((1 - rates.gain(1 / (2 * math.pi), 2.0)) / math.sqrt(2), rel=0.03)


def test_wrapped_angles_and_fixed_angles() -> None:
    t = np.arange(0.0, 300.0, 0.7)
    wrapped = (0.9 * t + 3.0) % (2 * math.pi)
    assert rates.from_angles(wrapped, 0.7).rate == pytest.approx(np.full(t.size - 1, 0.9), abs=1e-12)
    with pytest.raises(SeriesError, match="number of turns is not certain"):
        rates.from_angles((4.2 * t) % (2 * math.pi), 0.7)
    # rate 1 + 0.2 cos 4 theta over windows of 0.6 rad at equal angles: mean low by 0.8 %
    marks = np.arange(0.0, 2 * math.pi * 30, 0.6)
    fine = np.linspace(0.0, marks[-1], 400_001)
    when = np.interp(marks, fine, np.concatenate([[0.0], np.cumsum(np.diff(fine) / (1 + 0.2 * np.cos(4 * fine[:-1])))]))
    found = rates.fixed_angle(when, 0.6, u_time=1e-4)
    slow, true = 1 / np.mean(1 / found.rate), 1.0
    assert slow / true == pytest.approx(math.sqrt(1 - 0.2**2), rel=2e-3) and found.rate.mean() > slow
    assert found.u[0] == pytest.approx(found.rate[0] * math.sqrt(2) * 1e-4 / (when[1] - when[0]))
    with pytest.raises(SeriesError, match="mark 3 is not later"):
        rates.fixed_angle(np.array([0.0, 1.0, 0.5]), 0.6)


# ------------------------------------------------------------------------------- acquisition
def test_step_of_a_converter_and_its_error() -> None:
    """14 bit over -+5 V: 0.610 mV; noise above half a step makes rounding white; EX9: 5 s behind 720 Hz, 39.5 dB."""
    rng = np.random.default_rng(2)
    q = 10.0 / 2**14
    for noise, white in ((2.0, True), (0.2, False)):
        x = np.round((0.3 + noise * q * rng.normal(size=20_000)) / q) * q
        found = quantization.quantization(x)
        assert found.step == pytest.approx(q, rel=1e-6) and found.white == white
        assert found.error == pytest.approx(q / math.sqrt(12))
    assert quantization.quantization(rng.normal(size=5000)).step == 0.0
    clipped = np.clip(np.round(rng.normal(size=5000).cumsum()), -20, 20)
    assert quantization.quantization(clipped).saturated > 0.1
    found = quantization.folded(5.0, 720.0)
    assert found.decibels == pytest.approx(39.5, abs=0.05) and found.longest == pytest.approx(0.56e-3, rel=0.01)
    assert quantization.folded(0.4 / 720.0, 720.0).ratio == pytest.approx(1.0)
    with pytest.raises(SeriesError, match="cutoff"):
        quantization.folded(1.0, 0.0)


# ---------------------------------------------------------------------------------- harmonics
@pytest.mark.parametrize("n", [5, 8, 24, 25])
def test_harmonics_of_equal_steps(n: int) -> None:
    """Transform = least squares = sums; b_{n/2} is not reported as 0 (ER5..ER10)."""
    rng = np.random.default_rng(n)
    theta, y = 2 * math.pi * np.arange(n) / n, rng.normal(size=n)
    top = (n - 1) // 2
    found = harmonics.equal_steps(y, top)
    X = np.column_stack([np.ones(n)] + [f(r * theta) for r in range(1, top + 1) for f in (np.cos, np.sin)])
    beta = np.linalg.lstsq(X, y, rcond=None)[0]
    assert found.a == pytest.approx(np.r_[beta[0], beta[1::2]], abs=1e-12)
    assert found.b == pytest.approx(np.r_[0.0, beta[2::2]], abs=1e-12)
    if n % 2 == 0:
        half = harmonics.equal_steps(y, n // 2)
        assert half.a[-1] == pytest.approx(np.mean(y * (-1.0) ** np.arange(n))) and math.isnan(half.b[-1])
    with pytest.raises(SeriesError, match="alias"):
        harmonics.equal_steps(y, n // 2 + 1)


def test_harmonics_at_unequal_angles_amplitude_and_spread() -> None:
    """48 samples at equal times of a rate 1 + 0.2 cos + 0.05 sin 2: sums give 0.9784, least squares 1."""
    theta = [0.0]
    for _ in range(48 * 400):
        rate = 1 + 0.2 * math.cos(theta[-1]) + 0.05 * math.sin(2 * theta[-1])
        theta.append(theta[-1] + rate * 2 * math.pi / 0.9784 / (48 * 400))
    at = np.array(theta[: 48 * 400 : 400])
    y = 1 + 0.2 * np.cos(at) + 0.05 * np.sin(2 * at)
    assert harmonics.equal_steps(y, 2).a[0] == pytest.approx(0.9784, abs=5e-4)
    found = harmonics.over_angle(at, y, 2)
    assert found.a == pytest.approx([1.0, 0.2, 0.0], abs=1e-9) and found.b == pytest.approx([0.0, 0.0, 0.05], abs=1e-9)
    minus = harmonics.over_angle(at, -0.3 * np.cos(at) - 0.4 * np.sin(at), 1)
    assert minus.phase[1] == pytest.approx(-2.4981, abs=5e-5) and minus.amplitude[1] == pytest.approx(0.5)
    turns = np.random.default_rng(3).normal(size=(2000, 4, 24))
    spread = [harmonics.over_turns(y, 1)[1].u_a[1] ** 2 for y in turns]
    assert np.mean(spread) == pytest.approx(2 / 24, rel=0.06)  # ER10: with 1/L it would be 3/4 of it
    with pytest.raises(SeriesError, match="at least 2 turns"):
        harmonics.over_turns(np.zeros(24), 1)


# -------------------------------------------------------------------------------- orthogonal columns
def test_orthonormal_columns_and_conversion() -> None:
    """ER34: Q'Q = 1 even of a Hilbert matrix; R^-1 b is least squares; the printed recursion is not orthogonal."""
    rng = np.random.default_rng(4)
    X, y = np.vander(np.linspace(-1, 1, 40), 6, increasing=True), rng.normal(size=40)
    names = tuple("abcdef")
    Q, R = orthonormal(X, names)
    assert pytest.approx(np.eye(6), abs=1e-14) == Q.T @ Q and np.all(np.diag(R) > 0) and pytest.approx(X) == Q @ R
    found = orthogonal_fit(X, y, names)
    assert found.beta == pytest.approx(np.linalg.lstsq(X, y, rcond=None)[0], abs=1e-12)
    rest = y - X @ found.beta
    assert found.covariance == pytest.approx(rest @ rest / 34 * np.linalg.inv(X.T @ X), rel=1e-9)
    assert found.left[-1] == pytest.approx(rest @ rest) and found.left[0] == pytest.approx(y @ y - found.b[0] ** 2)
    hilbert = linalg.hilbert(8)
    assert orthonormal(hilbert, tuple("abcdefgh"))[0].T @ orthonormal(hilbert, tuple("abcdefgh"))[0] == pytest.approx(
        np.eye(8), abs=1e-13
    )
    with pytest.raises(RegressionError, match="column 'c' is a combination"):
        orthonormal(np.column_stack([X[:, :2], X[:, 0] - 2 * X[:, 1]]), tuple("abc"))
    with pytest.raises(RegressionError, match="weights must not be negative"):
        orthonormal(X, names, -np.ones(40))


def test_exponential_on_legendre_polynomials() -> None:
    """exp on -1..1, six terms: (f, f) - sum a_k^2 = 1.53e-9, by Gauss quadrature as weights."""
    t, w = legendre.leggauss(30)
    found = orthogonal_fit(np.vander(t, 6, increasing=True), np.exp(t), tuple("012345"), w)
    assert found.left[-1] == pytest.approx(1.53e-9, rel=0.01)
    assert found.b[0] == pytest.approx(math.sinh(1.0) * math.sqrt(2.0))  # mean of exp times the length of 1


def test_orthogonal_coefficients_are_independent_and_selection_keeps_its_level() -> None:
    rng = np.random.default_rng(5)
    X, names = np.vander(np.linspace(-1, 1, 40), 6, increasing=True), tuple("abcdef")
    fits = [orthogonal_fit(X, rng.normal(size=40), names) for _ in range(2000)]
    assert np.cov(np.array([f.b for f in fits]).T) == pytest.approx(np.eye(6), abs=0.12)
    assert sum(bool(f.significant(0.05)) for f in fits) / 2000 == pytest.approx(0.05, abs=0.015)


# -------------------------------------------------------------------------------------- elimination
def columns(rng: np.random.Generator, n: int = 96) -> tuple[Any, tuple[str, ...]]:
    return np.column_stack([np.ones(n), rng.normal(size=(n, 8))]), ("1", *(f"x{k}" for k in range(1, 9)))


def test_what_selection_does() -> None:
    """Eight null columns at 5 %: one is kept in 0.337 of records (0.347); two real terms of 0.6 s are both kept in 97
    %. Of what was kept of nothing no ordinary interval holds zero, the wide one does; the full model's covers
    throughout.
    """
    rng = np.random.default_rng(6)
    X, names = columns(rng)
    kept = wrong = wide = full = 0
    runs = 200
    for _ in range(runs):
        found = eliminate(X, rng.normal(size=96), names, 0.05)
        k = np.array([name != "1" for name in found.kept])
        if k.any():
            kept += 1
            wrong += bool(np.all(np.abs(found.fit.beta[k]) > found.fit.half_width()[k]))
            wide += bool(np.all((found.low[k] < 0) & (found.high[k] > 0)))
        full += int(found.full_low[3] <= 0.0 <= found.full_high[3])
    assert kept / runs == pytest.approx(0.34, abs=0.08)
    assert wrong == kept and wide >= 0.97 * kept and 0.91 < full / runs < 0.985
    both = spurious = 0
    truth = np.zeros(9)
    truth[[1, 4]] = 0.6
    for _ in range(120):
        found = eliminate(X, X @ truth + rng.normal(size=96), names, 0.05)
        both += {"x1", "x4"} <= set(found.kept)
        spurious += len(set(found.kept) - {"1", "x1", "x4"})
    assert both / 120 > 0.93 and spurious / 120 == pytest.approx(0.32, abs=0.16)


def test_one_at_a_time_groups_family_and_refusals() -> None:
    """Collinear pair: neither |t| is significant while F is 1e-19; one is removed, the other stays."""
    rng = np.random.default_rng(7)
    x1 = rng.normal(size=40)
    X = np.column_stack([np.ones(40), x1, x1 + 1e-3 * rng.normal(size=40)])
    y = x1 + 0.3 * rng.normal(size=40)
    found = eliminate(X, y, ("1", "p", "q"), 0.05)
    assert np.abs(found.full.t[1:]).max() < 2.0 and found.full.f_test()[1] < 1e-15
    assert len(found.removed) == 1 and len(found.kept) == 2 and "1" in found.kept
    t = 2 * math.pi * np.arange(48) / 48
    turn = np.column_stack([np.ones(48), np.cos(t), np.sin(t), np.cos(2 * t), np.sin(2 * t)])
    names, pairs = ("A0", "A1", "B1", "A2", "B2"), (("A1", "B1"), ("A2", "B2"))
    y = 0.9 * np.cos(t) + 0.3 * rng.normal(size=48)
    found = eliminate(turn, y, names, 0.01, groups=pairs)
    assert found.kept == ("A0", "A1", "B1") and found.removed[0].names == ("A2", "B2")
    cos2 = found.full.beta[3:]
    F = cos2 @ cos2 / 2 / (found.full.s**2 * 2 / 48)
    assert found.removed[0].statistic == pytest.approx(F)
    assert eliminate(turn, y, names, 0.05, family=True).level == pytest.approx(0.05 / 4)
    assert "B2" in eliminate(turn, y, names, 0.01, protected=("B2",)).kept
    correlated = eliminate(turn, y, names, 0.01, covariance=linalg.toeplitz(0.5 ** np.arange(48)))
    assert "A1" in correlated.kept
    with pytest.raises(RegressionError, match="alpha = 0"):
        eliminate(turn, y, names, 0.0)
    with pytest.raises(RegressionError, match="at least 10"):
        eliminate(turn[:9], y[:9], names, 0.05)
    with pytest.raises(RegressionError, match="not estimable"):
        eliminate(np.column_stack([turn, turn[:, 1]]), y, (*names, "again"), 0.05)
    with pytest.raises(RegressionError, match="no column 'C1'"):
        eliminate(turn, y, names, 0.05, protected=("C1",))


# ------------------------------------------------------------------- correlation time of long records
def test_likelihood_of_a_steady_filter_is_that_of_the_tridiagonal_factors() -> None:
    """s < 0: means over the sampling interval.  Values before the filter is steady: r^2k = 1e-18."""
    x = 3.0 + signal.lfilter([1.0], [1.0, -0.95], np.random.default_rng(19).normal(size=19_000))
    found = _Likelihood(x, True)
    for phi, s in ((0.95, 0.0), (0.95, 1.0), (0.5, 30.0), (0.99, 5.0), (0.2, 1e4), (0.97, -0.01)):
        m = settling(phi, s)
        assert 20 * m < x.size
        sums, state = found.exact(phi, s, m)
        assert sums + found.steady(phi, s, m, *state) == pytest.approx(found.exact(phi, s, x.size)[0], rel=1e-10)


def test_likelihood_of_a_long_record_by_a_filter_run_through_it() -> None:
    """Kalman filter sample by sample, 25,000 of them; without its steady state mixed() agrees to the rounding."""
    y = signal.lfilter([1.0], [1.0, -0.95], np.random.default_rng(20).normal(size=25_000))
    phi, s, P, a, b, log, squares = 0.9, 0.7, 1.0, 0.0, 0.0, 0.0, np.zeros(3)
    for reading in y.tolist():
        F = P + s
        v, u = reading - a, 1.0 - b
        log += math.log(F)
        squares += np.array([v * v, u * v, u * u]) / F
        a, b, P = phi * (a + P / F * v), phi * (b + P / F * u), phi * phi * P * s / F + 1.0 - phi * phi
    rest = squares[0] - squares[1] ** 2 / squares[2]
    expected = -0.5 * (log + math.log(squares[2]) + (y.size - 1) * math.log(rest))
    assert _Likelihood(y, True).mixed(phi, s) == pytest.approx((expected, rest / (y.size - 1)), rel=1e-12)


def test_values_until_a_filter_is_steady() -> None:
    # q = 3/4, s = 1: P^2 = 3/4, r = 1/2/(1.866025) = 0.267949, 2 + 41.45/(2 1.316958) = 17.7
    assert settling(0.5, 1.0) == 18
    assert settling(0.9999999, 1e5) > 19_000 and settling(0.9, -0.8) == 0


# ---------------------------------------------------------------------------------------- smoothing
def test_smoother_is_the_dense_estimate() -> None:
    """Random time-varying model, Wbar not zero, 25 readings: states, disturbances and covariances of the estimate of
    all unknowns at once; and the adjoint equation 6-80 with the corrected signs (ER50..ER52).
    """
    rng = np.random.default_rng(8)
    n, k, g, m = 25, 3, 2, 2
    Phi, Gamma, H = rng.normal(size=(n, k, k)) * 0.5, rng.normal(size=(n, k, g)), rng.normal(size=(n, m, k))
    Q, R = (np.array([a @ a.T + 0.1 * np.eye(2) for a in rng.normal(size=(n, 2, 2))]) for _ in range(2))
    x0, P0, Wbar, z = rng.normal(size=k), np.diag([1.0, 2.0, 0.5]), rng.normal(size=(n, g)), rng.normal(size=(n, m))
    found = smooth(z, LinearModel(Phi, Gamma, Q, H, R, x0, P0, Wbar))
    # x_i = G_i u + c_i of u = (x_0, w_0 .. w_{n-1})
    size = k + g * n
    G, rows, mean = np.eye(k, size), [], np.concatenate([x0, Wbar.ravel()])
    for i in range(n):
        rows.append(G)
        G = Phi[i] @ G
        G[:, k + g * i : k + g * (i + 1)] += Gamma[i]
    P = linalg.block_diag(P0, *Q)
    A, noise = np.concatenate([H[i] @ rows[i] for i in range(n)]), linalg.block_diag(*R)
    gain = P @ A.T @ np.linalg.inv(A @ P @ A.T + noise)
    u, cov = mean + gain @ (z.ravel() - A @ mean), P - gain @ A @ P
    assert found.state == pytest.approx(np.array([row @ u for row in rows]), abs=1e-11)
    assert found.covariance == pytest.approx(np.array([row @ cov @ row.T for row in rows]), abs=1e-11)
    assert found.disturbance == pytest.approx(u[k:].reshape(n, g), abs=1e-11)
    blocks = np.array([cov[k + g * i : k + g * (i + 1), k + g * i : k + g * (i + 1)] for i in range(n)])
    assert found.disturbance_covariance == pytest.approx(blocks, abs=1e-11)


def test_smoothed_drift_is_half_as_uncertain_as_filtered() -> None:
    """AR(1), phi = 0.946, signal to noise 1: variance 0.245 filtered, 0.162 smoothed, of rates of 1e-8 rad/s too."""
    rng = np.random.default_rng(9)
    phi, n, unit = 0.946, 4000, 1e-8
    truth = signal.lfilter([math.sqrt(1 - phi**2)], [1.0, -phi], rng.normal(size=n + 200))[200:]
    z = unit * (truth + rng.normal(size=n)) + 3e-7
    z[1000:1010] = np.nan
    drift = GaussMarkov(-1.0 / math.log(phi), 0.0, math.inf, unit, unit, 100.0, n, 1.0)
    level, sd = smooth_drift(z, 1.0, drift, mean=3e-7)
    assert np.mean(((level - 3e-7) / unit - truth) ** 2) == pytest.approx(0.165, abs=0.012)
    assert (sd[500] / unit) ** 2 == pytest.approx(0.162, abs=5e-4) and sd[1005] > 1.5 * sd[500]
    one = np.eye(1)
    model = LinearModel(phi * one, one, (1 - phi**2) * one, one, one, np.zeros(1), one)
    assert float(smooth(z / unit - 30.0, model).filtered_covariance[500, 0, 0]) == pytest.approx(0.245, abs=5e-4)
    with pytest.raises(SeriesError, match="nothing to smooth"):
        smooth_drift(z, 1.0, GaussMarkov(18.0, 0.0, math.inf, unit, 0.0, 100.0, n, 1.0))
    for name, bad in (("R", np.zeros((1, 1))), ("Q", -one), ("Phi", np.eye(2))):
        with pytest.raises(SeriesError, match=f"^{name}"):
            smooth(z, LinearModel(**{**model.__dict__, name: bad}))


# ----------------------------------------------------------------------------------------- wavelets
def test_levels_and_filters_of_the_source() -> None:
    """17158 readings: 11, 9, 11, 10 levels, which is where the 'optimal' levels 11, 9, 9, 10 of the source sit
    (EX29).
    """
    assert [wavelets.highest_level(17_158, w) for w in ("db4", "coif4", "sym4", "bior1.5")] == [11, 9, 11, 10]
    assert [wavelets.level_for(1.0, dt) for dt in (1e-3, 1e-2)] == [6, 3]
    with pytest.raises(SeriesError, match="no level"):
        wavelets.level_for(30.0, 1e-2)
    with pytest.raises(SeriesError, match="available: haar, db4"):
        wavelets.highest_level(100, "db5")


@pytest.mark.parametrize("wavelet", ["db4", "coif4", "sym4", "bior1.5"])
def test_denoising_is_that_of_pywavelets_and_its_error_the_same_for_all(wavelet: str) -> None:
    """sigma 2^(-J/2) over a constant truth; thresholds are standard deviations times sqrt(2 ln n) (EX23, EX29)."""
    x = 0.0083 * np.random.default_rng(10).normal(size=17_158)
    found = wavelets.denoise(x, wavelet, 5)
    c = pywt.wavedec(x, wavelet, level=5)
    sigma = [np.median(np.abs(d)) / 0.6745 for d in c[1:]]
    limit = math.sqrt(2 * math.log(x.size))
    c[1:] = [pywt.threshold(d, s * limit, "soft") for d, s in zip(c[1:], sigma, strict=True)]
    assert found.x == pytest.approx(pywt.waverec(c, wavelet)[: x.size], abs=1e-15)
    assert found.sigma == pytest.approx(sigma[::-1], rel=1e-12)
    scale = 1.0 if wavelet != "bior1.5" else np.std(found.x) / (0.0083 * 2**-2.5)  # not orthogonal: a fifth more
    assert np.std(found.x) == pytest.approx(0.0083 * 2**-2.5 * scale, rel=0.1) and 0.9 < scale < 1.4


def test_error_by_level_is_the_law_and_near_the_source() -> None:
    """db4, levels 4 to 9: within 20 % of 0.0083 x 2^(-J/2), as the column of table 4.3.2 is."""
    printed = [0.002115, 0.001432, 0.001043, 0.0006902, 0.0006124, 0.0003757]
    rng = np.random.default_rng(11)
    for J, value in zip(range(4, 10), printed, strict=True):
        errors = [wavelets.denoise(0.0083 * rng.normal(size=17_158), "db4", J).x.std() for _ in range(6)]
        law = 0.0083 * 2 ** (-J / 2)
        assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(law, rel=0.2) and value == pytest.approx(
            law, rel=0.2
        )


def test_running_sigma_follows_a_change_and_a_signal_limits_the_level() -> None:
    rng = np.random.default_rng(12)
    n = 16_384
    noise = rng.normal(size=n) * np.where(np.arange(n) < n // 2, 1.0, 4.0)
    one, running = (wavelets.denoise(noise, "sym4", 4, window=w) for w in (None, 1024))
    quiet = slice(500, n // 2 - 500)
    loud = slice(n // 2 + 500, n - 500)
    # 4 x 2^(-4/2) = 1 is what the approximation leaves; beyond it, one sigma for all lets the loud half through
    assert running.x[loud].var() - 1.0 < 0.4 * (one.x[loud].var() - 1.0) and running.x[quiet].std() < 0.3
    t = np.arange(60_000) * 1e-3
    sine, w = 0.01 * np.sin(2 * np.pi * t), 1.643e-3 * rng.normal(size=t.size)
    decibels = {}
    for J in (6, 8):
        off = wavelets.denoise(sine + w, "db4", J).x - sine
        decibels[J] = 20 * math.log10(off[3000:-3000].std() / 1.643e-3)
    assert decibels[6] == pytest.approx(-18.4, abs=0.8) and decibels[8] == pytest.approx(-6.1, abs=0.8)
    with pytest.raises(SeriesError, match="1 to 13 are possible"):
        wavelets.denoise(w, "db4", 14)
    with pytest.raises(SeriesError, match="at least 1024"):
        wavelets.denoise(w, "db4", 4, window=100)
    with pytest.raises(SeriesError, match="not a finite number"):
        wavelets.denoise(np.where(t == t[9], np.nan, w))
