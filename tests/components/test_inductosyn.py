"""The angle reader: errors of the scale, coarse-fine carry, excitation, latching, multiplier loop, refusals."""

import math

import numpy as np
import pytest
from inductosyns import ARCSEC, DEG, KHZ2, PULSE, H, Inductosyn, follow, started
from native_parts import make
from scipy.optimize import brentq

from gyrobench.component import Component, ComponentError, Input, Output, Parameter, sampled
from gyrobench.component.blocks import angle as block


class Encoder(Component):
    """A part that latches the scale once in a communication step, and nothing else."""

    step = Parameter(1e9, "s", "largest internal step", above=0.0)
    angle = Input(0.0, "rad", "angle")
    count = Output("1", "count")
    encoder = block.IncrementalEncoder()

    @sampled(every=1)
    def tick(self):
        self.encoder.latch(self.angle)

    def outputs(self):
        self.count = self.encoder.count


def encoder_error(angles, **parameters):
    """Reading minus angle with a quantum too small to matter."""
    part = Encoder(encoder_quantum=1e-13, **{f"encoder_{n}": x for n, x in parameters.items()})
    part.initialize()
    out = []
    for k, a in enumerate(angles):
        part.angle = float(a)
        part.do_step(k * H, H)
        out.append(part.count * 1e-13 - a)
    return np.array(out)


# ------------------------------------------------------------------------------------ errors of the scale
def test_electrical_errors_are_those_of_two_imperfect_channels():
    """5-51 with e5 - e3, against the angle of the channels' vector (no formula shared), to 1e-9 electrical rad."""
    d0, de, e3, e5, p = 1e-5, 2e-5, 1.5e-5, 0.7e-5, 360
    a = np.linspace(0.0, 2 * math.pi / p, 181)
    th = p * a
    cosine = np.cos(th + d0) + e3 * np.cos(3 * th) + e5 * np.cos(5 * th)
    sine = (1 + de) * np.sin(th) - e3 * np.sin(3 * th) + e5 * np.sin(5 * th)
    exact = np.unwrap(np.arctan2(sine, cosine)) - th
    assert encoder_error(a, d0=d0, de=de, e3=e3, e5=e5) * p == pytest.approx(exact, abs=1e-9)
    assert np.ptp(exact) > 2e-5


def test_harmonics_of_the_scale():
    a = np.linspace(-7.0, 7.0, 301)
    seen = encoder_error(
        a, eccentricity=3e-6, eccentricity_phase=0.3, tilt=2e-6, tilt_phase=-1.0, pitch=1e-6, pitch_order=36,
        pitch_phase=0.5, interpolation=0.5e-6, interpolation_phase=2.0,
    )  # fmt: skip
    hand = 3e-6 * np.sin(a + 0.3) + 2e-6 * np.sin(2 * a - 1) + 1e-6 * np.sin(36 * a + 0.5) + 5e-7 * np.sin(360 * a + 2)
    assert seen == pytest.approx(hand, abs=1.1e-13)


def test_reading_noise_and_seed():
    counts = []
    for seed in (1, 1, 2):
        part = started(0.1, mode=1, encoder_reading=20 * ARCSEC, seed=seed)
        part.angle = 0.1
        rows = []
        for k in range(400):
            part.do_step(k * H, H)
            rows.append(part.angle_read - 0.1)
        counts.append(rows)
    assert counts[0] == counts[1] != counts[2]
    assert np.std(counts[0]) == pytest.approx(20 * ARCSEC, rel=0.12)  # 400 readings: 3.5 %


# ------------------------------------------------------------------------------------------------- carry
@pytest.fixture(scope="module")
def all_angles():
    return np.arange(7_200_000, dtype=float)  # of 5e-5 deg; fine 10000 counts, coarse 3600 of 2000


def wrong(monkeypatch, a, error_deg, half_step=True):
    """Angles (of a) that the carry gets wrong with this coarse error."""
    coarse = np.floor((a + error_deg / 5e-5) / 2000.0) % 3600
    if not half_step:
        coarse = coarse - 0.5  # takes the half step of the rule away again
    monkeypatch.setattr(block, "floor", np.floor)
    return np.count_nonzero(block.carried(a % 10000, coarse, 2000.0, 10000.0, 720.0) != a)


