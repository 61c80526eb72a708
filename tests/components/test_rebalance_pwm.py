"""Pulse-width rebalance: charge of the pulses, counts, the loop with a float in closed form, refusals."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from pulse_loop import ARCSEC, DEG, RATIO, TAU, I, Loop, RebalancePwm, W, loop_gain
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

N = 1e-6 * DEG  # rad, one clock of full torque
T_S, CLOCKS = 1e-3, 1000


# ------------------------------------------------------------------------------------------ pulses
def charge(plus: int, d_plus: float, d_minus: float, dT: list[float]) -> float:
    """Charge of one saw, A s, by exact fractions: the edge at ``plus`` clocks and its error, both currents."""
    d = Fraction(2 * plus - CLOCKS, CLOCKS)
    late = sum(Fraction(x) * d**k for k, x in enumerate(dT)) if 0 < plus < CLOCKS else Fraction(0)
    on = min(max(Fraction(plus, 10**6) + late, Fraction(0)), Fraction(1, 1000))
    return float((Fraction(I) + Fraction(d_plus)) * on - (Fraction(I) + Fraction(d_minus)) * (Fraction(1, 1000) - on))


@pytest.mark.parametrize("dT", [[0.0, 0.0, 0.0], [3e-7, -4e-7, 2e-7], [-3e-6, 1e-6, -5e-7], [4e-5, 0.0, 0.0]])
@pytest.mark.parametrize("step", [2e-3, 1e-3, 5e-4, 1e-5, 1e-6])
def test_charge_of_a_saw(step: float, dT: list[float]) -> None:
    """In steps of two saws and of fractions of one: charge and counts of a held demand, by exact fractions."""
    errors = {"dI_plus": 2e-4, "dI_minus": -3e-4, "dT": dT}
    for d in (-1.0, -0.98, -0.333, 0.0, 0.0015, 0.5, 0.999, 1.0) if step > 1e-6 else (-0.98, 0.5001):
        part = RebalancePwm(K_p=I, K_i=0.0, **errors)
        part.u = d
        part.initialize()
        part.do_step(0.0, step)
        assert part.n_plus == part.n_minus == part.i_read == 0.0
        total = 0.0
        saws = max(1, round(step / T_S))
        for k in range(1, round(saws * T_S / step) + 1):
            total += part.i * step
            part.do_step(k * step, step)
        plus = math.ceil(Fraction(CLOCKS, 2) * (1 + Fraction(d)))
        assert part.n_plus == saws * plus and part.n_minus == saws * (CLOCKS - plus)
        assert total == pytest.approx(saws * charge(plus, 2e-4, -3e-4, dT), rel=1e-12, abs=1e-17)
        assert part.i_read == pytest.approx(I * (2 * plus - CLOCKS) / CLOCKS, rel=1e-14)


def test_the_newest_demand_meets_the_saw() -> None:
    # steps of a quarter: demand 0.5 until the middle, then -0.5: the saw, at 0 there, is above it: edge at clock 500
    part = RebalancePwm(K_p=I, K_i=0.0)
    part.u = 0.5
    part.initialize()
    seen = []
    for k, u in enumerate((0.5, 0.5, -0.5, 0.9, 0.5)):
        part.u = u
        part.do_step(k * 2.5e-4, 2.5e-4)
        seen.append(part.i / I)
    assert seen == [1.0, 1.0, -1.0, -1.0, 1.0]  # latched: 0.9 in the last quarter switches nothing back
    assert (part.n_plus, part.n_minus) == (500.0, 500.0)


def test_amplifier() -> None:
    # u = 1e-4 V for 0.1 s: K_p u + K_i u t; a saw late, the first step is not known
    part = load_part("rebalance_pwm", BENCH)(K_p=100.0, K_i=1000.0)
    part.initialize()
    part.u = 1e-4
    for k in range(100):
        part.do_step(k * T_S, T_S)
    assert part.demand() == pytest.approx(0.01 + 0.01, rel=1e-13)
    assert part.i == pytest.approx(0.02, abs=2.0 * I / CLOCKS)
    part.u = 1e-3  # limited from K_i q = I - K_p u = 0.1093 A on: no wind-up
    for k in range(100, 1000):
        part.do_step(k * T_S, T_S)
    assert part.saturated == 1.0 and part.i == pytest.approx(I)
    assert part.q == pytest.approx((I - 0.1) / 1000.0, abs=1e-6)
    part.u = -1e-4
    part.do_step(1.0, T_S)
    assert part.saturated == 0.0


# ------------------------------------------------------------------------------------------ loop
RATES = (-0.9000013, -0.5123457, -0.1, -0.0030007, 0.0, 0.00071234, 0.0512345, 0.3333333, 0.7071068, 0.95)


def test_mean_output_is_the_input() -> None:
    """Ten rates: within 3 N/T at T = 2 s; every count has the parity of n+ + n-."""
    for rate in RATES:
        loop = Loop(rate * W)
        loop.run(1.0)
        assert abs(loop.measured(2.0) - rate * W) < 3.001 * N / 2.0, rate
        plus, minus = loop.part.n_plus, loop.part.n_minus
        assert plus + minus == 2_999_000.0 and (plus - minus) % 2.0 == 0.0


def test_outputs_move_in_twos() -> None:
    """Inputs of 0 to 12 N/T: the counts are even, so the resolution is 2 N/T, not N/T (ET17)."""
    counts = set()
    for k in range(13):
        loop = Loop(k * N)
        loop.run(0.5)
        counts.add(round(loop.measured(1.0) / N))
    assert len(counts) > 4 and {c % 2 for c in counts} == {0}


def test_cycle_at_zero_input() -> None:
    """Steps of ten clocks: the float moves at the frequency of the saw by (H/C) W (T_s/2 - 2 tau ln(2/(1 + e))),
    e = exp(-T_s/(2 tau)): 0.2969 arcsec.  Steps of whole saws show none of it.
    """
    loop = Loop(0.0, step=1e-5)
    loop.run(0.3)
    theta = loop.run(0.01, lambda x: x.theta).reshape(10, 100)
    closed = RATIO * W * (T_S / 2 - 2 * TAU * math.log(2.0 / (1.0 + math.exp(-T_S / 2 / TAU))))
    assert closed / ARCSEC == pytest.approx(0.2969, abs=5e-5)
    assert np.ptp(theta, axis=1) == pytest.approx(closed, rel=1e-4)
    assert np.ptp(theta[:, -1]) < 1e-6 * closed  # period 1
    whole = Loop(0.0)
    whole.run(0.3)
    assert np.ptp(whole.run(0.01, lambda x: x.theta)) == 0.0


@pytest.mark.parametrize("hertz, periodic", [(20.0, True), (100.0, True), (1600.0, False)])
def test_period_of_the_loop(hertz: float, periodic: bool) -> None:
    """Every saw is like the one before at K_v/2 pi = 20 and 100 Hz, not at 1600 Hz."""
    loop = Loop(0.1 * W, step=1e-5, **loop_gain(hertz))
    loop.run(0.4)
    ends = loop.run(0.1, lambda x: x.theta)[99::100]
    assert (np.std(ends) < N) == periodic and (np.std(ends) > 5.0 * N) != periodic


def test_over_range() -> None:
    """At 1.1 of full scale the counts say full scale, the flag is up and the float runs away."""
    loop = Loop(1.1 * W)
    loop.run(0.5)
    before = loop.theta
    assert loop.measured(1.0) == pytest.approx(W, rel=1e-12)
    assert loop.part.saturated == 1.0
    assert loop.theta - before == pytest.approx(RATIO * 0.1 * W * 1.0, rel=1e-9)


@pytest.mark.parametrize("step", [1e-3, 1e-4])
def test_bias_and_scale_factor(step: float) -> None:
    """Reading d of the loop: I d + I_0 + dK d = w/k to first order, with the signs of ET18, and exactly by the charge
    of both parts of a saw.
    """
    d_plus, d_minus, dT = 3e-3 * I, -1e-3 * I, [2e-7, 5e-7, 0.0]
    bias = (d_plus - d_minus) / 2.0 + 2.0 * I * dT[0] / T_S
    scale = (d_plus + d_minus) / 2.0 + 2.0 * I * dT[1] / T_S
    time = 2.0 if step == T_S else 1.0
    for rate in (-0.6, 0.0, 0.8):
        loop = Loop(rate * W, step, dI_plus=d_plus, dI_minus=d_minus, dT=dT)
        loop.run(0.5)
        read = loop.measured(time) / W
        on = (rate * I + I + d_minus) / (2.0 * I + d_plus + d_minus)  # positive part of a saw
        exact = (on - 0.5 - dT[0] / T_S) / (0.5 + dT[1] / T_S)
        # within one clock of the edge the float may still be on its way: 2 f_s/K_v = 15.9 clocks of the count
        assert read == pytest.approx(exact, abs=16.0 * 1e-6 / time), rate
        assert exact == pytest.approx((rate * I - bias) / (I + scale), abs=1e-5)
    assert abs(bias) > 0.002 * I and abs(scale) > 0.0019 * I  # far above the tolerance


# ------------------------------------------------------------------------------------------ refusals
@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"f_s": 3e3}, r"f_q = 1e\+06 Hz must be an even multiple of f_s = 3000 Hz"),
        ({"f_q": 1e6, "f_s": 1e6 / 125}, "must be an even multiple"),
        ({"f_s": 0.0}, "f_s = 0 Hz must be > 0"),
        ({"f_q": -1.0}, "f_q = -1 Hz must be > 0"),
        ({"I": 0.0}, "I = 0 A must be > 0"),
        ({"dI_plus": -1.0}, "a pulse keeps its sign"),
        ({"dI_minus": -I}, "a pulse keeps its sign"),
        ({"dT": [9e-5, -2e-5, 0.0]}, "dT: switching-time errors must not add up to more than a tenth of the saw"),
        ({"K_p": -1.0}, "K_p = -1 A/V must be >= 0"),
    ],
)
def test_refuses(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ComponentError, match=message):
        RebalancePwm(**parameters).initialize()


@pytest.mark.parametrize(
    "step, message",
    [
        (1.5e-6, r"1.5e-06 s, must be whole periods of the data clock, f_q = 1e\+06 Hz"),
        (1.5e-3, r"0.0015 s, must be whole saws, 1/f_s, or go into one a whole number of times; f_s = 1000 Hz"),
        (3e-4, "must be whole saws"),
    ],
)
def test_refuses_a_step(step: float, message: str) -> None:
    part = RebalancePwm()
    part.initialize()
    with pytest.raises(ComponentError, match=message):
        part.do_step(0.0, step)


def test_refuses_another_step() -> None:
    part = RebalancePwm()
    part.initialize()
    part.do_step(0.0, 1e-3)
    with pytest.raises(ComponentError, match=r"the communication step must not change; it was 0.001 s"):
        part.do_step(1e-3, 2e-3)
