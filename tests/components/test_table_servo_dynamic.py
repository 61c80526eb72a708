"""A table that its gyro holds by a sampled controller, against the loop written from its equations."""

import math

import numpy as np
import pytest
from native_parts import make
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from gyrobench.packaging.instance import InstanceError

ARCSEC = math.pi / 648000.0
GCM = 9.80665e-5
J, T, K, LAG, H_STEP = 2.56, 5e-3, 9.80665e-4, 5e-4, 1e-3
H, J_G, C_G, K_SG = 0.2, 2e-4, 0.2, 10.0  # H/c = 1, 1 ms: 10 V per rad of the table
SENSITIVITY = K_SG * H / C_G


@pytest.fixture
def table():
    part = make("table_servo_dynamic", "native")
    yield part
    part.free()


class Gyro:
    """Float without drift: J_g b'' + C_g b' = H w, its rate held at the mean of each step; u = K_sg b."""

    def __init__(self, polarity=1.0, drift=0.0):
        self.x = np.zeros(2)
        m = np.array([[0.0, 1.0, 0.0], [0.0, -C_G / J_G, H / J_G], [0.0, 0.0, 0.0]])
        self.step, self.polarity, self.drift = expm(m * H_STEP)[:2], polarity, drift

    def after(self, turned):
        self.x = self.step @ [*self.x, self.polarity * turned / H_STEP - self.drift]
        return K_SG * self.x[0]


def hold(part, until, gyro, base=0.0, torque=lambda t: 0.0, **values):
    """Let the gyro hold the table on a base that turns; return angle, reading, in_position after each step."""
    part.set({"mode": 3.0, "omega_local[3]": base, **{k: float(v) for k, v in values.items()}})
    part.initialize()
    rows, u, before = [], 0.0, 0.0
    for k in range(round(until / H_STEP)):
        t = k * H_STEP
        part.set({"u": u, "torque": torque(t)})
        part.step(t, H_STEP)
        rows.append(part.get(["angle", "angle_read", "in_position"]))
        u = gyro.after(rows[-1][0] - before + base * H_STEP)
        before = rows[-1][0]
    return np.array(rows)


def by_hand(torque, until, p):
    """Angle at each sample under a constant torque: u_k = b u_k-1 + (2J/T2)(g x_k - a x_k-1), x the float angle over
    H/c a step of 1 ms ago, which the master holds; root shaper, lag, square law; J theta'' = K U|U| + M.
    """
    b = (p**3 + 3.0 * p**2 + 3.0 * p - 3.0) / 4.0
    g, a = 2.0 + b - 3.0 * p, p**3 - b
    y, U, u, x_last, out = np.zeros(4), 0.0, 0.0, 0.0, []  # theta, w, float angle, float rate
    x = 0.0

    def run(y, time, goal, before, at):
        def slope(t, y):
            volt = goal + (before - goal) * math.exp(-(at + t) / LAG)
            return [y[1], (K * volt * abs(volt) + torque) / J, y[3], (H * y[1] - C_G * y[3]) / J_G]

        return solve_ivp(slope, (0.0, time), y, method="DOP853", rtol=1e-11, atol=1e-15, max_step=1e-4).y[:, -1]

    goal = 0.0
    for k in range(round(until / T)):
        if k:
            x_last = x if k == 1 else x_last  # preset: no error before the first
            u = b * u + 2.0 * J / T**2 * (g * x - a * x_last)
            x_last = x
        goal = math.copysign(math.sqrt(abs(u) / K), u)
        early = run(y, T - H_STEP, goal, U, 0.0)
        x = -early[2] * C_G / H
        y = run(early, H_STEP, goal, U, T - H_STEP)
        U = goal + (U - goal) * math.exp(-T / LAG)
        out.append(y[0])
    return np.array(out)


@pytest.mark.long
def test_answers_a_torque_as_the_loop_written_by_hand(table):
    """A torque of 140 g.cm on the table at null, counts of 1e-9 rad: two of them."""
    expected = by_hand(140.0 * GCM, 0.3, 0.5)
    small = {"quantum": 1e-9, "rate_max": 8e-4, "index_rate": 8e-4}
    seen = hold(table, 0.3, Gyro(), torque=lambda _: 140.0 * GCM, **small)[4::5, 0]
    assert np.ptp(expected) > 1e-6
    print("MAX", np.abs(seen - expected).max())
    assert np.abs(seen - expected).max() < 2e-9


def test_stiffness_of_the_sampled_law(table):
    """547 g.cm/arcsec at p = 0.5, T = 5 ms [CTRL-SAMPLED]: 1400 g.cm hold the table 2.56 arcsec from null."""
    rows = hold(table, 4.0, Gyro(), torque=lambda t: 1400.0 * GCM if t > 1.0 else 0.0, quantum=1e-8, rate_max=8e-3,
                index_rate=8e-3)  # fmt: skip
    moved = rows[3000:, 0].mean() - rows[500:1000, 0].mean()
    assert moved / ARCSEC == pytest.approx(1400.0 / 547.0, rel=2e-3)


@pytest.mark.parametrize("polarity", [1.0, -1.0])
def test_turns_against_its_base_with_the_drift_of_the_gyro(table, polarity):
    """x' = omega_d - e: one Earth rate of the base and 20 deg/h of drift.  20 s with readings of 0.18 arcsec."""
    base, drift = 7.2921159e-5, math.radians(20.0) / 3600.0
    rows = hold(table, 22.0, Gyro(polarity, drift), base, polarity=polarity, axis_friction=140.0 * GCM)
    rate = (rows[-1, 1] - rows[1999, 1]) / 20.0
    assert rate == pytest.approx(polarity * drift - base, abs=0.4 * ARCSEC / 20.0)
    assert rows[-1, 2] == 1.0


def test_goes_back_to_where_it_was_sent_before(table):
    """Index to 1 arcmin, a gyro that turns the table away, index to the same angle: the command is planned again."""
    gyro, at, u, before, end = Gyro(drift=1e-3), 60.0 * ARCSEC, 0.0, 0.0, {}
    table.initialize()
    for k in range(3000):
        table.set({"mode": 3.0 if 1000 <= k < 2000 else 1.0, "target": at, "u": u})
        table.step(k * H_STEP, H_STEP)
        angle, inside = table.get(["angle", "in_position"])
        if 1000 <= k < 2000:
            u = gyro.after(angle - before)
        before = angle
        end[k] = angle, inside
    assert end[999] == (pytest.approx(at, abs=0.3 * ARCSEC), 1.0)
    assert end[1999][0] == pytest.approx(at + 1e-3, rel=0.02)  # a second at 1e-3 rad/s
    assert end[2999] == (pytest.approx(at, abs=0.3 * ARCSEC), 1.0)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"law_p": 0.0, "J_g": 8e-4}, "servo loop is unstable at law_p = 0"),
        ({"J_g": 2e-3}, "servo loop is unstable"),
        ({"polarity": 0.0}, "polarity must be 1 or -1"),
        ({"u": 0.4}, "more than law_error_max = 0.0349066 rad of table angle from null"),
    ],
)
def test_what_is_refused(table, values, text):
    with pytest.raises(InstanceError, match=text):
        table.set({"mode": 3.0, **values})
        table.initialize()
        for k in range(10):
            table.step(k * H_STEP, H_STEP)
