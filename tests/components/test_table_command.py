"""Command counts of a table axis: whole numbers against Python's own, rates, moves, ways, refusals."""

import math
from fractions import Fraction

import numpy as np
import pytest
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

TableCommand = load_part("table_command", BENCH)
ERU = 7.2921159e-5
ARCSEC = math.pi / 648000
QUANTUM = 0.18 * ARCSEC


def started(mode=0.0, target=0.0, **parameters):
    part = TableCommand(**parameters)
    part.mode, part.target = mode, target
    part.initialize()
    return part


def run(part, steps, h=5e-3, start=0):
    rows = []
    for k in range(start, start + steps):
        part.do_step(k * h, h)
        rows.append((part.count, part.angle, part.rate, part.acc, part.arrived))
    return np.array(rows)


def phase(part):
    return Fraction(int(part.reference_count)) + Fraction(int(part.reference_part), 2**38)


def test_the_phase_is_the_whole_number_sum_of_the_rates():
    # after a day at 1999.9 ERU the cumulative count is 1.4e10; a sum in doubles there is good to 2e-6 counts a sample
    part = started(2.0, 1999.9 * ERU, angle0=12600.0)
    run(part, 100)  # 0.146 s of ramp
    before, v = phase(part), int(part.reference_v)
    assert abs(v - 1999.9 * ERU * 5e-3 / QUANTUM * 2**38) <= 1.0  # to the nearest even unit
    run(part, 1000, start=100)
    assert phase(part) - before == Fraction(1000 * v, 2**38)
    assert part.count == math.floor(phase(part))


def test_ramps_sum_exactly_as_well():
    part = started(2.0, 300.0 * ERU, period=1e-3)
    total, v_last = Fraction(0), 0
    rng = np.random.default_rng(3)
    for k in range(400):
        if k % 50 == 0:
            part.target = float(rng.integers(-1999, 1999)) * ERU
        part.do_step(k * 1e-3, 1e-3)
        v = int(part.reference_v)
        total += Fraction(v_last + v, 2**39)
        assert phase(part) == total
        assert abs(v - v_last) * QUANTUM / 2**38 <= 1.0 * 1e-6 * (1 + 1e-9)  # 1 rad/s2 over 1 ms
        v_last = v


@pytest.mark.parametrize(("eru", "per_second"), [(0.01, 0.836), (1.0, 83.6), (999.99, 83.6e3), (1999.9, 167e3)])
def test_pulse_frequency(eru, per_second):
    part = started(2.0, -eru * ERU, period=0.02)
    run(part, 30, h=0.02)
    first = part.count
    rows = run(part, 500, h=0.02, start=30)
    assert -(part.count - first) / 10.0 == pytest.approx(per_second, abs=0.1 + 2e-3 * per_second)
    assert rows[-1, 2] == pytest.approx(-eru * ERU, rel=1e-8)


def test_rates_are_set_in_steps_of_a_hundredth_and_by_latitude():
    latitude = math.radians(45.75)
    for wanted, set_to in ((10.004, 10.0), (10.006, 10.01), (math.sin(latitude), math.sin(latitude))):
        part = started(2.0, wanted * ERU, reference_latitude=latitude)
        assert run(part, 5)[-1, 2] / ERU == pytest.approx(set_to, rel=1e-9)
    part = started(2.0, math.cos(latitude) * ERU, reference_latitude=0.0)
    assert run(part, 5)[-1, 2] / ERU == pytest.approx(0.70, rel=1e-9)


def test_ramp_and_reference_acceleration():
    # 0.05 rad/s at 1 rad/s2: 10 periods of 5 ms; the reference is a parabola between the samples
    part = started(2.0, 0.05, reference_rate_step=0.0)
    rows = run(part, 20)
    assert rows[:, 4].tolist() == [0.0] * 10 + [1.0] * 10
    assert rows[0] == pytest.approx([0, 0, 0, 1.0, 0])  # the command is read here, and acts over the coming period
    assert rows[10, 1:4] == pytest.approx([0.5 * 0.05**2, 0.05, 0.0], rel=1e-7)
    expected = 0.0
    for k in range(19):  # acc of a sample carries angle and rate to the next one
        expected = rows[k, 1] + 5e-3 * rows[k, 2] + 0.5 * 25e-6 * rows[k, 3]
        assert rows[k + 1, 1] == pytest.approx(expected, abs=2e-10 * QUANTUM)


def test_index_move_is_a_trapezoid_that_ends_at_the_target():
    # 10 deg at 100 ERU = 7.29e-3 rad/s and 1 rad/s2: ramps of 1.46 -> 2 periods, cruise 10 deg/(peak T) - 2
    target = math.radians(10.0)
    part = started(1.0, target)
    rows = run(part, 4900)
    assert rows[-1, 0] == 200000.0  # 10 deg / 0.18 arcsec
    assert rows[-1, 1] == pytest.approx(target, abs=1e-15)
    assert rows[-1, 2] == 0.0 and rows[-1, 4] == 1.0
    assert rows[:, 2].max() <= 100 * ERU and rows[:, 2].max() > 0.999 * 100 * ERU
    assert np.abs(rows[:, 3]).max() <= 1.0
    moved = int(np.argmax(rows[:, 4])) * 5e-3
    assert moved == pytest.approx(target / (100 * ERU) + 2 * 5e-3, abs=2 * 5e-3)
    jumps = np.diff(rows[:, 1])
    assert np.abs(np.diff(jumps)).max() <= 25e-6 * (1 + 1e-6)  # the correction at the end is inside the acceleration


