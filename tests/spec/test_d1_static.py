"""Static and dynamic models of gyros: each erratum of the static and dynamic equations that changes a number.

The right value of a static model is the cross product itself: M = M_0 + l x (m SF) + (K m SF) x (m SF), drift rates
omega_dx = -M_y/H, omega_dy = +M_x/H [STATIC-TORQUE, STATIC-DRIFT].  The bench's coefficients give it; the same
coefficients with one entry as printed do not.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from gyrobench import drift, frames
from gyrobench.bench import standard_folder
from gyrobench.drift import G0
from gyrobench.packaging import load_part

RNG = np.random.default_rng(1981)
H, MASS = 0.2, 0.25
ARM, K = RNG.normal(size=3) * 1e-6, RNG.uniform(1e-8, 1e-7, (3, 3))
M_0 = RNG.normal(size=3) * 1e-7
SF = RNG.normal(size=3) * G0
TORQUE = M_0 + np.cross(ARM, MASS * SF) + np.cross(K @ (MASS * SF), MASS * SF)
RIGHT = {"x": -TORQUE[1] / H, "y": TORQUE[0] / H}
A, Q = MASS * G0 / H, MASS * MASS * G0 * G0 / H
L = dict(zip("xyz", ARM.tolist(), strict=True))


def k(i: str, j: str) -> float:
    return float(K["xyz".index(i), "xyz".index(j)])


def ours() -> dict[str, float]:
    physical = {"M_x": M_0[0], "M_y": M_0[1], **{f"l_{a}": v for a, v in L.items()}}
    physical |= {f"K_{a}{b}": k(a, b) for a in "xyz" for b in "xyz"}
    return drift.from_physical_2dof(H, MASS, physical)


def rate(channel: str, coefficients: dict[str, float]) -> float:
    mine = {n: v for n, v in coefficients.items() if n.startswith(f"D{channel}_")}
    return float(drift.drift(SF / G0, mine))


#: erratum -> entries as printed: coefficient: value
PRINTED: dict[str, dict[str, float]] = {
    "E7 D(x)_x": {"Dx_x": A * L["x"]},
    "E7 D(y)_y": {"Dy_y": A * L["y"]},
    "E8 D(x)_yz": {"Dx_yz": Q * k("z", "y")},
    "E8 D(x)_zz with K_zx": {"Dx_zz": Q * k("z", "x")},
    "E8 D(x)_xz": {"Dx_xz": -Q * (k("z", "x") - k("x", "z"))},
    "E8 D_xy with K_xy": {"Dx_xy": -Q * k("x", "y")},
    "E8 D_yz with K_yz": {"Dx_yz": Q * k("y", "z")},
    "E8 D_xx with K_xx": {"Dx_xx": -Q * k("x", "x")},
    "E8 D_zz with K_zz": {"Dx_zz": Q * k("z", "z")},
    "E8 D(y)_yz": {"Dy_yz": Q * (k("z", "y") - k("y", "z"))},
    "E8 D(y)_xz": {"Dy_xz": Q * k("z", "y")},
}


def test_bench_has_the_cross_product() -> None:
    for channel, right in RIGHT.items():
        assert rate(channel, ours()) == pytest.approx(right, rel=1e-12)


@pytest.mark.parametrize("erratum", PRINTED)
def test_e7_e8_printed_entries_fail(erratum: str) -> None:
    (name,) = PRINTED[erratum]
    channel = name[1]
    assert abs(rate(channel, {**ours(), **PRINTED[erratum]}) / RIGHT[channel] - 1.0) > 1e-3


@pytest.mark.parametrize(("channel", "right", "printed"), [("x", 2, 1), ("y", 2, 0)])
def test_e9_printed_second_linear_term_fails(channel: str, right: int, printed: int) -> None:
    """2-30 multiplies the second linear coefficient by SF_x, 2-31 by g_y: right is SF_z in both."""
    own = ours()
    second = own[f"D{channel}_z"]
    assert abs((rate(channel, own) + second * (SF[printed] - SF[right]) / G0) / RIGHT[channel] - 1.0) > 1e-3


def test_e3_e5_e6_printed_torques_fail() -> None:
    """2-15: the skew matrix of the displacement with delta_x and delta_z exchanged; 2-19 first row with K_xx X Y for
    K_zx; 2-20 and 2-22 with l_x Y for l_z Y, and K_xx in the products of X for K_zx, K_yx.
    """
    force = MASS * SF
    dx, dy, dz = K @ force
    X, Y, Z = SF
    skew = np.array([[0.0, -dz, dy], [dz, 0.0, -dx], [-dy, dx, 0.0]])
    assert skew @ force == pytest.approx(np.cross(K @ force, force), rel=1e-12)
    exchanged = np.array([[0.0, -dx, dy], [dx, 0.0, -dz], [-dy, dz, 0.0]])
    assert np.abs(exchanged @ force / np.cross(K @ force, force) - 1.0).max() > 1e-3  # E3
    m2 = MASS * MASS
    rest = m2 * ((k("y", "y") - k("z", "z")) * Y * Z - k("z", "y") * Y * Y + k("y", "z") * Z * Z)
    linear = M_0[0] + MASS * L["y"] * Z

    def about_x(arm: float, xy: float, xz: float) -> float:
        return linear - MASS * arm * Y + rest - m2 * xy * X * Y + m2 * xz * X * Z

    assert about_x(L["z"], k("z", "x"), k("y", "x")) == pytest.approx(TORQUE[0], rel=1e-12)
    for wrong in (  # E5, E4 and E6, E6
        about_x(L["x"], k("z", "x"), k("y", "x")),
        about_x(L["z"], k("x", "x"), k("y", "x")),
        about_x(L["z"], k("z", "x"), k("x", "x")),
    ):
        assert abs(wrong / TORQUE[0] - 1.0) > 1e-3


def test_e11_e12_printed_lines_fail() -> None:
    """2-40 has U_x at SF_x and U_z at SF_z; 2-41 other compliances in each line (torque sign, omega_M = +M_y/H)."""
    torque = {n: -v for n, v in ours().items() if n.startswith("Dx_")}
    right = TORQUE[1] / H

    def value(**changed: float) -> float:
        return float(drift.drift(SF / G0, {**torque, **changed}))

    assert value() == pytest.approx(right, rel=1e-12)
    assert abs(value(Dx_x=A * L["x"], Dx_z=-A * L["z"]) / right - 1.0) > 1e-3  # E11
    for changed in (  # E12
        {"Dx_xx": Q * k("x", "x")},
        {"Dx_zz": -Q * k("z", "z")},
        {"Dx_xy": Q * (k("y", "x") + k("x", "y"))},
        {"Dx_yz": Q * (k("y", "z") - k("z", "y"))},
        {"Dx_xz": Q * (k("z", "x") - k("x", "z"))},
    ):
        assert abs(value(**changed) / right - 1.0) > 1e-3


def test_e1_e2_meru() -> None:
    """A thousandth of Earth rate is 0.015041 deg/h, not 0.01541: only with it H omega = 0.145 dyn cm comes out; the
    arm H omega/(m g) = 5.95e-7 cm is a magnitude.
    """
    meru = frames.EARTH_RATE / 1000.0
    assert math.degrees(meru) * 3600.0 == pytest.approx(0.015041, abs=5e-7)
    arm = drift.to_physical(H, MASS, {"D_S": meru * G0 / 9.80})["l_I"]
    assert arm == pytest.approx(5.95e-9, abs=0.005e-9)
    assert abs(math.radians(0.01541 / 3600.0) * H / (MASS * 9.80) - arm) > 0.1e-9


def test_e15_e16_printed_responses_fail() -> None:
    """Float angle against a turn of the case about the output axis: 2-63 prints K_y K_x C s3 as numerator without a
    common bar, 2-65 a plus sign.  The part's own equations, by differentiation, decide.
    """
    part = load_part("compliant_gyro", standard_folder())()
    part.initialize()
    a = np.array(part.jacobian())
    by = {n: np.array(part.tangent({n: 1.0})[0]) for n in ("omega[2]", "alpha[2]")}

    def response(s: complex) -> complex:
        return complex(np.linalg.solve(s * np.eye(len(a)) - a, by["omega[2]"] * s + by["alpha[2]"] * s * s)[0])

    J, C, K_x, K_y = part.J, part.C, part.K_I, part.K_O
    tau = J / C + part.H**2 / (K_x * C)
    for hertz in (1.0, 100.0, 900.0):
        s = 2j * math.pi * hertz
        cubic = part.H**2 * J / (K_x * K_y * C) * s**3
        delta = cubic + part.H**2 / (K_x * K_y) * s**2 + tau * s + 1.0
        assert response(s) == pytest.approx(-(cubic + tau * s) / delta, rel=1e-9)
        printed = -(K_y * K_x * C * s**3) / delta + tau * s
        assert abs(printed / response(s) - 1.0) > 1e-3  # E15
        if hertz == 1.0:
            assert -tau * s / (1.0 + tau * s) == pytest.approx(response(s), rel=1e-3)
            assert abs(tau * s / (1.0 + tau * s) / response(s) - 1.0) > 1.0  # E16
