"""Alignment of a gyro platform: errors come out with sign and size of the budget; what has no heading says so.

Expected values by hand from phi_z = d_E/N + tan(L) b_E/g (ALIGN-GYRO); the settling against a matrix exponential
written here.
"""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from gyrobench.engine.session import Session
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system

NAME = "platform_alignment"
W, DEG = 7.2921159e-5, math.pi / 180.0
DPH, ARCMIN, UG = DEG / 3600.0, DEG / 60.0, 9.80665e-6
LAT = 45.75 * DEG
N = W * math.cos(LAT)
SYSTEM = load_system(NAME)
plans: Any = importlib.import_module(".plans", type(SYSTEM).__module__)
planning: Any = importlib.import_module(".planning", type(SYSTEM).__module__)
QUIET = {n: 0.0 for n in SYSTEM.noises if not n.startswith("site.")}
FIXED = {"coarse_time": 40.0, "fast": 0.04, "fast_time": 60.0, "slow": 0.02, "wanted": 1e-6, "time": 450.0}


@pytest.fixture(scope="module")
def aligned(session: Any) -> Any:
    """One noisy alignment at default values: (record, result)."""
    record = session.run({}, seed=3)
    return record, SYSTEM.reduce(record)


def finished(session: Any, **values: Any) -> tuple[Any, Any]:
    record = session.run({**QUIET, **FIXED, **values}, seed=1, step=2e-3)
    return record, SYSTEM.with_values(values).reduce(record)


def error(record: Any, at: int = -1) -> float:
    """Heading as computed less true, rad; level gimbals: the axis y points to -azimuth."""
    true = -float(record.channels["platform.theta[3]"][at])
    return math.remainder(float(record.channels["controller.heading"][at]) - true, 2.0 * math.pi)


# --------------------------------------------------------------------------------------- the budget
CASES: dict[str, tuple[dict[str, Any], str, float, float]] = {
    "east drift": ({"controller.drift[1]": -0.05 * DPH}, "constant drift along x", 0.05 * DPH / N, 0.02),
    "accelerometer along x": ({"accelerometers.bias": [300 * UG, 0.0, 0.0]}, "accelerometer bias along x",
                              math.tan(LAT) * 3e-4 * 9.80665 / 9.80687, 0.02),
    "accelerometer along y": ({"accelerometers.bias": [0.0, 300 * UG, 0.0]}, "accelerometer bias along y", 0.0, 0.0),
    "azimuth drift": ({"controller.drift[3]": -0.05 * DPH}, "constant drift along z", 0.0, 0.0),
}  # fmt: skip


@pytest.fixture(scope="module")
def clean(session: Any) -> tuple[Any, Any]:
    return finished(session)


def test_without_errors_the_heading_is_right(clean: Any) -> None:
    record, result = clean
    assert abs(error(record)) < 0.15 * ARCMIN
    assert abs(result["tilt_x"].truth) < 0.2 and abs(result["tilt_y"].truth) < 0.2  # arcsec


@pytest.mark.parametrize("name", CASES)
@pytest.mark.long
def test_a_simulated_error_has_the_sign_and_size_of_its_budget_line(session: Any, clean: Any, name: str) -> None:
    """A known drift that is too small by d leaves the drift d.  Zero: below 2 % of what d/N would be."""
    values, source, expected, part = CASES[name]
    known = clean[0].run.parameters["controller.drift"]
    values = {k: v + (known[int(k[-2]) - 1] if k.startswith("controller.drift") else 0.0) if isinstance(v, float) else v
              for k, v in values.items()}  # fmt: skip
    record, result = finished(session, **values)
    found = error(record) - error(clean[0])
    assert found == pytest.approx(expected, rel=part, abs=0.3 * ARCMIN)
    line = next((b for b in result.budget if b.source == source), None)
    assert line is not None
    size = {"°/h": 0.05, "µg": 300.0}[line.size_unit]
    assert line.sensitivity * size == pytest.approx(expected / DEG, rel=0.03, abs=0.005)


