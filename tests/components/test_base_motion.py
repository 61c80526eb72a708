"""base_motion: rates and forces against the rotation matrix, presets, recorded profile."""

import math

import numpy as np
import pytest
from native_parts import make
from scipy.spatial.transform import Rotation
from wired import BENCH, Native

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part
from gyrobench.record.motion_profile import profile_rates

BaseMotion = load_part("base_motion", BENCH)
W_E, LATITUDE, H = 0.05, 0.7, 1e-4  # an Earth that turns fast, so that its share shows

MOVING = {
    "earth_rate": W_E, "latitude": LATITUDE, "onset": 0.3, "preset": 2, "scale": 0.5,
    "amplitude": [[0.2, 0.05, 0.0, 0.0], [0.3, 0.0, 0.0, 0.0], [0.1, 0.0, 0.4, 0.0]],
    "frequency": [[0.7, 1.9, 1.0, 1.0], [0.5, 1.0, 1.0, 1.0], [0.9, 1.0, 0.3, 1.0]],
    "phase": [[0.1, 0.2, 0.0, 0.0], [0.7, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
}  # fmt: skip
T = [0.2, 0.5, 0.7, 1.1, 1.3, 1.7]
ANGLES = [[0.0, 0.1, 0.3], [0.1, 0.2, 0.2], [0.25, -0.1, 0.1], [0.2, -0.3, -0.1], [-0.1, 0.0, 0.0], [-0.1, 0.2, 0.4]]


def recorded(**more):
    fill = 400 - len(T)
    profile = {"preset": 9, "points": len(T), "profile_t": T + [0.0] * fill, "profile": ANGLES + [[0.0] * 3] * fill}
    return {"earth_rate": W_E, "latitude": LATITUDE, **profile, **more}


def matrix(angle):
    """v_base = C v_ENU with scipy: active rotations, heading about z, then pitch about x, roll about y, transposed."""
    pitch, roll, heading = angle
    return Rotation.from_euler("ZXY", [heading, pitch, roll]).as_matrix().T


def play(parameters, until):
    """Outputs after a step: those beside and at each fiftieth."""
    part = Native("base_motion", **parameters)
    part.initialize()
    rows = {}
    for k in range(round(until / H)):
        part.do_step(k * H, H)
        if (k + 1) % 50 < 3:
            rows[k] = [np.array(getattr(part, n)) for n in ("angle", "omega", "alpha", "f")]
    return rows


@pytest.mark.parametrize("parameters", [MOVING, recorded()])
def test_rate_acceleration_and_force_belong_to_the_angles(parameters):
    """omega = vee(C dC^T/dt) + C w_E and alpha = d omega/dt by central differences (error h2/6 of a third derivative
    of about 50 rad/s3: below 1e-7; for the rate some 1e-6); f = C (0, 0, g + heave): its direction is that of up."""
    rows = play(parameters, 1.9)
    earth = W_E * np.array([0.0, math.cos(LATITUDE), math.sin(LATITUDE)])
    for k in range(50, max(rows), 50):
        angle, omega, alpha, f = rows[k]
        c = matrix(angle)
        turn = c @ (matrix(rows[k + 1][0]) - matrix(rows[k - 1][0])).T / (2 * H)
        rate = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
        np.testing.assert_allclose(omega, rate + c @ earth, atol=2e-6)
        if not any(abs(k * H + H - t) < 2 * H for t in T):  # a kink of the acceleration at each point
            np.testing.assert_allclose(alpha, (rows[k + 1][1] - rows[k - 1][1]) / (2 * H), atol=3e-5)
        np.testing.assert_allclose(f / np.linalg.norm(f), c[:, 2], atol=1e-12)


def test_profile_passes_its_points_and_rests_outside():
    part = Native("base_motion", **recorded(earth_rate=0.0))
    part.initialize()
    seen, looked = {}, {1, 20000, *(round(t / H) for t in T)}
    for k in range(20000):
        part.do_step(k * H, H)
        if k + 1 in looked:
            seen[k + 1] = list(part.angle)
    for t, angles in zip(T, ANGLES, strict=True):
        assert seen[round(t / H)] == pytest.approx(angles, abs=1e-12)
    assert seen[1] == ANGLES[0] and seen[20000] == ANGLES[-1]
    assert [part.get(f"omega[{i}]") for i in (1, 2, 3)] == [0.0, 0.0, 0.0]


def test_rates_of_a_recording_without_the_part():
    """profile_rates, from which a wanted jitter has its density, against the part; both rest before and after."""
    part = Native("base_motion", **recorded(earth_rate=0.0))
    part.initialize()
    t, seen = np.arange(1, 200) * 0.01, []
    for k in range(t.size):
        part.do_step(k * 0.01, 0.01)
        seen.append(part.omega)
    rates = profile_rates(np.array(T), np.array(ANGLES), t)
    np.testing.assert_allclose(np.array(seen).T, rates, atol=1e-12)
    assert not rates[:, t < T[0]].any() and not rates[:, t > T[-1]].any()


def test_profile_follows_a_parabola_exactly_inside():
    """Slopes and curvatures come from parabolas through three points: of a parabola they are exact, wherever the points
    are, and the quintic then is that parabola (not in the first and last piece, whose ends rest)."""
    times = [0.0, 0.2, 0.5, 0.6, 1.0, 1.1]
    values = [0.3 + 0.2 * t - 0.4 * t * t for t in times]
    fill = 400 - len(times)
    profile = [[v, 0.0, 0.0] for v in values] + [[0.0] * 3] * fill
    part = Native("base_motion", preset=9, points=6, profile_t=times + [0.0] * fill, profile=profile)
    part.initialize()
    for k in range(9999):
        part.do_step(k * H, H)
        t = (k + 1) * H
        if t >= 0.2:
            assert abs(part.angle[0] - (0.3 + 0.2 * t - 0.4 * t * t)) <= 1e-12
            assert abs(part.omega[0] - (0.2 - 0.8 * t)) <= 1e-11
            assert abs(part.alpha[0] + 0.8) <= 1e-9


@pytest.mark.parametrize(("preset", "roll", "heave"), [(1, 1.5, 0.2), (3, 8.0, 1.0), (5, 2.0, 1.5)])
def test_presets_have_the_rms_of_the_table(preset, roll, heave):
    """Sines of different frequency add their powers: a long mean of the square is rms2.  (The native FMU: quicker.)"""
    part = make("base_motion", "native")
    part.set({"preset": preset, "onset": 0.0})
    part.initialize()
    angles, forces = [], []
    for k in range(20000):
        part.step(k * 0.25, 0.25)
        angle, *f = part.get(["angle[2]", "f[1]", "f[2]", "f[3]"])
        angles.append(angle)
        forces.append(math.hypot(*f) - 9.80665)
    part.free()
    assert math.degrees(np.std(angles)) == pytest.approx(roll, rel=0.02)
    assert np.std(forces) == pytest.approx(heave, rel=0.02)


def test_lines_of_a_preset_share_the_spectrum_equally():
    """Area of S ~ w^-5 exp(-1.25 (wm/w)^4) below w is exp(-1.25 (wm/w)^4), by hand; the lines: 1/16, 3/16 ..."""
    part = BaseMotion(preset=2)
    part.initialize()
    mode = 2 * math.pi / 10.0  # roll, sea state 5
    below = [math.exp(-1.25 * (mode / w) ** 4) for w in part.line_w[1]]
    assert below == pytest.approx([(k + 0.5) / 8 for k in range(8)], rel=1e-12)


@pytest.mark.parametrize("steps", [[1e-3], [1e-3, 2.5e-3, 2.5e-3]])
def test_the_sines_of_a_preset_turn_as_far_as_the_time(steps):
    """Against the sum of sines by numpy at the same instants: w_k and phases by the formulas of the README.

    64 turns of an error of 1e-16 each, and w t of some 50 rad rounded: some 1e-14 of each of 8 amplitudes of rms / 2.
    Were the turn of a step by the step before, it would be off by w 1.5 ms = 2e-3.
    """
    rms, periods = np.radians([1.0, 4.0, 0.8]), np.array([7.0, 10.0, 14.0])  # sea state 5
    k = np.arange(8)
    w = 2 * np.pi / periods[:, None] * (1.25 / -np.log((k + 0.5) / 8)) ** 0.25
    phase = 2 * np.pi * ((math.sqrt(5) - 1) / 2 * (8 * np.arange(3)[:, None] + k + 1) % 1)
    part = make("base_motion", "native")
    part.set({"preset": 2.0, "onset": 0.0})
    part.initialize()
    turns, worst = np.cumsum([0, *(round(2000 * h) for h in steps)]), 0.0  # whole: sums of times add their rounding
    for n in range(10_000):
        rounds, at = divmod(n, len(steps))
        part.step((rounds * turns[-1] + turns[at]) / 2000, steps[at])
        t = (rounds * turns[-1] + turns[at + 1]) / 2000
        wanted = rms / 2 * np.sin(w * t + phase).sum(axis=1)
        worst = max(worst, np.abs(np.array(part.get([f"angle[{i}]" for i in (1, 2, 3)])) / rms - wanted / rms).max())
    part.free()
    assert worst < 1e-13


def test_native_target_repeats_a_preset():
    parts = [make("base_motion", how) for how in ("plain", "native")]
    names = [f"{n}[{i}]" for n in ("angle", "omega", "alpha", "f") for i in (1, 2, 3)]
    seen = []
    for part in parts:
        part.set({"preset": 4.0, "earth_rate": 7.292e-5})
        part.initialize(0.0)
        for k in range(200):
            part.step(k * 0.05, 0.05)
        seen.append(part.get(names))
        part.free()
    assert seen[0] == seen[1]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"preset": 6}, "presets are 0 none, 1..3 sea"),
        ({"preset": 9, "points": 2}, "needs 3 points or more"),
        (recorded(profile_t=[0.2, 0.5, 0.5, *[1.0] * 397]), "the time of point 3 is not after"),
    ],
)
def test_refusals(change, says):
    with pytest.raises(ComponentError, match=says):
        BaseMotion(**change).initialize()
