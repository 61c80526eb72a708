"""Drift compensator: model between two readings, filter against one in information form, torquer, refusals.
[COMP-RANDOM-DRIFT]"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import integrate
from scipy.linalg import expm, solve_discrete_are

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

DPH = ARCSEC = math.pi / 648000.0
RMS, TAU, LAG, SIGMA, H = 0.01 * DPH, 3600.0, 1.0, 0.2 * ARCSEC, 10.0
#: states in the part's units: rms, sigma, sigma
SCALE = np.array([RMS, SIGMA, SIGMA])
F = np.array([[-1.0 / TAU, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0 / LAG, -1.0 / LAG]])


def van_loan(F, L, h):
    """exp(F h) and the integral of exp(F s) L exp(F s)', of one exponential of twice the size."""
    n = len(F)
    e = expm(np.block([[-F, L], [np.zeros((n, n)), F.T]]) * h)
    return e[n:, n:].T, e[n:, n:].T @ e[:n, n:]


def started(**given):
    part = load_part("drift_compensator")(**given)
    part.initialize()
    return part


def played(part, z, valid=None):
    """u, P (in SI), estimate after each reading."""
    rows = []
    for k, reading in enumerate(z):
        part.z, part.valid = reading, 1.0 if valid is None else valid[k]
        part.do_step(k * H, H)
        P = np.array(part.covariance) * np.outer(SCALE, SCALE)
        rows.append((part.u, part.estimate, part.alpha, part.theta, part.nis, part.i, part.saturated, P))
    return rows


@pytest.mark.parametrize(("h", "lag"), [(10.0, 1.0), (10.0, 30.0), (5.0, 0.5)])
def test_model_between_two_readings_is_van_loans(h, lag):
    part = started(Ts=h, lag=lag, white=1e-9, T_c=0.0)
    part.do_step(0.0, h)
    A = F.copy()
    A[2] = [0.0, 1.0 / lag, -1.0 / lag]
    Phi, Q = van_loan(A, np.diag([2.0 * RMS**2 / TAU, 1e-18, 0.0]), h)
    B = integrate.quad_vec(lambda s: expm(A * s) @ [0.0, -1.0, 0.0], 0.0, h, epsabs=0.0, epsrel=1e-12)[0]
    assert np.array(part.model_Phi) * np.outer(SCALE, 1.0 / SCALE) == pytest.approx(Phi, rel=1e-10, abs=1e-14)
    assert np.array(part.model_Q) * np.outer(SCALE, SCALE) == pytest.approx(Q, rel=1e-10)
    assert np.array(part.model_B) * SCALE == pytest.approx(B, rel=1e-10)


def test_a_lag_far_shorter_than_the_period():
    """Van Loan's exponential of -F overflows at h/lag = 5000: alpha_k of one reading is theta_k then."""
    part = started(lag=2e-3)
    part.do_step(0.0, H)
    Phi = np.array(part.model_Phi)
    assert Phi[2] == pytest.approx(Phi[1], rel=1e-3) and Phi[0, 0] == pytest.approx(math.exp(-H / TAU), rel=1e-12)


def test_observable_from_the_table_angle_alone():
    part = started()
    part.do_step(0.0, H)
    Phi = np.array(part.model_Phi)
    H_k = np.array([[0.0, 0.0, 1.0]])
    seen = np.vstack([H_k, H_k @ Phi, H_k @ Phi @ Phi])
    assert np.linalg.matrix_rank(seen / np.linalg.norm(seen, axis=0)) == 3


