"""Rate by gates and by the time of a degree: resolution, time base, overflow, reversal, stamps."""

import math
from functools import partial

import numpy as np
import pytest
from wired import Native

from gyrobench.component import ComponentError

RateGate, InverseRate, Inductosyn = (partial(Native, n) for n in ("rate_gate", "inverse_rate", "inductosyn"))
DEG = math.pi / 180.0
ARCSEC = DEG / 3600.0
COUNT = 0.18 * ARCSEC
ERU = 7.2921159e-5


def counted(angle):
    return math.floor(angle / COUNT + 0.5)


def read(part, angle, until, h, stamp=lambda t: t):
    """Show the part the counts of angle(t); return a row for each new reading: (rate, t_start, t_end, valid, over)."""
    part.count, part.t_read = counted(angle(stamp(0.0))), stamp(0.0)
    part.initialize()
    rows = []
    number = 0.0
    for k in range(round(until / h)):
        t = (k + 1) * h
        part.count, part.t_read = counted(angle(stamp(t))), stamp(t)
        part.do_step(k * h, h)
        if part.number != number:
            number = part.number
            rows.append((part.rate, part.t_start, part.t_end, part.valid, part.overflow))
    return np.array(rows)


# --------------------------------------------------------------------------------------------------- gate
@pytest.mark.parametrize("gate", [0.1, 1.0, 10.0])
def test_gate_is_right_within_a_count(gate):
    rate = 0.7 * ERU
    rows = read(RateGate(gate=gate), lambda t: 0.3 + rate * t, 100.0 if gate > 1 else 10.0, 0.05)
    assert np.abs(rows[:, 0] - rate).max() <= COUNT / gate
    assert np.diff(rows[:, 2]) == pytest.approx(gate, abs=1e-9)  # gates join, their ends do not drift
    assert rows[1:, 1] == pytest.approx(rows[:-1, 2])
    # errors of the two ends: the ends are shared, so that the mean of n gates is n times as good
    assert abs(rows[:, 0].mean() - rate) <= COUNT / (gate * len(rows))


def test_resolution_of_a_gate_of_1000_s():
    """One count of 0.18 arcsec in 1000 s: 1.8e-4 arcsec/s = 1.2e-5 ERU."""
    more = 1.8e-4 * ARCSEC
    seen = [read(RateGate(gate=1000.0), lambda t, r=r: r * t, 2000.0, 100.0)[-1, 0] for r in (ERU, ERU + more)]
    assert seen[1] - seen[0] == pytest.approx(1.8e-4 * ARCSEC, rel=1e-9)
    assert pytest.approx(1.2e-5, rel=3e-3) == 1.8e-4 * ARCSEC / ERU


def test_ten_seconds_at_one_earth_rate():
    """Quantization of 10 s at 1 ERU: one count is 0.12 % (0.14 % in Hu 1981)."""
    rows = read(RateGate(gate=10.0), lambda t: ERU * t, 200.0, 0.1)
    off = np.abs(rows[:, 0] / ERU - 1)
    assert 2e-4 < off.max() <= COUNT / (10 * ERU) == pytest.approx(1.197e-3, rel=2e-3)


def test_signs_of_the_gate_errors():
    """ET4: d rate = + d angle / T; a time base that runs fast shows too small a rate, -angle dT / T^2."""
    jump = 50 * COUNT
    steady = read(RateGate(gate=1.0), lambda t: 1e-3 * t, 1.25, 0.1)[0, 0]
    late = read(RateGate(gate=1.0), lambda t: 1e-3 * t + (jump if t > 1.05 else 0.0), 1.25, 0.1)[0, 0]
    assert late - steady == pytest.approx(jump, abs=1.01 * COUNT)
    fast = read(RateGate(gate=1.0, clock=1e-3), lambda t: 1e-3 * t, 1.25, 0.1)[0, 0]
    assert fast - steady == pytest.approx(-1e-3 * 1e-3, rel=2e-3)


