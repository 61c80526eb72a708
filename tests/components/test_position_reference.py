"""Polygon, autocollimator and level: readings by hand, against scipy's rotations, range of the autocollimator."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wired import BENCH

from gyrobench.packaging import load_part

PositionReference = load_part("position_reference", BENCH)
ARCSEC = math.pi / 648000
QUIET = {"optical": 0.0, "level_x_noise": 0.0, "level_y_noise": 0.0}


def read(angle=0.0, f=(0.0, 0.0, 9.8), azimuth=0.0, **parameters):
    part = PositionReference(**QUIET, **parameters)
    c, s = math.cos(azimuth), math.sin(azimuth)
    part.angle, part.f, part.face = angle, list(f), [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]
    part.initialize()
    return part


def test_deviation_by_hand():
    errors = [k * ARCSEC for k in range(72)]
    # 12 faces: 61 deg is 1 deg beyond face 2; the error of that face is taken off, the zero added
    part = read(math.radians(60) + 3 * ARCSEC, errors=errors, zero=10 * ARCSEC)
    assert part.deviation / ARCSEC == pytest.approx(3 - 2 + 10, abs=1e-9)
    # turned by 90 deg against the plate face 5 is seen at 60 deg; whole turns do not matter
    part = read(math.radians(60 - 720) + 3 * ARCSEC, azimuth=math.radians(90), errors=errors)
    assert part.deviation / ARCSEC == pytest.approx(3 - 5, abs=1e-8)
    assert part.lost == 0.0 and read(math.radians(1.0)).lost == 1.0


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.5])
def test_level_against_rotations(angle):
    """A base tilted about its first and second axis, a table on it, a plate that leans: all turned by scipy."""
    tilt, azimuth = (30 * ARCSEC, -20 * ARCSEC), 0.9
    base = (Rotation.from_rotvec([tilt[0], 0, 0]) * Rotation.from_rotvec([0, tilt[1], 0])).inv()
    f = Rotation.from_rotvec([0, 0, angle]).inv().apply(base.apply([0, 0, 9.8]))
    part = read(angle, f, azimuth, plate=[3 * ARCSEC, 4 * ARCSEC], level_zero=[1 * ARCSEC, 2 * ARCSEC])
    p = (-tilt[1] + 1j * tilt[0]) * np.exp(-1j * angle) + (3 + 4j) * ARCSEC
    expected = p * np.exp(-1j * azimuth) + (1 + 2j) * ARCSEC
    assert part.level_x == pytest.approx(expected.real, abs=1e-8)  # second order of the tilts
    assert part.level_y == pytest.approx(expected.imag, abs=1e-8)
