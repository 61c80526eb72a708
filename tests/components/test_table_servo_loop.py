"""The loop of the table servo with floated_gyro: margins of TABLE-SERVO, exactness, statics, drift, exchange step."""

import math

import control
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import ss2tf
from servo_loop import ARCSEC, FAST, FREE, GCM, SLOW, H, Loop

from gyrobench.component import ComponentError
from gyrobench.linear.part_linearization import state_space


def margins(loop):
    loop.run(loop.h)  # the fine loop is closed by the first step
    table = state_space(loop.table, ["u"], ["omega[1]"])
    gyro = state_space(loop.gyro, ["omega[1]"], ["u"])
    loop.table.gain = 0.0  # what is left is the gyro's reaction on the table: part of the plant, not of the cut loop
    rest = state_space(loop.table, ["u"], ["omega[1]"])
    cut = -(table - rest) * gyro * control.feedback(1, rest * gyro, sign=1)
    num, den = ss2tf(cut.A, cut.B, cut.C, cut.D)  # by SciPy: slycot, where it is installed, loses these poles
    gains, pm, _, _, w, _ = control.stability_margins(control.tf(num[0], den), returnall=True)
    gains = gains[gains > 1e-3]  # below: artefacts of the gyro's resonance, which is not damped
    return {
        "f_c": w[0] / (2.0 * math.pi),
        "PM": pm[0],
        "GM": 20.0 * math.log10(min(g for g in gains if g > 1.0)),
        "low": max(g for g in gains if g < 1.0),
    }


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of python-control, about the float that is not damped
@pytest.mark.parametrize(
    "network, gyro, f_c, pm, gm, low, stiffness",
    [
        (1, FAST, 50.0, 53.8, 11.6, 0.073, 15876.0),
        (2, SLOW, 50.0, 53.4, 9.4, 0.074, 13209.0),
        (3, FREE, 10.0, 45.4, 16.9, 0.098, None),
        (4, FREE, 10.0, 49.7, 12.0, 0.21, None),
    ],
)
def test_margins_are_those_of_the_method(network, gyro, f_c, pm, gm, low, stiffness):
    """TABLE-SERVO, table of compensations: crossover, margins, lower gain limit, static stiffness in g.cm/arcsec."""
    loop = Loop(gyro, network=network, plain=True)
    found = margins(loop)
    assert found["f_c"] == pytest.approx(f_c, rel=1e-3)
    assert found["PM"] == pytest.approx(pm, abs=0.06)
    assert found["GM"] == pytest.approx(gm, abs=0.06)
    assert found["low"] == pytest.approx(low, abs=0.0006 if low < 0.1 else 0.006)
    if stiffness:
        found = loop.K_T / (GCM / ARCSEC)
        assert found == pytest.approx(stiffness, abs=0.6)


def test_gain_outside_its_limits_is_refused_and_unstable():
    """K_T 13209 g.cm/arcsec may fall to x0.074 and rise by 9.4 dB (x2.95): Routh's table against the poles."""
    nominal = 13209.15 * GCM / ARCSEC
    for factor in (0.0745, 2.93):
        loop = Loop(stiffness=factor * nominal, plain=True)
        loop.run(H)
        table = state_space(loop.table, ["u"], ["omega[1]"])
        gyro = state_space(loop.gyro, ["omega[1]"], ["u"])
        closed = control.feedback(-table * gyro, 1)
        poles = np.sort(closed.poles().real)
        assert poles[-1] == pytest.approx(0.0, abs=1e-9) and poles[-2] < 0.0  # the angle against the base is free
    for factor in (0.0735, 2.96):
        with pytest.raises(ComponentError, match="the loop is unstable with network 2"):
            Loop(stiffness=factor * nominal)


def test_networks_are_per_gyro():
    with pytest.raises(ComponentError, match=r"unstable with network 1 and a gyro of J_g = 0\.0003,"):
        Loop({**SLOW, "J": 3e-4}, network=1)  # 10 ms


def test_own_network():
    # network 2 by hand: leads r = 5 about 50 Hz, lag-lead at 50 / 12 Hz and a fifth of that
    w = 100.0 * math.pi
    r = math.sqrt(5.0)
    own = Loop(network=0, zeros=[w / r, w / r, w / 12.0], poles=[w * r, w * r, w / 60.0], crossover=w)
    assert own.table.gain == pytest.approx(Loop().table.gain, rel=1e-14)


@pytest.mark.parametrize("h", [1e-4, 1e-3])
def test_exact_against_expm(h):
    """The README's number: fine loop open, random held voltages and torques, against expm of its linearization."""
    part = Loop(h=h, viscous=0.3, angle0=0.2, plain=True).table
    part.omega_local = [0.0, 0.0, 5e-5]
    part.do_step(0.0, h)
    a = np.array(part.jacobian())
    n = len(a)
    names = ("theta", "spin", "filt", "net")
    state = lambda: np.hstack([getattr(part, n) for n in names])  # noqa: E731
    x = state()
    rng = np.random.default_rng(1)
    worst = 0.0
    for k in range(1, 200):
        part.u, part.torque = rng.normal() * 1e-7, rng.normal() * 0.1
        f = np.zeros(n)  # constant term: f(0)
        f[0] = -5e-5
        f[1] = (part.torque + 0.3 * 5e-5 - 0.04 / 10.0 * part.u / part.lag) / part.J
        f[2] = part.u / part.lag
        step = expm(np.block([[a, f[:, None]], [np.zeros((1, n + 1))]]) * h)
        x = step[:n, :n] @ x + step[:n, n]
        part.do_step(k * h, h)
        worst = max(worst, (abs(state() - x) / (abs(x) + 1e-9)).max())
    assert part.saturated == 0.0
    assert worst < 1e-10