def test_a_gate_divides_by_its_stamps():
    """A reader sampled at 2.4 kHz, read every 5 ms: its stamps are 0.2 to 0.6 ms old."""
    reader = Inductosyn(mode=0, **{f"encoder_{n}": 0.0 for n in ("eccentricity", "tilt", "pitch", "d0", "de", "e3")})
    gate = RateGate(gate=0.1)
    reader.rate = rate = 0.5
    reader.initialize()
    gate.initialize()
    seen = []
    for k in range(400):
        reader.angle = rate * (k + 1) * 5e-3
        reader.do_step(k * 5e-3, 5e-3)
        gate.count, gate.t_read = reader.count, reader.t_read
        gate.do_step(k * 5e-3, 5e-3)
        if gate.number > len(seen) + 1:
            seen.append(gate.rate)
    assert np.abs(np.array(seen) - rate).max() <= 1.1 * COUNT / 0.1  # 8.7e-6 rad/s; an old stamp: up to 1e-3


def test_gate_overflow():
    part = RateGate(gate=1.0, count_max=1e4)  # 1800 arcsec/s
    rows = read(part, lambda t: 1700 * ARCSEC * t if t < 3 else 2000 * ARCSEC * t - 900 * ARCSEC, 6.0, 0.1)
    assert rows[:3, 3].all() and not rows[:3, 4].any()
    assert not rows[3:, 3].any() and rows[3:, 4].all() and (rows[3:, 0] == 0.0).all()


# ------------------------------------------------------------------------------------------- inverse rate
def test_one_earth_rate_is_239_s_a_degree():
    part = InverseRate()
    rows = read(part, lambda t: ERU * t, 1000.0, 0.02)
    assert len(rows) == 3  # of four marks
    assert part.duration == pytest.approx(239.345, abs=0.025)  # reading step of 20 ms: less than two counts in it
    assert np.abs(rows[:, 0] / ERU - 1).max() <= 0.02 / 239.3 + 1e-6


@pytest.mark.parametrize("rate", [0.02, -0.02, 0.9, -3.0])
def test_inverse_rate_is_right_within_its_clock(rate):
    """Between two readings the marks are interpolated: a count and the LSB of 0.1 ms are left."""
    rows = read(InverseRate(), lambda t: 0.1 + rate * t, 12.0, 5e-3)
    time = DEG / abs(rate)
    assert np.abs(np.abs(DEG / rows[:, 0]) - time).max() <= 1.01e-4 + 1.1 * COUNT / abs(rate)
    assert (np.sign(rows[:, 0]) == np.sign(rate)).all()
    assert len(rows) == pytest.approx(12.0 / time, abs=3.5)  # from the first reading's mark


def test_several_marks_between_two_readings():
    rows = read(InverseRate(), lambda t: 6.0 * t, 2.0, 0.01)  # 3.4 deg a reading
    assert rows[:, 0] == pytest.approx(6.0, rel=0.04)  # 2.9 ms a degree on a clock of 0.1 ms
    assert np.average(rows[:, 0]) == pytest.approx(6.0, rel=3e-3)


def test_below_0_239_earth_rates_the_display_ends():
    """999.9999 s a degree are 0.2393 ERU; nothing is shown below, and nothing old."""
    assert pytest.approx(0.2393, abs=1e-4) == DEG / 999.9999 / ERU
    slow = read(InverseRate(), lambda t: 0.238 * ERU * t, 3100.0, 0.5)
    assert len(slow) >= 1 and not slow[:, 3].any() and slow[:, 4].all() and (slow[:, 0] == 0.0).all()
    assert read(InverseRate(), lambda t: 0.241 * ERU * t, 3100.0, 0.5)[:, 3].all()
    part = InverseRate(time_max=10.0)  # a table that stops: after 10 s the last value is withdrawn
    read(part, lambda t: 0.02 * min(t, 5.0), 12.0, 0.01)
    assert (part.valid, part.overflow, part.number) == (1.0, 0.0, 4.0)  # marks at 1 to 5 deg of 5.7
    part = InverseRate(time_max=10.0)
    read(part, lambda t: 0.02 * min(t, 5.0), 16.0, 0.01)
    assert (part.valid, part.overflow, part.rate, part.duration) == (0.0, 1.0, 0.0, 0.0)