@pytest.mark.parametrize("T_c", [0.0, 300.0])
def test_against_the_filter_in_information_form(T_c):
    """(6-31) corrected: p^-1 = M^-1 + H'R^-1 H, K = p H'/R, prediction with the u that the torquer got."""
    rng = np.random.default_rng(4)
    z = np.cumsum(rng.normal(size=60)) * ARCSEC
    valid = (rng.random(60) > 0.2).astype(float)
    limit = 0.004 * DPH
    rows = played(started(T_c=T_c, u_max=limit), z, valid)
    Phi, Q = van_loan(F, np.diag([2.0 * RMS**2 / TAU, 0.0, 0.0]), H)
    B = expm(np.block([[F, np.array([[0.0], [-1.0], [0.0]])], [np.zeros((1, 4))]]) * H)[:3, 3]
    x, P, u = np.zeros(3), np.diag([RMS**2, 0.0, 0.0]), 0.0
    D = np.diag(1.0 / SCALE)  # numbers near 1
    without = np.zeros(3)  # the same filter, told the u that was wanted
    wanted = 0.0
    for k in range(60):
        x, P = Phi @ x + B * u, Phi @ P @ Phi.T + Q
        without = Phi @ without + B * wanted
        if valid[k]:
            M = D @ P @ D
            p = np.linalg.inv(np.linalg.inv(M) + np.diag([0.0, 0.0, 1.0]))
            gain = SCALE * p[:, 2] / SIGMA
            x, without = x + gain * (z[k] - x[2]), without + gain * (z[k] - without[2])
            P = np.diag(SCALE) @ p @ np.diag(SCALE)
        wanted = x[0] + (x[1] / T_c if T_c else 0.0)
        u = min(max(wanted, -limit), limit)
        got = rows[k]
        assert got[0] == pytest.approx(u, rel=1e-8) and got[1] == pytest.approx(x[0], rel=1e-8, abs=1e-9 * RMS)
        assert [got[2], got[3]] == pytest.approx(x[1:], rel=1e-8, abs=1e-9 * SIGMA)
        assert got[7] == pytest.approx(P, rel=1e-7)
        assert got[5] == pytest.approx(-u / (17.2e3 * DPH), rel=1e-8)
        assert got[6] == (abs(wanted) > limit)
    assert sum(r[6] for r in rows) > 10, "the torquer was at its limit"
    assert abs(without[0] - x[0]) > 0.1 * RMS, "a prediction with the u that was wanted gives another drift"


def test_steady_state_is_that_of_the_riccati_equation():
    """sd of the drift 0.00195 deg/h; the variance without transpose, as printed, is not symmetric."""
    Phi, Q = van_loan(F, np.diag([2.0 * RMS**2 / TAU, 0.0, 0.0]), H)
    H_k = np.array([[0.0, 0.0, 1.0]])
    s = np.outer(SCALE, SCALE)
    P = solve_discrete_are((Phi * np.outer(1.0 / SCALE, SCALE)).T, H_k.T, 0.5 * (Q + Q.T) / s, np.eye(1)) * s
    p = P - P @ H_k.T @ H_k @ P / (P[2, 2] + SIGMA**2)
    last = played(started(), np.zeros(1500))[-1][7]
    assert last == pytest.approx(p, rel=1e-6)
    assert math.sqrt(last[0, 0]) / DPH == pytest.approx(0.00195, abs=1e-5)
    printed = (Phi @ p @ Phi) / s
    assert np.abs(printed - printed.T).max() > 0.01 * np.abs(printed).max()


def test_begins_anew_where_the_table_is_at_zero():
    part = started()
    z = np.random.default_rng(1).normal(size=30) * ARCSEC
    first = played(part, z)
    part.restart = 1.0
    part.do_step(30 * H, H)
    assert (part.u, part.i, part.estimate, part.alpha) == (0.0, 0.0, 0.0, 0.0)
    part.restart = 0.0
    second = []
    for k, reading in enumerate(z):
        part.z = reading
        part.do_step((31 + k) * H, H)
        second.append(part.u)
    assert second == pytest.approx([r[0] for r in first], rel=1e-12)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"Ts": 1300.0, "T_c": 0.0}, "Ts = 1300 s is longer than a third of tau = 3600 s"),
        ({"T_c": 40.0}, "T_c = 40 s is shorter than 5 Ts, Ts = 10 s"),
        ({"known_from": 7e4}, "tau = 3600 s from a record of 70000 s .* at least 20 tau"),
        ({"sigma": 0.0}, "sigma = 0.* > 0"),
        ({"lag": 0.0}, "lag = 0.* > 0"),
        ({"tau": -1.0}, "tau = -1.* > 0"),
    ],
)
def test_refused(given, words):
    with pytest.raises(ComponentError, match=words):
        started(**given)
