"""The network against scipy.signal, its margins with python-control, limits without wind-up, refusals."""

from functools import partial

import control
import numpy as np
import pytest
from scipy.signal import cont2discrete
from wired import BENCH, begun

from gyrobench.component import ComponentError
from gyrobench.linear.part_linearization import state_space
from gyrobench.packaging import load_part

StabilizerLeadLag = load_part("stabilizer_lead_lag", BENCH)


started = partial(begun, StabilizerLeadLag)


def network(K=2.0, tau1=0.2, T1=2.0, tau2=0.03, T2=0.003, integral=0.0):
    """(numerator, denominator) of G in powers of s, written out."""
    num = K * np.polymul([tau1, 1.0], [tau2, 1.0])
    den = np.polymul([T1, 1.0], [T2, 1.0])
    return (np.polymul(num, [1.0, integral]), np.polymul(den, [1.0, 0.0])) if integral else (num, den)


@pytest.mark.parametrize("h", [1e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("given", [{}, {"integral": 3.0}, {"K": 0.7, "tau1": 0.5, "T1": 0.1, "tau2": 0.0, "T2": 0.02}])
def test_held_inputs_are_exact(given, h):
    """v = -G (u + test - K_u command), held and random: the exact discrete network by zero-order hold."""
    num, den, _ = cont2discrete(network(**given), h, "zoh")
    num, part = num.ravel(), started(**given, K_u=3.0, v_max=1e9, step=1.0)
    rng = np.random.default_rng(3)
    e = rng.normal(size=300)
    out, n = np.zeros(300), len(den)
    for k in range(300):
        part.u, part.test, part.command = 0.25 * e[k], e[k], e[k] / 12.0
        part._dirty = True
        past = slice(max(0, k - n + 1), k)
        m = min(k, n - 1)
        out[k] = num[: m + 1] @ e[k - m : k + 1][::-1] - (den[1 : m + 1] @ out[past][::-1] if m else 0.0)
        assert part.get("v") == pytest.approx(-out[k], rel=1e-8, abs=1e-9)
        assert part.get("e") == pytest.approx(1.25 * e[k], rel=1e-15)
        part.do_step(k * h, h)


def loop(gain=1.0):
    """L = K_m K_x G / (J_x s2) with G from the part's own linearization (the part carries the minus)."""
    g = state_space(started(), ["u"], ["v"])
    return control.tf([-gain * 8250.0], [0.5, 0.0, 0.0]) * control.ss2tf(g)


def test_margins_of_the_method():
    """Crossover 100 rad/s, phase margin 52.3 deg, -24 dB/decade; stable at 5 % of the gain, not at 4 %."""
    lower, phase, _, crossover = control.margin(loop())
    assert crossover == pytest.approx(100.0, abs=0.5)
    assert phase == pytest.approx(52.3, abs=0.1)
    assert lower == pytest.approx(0.044, abs=0.001)
    decade = np.abs(loop()(1j * np.array([crossover * 0.999, crossover * 1.001])))
    assert 20 * np.log10(decade[1] / decade[0]) / np.log10(1.001 / 0.999) == pytest.approx(-24.0, abs=1.0)
    for gain, stable in ((0.04, False), (0.05, True), (1.0, True), (10.0, True)):
        assert bool(max(control.poles(control.feedback(loop(gain), 1)).real) < 0.0) is stable


def test_at_rest_the_gain_is_K():
    """A finite T1 does not remove the error at rest; with the integral v grows without end."""
    part = started(T1=0.5, tau1=0.2)
    part.u = 0.01
    for k in range(1000):
        part.do_step(0.02 * k, 0.02)
    assert part.v == pytest.approx(-2.0 * 0.01, rel=1e-9)
    part = started(T1=0.5, tau1=0.2, integral=1.0)
    part.u = 0.01
    for k in range(1000):
        part.do_step(0.02 * k, 0.02)
    assert part.v == pytest.approx(-2.0 * 0.01 * (1.0 + 20.0), rel=0.02)  # 20 s, less the start of the lag


def test_limit_without_wind_up():
    """Ten seconds at the limit, then e turns round: v leaves the limit at once, not after ten seconds."""
    part = started(tau1=1.0, T1=1.0, tau2=1.0, T2=1.0, K=10.0, integral=1.0, v_max=1.0)
    part.u = 1.0
    for k in range(1000):
        part.do_step(0.01 * k, 0.01)
    assert (part.v, part.saturated) == (-1.0, 1.0) and part.sum < 0.01
    part.u = -0.05
    part.do_step(10.0, 0.01)
    assert part.v > 0.4 and part.saturated == 0.0


@pytest.mark.parametrize("step", [1e-3, 2e-4])
def test_integral_that_waits_within_the_step_is_told(step):
    """tau2/T2 = 200, K = 2: a jump of 0.1 V is 40 V at the beginning of a step of 1 ms, 100 T2, and 0.2 V at its end.

    The limit of 27 V is met within: the integral waits for the whole step, or for the first of five internal ones, and
    goes on in the next.  Without a limit in reach, with T2 = the step, or without an integral nothing waits.
    """
    given = {"tau1": 1.0, "T1": 1.0, "tau2": 2e-3, "T2": 1e-5, "integral": 3.0, "step": step}

    def flags(**other):
        part = started(**(given | other))
        part.u = 0.1
        found = []
        for k in range(2):
            part.do_step(1e-3 * k, 1e-3)
            assert abs(part.v) < 1.0
            found.append(part.saturated)
        return found, part.sum

    told, sum_ = flags()
    assert told == [1.0, 0.0] and sum_ == pytest.approx(3.0 * 0.1 * (2e-3 - step), rel=0.1)
    told, sum_ = flags(v_max=50.0)
    assert told == [0.0, 0.0] and sum_ > 3.0 * 0.1 * 2e-3
    assert flags(integral=0.0)[0] == flags(tau2=2e-3, T2=1e-3)[0] == [0.0, 0.0]


@pytest.mark.parametrize("given, flag", [({}, 0.0), ({"tau1": 2.5}, 1.0), ({"tau2": 0.3}, 1.0), ({"T2": 0.03}, 1.0)])
def test_order_is_flagged(given, flag):
    assert started(**given).unordered == flag


@pytest.mark.parametrize(
    "given, message",
    [
        ({"T1": 0.0}, "T1 = 0 s must be > 0"),
        ({"T2": -1.0}, "T2 = -1 s must be > 0"),
        ({"tau1": -0.1}, "tau1 = -0.1 s must be >= 0"),
        ({"K": -1.0}, "K = -1 1 must be >= 0"),
        ({"integral": -1.0}, "integral = -1 1/s must be >= 0"),
        ({"v_max": 0.0}, "v_max = 0 V must be > 0"),
    ],
)
def test_refuses(given, message):
    with pytest.raises(ComponentError, match=message):
        started(**given)
