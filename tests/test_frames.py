"""Frames: gravity against an independent library, attitudes against hand-derived components."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gyrobench import frames
from gyrobench.frames import E, N, U

LATS = [math.radians(v) for v in (0.0, 12.3, 45.75, -33.0, 78.0)]


def test_gravity_on_the_ellipsoid_to_1e_9() -> None:
    boule = pytest.importorskip("boule")
    for lat in (-90.0, -33.3, 0.0, 10.0, 45.75, 89.0):
        exact = float(boule.WGS84.normal_gravity((0.0, lat, 0.0), si_units=True))
        assert frames.normal_gravity(math.radians(lat)) == pytest.approx(exact, abs=1e-9)


def test_gravity_at_height_keeps_its_stated_error() -> None:
    boule = pytest.importorskip("boule")
    for lat in (0.0, 45.75, 90.0):
        for h in (-300.0, 500.0, 1000.0, 4000.0):
            exact = float(boule.WGS84.normal_gravity((0.0, lat, h), si_units=True))
            assert abs(frames.normal_gravity(math.radians(lat), h) - exact) < 1.1e-10 * abs(h) + 1e-11
    # the quadratic term: second difference 6 g h2/a2
    second = frames.normal_gravity(0.8, 1e4) + frames.normal_gravity(0.8, -1e4) - 2 * frames.normal_gravity(0.8)
    assert second == pytest.approx(6 * 9.806 * (1e4 / 6378137.0) ** 2, rel=1e-3)


@pytest.mark.parametrize(("lat", "h"), [(1.6, 0.0), (float("nan"), 0.0), (0.0, 1e6), (0.0, float("nan"))])
def test_gravity_refuses(lat: float, h: float) -> None:
    with pytest.raises(ValueError, match="outside"):
        frames.normal_gravity(lat, h)


def test_pole_and_earth_rate() -> None:
    assert frames.pole(math.pi / 2) == pytest.approx(U)
    assert frames.pole(0.0) == pytest.approx(N)
    assert np.linalg.norm(frames.earth_rate_local(0.7)) == pytest.approx(7.2921159e-5)


@pytest.mark.parametrize("lat", LATS)
def test_polar_base(lat: float) -> None:
    base = frames.check_rotation(frames.polar_base(lat), "base")
    c, s = math.cos(lat), math.sin(lat)
    assert base[0] == pytest.approx(E)
    assert base[1] == pytest.approx([0.0, s, -c])  # p x E
    assert base[2] == pytest.approx([0.0, c, s])
    assert frames.to_face(frames.earth_rate_local(lat), np.eye(3), base, 1.234) == pytest.approx([0, 0, 7.2921159e-5])


@pytest.mark.parametrize("lat", LATS)
def test_tumble_geometry(lat: float) -> None:
    """[TUM1-GEOM] gamma = (-c sin t, -s, -c cos t), (-c sin t, s, c cos t), (0, -1, 0), (0, 1, 0), t =
    -angle.
    """
    base, c, s = frames.polar_base(lat), math.cos(lat), math.sin(lat)
    faces = frames.tumble_faces(lat)
    for name, face in faces.items():
        frames.check_rotation(face, name)
    for theta in np.linspace(0, 6, 7):
        gamma = {n: frames.to_face(-U, faces[n], base, -theta) for n in ("mount 1", "mount 2")}
        assert gamma["mount 1"] == pytest.approx([-c * math.sin(theta), -s, -c * math.cos(theta)])
        assert gamma["mount 2"] == pytest.approx([-c * math.sin(theta), s, c * math.cos(theta)])
    assert frames.to_face(-U, faces["static 3"], base, 0.0) == pytest.approx([0, -1, 0])
    assert frames.to_face(-U, faces["static 4"], base, 0.0) == pytest.approx([0, 1, 0])
    for face in faces.values():  # input axis east: no Earth rate at angle 0
        assert frames.to_face(frames.earth_rate_local(lat), face, base, 0.0)[0] == pytest.approx(0, abs=1e-20)


def test_mount_two_is_mount_one_turned_about_its_input_axis() -> None:
    assert frames.MOUNTS[2] == pytest.approx(frames.MOUNTS[1] @ frames.rotation([1, 0, 0], math.pi).T)


def test_passive_and_active_rotation() -> None:
    np.testing.assert_allclose(frames.rotation(U, 0.3).T, frames.passive_z(0.3), atol=1e-15)
    assert frames.rotation(U, math.pi / 2) @ E == pytest.approx(N)
    with pytest.raises(ValueError, match="no direction"):
        frames.rotation([0, 0, 0], 1.0)


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.diag([1, 1, -1]), "left-handed"),
        (np.diag([1, 1, 1.1]), "not orthonormal"),
        (np.eye(2), "3x3"),
        (np.full((3, 3), np.nan), "non-finite"),
        (np.eye(3) + 2e-9, "not orthonormal"),
    ],
)
def test_no_rotation_is_refused_by_name(matrix: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=f"mount 7.*{message}"):
        frames.check_rotation(matrix, "mount 7")
