"""Errors of gyros and their compensation: quick form against the floated gyro, acceptance of the compensation, noise.
[GYRO-STATIC-ERR, GYRO-DYNAMIC-ERR]"""

from __future__ import annotations

import math

import numpy as np
import pytest
from native_parts import make
from wired import DEG_H, NO_DRIFT, QUIET, FloatedGyro, Native

from gyrobench import drift
from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

G0 = 9.80665
# the gyro of Xia 2008 as a rate gyro of 100 Hz [GYRO-SDF-EOM]
SPIN, J_O, D_J, WN = 0.02, 2.5e-5, 3e-6, 2 * math.pi * 100
RATE = {"H": SPIN, "J": J_O, "K": J_O * WN**2, "C": 2 * 0.7 * J_O * WN, "u_max": 10.0, "k": 1.0}
PRODUCTS = {"J_IO": 1.5e-7, "J_OS": -1.2e-7, "J_SI": 3e-8}
DYNAMIC = {"J": J_O / SPIN, "dJ": D_J / SPIN, "HK": SPIN / RATE["K"], **{n: x / SPIN for n, x in PRODUCTS.items()}}
DRIFTS = dict(zip(NO_DRIFT, np.array([-0.3, -0.9, 0.1, -0.7, -0.05, 0.04, -0.03, -0.02, -0.15]) * DEG_H, strict=True))
MOUNTS = {"x": np.eye(3), "y": np.eye(3)[[1, 2, 0]], "z": np.eye(3)[[2, 0, 1]]}  # rows I, O, S
SILENT = {f"noise_{a}_{n}": 0.0 for a in "xyz" for n in ("bias", "gyro", "acc")} | {"heading_noise": 0.0}


def named(axis, values):
    return {f"{axis}_{n}": float(x) for n, x in values.items()}


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_errors_are_those_of_a_floated_gyro(axis):
    """Rest of the float after 0.2 s at constant rates, accelerations and specific force: w_hat = K b/H."""
    omega, alpha, f = [0.3, -0.2, 0.4], [0.5, -0.4, 0.3], [2.0, -3.0, 9.0]
    gyro = FloatedGyro(**{**QUIET, **DRIFTS, **RATE, "dJ": D_J, **PRODUCTS}, mount=MOUNTS[axis].tolist())
    gyro.omega, gyro.alpha, gyro.f = omega, alpha, f
    gyro.initialize()
    for k in range(2000):
        gyro.do_step(k * 1e-4, 1e-4)
    seen = gyro.K * gyro.b / gyro.H
    unit = load_part("inertial_unit")(**SILENT, **named(axis, DYNAMIC | DRIFTS))
    unit.omega, unit.alpha, unit.f = omega, alpha, f
    unit.initialize()
    unit.do_step(0.0, 0.01)
    j = "xyz".index(axis)
    assert unit.indicated[j] == pytest.approx(seen, rel=2e-6)  # terms of second order in b = 1e-3
    assert abs(unit.dynamic[j]) > 50.0 * abs(unit.indicated[j] - seen)
    assert abs(unit.static[j]) > 100.0 * DEG_H * 1e-3


def rate_gyro(omega, alpha, h, **given):
    """w_hat of a floated gyro through a motion given at the middle of each step."""
    gyro = Native("floated_gyro", **{**QUIET, **NO_DRIFT, **RATE, **given})
    gyro.initialize()
    out = []
    for k in range(len(omega)):
        gyro.omega, gyro.alpha = omega[k].tolist(), alpha[k].tolist()
        gyro.do_step(k * h, h)
        out.append(gyro.K * gyro.b / gyro.H)
    return np.array(out)


