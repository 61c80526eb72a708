"""The single-axis platform: motor, reducer, gyro momentum, bearing that sticks, unbalance, frames, refusals."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from wired import BENCH, Native

from gyrobench.component import ComponentError
from gyrobench.linear.part_linearization import state_space
from gyrobench.packaging import load_part

Platform = load_part("platform_single_axis", BENCH)
BARE = {"viscous": 0.0, "k_e": 0.0}


def made(inputs=None, native=False, **parameters):
    """native: for long runs."""
    part = Native("platform_single_axis", **parameters) if native else Platform(**parameters)
    for name, x in (inputs or {}).items():
        part.set(name, x)
    part.initialize()
    return part


def run(part, seconds, h=1e-3, each=lambda t: None):
    """Steps of h; ``each(t)`` sets inputs before a step.  Rows of t, theta, theta_dot after each step."""
    rows = []
    for k in range(round(seconds / h)):
        each(k * h)
        part.do_step(k * h, h)
        rows.append(((k + 1) * h, part.theta, part.theta_dot))
    return np.array(rows)


# ----------------------------------------------------------------------------------- motor and reducer
@pytest.mark.parametrize("h", [1e-4, 1e-3])
def test_motor_and_platform_are_the_linear_system(h):
    """x = (theta, w, i), random held v and M, against expm; L/R = 2 ms, so RK4 of 1 ms has 0.5^5 / 5! = 3e-4 a step."""
    p = made(J=1.3, viscous=0.2, ratio=3.0, J_motor=0.04, k_t=0.7, k_e=0.8)
    inertia = 1.3 + 9 * 0.04
    a = np.array([[0, 1, 0], [0, -0.2 / inertia, 2.1 / inertia], [0, -0.8 * 3 / 4e-3, -2 / 4e-3]])
    b = np.array([[0, 0], [0, 1 / inertia], [1 / 4e-3, 0]])
    whole = expm(np.block([[a, b], [np.zeros((2, 5))]]) * h)
    rng = np.random.default_rng(1)
    x, worst, largest = np.zeros(3), 0.0, 0.0
    for k in range(300):
        u = rng.normal(size=2) * (5.0, 1.0)
        p.v, p.M_load = map(float, u)
        p.do_step(k * h, h)
        x = whole[:3, :3] @ x + whole[:3, 3:] @ u
        worst, largest = max(worst, abs(p.omega[0] - x[1])), max(largest, abs(x[1]))
    assert worst < (2e-8 if h == 1e-4 else 2e-4) * largest
    assert p.i_motor == p.i and p.M_motor == pytest.approx(2.1 * p.i)


def test_motor_without_inductance_is_the_limit_of_a_small_one():
    """i = (v - k_e w) / R at once: w = v / k_e (1 - exp(-t k_t k_e / (R J)))."""
    p = made(native=True, L=0.0, viscous=0.0)
    run(p, 2.0, each=lambda t: p.set("v", 4.0))
    assert p.theta_dot == pytest.approx(4.0 * (1 - math.exp(-2.0 * 1.0 / (2.0 * 2.0))), rel=1e-9)
    assert p.i_motor == pytest.approx((4.0 - p.theta_dot) / 2.0, rel=1e-12)


def test_back_emf_drags_the_platform_along_with_its_base():
    """Base at 0.1 rad/s, shorted motor: w' = k_t k_e (w_b - w) / (R J), so w = w_b (1 - exp(-t / 4 s))."""
    p = made({"omega_b[1]": 0.1}, L=0.0, viscous=0.0, theta_dot_0=-0.1)
    assert p.omega[0] == 0.0
    p.do_step(0.0, 1e-9)
    assert p.M_motor == pytest.approx(0.05)
    run(p, 2.0)
    assert p.omega[0] == pytest.approx(0.1 * (1 - math.exp(-0.5)), rel=1e-9)
    assert p.attitude == pytest.approx(0.1 * (2.0 - 4.0 * (1 - math.exp(-0.5))), rel=1e-9)
    assert p.theta == pytest.approx(p.attitude - 0.1 * (2.0 + 1e-9), rel=1e-12)


