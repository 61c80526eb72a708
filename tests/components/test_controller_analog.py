"""Analogue controller: networks against python-control, count loop, tachometer loop, presets."""

import math

import control
import numpy as np
import pytest
from wired import BENCH, begun

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

Controller = load_part("controller_analog", BENCH)
ERU, ARCSEC, GCM, DEG = 7.2921159e-5, math.pi / 648000, 9.80665e-5, math.pi / 180
QUANTUM, J, M_MAX = 0.18 * ARCSEC, 2.56, 9.80665


def started(**values):
    return begun(Controller, **values)


def network(number, w):
    s = control.tf("s")
    lag = (1 + 12 * s / w) / (1 + 60 * s / w)

    def lead(r):
        return (1 + math.sqrt(r) * s / w) / (1 + s / (math.sqrt(r) * w))

    return {1: lead(4) ** 2 * lag, 2: lead(5) ** 2 * lag, 3: lead(28) ** 2, 4: lead(6.5) ** 3, 5: lead(14) * lag}[
        number
    ]


@pytest.mark.parametrize("number", [1, 2, 3, 4, 5])
def test_networks(number):
    """Step response of each set against python-control; the gain puts the crossover of J at w."""
    w, h = 200.0, 1e-3
    part = started(bank_network=number, bank_crossover=w, M_max=1e9)
    gain = J * w * w / abs(network(number, w)(1j * w))
    assert part.bank_K == pytest.approx(gain, rel=1e-12)
    t = np.arange(60) * h
    expected = control.forced_response(network(number, w), t, np.ones_like(t)).outputs * gain * 1000 * QUANTUM
    part.count_command = 1000.0
    out = []
    for k in range(60):
        part.do_step(k * h, h)
        out.append(part.demand)
    assert np.array(out[:-1]) == pytest.approx(expected[1:], rel=1e-9)


def test_own_networks_and_gain():
    part = started(
        bank_network=0, bank_zeros=[10.0, 20.0, 30.0], bank_poles=[100.0, 20.0, 30.0], bank_gain=5.0, count_command=1e6
    )
    part.do_step(0.0, 1.0)
    assert part.demand == pytest.approx(5.0 * 1e6 * QUANTUM, rel=1e-9)  # settled: 1e6 counts are 0.87 rad


def test_count_loop_margins_and_constant_rate():
    w = 40 * math.pi
    part = started()
    s = control.tf("s")
    opened = part.bank_K * network(5, w) / (J * s * s)
    _, pm, _, wc = control.margin(opened)
    assert wc == pytest.approx(w, rel=1e-6) and pm > 50.0
    h, x, v, errors = 5e-4, 0.0, 0.0, []
    for k in range(4000):
        reference = 10 * ERU * k * h
        part.count_command, part.count = math.floor(reference / QUANTUM), math.floor(x / QUANTUM)
        errors.append(x - reference)
        part.do_step(k * h, h)
        a = (part.demand + 140 * GCM) / J
        x, v = x + v * h + 0.5 * a * h * h, v + a * h
    # no error of a constant rate; 140 g.cm / 2662 g.cm/arcsec = 0.05 arcsec and one count
    assert np.abs(errors[2000:]).max() / ARCSEC < 0.05 + 0.18
    assert part.saturated == 0.0


def test_preset_and_enable_switch_without_a_jump():
    part = started(enable=0.0, count_command=40.0)
    part.do_step(0.0, 1e-3)
    assert part.demand == 0.0
    part.enable = 1.0
    part.do_step(1e-3, 1e-3)
    assert part.demand == pytest.approx(part.bank_K * 40 * QUANTUM, rel=1e-12)
    part.count_command = 80.0
    part.preset = 1.0
    part.do_step(2e-3, 1e-3)
    assert part.demand == pytest.approx(part.bank_K * 80 * QUANTUM, rel=1e-12)


# ------------------------------------------------------------------------------------------- tachometer
def tacho(rate, time, h=1e-3, ripple=1e-3, cycles=36):
    """Rate of a table with 6000 g.cm of friction, whose tachometer has ripple."""
    part = started(loop=1)
    part.rate_command = rate
    w = angle = 0.0
    out = []
    for k in range(round(time / h)):
        part.tacho = w * (1 + ripple * math.sin(cycles * angle))
        part.do_step(k * h, h)
        w += h * (part.demand - 6000 * GCM * math.tanh(w / 1e-4)) / J
        angle += h * w
        out.append(w)
    return np.array(out)


def spread(w):
    return (w.max() - w.min()) / 2 / w[-1]


def test_tachometer_loop():
    # 99 % of 999.9 deg/s after 0.99 J w / (M - M_f) = 4.80 s
    fast = tacho(999.9 * DEG, 7.0)
    reached = np.argmax(fast > 0.99 * 999.9 * DEG) * 1e-3
    assert reached == pytest.approx(0.99 * J * 999.9 * DEG / (M_MAX - 6000 * GCM), abs=0.02)
    assert reached == pytest.approx(4.80, abs=0.01)
    # 0.1 % of ripple at 36 cycles a turn: 1 Hz at 10 deg/s is inside the loop's 5 Hz, 100 Hz at 999.9 deg/s is not
    assert spread(tacho(10 * DEG, 4.0)[-2000:]) == pytest.approx(1.1e-3, abs=0.1e-3)
    assert spread(fast[-1000:]) == pytest.approx(5e-5, abs=1e-5)


def test_example_of_a_tachometer_loop():
    """ET14: 2.61e4 g.cm.s2 (not g.cm2) are 2.56 kg.m2; 6000 g.cm leave M / (J w_b) = 151 deg/h at 50 Hz, all of 10 ERU.

    The printed 31.6 deg/h would be 21.0 % of 10 ERU, not 21.6 %; it is not what the loop does.
    """
    eru = 7.2921159e-5
    inertia = 2.61e4 * GCM  # 1 g.cm.s2 = 9.80665e-5 kg.m2, as 1 g.cm = 9.80665e-5 N.m
    assert inertia == pytest.approx(2.56, abs=1e-3)
    assert 31.6 * DEG / 3600.0 / (10.0 * eru) == pytest.approx(0.210, abs=5e-4)
    part = started(loop=1, rate_K_p=inertia * 100.0 * math.pi, rate_K_i=0.0, rate_rate_least=0.0)
    part.rate_command = 20.0 * eru
    w = 20.0 * eru
    for k in range(500):  # 0.1 s, 31 time constants of the loop
        part.tacho = w
        part.do_step(k * 2e-4, 2e-4)
        w += 2e-4 * (part.demand - 6000.0 * GCM) / inertia
    lost = 20.0 * eru - w
    assert lost / DEG * 3600.0 == pytest.approx(150.9, abs=0.1)
    assert lost == pytest.approx(6000.0 * GCM / (inertia * 100.0 * math.pi), rel=1e-9)
    assert lost / (10.0 * eru) == pytest.approx(1.003, abs=1e-3)


@pytest.mark.parametrize(("rate", "text"), [(1000.0, "above rate_rate_most"), (0.09, "use the synchronous rate")])
def test_rates_of_the_tachometer_loop(rate, text):
    part = started(loop=1)
    part.rate_command = -rate * DEG
    with pytest.raises(ComponentError, match=text):
        for k in range(3):
            part.do_step(k * 1e-3, 1e-3)
