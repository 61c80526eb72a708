"""Sampled controller on scipy's zero-order-hold plant: closed forms, acceptance figures, delay, refusals."""

import math

import numpy as np
import pytest
from scipy.signal import cont2discrete
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

TableCommand, Controller = load_part("table_command", BENCH), load_part("controller_sampled", BENCH)
ERU, ARCSEC, GCM = 7.2921159e-5, math.pi / 648000, 9.80665e-5
QUANTUM = 0.18 * ARCSEC
J = 2.56


def plant(inertia):
    return np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0 / inertia]]), np.eye(2), np.zeros((2, 1))


class Loop:
    """Controller and inertia; counts of a reference that is a function of time, floor(angle / quantum) of the table."""

    def __init__(self, T=5e-3, inertia=J, torque=0.0, quantum=QUANTUM, **parameters):
        self.part = Controller(period=T, law_quantum=quantum, **parameters)
        self.part.initialize()
        self.T, self.quantum, self.torque = T, quantum, torque
        a, b, *_ = cont2discrete(plant(inertia), T)
        self.a, self.b = a, b[:, 0]

    def run(self, reference, time, acc=None):
        x, rows = np.zeros(2), []
        for k in range(round(time / self.T)):
            t = k * self.T
            r = reference(t)
            self.part.count_command = math.floor(r / self.quantum + 1e-9)
            self.part.count = math.floor(x[0] / self.quantum + 1e-9)
            self.part.acc_command = acc(t) if acc else 0.0
            self.part.do_step(t, self.T)
            rows.append((x[0], x[1], r, self.part.demand))
            x = self.a @ x + self.b * (self.part.demand + self.torque)
        return np.array(rows).T


def ramped(rate, acc=1.0):
    """Return the reference that reaches a rate with a constant acceleration from rest."""
    t1 = abs(rate) / acc
    return lambda t: math.copysign(0.5 * acc * t * t, rate) if t < t1 else rate * (t - 0.5 * t1)


# ---------------------------------------------------------------------------------------- closed forms
def test_step_response_is_that_of_the_z_domain():
    # Phi = 1.25/z + 0.5/z2 - 0.75/z3: 1.25, 1.75, 1, 1 ...   A count of 1e-16 rad stands for no quantization
    angle, _, _, torque = Loop(quantum=1e-16).run(lambda t: 1e-6, 0.1)
    assert angle[:5] / 1e-6 == pytest.approx([0.0, 1.25, 1.75, 1.0, 1.0], rel=1e-9)
    assert angle[3:] / 1e-6 == pytest.approx(1.0, rel=1e-9)
    # torque by hand: 2 J/T2 (1.25, -0.75 - 0.75 1.25 ...)
    assert torque[0] == pytest.approx(2 * J / 25e-6 * 1.25e-6, rel=1e-9)


def test_softer_poles_follow_their_transfer_function():
    # Phi = (z + 1)(g z - a)/(z - p)3 with p = 0.5: b = -0.15625, g = 0.34375, a = 0.28125
    p = 0.5
    b = (p**3 + 3 * p**2 + 3 * p - 3) / 4
    g, a = 2 + b - 3 * p, p**3 - b
    assert (b, g, a) == (-0.15625, 0.34375, 0.28125)
    numerator, denominator = np.polymul([1, 1], [g, -a]), np.poly([p, p, p])
    y = np.zeros(40)
    for k in range(40):  # difference equation of Phi for a unit step
        y[k] = sum(numerator[j] for j in range(3) if k - 1 - j >= 0)
        y[k] -= sum(denominator[j] * y[k - j] for j in range(1, 4) if k - j >= 0)
    angle = Loop(quantum=1e-16, law_p=p).run(lambda t: 1e-6, 0.2)[0]
    assert angle / 1e-6 == pytest.approx(y, abs=1e-8)


