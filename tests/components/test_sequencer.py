"""The timeline of phases, and every refusal."""

import itertools

import pytest
from wired import Sequencer, plan

from gyrobench.component import ComponentError

EYE = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
TURNED = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
H = 0.01


def started(phases, faces=(EYE,)):
    part = Sequencer(**plan(phases, list(faces)))
    part.initialize()
    return part


def play(part, steps, angle=lambda t: 0.0, in_position=lambda t: 1.0):
    """Signals after each step; the inputs are those of the end of the step before."""
    out = [(0, part.phase, part.gate, part.done)]
    for k in range(steps):
        part.angle, part.in_position = angle(k * H), in_position(k * H)
        part.do_step(k * H, H)
        out.append((k + 1, part.phase, part.gate, part.done))
    return out


def changes(track):
    """(sample number, phase, gate, done) wherever something changes."""
    return [b for a, b in itertools.pairwise(track) if a[1:] != b[1:]]


def test_hold_phase():
    # samples 1, 2, 3: waits for a report that is not stale; settles 10 samples; open at 13; dwell 100 samples to
    # 113, open for three more, closed and done at 116
    part = started([{"mode": 0, "settle": 0.1, "dwell": 1.0, "window": 0.5}])
    assert changes(play(part, 130)) == [(13, 1.0, 1.0, 0.0), (116, 1.0, 0.0, 1.0)]


def test_move_ends_before_settle_begins():
    # in position from t = 0.50 on, seen in the step that ends at 0.51: settle 0.2 s from there
    part = started([{"mode": 1, "target": 0.3, "settle": 0.2, "dwell": 0.3, "window": 0.1}])
    assert (part.mode, part.target, part.window) == (1.0, 0.3, 0.1)
    track = play(part, 120, in_position=lambda t: float(t > 0.499))
    assert changes(track) == [(71, 1.0, 1.0, 0.0), (104, 1.0, 0.0, 1.0)]


def test_settling_starts_anew_when_the_table_leaves_its_position():
    part = started([{"settle": 0.2, "dwell": 0.3, "window": 0.1}])
    track = play(part, 120, in_position=lambda t: float(not 0.1 < t < 0.2))
    assert changes(track)[0] == (21 + 20, 1.0, 1.0, 0.0)


def test_a_stale_report_is_not_believed():
    # the report of the old position lasts two samples into the new phase
    part = started([{"mode": 1, "target": 1.0, "settle": 0.0, "dwell": 0.1, "window": 0.1}])
    track = play(part, 60, in_position=lambda t: float(t < 0.015 or t > 0.3))
    assert changes(track)[0] == (32, 1.0, 1.0, 0.0)


def test_rate_phase_without_travel_has_windows_by_time():
    # only the second axis turns; opens at sample 3 + 5, dwell 0.2 s to 28, three more: as a hold phase
    phase = {"mode": 2, "settle": 0.05, "dwell": 0.2, "window": 0.1}
    part = Sequencer(**plan([phase], [EYE]), targets_y=[1.0] + [0.0] * 98)
    part.initialize()
    assert (part.mode, part.target, part.target_y) == (2.0, 0.0, 1.0)
    assert changes(play(part, 60)) == [(8, 1.0, 1.0, 0.0), (31, 1.0, 0.0, 1.0)]


def test_rate_phase_opens_by_angle_and_keeps_the_gate_a_hair_longer():
    # 1 rad/s: 0.01 rad a sample.  Opens at sample 8 (3 + 5), sees 0.07; travel 0.5 + 0.1/100 reached when
    # angle >= 0.571, seen at 58 -> sample 59 (0.58 is seen); three more: closed at 62.
    part = started([{"mode": 2, "target": 1.0, "settle": 0.05, "travel": 0.5, "window": 0.1}])
    track = play(part, 80, angle=lambda t: t)
    assert changes(track) == [(8, 1.0, 2.0, 0.0), (62, 1.0, 0.0, 1.0)]
    part.reset()
    for key, x in plan([{"mode": 2, "target": -1.0, "settle": 0.05, "travel": 0.5, "window": 0.1}], [EYE]).items():
        setattr(part, key, x)
    part.initialize()
    assert changes(play(part, 80, angle=lambda t: -t)) == [(8, 1.0, 2.0, 0.0), (62, 1.0, 0.0, 1.0)]