@pytest.mark.long
def test_a_wrong_latitude_moves_order_two_and_not_order_three(session: Any, clean: Any) -> None:
    """U torqued too large by u leaves d_z = u; order 2, its gains over N as believed: 2 z u/w times that over N."""
    e, w = 3.0 * DEG, 0.04
    both = {"controller.latitude": LAT + e, "slow": w, "heading": 0.0}  # no turn
    three = error(finished(session, **both)[0]) - error(clean[0])
    two = error(finished(session, order=2, **both)[0]) - error(finished(session, order=2, slow=w)[0])
    assert abs(three) < 0.1 * ARCMIN
    u, ratio = W * (math.sin(LAT + e) - math.sin(LAT)), math.cos(LAT + e) / math.cos(LAT)
    assert two == pytest.approx(math.sqrt(2.0) * u / w * ratio, rel=0.02)  # 0.30 arcmin


@pytest.mark.long
def test_base_motion_adds_little_to_a_platform_that_holds_still(session: Any, clean: Any) -> None:
    """Bus: 0.01 m/s2 about 5 Hz, whose mean is 0; the gains that rise slowly keep it out: a fifth of sigma at most."""
    system = load_system(NAME)
    system.set("base", "bus")
    with Session(system) as moving:
        record = moving.run({**QUIET, **FIXED, "base": "bus"}, seed=1, step=2e-3)
    moved = error(record) - error(clean[0])
    assert 1e-6 < abs(moved) < 1.0 * ARCMIN
    assert abs(np.ptp(record.channels["controller.tilt[1]"][-100:])) > 5.0 * np.ptp(
        clean[0].channels["controller.tilt[1]"][-100:]
    )
    # place of the oscillator of 5 Hz: 0.01/(10 pi) m/s, correlated by 0.15 from one period of 0.2 s to the next
    fall, q = 3.0 * math.pi, 10.0 * math.pi * math.sqrt(1.0 - 0.3**2)
    later = sum(math.exp(-fall * t) * (math.cos(q * t) + fall / q * math.sin(q * t)) for t in (0.2, 0.4, 0.6, 0.8))
    told = record.run.parameters["controller.errors_vibration"]
    assert told == pytest.approx(0.01 / (10.0 * math.pi) * math.sqrt(1.0 + 2.0 * later), rel=1e-3)
    coarse = int(np.argmax(np.asarray(record.channels["controller.mode"]) == 5.0))
    of_base = [np.asarray(r.channels["controller.sigma"])[coarse] for r in (record, clean[0])]
    assert math.sqrt(of_base[0] ** 2 - of_base[1] ** 2) > 2.0 * ARCMIN  # window of 40 s
    (line,) = (b for b in SYSTEM.reduce(record).budget if b.source == "vibration of the base")
    assert line.size == pytest.approx(1e3 * told) and line.contribution * 60.0 < 2.0


@pytest.mark.long
def test_two_positions_leave_the_drift_out(session: Any, clean: Any) -> None:
    """0.05 deg/h along x is 16 arcmin in one position."""
    known = clean[0].run.parameters["controller.drift"][0]
    record, result = finished(session, **{"controller.drift[1]": known - 0.05 * DPH}, positions=2, time=600.0)
    assert abs(error(record)) < 0.5 * ARCMIN
    (line,) = (b for b in result.budget if b.source == "constant drift along x")
    assert abs(line.sensitivity) < 0.08  # deg per deg/h; 5.5 in one position


