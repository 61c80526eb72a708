"""The estimators one by one: equations, steady states, missing readings, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimating import AR3, SIGMA2, autoregressive, companion, kalman, play, rate_model, riccati, rms
from native_parts import make
from scipy import linalg, stats

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

SAMPLED = [
    "estimator_moving_average",
    "estimator_alpha_beta_gamma",
    "estimator_kalman_ar",
    "estimator_kalman_rate",
    "estimator_kalman_robust",
    "estimator_lti",
    "estimator_coloured",
    "estimator_sage_husa",
    "estimator_statistical",
    "estimator_wavelet",
]
FULL = ["estimate", "variance", "innovation", "nis"]


def noisy(n: int, seed: int = 11) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=n) * 2e-3 + 0.01


def gaps(n: int, seed: int = 12) -> np.ndarray:
    valid = (np.random.default_rng(seed).random(n) > 0.2).astype(float)
    valid[0] = 1.0
    return valid


# -------------------------------------------------------------------------------- all that sample
@pytest.mark.parametrize("part", SAMPLED)
def test_one_reading_in_each_sampling_period(part):
    """At Ts = 4 T the readings at 4 T, 8 T ... count, those between are not seen."""
    z = noisy(80)
    slow = play(part, z, T=1e-3, Ts=4e-3)
    alone = play(part, z[3::4], T=4e-3, Ts=4e-3)
    assert np.array_equal(slow[3::4], alone)
    for k in range(1, 4):
        assert np.array_equal(slow[3 + k :: 4], slow[3:-k:4][: slow[3 + k :: 4].size])


@pytest.mark.parametrize("part", SAMPLED)
@pytest.mark.parametrize("Ts", [2.5e-3, 0.4e-3, 1.001e-3])
def test_sampling_period_that_is_no_multiple(part, Ts):
    one = load_part(part)(Ts=Ts)
    one.initialize()
    with pytest.raises(
        ComponentError, match=rf"Ts = {Ts:g} s must be a whole multiple of the communication step, 0.001 s"
    ):
        one.do_step(0.0, 1e-3)


@pytest.mark.parametrize("part", SAMPLED)
def test_a_missing_reading_is_not_seen(part):
    """Whatever stands at z while valid = 0 changes nothing."""
    z, valid = noisy(120), gaps(120)
    wild = np.where(valid > 0.5, z, 1e3)
    assert np.array_equal(play(part, z, valid=valid), play(part, wild, valid=valid))


# ------------------------------------------------------------------------------------------ plain
def test_none():
    z = noisy(20)
    found = play("estimator_none", z, ["estimate", "latency"])
    assert np.array_equal(found[:, 0], z) and not found[:, 1].any()


def test_moving_average():
    z = noisy(200)
    N = 9
    found = play("estimator_moving_average", z, ["estimate", "latency"], N=N)
    for k in range(z.size):
        part = z[max(0, k - N + 1) : k + 1]
        assert found[k, 0] == pytest.approx(part.mean(), abs=1e-16)
    assert found[0, 1] == pytest.approx((N - 1) / 2 * 1e-3)


def test_moving_average_of_a_sine():
    # mean of N samples of exp(j w k T): sin(N w T/2) / (N sin(w T/2)) exp(-j w T (N-1)/2)
    T, f, N = 1e-3, 17.0, 16
    t = np.arange(1, 1001) * T
    w = 2.0 * math.pi * f
    gain = math.sin(N * w * T / 2) / (N * math.sin(w * T / 2))
    expected = gain * np.sin(w * (t - (N - 1) / 2 * T))
    found = play("estimator_moving_average", np.sin(w * t), N=N)
    assert np.abs(found - expected)[N:].max() < 1e-12


# ------------------------------------------------------------------------------- alpha-beta-gamma
def test_alpha_beta_gamma_follows_a_parabola():
    t = np.arange(1, 1201) * 1e-3
    z = 0.2 + 3.0 * t - 4.0 * t * t
    found = play("estimator_alpha_beta_gamma", z, ["estimate", "innovation"])
    assert np.abs(found[-200:, 0] - z[-200:]).max() < 1e-12
    assert np.abs(found[-200:, 1]).max() < 1e-12


def test_alpha_beta_lags_a_parabola_by_what_theory_says():
    # gamma = 0: the innovation of a constant acceleration A settles where v grows by A T a step: beta y / T = A T
    A, T, alpha, beta = 4.0, 1e-3, 0.3, 0.05
    t = np.arange(1, 3001) * T
    found = play("estimator_alpha_beta_gamma", A * t * t / 2, "innovation", alpha=alpha, beta=beta, gamma=0.0)
    assert found[-1] == pytest.approx(A * T * T / beta, rel=1e-9)


def test_alpha_beta_gamma_default_is_critically_damped():
    part = load_part("estimator_alpha_beta_gamma")()
    roots = np.roots(error_polynomial(part.alpha, part.beta, part.gamma))
    assert np.abs(roots - 0.95).max() < 1e-4  # a triple root: rounding 1e-16 shows as its third root, 5e-6


def error_polynomial(alpha: float, beta: float, gamma: float) -> np.ndarray:
    """Characteristic polynomial of x -> (I - K H) F x with T = 1, from the matrices."""
    F = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
    K = np.array([[alpha], [beta], [gamma / 2.0]])
    return np.poly((np.eye(3) - K @ np.eye(1, 3)) @ F)


def test_alpha_beta_gamma_refuses_exactly_what_is_unstable():
    cls = load_part("estimator_alpha_beta_gamma")
    rng = np.random.default_rng(5)
    seen = [0, 0]
    for _ in range(300):
        gains = rng.uniform([0.05, 0.01, 0.001], [2.4, 4.0, 3.0])
        stable = bool(np.abs(np.roots(error_polynomial(*gains))).max() < 1.0)
        seen[stable] += 1
        one = cls(alpha=gains[0], beta=gains[1], gamma=gains[2])
        if stable:
            one.initialize()
        else:
            with pytest.raises(ComponentError, match="unstable"):
                one.initialize()
    assert min(seen) > 50


# ----------------------------------------------------------------------------------------- Kalman
@pytest.mark.parametrize("phi", [(0.9,), (1.2, -0.5), AR3, (0.3, 0.2, 0.1, -0.2, 0.1)])
def test_kalman_ar_is_the_matrix_filter(phi):
    z, valid = noisy(300), gaps(300)
    F, G = companion(phi, 3e-6)
    p = len(phi)
    found = play("estimator_kalman_ar", z, FULL, valid=valid, p=p, phi=phi, Q=3e-6, R=2e-6, P0=1e-4)
    expected = kalman(z, F, G, 2e-6, np.eye(p) * 1e-4, valid)
    assert np.abs(found - expected).max(0) == pytest.approx(np.zeros(4), abs=1e-13)


@pytest.mark.parametrize(("q", "walk", "slope"), [(0.5, 0.0, 1.0), (0.5, 1e-4, 1.0), (0.0, 1e-3, 0.0)])
def test_kalman_rate_is_the_matrix_filter(q, walk, slope):
    z, valid = noisy(300), gaps(300)
    F, G = rate_model(q, 1e-3, walk)
    found = play("estimator_kalman_rate", z, FULL, valid=valid, q=q, walk=walk, R=2e-6, P0=0.5, P0_slope=slope)
    expected = kalman(z, F, G, 2e-6, np.diag([0.5, slope]), valid)
    assert np.abs(found - expected).max(0) == pytest.approx(np.zeros(4), abs=1e-12)


def gain_of(part: str, n: int, **parameters) -> tuple[float, float]:
    """Gain in the end, seen from outside: change of the estimate by a unit step of one reading; variance."""
    z = np.zeros(n)
    z[-1] = 1.0
    found = play(part, z, ["estimate", "variance"], **parameters)
    return float(found[-1, 0]), float(found[-1, 1])


@pytest.mark.parametrize("phi", [(0.95,), AR3, (0.3, 0.2, 0.1, -0.2, 0.1)])
@pytest.mark.parametrize("R", [0.3 * SIGMA2, SIGMA2, 20.0 * SIGMA2])
def test_steady_state_of_kalman_ar(phi, R):
    expected = riccati(*companion(phi, SIGMA2), R)
    assert gain_of("estimator_kalman_ar", 400, p=len(phi), phi=phi, Q=SIGMA2, R=R) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("q", [0.02, 0.5, 8.0])
def test_steady_state_of_kalman_rate(q):
    R = 1.643e-3**2
    expected = riccati(*rate_model(q, 1e-3), R)
    assert gain_of("estimator_kalman_rate", 4000, q=q, R=R) == pytest.approx(expected, rel=1e-9)


def test_steady_state_of_the_local_level():
    # scalar: P-^2 - Q P- - Q R = 0, so gain = P-/(P- + R) with P- = Q/2 + sqrt(Q^2/4 + Q R)
    R, Q, T = 2.7e-6, 2.7e-9, 5.0
    prior = Q / 2 + math.sqrt(Q * Q / 4 + Q * R)
    found = gain_of("estimator_kalman_rate", 1500, T=T, Ts=T, q=0.0, walk=Q / T, R=R, P0=1.0, P0_slope=0.0)
    assert found == pytest.approx((prior / (prior + R), prior * R / (prior + R)), rel=1e-9)


def test_kalman_ar_without_readings_ends_at_the_process():
    """Prediction only: variance to that of the process (Lyapunov), estimate to 0."""
    F, G = companion(AR3, SIGMA2)
    z, valid = noisy(400), np.zeros(400)
    valid[:50] = 1.0
    found = play("estimator_kalman_ar", z, FULL, valid=valid)
    assert found[-1, 1] == pytest.approx(linalg.solve_discrete_lyapunov(F, G)[0, 0], rel=1e-9)
    assert abs(found[-1, 0]) < 1e-12 and not found[50:, 2:].any()


def test_kalman_rate_follows_a_ramp():
    t = np.arange(1, 3001) * 1e-3
    found = play("estimator_kalman_rate", 0.3 - 2.0 * t, q=2.0)
    assert np.abs(found - (0.3 - 2.0 * t))[-500:].max() < 1e-9


def chi_square_mean(nu: float) -> tuple[float, float]:
    """99.9 % bounds of the mean of nu squares of unit normals."""
    return stats.chi2.ppf(0.0005, nu) / nu, stats.chi2.ppf(0.9995, nu) / nu


@pytest.mark.parametrize("part", ["ar", "rate"])
def test_nees_and_nis_are_consistent(part):
    """200 runs of the model itself: NEES at one instant and NIS of every reading within their chi-square bounds."""
    rng = np.random.default_rng(31)
    runs, n, T = 200, 120, 1e-3
    one = make(f"estimator_kalman_{part}", "native")
    nees, nis = [], []
    for _ in range(runs):
        if part == "ar":
            F, G = companion(AR3, SIGMA2)
            P0 = linalg.solve_discrete_lyapunov(F, G)
            x = autoregressive(rng, n, SIGMA2)
            z = x + rng.normal(size=n) * math.sqrt(SIGMA2)
            # diagonal of the stationary covariance as P0: its correlations are forgotten after some ten readings
            found = play("estimator_kalman_ar", z, FULL, P0=P0[0, 0], instance=one)[40:]
        else:
            F, G = rate_model(0.5, T)
            state = rng.normal(size=2)  # P0 = P0_slope = 1
            root, x = linalg.cholesky(G, lower=True), np.empty(n)
            for k in range(n):
                state = F @ state + root @ rng.normal(size=2)
                x[k] = state[0]
            z = x + rng.normal(size=n) * 1.643e-3
            found = play("estimator_kalman_rate", z, FULL, instance=one)[40:]
        nees.append((found[-1, 0] - x[-1]) ** 2 / found[-1, 1])
        nis.append(found[:, 3])
    one.free()
    low, high = chi_square_mean(runs)
    assert low < np.mean(nees) < high
    low, high = chi_square_mean(runs * 80)
    assert low < np.mean(nis) < high


def test_wrong_R_is_seen_by_nis():
    """With R half as large as it is, S is too small and the mean of NIS leaves its bounds upwards."""
    rng = np.random.default_rng(8)
    x = autoregressive(rng, 4000, SIGMA2)
    z = x + rng.normal(size=4000) * math.sqrt(SIGMA2)
    nis = play("estimator_kalman_ar", z, "nis", R=0.5 * SIGMA2)[100:]
    assert np.mean(nis) > chi_square_mean(3900)[1]


# ------------------------------------------------------------------------------- stationarity
@pytest.mark.parametrize("part", ["estimator_kalman_ar", "estimator_sage_husa"])
def test_stationarity(part):
    """Refused exactly where a root of the polynomial reaches the unit circle; the sign trap is named."""
    cls = load_part(part)
    rng = np.random.default_rng(77)
    seen = {"ok": 0, "trap": 0, "not": 0}
    for _ in range(400):
        p = int(rng.integers(1, 6))
        phi = rng.uniform(-1.0, 1.0, p)
        radius = [np.abs(np.roots([1.0, *(-s * phi)])).max() for s in (1.0, -1.0)]
        one = cls(p=p, phi=[*phi, *[0.0] * (5 - p)])
        if radius[0] < 1.0:
            seen["ok"] += 1
            one.initialize()
        else:
            trap = radius[1] < 1.0
            seen["trap" if trap else "not"] += 1
            with pytest.raises(
                ComponentError, match="arburg .* returns a = -phi" if trap else "within the unit circle"
            ):
                one.initialize()
    assert min(seen.values()) > 30


@pytest.mark.parametrize("part", ["estimator_kalman_ar", "estimator_sage_husa"])
def test_the_printed_table_falls_into_the_trap(part):
    with pytest.raises(ComponentError, match="give phi = -a"):
        load_part(part)(p=3, phi=[0.7466, 0.5044, 0.2538, 0.0, 0.0]).initialize()


def test_a_random_walk_is_sent_elsewhere():
    with pytest.raises(ComponentError, match="estimator_kalman_rate"):
        load_part("estimator_kalman_ar")(p=1, phi=[1.0, 0.0, 0.0, 0.0, 0.0]).initialize()


@pytest.mark.parametrize("b", [0.0, 1.0, -0.5, 1.5])
def test_forgetting_factor(b):
    with pytest.raises(ComponentError, match=rf"parameter b = {b:g} 1 must be [<>] "):
        load_part("estimator_sage_husa")(b=b).initialize()


def test_sage_husa_holds_R_above_its_floor_and_counts():
    """Readings without noise: form 1 wants a negative R; it is held at R_min R0 and every time is counted."""
    z = np.zeros(300)
    R = play("estimator_sage_husa", z, ["R_hat", "clip_count"], form=1, b=0.9, R0=1e-4, R_min=0.01, P0=1e-4)
    assert R[:, 0].min() == pytest.approx(1e-6) and R[-1, 1] > 0 and (np.diff(R[:, 1]) >= 0).all()
    assert np.count_nonzero(np.isclose(R[:, 0], 1e-6, rtol=1e-12)) == R[-1, 1]


def test_sage_husa_with_missing_readings_keeps_R():
    z, valid = noisy(200), np.ones(200)
    valid[100:150] = 0.0
    R = play("estimator_sage_husa", z, "R_hat", valid=valid)
    assert (R[99:150] == R[99]).all() and R[150] != R[99]


def test_estimates_beat_the_reading_on_their_own_model():
    rng = np.random.default_rng(2)
    x = autoregressive(rng, 3000, SIGMA2)
    z = x + rng.normal(size=3000) * math.sqrt(SIGMA2)
    assert rms((play("estimator_kalman_ar", z) - x)[100:]) < 0.8 * rms(z - x)