@pytest.mark.parametrize(
    ("f", "tau_a", "least", "most"), [(1.0, 0.0, 0.0, 0.01), (4.0, 0.0, 0.0, 0.02), (4.0, 2e-3, 0.03, 0.1)]
)
def test_acceptance_of_the_compensation(f, tau_a, least, most):
    """0.5 rad/s on I and S, 1 rad/s2 on O, gyro of 100 Hz: less than 2 % of the uncompensated error is left below
    a twentieth of its bandwidth; a lag of 2 ms in the acceleration leaves 2 pi f (0.5 ms + 2 ms) = 6 % of -J a_O.
    """
    h, n = 1e-3, round(4.0 / f / 1e-3)
    t = h * (np.arange(n) + 0.5)
    s, c = np.sin(2 * math.pi * f * t), np.cos(2 * math.pi * f * t)
    w = 2 * math.pi * f
    omega = np.column_stack([0.5 * s, s / w, 0.5 * s])
    alpha = np.column_stack([0.5 * w * c, c, 0.5 * w * c])
    mine = np.column_stack([omega[:, 0], 0 * t, 0 * t])
    indicated = rate_gyro(omega, alpha, h, dJ=D_J)
    alone = rate_gyro(mine, 0 * alpha, h)
    error = indicated - alone
    # readings of the other two gyros: the same motion through gyros without errors
    others = [rate_gyro(np.column_stack([omega[:, k], 0 * t, 0 * t]), 0 * alpha, h) for k in (1, 2)]
    part = Native("gyro_error_compensator", tau_a=tau_a, **{f"x_{n}": DYNAMIC[n] for n in ("J", "dJ", "HK")})
    part.initialize()
    left = []
    for k in range(n):
        part.indicated = [float(indicated[k]), float(others[0][k]), float(others[1][k])]
        part.do_step(k * h, h)
        left.append(part.omega[0] - alone[k])
    last = slice(n // 2, None)
    assert np.max(np.abs(error[last])) > 1e-3
    assert least < np.std(np.array(left)[last]) / np.std(error[last]) < most


def test_constant_rates_are_compensated_to_two_percent():
    """The 4.69e-4 rad/s at 0.5 rad/s on I and S; with the sign printed in 2.2.11 the error becomes larger."""
    part = load_part("gyro_error_compensator")(x_dJ=DYNAMIC["dJ"], x_HK=DYNAMIC["HK"])
    part.initialize()
    omega = np.tile([0.5, 0.0, 0.5], (300, 1))
    seen = rate_gyro(omega, 0 * omega, 1e-3, dJ=D_J)[-1]
    part.indicated = [float(seen), 0.0, 0.5]
    part.do_step(0.0, 1e-3)
    assert seen - 0.5 == pytest.approx(-4.689e-4, abs=1e-7)
    assert abs(part.omega[0] - 0.5) < 0.02 * 4.689e-4
    printed = load_part("gyro_error_compensator")(x_dJ=DYNAMIC["dJ"] + 2.0 * DYNAMIC["HK"], x_HK=DYNAMIC["HK"])
    printed.initialize()
    printed.indicated = [float(seen), 0.0, 0.5]
    printed.do_step(0.0, 1e-3)
    assert abs(printed.omega[0] - 0.5) > 2.0 * 4.689e-4


def test_static_drift_is_taken_off_with_the_sign_of_an_accelerometer():
    """EX5: a polynomial in F = -f that is fed with accelerometer outputs has its linear terms doubled, not removed."""
    f = [3.0, -2.0, 9.0]
    unit = load_part("inertial_unit")(**SILENT, **named("x", DRIFTS), **named("y", DRIFTS), **named("z", DRIFTS))
    unit.f = f
    unit.initialize()
    unit.do_step(0.0, 0.01)
    for sign, left in ((1.0, 0.0), (-1.0, 1.0)):
        part = load_part("gyro_error_compensator")(**{k: v for a in "xyz" for k, v in named(a, DRIFTS).items()})
        part.indicated, part.f = list(unit.indicated), [sign * x for x in f]
        part.initialize()
        part.do_step(0.0, 0.01)
        assert np.abs(part.omega).max() / DEG_H == pytest.approx(left, abs=1e-9 if left == 0.0 else 0.9)
    assert np.abs(part.omega).max() > np.abs(unit.indicated).max()


def test_noise_of_the_unit():
    """Densities times 1/sqrt(h); a heading reading every period, in the first step too; rates are means of the step."""
    one = make("inertial_unit", "native")
    one.set(
        {f"noise_{a}_bias": 0.0 for a in "xyz"} | {"noise_x_gyro": 1e-4, "noise_x_acc": 1e-3, "heading_period": 0.5}
    )
    one.set({"omega[2]": 0.0, "angle[3]": 0.7})
    one.initialize(0.0)
    rows = []
    for k in range(4000):
        one.set({"omega[2]": 0.01 * (k + 1)})  # a ramp: the mean over the step is at its middle
        one.step(0.01 * k, 0.01)
        rows.append(one.get(["indicated[1]", "f_read[1]", "heading_new", "heading", "indicated[2]"]))
    one.free()
    got = np.array(rows)
    assert np.std(got[:, 0]) == pytest.approx(1e-3, rel=0.05) and np.std(got[:, 1]) == pytest.approx(1e-2, rel=0.05)
    assert np.flatnonzero(got[:, 2]).tolist() == [0, *range(49, 4000, 50)]
    new = got[got[:, 2] > 0.5, 3]
    assert np.std(new - 0.7) == pytest.approx(math.radians(0.2), rel=0.35) and np.unique(new).size == new.size
    ramp = got[1:, 4] - 0.01 * (np.arange(1, 4000) + 0.5)
    assert abs(np.mean(ramp)) < 5.0 * np.std(ramp) / math.sqrt(3999.0)


def test_bias_is_a_gauss_markov_process():
    one = make("inertial_unit", "native")
    one.set({"bias_tau": 2.0, "noise_y_gyro": 0.0, "heading_period": 0.0})
    one.initialize(0.0)
    b = []
    for k in range(40000):
        one.step(0.05 * k, 0.05)
        b.append(one.get(["bias[2]"])[0])
    one.free()
    x = np.array(b) / (5.0 * DEG_H)
    assert np.mean(x * x) == pytest.approx(1.0, rel=4.0 * math.sqrt(2.0 * 2.0 / 2000.0))
    assert np.mean(x[40:] * x[:-40]) == pytest.approx(math.exp(-1.0), abs=0.12)


@pytest.mark.parametrize("name", ["inertial_unit", "gyro_error_compensator"])
def test_mounts_must_be_rotations(name):
    with pytest.raises(ComponentError, match="mount_y is not a rotation matrix"):
        load_part(name)(mount_y=[[1.0, 0.0, 0.0], [0.0, 1.0, 0.1], [0.0, 0.0, 1.0]]).initialize()


def test_from_positions_to_the_compensation() -> None:
    """24 orientations at 1 g, noise of 0.01 deg/h: nine coefficients within 4 standard errors; in the compensation
    they leave less than 0.03 deg/h of 1 deg/h at other attitudes.  The tenth is not separable: rank 9 of 10."""
    rng = np.random.default_rng(8)
    f = G0 * np.array([v / np.linalg.norm(v) for v in rng.normal(size=(24, 3))])
    unit = load_part("inertial_unit")(**SILENT, **named("x", DRIFTS))
    unit.initialize()
    rates = []
    for k, row in enumerate(f):
        unit.f = row.tolist()
        unit.do_step(0.01 * k, 0.01)
        rates.append(unit.indicated[0])
    names = tuple(DRIFTS)
    X = drift.regressors(-f / G0, names)
    ten = drift.regressors(-f / G0, (*names, "D_OO"))
    assert np.linalg.matrix_rank(X) == 9 and np.linalg.matrix_rank(ten, tol=1e-9) == 9
    y = -np.array(rates) + 0.01 * DEG_H * rng.normal(size=24)
    fit = np.linalg.lstsq(X, y, rcond=None)[0]
    se = 0.01 * DEG_H * np.sqrt(np.diag(np.linalg.inv(X.T @ X)))
    truth = np.array([DRIFTS[n] for n in names])
    assert np.all(np.abs(fit - truth) < 4.0 * se)
    part = load_part("gyro_error_compensator")(**named("x", dict(zip(names, fit, strict=True))))
    part.initialize()
    before, left = [], []
    for k, v in enumerate(rng.normal(size=(20, 3))):
        unit.f = part.f = (G0 * v / np.linalg.norm(v)).tolist()
        unit.do_step(1.0 + 0.01 * k, 0.01)
        part.indicated = list(unit.indicated)
        part.do_step(0.01 * k, 0.01)
        before.append(abs(unit.indicated[0]) / DEG_H)
        left.append(abs(part.omega[0]) / DEG_H)
    assert max(before) > 0.9 and max(left) < 0.03