# ------------------------------------------------------------------------------------------ settling
@pytest.mark.long
def test_settling_of_the_platform_is_that_of_the_loop(session: Any, clean: Any) -> None:
    """A drift, by expm of (phi_x, phi_z, y, integral) over the same 45 s of gyrocompass: order 3, w = 0.04."""
    known = clean[0].run.parameters["controller.drift"][0]
    d = 0.05 * DPH
    record, _ = finished(session, **{"controller.drift[1]": known - d}, heading=0.0)
    quiet, _ = finished(session, heading=0.0)
    mode = np.asarray(record.channels["controller.mode"])
    i = int(np.argmax(mode == 6.0)) + 10  # the gains have risen
    j = i + 45
    z, w = math.sqrt(0.5), 0.04
    k1, k2, k3 = (1 + 2 * z) * w, (1 + 2 * z) * w * w, w**3
    A = np.array([[-k1, -N, 0, 0], [N, 0, k2 / N, 1], [10 * w, 0, -10 * w, 0], [k3 / N, 0, 0, 0]])

    def state(r: Any, at: int) -> np.ndarray:
        """phi_x from the pitch gimbal; y, the smoothed tilt, as good as phi_x."""
        phi = float(r.channels["platform.theta[1]"][at])
        return np.array([phi, error(r, at), phi, float(r.channels["controller.correction[3]"][at])])

    start = state(record, i) - state(quiet, i)
    both = np.block([[A, np.array([[d], [0], [0], [0]])], [np.zeros((1, 5))]])
    end = expm(both * 45.0) @ np.append(start, 1.0)
    found = state(record, j) - state(quiet, j)
    assert abs(start[1] - d / N) < 0.05 * d / N  # the coarse heading has it already
    assert found[1] == pytest.approx(end[1], rel=0.05)


# --------------------------------------------------------------------------------- result and report
def test_result_of_an_alignment(aligned: Any) -> None:
    record, result = aligned
    psi, coarse, ready = result["ψ"], result["ψ_coarse"], result["ready time"]
    assert psi.u * 60.0 <= 5.0 and psi.u < coarse.u and abs(psi.z) < 3.5 and abs(coarse.z) < 3.5
    assert (
        ready.estimate == pytest.approx(ready.closed, rel=0.15) and record.channels["time"][-1] > ready.estimate + 100.0
    )
    total = math.sqrt(sum(b.contribution**2 for b in result.budget))
    assert total == pytest.approx(psi.u, rel=0.12)
    largest = {b.source for b in result.budget[:2]}
    assert largest == {"constant drift along x", "accelerometer noise"}
    (table,) = (t for t in result.tables if t.kind == "ready_times")
    times = [row[1] for row in table.rows if row[1] is not None]
    assert times == sorted(times) and len(set(times)) >= 2
    assert [r.name for r in result.responses] == ["heading error", "tilt", "ready time"]
    assert result.verdict == "no specification given" and not result.warnings


def test_a_heading_that_is_not_ready_has_no_ready_time(session: Any, clean: Any) -> None:
    result = clean[1]
    assert result["ready time"].no_value.startswith("not ready: standard deviation") and result["ψ"].no_value == ""
    short = SYSTEM.reduce(session.run({**QUIET, **FIXED, "time": 100.0}, seed=1, step=2e-3))
    assert all(c.verdict == "void" and math.isnan(c.estimate) for c in short.coefficients)
    assert "never came to the gyrocompass" in short.summary[0]


def test_a_latitude_that_the_rates_contradict_voids_the_result(session: Any) -> None:
    record, result = finished(session, **{"controller.latitude": LAT + 3.0 * DEG})
    assert record.channels["controller.status"][-1] == 2.0
    assert all(c.verdict == "void" for c in result.coefficients) and "contradict" in result["ψ"].no_value


def test_an_unstable_platform_has_no_heading(session: Any) -> None:
    """A stabilizer with far too much gain: a limit cycle at the motor's limit, in which the tilt looks level."""
    _, result = finished(session, **{"pitch.K": 3e4})
    assert all(c.verdict == "void" for c in result.coefficients)


def test_an_error_that_the_controller_is_not_told_of_withholds_the_verdict(session: Any, clean: Any) -> None:
    known = clean[0].run.parameters["controller.drift"][0]
    values = {**QUIET, **FIXED, "controller.drift[1]": known - 0.3 * DPH, "slow": 0.01}
    record = session.run(values, seed=1, step=2e-3)
    result = SYSTEM.reduce(record, {"ψ": (-1.0, 1.0)})
    assert result["ψ"].verdict in ("inconclusive", "void") and result.warnings


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"latitude": 86.0 * DEG}, "no gyrocompass"),
        ({"grade": "gold"}, "precise, navigation, tactical"),
        ({"base": "moon"}, "must be one of rest, bus"),
        ({"fast": 0.01, "slow": 0.02}, "must be at most fast"),
        ({"crossover": 15.0, "step": 1e-3}, ""),
    ],
)
def test_refused(values: dict[str, Any], words: str) -> None:
    system = load_system(NAME)
    if not words:
        system.step = 5e-3
        words = "wants a crossover up to"
    for name, value in values.items():
        if name != "step":
            system.set(name, value)
    with pytest.raises(InvalidConfigurationError, match=words):
        system.refuse()


