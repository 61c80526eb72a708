"""Rebalance by pulses on demand: sum clock by clock, the loop, scale factors of both signs, refusals."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from pulse_loop import I, Loop, RebalancePulse, W

from gyrobench.component import ComponentError

N = W / 1e5  # rad, one pulse


def clock_by_clock(demands: list[float], clocks: int) -> list[int]:
    """Net pulses of each step: the sum with one look at each clock, in fractions."""
    total, out = Fraction(0), []
    for d in demands:
        net = 0
        for _ in range(clocks):
            total += Fraction(d)
            if abs(total) >= 1:
                sign = 1 if total > 0 else -1
                net, total = net + sign, total - sign
        out.append(net)
    return out


@pytest.mark.parametrize("step", [1e-3, 1e-4, 1e-5])
def test_pulses_of_held_demands(step: float) -> None:
    demands = [0.0, 0.25, -0.25, 0.9375, -0.0625, -1.0, 1.0, 0.03125, -0.5, 0.0, 0.0078125] * 3
    part = RebalancePulse(K_p=I, K_i=0.0)
    part.initialize()
    nets, total = [], 0.0
    for k, d in enumerate([*demands, 0.0]):
        before, charge = part.n_plus - part.n_minus, part.i * step
        part.u = d  # i is decided at the end of the step, and flows in the next one
        part.do_step(k * step, step)
        nets.append(int(part.n_plus - part.n_minus - before))
        assert charge == pytest.approx(nets[-1] * I / 1e5, rel=1e-12, abs=1e-20)
        assert part.i_read == pytest.approx(I * nets[-1] / (1e5 * step), rel=1e-12, abs=1e-20)
        total += charge
    assert nets[1:] == clock_by_clock(demands, round(step * 1e5)) and nets[0] == 0


def test_mean_output_is_the_input_and_odd_counts_occur() -> None:
    """Within two pulses at T = 2 s: the resolution is N/T, half of that of a binary loop with this quantum."""
    counts = set()
    for rate in (-0.9000013, -0.5123457, -0.0030007, 0.00071234, 0.3333333, 0.95):
        loop = Loop(rate * W, kind=RebalancePulse)
        loop.run(1.0)
        measured = loop.measured(2.0)
        assert abs(measured - rate * W) < 2.001 * N / 2.0, rate
        counts.add(round(measured * 2.0 / N) % 2)
    assert counts == {0, 1}


def test_it_rests_at_zero_input() -> None:
    loop = Loop(0.0, kind=RebalancePulse, dI_plus=0.01 * I, dT=1e-7)
    assert np.ptp(loop.run(0.3, lambda x: x.theta)) == 0.0
    assert loop.part.n_plus == loop.part.n_minus == 0.0


def test_over_range() -> None:
    loop = Loop(1.1 * W, kind=RebalancePulse)
    loop.run(0.5)
    assert loop.measured(0.5) == pytest.approx(W, rel=1e-12) and loop.part.saturated == 1.0


def test_scale_factors_of_both_signs() -> None:
    """The loop reads w/k / (1 + e) with e of the sign of w; no bias: the ratio is the same at 0.1 and 0.8."""
    errors = {"dI_plus": 3e-3 * I, "dI_minus": -1e-3 * I, "dT": 2e-8}
    for rate in (0.8, 0.1, -0.1, -0.8):
        loop = Loop(rate * W, kind=RebalancePulse, **errors)
        loop.run(0.5)
        e = (1.003 if rate > 0.0 else 0.999) * (1.0 + 1e5 * 2e-8) - 1.0  # 5.006e-3, 0.998e-3
        assert loop.measured(4.0) == pytest.approx(rate * W / (1.0 + e), abs=2.0 * N / 4.0), rate
    assert 0.1 * 4e-3 * W > 50.0 * 2.0 * N / 4.0  # the difference of both signs, against the tolerance


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"dT": 2e-6}, "dT = 2e-06 s must be at most a tenth of the clock"),
        ({"dI_plus": -1.0}, "a pulse keeps its sign"),
        ({"f_q": 0.0}, "f_q = 0 Hz must be > 0"),
        ({"I": -1.0}, "I = -1 A must be > 0"),
    ],
)
def test_refuses(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ComponentError, match=message):
        RebalancePulse(**parameters).initialize()


def test_refuses_a_step() -> None:
    part = RebalancePulse()
    part.initialize()
    with pytest.raises(ComponentError, match=r"0.000125 s, must be whole periods of the data clock"):
        part.do_step(0.0, 1.25e-4)
