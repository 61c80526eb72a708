"""Means, deviations and boundaries of the sampler."""

import itertools
import math
from functools import partial

import numpy as np
import pytest
from wired import ROW, Native

from gyrobench.component import ComponentError

Sampler = partial(Native, "sampler")
H = 0.01


def sample(signal, gate, angle=None, window=1.0, phase=None, flag=None, h=H, steps=None, start=0):
    """Feeds samples k = start + 1 ... at t = k h; rows of the completed windows."""
    part = Sampler()
    part.initialize()
    rows = []
    zero = lambda _: 0.0  # noqa: E731
    for k in range(start + 1, start + 1 + steps):
        t = k * h
        part.x, part.gate, part.window = signal(t), gate(t), window
        part.angle, part.phase, part.flag = (angle or zero)(t), (phase or zero)(t), (flag or zero)(t)
        before = part.count
        part.do_step((k - 1) * h, h)
        if part.count > before:
            assert part.count == before + 1
            rows.append({key: getattr(part, key) for key in ROW})
    return rows


def test_mean_of_a_line_is_exact_and_of_a_parabola_within_h2():
    # first open sample at 0.5; windows of 1 s
    line = sample(lambda t: 3.0 + 2.0 * t, lambda t: float(t > 0.495), steps=400)
    assert [r["n"] for r in line] == [100, 100, 100]
    assert [r["t_start"] for r in line] == pytest.approx([0.5, 1.5, 2.5], abs=1e-14)
    assert [r["t_end"] for r in line] == pytest.approx([1.5, 2.5, 3.5], abs=1e-14)
    assert [r["mean"] for r in line] == pytest.approx([5.0, 7.0, 9.0], abs=1e-13)
    # trapezoid of t2: error h2/12 x'' = h2/6
    square = sample(lambda t: t * t, lambda t: float(t > 0.495), steps=200)
    assert square[0]["mean"] == pytest.approx((1.5**3 - 0.5**3) / 3 + H * H / 6, abs=1e-13)


def test_whole_turn_of_a_sine_has_mean_zero():
    rows = sample(lambda t: math.sin(2 * math.pi * t), lambda t: 1.0, steps=210)
    assert rows[0]["mean"] == pytest.approx(0.0, abs=1e-15)
    assert rows[0]["std"] == pytest.approx(math.sqrt(50 / 99), rel=1e-12)  # sum of 100 sin2 = 50


def test_std_against_numpy_with_a_large_offset():
    noise = np.random.default_rng(1).normal(size=1001)
    rows = sample(lambda t: 1e9 + noise[round(t / H)], lambda t: 1.0, window=9.0, steps=1000)
    inside = (1e9 + noise)[2:902]  # window from sample 1: samples 2 ... 901
    assert rows[0]["n"] == 900
    assert rows[0]["std"] == pytest.approx(inside.std(ddof=1), rel=1e-9)
    whole = (1e9 + noise)[1:902]
    assert rows[0]["mean"] - 1e9 == pytest.approx(np.trapezoid(whole - 1e9) / 900, abs=3e-7)


def test_a_constant_is_its_own_mean_to_the_last_bit():
    rows = sample(lambda t: 0.1, lambda t: 1.0, steps=110)
    assert rows[0]["mean"] == 0.1 and rows[0]["std"] == 0.0


def test_windows_by_time_never_gain_or_lose_a_sample():
    # 0.1 s windows of 10 samples at times where t and k window are never exact
    rows = sample(lambda t: 0.0, lambda t: 1.0, window=0.1, steps=20001, start=3333)
    assert len(rows) == 2000
    assert {r["n"] for r in rows} == {10.0}


