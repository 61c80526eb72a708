"""Kinematics of the table: moves by hand, frames against scipy, the derivative of the rate."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from wired import begun

from gyrobench.component import ComponentError

RNG = np.random.default_rng(5)
H = 0.01


def started(**values):
    return begun("table_rate", **values)


def run(part, until, h=H, start=0.0):
    track = []
    for k in range(round(start / h), round(until / h)):
        part.do_step(k * h, h)
        track.append(((k + 1) * h, part.angle, part.rate, part.alpha[2], part.in_position))
    return np.array(track)


def at(track, t):
    return track[np.argmin(abs(track[:, 0] - t))]


def arrival(track):
    return track[np.argmax(track[:, 4] == 1.0), 0]


def test_index_with_cruise():
    # 1 rad at 0.1 rad/s with 0.1 rad/s2: 1 s and 0.05 rad up, 9 s cruise, 1 s down: 11 s
    track = run(started(mode=1.0, target=1.0), 12.0)
    assert arrival(track) == pytest.approx(11.0, abs=1.5 * H)
    assert at(track, 0.5)[1:4] == pytest.approx([0.0125, 0.05, 0.1], rel=1e-12)
    assert at(track, 1.0)[1] == pytest.approx(0.05, rel=1e-12)
    assert at(track, 6.0)[1:4] == pytest.approx([0.55, 0.1, 0.0], rel=1e-12)
    assert at(track, 10.5)[1:4] == pytest.approx([0.95 + 0.0375, 0.05, -0.1], rel=1e-11)
    assert track[-1, 1] == 1.0 and track[-1, 2] == 0.0


def test_index_too_short_to_cruise():
    # 0.04 rad: 2 sqrt(d / a) = 1.264911 s, peak sqrt(d a) = 0.0632456 rad/s
    track = run(started(mode=1.0, target=-0.04, angle0=0.0), 2.0, h=1e-4)
    assert arrival(track) == pytest.approx(1.264911, abs=1.5e-4)
    assert track[:, 2].min() == pytest.approx(-0.0632456, abs=1.1e-5)
    assert track[-1, 1] == -0.04


def test_rate():
    # 0.05 rad/s reached after 0.5 s and 0.0125 rad
    track = run(started(mode=2.0, target=0.05), 10.0)
    assert arrival(track) == pytest.approx(0.5, abs=1.5 * H)
    assert at(track, 10.0)[1:3] == pytest.approx([0.0125 + 0.05 * 9.5, 0.05], rel=1e-13)


def test_reversal_hold_and_index_from_motion():
    part = started(mode=2.0, target=0.05)
    run(part, 2.0)  # at 0.0125 + 0.075 = 0.0875
    part.target = -0.05
    # 1 s from +0.05 to -0.05: back at 0.0875; then 0.5 s more
    track = run(part, 3.5, start=2.0)
    assert arrival(track) == pytest.approx(3.0, abs=1.5 * H)
    assert at(track, 2.5)[1:3] == pytest.approx([0.0875 + 0.0125, 0.0], abs=1e-14)
    assert at(track, 3.5)[1] == pytest.approx(0.0875 - 0.025, rel=1e-12)
    part.mode = 0.0
    track = run(part, 5.0, start=3.5)  # 0.5 s, 0.0125 rad
    assert arrival(track) == pytest.approx(4.0, abs=1.5 * H)
    assert track[-1, 1:3] == pytest.approx([0.05, 0.0], abs=1e-14)
    part.mode, part.target = 2.0, 0.05
    run(part, 6.0, start=5.0)  # 0.05 + 0.0125 + 0.025 = 0.0875 at 0.05 rad/s
    part.mode, part.target = 1.0, 0.0
    # brakes to rest at 0.1 (0.5 s), then 0.1 rad back: 1 s, 1 s (peak sqrt(0.01) = 0.1 rad/s)
    track = run(part, 9.0, start=6.0)
    assert arrival(track) == pytest.approx(8.5, abs=1.5 * H)
    assert track[:, 1].max() == pytest.approx(0.1, abs=1e-13)
    assert track[-1, 1:3] == pytest.approx([0.0, 0.0], abs=0.0)


def test_hold_at_rest_is_in_position_at_once():
    part = started(mode=0.0, angle0=0.3)
    part.do_step(0.0, H)
    assert (part.in_position, part.angle, part.rate) == (1.0, 0.3, 0.0)


def test_days_at_constant_rate_add_no_error():
    # 10 Earth rates for 1e7 s: angle_ref + rate (t - t_ref), not a sum
    rate = 7.2921159e-4
    part = started(mode=2.0, target=rate)
    for k in range(20):
        part.do_step(k * 1e-3, 1e-3)
    part.do_step(1e7 - 1e-3, 1e-3)
    ramp = rate / 0.1
    assert part.angle == pytest.approx(rate * (1e7 - ramp / 2), rel=3e-16)


def test_moves_against_a_tight_reference():
    """The README's number: closed form against solve_ivp (rtol 1e-12) of angle' = rate, rate' = acceleration."""
    worst = 0.0
    for target in (1.0, -0.04, 3.3):
        part = started(mode=1.0, target=target, acceleration=0.3, index_rate=0.2)
        track = run(part, 25.0)
        corners = part.motion_t_s[1:]
        y = [0.0, 0.0]
        edges = [corners[0], *corners[1:], 25.0]
        reference = {}
        for a, (t0, t1) in zip([*part.motion_a_s[1:]], itertools.pairwise(edges), strict=True):
            if t1 <= t0:
                continue
            inside = track[(track[:, 0] > t0) & (track[:, 0] <= t1), 0]
            ends = np.unique(np.append(inside, t1))
            s = solve_ivp(lambda _, y, a=a: [y[1], a], (t0, t1), y, "DOP853", ends, rtol=1e-12, atol=1e-15)
            y = s.y[:, -1]
            reference |= dict(zip(s.t, s.y[0], strict=True))
        worst = max([worst, *(abs(x - reference[t]) for t, x in track[:, :2] if t in reference)])
    assert worst < 2e-14


