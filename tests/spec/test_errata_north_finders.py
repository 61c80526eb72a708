"""Errata of the north finders (GSP ch. 5, eq. 5-44..5-65): headings, tilt, strapdown."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gyrobench.units import EARTH_RATE

LATITUDE = np.radians(40.0)
NORTH, UP = EARTH_RATE * np.cos(LATITUDE), EARTH_RATE * np.sin(LATITUDE)
HEADINGS = np.radians([-170, -135, -90, -60, -30, -5, 1, 20, 40, 80, 120, 150, 179])
G = 9.80665


def attitude(psi: float, theta: float, gamma: float) -> Any:
    """C_g^b = Ry(gamma) Rx(theta) Rz(psi) of 5-57, ENU to right, forward, up; psi clockwise from north."""
    (c, s), (ct, st), (cg, sg) = ((np.cos(a), np.sin(a)) for a in (psi, theta, gamma))
    y, x = np.array([[cg, 0, -sg], [0, 1, 0], [sg, 0, cg]]), np.array([[1, 0, 0], [0, ct, st], [0, -st, ct]])
    return y @ x @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def wrap(angle: Any) -> Any:
    return (np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi


def test_four_positions() -> None:
    """EG16: psi_2 is an arcsine, the printed arccosine gives psi + 90 deg.  EG17: 5-51 holds for 0 to 90 deg."""
    for psi in HEADINGS:
        w = [NORTH * np.cos(psi + k * np.pi / 2) for k in range(4)]
        assert wrap(np.arctan2(w[3] - w[1], w[0] - w[2]) - psi) == pytest.approx(0.0, abs=1e-12)
    psi = np.radians(40.0)
    w = [NORTH * np.cos(psi + k * np.pi / 2) for k in range(4)]
    first, printed = np.arccos((w[0] - w[2]) / (2 * NORTH)), np.arccos((w[1] - w[3]) / (2 * NORTH))
    assert printed == pytest.approx(psi + np.pi / 2)
    assert np.arcsin((w[3] - w[1]) / (2 * NORTH)) == pytest.approx(psi)
    assert abs(first * np.sin(first) ** 2 + printed * np.cos(printed) ** 2 - psi) > np.radians(20.0)
    for heading, fits in ((60.0, True), (-40.0, False), (120.0, False)):
        one, two = np.arccos(np.cos(np.radians(heading))), np.arcsin(np.sin(np.radians(heading)))
        mean = one * np.sin(one) ** 2 + two * np.cos(two) ** 2
        assert bool(abs(mean - np.radians(heading)) < 1e-9) is fits


def test_weights_of_noisy_headings() -> None:
    """EG17: weights taken from the noisy headings enlarge the error: 17' for 7.3' at 60 deg."""
    rng, psi, noise = np.random.default_rng(46), np.radians(60.0), 1.5e-3
    w = [np.cos(psi + k * np.pi / 2) + noise * rng.normal(size=20_000) for k in range(4)]
    one, two = np.arccos((w[0] - w[2]) / 2), np.arcsin((w[3] - w[1]) / 2)
    weighted = one * np.sin(one) ** 2 + two * np.cos(two) ** 2
    assert np.std(weighted) / np.std(np.arctan2(w[3] - w[1], w[0] - w[2])) == pytest.approx(17.0 / 7.3, rel=0.05)


def test_continuous_rotation() -> None:
    """EG18: sum w_i sin in 5-54.  EG19: sum w_i cos and the sign of B in 5-55.  EG20: atan2."""
    alpha, A, B = np.sort(np.random.default_rng(8).uniform(0, 2 * np.pi, 17)), -0.8, -0.5
    w, s, c = A * np.cos(alpha) - B * np.sin(alpha), np.sin(alpha), np.cos(alpha)
    ss, cc, sc, wc, ws = s @ s, c @ c, s @ c, w @ c, w @ s
    D = ss * cc - sc**2
    assert (ss * wc - sc * ws) / D == pytest.approx(A) and (sc * wc - cc * ws) / D == pytest.approx(B)
    assert (ss * wc - np.sum(np.sin(w)) * sc) / D != pytest.approx(A, rel=0.01)
    assert (cc * ws - sc * wc) / D == pytest.approx(-B)  # printed sign, its first sum mended: heading negated
    assert (cc * ws - c.sum() * sc) / D != pytest.approx(B, rel=0.01)
    psi = np.arctan2(B, A)
    assert abs(wrap(np.arctan(B / A) - psi)) == pytest.approx(np.pi)


def test_tilted_table() -> None:
    """EG21: + in 5-59; the printed minus doubles the error of a tilt.  EG22: asin(f_y/g) is for specific force."""
    for psi in HEADINGS:
        theta, gamma = 0.03, -0.02
        C = attitude(psi, theta, gamma)
        rate, force = C @ [0.0, NORTH, UP], C @ [0.0, 0.0, G]
        assert rate[1] == pytest.approx(NORTH * np.cos(psi) * np.cos(theta) + UP * np.sin(theta))
        assert abs(rate[1] - (NORTH * np.cos(psi) * np.cos(theta) - UP * np.sin(theta))) > 1e-6
        assert np.arcsin(force[1] / G) == pytest.approx(theta) and np.arcsin(-force[1] / G) == pytest.approx(-theta)
        assert -np.arcsin(force[0] / (G * np.cos(theta))) == pytest.approx(gamma)


def rotated(psi: float, tilt: float, sign: float) -> float:
    """Heading error by continuous rotation about an axis tilted about north, compensated with ``sign`` (0: not)."""
    alpha = 2 * np.pi * np.arange(48) / 48
    about_north = np.array([[np.cos(tilt), 0, -np.sin(tilt)], [0, 1, 0], [np.sin(tilt), 0, np.cos(tilt)]])
    axes = np.c_[np.sin(psi + alpha), np.cos(psi + alpha), np.zeros(48)] @ about_north
    w = axes @ [0.0, NORTH, UP]
    sine = axes[:, 2]  # f_y/g
    w = (w - sign * UP * sine) / np.sqrt(1 - sine**2)
    A, B, _ = np.linalg.lstsq(np.c_[np.cos(alpha), -np.sin(alpha), np.ones(48)], w, rcond=None)[0]
    return float(wrap(np.arctan2(B, A) - psi))


def test_sign_of_the_tilt_compensation() -> None:
    """EG21: 10 mrad about north: 28.9' without compensation, none with +, 57.8' with the printed sign."""
    plain, right, printed = (np.degrees(rotated(0.7, 0.01, sign)) * 60 for sign in (0.0, 1.0, -1.0))
    assert abs(plain) == pytest.approx(28.9, abs=0.3) and abs(right) < 0.15
    assert abs(printed) == pytest.approx(57.8, abs=0.6)


def test_strapdown() -> None:
    """EG23: + sin psi sin gamma in row 3 of 5-63.  EG24: w_ie sin(latitude) in 5-65c, printed w_ie: 3.3 deg off."""
    worst = 0.0
    for psi in HEADINGS:
        theta, gamma = 0.0873, 0.0873  # 5 deg
        x, y, z = attitude(psi, theta, gamma) @ [0.0, NORTH, UP]
        cos, sin = np.cos, np.sin
        third = -(cos(psi) * sin(theta) * cos(gamma) + sin(psi) * sin(gamma)) * NORTH + cos(theta) * cos(gamma) * UP
        assert z == pytest.approx(third, rel=1e-9)
        for rate in (UP, EARTH_RATE):
            above = -(x * cos(theta) - y * sin(gamma) * sin(theta) + rate * sin(gamma))
            off = abs(wrap(np.arctan2(above, (y - rate * sin(theta)) * cos(gamma)) - psi))
            if rate == UP:
                assert off < 1e-9
            else:
                worst = max(worst, float(np.degrees(off)))
        printed = -(cos(psi) * sin(theta) * cos(gamma) - sin(psi) * sin(gamma)) * NORTH + cos(theta) * cos(gamma) * UP
        assert abs(sin(psi)) < 0.1 or abs(z - printed) > 1e-6
    assert worst == pytest.approx(3.3, abs=0.2)
