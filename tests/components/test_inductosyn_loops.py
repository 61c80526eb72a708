"""Inductosyn: loops of its multiplier, excitation by the width of pulses."""

import math

import numpy as np
import pytest
from inductosyns import ARCSEC, CLEAN, DEG, KHZ2, PULSE, H, Inductosyn, follow, started
from scipy.integrate import solve_ivp


# ---------------------------------------------------------------------------------------- multiplier loop
def test_lag_of_the_multiplier_loops():
    """Type 1 lags rate / K_v = 328 arcsec at 1 rad/s and 2 pi 100 1/s, type 2 and the ideal one not."""
    lags = {}
    for kind in (0, 1, 2):
        part = started(0.0, 1.0, loop_type=kind)
        lags[kind] = -follow(part, lambda t: t, lambda t: 1.0, 0.2)[-20:, 1] / ARCSEC
    assert lags[1] == pytest.approx(328.3, abs=0.2)
    assert np.abs(lags[0]).max() <= 0.1 and np.abs(lags[2]).max() <= 0.1


@pytest.mark.parametrize("h", [1e-4, 5e-3])
@pytest.mark.parametrize("kind", [1, 2])
def test_multiplier_loop_against_its_differential_equation(kind, h):
    """A table that starts, turns and stops (rate linear between the steps): exact whatever the step."""
    K = 200.0
    knots = np.array([0.0, 0.05, 0.1, 0.15, 0.3])
    rates = np.array([0.0, 0.5, 0.5, 0.0, 0.0])

    def rate(t):
        return float(np.interp(t, knots, rates))

    def angle(t):  # exact integral of the rate
        pieces = np.append(knots[knots < t], t)
        values = [rate(x) for x in pieces]
        return float(np.trapezoid(values, pieces))

    def slope(t, y):
        x = (np.interp(t, knots, rates), angle(t))
        if kind == 1:
            return [K * (x[1] - y[0])]
        return [y[1] + K * (x[1] - y[0]), K * K / 4 * (x[1] - y[0])]

    part = started(0.0, loop_type=kind, loop_K_v=K, rate_max=0.6)
    rows = follow(part, angle, rate, 0.3, h=h)
    exact = solve_ivp(slope, (0, 0.3), [0.0] * kind, t_eval=rows[:, 0], rtol=1e-9, atol=1e-12, max_step=1e-3).y[0]
    read = rows[:, 1] + [angle(t) for t in rows[:, 0]]
    assert read == pytest.approx(exact, abs=0.51 * part.quantum + 1e-9)
    assert np.abs(rows[:, 1]).max() > 1e-4  # the lag itself is a hundred quanta


def test_beyond_the_capture_range_a_cycle_is_lost_and_said():
    """Type 1, half a cycle 0.25 deg: at K_v = 100 1/s rates above 0.436 rad/s lose it for good."""
    part = started(0.0, loop_type=1, loop_K_v=100.0, rate_max=0.43)

    def rate(t):
        return float(np.interp(t, [0.0, 0.5, 1.0, 1.5], [0.0, 0.6, 0.0, 0.0]))

    def angle(t):
        x = np.append(np.array([0.0, 0.5, 1.0])[np.array([0.0, 0.5, 1.0]) < t], t)
        return float(np.trapezoid([rate(v) for v in x], x))

    rows = follow(part, angle, rate, 1.5)
    assert rows[300, 3] == 0.0 and rows[-1, 3] == 1.0  # at 0.36 rad/s still locked
    cycles = rows[-1, 1] / (0.5 * DEG)
    assert round(cycles) <= -1 and cycles == pytest.approx(round(cycles), abs=1e-3)
    held = started(0.0, loop_type=1, loop_K_v=100.0, rate_max=0.43)
    assert not follow(held, lambda t: 0.3 * angle(t), lambda t: 0.3 * rate(t), 1.5)[:, 3].any()


# --------------------------------------------------------------------------------------------- pulse width
def test_pulse_widths_drive_like_sine_and_cosine():
    """Fundamental of a bipolar pulse of width 2 a_0: (4/pi) sin a_0, null at p a = a_0; one clock 1 arcsec."""
    u = (np.arange(36000) + 0.5) / 100.0
    for a0 in (10, 33, 71):
        pulses = 1.0 * (abs(u - 90) < a0) - 1.0 * (abs(u - 270) < a0)
        assert 2 / 36000 * abs(np.sum(pulses * np.exp(-1j * np.radians(u)))) == pytest.approx(
            4 / math.pi * math.sin(math.radians(a0)), abs=1e-3
        )
    part = started(0.5, **PULSE)
    assert part.N == 3600.0
    assert part.angle_read == pytest.approx(0.5, abs=0.51 * ARCSEC)


def test_the_pulse_width_reading_is_the_null_of_the_output():
    """5-38, 5-39: U_2 = K U_1 sin(a_i - p alpha) is 0 within half a clock where a_i = p times the reading."""
    for a in np.linspace(-1.0, 2.0, 17):
        part = started(a, **PULSE)
        a_i = 2 * math.pi * (part.count % 3600) / 3600
        assert abs(math.sin(a_i - 360 * a)) <= math.sin(math.pi / 3600) + 1e-9 and math.cos(a_i - 360 * a) > 0


def test_a_late_hour_changes_nothing():
    """At 1e6 s the excitation periods are still counted one by one: slew limit and stamps as at the start."""
    t0 = 1e6
    part = Inductosyn(**{**CLEAN, **PULSE})
    part.initialize(t0)
    for k in range(300):
        part.angle = 1900 * ARCSEC * (k + 1) * H
        part.rate = 1900 * ARCSEC
        part.do_step(t0 + k * H, H)
        assert abs(part.angle_read - part.angle) <= 1.6 * ARCSEC
    part = Inductosyn(**{**CLEAN, **KHZ2, "mode": 0})
    part.rate = 1.0
    part.initialize(t0)
    for k in range(300):
        part.angle = (k + 1) * H
        part.do_step(t0 + k * H, H)
        if k > 1:
            assert abs(part.angle_read - (part.t_read - t0)) <= 0.51e-4 * DEG + 1e-9


def test_the_pulse_width_counter_follows_one_clock_a_period():
    part = started(0.0, **PULSE)  # at 2 kHz: 2000 arcsec/s
    rows = follow(part, lambda t: 1900 * ARCSEC * t, lambda t: 1900 * ARCSEC, 0.5)
    assert np.abs(rows[:, 1]).max() <= 1.6 * ARCSEC and not rows[:, 3].any()
    part = started(0.0, **PULSE)
    rows = follow(part, lambda t: 4000 * ARCSEC * t, lambda t: 4000 * ARCSEC, 1.2)
    assert rows[499, 1] == pytest.approx(-1000 * ARCSEC, abs=10 * ARCSEC)  # half the rate is left behind
    assert rows[890, 3] == 0.0 and rows[910, 3] == 1.0  # half a cycle, 1800 arcsec, after 0.9 s
    end = part.angle
    rows = follow(part, lambda t: end, lambda t: 0.0, 3.0, start=1.2)
    assert rows[-1, 1] == pytest.approx(-DEG, abs=0.51 * ARCSEC)  # at rest it stands in the cycle before
