"""reading_channel and gyro_bracket: each disturbance in its phase alone, the response of the mode."""

import math

import numpy as np
import pytest
from scipy import signal
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

Channel = load_part("reading_channel", BENCH)
Bracket = load_part("gyro_bracket", BENCH)
H = 1e-3


def passed(count, phase=1.0, z=lambda t: t, **parameters):
    """Readings and flags after each of ``count`` steps of 1 ms; z is the time, in s."""
    part = Channel(**parameters)
    part.phase = phase
    part.initialize()
    y, valid = [], []
    for k in range(count):
        part.z = z((k + 1) * H)
        part.do_step(k * H, H)
        y.append(part.get("y"))
        valid.append(part.get("valid"))
    return np.array(y), np.array(valid)


def test_nothing_is_disturbed_outside_of_its_phase():
    """Phase 0, which an input that is not wired has, is none."""
    all_of_them = {"white": 1.0, "line": 1.0, "gap_length": 0.5, "wild_size": 1.0, "wild_period": 0.01}
    for phases, phase in ((2, 1.0), (0, 0.0)):
        named = {f"{n}_phase": phases for n in ("noise", "line", "gap", "wild")}
        y, valid = passed(50, phase, **all_of_them, **named)
        assert y == pytest.approx(H * np.arange(1, 51), abs=0.0) and np.all(valid == 1.0)


def test_gaps_repeat_the_last_value_and_flag_it():
    """Gaps of 3 ms at 0, 10, 20 ms: t = 10, 11, 12 ms are missing and stay at the value of 9 ms."""
    y, valid = passed(25, gap_phase=1, gap_period=0.010, gap_length=0.003)
    gone = [round(1e3 * (k + 1) * H) for k in range(25) if valid[k] == 0.0]
    assert gone == [1, 2, 10, 11, 12, 20, 21, 22]
    assert y[9:12] == pytest.approx([0.009] * 3) and y[12] == pytest.approx(0.013)


def test_wild_readings_last_one_step_and_turn_their_sign():
    y, valid = passed(25, wild_phase=1, wild_period=0.010, wild_size=5.0)
    off = y - H * np.arange(1, 26)
    assert {k + 1: round(float(x), 12) for k, x in enumerate(off) if abs(x) > 1e-9} == {10: 5.0, 20: -5.0}
    assert np.all(valid == 1.0)  # nothing tells


def test_line_and_noise():
    """The noise of a step has the variance density2/h; 4000 steps: its root to 1.1 %, here 4 of these."""
    y, _ = passed(40, line_phase=1, line=2.0, line_frequency=50.0, z=lambda t: 0.0)
    assert y == pytest.approx([2.0 * math.sin(2.0 * math.pi * 50.0 * (k + 1) * H) for k in range(40)])
    y, _ = passed(4000, noise_phase=1, white=0.3, seed=4, z=lambda t: 0.0)
    assert float(np.std(y)) == pytest.approx(0.3 / math.sqrt(H), rel=0.045)


def test_a_gap_that_never_ends_is_refused():
    with pytest.raises(ComponentError, match="gap_length = 1"):
        Channel(gap_length=1.0, gap_period=1.0).initialize()


def test_bracket_is_the_transmissibility_of_a_base_excited_mode():
    """Against scipy's (2 zeta wn s + wn2)/(s2 + 2 zeta wn s + wn2) over held inputs, and 1/(2 zeta) at the mode."""
    wn, zeta, h = 2.0 * math.pi * 40.0, 0.05, 5e-4
    w = np.random.default_rng(3).normal(0.0, 0.1, 400)
    part = Bracket(frequency=40.0, damping=zeta)
    part.initialize()
    got = []
    for k, x in enumerate(w):
        part.omega[:] = [x, 0.2, -0.3]
        part.do_step(k * h, h)
        got.append([part.get(f"omega_gyro[{i}]") for i in (1, 2, 3)])
    A, B = np.array([[0.0, 1.0], [-wn * wn, -2.0 * zeta * wn]]), np.array([[-1.0], [2.0 * zeta * wn]])
    d = signal.cont2discrete((A, B, np.eye(2), np.zeros((2, 1))), h)
    x, expected = np.zeros(2), []
    for value in w:
        x = d[0] @ x + d[1][:, 0] * value
        expected.append(x[1])
    assert np.array(got)[:, 0] == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert got[-1][1:] == [0.2, -0.3]
    _, response = signal.freqs([2.0 * zeta * wn, wn * wn], [1.0, 2.0 * zeta * wn, wn * wn], [wn])
    assert abs(response[0]) == pytest.approx(math.hypot(1.0, 1.0 / (2.0 * zeta)))


def test_bracket_begins_with_the_platform():
    part = Bracket()
    part.omega[:] = [0.7, 0.0, 0.0]
    part.initialize()
    for k in range(20):
        part.do_step(k * H, H)
    assert part.get("omega_gyro[1]") == pytest.approx(0.7) and part.get("q") == pytest.approx(0.0, abs=1e-15)