def test_reducer_under_an_accelerated_base():
    """T = J w2/2 + J_m (w_b + n S)2/2; free of torque, w_b = a t: (J + n2 J_m) w' = n (n - 1) J_m a (by Lagrange)."""
    p = made(J=2.0, ratio=5.0, J_motor=0.02, **BARE)
    for k in range(1000):
        p.set("alpha_b[1]", 0.3)
        p.set("omega_b[1]", 0.3e-3 * (k + 1))  # at the end of the step
        p.do_step(k * 1e-3, 1e-3)
    assert p.alpha[0] == pytest.approx(5 * 4 * 0.02 * 0.3 / (2.0 + 25 * 0.02), rel=1e-12)
    assert p.omega[0] == pytest.approx(p.alpha[0] * 1.0, rel=1e-9)


def test_limits_of_voltage_and_current():
    """48 V at 2 Ohm want 24 A; with i_max = 5 A the torque is 5 N.m: w = 2.5 t but for the first 0.5 ms of rise."""
    p = made(native=True, i_max=5.0, k_e=0.0, viscous=0.0)
    run(p, 1.0, each=lambda t: p.set("v", 1e3))
    assert p.i_motor == 5.0 and p.saturated == 1.0
    lost = 5.0 / (48.0 / 4e-3) / 2  # the rise is nearly straight: half of its time is lost
    assert p.theta_dot == pytest.approx(2.5 * (1.0 - lost), rel=2e-4)
    free = made(native=True, viscous=0.0, i_max=1e3)
    run(free, 60.0, h=1e-2, each=lambda t: free.set("v", 1e3))
    assert free.theta_dot == pytest.approx(48.0, rel=1e-6) and free.saturated == 1.0  # v_max / k_e, not 1000
    free.set("v", 40.0)
    assert free.get("saturated") == 0.0


# ----------------------------------------------------------------------------------------------- gyro
@pytest.mark.long
def test_gyro_wired_by_its_momentum_keeps_the_nutation():
    """J w + h = const and J_g b'' = H w exchanged at 0.1 ms: 17.4 Hz, neither growth nor decay over 32 turns (2 s)."""
    p = made(native=True, J=0.5, **BARE)
    h, big_h, small = 1e-4, 10.0, 0.02  # STAB-POWER-2DOF: nutation H / sqrt(J_x J_y) = 100 rad/s with 0.5 and 0.02
    b, rate, kick = 0.0, 0.01, []
    for k in range(20000):
        p.set("h_gyro", big_h * b)
        w = p.get("omega[1]")
        rate += h * big_h * w / small
        b += h * rate
        p.do_step(k * h, h)
        kick.append(w)
        assert p.p == 0.0  # nothing from outside: the momentum stays where it began
    kick = np.array(kick)
    swing = 0.01 * 100.0 * 0.02 / 10.0  # J w = -H b, b = (rate0 / n) sin n t: w = rate0 sqrt(J_y / J_x)
    assert np.max(np.abs(kick[:2000])) == pytest.approx(swing, rel=1e-2)
    assert np.max(np.abs(kick[-2000:])) == pytest.approx(np.max(np.abs(kick[:2000])), rel=1e-3)
    spectrum = np.abs(np.fft.rfft(kick * np.hanning(kick.size)))
    assert np.argmax(spectrum) / 2.0 == pytest.approx(100.0 / (2 * math.pi), abs=0.51)


def test_gyro_wired_by_its_torque_acts_as_a_load():
    a, b = (made({name: 0.7}, **BARE) for name in ("M_gyro", "M_load"))
    run(a, 1.0), run(b, 1.0)
    assert a.theta == b.theta == pytest.approx(0.7 / 2.0 / 2, rel=1e-9)


# -------------------------------------------------------------------------------------------- bearing
def test_slip_stops_where_energy_says_and_stays():
    """J w2/2 = F x: 0.5 rad/s on 0.4 N.m stop after 0.625 rad, 2.5 s (the contact gives way by presliding)."""
    p = made(native=True, friction=0.4, theta_dot_0=0.5, **BARE)
    rows = run(p, 4.0)
    assert rows[-1, 1] == pytest.approx(0.625, abs=1e-4)
    stop = rows[np.argmax(rows[:, 2] <= 0.0), 0]
    assert stop == pytest.approx(2.5, abs=0.01)
    assert np.max(np.abs(rows[-500:, 2])) < 1e-7
    later = run(p, 2.0)
    assert np.ptp(later[:, 1]) < 1e-12