def test_ramp_without_error_after_three_samples_and_without_torque_between_them():
    loop = Loop(quantum=1e-16, law_M_max=1e9)
    angle, _, reference, torque = loop.run(lambda t: 10 * ERU * t, 0.2)
    assert np.abs((angle - reference)[4:]).max() < 1e-14  # 4e-16 of quantum and rounding
    assert np.abs(torque[5:]).max() < 1e-6 * np.abs(torque).max()
    # an unramped step of the rate w takes 2.5 J w / T
    assert np.abs(torque).max() == pytest.approx(2.5 * J * 10 * ERU / 5e-3, rel=1e-6)


@pytest.mark.parametrize(("T", "error"), [(5e-3, 0.484), (1e-2, 1.936)])
def test_stiffness(T, error):
    # (2J/T2)(2/7) of the deadbeat design: 1400 g.cm gives 0.48 and 1.94 arcsec
    angle = Loop(T=T, torque=1400 * GCM, quantum=1e-12).run(lambda t: 0.0, 0.3)[0]
    assert angle[-1] / ARCSEC == pytest.approx(error, abs=2e-3)


def test_feedforward_moves_the_table_without_error():
    # the reference has constant acceleration between samples, and so has the table under J_ff acc
    command = TableCommand(reference_rate_step=0.0)
    command.mode, command.target = 2.0, 0.05
    command.initialize()
    rows = []
    for k in range(40):
        command.do_step(k * 5e-3, 5e-3)
        rows.append((command.angle, command.acc))
    follows = Loop(quantum=1e-16, law_J_ff=J).run(
        lambda t: rows[round(t / 5e-3)][0], 0.2, lambda t: rows[round(t / 5e-3)][1]
    )
    assert np.abs(follows[0] - follows[2]).max() < 1e-13
    alone = Loop(quantum=1e-16).run(lambda t: rows[round(t / 5e-3)][0], 0.2)
    # feedback alone: 1 rad/s2 costs J / stiffness = 2.56 / (2 2.56/25e-6 2/7) = 43.75 urad
    assert (alone[2] - alone[0]).max() == pytest.approx(43.75e-6, rel=0.01)


def test_inertia_that_differs_from_the_design():
    """Stable for 0.61 to 8 times the inertia; the deadbeat property is lost: |pole| 0.48 at 0.9, 0.41 at 1.1."""

    def largest(ratio):
        part = Loop().part
        opened = np.polymul([1, 1], [part.law_g, -part.law_a]) / ratio
        return np.abs(np.roots(np.polyadd(np.polymul([1, -2, 1], [1, -part.law_b]), opened))).max()

    assert [round(largest(r), 2) for r in (0.9, 1.1)] == [0.48, 0.41]
    assert largest(0.60) > 1 > largest(0.62) and largest(8.0) < 1
    for ratio, settles in ((0.58, False), (0.65, True), (8.0, True)):  # and in time: 1 urad, never saturated
        angle = Loop(inertia=ratio * J, quantum=1e-16, law_M_max=1e9, law_error_max=1e9).run(lambda t: 1e-6, 2.0)[0]
        assert (abs(angle[-1] - 1e-6) < 1e-8) == settles


# ------------------------------------------------------------------------------------ figures of the loop
@pytest.mark.parametrize("eru", [0.01, 1, 10, 100, 999.99, 1999.9])
def test_synchronous_rate(eru):
    angle, _, reference, torque = Loop(torque=140 * GCM).run(ramped(eru * ERU), 6.0)
    error = np.abs(angle - reference)[800:].max() / ARCSEC
    assert 0.26 < error < 0.40  # 0.27 to 0.39; allowed: 1.5
    assert np.abs(torque).max() < 9.8


def test_mean_rate_from_counts():
    # ten seconds at 1 ERU: one count of 0.18 arcsec in 150.4 arcsec is 0.12 %
    angle = Loop(torque=140 * GCM).run(ramped(ERU), 14.5)[0]
    counted = (math.floor(angle[2800] / QUANTUM) - math.floor(angle[800] / QUANTUM)) * QUANTUM / 10.0
    assert abs(counted / ERU - 1) < 1.4e-3