def test_ripple_is_consistent():
    # angle = x + r/n sin nx with x = v t: rate and acceleration are its derivatives
    part = started(mode=2.0, target=0.5, acceleration=1e6, ripple=0.02, ripple_cycles=7)
    h = 1e-3
    track = run(part, 4.0, h=h)
    x = 0.5 * track[:, 0]
    assert track[:, 1] == pytest.approx(x + 0.02 / 7 * np.sin(7 * x), abs=3e-7)  # 3e-7: the ramp of 0.5 us
    slope = (track[2:, 1] - track[:-2, 1]) / (2 * h)
    assert track[1:-1, 2] == pytest.approx(slope, abs=1e-7)
    slope = (track[2:, 2] - track[:-2, 2]) / (2 * h)
    assert track[1:-1, 3] == pytest.approx(slope, abs=1e-6)


def test_angle_quantum():
    part = started(mode=2.0, target=-0.3, quantum=1e-3)
    for k in range(300):
        part.do_step(k * H, H)
        q = part.angle_read / 1e-3
        assert q == pytest.approx(round(q), abs=1e-9)
        assert abs(part.angle_read - part.angle) <= 0.5e-3 + 1e-12


def random_rotation():
    return Rotation.random(random_state=int(RNG.integers(1 << 31))).as_matrix()


def test_frames_with_tilt_against_scipy():
    for _ in range(5):
        base, face, tilt = random_rotation(), random_rotation(), RNG.uniform(-0.05, 0.05, 2)
        e, g = RNG.normal(size=3) * 1e-4, RNG.normal(size=3) * 9.8
        part = started(
            base=base.tolist(),
            face=face.tolist(),
            tilt=tilt.tolist(),
            omega_local=e.tolist(),
            f_local=g.tolist(),
            mode=2.0,
            target=0.4,
        )
        run(part, 9.0, h=0.1)
        # passive matrices are the inverses of scipy's active rotations
        r1 = Rotation.from_rotvec([tilt[0], 0, 0]).as_matrix().T
        r2 = Rotation.from_rotvec([0, tilt[1], 0]).as_matrix().T
        rz = Rotation.from_rotvec([0, 0, part.angle]).as_matrix().T
        to_table = rz @ r2 @ r1 @ base
        assert part.f == pytest.approx(face @ to_table @ g, abs=1e-14)
        assert part.omega == pytest.approx(face @ (to_table @ e + [0, 0, 0.4]), abs=1e-15)