def test_the_linearization_is_that_of_the_fine_loop_in_every_mode():
    part = Loop(plain=True).table
    part.do_step(0.0, H)
    a = part.jacobian()
    part.u = 1.0
    part.friction = 0.1
    for k in range(1, 5):
        part.do_step(k * H, H)
    assert part.saturated == 1.0 and part.jacobian() == a
    part.mode = 2.0
    part.do_step(5 * H, H)
    assert part.stage == 0.0 and part.jacobian() == a


# ------------------------------------------------------------------------------------------- statics
@pytest.mark.parametrize("gyro, network", [(FAST, 1), (SLOW, 2), ({"H": 0.2, "J": 2e-4, "C": 0.2, "K_sg": 10.0}, 2)])
def test_static_stiffness(gyro, network):
    """1400 g.cm at 13209 g.cm/arcsec: 0.10599 arcsec against +torque's own sense, and no rate; doubled, the double."""
    K_T = 13209.0 * GCM / ARCSEC
    angles = []
    for m in (1400.0 * GCM, 2800.0 * GCM):
        track = Loop(gyro, network=network, stiffness=K_T).run(0.9, lambda t, m=m: m)
        assert abs(track[-1, 2]) < 1e-11
        angles.append(track[-1, 1] / ARCSEC)
    # a jump of a held torque is seen by a rate sampled at the end of each step: h2 dM / (12 J) more
    assert angles[0] == pytest.approx(1400.0 / 13209.0 + H * H / 12.0 * 1400.0 * GCM / 2.56 / ARCSEC, rel=1e-6)
    assert angles[0] == pytest.approx(0.10599, rel=1e-4)
    assert angles[1] == pytest.approx(2.0 * angles[0], rel=1e-9)


def test_varying_torque_gives_a_rate_error_of_change_over_stiffness_and_time():
    """5-15: dM over T gives dM / (K_T T); a constant torque gives none."""
    loop = Loop(h=5e-4)
    track = loop.run(4.0, lambda t: 0.05 + 0.02 * max(0.0, t - 1.0) / 3.0)
    rate = track[:, 2]
    assert rate[(track[:, 0] > 0.9) & (track[:, 0] < 0.99)].mean() == pytest.approx(0.0, abs=1e-11)
    assert rate[-2000:].mean() == pytest.approx(0.02 / 3.0 / loop.K_T, rel=1e-6)


def test_undamped_gyro_holds_the_torque_with_the_float():
    """5-20: the float integrates the table angle, so that goes back to 0, and G K_g b holds the torque."""
    loop = Loop(FREE, network=4, h=2.5e-4)
    track = loop.run(2.0, lambda t: 0.05 * min(1.0, t))
    assert abs(track[:, 1]).max() > 9e-8  # while the torque grows
    assert track[-1, 1] == pytest.approx(0.0, abs=1e-9)
    assert track[-1, 6] * 10.0 * loop.table.gain == pytest.approx(0.05, rel=1e-5)


@pytest.mark.long
def test_drift_and_earth_rate():
    """rate = omega_d - omega_E,x (MEAS-SERVO with omega_M = -omega_d), the drift of 1e-7 rad/s with its sign."""
    track = Loop(gyro_parameters={"D_F": 1e-7}).run(0.6)
    assert track[-1, 2] == pytest.approx(1e-7, rel=1e-6)
    earth = [0.0, 0.0, 5.22e-5]
    loop = Loop(gyro_parameters={"D_F": 1e-7}, inputs={"omega_local": earth})
    assert loop.run(1.0)[-1, 2] == pytest.approx(1e-7 - 5.22e-5, rel=1e-9)
    # input axis against the table axis: w about the axis is -omega_d
    against = [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
    loop = Loop(gyro_parameters={"D_F": 1e-7}, face=against, polarity=-1, inputs={"omega_local": earth})
    assert loop.run(1.0)[-1, 2] == pytest.approx(-1e-7 - 5.22e-5, rel=1e-9)


@pytest.mark.parametrize("h, lost", [(1e-4, 0.0), (1e-3, 0.2)])
def test_phase_cost_of_the_exchange(h, lost):
    """Table first: the held rate leads by h/2, the held voltage lags by h/2.  At once: h more, 1.8 deg for 0.1 ms."""
    loop = Loop(plain=True)
    loop.run(H)
    table = state_space(loop.table, ["u"], ["omega[1]"])
    gyro = state_space(loop.gyro, ["omega[1]"], ["u"])
    z = np.exp(100j * math.pi * h)
    p, q = control.sample_system(table, h)(z), control.sample_system(gyro, h)(z)
    smooth = (table * gyro)(100j * math.pi)
    assert np.degrees(np.angle(p * q * z / smooth)) == pytest.approx(0.0, abs=0.01 + lost)
    assert np.degrees(np.angle(p * q / smooth)) == pytest.approx(-18000.0 * h, abs=0.01 + lost)