def test_a_reversal_gives_no_interval():
    """Up over marks 1 to 4, back over 4 to 1: 3 and 3 intervals; none over the turning point."""

    def angle(t):
        return (0.5 * DEG + 2 * DEG * t) if t < 2 else (0.5 + 4 - 2 * (t - 2)) * DEG

    rows = read(InverseRate(), angle, 4.0, 0.01)
    assert np.sign(rows[:, 0]).tolist() == [1, 1, 1, -1, -1, -1]
    assert np.abs(rows[:, 0]) == pytest.approx(2 * DEG, rel=1e-3)


@pytest.mark.long
def test_noise_at_a_mark_is_not_a_reversal():
    """Counts that jump by +-3 between readings, at 1.7 counts a reading: each degree is read once, none backwards."""
    jump = [0.0, 3.0, -2.0, 1.0, -3.0, 2.0, -1.0]
    rate = 20 * ERU

    def angle(t):
        return rate * t + COUNT * jump[round(t * 1e3) % 7]

    rows = read(InverseRate(), angle, 60.0, 1e-3)
    assert len(rows) == 4 and (rows[:, 0] > 0).all()  # 5.01 deg: marks 1 to 5
    assert abs(rows[:, 0].mean() / rate - 1) < 2 * COUNT / DEG
    flickering = read(InverseRate(hysteresis=0.0), angle, 60.0, 1e-3)  # starts anew at the last flicker: too short
    assert (flickering[:, 0] / rate - 1 > COUNT / DEG).all()


def test_errors_of_the_scale_dominate():
    """+-0.2 arcsec over a degree: 5.6e-5 of the time.  An error of order 180 alternates from degree to degree."""
    assert pytest.approx(5.56e-5, rel=1e-3) == 0.2 / 3600
    rate = 0.05
    rows = read(InverseRate(), lambda t: rate * t + 0.1 * ARCSEC * math.cos(180 * rate * t), 8.0, 5e-3)
    relative = np.abs(rows[:, 0] / rate - 1)
    assert relative.max() == pytest.approx(5.56e-5, abs=1.0e-4 / (DEG / rate) + COUNT / DEG)
    assert relative.max() > 4e-5


# ------------------------------------------------------------------------------------------------ refusals
@pytest.mark.parametrize("cls", [RateGate, InverseRate])
def test_stamps_must_not_go_back(cls):
    part = cls()
    part.initialize()
    for k, t in enumerate((0.1, 0.2, 0.2)):
        part.t_read = t
        part.do_step(0.1 * k, 0.1)
    part.t_read = 0.19
    with pytest.raises(ComponentError, match=r"t_read = 0.19 s is before that of the last reading, 0.2 s"):
        part.do_step(0.3, 0.1)


@pytest.mark.parametrize(
    ("cls", "parameters", "said"),
    [
        (RateGate, {"gate": 2.0}, "gate = 2 s must be 0.1, 1, 10, 100 or 1000 s"),
        (RateGate, {"gate": 0.0}, "gate"),
        (RateGate, {"clock": 0.02}, "clock"),
        (InverseRate, {"interval": 1.00001 * DEG}, "whole number of counts"),
        (InverseRate, {"interval": 0.0}, "interval"),
        (InverseRate, {"lsb": -1e-4}, "lsb"),
        (InverseRate, {"hysteresis": 20000.0}, "hysteresis = 20000 counts"),
    ],
)
def test_refusals(cls, parameters, said):
    with pytest.raises(ComponentError, match=said):
        cls(**parameters).initialize()