@pytest.mark.long
def test_no_slip_at_any_angle_within_the_coarse_limit(monkeypatch, all_angles):
    for error in (-0.199, 0.199):
        assert wrong(monkeypatch, all_angles, error) == 0
    some = all_angles[::11]
    for error in (-0.15, -0.05, 0.0, 0.123):
        assert wrong(monkeypatch, some, error) == 0
    # the coarse count with half a step is off by error +- 0.05 deg, uniform: beyond 0.25 deg for a tenth of the angles
    for error in (-0.21, 0.21):
        assert wrong(monkeypatch, some, error) / some.size == pytest.approx(0.1, abs=1e-3)


def test_half_a_coarse_step_makes_the_limits_equal(monkeypatch, all_angles):
    a = all_angles[::7]
    assert wrong(monkeypatch, a, 0.249, half_step=False) == 0 == wrong(monkeypatch, a, -0.149, half_step=False)
    assert wrong(monkeypatch, a, -0.16, half_step=False) > 0 < wrong(monkeypatch, a, 0.26, half_step=False)


def test_joined_digits_would_be_wrong(all_angles):
    """Without the decision, coarse digits and fine remainder joined: 720 000 wrong angles at 0.05 deg."""
    coarse = np.floor((all_angles + 0.05 / 5e-5) / 2000.0) % 3600
    joined = np.floor(coarse * 2000.0 / 10000.0) * 10000.0 + all_angles % 10000
    assert np.count_nonzero(joined != all_angles) == 720_000


def test_a_fine_error_of_one_arcsec_passes_the_wrap_unchanged():
    for a in np.arange(-720, 721) * 0.5 * DEG + 0.3 * ARCSEC:  # next to every wrap of the fine count, over two turns
        part = started(a, mode=0, encoder_eccentricity=ARCSEC, encoder_eccentricity_phase=math.pi / 2 - a)
        off = (part.angle_read - a - ARCSEC) / (2 * math.pi)
        assert abs(off - round(off)) * 2 * math.pi <= 0.51 * part.quantum


def test_absolute_reading_slips_beyond_the_limit_and_says_so():
    angles = (np.arange(400) * 0.9017) % 360 * DEG
    slips = {}
    for zero in (0.19, 0.21):
        read = [started(a, mode=0, coarse_zero=zero * DEG).angle_read - a for a in angles]
        off = np.array(read) / DEG
        slips[zero] = np.count_nonzero(np.abs(off - 360 * np.round(off / 360)) > 0.1)
        whole = off[np.abs(off) > 0.1] % 0.5
        assert np.minimum(whole, 0.5 - whole) == pytest.approx(0.0, abs=1e-4)  # by whole fine cycles
    assert slips[0.19] == 0 and 20 <= slips[0.21] <= 60  # a tenth of 400
    # a tighter limit than the carry needs tells a coarse channel on its way out before any slip
    part = started(0.3, mode=0, coarse_zero=0.19 * DEG, coarse_limit=0.1 * DEG)
    assert part.lost == 1.0 and abs(part.angle_read - 0.3) < part.quantum
    assert part.coarse_off == pytest.approx(0.19 * DEG, abs=0.051 * DEG)
    assert started(0.3, mode=0, coarse_zero=0.04 * DEG, coarse_limit=0.1 * DEG).lost == 0.0


@pytest.mark.parametrize("mode", [0, 1])
def test_turns_are_counted(mode):
    part = started(-3.0, mode=mode)
    rows = follow(part, lambda t: -3.0 + 0.9 * t, lambda t: 0.9, 20.0, h=0.01)  # through 0 and 360 deg, 15 rad
    tail = rows[5:]  # a start at full rate: the type-2 loop needs 50 ms
    assert np.abs(tail[:, 1]).max() <= 0.51 * part.quantum and not rows[:, 3].any()
    assert part.count == round(part.angle_read / part.quantum)


def test_second_head():
    """Both heads read the axis; each has the error of the scale at its own place."""
    e = {"encoder_eccentricity": 5 * ARCSEC, "encoder_eccentricity_phase": 0.4}
    for mode in (0, 1):
        for a in (0.0, 1.0, 2.5):
            one, two = (started(a, mode=mode, head=head, **e).angle_read for head in (0.0, math.pi))
            assert one - a == pytest.approx(5 * ARCSEC * math.sin(a + 0.4), abs=0.6 * 0.18 * ARCSEC)
            assert 0.5 * (one + two) == pytest.approx(a, abs=0.6 * 0.18 * ARCSEC)  # order 1 is gone