def test_softer_poles_trade_jitter_for_stiffness():
    expected = {0.0: (4.16, 0.35, 2893), 0.3: (1.86, 0.34, 1197), 0.5: (0.83, 0.35, 547), 0.7: (0.30, 0.86, 177)}
    for p, (jitter, error, stiffness) in expected.items():
        loop = Loop(torque=140 * GCM, law_p=p)
        angle, rate, reference, _ = loop.run(lambda t: 10 * ERU * t, 6.0)
        assert np.std(rate[600:]) / ERU == pytest.approx(jitter, abs=0.006)
        assert np.abs(angle - reference)[600:].max() / ARCSEC == pytest.approx(error, abs=0.006)
        law = loop.part
        static = law.law_scale * (law.law_g - law.law_a) / (1 - law.law_b)
        assert static * ARCSEC / GCM == pytest.approx(stiffness, abs=0.6)


def test_position():
    # 10 deg at 100 ERU, ramp 1 rad/s2, 140 g.cm; printed 0.32 arcsec, 3.82 N.m, 6.35 arcsec for a ramp that ends
    # between two samples; the command's ramps end at samples: less torque and lag
    command = TableCommand()
    command.mode, command.target = 1.0, math.radians(10)
    command.initialize()
    rows = []
    for k in range(5000):
        command.do_step(k * 5e-3, 5e-3)
        rows.append(command.angle)
    angle, _, reference, torque = Loop(torque=140 * GCM).run(lambda t: rows[round(t / 5e-3)], 25.0)
    assert np.abs(angle - math.radians(10))[-100:].max() / ARCSEC == pytest.approx(0.32, abs=0.05)
    assert 3.0 < np.abs(torque).max() < 3.83
    assert 5.0 < np.abs(angle - reference).max() / ARCSEC < 6.36


def test_unramped_start():
    goal = math.radians(10)
    slow = Loop().run(lambda t: 100 * ERU * t, 0.3)[3]
    assert np.abs(slow).max() == pytest.approx(9.16, abs=0.3)  # 2.5 J w/T = 9.33 without quantization
    angle, _, _, torque = Loop(law_error_max=1.0).run(lambda t: min(999.99 * ERU * t, goal), 6.0)
    assert np.abs(torque).max() == 9.80665
    assert (angle.max() - goal) / ARCSEC == pytest.approx(164, abs=2)


# -------------------------------------------------------------------------------- saturation, delay, presets
def test_saturation_is_fed_back_into_the_history():
    """Beyond the limit u_k-1 is the torque that was made, not the one that was wanted."""
    loop = Loop(quantum=1e-16, law_error_max=1.0)
    angle, _, _, torque = loop.run(lambda t: 2e-3, 0.3)
    assert np.abs(torque).max() == 9.80665
    ends = {}
    for fed_back in (True, False):
        x, u, e_last, y = np.zeros(2), 0.0, 0.0, []
        for _ in range(60):
            y.append(x[0])
            e = 2e-3 - x[0]
            u = -0.75 * u + 2 * J / 25e-6 * (1.25 * e - 0.75 * e_last)
            made = max(-9.80665, min(9.80665, u))
            e_last, u = e, made if fed_back else u
            x = loop.a @ x + loop.b * made
        ends[fed_back] = np.array(y)
    assert angle == pytest.approx(ends[True], abs=1e-12)
    assert np.abs(angle - ends[False]).max() > 1e-4


