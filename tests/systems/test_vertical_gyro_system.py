"""The vertical gyro in the co-simulation: the numbers of VERTICAL-GYRO, the reduction's geometry, refusals."""

import importlib
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gyrobench.engine.run_errors import ParameterRefusedError, RunError
from gyrobench.system.system import InvalidConfigurationError, load_system

NAME = "vertical_gyro"
SYSTEM = load_system(NAME)
reduction = importlib.import_module(type(SYSTEM).__module__ + ".reduction")
DEG, ARCMIN = math.pi / 180.0, math.pi / 10800.0
STILL = {"earth_rate": 0.0}


def found(session, **values):
    result = session.system.reduce(session.run(values, seed=1))
    return {c.name: c for c in result.coefficients}, result


# ------------------------------------------------------------------------------------------- reduction
def test_lean_is_the_rotor_in_level_axes():
    """Any attitude, rotor leaning by a small known vector: the reduction gives it back, with and without ring."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        pitch, roll = rng.uniform(-1.4, 1.4, 2)
        right, forward = rng.uniform(-0.02, 0.02, 2)
        n_level = np.array([math.tan(right), math.tan(forward), 1.0])
        n_level /= np.linalg.norm(n_level)
        # level axes along the heading -> vehicle axes: pitch, then roll, passive
        n = Rotation.from_euler("XY", [pitch, roll]).inv().apply(n_level)
        shown_roll = math.atan2(-n[0], n[2])
        shown_pitch = math.asin(n[1])
        args = [np.array([x]) for x in (pitch, roll, shown_pitch, shown_roll)]
        assert reduction.lean(*args)[0] == pytest.approx([right, forward], abs=1e-12)
        # the same rotor seen by a ring that lags by g2: n = R2(roll') R1(pitch') (sin g2, 0, cos g2)
        g4 = -shown_roll + 0.05
        v = Rotation.from_euler("Y", -g4).apply(n)  # ring axes
        g2, g3 = math.asin(v[0]), math.atan2(-v[1], v[2])
        args = [np.array([x]) for x in (pitch, roll, -g3, -g4, g2)]
        assert reduction.lean(*args)[0] == pytest.approx([right, forward], abs=1e-12)


def test_erection_time_by_law():
    assert reduction.erection_time(2 * DEG, 10 * ARCMIN, "switches", 4 * DEG / 60, 0.05) == pytest.approx(27.5)
    # linear: 4 deg/min down to 80 arcmin, then exp(-t/20 s) to 10: 10 s + 20 ln 8
    linear = reduction.erection_time(2 * DEG, 10 * ARCMIN, "linear", 4 * DEG / 60, 0.05)
    assert linear == pytest.approx(10.0 + 20.0 * math.log(8.0))
    assert reduction.erection_time(5 * ARCMIN, 10 * ARCMIN, "switches", 1.0, 1.0) is None


# ---------------------------------------------------------------------------- numbers of VERTICAL-GYRO
def test_erection_from_two_degrees(session):
    known, _ = found(session, phases="erection rest")
    assert known["t_zone"].estimate == pytest.approx(27.5, abs=0.15)
    assert known["t_zone"].estimate == pytest.approx(known["t_zone"].closed, abs=0.1)
    assert known["hang-off"].estimate == pytest.approx(math.sqrt(2) * 10.0, abs=0.2)


def test_hang_off_of_the_linear_law(session):
    known, _ = found(session, phases="erection rest", law="linear", time=300.0)
    assert known["hang-off"].estimate == pytest.approx(3.84, abs=0.01)
    assert known["hang-off"].closed == pytest.approx(3.84, abs=0.01)


@pytest.mark.parametrize("time", [60.0, 700.0])
@pytest.mark.long
def test_hang_off_holds_the_equilibrium(session, time):
    """T/H = omega x n with n = (tan e_x, tan e_y, 1): e = W cos(latitude)/gain to 1e-6 of it, 3.84071 arcmin.  A short
    rest has not settled (mean of its second half 3.91 with u 0.02); after a long one u was 6e-14 arcmin, the scatter.
    u is what these equations neglect, of second order: (e2 + (W/gain)2)/2 + (gain step)2 = 2e-6 of 3.84, over sqrt 3.
    """
    known, _ = found(session, law="linear", time=time, phases="erection rest")
    hang = known["hang-off"]
    true = 7.2921159e-5 * math.cos(math.radians(40.0)) / 0.05 / math.radians(1.0 / 60.0)
    assert 3e-6 < hang.u < 1e-5
    assert abs(hang.estimate - true) < 2.5 * hang.u


def test_a_rest_that_begins_at_the_largest_rate(session):
    """From 2 deg at 4 deg/min: 10 s to 4/60/0.05 = 1.33 deg, where the law begins to be linear.  The first part decays
    by no exponential: with it the hang-off was 0.4 of itself off, with as large a u.
    """
    known, _ = found(session, law="linear", time=120.0, phases="rest", tilt="2deg")
    true = 7.2921159e-5 * math.cos(math.radians(40.0)) / 0.05 / math.radians(1.0 / 60.0)
    assert abs(known["hang-off"].estimate - true) < 2.5 * known["hang-off"].u < 1e-3
    short, _ = found(session, law="linear", time=8.0, phases="rest", tilt="2deg")
    assert "largest rate" in short["hang-off"].no_value


def test_acceleration(session):
    given = {"phases": "acceleration", "tilt": 0.0, **STILL}
    assert found(session, **given, cut_off=0)[0]["lean"].estimate == pytest.approx(4.0, abs=0.02)
    cut, result = found(session, **given)
    assert abs(cut["lean"].estimate) < 1e-6
    table = next(t for t in result.tables if t.kind == "phases")
    assert table.rows[0][-1] == 1.0


def test_whole_flight(session):
    """Nothing tilts the rotor but the Earth's rate while cut off: 15.04 deg/h cos(40 deg) for 60 s is 11.5 arcmin."""
    known, result = found(session)
    assert known["turn"].estimate < math.sqrt(2) * 10.0 + 11.6
    assert known["loop"].estimate < math.sqrt(2) * 10.0 + 1.0
    # the whole loop and the whole roll, 60 deg/s / k_ring = 2 deg of lag at its end, each within its interval
    for name, whole in (("pitch", 360.0), ("roll", 358.0)):
        low, high = known[name].interval
        assert known[name].closed == pytest.approx(whole, abs=1e-9) and low < whole < high, name
        assert known[name].u < 0.001
    assert known["g2"].estimate == pytest.approx(2.0, abs=0.01)
    assert result.ranked_by == "max" and not result.warnings
    # sentences speak of what the figures show: the same largest values, from the end of the erection on
    figures = {r.name: r for r in result.responses}
    for name, largest in (("tilt", "max"), ("error", "shown max")):
        (line,) = figures[name].curves
        assert line.x[0] == pytest.approx(60.1) and "from 60.1 s on, after the erection" in figures[name].caption
        assert 0.97 * known[largest].estimate < max(line.y) <= known[largest].estimate
    assert "not distinguishable from zero" in result.summary[1] and "0.0005 ± 0.0011°" in result.summary[1]
    assert "23.668 ± 0.045 arcmin" in result.summary[2] and "130.362 ± 0.045 arcmin" in result.summary[2]


