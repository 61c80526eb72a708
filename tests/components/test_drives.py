"""Motors of a table axis: square law with root shaper, DC motor with current loop, tachometer."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

Ac, Dc, Tachometer = (load_part(n, BENCH) for n in ("motor_square_law", "motor_dc", "tachometer"))


def run(part, demand, rate=0.0, *, h=1e-4, time=0.01):
    """Return (t, torque, voltage, saturated) after each step; demand: a number or a function of the time."""
    part.initialize()
    part.rate = rate
    rows = []
    for k in range(round(time / h)):
        part.demand = demand(k * h) if callable(demand) else demand
        part.do_step(k * h, h)
        rows.append((k * h + h, part.torque, part.voltage, part.saturated))
    return np.array(rows)


# ---------------------------------------------------------------------------------------- square law
@pytest.mark.parametrize("demand", [4.0, -1.0, 1e-9])
def test_root_shaper_makes_the_torque_the_demand(demand):
    """Settled: M = K U |U| = demand.  On the way sqrt(M) follows its lag: M = demand (1 - exp(-t / lag))2."""
    track = run(Ac(), demand)
    way = demand * (1.0 - np.exp(-track[:, 0] / 5e-4)) ** 2
    assert np.allclose(track[:, 1], way, rtol=1e-11) and track[-1, 1] == pytest.approx(demand, rel=1e-8)


def test_square_law_without_shaper_and_its_limit():
    """M_max = 9.80665e-4 * 100^2 = 9.80665 N.m.  Without shaper d gives d |d| / M_max: 1.4 -> 0.19987."""
    assert run(Ac(motor_shaper=0), -1.4)[-1, 1] == pytest.approx(-1.4 * 1.4 / 9.80665, rel=1e-8)
    track = run(Ac(), -20.0)
    assert track[-1, 1] == pytest.approx(-9.80665, rel=1e-8) and track[-1, 3] == 1.0
    assert run(Ac(), 9.8)[-1, 3] == 0.0


def test_phase_of_the_shaped_motor_does_not_depend_on_the_amplitude():
    """Root, lag and square are homogeneous of degree one: ten times the demand gives ten times the torque, always."""

    def sine(size):
        return lambda t: size * math.sin(2.0 * math.pi * 50.0 * t)

    small, large = (run(Ac(), sine(a), time=0.04)[:, 1] for a in (0.01, 0.1))
    assert np.allclose(10.0 * small, large, rtol=1e-10, atol=1e-12)


def test_mistrimmed_shaper_pulls_at_null():
    """U = offset at demand 0: M = K offset |offset|; 2 V: 3.92e-3 N.m, the other way round for -2 V."""
    for offset in (2.0, -2.0):
        expected = 9.80665e-4 * offset * abs(offset)
        assert run(Ac(motor_offset=offset), 0.0)[-1, 1] == pytest.approx(expected, rel=1e-8)


def test_back_emf_of_the_square_law_motor():
    """V = U - K_e rate = sqrt(4 / K) - 20 * 0.5 V."""
    expected = 9.80665e-4 * (math.sqrt(4.0 / 9.80665e-4) - 10.0) ** 2
    assert run(Ac(motor_K_e=20.0), 4.0, 0.5)[-1, 1] == pytest.approx(expected, rel=1e-8)


# --------------------------------------------------------------------------------------------- DC
def dc_oracle(demand, rate, times, *, K_t=2.98, K_e=2.98, R=4.0, L=0.02, U_max=48.0, i_max=5.0, b=3000.0):
    """Current at the times: winding and controller as a differential equation, no wind-up by a fast discharge."""

    def slope(t, y):
        i, q = y
        goal = min(max(demand(t) / K_t, -i_max), i_max)
        wanted = L * b * (goal - i) + q
        U = min(max(wanted, -U_max), U_max)
        di = (U - R * i - K_e * rate) / L
        natural = R * i + K_e * rate
        return [di, R * b * (goal - i) if wanted == U else R * di + 1e5 * (natural - q)]

    y = solve_ivp(slope, (0.0, times[-1]), [0.0, 0.0], "LSODA", t_eval=times, rtol=1e-9, atol=1e-12, max_step=1e-5).y
    return y[0]


@pytest.mark.parametrize(("demand", "rate", "error"), [(1.5, 0.0, 1e-7), (-0.6, 1.0, 1e-7), (12.0, 2.0, 0.02)])
def test_current_loop_beside_a_differential_equation(demand, rate, error):
    """Within the voltage it is exact; 12 N.m saturate it at first, and the step ends the slew up to one step late."""
    track = run(Dc(), demand, rate, h=1e-4, time=0.015)
    expected = 2.98 * dc_oracle(lambda t: demand, rate, track[:, 0])
    assert np.max(np.abs(track[:, 1] - expected)) < error * abs(demand)
    assert track[-1, 1] == pytest.approx(demand, rel=0.02)  # a back EMF dies out with L / R = 5 ms
    assert track[:20, 3].any() == (abs(demand) > 10.0) and track[-1, 3] == 0.0


def test_current_loop_has_its_bandwidth():
    """Without back EMF i / i_d = 1 / (1 + s / b): after 1/b the torque is 1 - 1/e of the demand."""
    track = run(Dc(motor_bandwidth=2000.0), 0.5, h=5e-4, time=5e-3)
    assert np.allclose(track[:, 1], 0.5 * (1.0 - np.exp(-2000.0 * track[:, 0])), rtol=1e-11)


def test_limits_of_current_and_of_back_emf():
    """5 A * 2.98 = 14.9 N.m; at 20 rad/s the 48 V leave (48 - 59.6) / 4 = -2.9 A: the motor brakes."""
    track = run(Dc(), 30.0, time=0.05)
    assert track[-1, 1] == pytest.approx(14.9, rel=1e-6) and track[-1, 3] == 1.0
    assert run(Dc(), 10.0, 20.0, time=0.1)[-1, 1] == pytest.approx(2.98 * (48.0 - 59.6) / 4.0, rel=1e-6)


def test_cogging_and_ripple_at_their_orders():
    """One turn in 1 s at a held demand: harmonics 72 (cogging, demand or not) and 36 (ripple, share of the torque)."""
    rate = 2.0 * math.pi
    wave = {"motor_cogging": 0.05, "motor_cogging_phase": 0.3, "motor_ripple": 0.02, "motor_ripple_phase": -0.2}
    for demand in (0.0, 2.0):
        track = run(Dc(motor_K_e=0.0, **wave), demand, rate, h=1e-3, time=1.1)
        one = track[-1000:]
        x = rate * one[:, 0]
        for order, amplitude, phase in ((72, 0.05, 0.3), (36, 0.02 * demand, -0.2)):
            line = 2.0 * np.mean(one[:, 1] * np.exp(-1j * order * x))
            assert line == pytest.approx(amplitude * np.exp(1j * (phase - math.pi / 2.0)), abs=1e-9)
        assert np.mean(one[:, 1]) == pytest.approx(demand, abs=1e-9)


@pytest.mark.parametrize(
    ("part", "values", "text"),
    [
        (Ac, {"motor_K": 0.0}, "motor_K = 0"),
        (Ac, {"motor_U_max": 0.0}, "motor_U_max = 0"),
        (Dc, {"motor_bandwidth": 250.0}, "must be at least 1.5 R / L"),
        (Dc, {"motor_R": 0.0}, "motor_R = 0"),
    ],
)
def test_what_is_refused(part, values, text):
    with pytest.raises(ComponentError, match=text):
        part(**values).initialize()


# --------------------------------------------------------------------------------------- tachometer
def test_tachometer():
    """2 rad/s read 1 % too large, with a ripple of 3 % at 10 cycles: 2.02 (1 + 0.03 sin(10 x + 0.1))."""
    part = Tachometer(tacho_scale_error=0.01, tacho_ripple=0.03, tacho_cycles=10, tacho_phase=0.1)
    part.initialize()
    for x in (0.0, 0.2, -1.0):
        part.angle, part.rate = x, 2.0
        part.do_step(0.0, 1e-3)
        assert part.reading == pytest.approx(2.02 * (1.0 + 0.03 * math.sin(10.0 * x + 0.1)), rel=1e-12)