def test_servo_phase_lasts_until_time_and_angle_have_passed():
    # windows by time; opens at sample 3 + 5.  Dwell 0.2 s alone: closes at 28 + 3.  With a travel of 0.5 rad at
    # 1 rad/s, 0.01 rad a sample: opened at 8 having seen 0.07, 0.57 is seen at 57 -> sample 58; three more: 61.
    servo = {"mode": 3, "settle": 0.05, "dwell": 0.2, "window": 0.1}
    part = started([servo])
    assert changes(play(part, 80, angle=lambda t: t)) == [(8, 1.0, 1.0, 0.0), (31, 1.0, 0.0, 1.0)]
    assert part.mode == 0.0
    part = started([{**servo, "travel": 0.5}])
    assert part.mode == 3.0
    assert changes(play(part, 80, angle=lambda t: -t)) == [(8, 1.0, 1.0, 0.0), (61, 1.0, 0.0, 1.0)]
    part = started([{"mode": 0, "settle": 0.05, "dwell": 0.2, "window": 0.1, "travel": 0.5}])  # not of a hold phase
    assert changes(play(part, 80, angle=lambda t: 0.0)) == [(8, 1.0, 1.0, 0.0), (31, 1.0, 0.0, 1.0)]


def test_step_phase_settles_and_dwells_at_every_stop():
    # stops at 1.0, 0.5, 0.0 rad (travel 1).  Each as an index phase: opens 3 + 5 samples on, dwells 10, three more: 21
    step = {"mode": 4, "target": 1.0, "settle": 0.05, "dwell": 0.1, "travel": 1.0, "window": 0.1}
    part = Sequencer(**plan([step, {"dwell": 0.1, "window": 0.1}], [EYE]), steps=[-0.5] + [0.0] * 98)
    part.initialize()
    seen, track = [(part.mode, part.target)], [(0, part.phase, part.gate, part.done)]
    for k in range(90):
        part.do_step(k * H, H)
        seen.append((part.mode, part.target))
        track.append((k + 1, part.phase, part.gate, part.done))
    assert changes(track) == [
        (8, 1.0, 1.0, 0.0), (21, 1.0, 0.0, 0.0), (29, 1.0, 1.0, 0.0), (42, 1.0, 0.0, 0.0), (50, 1.0, 1.0, 0.0),
        (63, 2.0, 0.0, 0.0), (66, 2.0, 1.0, 0.0), (79, 2.0, 0.0, 1.0),
    ]  # fmt: skip
    assert [seen[k] for k in (0, 20, 21, 41, 42, 62)] == [(1.0, v) for v in (1.0, 1.0, 0.5, 0.5, 0.0, 0.0)]
    assert seen[63] == (0.0, 0.0)


def test_phases_follow_and_faces_change():
    part = started(
        [
            {"mode": 0, "dwell": 0.1, "window": 0.1},
            {"mode": 2, "target": 0.5, "travel": 0.2, "window": 0.1, "face": 2},
            {"mode": 1, "target": 7.0, "dwell": 0.2, "window": 0.1, "face": 1},
        ],
        [EYE, TURNED],
    )
    seen = {}
    for k in range(200):
        part.angle = 0.5 * k * H
        part.do_step(k * H, H)
        seen.setdefault((part.phase, part.mode, part.target, part.done, part.face[0][1]), k)
    assert list(seen) == [(1, 0, 0, 0, 0), (2, 2, 0.5, 0, 1), (3, 1, 7, 0, 0), (3, 0, 0, 1, 0)]


def test_gate_is_closed_between_phases_without_settling():
    part = started([{"dwell": 0.1, "window": 0.1}, {"dwell": 0.1, "window": 0.1}])
    track = play(part, 60)
    # open at 3, dwell to 13, closed with phase 2 at 16; open at 19
    assert changes(track) == [(3, 1.0, 1.0, 0.0), (16, 2.0, 0.0, 0.0), (19, 2.0, 1.0, 0.0), (32, 2.0, 0.0, 1.0)]