@pytest.mark.parametrize("load, sticks", [(0.59, True), (-0.59, True), (0.61, False), (-0.61, False)])
def test_sticks_up_to_break_away_without_creep(load, sticks):
    """Held torque: the contact turns by M / (stiction / presliding) and no further; beyond it (M - F) / J goes on."""
    p = made(native=True, friction=0.4, stiction=0.6, presliding=1e-4, **BARE)
    rows = run(p, 3.0, each=lambda t: p.set("M_load", load * min(1.0, t)))
    if sticks:
        assert rows[-1, 1] == pytest.approx(load / 0.6 * 1e-4, rel=1e-9)
        end = run(p, 60.0, h=1e-2)
        assert np.ptp(end[:, 1]) < 1e-15
    else:
        gone = abs(load) - 0.4
        rate = np.gradient(rows[:, 2], rows[:, 0])[-500:]
        np.testing.assert_allclose(rate, math.copysign(gone / 2.0, load), rtol=1e-6)


@pytest.mark.long
def test_stick_slip_as_counted_by_events():
    """A spring k pulled at u: sticks until k x = F_s, then J y'' = k (u t - y) - F_c until y' = 0 (events)."""
    k, u, fs, fc, inertia = 20.0, 0.02, 0.6, 0.4, 2.0
    p = made(native=True, friction=fc, stiction=fs, presliding=2e-6, **BARE)
    half = 1.25e-4  # the held torque is that of mid-step
    rows = run(p, 8.0, h=2 * half, each=lambda t: p.set("M_load", k * (u * (t + half) - p.angle - half * p.theta_dot)))
    t, y, slips = 0.0, 0.0, []
    while t < 8.0:
        t = fs / k / u + y / u  # breaks away
        stop = lambda s, x: x[1] - 1e-12  # noqa: E731
        stop.terminal, stop.direction = True, -1
        pull = lambda s, x: [x[1], (k * (u * s - x[0]) - fc) / inertia]  # noqa: E731
        path = solve_ivp(pull, (t, t + 20.0), [y, 1e-9], events=stop, rtol=1e-10, atol=1e-13)
        slips.append((t, path.t[-1], path.y[0, -1]))
        t, y = path.t[-1], path.y[0, -1]
    for begin, end, angle in slips[:-1]:
        middle = 0.5 * (begin + end)
        before, after = (rows[np.searchsorted(rows[:, 0], x), 1] for x in (begin - 0.05, end + 0.05))
        last = max((a for b, e, a in slips if e < begin), default=0.0)
        assert before == pytest.approx(last, abs=2e-5)
        assert after == pytest.approx(angle, abs=5e-5)
        assert rows[np.searchsorted(rows[:, 0], middle), 2] > 0.01
    assert len(slips) >= 4


def test_bearing_never_gives_more_than_its_spring_holds():
    """Random torques: the work of the contact is never above the start (0), less than -F x slipped way + spring."""
    rng = np.random.default_rng(4)
    p = made(native=True, friction=0.3, stiction=0.5, **BARE)
    work, slipped, h = 0.0, 0.0, 2e-4
    for k in range(20000):
        if k % 100 == 0:
            p.M_load = float(rng.normal() * 1.5)
        before = p.p
        p.do_step(k * h, h)
        impulse = p.p - before - h * p.M_load  # of the contact
        work += impulse * 0.5 * (p.p + before) / p.inertia
        slipped += abs(p.p + before) / 2 / p.inertia * h
        assert work < 1e-6
    assert slipped > 0.1 and work < -0.9 * 0.3 * (slipped - 0.01)


# ------------------------------------------------------------------------------- unbalance and frames
def test_unbalance_makes_a_pendulum():
    """Centre 0.01 kg.m above the axis (+z), f up: J th'' = +u g sin th (falls over); against solve_ivp over 10 s."""
    p = made(native=True, unbalance=[0.0, 0.01], theta_0=0.05, **BARE)
    rows = run(p, 10.0, h=5e-3)
    fall = lambda t, x: [x[1], 0.01 * 9.80665 * math.sin(x[0]) / 2.0]  # noqa: E731
    truth = solve_ivp(fall, (0, 10), [0.05, 0.0], rtol=1e-11, atol=1e-13).y[0, -1]
    assert rows[-1, 1] == pytest.approx(truth, rel=1e-9)
    forward = made(unbalance=[0.01, 0.0], **BARE)  # a mass in front (+y) pulls the nose down
    forward.do_step(0.0, 1e-3)
    assert forward.alpha[0] == pytest.approx(-0.01 * 9.80665 / 2.0, rel=1e-6)


