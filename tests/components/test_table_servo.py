"""The table servo beside its linear loop: motor, capture, load torques, encoder, frames, modes, refusals."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from servo_loop import ARCSEC, FAST, GCM, H, Loop, TableServo
from wired import TableRate, begun

from gyrobench.component import ComponentError
from gyrobench.linear.part_linearization import state_space


def kinematic(**values):
    return begun("table_servo", **values)


# ------------------------------------------------------------------------------------------- the motor
def test_square_law_without_its_root_shaper():
    """MOTOR-SQUARELAW: static error sqrt(M M_max) / K_T = 0.896 arcsec instead of 0.106 at 1400 g.cm."""
    loop = Loop(shaper=0, h=2e-4)
    track = loop.run(1.5, lambda t: 1400.0 * GCM * min(1.0, t / 0.5))
    assert track[-1, 1] / ARCSEC == pytest.approx(0.8958, rel=2e-3)
    assert track[-1, 3] == pytest.approx(-1400.0 * GCM, rel=1e-3)


@pytest.mark.parametrize("h, error", [(1e-4, 4e-4), (1e-3, 4e-2)])
@pytest.mark.long
def test_torque_limit_against_a_tight_reference(h, error):
    """The README's number: a voltage of 2e-3 sin(20 t) V drives the demand far beyond the limit and back."""
    part = Loop(h=h).table
    part.do_step(0.0, h)
    voltage = lambda k: 2e-3 * math.sin(20.0 * k * h)  # noqa: E731
    x = np.hstack([part.theta, part.spin, part.filt, part.net])
    pole, ratio = np.array(part.pole), np.array(part.ratio)

    def slope(t, x, u):
        y = x[2]
        dx = np.empty(6)
        for j in range(3):
            dx[3 + j] = pole[j] * (y - x[3 + j])
            y = x[3 + j] + ratio[j] * (y - x[3 + j])
        m = min(max(-part.gain * y, -part.torque_max), part.torque_max)
        fast = (u - x[2]) / part.lag
        dx[0], dx[1], dx[2] = x[1], (m - part.H_g / part.K_g * fast) / part.J, fast
        return dx

    limited, worst, peak = 0, 0.0, 0.0
    for k in range(1, round(0.4 / h)):
        part.u = voltage(k)
        part.do_step(k * h, h)
        x = solve_ivp(slope, (0.0, h), x, "RK45", args=(part.u,), rtol=1e-9, atol=1e-14).y[:, -1]
        limited += part.saturated
        worst, peak = max(worst, abs(part.spin - x[1])), max(peak, abs(x[1]))
    assert 0.3 < limited * h / 0.4 < 0.7
    assert worst / peak < error


# ------------------------------------------------------------------------------------------- capture
def test_capture_from_two_degrees():
    """CTRL-CAPTURE: from 2 deg of float angle, pickoff good to 0.5 deg, 1400 g.cm of friction: fine at 2.17 s."""
    loop = Loop(
        h=5e-4,
        capture=1,
        friction=1400.0 * GCM,
        friction_rate=1e-4,
        gyro_parameters={"u_max": 10.0 * math.radians(0.5)},
    )
    loop.gyro.float_angle = math.radians(2.0)
    track = loop.run(3.0)
    t, b = track[:, 0], track[:, 6]
    assert t[np.argmax(track[:, 5] == 1.0)] == pytest.approx(2.17, abs=0.02)
    assert t[np.nonzero(abs(b) > ARCSEC * 4.0 / 3.0)[0][-1]] == pytest.approx(2.31, abs=0.05)
    assert math.degrees(abs(track[:, 2]).max()) == pytest.approx(1.95, abs=0.02)
    assert abs(b[-1]) < 0.2 * ARCSEC and track[-1, 4] == 0.0