def test_times_are_not_accumulated():
    # 20,000 s at 1 ms: the dwell of 10,000 s has exactly 10,000,000 + 3 samples wherever it lies
    part = started([{"settle": 7.3, "dwell": 1e4, "window": 100.0}])
    h = 1e-3
    part.do_step(0.0, h)
    part.do_step(h, h)
    part.do_step(2 * h, h)
    start = 3 * h
    k = round((start + 7.3) / h)
    part.do_step((k - 2) * h, h)
    assert part.gate == 0.0
    part.do_step((k - 1) * h, h)
    assert part.gate == 1.0
    n = k + 10_000_000
    part.do_step((n - 2) * h, h)
    assert part.stage == 2.0
    part.do_step((n - 1) * h, h)
    assert part.stage == 3.0


def test_default_plan_runs_alone():
    part = Sequencer()
    part.initialize()
    assert changes(play(part, 130))[-1][3] == 1.0


OK = {"dwell": 1.0, "window": 0.5}
RATE = {"mode": 2, "target": 0.1, "travel": 6.0, "window": 0.5}


@pytest.mark.parametrize(
    "phase, message",
    [
        ({**OK, "mode": 5}, "phase 2: unknown mode; modes are 0 hold, 1 index, 2 rate, 3 servo"),
        ({**OK, "face": 13}, "phase 2: face_of must be 1 to 12"),
        ({**OK, "face": 0}, "phase 2: face_of must be 1 to 12"),
        ({**RATE, "target": 0.0}, "phase 2: the table does not turn"),
        ({**RATE, "travel": -1.0}, "phase 2: a rate phase needs a travel above 0 rad, or none and a dwell"),
        (
            {**RATE, "travel": 0.0, "dwell": 0.0},
            "phase 2: a hold, index, servo, step phase, or a rate phase without travel,",
        ),
        ({**RATE, "travel": 0.0, "dwell": 1.0, "target": 0.0}, "phase 2: the table does not turn"),
        ({**OK, "dwell": 0.0}, "phase 2: a hold, index, servo, step phase, or"),
        ({**OK, "mode": 1, "dwell": -1.0}, "phase 2: a hold, index, servo, step phase, or"),
        ({**OK, "mode": 4}, "phase 2: a step phase needs a step other than 0 rad"),
        ({**OK, "mode": 2.5}, "phase 2: unknown mode"),
        ({**OK, "window": 0.0}, "phase 2: the window must be above 0"),
        ({**OK, "window": 1.1}, "phase 2: the window is longer than the dwell"),
        ({**RATE, "window": 6.1}, "phase 2: the window is longer than the dwell"),
        ({**OK, "face": 3}, "phase 2: face 3 is not a rotation matrix"),
        ({**OK, "face": 4}, "phase 2: face 4 is left-handed"),
    ],
)
def test_refuses(phase, message):
    skewed = [[1, 0, 0], [2e-9, 1, 0], [0, 0, 1]]
    mirror = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]
    with pytest.raises(ComponentError, match=message):
        started([OK, phase], [EYE, TURNED, skewed, mirror])


def test_faces_and_phases_not_used_are_not_judged():
    started([OK, {**OK, "face": 2}], [EYE, TURNED, [[9, 0, 0], [0, 0, 0], [0, 0, 0]]])


@pytest.mark.parametrize("phases", [0, 100])
def test_refuses_number_of_phases(phases):
    part = Sequencer(phases=phases)
    with pytest.raises(ComponentError, match="phases = "):
        part.initialize()


def test_second_axis_has_targets_of_its_own():
    phases = [{"mode": 1, "target": x, "dwell": 0.1, "window": 0.1} for x in (0.1, 0.2)]
    part = Sequencer(**plan(phases, [EYE]), targets_y=[-0.3, 0.4] + [0.0] * 97)
    part.initialize()
    seen = {}
    for k in range(80):
        seen.setdefault(part.phase, (part.target, part.target_y))
        part.do_step(k * H, H)
    assert seen == {1.0: (0.1, -0.3), 2.0: (0.2, 0.4)}
    assert part.done == 1.0 and (part.target, part.target_y) == (0.0, 0.0)