@pytest.mark.parametrize("rate", [0.05, -0.05, 0.0313])
def test_windows_by_angle(rate):
    # 36 windows a turn, 3 turns; the gate closes one sample after the whole travel
    window, travel = 2 * math.pi / 36, 6 * math.pi
    steps = math.ceil(travel / abs(rate) / H)
    angle = lambda t: 1.234 + rate * (t - 5.0)  # noqa: E731
    gate = lambda t: 2.0 if 4.995 < t < 5.0 + (steps + 0.5) * H else 0.0  # noqa: E731
    rows = sample(lambda t: t, gate, angle, window, steps=steps + 700)
    assert len(rows) == 108
    for k, r in enumerate(rows):
        # each boundary is the first sample at or past its own mark, however many came before
        late = abs(r["angle_end"] - 1.234) - (k + 1) * window
        assert -1e-9 <= late < abs(rate) * H
        assert r["angle_end"] == pytest.approx(angle(r["t_end"]), abs=1e-14)
        assert r["mean"] == pytest.approx((r["t_start"] + r["t_end"]) / 2, abs=1e-9)
    assert all(a["t_end"] == b["t_start"] for a, b in itertools.pairwise(rows))


def test_last_bit_of_the_angle_does_not_lose_a_window():
    # marks that fall exactly on samples: k 0.1 rad, each rounded differently
    for offset in (0.0, 0.1, 1e3, 123.456):
        rows = sample(lambda t: 0.0, lambda t: 2.0, lambda t, offset=offset: offset + t, 0.1, steps=1001)
        assert len(rows) == 100
        assert {r["n"] for r in rows} == {10.0}


def test_closing_the_gate_drops_the_unfinished_window():
    rows = sample(lambda t: t, lambda t: float(0.095 < t < 0.795 or t > 1.995), steps=400, window=0.5)
    assert [r["t_start"] for r in rows] == pytest.approx([0.1, 2.0, 2.5, 3.0, 3.5], abs=1e-12)
    assert [r["t_end"] for r in rows] == pytest.approx([0.6, 2.5, 3.0, 3.5, 4.0], abs=1e-12)


def test_a_new_phase_begins_new_windows():
    rows = sample(lambda t: t, lambda t: 1.0, steps=200, window=0.5, phase=lambda t: 1.0 + (t > 0.805))
    assert [r["window_phase"] for r in rows] == [1, 2, 2]
    assert [r["t_start"] for r in rows] == pytest.approx([0.01, 0.81, 1.31], abs=1e-12)


def test_flagged_samples_are_counted():
    rows = sample(lambda t: t, lambda t: 1.0, steps=210, flag=lambda t: float(0.505 < t < 1.105))
    assert [r["flagged"] for r in rows] == [51, 9]  # 0.51 ... 1.01 (the end of window 1), 1.02 ... 1.10


def test_one_sample_for_each_communication_step():
    part = Sampler()
    part.gate, part.window = 1.0, 100.0
    part.initialize()
    part.do_step(0.0, 7.0)
    part.do_step(7.0, 7.0)
    assert part.steps == 1.0


@pytest.mark.parametrize(
    "gate, window, message",
    [
        (3.0, 1.0, "gate = 3 must be 0 closed, 1 windows by time or 2 windows by angle"),
        (1.0, 0.0, "window = 0 must be above 0"),
        (2.0, -1.0, "window = -1 must be above 0"),
        (1.0, 0.03, "window = 0.03 s is shorter than four steps"),
    ],
)
def test_refuses(gate, window, message):
    part = Sampler()
    part.gate, part.window = gate, window
    part.initialize()
    with pytest.raises(ComponentError, match=message):
        part.do_step(0.0, H)


def test_integrated_signal_is_summed():
    # x of the step that ends: 1, 2 ... in steps 51 to 150 after the first open sample, which does not count
    part = Sampler(integrated=1.0)
    part.initialize()
    for k in range(1, 151):
        part.x, part.gate = (1e6 if k == 50 else k - 50.0), float(k >= 50)
        part.do_step((k - 1) * H, H)
    assert part.count == 1 and part.mean == pytest.approx(50.5, rel=1e-9)