# ------------------------------------------------------------------------------- excitation and latching
def test_clocks():
    # 5-46 with m: one count of 10 MHz at 2 kHz is 1e-4 deg, 5000 counts are half a degree (ET15); 5-48: 3600 of 0.1 deg
    part = started(0.4 * DEG, mode=0, **KHZ2)
    assert (part.N, part.n_c, part.count) == (5000.0, 3600.0, 4000.0)
    # half a degree is 360/n with n = 720 poles, not 180/n (ET10): the reading repeats there, less often
    assert started(0.9 * DEG, mode=0, **KHZ2).count - part.count == 5000.0
    # 24 MHz for 5e-5 deg over 0.5 deg makes 2400 Hz; 4.32 MHz are then 1800 counts of 0.2 deg, 8.64 MHz 0.1 deg (ET13)
    assert started(mode=0).N == 1e4 and started(mode=0).n_c == 3600.0
    assert started(mode=0, f_c=4.32e6, coarse_limit=0.15 * DEG).n_c == 1800.0
    with pytest.raises(ComponentError, match="coarse_limit"):
        started(mode=0, f_c=4.32e6)
    # multiplier of 1e4: 0.18 arcsec with the doubled angle; 2.5 kHz: 40 ns a count
    assert started().quantum / ARCSEC == pytest.approx(0.18, rel=1e-12)
    assert pytest.approx(40e-9, rel=1e-12) == started(f_0=2500.0, f_T=25e6, f_c=9e6).N / 25e6 / 1e4


def crossings(angle, k, f_0=2000.0, p=360):
    """Zero crossings of cos(wt + p a) and then cos(wt - p a) around the middle of period k: times, by search."""
    w = 2 * math.pi * f_0
    base = 2 * math.pi * k  # phase of the middle
    first = brentq(lambda t: w * t + p * angle(t) - base, (k - 0.6) / f_0, (k + 0.1) / f_0, xtol=1e-16)
    second = brentq(lambda t: w * t - p * angle(t) - base, (k - 0.1) / f_0, (k + 0.6) / f_0, xtol=1e-16)
    return first, second


def test_the_count_is_the_angle_in_the_middle_of_both_crossings():
    """One period measured with the crossing times themselves; then what the part reads, and when.  [latching]"""
    rate, k = 1.0, 20
    turned = 0.21 * DEG
    middle = k / 2000.0

    def angle(t):
        return turned + rate * (t - middle)

    t1, t2 = crossings(angle, k)
    interval = (t2 - t1) * 2000.0 / 2 * DEG  # 5-43, 5-44: dt = 2 alpha_deg / f_0
    assert interval == pytest.approx(angle((t1 + t2) / 2), abs=2e-9)
    assert (t1 + t2) / 2 == pytest.approx(middle, abs=0.03 * (t2 - t1))  # p rate / w of it
    late = {}
    for stamp in (0, 1):
        part = started(angle(0.0), rate, mode=0, stamp=stamp, **KHZ2)
        rows = follow(part, angle, lambda t: rate, 0.0125, h=1e-4)
        ready = [r for r in rows if r[0] >= t2 + 1e-5]
        early = [r for r in rows if r[0] < t2 - 1e-5]
        assert ready[0][2] > early[-1][2]  # a new reading with the second crossing
        if stamp:
            assert ready[0][2] == pytest.approx(middle, abs=1e-12)
        late[stamp] = ready[0][1]
    assert abs(late[1]) < 0.51e-4 * DEG
    assert -late[0] == pytest.approx(rate * (t2 - t1) / 2, abs=0.6e-4 * DEG + 0.03 * rate * (t2 - t1) / 2)


def test_stamped_at_the_second_crossing_the_count_lags_up_to_half_a_period():
    """rate T_0 / 2 = 51.6 arcsec at 1 rad/s and 2 kHz; stamped in the middle nothing but the quantum is left."""
    lag = {}
    for stamp in (0, 1):
        part = started(0.0, 1.0, mode=0, stamp=stamp, **KHZ2)
        lag[stamp] = -follow(part, lambda t: t, lambda t: 1.0, 0.5, h=0.97e-3)[2:, 1] / ARCSEC
    assert lag[0].max() == pytest.approx(51.57, abs=1.0) and lag[0].min() == pytest.approx(0.0, abs=1.0)
    assert np.abs(lag[1]).max() <= 0.19


def test_accelerating_table_is_read_at_its_stamp():
    part = started(0.0, mode=0, **KHZ2)
    rows = follow(part, lambda t: 1.5 * t * t, lambda t: 3 * t, 0.3, h=1e-3)
    assert np.abs(rows[2:, 1]).max() <= 0.51e-4 * DEG


