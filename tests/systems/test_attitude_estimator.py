"""Attitude estimation on a moving base: consistency, what tells the filters apart, compensation, refusals.
[EST-ATTITUDE]"""

from __future__ import annotations

import importlib
import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gyrobench as gb
from gyrobench.engine.session import run
from gyrobench.reduction.loops.estimator_metrics import independent_squares, lasting_squares
from gyrobench.system.system import InvalidConfigurationError, load_system

NAME = "attitude_estimator"
CALM = "rest rocking"


@cache
def made(estimator: str = "mekf", seed: int = 1, **values: Any) -> Any:
    """Options; a parameter of a part as estimator__w_0."""
    test = gb.load(NAME, parts={"estimator": f"attitude_{estimator}"})
    for name, value in values.items():
        test.set(name.replace("__", "."), value)
    return test.run(seed=seed, check_step=False)


def reduction() -> Any:
    return importlib.import_module(".reduction", type(load_system(NAME)).__module__)


def by_phase(r: Any, column: str) -> dict[str, Any]:
    table = next(t for t in r.result.tables if t.kind == "phases")
    k = table.columns.index(column)
    return {row[0]: row[k] for row in table.rows}


def test_error_and_its_frame() -> None:
    """d turns the vehicle from the estimated to the true attitude; level errors are along east, north, up."""
    rng = np.random.default_rng(1)
    angle = rng.uniform(-1.0, 1.0, (5, 3))
    d = 1e-3 * rng.normal(size=(5, 3))
    m = reduction()
    C = m.matrices(angle)
    for k in range(5):
        pitch, roll, heading = angle[k]
        assert C[k] == pytest.approx(Rotation.from_euler("ZXY", [heading, pitch, roll]).as_matrix().T, abs=1e-14)
    true = np.array([Rotation.from_rotvec(-d[k]).as_matrix() @ C[k] for k in range(5)])
    heading, pitch, roll = Rotation.from_matrix(np.transpose(true, (0, 2, 1))).as_euler("ZXY").T
    found = m.attitude_errors(angle, np.column_stack([pitch, roll, heading]))
    assert found == pytest.approx(d, abs=1e-12)
    level = m.level_errors(found, np.column_stack([pitch, roll, heading]))
    assert level[2] == pytest.approx(true[2].T @ d[2], abs=1e-12)


def test_squares_of_an_error_that_stays_count_once() -> None:
    """A constant is one square, white noise n; by lags up to a twentieth a constant would count for ten."""
    n = 1000
    assert lasting_squares(np.ones(n)) < 1.5
    assert independent_squares(np.ones(n)) > 9.0
    assert lasting_squares(np.random.default_rng(1).normal(size=n)) > 0.7 * n


@pytest.mark.long
def test_the_multiplicative_filter_is_consistent_at_any_attitude() -> None:
    for rocking in ("20deg", "60deg"):
        r = made(phases=CALM, rocking=rocking)
        for name in ("NEES", "NIS"):
            c = r.result[name]
            assert abs(c.estimate - 1.0) < 4.0 * c.u, (rocking, name)
        assert not [w for w in r.result.warnings if "NEES" in w]
        assert r.result["tilt rocking"].estimate < 0.008


@pytest.mark.long
def test_intervals_of_an_rms_are_those_of_chi_square() -> None:
    """Above 0, wider upwards; few independent values of a bias: the next run may have several times as much."""
    r = made(phases=CALM)
    for c in r.result.coefficients[:-2]:
        assert 0.0 < c.interval[0] < c.estimate < c.interval[1]
        assert c.interval[1] == pytest.approx(c.estimate + c.k * c.u)
        assert c.interval[1] - c.estimate > c.estimate - c.interval[0]
    assert r.result["bias rocking"].dof < 20.0 < r.result["tilt rocking"].dof


@pytest.mark.long
def test_the_linear_filter_is_consistent_at_small_angles_only() -> None:
    small, large = (made("kalman", phases=CALM, rocking=x) for x in ("1deg", "20deg"))
    assert abs(small.result["NEES"].estimate - 1.0) < 4.0 * small.result["NEES"].u
    assert large.result["NEES"].estimate > 1000.0
    assert large.result["tilt rocking"].estimate > 30.0 * small.result["tilt rocking"].estimate
    assert any("NEES" in w and "understates" in w for w in large.result.warnings)


@pytest.mark.long
def test_drift_is_found() -> None:
    """5 deg/h before, some 2 deg/h after 7 minutes, as the filter states."""
    r = made(phases=CALM)
    channels = r.record.channels
    truth = reduction().true_bias(channels)
    assert 2.0 < np.sqrt(np.mean(truth**2)) * 206264.8 < 10.0
    assert r.result["bias rocking"].estimate < 3.0
    stated = math.sqrt(channels["estimator.covariance[4,4]"][-1]) * 206264.8
    assert 0.5 < stated < 3.0