def test_index_from_a_turning_table_brakes_first():
    part = started(2.0, 0.1)
    run(part, 40)
    part.mode, part.target = 1.0, 0.0
    rows = run(part, 1000, start=40)
    assert rows[:, 1].max() == pytest.approx(0.1 * 0.15 + 0.005 + 0.1 * 1e-2, abs=1.1e-3)
    assert rows[-1, 0] == 0.0 and rows[-1, 1] == 0.0


@pytest.mark.parametrize(
    ("way", "start", "target", "end"),
    [(0, 350, 10, 10), (1, 350, 10, 370), (1, 10, 350, -10), (2, 10, 350, 350), (3, 350, 10, 10), (3, 10, 350, -10),
     (2, 350, 10, 370), (1, 90, 90, 90), (2, 90, 90, 90), (3, 90, 90, 90), (2, 0, 360, 0), (1, 725, 5, 725)],
)  # fmt: skip
def test_way_to_the_target(way, start, target, end):
    part = started(
        1.0, math.radians(target), angle0=math.radians(start), reference_way=way, reference_index_rate=0.14, period=0.04
    )
    run(part, 1130, h=0.04)
    assert part.arrived == 1.0
    assert part.angle == pytest.approx(math.radians(end), abs=0.01 * QUANTUM)


def test_way_and_rate_of_a_move_come_with_the_command():
    part = started(1.0, math.radians(350), period=0.04)
    part.way, part.move_rate = 1.0, 0.05
    rows = run(part, 200, h=0.04)
    assert rows[-1, 1] == pytest.approx(math.radians(-10), abs=0.01 * QUANTUM) and rows[-1, 4] == 1.0
    assert 0.049 < -rows[:, 2].min() <= 0.05


def test_error_of_the_time_base():
    part = started(2.0, 100 * ERU, reference_clock=-2e-4)
    assert run(part, 5)[-1, 2] / (100 * ERU) == pytest.approx(1 - 2e-4, abs=1e-9)


def test_pulses_between_the_samples():
    """At a step of 1 ms the count is that of the parabola between two samples, and at them that of the accumulator."""
    fine, coarse = started(2.0, 500 * ERU), started(2.0, 500 * ERU)
    rows, ends = run(fine, 100, h=1e-3), run(coarse, 20)
    assert rows[4::5, :3].tolist() == ends[:, :3].tolist()
    for k in range(5, 40):  # the command acts from 5 ms on; 7 whole periods of ramp, 35 ms
        t = (k + 1) * 1e-3 - 5e-3
        assert rows[k, 1] == pytest.approx(0.5 * t * t, rel=1e-9) and rows[k, 2] == pytest.approx(t, rel=1e-9)
        assert rows[k, 0] == math.floor(rows[k, 1] / QUANTUM + 1e-9)


def test_hold_stops_within_the_acceleration():
    part = started(2.0, -0.02)
    run(part, 20)
    part.mode = 0.0
    rows = run(part, 20, start=20)
    assert rows[-1, 2] == 0.0 and rows[-1, 4] == 1.0
    assert rows[-1, 1] == rows[-5, 1]


@pytest.mark.parametrize(
    ("parameters", "mode", "target", "text"),
    [
        ({}, 2.0, 2000.0 * ERU, "exceeds reference_rate_max"),
        ({}, 3.0, 0.0, "mode must be 0 hold, 1 index or 2 rate"),
        ({"reference_acceleration": 1.6}, 0.0, 0.0, "saturates the motor at a change of rate"),
        ({"reference_quantum": 1e-9, "period": 0.1}, 0.0, 0.0, "at most 8192 counts"),
        ({"reference_acceleration": 1e-20}, 0.0, 0.0, "below the resolution"),
        ({"reference_limit": math.radians(95)}, 1.0, math.radians(100), "outside the range of the axis"),
        ({"reference_limit": 1e-4}, 2.0, 0.1, "leaves the range of the axis"),
        ({"reference_index_rate": 0.0}, 1.0, 1.0, "reference_index_rate"),
        ({"period": -5e-3}, 0.0, 0.0, "period"),
        ({"period": 7e-3}, 0.0, 0.0, "not a multiple of the internal step"),
        ({}, 2.0, math.nan, "target is nan"),
        ({"way": 4.0}, 1.0, 0.1, "way = 4 must be"),
        ({"move_rate": -0.1}, 1.0, 0.1, "move_rate = -0.1 rad/s must be"),
    ],
)
def test_refusals(parameters, mode, target, text):
    inputs = {n: x for n, x in parameters.items() if n in ("way", "move_rate")}
    with pytest.raises(ComponentError, match=text):
        part = TableCommand(**{n: x for n, x in parameters.items() if n not in inputs})
        part.initialize()
        part.mode, part.target = mode, target
        part.way, part.move_rate = inputs.get("way", 0.0), inputs.get("move_rate", 0.0)
        run(part, 30)
