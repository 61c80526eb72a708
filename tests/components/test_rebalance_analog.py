"""Gains, limit and anti-windup, and the measurement of the current."""

import math
from functools import partial

import numpy as np
import pytest
from pulse_loop import ARCSEC, RATIO, SCALE, TAU, Loop, loop_gain
from scipy.integrate import solve_ivp
from scipy.signal import welch
from wired import DEG_H, RebalanceAnalog, begun

from gyrobench.component import ComponentError

H = 1e-3


started = partial(begun, RebalanceAnalog, meter=0.0)


def feed(part, u, steps, h=H, k0=0):
    out = []
    for k in range(k0, k0 + steps):
        part.u = u(k)
        part.do_step(k * h, h)
        out.append((part.i, part.i_read, part.saturated, part.q))
    return np.array(out)


def test_default_gains_are_those_of_the_method():
    # M = -H k i = -20 b - 200 (integral of b) N.m with u = 10 b, H = 0.2, k = 17.2 deg/h/mA
    part = started()
    k = 17.2 * DEG_H / 1e-3
    assert 0.2 * k * part.K_p * 10.0 == pytest.approx(20.0, rel=1e-12)
    assert 0.2 * k * part.K_i * 10.0 == pytest.approx(200.0, rel=1e-12)


def test_step_response():
    # u = 1e-4 V held for 0.1 s: i = K_p u + K_i u t
    out = feed(started(K_p=100.0, K_i=1000.0), lambda k: 1e-4, 100)
    assert out[0, 0] == pytest.approx(0.01 + 1e-4, rel=1e-14)
    assert out[-1, 0] == pytest.approx(0.01 + 0.01, rel=1e-13)


def test_held_input_against_a_tight_reference():
    """The README's number: q against solve_ivp (rtol 1e-12) of q' = u, u held over each step."""
    u = lambda k: 1e-4 * math.sin(0.05 * k)  # noqa: E731
    part = started()
    feed(part, u, 500)
    q = [0.0]
    for k in range(500):
        q = solve_ivp(lambda _, y, k=k: [u(k)], (k * H, (k + 1) * H), q, "DOP853", rtol=1e-12, atol=1e-18).y[:, -1]
    assert part.q == pytest.approx(q[0], abs=1e-19)


def test_limit_does_not_wind_up():
    # K_p u = 0.02 A below the limit of 0.05; K_i q reaches 0.03 after 0.15 s; 10 s later q still stands there
    part = started(K_p=100.0, K_i=1000.0)
    out = feed(part, lambda k: 2e-4, 10_000)
    assert out[-1, 0] == 0.05 and out[-1, 2] == 1.0
    assert part.q == pytest.approx(3e-5, abs=2.5e-7)  # at most one step of 2e-7 V.s beyond
    assert out[:149, 2].max() == 0.0 and out[152:, 2].min() == 1.0
    back = feed(part, lambda k: -2e-4, 20, k0=10_000)
    assert back[0, 2] == 0.0  # free at once
    assert back[0, 0] == pytest.approx(0.01 - 2e-4, abs=3e-4)
    low = feed(part, lambda k: -2e-4, 10_000, k0=10_020)
    assert low[-1, 0] == -0.05 and part.q == pytest.approx(-3e-5, abs=2.5e-7)


def test_resolution():
    out = feed(started(resolution=1e-6, K_i=0.0, K_p=1.0), lambda k: 1.37e-7 * k - 5e-6, 100)
    steps = out[:, 1] / 1e-6
    assert steps == pytest.approx(np.round(steps), abs=1e-9)
    assert abs(out[1:, 1] - out[:-1, 0]).max() <= 0.5e-6 + 1e-15


def test_the_meter_reads_the_current_of_the_step_that_ends():
    out = feed(started(), lambda k: 1e-5 * k, 50)
    assert (out[1:, 1] == out[:-1, 0]).all()
    part = started()
    part.u = 1e-5
    part.initialize()
    assert part.i == part.i_read == pytest.approx(part.K_p * 1e-5)


@pytest.mark.parametrize("h", [1e-3, 4e-3])
def test_meter_noise_density_does_not_depend_on_the_step(h):
    part = started(meter=2e-7, step=1.0)
    n = 20_000
    read = feed(part, lambda k: 0.0, n, h=h)[:, 1]
    assert feed(part, lambda k: 0.0, 1)[:, 0] == 0.0  # the applied current is clean
    _, density = welch(read, 1 / h, nperseg=500, return_onesided=False)
    # 79 segments overlap by half; mean over the band: standard error about 1 / sqrt(n)
    assert np.mean(density) == pytest.approx(4e-14, rel=5 / math.sqrt(n))
    blocks = read.reshape(-1, 50).mean(axis=1)
    assert blocks.var() == pytest.approx(4e-14 / (50 * h), rel=5 * math.sqrt(2 / len(blocks)))


EARTH = 7.2921159e-5  # rad/s
K_V = RATIO * 15.04106  # 1/s: 1 arcsec of float angle at one Earth rate, whatever H


def proportional(rate: float, step: float) -> Loop:
    return Loop(rate, step, RebalanceAnalog, meter=0.0, i_max=1.0, **loop_gain(K_V / 2.0 / math.pi))


def test_gain_rule_of_the_proportional_loop():
    """H/C = 4/3: K_v = 20.05 1/s; at rest i = w/k and the float stands at 1 arcsec [eq. 5-64, 5-67]."""
    loop = proportional(EARTH, 1e-3)
    loop.run(1.0)
    assert pytest.approx(20.05, abs=0.005) == K_V
    assert loop.theta / ARCSEC == pytest.approx(1.0, rel=1e-5)
    assert SCALE * loop.part.i == pytest.approx(EARTH, rel=1e-8)


@pytest.mark.parametrize("hertz", [3.25, 8.0])
def test_frequency_response_of_the_proportional_loop(hertz):
    """|k i / w| = K_v / sqrt(w2 + (K_v - tau w2)2) with the square on the bracket (ET16); -3 dB at 3.25 Hz."""
    w, step = 2.0 * math.pi * hertz, 1e-4
    loop = proportional(0.0, step)
    seen = []
    for k in range(round((0.5 + 2.0 / hertz) / step)):
        loop.rate = EARTH * math.sin(w * (k + 0.5) * step)
        loop.run(step)
        seen.append(SCALE * loop.part.i)
    t = np.arange(1, len(seen) + 1) * step
    last = t > t[-1] - 1.0 / hertz
    fit = np.linalg.lstsq(np.column_stack([np.sin(w * t), np.cos(w * t)])[last], np.array(seen)[last], rcond=None)[0]
    gain = np.hypot(*fit) / EARTH
    assert gain == pytest.approx(K_V / math.hypot(w, K_V - TAU * w * w), rel=2e-3)
    assert hertz != 3.25 or gain == pytest.approx(math.sqrt(0.5), rel=3e-3)


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"i_max": 0.0}, "i_max = 0 A must be > 0"),
        ({"K_p": -1.0}, "K_p = -1 A/V must be >= 0"),
        ({"K_i": -1.0}, r"K_i = -1 A/\(V.s\) must be >= 0"),
        ({"resolution": -1e-9}, "resolution = -1e-09 A must be >= 0"),
        ({"meter": -1e-9}, r"meter = -1e-09 A/sqrt\(Hz\) must be >= 0"),
    ],
)
def test_refuses(parameters, message):
    with pytest.raises(ComponentError, match=message):
        started(**parameters)
