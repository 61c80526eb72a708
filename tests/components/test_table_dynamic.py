"""The table as it is built, against a loop written from its equations and integrated by scipy."""

import math
from functools import partial

import numpy as np
import pytest
from native_parts import make, stepped
from scipy.integrate import solve_ivp

from gyrobench.packaging.instance import InstanceError

ARCSEC = math.pi / 648000.0
ERU = 7.2921159e-5
QUANTUM = 0.18 * ARCSEC
J, T, K, LAG = 2.56, 5e-3, 9.80665e-4, 5e-4
GCM = 9.80665e-5


@pytest.fixture
def table():
    part = make("table_dynamic", "native")
    yield part
    part.free()


run = partial(stepped, mode=2.0)


def by_hand(rate, load, until, quantum):
    """Angle at each sample: deadbeat law u_k = -0.75 u_k-1 + (2J/T2)(1.25 x_k - 0.75 x_k-1) on counts, root shaper,
    lag, square-law motor, J theta'' = K U|U| + load; command counts rise from the second sample on, with 1 rad/s2.
    """
    theta, v, U, u, x_last, phase, vr = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    out, nxt = [], 0.0
    for k in range(round(until / T)):
        if k:
            phase, vr = phase + 0.5 * (vr + nxt) * T, nxt
            nxt = min(vr + 1.0 * T, rate)
            x = (math.floor(phase / quantum + 1e-5) - math.floor(theta / quantum + 0.5)) * quantum
            u = -0.75 * u + 2.0 * J / T**2 * (1.25 * x - 0.75 * x_last)
            x_last = x
        goal = math.copysign(math.sqrt(abs(u) / K), u)

        def slope(t, y, goal=goal, before=U):
            volt = goal + (before - goal) * math.exp(-t / LAG)
            return [y[1], (K * volt * abs(volt) + load) / J]

        theta, v = solve_ivp(slope, (0.0, T), [theta, v], method="DOP853", rtol=1e-11, atol=1e-14, max_step=2e-4).y[
            :, -1
        ]
        U = goal + (U - goal) * math.exp(-T / LAG)
        out.append(theta)
    return np.array(out)


def test_follows_the_loop_written_by_hand(table):
    """Counts of 2e-4 arcsec: what is left, 3 of them, is when a count falls, and the motor's torque taken at the mean
    voltage of an internal step.
    """
    values = {"quantum": 1e-9, "rate_max": 8e-4, "index_rate": 8e-4}
    expected = by_hand(10.0 * ERU, 140.0 * GCM, 0.4, 1e-9)
    seen = run(table, 0.4, ["angle"], target=10.0 * ERU, M_load=140.0 * GCM, **values)[4::5, 0]
    assert np.abs(seen - expected).max() < 3e-9
    assert np.ptp(expected) > 2e-4


@pytest.mark.parametrize("rate", [0.01, 1.0, 100.0, 999.99])
def test_rate_of_the_time_base_whatever_the_load(table, rate):
    """700 g.cm: error M / stiffness = 0.24 arcsec [CTRL-SAMPLED], jitter of the counts added; mean rate exact."""
    rows = run(table, 12.0, ["angle", "e", "in_position"], target=rate * ERU, M_load=700.0 * GCM)
    still = rows[2000:]
    assert still[:, 2].min() == 1.0
    assert abs(np.mean(still[:, 1])) == pytest.approx(0.24 * ARCSEC, abs=0.1 * ARCSEC)
    mean = (rows[-1, 0] - rows[1999, 0]) / 10.0
    assert mean == pytest.approx(rate * ERU, abs=2.0 * 0.71 * ARCSEC / 10.0)


def test_goes_to_an_angle(table):
    """10 deg at 100 ERU, 1 rad/s2: 0.174533 / 7.29212e-3 = 23.934 s and one ramp of 7.3 ms; at rest to 1 arcsec."""
    at = math.radians(10.0)
    rows = run(
        table, 26.0, ["angle", "in_position", "torque"], mode=1.0, target=at, index_rate=100.0 * ERU, M_load=140.0 * GCM
    )
    arrived = np.argmax(rows[:, 1] == 1.0) * 1e-3
    assert 23.94 < arrived < 24.2
    assert np.abs(rows[25000:, 0] - at).max() < 0.6 * ARCSEC
    assert np.abs(rows[:, 2]).max() < 9.8


def test_the_table_goes_where_its_scale_says(table):
    """The loop keeps reading = command: the true angle is the command less the error of the scale, 3 arcsec cos a."""
    names = {"scale_eccentricity": 3.0 * ARCSEC, "scale_eccentricity_phase": 0.5 * math.pi}
    at = math.radians(60.0)
    rows = run(table, 12.5, ["angle", "angle_read"], mode=1.0, target=at, **names)
    assert np.mean(rows[-500:, 0]) - at == pytest.approx(-1.5 * ARCSEC, abs=0.1 * ARCSEC)
    assert rows[-1, 1] == pytest.approx(at, abs=0.3 * ARCSEC)


@pytest.mark.parametrize("h", [1e-3, 2.5e-3])
def test_acceleration_turns_into_the_change_of_rate(table, h):
    """alpha is the mean over the communication step: its sum is the change of omega, jitter or not."""
    rows = run(table, 1.0, ["omega[3]", "alpha[3]"], h, target=10.0 * ERU, **{"omega_local[3]": 5e-5})
    assert np.sum(rows[:, 1]) * h == pytest.approx(rows[-1, 0] - 5e-5, abs=1e-14)
    assert np.std(rows[200:, 1]) > 1e-3  # it does jitter


def test_less_jitter_with_softer_poles(table):
    """p = 0.7 for 0: rate jitter 14 times less without lag, stiffness 16 times less.  [CTRL-SAMPLED]"""
    soft = run(table, 5.0, ["rate"], target=10.0 * ERU, law_p=0.7)
    other = make("table_dynamic", "native")
    hard = run(other, 5.0, ["rate"], target=10.0 * ERU)
    other.free()
    assert np.std(hard[2000:, 0]) > 5.0 * np.std(soft[2000:, 0])


def test_refuses_what_the_drive_cannot_do(table):
    with pytest.raises(InstanceError, match="rate_max"):
        run(table, 0.1, ["angle"], target=2100.0 * ERU)


def test_refuses_a_sampling_period_that_does_not_fit(table):
    with pytest.raises(InstanceError, match="not a multiple of the internal step"):
        run(table, 0.1, ["angle"], step=1e-3, period=5.5e-3, target=ERU)