def test_fine_loop_closed_directly_at_two_degrees_does_not_settle():
    loop = Loop(h=1e-3, capture=0, friction=1400.0 * GCM, friction_rate=1e-4, gyro_parameters={"u_max": 10.0})
    loop.gyro.float_angle = math.radians(2.0)
    track = loop.run(5.0)
    late = track[:, 0] > 4.0
    assert math.degrees(abs(track[late, 6]).max()) > 2.0 and track[late, 4].mean() > 0.5


def test_capture_waits_for_its_time():
    for hold in (0.0, 0.02):
        track = Loop(capture=1, capture_hold=hold).run(0.03)
        assert track[np.argmax(track[:, 5] == 1.0), 0] == pytest.approx(max(hold, H), abs=1.1 * H)


@pytest.mark.parametrize("degrees_per_hour", [20.0, -60.0])
def test_capture_of_a_gyro_that_drifts(degrees_per_hour):
    """Above capture_slow (6.2 deg/h) u alone tells: near null for 2 capture_angle / capture_slow = 2.585 s, in which
    the mean rate against the drift is below capture_slow.  Before, the tachometer holds the float away from null by
    H/C 2 damping omega_d / capture_rate; after it the table turns with the drift.
    """
    omega_d = math.radians(degrees_per_hour) / 3600.0
    loop = Loop(h=1e-3, capture=1, gyro_parameters={"D_F": omega_d})
    track = loop.run(2.5)
    assert not track[:, 5].any()
    assert abs(track[-1, 6]) == pytest.approx(4.0 / 3.0 * 2.4 * abs(omega_d) / (8.0 * math.pi), rel=1e-3)
    track = loop.run(0.6)
    fine = track[:, 5] == 1.0
    assert fine[-1] and track[np.argmax(fine), 0] == pytest.approx(2.585, abs=0.01)
    track = loop.run(1.0)
    assert np.mean(track[500:, 2]) == pytest.approx(omega_d, rel=1e-6) and abs(track[-1, 6]) < 0.01 * ARCSEC


# ------------------------------------------------------------------------------------------- load torques
def settled(loop, duration=1.0):
    """Torque that the loop holds, from the static angle error of the gyro's pickoff."""
    loop.run(duration)
    return loop.gyro.b * 10.0 * loop.table.gain


def test_unbalance():
    """5-36: G m cos(phi) sin(theta): 20 kgf at 0.05 cm with the axis at 15 deg: 966 g.cm where it is largest."""
    p = math.radians(15.0)
    axis = [0.0, math.cos(p), math.sin(p)]  # north and 15 deg up; the first axis east: east x down = north, M > 0
    base = [[1.0, 0.0, 0.0], np.cross(axis, [1.0, 0.0, 0.0]).tolist(), axis]
    inputs = {"f_local": [0.0, 0.0, 9.80665]}
    for angle, part in ((0.0, 1.0), (math.pi / 6.0, math.cos(math.pi / 6.0)), (math.pi / 2.0, 0.0)):
        loop = Loop(h=5e-4, base=base, angle0=angle, unbalance=[20.0 * 0.0005, 0.0], inputs=inputs)
        assert settled(loop) == pytest.approx(part * 966.0 * GCM, abs=0.2 * GCM)
    vertical = Loop(h=5e-4, unbalance=[0.01, 0.01], inputs=inputs)
    assert settled(vertical, 0.3) == pytest.approx(0.0, abs=1e-9)


def test_friction_and_viscous_torque_oppose_the_rate_against_the_base():
    earth = {"omega_local": [0.0, 0.0, 7e-5]}  # the table turns at -7e-5 against its base
    assert settled(Loop(h=5e-4, friction=0.02, inputs=earth)) == pytest.approx(0.02, rel=1e-6)
    assert settled(Loop(h=5e-4, viscous=100.0, inputs=earth)) == pytest.approx(7e-3, rel=1e-6)


def test_torque_ripple():
    loop = Loop(h=5e-4, ripple=0.03, ripple_cycles=36, ripple_phase=0.4, angle0=0.1)
    assert settled(loop) == pytest.approx(0.03 * math.sin(36 * 0.1 + 0.4), rel=1e-5)