def test_rates_accelerations_and_force_in_platform_axes():
    """Against the rotation matrix: C = R1(theta) (passive); d(C w_b)/dt + joint terms by central differences."""
    rng = np.random.default_rng(7)
    for _ in range(10):
        th, s, acc = rng.normal(size=3)
        wb, ab, fb = rng.normal(size=(3, 3))
        inputs = {"omega_b": wb, "alpha_b": ab, "f_b": fb}
        inputs = {f"{n}[{i + 1}]": x[i] for n, x in inputs.items() for i in range(3)}
        p = made(inputs, theta_0=th, theta_dot_0=s, **BARE)

        def omega(t, th=th, s=s, acc=acc, wb=wb, ab=ab):
            turned = Rotation.from_euler("x", th + s * t + acc * t * t / 2).inv().apply(wb + ab * t)
            return turned + np.array([s + acc * t, 0.0, 0.0])

        p.der.p = p.inertia * (ab[0] + acc)  # as after a step
        p.set("v", 0.0)
        np.testing.assert_allclose([p.get(f"omega[{i}]") for i in (1, 2, 3)], omega(0.0), atol=1e-13)
        slope = (omega(1e-5) - omega(-1e-5)) / 2e-5
        np.testing.assert_allclose([p.get(f"alpha[{i}]") for i in (1, 2, 3)], slope, atol=1e-8)
        f = Rotation.from_euler("x", th).inv().apply(fb)
        np.testing.assert_allclose([p.get(f"f[{i}]") for i in (1, 2, 3)], f, atol=1e-13)


def test_linearization_has_the_poles_of_motor_and_platform():
    """J s (L s + R) + viscous (L s + R) + k_t k_e = 0, and two integrations."""
    system = state_space(made(), ["v"], ["omega[1]"])
    poles = np.sort(system.poles().real)
    hand = np.sort(np.concatenate([np.roots([2.0 * 4e-3, 2.0 * 2 + 0.05 * 4e-3, 0.05 * 2 + 1.0]), [0.0, 0.0]]))
    np.testing.assert_allclose(poles, hand, atol=1e-9)
    assert system(1e-9j).real == pytest.approx(1.0 / (1.0 + 0.05 * 2), rel=1e-6)  # k_t / (k_t k_e + viscous R)
    stuck = state_space(made(friction=0.4, presliding=1e-4, k_e=0.0), ["M_load"], ["theta"])
    assert stuck(0.01j).real == pytest.approx(1e-4 / 0.4, rel=1e-3)  # at rest the contact is a spring


# ------------------------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"J": 0.0}, r"parameter J = 0 kg\.m2 must be > 0"),
        ({"R": 0.0}, r"parameter R = 0 Ohm must be > 0"),
        ({"ratio": 0.0}, "parameter ratio = 0 1 must be > 0"),
        ({"friction": -1.0}, "parameter friction = -1 N.m must be >= 0"),
        ({"friction": 0.5, "stiction": 0.4}, r"stiction = 0\.4 N\.m must be 0 or at least friction = 0\.5 N\.m"),
        ({"L": 1e-3}, r"step = 0\.001 s must be <= L / R of the motor, L = 0\.001 Ohm\.s, R = 2 Ohm"),
        ({"friction": 5.0, "presliding": 1e-6}, r"step = 0\.001 s must be <= 0\.5 sqrt\(J presliding / stiction\)"),
        ({"v_max": math.nan}, "parameter v_max = nan V must be finite"),
    ],
)
def test_refusals(parameters, message):
    with pytest.raises(ComponentError, match=message):
        made(**parameters)


def test_an_input_that_is_not_finite_is_refused():
    p = made()
    p.set("v", math.inf)
    with pytest.raises(ComponentError, match=r"input v is inf at t = 0 s"):
        p.do_step(0.0, 1e-3)
