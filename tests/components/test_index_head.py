"""The indexing head: its positions with their errors, the move, the creep into place; frames as in table_rate."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wired import BENCH, Sampler, Sequencer, TableRate, Wired, begun, plan

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

IndexHead = load_part("index_head", BENCH)

ARCSEC = math.pi / 648000.0
H = 0.01


def started(**values):
    return begun(IndexHead, **values)


def run(part, until, start=0.0, h=H):
    track = []
    for k in range(round(start / h), round(until / h)):
        part.do_step(k * h, h)
        track.append(((k + 1) * h, part.angle, part.rate, part.alpha[2], part.angle_read, part.in_position))
    return np.array(track)


def table(n, seed=1):
    return [*np.random.default_rng(seed).normal(0.0, 5 * ARCSEC, n), *[0.0] * (24 - n)]


@pytest.mark.parametrize("n", [4, 8, 12, 24])
def test_every_position_has_its_error(n):
    """Twice round and back by the angle: nominal angle in the reading, nominal angle and error in truth."""
    error = table(n)
    part = started(positions=n, error=error, index_rate=100.0)
    t = 0.0
    for k in [*range(2 * n + 1), -1, -n, -n - 3]:
        part.mode, part.target = 1.0, k * 2.0 * math.pi / n
        run(part, t + 1.0, t)
        t += 1.0
        assert part.in_position == 1.0 and part.rate == 0.0
        assert part.angle_read == pytest.approx(k * 2.0 * math.pi / n, abs=1e-14)
        assert part.angle - part.angle_read == pytest.approx(error[k % n], abs=1e-14)
        assert part.position == k % n + 1


def test_by_number_the_shortest_way():
    part = started(positions=8, index_rate=100.0, mode=1.0, number=1.0)
    turned = []
    for t, number in enumerate((1, 4, 7, 1, 6)):  # 0; 3 on; 3 on; 2 on; 3 back
        part.number = number
        run(part, t + 1.0, t)
        turned.append(round(part.angle / (math.pi / 4.0)))
        assert part.position == number
    assert turned == [0, 3, 6, 8, 5]


def test_move():
    # 90 deg with a peak rate of 0.5 rad/s: 1.5 (pi/2) / 0.5 = 4.712 s; half way at half time with the peak rate
    part = started(positions=4, mode=1.0, target=math.pi / 2.0)
    track = run(part, 6.0)
    assert track[np.argmax(track[:, 5] == 1.0), 0] == pytest.approx(1.5 * math.pi, abs=1.01 * H)
    middle = np.argmin(abs(track[:, 0] - 0.75 * math.pi))
    assert track[middle, 1] == pytest.approx(math.pi / 4.0, abs=0.005)
    assert track[:, 2].max() == pytest.approx(0.5, rel=1e-5)
    moving = track[:, 0] < 4.7
    slope = (track[2:, 1] - track[:-2, 1]) / (2.0 * H)
    assert slope[moving[2:]] == pytest.approx(track[1:-1, 2][moving[2:]], abs=5e-6)
    slope = (track[2:, 2] - track[:-2, 2]) / (2.0 * H)
    assert slope[moving[2:]] == pytest.approx(track[1:-1, 3][moving[2:]], abs=1e-12)
    assert track[-1, 1] == math.pi / 2.0


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_creep(way):
    """20 arcsec short, dying away with 0.5 s: below 1e-7 rad after 0.5 ln(20 arcsec / 1e-7) = 3.437 s."""
    part = started(creep=20 * ARCSEC, settling=0.5, index_rate=100.0, mode=1.0, target=way * math.pi / 4.0)
    track = run(part, 5.0)
    arrival = 1.5 * math.pi / 4.0 / 100.0
    after = track[track[:, 0] > arrival]
    rest = 20 * ARCSEC * np.exp(-(after[:, 0] - arrival) / 0.5)
    assert after[:, 1] == pytest.approx(way * (math.pi / 4.0 - rest), abs=1e-15)
    assert after[:, 2] == pytest.approx(way * rest / 0.5, abs=1e-15)
    assert after[:, 3] == pytest.approx(-way * rest / 0.25, abs=1e-15)
    ready = track[np.argmax(track[:, 5] == 1.0), 0]
    assert ready == pytest.approx(arrival + 0.5 * math.log(20 * ARCSEC / 1e-7), abs=1.01 * H)


def test_a_move_is_finished_before_the_next():
    part = started(positions=4, mode=1.0, target=math.pi / 2.0)
    run(part, 1.0)
    part.target = 0.0
    track = run(part, 12.0, 1.0)
    assert track[:, 1].max() > math.pi / 2.0 - 1e-3  # went there first
    assert track[-1, 1] == 0.0 and track[-1, 5] == 1.0
    part.mode, part.target = 0.0, 1.234  # holding: the target is not looked at
    assert run(part, 13.0, 12.0)[-1, 1] == 0.0


def test_repeatability():
    part = started(positions=4, repeat=2 * ARCSEC, index_rate=1000.0, mode=1.0, seed=5)
    errors = []
    for k in range(400):
        part.target = math.pi / 2.0 * (k % 4 + 1)
        part.do_step(k * 0.1, 0.1)
        part.do_step(k * 0.1 + 0.05, 0.05)
        errors.append(part.angle - part.angle_read)
        held = part.angle
        part.do_step(k * 0.1 + 0.1, 1e-3)
        assert part.angle == held
    assert np.std(errors) == pytest.approx(2 * ARCSEC, rel=0.12)
    assert abs(np.mean(errors)) < 0.3 * ARCSEC


def test_frames_are_those_of_table_rate():
    rng = np.random.default_rng(4)
    base, face = (Rotation.random(random_state=k).as_matrix().tolist() for k in (1, 2))
    tilt, earth, f = [0.02, -0.03], rng.normal(size=3).tolist(), rng.normal(size=3).tolist()
    part = started(base=base, tilt=tilt, face=face, omega_local=earth, f_local=f, mode=1.0, target=math.pi)
    for k in range(300):
        part.do_step(k * H, H)
    like = TableRate(base=base, tilt=tilt, angle0=part.angle)
    like.face, like.omega_local, like.f_local = face, earth, f
    like.initialize()
    like.motion_x, like.motion_v, like.motion_a = part.angle, part.rate, part.a
    like.outputs()
    assert part.rate > 0.1
    for name in ("omega", "alpha", "f"):
        assert getattr(part, name) == pytest.approx(getattr(like, name), abs=1e-15)


def test_eight_positions_by_the_sequencer():
    """A horizontal axis, the accelerometer's x from level up: each dwell sees g sin(nominal angle + error)."""
    error = table(8)
    phases = [{"mode": 1, "target": k * math.pi / 4.0, "settle": 0.5, "dwell": 1.0, "window": 1.0} for k in range(8)]
    parts = {
        "sequencer": Sequencer(**plan(phases, [np.eye(3)])),
        "head": IndexHead(
            base=[[1, 0, 0], [0, 0, 1], [0, -1, 0]], error=error, index_rate=5.0, creep=1e-4, settling=0.05
        ),
        "sampler": Sampler(),
    }
    wires = [(f"sequencer.{n}", f"head.{n}") for n in ("mode", "target", "face")]
    wires += [("head.angle_read", "sequencer.angle"), ("head.in_position", "sequencer.in_position")]
    wires += [(f"sequencer.{n}", f"sampler.{n}") for n in ("gate", "window", "phase")]
    wires += [("head.angle_read", "sampler.angle"), ("head.angle", "sampler.x")]
    rows = Wired(parts, ["sequencer", "head", "sampler"], wires).run(H, 60.0)
    assert [r["window_phase"] for r in rows] == [*range(1, 9)]
    for k, row in enumerate(rows):
        assert row["mean"] == pytest.approx(k * math.pi / 4.0 + error[k], abs=1e-11 + 1e-4 * math.exp(-10.0))
    assert parts["head"].f[0] == pytest.approx(9.80665 * math.sin(7 * math.pi / 4.0 + error[7]), abs=1e-8)


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"base": [[1, 0, 0], [0, 1, 2e-9], [0, 0, 1]]}, "base is not a rotation matrix"),
        ({"base": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "base is left-handed"),
        ({"positions": 25}, "positions = 25 1 must be <= 24"),
        ({"error": [0.2] + [0.0] * 23}, r"error\[1\] = 0.2 rad must be <= 0.1"),
        ({"settling": 0.0}, "settling = 0 s must be > 0"),
    ],
)
def test_refuses(parameters, message):
    with pytest.raises(ComponentError, match=message):
        started(**parameters)


@pytest.mark.parametrize(
    "inputs, message",
    [
        ({"mode": 2.0}, "mode = 2 must be 0 hold or 1 index"),
        ({"mode": 1.0, "target": 0.7}, "0.7 rad is not one of the 8 positions of the head: .* multiple of 0.785398"),
        ({"mode": 1.0, "number": 9.0}, "number = 9 must be 1 to 8"),
        ({"mode": 1.0, "number": 1.5}, "number = 1.5 must be 1 to 8"),
    ],
)
def test_refuses_commands(inputs, message):
    part = started(**inputs)
    with pytest.raises(ComponentError, match=message):
        part.do_step(0.0, H)