@pytest.mark.long
def test_rumble_gives_the_angle_its_density_over_the_stiffness():
    """Torque noise well inside the band of the loop: angle density = torque density / K_T; rms by the closed loop."""
    part = Loop(rumble=1e-4, h=1e-3)
    track = part.run(6.0)
    cut = Loop(plain=True)
    cut.run(H)
    table = state_space(cut.table, ["torque", "u"], ["angle", "omega[1]"])
    gyro = state_space(cut.gyro, ["omega[1]"], ["u"])
    w = 2.0 * math.pi * np.linspace(0.05, 400.0, 20001)
    p, q = table(1j * w), gyro(1j * w)
    response = p[0, 0] + p[0, 1] * q * p[1, 0] / (1.0 - q * p[1, 1])
    assert abs(response[0]) * part.K_T == pytest.approx(1.0, rel=0.01)
    # a two-sided density S gives the variance S2 times the two-sided noise bandwidth
    rms = 1e-4 * math.sqrt(2.0 * np.sum(abs(response) ** 2) * (w[1] - w[0]) / (2.0 * math.pi))
    assert track[500:, 1].std() == pytest.approx(rms, rel=0.15)


# ------------------------------------------------------------------------------------------- angle, frames, modes
def test_encoder():
    part = kinematic(
        mode=2.0,
        target=1.0,
        acceleration=1e6,
        encoder_amplitude=[2e-6, 1e-6, 5e-7],
        encoder_phase=[0.3, -0.7, 1.1],
        encoder_fine=360,
    )
    for k in range(300):
        part.do_step(k * 0.02, 0.02)
        x = part.angle
        error = 2e-6 * math.sin(x + 0.3) + 1e-6 * math.sin(2 * x - 0.7) + 5e-7 * math.sin(360 * x + 1.1)
        assert part.angle_read - x == pytest.approx(error, abs=1e-14)
    coarse = kinematic(mode=2.0, target=-0.3, quantum=1e-3, encoder_amplitude=[0.01, 0.0, 0.0])
    for k in range(300):
        coarse.do_step(k * 0.01, 0.01)
        q = coarse.angle_read / 1e-3
        assert q == pytest.approx(round(q), abs=1e-9)
        assert abs(coarse.angle_read - coarse.angle - 0.01 * math.sin(coarse.angle)) <= 0.5e-3 + 1e-12