def shifter(rate, slope, f_0, a, p=360):
    """Error of the reading from the two sidebands of the cosine channel, each through its own phase shift."""
    d = p * rate / (2 * math.pi * f_0)
    plus, minus = np.exp(1j * p * a), np.exp(-1j * p * a)

    def shift(x):
        return np.exp(-1j * (math.pi / 2 + slope * (x - 1)))  # -90 deg at the carrier

    cosine = 0.5j * ((1 + d) * plus * shift(1 + d) + (1 - d) * minus * shift(1 - d))
    sine = 0.5 * (-(1 + d) * plus + (1 - d) * minus)
    return np.angle((cosine - sine) * np.conj(cosine + sine) * np.exp(-2j * p * a)) / (2 * p)


@pytest.mark.parametrize("slope", [1.0, 0.5, 0.0])
def test_single_phase_excitation(slope):
    """5-57: up to rate/w = 16.4 arcsec at 1 rad/s, 2 kHz, mean 8.2 (ET12); a broadband shifter makes no error."""
    a = np.linspace(0.0, 0.5 * DEG, 101)[:-1]
    seen = []
    for x in a:
        part = started(x, 1.0, mode=0, phases=1, shifter_slope=slope, **KHZ2)
        part.do_step(0.0, 1e-3)  # period 1 at the angle x - (1e-3 - t_read)
        seen.append(part.angle_read - (x - (1e-3 - part.t_read)))
    seen = np.array(seen)
    read = a - 0.5e-3  # about there
    exact = shifter(1.0, slope, 2000.0, read)
    # second order in p rate / w = 2.9 %, quantum 0.36 arcsec, and the angle at which it was read (2 periods at most)
    assert np.sort(seen) / ARCSEC == pytest.approx(np.sort(exact) / ARCSEC, abs=0.9)
    assert seen.mean() / ARCSEC == pytest.approx(-8.2 * slope, abs=0.3)
    assert seen.min() / ARCSEC == pytest.approx(-16.4 * slope, abs=0.4)
    two = started(0.3, 1.0, mode=0, phases=2, shifter_slope=slope, **KHZ2)
    assert abs(follow(two, lambda t: 0.3 + t, lambda t: 1.0, 0.05)[3:, 1]).max() <= 0.51e-4 * DEG


# ------------------------------------------------------------------------------------ targets and refusals
@pytest.mark.parametrize("more", [{"mode": 0.0, "stamp": 0.0}, {"loop_type": 1.0}, {"loop_type": 2.0}, PULSE])
def test_native_is_bit_equal_in_every_mode(more):
    """reference.csv is one mode with one-phase excitation."""
    rows = []
    for target in ("plain", "native"):
        one = make("inductosyn", target)
        one.set({"coarse_zero": 0.003, "encoder_reading": 1e-6, "seed": 4.0, **{n: float(x) for n, x in more.items()}})
        one.initialize(0.0)
        for k in range(100):
            one.set({"angle": 8e-3 * math.sin(0.1 * k), "rate": 0.8 * math.cos(0.1 * k)})
            one.step(k * 1e-3, 1e-3)
            rows.append(one.get(["count", "angle_read", "t_read", "lost", "coarse_off"]))
        one.free()
    assert rows[:100] == rows[100:] and all(rows[50][:3])


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"f_T": 24.0005e6}, "whole number of counts"),
        ({"f_c": 8.6405e6}, "whole number of coarse counts"),
        ({"quantum": 0.36 * ARCSEC}, "1 / 7.2e"),  # that of the single angle
        ({"coarse_limit": 0.201 * DEG}, "coarse_limit"),
        ({"rate_max": 10.5}, "half a fine cycle in an excitation period"),  # 0.25 deg 2400 1/s = 10.47 rad/s
        ({"loop_type": 1, "rate_max": 2.75}, "capture range"),  # 0.25 deg 200 pi 1/s = 2.74 rad/s
        ({**PULSE, "rate_max": 0.0097}, "more than the counter follows"),  # 2000 arcsec/s = 0.009696 rad/s
        ({"pole_pairs": 0}, "pole_pairs"),
        ({"encoder_e3": 0.2}, "encoder_e3"),
    ],
)
def test_refusals(parameters, said):
    with pytest.raises(ComponentError, match=said):
        started(**parameters)


def test_limits_of_the_refusals_are_allowed():
    started(rate_max=10.4, loop_type=0)
    started(loop_type=1, rate_max=2.7)
    started(**{**PULSE, "rate_max": 0.0096})
    assert Inductosyn.declarations["pole_pairs"].type is int  # an FMU takes no other