def test_what_is_not_expected_is_told_before_the_run() -> None:
    """One position: the east drift alone leaves 0.01 deg/h / N = 3.3 arcmin."""
    system = load_system(NAME)
    system.set("wanted", "2arcmin")
    (text,) = system.warnings()
    assert "3.28′ of it by constant drift along x" in text
    system.set("positions", 2)
    assert not system.warnings()


# ------------------------------------------------------------------------------------------- settings
@pytest.mark.parametrize("latitude", [0.0, 70.0])
@pytest.mark.parametrize("grade", ["precise", "navigation", "tactical"])
@pytest.mark.parametrize("positions", [1, 2])
@pytest.mark.long
def test_a_looser_heading_is_never_ready_later(latitude: float, grade: str, positions: int) -> None:
    """Predicted times over a grid of wanted standard deviations; two positions were later by up to four minutes."""
    sensors = plans.GRADES[grade]
    given = plans.Settings(latitude * DEG, positions=positions, coarse_time=0.0, fast_frequency=0.0, fast_time=-1.0,
                           slow_frequency=0.0)  # fmt: skip
    times = []
    for wanted in np.geomspace(0.7, 80.0, 10) * ARCMIN:
        settings = planning.designed(given, sensors, float(wanted), 1.0, 700.0)
        ready = planning.ready_after(*planning.predicted(settings, sensors, 1.0, 700.0), float(wanted))
        times.append(math.inf if ready is None else ready)
    assert times == sorted(times, reverse=True) and math.isfinite(times[-1])


@pytest.mark.parametrize("order", [2, 3])
def test_what_constant_errors_leave_in_the_end_is_that_of_the_error_model(order: int) -> None:
    """README: d_x/N + tan(L) b_x/g + (order 2) 2 zeta d_z/w; half a turn takes nearly all of it out."""
    quiet = plans.Sensors(0.02 * DPH, 0.0, 0.0, 50.0 * UG, 0.0)
    one = plans.Settings(LAT, order=order, fast_frequency=0.03, slow_frequency=0.02)
    end = float(plans.history(one, 0.5, 3000.0).sigma(one, quiet)[-1, 2])
    assert end == pytest.approx(planning.lasting(one, quiet), rel=0.02)
    two = plans.Settings(LAT, positions=2, order=order, fast_frequency=0.03, slow_frequency=0.02)
    assert plans.history(two, 0.5, 3000.0).sigma(two, quiet)[-1, 2] < 0.01 * end and planning.lasting(two, quiet) == 0.0


def test_what_is_given_is_kept_and_what_is_not_is_worth_it() -> None:
    """Of the settings that are tried none is ready sooner; given ones stand in all of them."""
    sensors = plans.GRADES["navigation"]
    given = plans.Settings(LAT, positions=2, coarse_time=90.0, fast_frequency=0.0, fast_time=0.0, slow_frequency=0.0)
    every = planning.prepared(given, sensors)
    assert len(every) > 20 and {(c.coarse_time, c.fast_time) for c in every} == {(90.0, 0.0)}
    times = []
    for settings in every:
        h, sigma = planning.predicted(settings, sensors, 1.0, 900.0)
        ready = planning.ready_after(h, sigma, 3.0 * ARCMIN)
        times.append(math.inf if ready is None else ready)
        first = h.t[np.argmax(h.usable)]
        assert planning.begin(settings, 1.0) == pytest.approx(first, abs=0.2 / settings.fast_frequency)
    chosen = planning.designed(given, sensors, 3.0 * ARCMIN, 1.0, 900.0)
    assert times[every.index(chosen)] == min(times) < max(times)