@pytest.mark.long
def test_a_slow_acceleration_separates_the_filters() -> None:
    """0.05 g lean the vertical by 2.86 deg: filters that weigh the noise take it over in seconds, the slow one not."""
    fast, slow = made(), made("complementary")
    lean = math.degrees(math.atan(0.05))
    assert by_phase(fast, "largest / °")["acceleration"] == pytest.approx(lean, rel=0.1)
    assert slow.result["tilt acceleration"].estimate < 0.8 * fast.result["tilt acceleration"].estimate
    assert slow.result["bias recovery"].estimate > 1.5 * fast.result["bias recovery"].estimate
    assert slow.result["tilt rocking"].estimate > 2.0 * fast.result["tilt rocking"].estimate
    assert by_phase(fast, "aided")["turn"] == 0.0 and by_phase(fast, "aided")["acceleration"] == 1.0
    slower = made("complementary", estimator__w_0=0.005)
    assert slower.result["tilt acceleration"].estimate < 0.5 * slow.result["tilt acceleration"].estimate


@pytest.mark.long
def test_an_acceleration_beyond_the_gate_leaves_the_attitude() -> None:
    r = made(phases="rest acceleration", acceleration=3.0)
    assert by_phase(r, "aided")["acceleration"] < 0.02
    assert r.result["tilt acceleration"].estimate < 0.05


@pytest.mark.long
def test_compensation_in_front() -> None:
    """Without it the filter takes static drift for bias, which turns with the vehicle: it is no longer consistent."""
    with_it, without = made(phases=CALM), made(phases=CALM, known=0.0)
    assert without.result["NEES"].estimate > 2.0
    assert without.result["bias rocking"].estimate > 1.5 * with_it.result["bias rocking"].estimate
    static = reduction().vectors(without.record.channels, "imu.static")
    assert np.abs(static).max() * 206264.8 > 10.0


@pytest.mark.long
def test_without_heading_its_drift_is_not_observable_and_said_so() -> None:
    """The stated variance of heading grows, that of the tilt does not, and both hold."""
    assert (
        "neither the heading nor the gyro bias" in load_system(NAME).with_values({"heading_period": 0.0}).warnings()[0]
    )
    r = made(phases="rest", heading_period=0.0, rest=600.0)
    c = r.record.channels
    # 1 deg at the start and 5 deg/h for 600 s: 1.30 deg; the Earth rate tells a little of it
    assert math.degrees(math.sqrt(c["estimator.covariance[3,3]"][-1])) == pytest.approx(1.29, abs=0.02)
    assert c["estimator.covariance[6,6]"][-1] > 0.9 * c["estimator.covariance[6,6]"][1]
    assert c["estimator.covariance[1,1]"][-1] < c["estimator.covariance[1,1]"][60]
    assert abs(r.result["NEES"].estimate - 1.0) < 4.0 * r.result["NEES"].u


@pytest.mark.long
def test_accelerometer_bias_shows_in_the_consistency() -> None:
    """1 mg: 0.057 deg of tilt, which the filter states as 0.004."""
    r = made(phases=CALM, imu__noise_x_acc_bias=0.02, imu__noise_y_acc_bias=0.02)
    assert r.result["NEES"].estimate > 3.0


def test_step_does_not_change_the_figures() -> None:
    fine = load_system(NAME)
    fine.step = 5e-3
    result = fine.reduce(run(fine, values={"phases": CALM}, seed=5))
    for name in ("NEES", "NIS"):
        assert abs(result[name].estimate - 1.0) < 4.0 * result[name].u


@pytest.mark.long
def test_sea_as_motion() -> None:
    test = gb.load(NAME, phases="rest", parts={"motion": "base_motion"}, rest=200.0)
    test.set("motion.preset", 2)
    r = test.run(seed=1)
    assert np.ptp(r.record.channels["motion.angle[2]"]) > 0.1
    assert r.result["tilt rest"].estimate < 0.1


def test_a_base_without_manoeuvres_is_asked_to_rest() -> None:
    with pytest.raises(InvalidConfigurationError, match="rocking: the part in the slot motion flies no manoeuvres"):
        run(load_system(NAME), {"motion": "base_motion"}, values={"phases": "rest rocking"})


@pytest.mark.long
def test_comparison_ranks_them() -> None:
    runs = [made(e) for e in ("mekf", "kalman", "complementary")]
    text = str(gb.compare(*runs, names=("mekf", "kalman", "complementary")))
    assert "attitude" in text


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"phases": "rest flight"}, "phases: 'flight' is none of rest, rocking"),
        ({"gate": 0.0}, "gate = 0 m/s2: must be > 0"),
        ({"period": 0.0}, "period = 0 s: must be > 0"),
    ],
)
def test_refused(values: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=words):
        run(load_system(NAME), values=values)
