"""Supplies of a gyro: their time functions, and what a floated gyro makes of them, against its equation of motion."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from wired import BENCH

from gyrobench.packaging.loading import load_part

Supply, Gyro = load_part("supply", BENCH), load_part("floated_gyro", BENCH)
Compliant, TwoAxis = load_part("compliant_gyro", BENCH), load_part("gyro_2dof", BENCH)
OUTPUTS = ("wheel_frequency", "wheel_voltage", "wheel_phase", "pickoff_excitation", "torquer_excitation")
BLOCKS = ("frequency", "voltage", "asymmetry", "pickoff", "torquer")


def test_departure_in_time() -> None:
    """offset + ramp t + step + swing sin(2 pi t / 4 + 0.3), each output by its own parameters: 1, 2 ... 5 times."""
    one = {"offset": 1e-3, "ramp": 2e-5, "step": -4e-3, "swing": 3e-4}
    values = {f"{b}_{n}": k * v for k, b in enumerate(BLOCKS, 1) for n, v in one.items()}
    part = Supply(step_time=2.5, period=4.0, phase=0.3, **values)
    part.initialize()
    for j in range(5):
        t = float(j)
        if j:
            part.do_step(t - 1.0, 1.0)
        expected = 1e-3 + 2e-5 * t - 4e-3 * (t >= 2.5) + 3e-4 * math.sin(math.pi * t / 2.0 + 0.3)
        got = [getattr(part, n) for n in OUTPUTS]
        assert got == pytest.approx([k * expected for k in range(1, 6)], rel=1e-12)


def test_wander_has_its_rms_and_correlation() -> None:
    """e^(-1/5) from one second to the next; the standard error of both over 8000 values is below 3 %."""
    part = Supply(tau=5.0, pickoff_wander=2e-4, seed=3)
    part.initialize()
    x = []
    for k in range(8000):
        part.do_step(float(k), 1.0)
        x.append(part.pickoff_excitation)
    a = np.array(x)
    assert a.std() == pytest.approx(2e-4, rel=0.1)
    assert np.corrcoef(a[1:], a[:-1])[0, 1] == pytest.approx(math.exp(-0.2), abs=0.03)
    assert part.wheel_frequency == 0.0


def excited(cls: Any, seed: int, **more: Any) -> tuple[Any, np.ndarray, np.ndarray, float, float]:
    """Return a gyro after 20 ms with random supplies, their errors, the rates, its nominal drift, its torque."""
    rng = np.random.default_rng(seed)
    errors = rng.normal(size=5) * 0.02
    _, v, p, e, a = errors
    w, g, i = rng.normal(size=3) * 1e-4, rng.normal(size=3) * 6.0, 1e-3
    names = ("D_pickoff", "D_torquer", "D_UI", "D_US", "D_PI", "D_PS")
    given = dict(zip(names, rng.normal(size=6) * 3e-6, strict=True))
    gyro = cls(white=0.0, markov=0.0, pickoff=0.0, k_E=0.7, **more, **given)
    gyro.initialize()
    for name, x in zip(OUTPUTS, errors, strict=True):
        setattr(gyro, name, x)
    for j in range(3):
        gyro.omega[j], gyro.f[j] = w[j], g[j]
    gyro.i = i
    for n in range(20):
        gyro.do_step(n * 1e-3, 1e-3)
    X, Y, Z = -g / 9.80665
    D_I, D_S = gyro.D_I + given["D_UI"] * v + given["D_PI"] * p, gyro.D_S + given["D_US"] * v + given["D_PS"] * p
    D_F = gyro.D_F + given["D_pickoff"] * ((1 + e) ** 2 - 1) + given["D_torquer"] * ((1 + a) ** 2 - 1)
    nominal = D_F + D_I * X + gyro.D_O * Y + D_S * Z + gyro.D_II * X * X + gyro.D_SS * Z * Z
    nominal += gyro.D_IO * X * Y + gyro.D_OS * Y * Z + gyro.D_IS * X * Z
    return gyro, errors, w, nominal, -gyro.H * (nominal + gyro.k * (1 + 0.7 * a) * i)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_floated_gyro_against_its_torques(seed: int) -> None:
    """J b'' + C b' = H (1 + f)(w_I cos b - w_S sin b) + torques.  Those of drift and torquer are the nominal ones, for
    they do not turn with the wheel; reaction torques go with the square of the excitation.
    """
    gyro, (f, _, _, e, _), w, nominal, torque = excited(Gyro, seed, reaction=True)

    def rhs(_: float, y: np.ndarray) -> list[float]:
        sensed = w[0] * math.cos(y[0]) - w[2] * math.sin(y[0])
        return [y[1], (gyro.H * (1 + f) * sensed + torque - gyro.C * y[1]) / gyro.J]

    b, rate = solve_ivp(rhs, (0.0, 0.02), [0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-18).y[:, -1]
    assert gyro.b == pytest.approx(b, rel=1e-10)
    assert gyro.u == pytest.approx(gyro.K_sg * (1 + e) * b, rel=1e-10)
    assert gyro.drift == pytest.approx(nominal / (1 + f), rel=1e-12)
    assert gyro.h_I == pytest.approx(gyro.H * (1 + f) * math.sin(b + 0.5e-3 * rate), rel=1e-6)
    assert gyro.M_react[1] == pytest.approx(gyro.C * rate - torque, rel=1e-9)


@pytest.mark.parametrize("seed", [1, 2])
def test_compliant_gyro_against_its_torques(seed: int) -> None:
    """H (1 + f) between rotor and gimbal, the torques of drift and torquer at the nominal H; rotor and float as in
    GYRO-DYN-3, integrated by scipy.
    """
    gyro, (f, _, _, e, _), w, nominal, torque = excited(Compliant, seed)
    H = gyro.H * (1 + f)

    def rhs(_: float, y: np.ndarray) -> list[float]:
        b, rate, about_i, about_o = y
        sensed = w[0] * math.cos(b) - w[2] * math.sin(b)
        spring = gyro.K_O * about_o
        rotor = [spring / H - sensed, -gyro.K_I / H * about_i - rate - w[1]]
        return [rate, (spring + torque - gyro.C * rate) / gyro.J, *rotor]

    b = solve_ivp(rhs, (0.0, 0.02), [0.0] * 4, method="DOP853", rtol=1e-12, atol=1e-18).y[0, -1]
    assert gyro.b == pytest.approx(b, rel=1e-8)
    assert gyro.u == pytest.approx(gyro.K_sg * (1 + e) * b, rel=1e-8)
    assert gyro.drift == pytest.approx(nominal / (1 + f), rel=1e-12)


@pytest.mark.parametrize("nutation", [False, True])
def test_two_degrees_of_freedom_against_their_torques(nutation: bool) -> None:
    """The nominal torques T_x = H (omega_dy + k_x i_x), T_y = -H (omega_dx + k_y i_y) on a wheel of H (1 + f): without
    nutation it precesses by T_y and T_x over H (1 + f); with it J p' = -H (1 + f) q + T_x, J q' = H (1 + f) p + T_y.
    """
    rng = np.random.default_rng(7)
    f, v, p, e, a = rng.normal(size=5) * 0.02
    w, g, i = rng.normal(size=3) * 1e-4, rng.normal(size=3) * 6.0, (1e-3, -2e-3)
    names = ("pickoff", "torquer", "voltage", "voltage_z", "phase", "phase_z")
    given = {f"D{c}_{n}": x for c in "xy" for n, x in zip(names, rng.normal(size=6) * 3e-6, strict=True)}
    J = 1e-4 if nutation else 0.0
    silent = {f"{n}_{c}": 0.0 for n in ("white", "markov", "pickoff") for c in "xy"}
    gyro = TwoAxis(**silent, **given, J_x=J, J_y=J, k_E=0.7, u_max=10.0)
    gyro.initialize()
    for name, x in zip(OUTPUTS, (f, v, p, e, a), strict=True):
        setattr(gyro, name, x)
    for j in range(3):
        gyro.omega[j], gyro.f[j] = w[j], g[j]
    gyro.i_x, gyro.i_y = i
    h, steps = (1e-5, 500) if nutation else (1e-3, 20)
    for n in range(steps):
        gyro.do_step(n * h, h)
    X, Y, Z = -g / 9.80665

    def nominal(c: str, own: float) -> float:
        D = {n: getattr(gyro, f"D{c}_{n}") for n in ("0", "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz", *names)}
        drift = D["0"] + D["pickoff"] * ((1 + e) ** 2 - 1) + D["torquer"] * ((1 + a) ** 2 - 1)
        drift += D["x"] * X + D["y"] * Y + D["z"] * Z + (D["voltage"] * v + D["phase"] * p) * own
        drift += (D["voltage_z"] * v + D["phase_z"] * p) * Z + D["xx"] * X * X + D["yy"] * Y * Y + D["zz"] * Z * Z
        return float(drift + D["xy"] * X * Y + D["yz"] * Y * Z + D["xz"] * X * Z)

    H, drifts = gyro.H * (1 + f), (nominal("x", X), nominal("y", Y))
    T_x = gyro.H * (drifts[1] + gyro.k_x * (1 + 0.7 * a) * i[0])
    T_y = -gyro.H * (drifts[0] + gyro.k_y * (1 + 0.7 * a) * i[1])

    def rhs(_: float, y: np.ndarray) -> list[float]:
        psi_x, psi_y, rate_p, rate_q = y
        turn = ((-H * rate_q + T_x) / J, (H * rate_p + T_y) / J) if nutation else (0.0, 0.0)
        rates = (rate_p, rate_q) if nutation else (-T_y / H, T_x / H)
        return [rates[0] - w[0] + w[2] * psi_y, rates[1] - w[1] - w[2] * psi_x, *turn]

    psi = solve_ivp(rhs, (0.0, h * steps), [0.0] * 4, method="DOP853", rtol=1e-12, atol=1e-18).y[:2, -1]
    near = 1e-4 if nutation else 1e-9  # the midpoint rule at 500 steps: (H h / J)^2/12 of the nutation, 3e-5
    assert (gyro.psi_x, gyro.psi_y) == pytest.approx(tuple(psi), rel=near)
    assert (gyro.drift_x, gyro.drift_y) == pytest.approx(tuple(x / (1 + f) for x in drifts), rel=1e-12)
    assert gyro.u_x == pytest.approx(-gyro.K_sg_x * (1 + e) * gyro.psi_x, rel=1e-12)