def test_kinematic_modes_are_those_of_table_rate():
    rng = np.random.default_rng(3)
    rotation = lambda: Rotation.random(random_state=int(rng.integers(1 << 31))).as_matrix().tolist()  # noqa: E731
    shared = {"base": rotation(), "tilt": [0.01, -0.02], "angle0": 0.3, "acceleration": 0.4, "quantum": 1e-4}
    face, earth = rotation(), [3e-5, -4e-5, 5e-5]
    servo, plain = kinematic(**shared), TableRate(**shared)
    plain.initialize()
    commands = [(2.0, 0.2), (1.0, 1.5), (2.0, -0.3), (0.0, 0.0), (1.0, -0.2)]
    for k in range(1500):
        for part in (servo, plain):
            part.face, part.omega_local = face, earth
            part.mode, part.target = commands[k // 300]
            part.do_step(k * 0.01, 0.01)
        assert (servo.angle, servo.angle_read, servo.in_position) == (plain.angle, plain.angle_read, plain.in_position)
        assert servo.rate == pytest.approx(plain.rate, abs=1e-16)
        assert servo.omega == pytest.approx(plain.omega, abs=1e-16)
        assert servo.alpha == pytest.approx(plain.alpha, abs=1e-16)
        assert servo.f == pytest.approx(plain.f, abs=1e-14)


def test_from_rate_to_servo_and_back_to_an_index():
    """Capture brakes a table that turns; the next command starts from where the servo left it."""
    loop = Loop(h=1e-3, capture=1, acceleration=0.5)
    loop.table.mode, loop.table.target = 2.0, 0.02
    track = loop.run(0.5)
    assert track[-1, 2] == pytest.approx(0.02, rel=1e-12)
    loop.table.mode = 3.0
    track = loop.run(3.0)
    assert track[-1, 5] == 1.0 and abs(track[-1, 2]) < 1e-9
    assert abs(np.diff(track[:, 1])).max() < 1.02e-3 * loop.table.capture_speed  # no jump
    before = track[-1, 1]
    loop.table.mode, loop.table.target = 1.0, before + 0.1
    track = loop.run(2.0)
    assert track[0, 1] - before == pytest.approx(0.25e-6, rel=1e-3)  # a t2 / 2 from the beginning of the step
    assert track[-1, 5] == 1.0 and track[-1, 1] == before + 0.1


def test_alpha_is_the_derivative_of_omega():
    loop = Loop(FAST, network=1, inputs={"omega_local": [0.3, -0.2, 0.0]})
    omega, alpha = [], []
    for _ in range(600):
        loop.run(H, lambda t: 0.2 * math.sin(60.0 * t))
        omega.append(list(loop.table.omega))
        alpha.append(list(loop.table.alpha))
    omega, alpha = np.array(omega), np.array(alpha)
    slope = (omega[2:] - omega[:-2]) / (2.0 * H)
    assert abs(slope - alpha[1:-1]).max() < 0.02 * abs(alpha).max()  # h/2 of delay: the torque is held


# ------------------------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"base": [[1, 0, 0], [0, 1, 2e-9], [0, 0, 1]]}, "base is not a rotation matrix"),
        ({"base": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "base is left-handed"),
        ({"J": 0.0}, "J = 0 kg.m2 must be > 0"),
        ({"H_g": -0.2}, "H_g = -0.2 N.m.s must be > 0"),
        ({"C_g": -1.0}, "C_g = -1 N.m.s/rad must be >= 0"),
        ({"C_g": 0.0, "stiffness": 1e5, "capture": 0}, "with C_g = 0.* static stiffness is infinite"),
        ({"C_g": 0.0, "network": 3}, "stiffness and capture need a damped gyro"),
        ({"polarity": 0}, "polarity must be 1 or -1"),
        ({"network": 0}, "network 0 needs a crossover or a stiffness"),
        ({"torque_max": 0.0}, "torque_max = 0 N.m must be > 0"),
        ({"quantum": -1.0}, "quantum = -1 rad must be >= 0"),
        ({"capture_angle": 1e-3}, "capture_angle = 0.001 rad is beyond the linear range"),
    ],
)
def test_refuses(parameters, message):
    with pytest.raises(ComponentError, match=message):
        kinematic(**parameters)


@pytest.mark.parametrize(
    "mode, target, message",
    [
        (4.0, 0.0, "mode = 4 must be 0 hold, 1 index, 2 rate or 3 servo"),
        (-1.0, 0.0, "mode = -1 must be 0 hold, 1 index, 2 rate or 3 servo"),
        (2.0, -11.0, "rate -11 rad/s exceeds rate_max = 10"),
    ],
)
def test_refuses_commands(mode, target, message):
    part = kinematic(mode=mode, target=target)
    with pytest.raises(ComponentError, match=message):
        part.do_step(0.0, H)


def test_base_whose_rate_changes():
    """Spin stays 0 without torque, so x = -(integral of e); e = a t held at its end value in each step, as the input of
    a table that stands on another one is.  The mean of both ends makes it exact: -a t2 / 2, where the end values alone
    would give -a t (t + h) / 2.
    """
    part = TableServo(capture=0)
    part.initialize()
    part.mode = 3.0
    h, a = 1e-3, 0.02
    for k in range(500):
        part.omega_local = [0.0, 0.0, a * (k + 1) * h]
        part.do_step(k * h, h)
    assert part.angle == pytest.approx(-a * 0.5**2 / 2.0, rel=1e-9)
