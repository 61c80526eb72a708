"""Drift models against the cross product they come from."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gyrobench import drift
from gyrobench.units import G0

rng = np.random.default_rng(5)


def test_term_sets() -> None:
    assert {n: len(drift.terms(n)) for n in (3, 4, 5, 8, 9, 10)} == {3: 3, 4: 4, 5: 5, 8: 8, 9: 9, 10: 10}
    assert set(drift.NAMES) - set(drift.terms(9)) == {"D_OO"}
    assert set(drift.NAMES) - set(drift.terms(8)) == {"D_OO", "D_O"}
    with pytest.raises(ValueError, match="7-term drift model unknown; there are 3, 4, 5, 8, 9, 10"):
        drift.terms(7)


def test_regressors() -> None:
    assert drift.regressors([2.0, 3.0, 5.0]).tolist() == [1, 2, 3, 5, 4, 9, 25, 6, 15, 10]
    assert [drift.order(n) for n in drift.NAMES] == [0, 1, 1, 1, 2, 2, 2, 2, 2, 2]
    assert drift.surface_unit("D_IS") == "deg/h/g2"
    with pytest.raises(KeyError, match="D_XX"):
        drift.drift([0, 0, 1], {"D_XX": 1.0})


def test_physical_form_is_the_cross_product() -> None:
    """[STATIC-DRIFT] omega_d = -M_y/H with M = M_0 + l x (m SF) + (K m SF) x (m SF)."""
    H, m = 0.2, 0.25
    arm, K, SF = rng.normal(size=3) * 1e-6, rng.uniform(0, 1e-7, (3, 3)), rng.normal(size=3) * G0
    torque = 1e-7 + np.cross(arm, m * SF)[1] + np.cross(K @ (m * SF), m * SF)[1]
    D = drift.from_physical(
        H,
        m,
        {
            "M_O": 1e-7,
            "l_I": arm[0],
            "l_S": arm[2],
            "K_SI": K[2, 0],
            "K_IS": K[0, 2],
            "K_SO": K[2, 1],
            "K_IO": K[0, 1],
            "K_SS": K[2, 2],
            "K_II": K[0, 0],
        },
    )
    assert float(drift.drift(SF / G0, D)) == pytest.approx(-torque / H, rel=1e-12)


def test_physical_round_trip() -> None:
    D = {n: v for n, v in drift.STANDARD.items() if n not in ("D_O", "D_OO")}
    p = drift.to_physical(0.2, 0.25, D)
    assert drift.from_physical(0.2, 0.25, p) == pytest.approx(D, rel=1e-14)


def test_acceptance_ex_6e_7() -> None:
    """[EX-6e-7] H = 0.2, drift 1 meru, m = 0.25 kg, g = 9.80: l = 5.95e-9 m."""
    # by hand: 0.2 * 7.2921159e-8 / (0.25 * 9.80) = 5.953e-9
    arm = drift.to_physical(0.2, 0.25, {"D_S": 7.2921159e-8 * G0 / 9.80})["l_I"]  # D is per g0
    assert arm == pytest.approx(5.952e-9, rel=1e-3)


@pytest.mark.parametrize(
    ("H", "m", "p", "message"),
    [
        (0.0, 0.25, {}, "H = 0"),
        (0.2, -1.0, {}, "m = -1"),
        (float("nan"), 1.0, {}, "H = nan"),
        (0.2, 0.25, {"l_O": 1.0}, "'l_O' unknown"),
        (0.2, 0.25, {"K_SS": -1e-9, "K_II": 0.0}, "K_SS = -1e-09.*>= 0"),
        (0.2, 0.25, {"K_SS": 1e-9}, "K_II is missing"),
        (0.2, 0.25, {"l_I": math.inf}, "no finite number"),
        (0.2, 0.25, {"K_SS": 1e-9, "K_II": 0.0, "K_SS-K_II": 1e-9}, "twice"),
    ],
)
def test_physical_refusals(H: float, m: float, p: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        drift.from_physical(H, m, p)


def test_double_definition_is_refused() -> None:
    assert drift.merge({"D_F": 1.0}, 0.2, 0.25, {"l_I": 1e-9}).keys() == {"D_F", "D_S"}
    with pytest.raises(ValueError, match="D_S: given as coefficient and by physical"):
        drift.merge({"D_S": 1.0}, 0.2, 0.25, {"l_I": 1e-9})
    with pytest.raises(ValueError, match="D_O = 1"):
        drift.to_physical(0.2, 0.25, {"D_O": 1.0})


def test_two_channels_are_the_cross_product() -> None:
    """[STATIC-DRIFT] omega_dx = -M_y/H, omega_dy = +M_x/H; the outer gimbal acts about the outer axis x only."""
    H, m, outer = 0.2, 0.25, 3e-7
    M, arm, K = rng.normal(size=3) * 1e-7, rng.normal(size=3) * 1e-6, rng.uniform(0, 1e-7, (3, 3))
    SF = rng.normal(size=3) * G0
    torque = M + np.cross(arm, m * SF) + np.cross(K @ (m * SF), m * SF)
    about_x = torque[0] + np.cross([0.0, 0.0, outer], SF)[0]
    physical = {"M_x": M[0], "M_y": M[1], "l_x": arm[0], "l_y": arm[1], "l_z": arm[2]}
    physical |= {f"K_{a}{b}": K[i, j] for i, a in enumerate("xyz") for j, b in enumerate("xyz")}
    D = drift.from_physical_2dof(H, m, physical, outer)
    x = {n: v for n, v in D.items() if n.startswith("Dx")}
    y = {n: v for n, v in D.items() if n.startswith("Dy")}
    assert float(drift.drift(SF / G0, x)) == pytest.approx(-torque[1] / H, rel=1e-12)
    assert float(drift.drift(SF / G0, y)) == pytest.approx(about_x / H, rel=1e-12)
    # the table of GYRO-STATIC-8, entry by entry
    q = m * m * G0 * G0 / H
    assert D["Dy_xy"] == pytest.approx(-q * K[2, 0]) and D["Dy_xz"] == pytest.approx(q * K[1, 0])
    assert D["Dy_yz"] == pytest.approx(q * (K[1, 1] - K[2, 2])) and D["Dy_yy"] == pytest.approx(-q * K[2, 1])
    assert D["Dx_x"] - D["Dy_y"] == pytest.approx(outer * G0 / H)


def test_two_channels_names_and_refusals() -> None:
    assert drift.terms_2dof("x", 8) == tuple(f"Dx_{n}" for n in ("0", "x", "z", "xx", "zz", "xy", "yz", "xz"))
    assert set(drift.terms_2dof("y", 9)) == {f"Dy_{n}" for n in ("0", "x", "y", "z", "yy", "zz", "xy", "xz", "yz")}
    assert [drift.order(n) for n in drift.NAMES_2DOF["y"]] == [drift.order(n) for n in drift.NAMES]
    assert drift.regressors([2.0, 3.0, 5.0], ("Dy_0", "Dy_x", "Dx_yz", "Dy_zz")).tolist() == [1, 2, 15, 25]
    rate = drift.at_points({"Dy_0": 1.0, "Dy_x": 10.0, "Dx_yz": 100.0, "Dy_zz": 1000.0, "Dy_z": 0.0})
    assert rate((2.0, 3.0, 5.0)) == 1.0 + 20.0 + 1500.0 + 25000.0
    only = drift.from_physical_2dof(0.2, 0.25, {"K_zz": 3e-9, "K_yy": 1e-9})
    assert only.keys() == {"Dy_yz"}
    with pytest.raises(KeyError, match="Dy_x"):
        drift.drift([0, 0, 1], {"Dx_0": 1.0, "Dy_x": 1.0})
    for physical, message in (
        ({"l_q": 1.0}, "'l_q' unknown for a two"),
        ({"K_zz": 1e-9}, r"x channel \(I, O, S = x, y, z\): D_IS needs K_SS and K_II; K_II is missing"),
        ({"K_yy": 1e-9}, r"y channel \(I, O, S = y, -x, z\): D_IS needs K_SS and K_II; K_SS is missing"),
        ({"K_zz": 1e-9, "K_yy": -1e-9, "K_xx": 0.0}, "y channel .*K_II = -1e-09"),
        ({"M_x": math.nan}, "y channel .*no finite number"),
    ):
        with pytest.raises(ValueError, match=message):
            drift.from_physical_2dof(0.2, 0.25, physical)


def test_signs() -> None:
    """[CONV-SIGNS] SF -> -f changes the linear terms; torque sign changes all."""
    D = dict(zip(drift.NAMES, rng.normal(size=10), strict=True))
    v = rng.normal(size=3)
    here = float(drift.drift(v, D))
    assert float(drift.drift(v, drift.change_sign(D, "precession", "torque"))) == pytest.approx(-here)
    assert float(drift.drift(-v, drift.change_sign(D, "precession", "precession_f"))) == pytest.approx(here)
    assert float(drift.drift(-v, drift.change_sign(D, "precession", "ieee"))) == pytest.approx(-here)
    for c in drift.CONVENTIONS:
        assert drift.change_sign(drift.change_sign(D, "precession", c), c, "precession") == pytest.approx(D)
    with pytest.raises(ValueError, match="'nasa' unknown"):
        drift.change_sign(D, "nasa", "ieee")


def test_standard_gyro_is_the_table_of_the_source_in_precession_sign() -> None:
    s = {n: v * 3600 * 180 / math.pi for n, v in drift.STANDARD.items()}
    # omega_M = R + U_z X - U_x Z + (Kzz-Kxx) XZ + Kzx X2 ...
    torque = drift.change_sign(s, "precession", "torque")
    assert torque == pytest.approx(
        {
            "D_F": 0.3,
            "D_I": 0.9,
            "D_O": -0.1,
            "D_S": 0.7,
            "D_II": 0.05,
            "D_OO": 0.0,
            "D_SS": -0.04,
            "D_IO": 0.03,
            "D_OS": 0.02,
            "D_IS": 0.15,
        }
    )