def test_fast_start(session):
    known, _ = found(session, phases="erection", tilt=20.0 * DEG, fast_time=40.0, **STILL)
    assert known["t_zone"].estimate == pytest.approx((20.0 - 1.0 / 6.0) / (40.0 / 60.0), abs=0.2)


def test_same_axis_torque_does_not_erect(session):
    given = {"erection.cross": 0, "phases": "erection", "law": "linear", "tilt": 0.5 * DEG, **STILL}
    record = session.run(given, seed=1)
    tilt = np.hypot(record.channels["gyro.e_x"], record.channels["gyro.e_y"])
    assert tilt[-1] == pytest.approx(0.5 * DEG, rel=0.01)  # it cones
    assert any("did not reach the dead zone" in w for w in session.system.reduce(record).warnings)


# ------------------------------------------------------------------------------------------- refusals
def test_lock_without_ring_ends_the_run(session):
    """A pitch without the loop phase's guard: the part itself ends the run, with time."""
    table = [36.0 * DEG] + [0.0] * 98
    values = {"ring": 0, "phases": "erection", **{f"motion.pitch[{k + 1}]": x for k, x in enumerate(table[:1])}}
    with pytest.raises((ParameterRefusedError, RunError), match="the gimbals have locked"):
        record = session.run(values, seed=1)
        raise RunError("; ".join(record.run.notes))


@pytest.mark.parametrize(
    "values, message",
    [
        ({"phases": "erection dive"}, "phases: 'dive' is none of erection, rest"),
        ({"law": "on-off"}, "law = on-off: must be one of switches, linear"),
        ({"rate": 0.0}, "rate = 0 rad/s: must be > 0"),
        ({"tilt": "70deg"}, "tilt = 70°: beyond 60° the switches are of no use; give a fast start"),
        ({"ring": 0}, "ring = 0: without the follow-up ring the gimbals lock in the loop"),
    ],
)
def test_refuses(values, message):
    with pytest.raises(InvalidConfigurationError, match=message):
        load_system(NAME).with_values(values).refuse()


def test_erection_follows_the_gyro_and_must_agree_with_it_on_H(session):
    record = session.run({"gyro.H": 0.7, "phases": "rest", "time": 1.0}, seed=1)
    assert record.run.parameters["erection.H"] == 0.7
    with pytest.raises(InvalidConfigurationError, match=r"gyro.H = 0.7 and erection.H = 0.5 N.m.s"):
        session.run({"gyro.H": 0.7, "erection.H": 0.5}, seed=1)
