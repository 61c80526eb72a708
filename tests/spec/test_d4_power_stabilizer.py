"""STAB-POWER-2DOF: closed forms of the system's folder, and the printed forms that fail."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from gyrobench.system.system import load_system

R: Any = importlib.import_module(".reduction", type(load_system("stabilizer_power_2dof")).__module__)
SET = {"H": 10.0, "J_x": 0.5, "J_y": 0.02, "C_x": 10.0, "C_y": 2.0}


def matrix(K_m: float, H: float, J_x: float, J_y: float, C_x: float, C_y: float) -> np.ndarray:
    """States a', b', b of (5-7), (5-8)."""
    return np.array([[-C_x / J_x, -H / J_x, -K_m / J_x], [H / J_y, -C_y / J_y, 0.0], [0.0, 1.0, 0.0]])


def test_characteristic_equation() -> None:
    """J_x J_y s3 + (J_y C_x + J_x C_y) s2 + (H2 + C_x C_y) s + H K_m (5-20) has the eigenvalues of (5-7), (5-8): 50
    random sets; with the derivatives as printed in (5-19), of one order less each, it is of second order."""
    rng = np.random.default_rng(2)
    for _ in range(50):
        g = dict(zip(SET, 10.0 ** rng.uniform(-1, 1, 5), strict=True))
        K_m = 10.0 ** rng.uniform(-1, 1)
        H, J_x, J_y, C_x, C_y = g.values()
        right = np.array([J_x * J_y, J_y * C_x + J_x * C_y, H * H + C_x * C_y, H * K_m])
        np.testing.assert_allclose(np.poly(matrix(K_m, **g)), right / right[0], rtol=1e-9)
        printed = np.roots([right[0], right[1] + right[2], right[3]])
        assert printed.size == 2 and np.linalg.eigvals(matrix(K_m, **g)).size == 3


def test_routh_limit_is_exact_where_the_printed_one_is_not() -> None:
    """200 random sets: stable at 0.999, unstable at 1.001 of (C_x/J_x + C_y/J_y)(H + C_x C_y/H).  (5-23) drops
    C_x C_y/H: of the default set it would forbid K_m from 1200 on, where the loop is stable up to 1440."""
    rng = np.random.default_rng(7)
    for _ in range(200):
        g = dict(zip(SET, 10.0 ** rng.uniform(-2, 2, 5), strict=True))
        limit = R.routh_limit(**g)
        assert np.max(np.linalg.eigvals(matrix(0.999 * limit, **g)).real) < 0.0
        assert np.max(np.linalg.eigvals(matrix(1.001 * limit, **g)).real) > 0.0
    assert R.routh_limit(**SET) == pytest.approx(1440.0, rel=1e-12)
    printed = (SET["C_x"] / SET["J_x"] + SET["C_y"] / SET["J_y"]) * SET["H"]
    assert printed == pytest.approx(1200.0)
    assert np.max(np.linalg.eigvals(matrix(1.1 * printed, **SET)).real) < 0.0


def test_steady_platform_angle_is_not_always_zero() -> None:
    """States a, a', b', b under M_x = 1, by expm at 50 s: a = C_y/(H K_m), not 0 as the text says."""
    for C_y in (2.0, 0.5, 0.0):
        g = {**SET, "C_y": C_y}
        m = np.zeros((5, 5))
        m[1:4, 1:4] = matrix(100.0, **g)
        m[0, 1], m[1, 4] = 1.0, 1.0 / g["J_x"]
        a = expm(50.0 * m)[0, 4]
        assert a == pytest.approx(R.steady(1.0, 10.0, 100.0, C_y), abs=1e-12)
    assert R.steady(1.0, 10.0, 100.0, 2.0) == pytest.approx(2e-3, rel=1e-12)
    assert R.steady(1.0, 10.0, 100.0, 0.0) == 0.0


def test_stiffness_of_the_correction() -> None:
    """K_m = i k_u k_i k_m (5-5) with the gyro's pickoff as potentiometer."""
    p = {"stabilizer.ratio": 50.0, "gyro.K_sg_y": 8.0, "stabilizer.k_i": 5.0, "stabilizer.k_m": 0.03}
    assert R.k_m(p) == pytest.approx(60.0, rel=1e-12)