def test_alpha_is_the_derivative_of_omega():
    """With Earth rate made large, d(omega)/dt from differences."""
    part = started(
        base=random_rotation().tolist(),
        face=random_rotation().tolist(),
        omega_local=[0.3, -0.2, 0.5],
        mode=1.0,
        target=1.0,
        acceleration=0.5,
        index_rate=0.4,
        ripple=0.01,
        ripple_cycles=5,
    )
    h = 1e-3
    rate, alpha = [], []
    for k in range(3500):
        part.do_step(k * h, h)
        rate.append(list(part.omega))
        alpha.append(list(part.alpha))
    rate, alpha = np.array(rate), np.array(alpha)
    slope = (rate[2:] - rate[:-2]) / (2 * h)
    error = abs(slope - alpha[1:-1]).max(axis=1)
    corners = [c / h for c in part.motion_t_s]
    smooth = [all(abs(k + 2 - c) > 2 for c in corners) for k in range(len(error))]
    assert error[smooth].max() < 1e-6
    assert abs(alpha).max() > 0.4


def test_gravity_turns_the_right_way():
    # axis horizontal to the north: base rows E, -U, N.  Turned by +90 deg about N, the first axis points to -U,
    # where it feels -g; the face swaps the first and second axis (and reverses the third)
    base = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    face = [[0, 1, 0], [1, 0, 0], [0, 0, -1]]
    part = started(base=base, face=face, angle0=math.pi / 2)
    part.do_step(0.0, H)
    assert part.f == pytest.approx([0.0, -9.80665, 0.0], abs=1e-14)


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"base": [[1, 0, 0], [0, 1, 2e-9], [0, 0, 1]]}, "base is not a rotation matrix"),
        ({"base": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "base is left-handed"),
        ({"acceleration": 0.0}, "acceleration = 0 rad/s2 must be > 0"),
        ({"index_rate": 0.0}, "index_rate = 0 rad/s must be > 0"),
        ({"quantum": -1.0}, "quantum = -1 rad must be >= 0"),
        ({"ripple": 0.2}, "ripple = 0.2 1 must be <= 0.1"),
        ({"tilt": [0.0, 0.2]}, r"tilt\[2\] = 0.2 rad must be <= 0.1"),
    ],
)
def test_refuses(parameters, message):
    with pytest.raises(ComponentError, match=message):
        started(**parameters)


@pytest.mark.parametrize(
    "mode, target, message",
    [(3.0, 0.0, "mode = 3 must be 0 hold, 1 index or 2 rate"), (2.0, -11.0, "rate -11 rad/s exceeds rate_max = 10")],
)
def test_refuses_commands(mode, target, message):
    part = started(mode=mode, target=target)
    with pytest.raises(ComponentError, match=message):
        part.do_step(0.0, H)


def test_encoder_harmonics_and_quantum():
    # read = angle + a_1 sin(angle + p_1) + a_2 sin(2 angle + p_2), to the nearest quantum; the motion stays as it is
    wrong = {"encoder_amplitude": [3e-3, -2e-3], "encoder_phase": [0.4, 1.1]}
    part, rounded, plain = (started(mode=2.0, target=0.5, **p) for p in (wrong, {**wrong, "quantum": 1e-4}, {}))
    for part_ in (part, rounded, plain):
        run(part_, 5.0)
    x = plain.angle
    read = x + 3e-3 * math.sin(x + 0.4) - 2e-3 * math.sin(2.0 * x + 1.1)
    assert part.angle == x and part.rate == plain.rate and plain.angle_read == x
    assert part.angle_read == pytest.approx(read, abs=1e-15) and abs(read - x) > 1e-3
    assert rounded.angle_read == pytest.approx(1e-4 * round(read / 1e-4), abs=1e-15)