@pytest.mark.parametrize(("p", "delay"), [(0.0, 1e-3), (0.5, 2e-3), (0.5, 5e-3)])
def test_delay(p, delay):
    """The demand appears late by the delay, and the loop is that of the plant with late torque."""
    h = 1e-3
    part = Controller(law_p=p, law_delay=delay, law_quantum=1e-16)
    part.initialize()
    a, b, *_ = cont2discrete(plant(J), h)
    x, steps, seen = np.zeros(2), [], []
    for k in range(200):
        part.count_command, part.count = 1e10, math.floor(x[0] / 1e-16)
        part.do_step(k * h, h)
        steps.append(part.demand)
        seen.append(x[0])
        x = a @ x + b[:, 0] * part.demand
    changes = np.flatnonzero(np.diff([0.0, *steps]))
    assert {int(n + 1) % 5 for n in changes} == {round(delay / h) % 5}
    assert (changes[0] + 1) * h == pytest.approx(5e-3 + delay)
    # oracle: sampled states (angle, rate, torque on its way), torque u_k-1 for delay, then u_k
    f = np.array([[1.0, 5e-3], [0, 1]])
    late = np.array([delay * (5e-3 - delay / 2), delay]) / J
    now = np.array([(5e-3 - delay) ** 2 / 2, 5e-3 - delay]) / J
    bb = (p**3 + 3 * p * p + 3 * p - 3) / 4
    g, aa = 2 + bb - 3 * p, p**3 - bb
    s, u, e_last, expected = np.zeros(2), 0.0, 0.0, []
    for _ in range(39):
        e = 1e-6 - s[0]
        u_new = bb * u + 2 * J / 25e-6 * (g * e - aa * e_last)
        s = f @ s + late * u + now * u_new
        u, e_last = u_new, e
        expected.append(s[0])
    assert np.array(seen[9::5][: len(expected)]) == pytest.approx(np.array(expected[: len(seen[9::5])]), abs=1e-13)


def test_enable_and_preset():
    part = Controller()
    part.count_command, part.count, part.enable = 50.0, 0.0, 0.0
    part.initialize()
    part.do_step(0.0, 5e-3)
    assert part.demand == 0.0
    part.enable, part.preset = 1.0, 1.0
    part.do_step(5e-3, 5e-3)
    # the history holds the present error and no torque: (2 J/T2)(g - a) x, not (2 J/T2) g x
    assert part.demand == pytest.approx(2 * J / 25e-6 * 0.5 * 50 * QUANTUM, rel=1e-12)


def test_in_position():
    part = Controller(near_hold=0.02)
    part.initialize()
    flags = []
    for k in range(12):
        part.count_command = 0.0 if k != 6 else 6.0  # 6 counts are 1.08 arcsec
        part.do_step(k * 5e-3, 5e-3)
        flags.append(part.in_position)
    assert flags == [0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 1, 1]


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        ({"period": 1e-3, "law_quantum": 0.36 * ARCSEC}, "one count .* demands more than M_max"),
        ({"law_delay": 2e-3}, "unstable with a computation delay"),
        ({"law_p": 0.3, "law_delay": 4e-3}, "unstable with a computation delay"),
        ({"law_p": 0.5, "law_delay": 6e-3}, "longer than the period"),
        ({"law_p": 1.0}, "law_p"),
        ({"period": 0.0}, "period"),
        ({"period": 0.02}, "period"),
        ({"law_J": 0.0}, "law_J"),
        ({"law_p": 0.5, "law_delay": 1.5e-3}, "not a multiple of the internal step"),
    ],
)
def test_refusals(parameters, text):
    with pytest.raises(ComponentError, match=text):
        part = Controller(**parameters)
        part.initialize()
        part.do_step(0.0, part.period)


def test_torque_of_one_count():
    # 2 J/T2 1.25 quantum: 0.22 N.m at 5 ms, 5.6 N.m at 1 ms
    for T, torque in ((5e-3, 0.22), (1e-3, 5.6)):
        part = Controller(period=T)
        part.count_command = 1.0
        part.initialize()
        part.do_step(0.0, T)
        assert part.demand == pytest.approx(torque, abs=0.02 * torque)


@pytest.mark.parametrize(("count", "text"), [(0.5, "must be cumulative counts"), (1e6, "none counted per sample")])
def test_counts_must_be_cumulative(count, text):
    part = Controller()
    part.initialize()
    part.count = count
    with pytest.raises(ComponentError, match=text):
        part.do_step(0.0, 5e-3)


