"""directional_gyro, magnetic_sensor, slaving: drift, gimballing, tilt, iron, limit, cut-off."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

Gyro = load_part("directional_gyro", BENCH)
Sensor = load_part("magnetic_sensor", BENCH)
Slaving = load_part("slaving", BENCH)
DEG = math.pi / 180.0


def case_axes(pitch, roll, heading):
    """Rows: case axes x right, y forward, z up in ENU; heading, pitch, roll in this order, by scipy."""
    return Rotation.from_euler("ZXY", [heading, pitch, roll]).as_matrix().T


def test_free_gyro_drifts_by_the_vertical_earth_rate():
    """At 40 degrees: -7.2921159e-5 sin 40 = -4.6873e-5 rad/s, 9.67 deg/h, whatever the heading."""
    up = 7.2921159e-5 * math.sin(40 * DEG)
    assert up / DEG * 3600.0 == pytest.approx(9.67, abs=0.005)
    for heading in (0.0, 1.0):
        part = Gyro()
        part.angle[:] = [0.0, 0.0, heading]
        part.omega[:] = [0.0, 7.2921159e-5 * math.cos(40 * DEG) * math.cos(heading), up]
        part.omega[0] = 7.2921159e-5 * math.cos(40 * DEG) * math.sin(heading)
        part.initialize()
        for k in range(100):
            part.do_step(k * 1.0, 1.0)
        assert part.get("psi") + heading == pytest.approx(-100.0 * up, rel=1e-9)


@pytest.mark.parametrize(("pitch", "roll"), [(0.0, 0.5), (0.3, 0.0), (0.2, -0.7)])
def test_gimballing_error_is_the_projection_of_the_rotor_axis(pitch, roll):
    """Rotor axis level, north; read about the case's z between its projection and forward.

    By vectors: v = C (0, 1, 0), psi = atan2(-v_x, v_y); at pitch 0 tan psi = cos(roll) tan(heading).
    """
    for psi in (0.4, 1.1, 2.5, -2.0):
        part = Gyro()
        part.angle[:] = [pitch, roll, -psi]
        part.initialize()
        v = case_axes(pitch, roll, -psi) @ [0.0, 1.0, 0.0]
        assert part.get("psi") == pytest.approx(math.atan2(-v[0], v[1]), abs=1e-12)
        if pitch == 0.0:
            assert math.tan(part.get("psi")) == pytest.approx(math.cos(roll) * math.tan(psi), rel=1e-12)
        assert part.get("azimuth") == pytest.approx(psi)


def test_gyro_keeps_its_direction_through_a_banked_turn():
    """A turn of 90 degrees clockwise under 30 degrees of bank: the azimuth follows the vertical rate."""
    rate, part = 3 * DEG, Gyro()
    part.initialize()
    for k in range(300):
        heading = -rate * 0.1 * (k + 1)
        part.angle[:] = [0.0, 0.5, heading]
        part.omega[:] = case_axes(0.0, 0.5, heading) @ [0.0, 0.0, -rate]
        part.do_step(k * 0.1, 0.1)
    assert part.get("azimuth") == pytest.approx(math.pi / 2.0, rel=1e-9)


def read(angle=(0.0, 0.0, 0.0), f=(0.0, 0.0, 9.80665), **parameters):
    part = Sensor(**parameters)
    part.angle[:] = angle
    part.f[:] = f
    part.initialize()
    return part.get("psi")


def test_level_sensor_shows_the_magnetic_heading():
    """True heading 50 degrees clockwise, declination 8 degrees clockwise: 42."""
    assert read((0.0, 0.0, -50 * DEG), declination=8 * DEG) / DEG == pytest.approx(42.0)


def test_bank_without_acceleration_does_not_tilt_a_pendulum():
    """At rest the pendulum is level whatever the bank; fixed in the case the vertical field comes in."""
    angle, gravity = (0.1, 0.4, -1.0), case_axes(0.1, 0.4, -1.0) @ [0.0, 0.0, 9.80665]
    assert read((0.0, 0.4, -1.0), case_axes(0.0, 0.4, -1.0) @ [0.0, 0.0, 9.80665]) == pytest.approx(1.0, abs=1e-12)
    assert abs(read(angle, gravity) - 1.0) < 1e-12
    assert abs(read(angle, gravity, pendulous=0) - 1.0) > 5 * DEG


def test_turning_error_is_that_of_the_tilted_plane():
    """Heading north, plane tilted by delta to the right: tan psi_m = tan I sin(delta), I = 60 degrees.

    Clockwise turn: a to the right (east), f = (v w, 0, g): the plumb leans to the right, so that x' points down by
    delta; the field's down component makes B . x' = B_h tan I sin(delta), and psi_m = -atan of it.
    """
    a = 50.0 * 3.0 * DEG
    delta = math.atan2(a, 9.80665)
    assert read(f=(a, 0.0, 9.80665)) == pytest.approx(-math.atan(math.tan(60 * DEG) * math.sin(delta)), rel=1e-4)


def test_iron():
    """Hard iron, a tenth of the field to the right: heading north shows atan(-0.1); soft iron 1.1 along x."""
    assert read(hard=[3e-6, 0.0, 0.0]) == pytest.approx(-math.atan(0.1))
    soft = [[1.1, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    assert math.tan(read((0.0, 0.0, -0.6), soft=soft)) == pytest.approx(1.1 * math.tan(0.6))


def test_pendulum_follows_with_its_time_constant():
    part = Sensor(tau=2.0)
    part.initialize()
    part.f[:] = [1.0, 0.0, 9.75549]
    for k in range(20):
        part.do_step(k * 0.1, 0.1)
    assert part.get("n[1]") == pytest.approx((1.0 - math.exp(-1.0)) / 9.80665, rel=1e-4)


def test_too_weak_a_field_is_refused():
    with pytest.raises(ComponentError, match="field = 4e-06 T"):
        Sensor(field=4e-6).initialize()


def rate(psi, psi_m, turn=0.0, **parameters):
    part = Slaving(**parameters)
    part.psi, part.psi_m, part.turn = psi, psi_m, turn
    part.initialize()
    return part.get("rate")


def test_slaving_law():
    """k e with k = 1/60; the limit 2 deg/min; the short way round; cut off above 0.2 deg/s, but for the correction."""
    assert rate(0.0, 0.01) == pytest.approx(0.01 / 60.0)
    assert rate(0.0, -1.0) == pytest.approx(-2 * DEG / 60.0)
    assert rate(179.5 * DEG, -179.5 * DEG) == pytest.approx(DEG / 60.0)
    assert rate(0.0, 0.01, declination=0.02) == pytest.approx(0.03 / 60.0)
    assert rate(0.0, 0.01, turn=-0.3 * DEG, correction=1e-5) == 1e-5
    assert rate(0.0, 0.01, turn=-0.3 * DEG, cut_off=False) == pytest.approx(0.01 / 60.0)
    with pytest.raises(ComponentError):
        Slaving(k=0.0).initialize()


def test_random_drift_has_its_density():
    """After 1000 steps of 1 s the walk has the standard deviation 1e-3 sqrt(1000); 60 seeds: 9 %, here 2.5 of these."""
    ends = []
    for seed in range(1, 61):
        part = Gyro(white=1e-3, seed=seed)
        part.initialize()
        for k in range(100):
            part.do_step(k * 10.0, 10.0)
        ends.append(part.get("azimuth"))
    assert float(np.std(ends)) == pytest.approx(1e-3 * math.sqrt(1000.0), rel=0.23)