# ---------------------------------------------------------------------------------------- a plant with viscous friction
@pytest.mark.parametrize("p", [0.0, 0.5])
@pytest.mark.parametrize("D", [1e-4, 2.0, 400.0])
def test_poles_of_an_axis_with_viscous_friction(D, p):
    """(z - 1)(z - d)(z - b) + n (g z - a) = (z - p)3 with scipy's zero-order hold of 1/(s (J s + D))."""
    part = Controller(law_viscous=D, law_p=p)
    part.initialize()
    num, den, _ = cont2discrete(([1.0], [J, D, 0.0]), 5e-3)
    closed = np.polyadd(np.polymul(den, [1.0, -part.law_b]),
                        np.polymul(num.ravel()[-2:] * part.law_scale, [part.law_g, -part.law_a]))  # fmt: skip
    assert closed == pytest.approx(np.poly([p] * 3), abs=1e-9)


def test_step_and_ramp_of_an_axis_with_viscous_friction():
    """A step without error after three samples, of the design with D alone; of a ramp D w / K is left of either design.

    K = (2 J/T2)(g - a)/(1 - b), the static stiffness: the plant integrates once.
    """
    D, w, T = 40.0, 1e-3, 5e-3
    a, b, *_ = cont2discrete((np.array([[0.0, 1.0], [0.0, -D / J]]), np.array([[0.0], [1.0 / J]]), np.eye(2),
                              np.zeros((2, 1))), T)  # fmt: skip
    for viscous in (D, 0.0):
        loop = Loop(quantum=1e-16, law_viscous=viscous)
        loop.a, loop.b = a, b[:, 0]
        angle, *_ = loop.run(lambda t: 1e-6, 0.1)
        assert (abs(angle[3:] - 1e-6) < 1e-14).all() == (viscous > 0.0)
        loop = Loop(quantum=1e-16, law_viscous=viscous)
        loop.a, loop.b = a, b[:, 0]
        angle, _, reference, _ = loop.run(lambda t: w * t, 0.5)
        K = loop.part.law_scale * (loop.part.law_g - loop.part.law_a) / (1.0 - loop.part.law_b)
        assert reference[-1] - angle[-1] == pytest.approx(D * w / K, rel=1e-6)


def test_delay_of_an_axis_with_viscous_friction():
    """The start refuses a delay where an eigenvalue of the sampled states leaves the unit circle, and no other."""
    T, verdicts = 5e-3, set()
    for D, p, delay in [(d, p, k * 5e-4) for d in (1e-4, 30.0, 300.0) for p in (0.0, 0.2) for k in range(11)]:
        part = Controller(law_viscous=D, law_p=p, law_delay=delay, law_quantum=1e-9, step=5e-4)
        free = Controller(law_viscous=D, law_p=p)
        free.initialize()
        plain = np.array([[0.0, 1.0], [0.0, -D / J]]), np.array([[0.0], [1.0 / J]]), np.eye(2), np.zeros((2, 1))
        new = cont2discrete(plain, max(T - delay, 1e-12))
        old = cont2discrete(plain, max(delay, 1e-12))
        A = new[0] @ old[0]
        gain = free.law_scale
        # states: angle, rate, last torque, last error; x = -angle, u = b u' + gain (g x - a x')
        u = np.array([-gain * free.law_g, 0.0, free.law_b, -gain * free.law_a])
        M = np.zeros((4, 4))
        M[:2, :2], M[:2, 2] = A, (new[0] @ old[1])[:, 0]
        M[:2] += np.outer(new[1][:, 0], u)
        M[2], M[3, 0] = u, -1.0
        largest = float(np.max(np.abs(np.linalg.eigvals(M))))
        if abs(largest - 1.0) < 1e-6:
            continue
        try:
            part.initialize()
            stable = True
        except ComponentError as error:
            assert "unstable" in str(error)
            stable = False
        assert stable == (largest < 1.0), (D, p, delay, largest)
        verdicts.add(stable)
    assert verdicts == {True, False}
