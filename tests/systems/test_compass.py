"""Gyro-magnetic compass: complementary filter, error at rest, turn, disturbed field, against formulas by hand."""

from __future__ import annotations

import importlib
import math
import sys
from typing import Any

import numpy as np
import pytest
from scipy import integrate, optimize

from gyrobench.engine.session import Session
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system

NAME = "gyro_magnetic_compass"
field = importlib.import_module(type(load_system(NAME)).__module__ + ".field")
DEG = math.pi / 180.0
QUIET = {"noise": 0.0, "random_drift": 0.0}


def reduced(phases: tuple[str, ...] = (), **values: Any) -> Any:
    """Result of a run, of these phases alone where some are named."""
    (result,) = each(phases, 1, **values)
    return result


def each(phases: tuple[str, ...], runs: int, **values: Any) -> list[Any]:
    """Results of runs with the seeds 1, 2, ..."""
    system = load_system(NAME)
    for name, value in values.items():
        system.set(name, value)
    if phases:
        plan = [p for p in system.phases() if p.label.startswith(phases) or p.label == "turn"]
        system.phases = lambda: plan  # type: ignore[method-assign]
    with Session(system) as session:
        return [system.reduce(session.run(seed=seed)) for seed in range(1, runs + 1)]


@pytest.fixture(scope="module")
def quiet() -> Any:
    return reduced(**QUIET)


def curve(result: Any, name: str) -> tuple[Any, Any]:
    (r,) = [r for r in result.responses if r.name == name]
    return np.array(r.x), np.array(r.y) * np.exp(1j * np.radians(r.phase))


@pytest.mark.long
def test_the_two_filters_are_complementary(quiet: Any) -> None:
    """Measured k/(s + k) of the magnetic heading and s times 1/(s + k) of the drift: their sum is 1 (a step: 0.1 %)."""
    f, magnetic = curve(quiet, "magnetic path")
    f_gyro, drift = curve(quiet, "gyro path")
    s, k = 2j * math.pi * f, 1.0 / 60.0
    assert f == pytest.approx(f_gyro) and f.min() < k / (2.0 * math.pi) < f.max()
    assert np.abs(magnetic - k / (s + k)).max() < 3e-3
    assert np.abs(magnetic + s * drift - 1.0).max() < 3e-3
    (r,) = [r for r in quiet.responses if r.name == "magnetic path"]
    assert any("linear" in c.label for c in r.curves)


@pytest.mark.long
def test_cut_off_is_k_over_two_pi_measured_and_computed(quiet: Any) -> None:
    f_c = quiet["f_c slaving"]
    assert f_c.estimate == pytest.approx(1.0 / (120.0 * math.pi), rel=1e-3)
    assert f_c.closed == pytest.approx(1.0 / (120.0 * math.pi), rel=1e-3)
    assert quiet["PM slaving"].estimate == pytest.approx(90.0, abs=0.2)
    assert quiet["time constant"].estimate == pytest.approx(60.0, rel=2e-3)  # half a step of 0.1 s


@pytest.mark.long
def test_time_constant_under_noise() -> None:
    """The noise of the heading decays as the step does, so that its samples are no independent ones: eight seeds."""
    found = [result["time constant"] for result in each(("alignment",), 8)]
    z = np.array([(c.estimate - 60.0) / c.u for c in found])
    assert 0.4 < math.sqrt(np.mean(z**2)) < 1.75 and abs(np.mean(z)) < 1.2  # 3.3 standard deviations
    assert all(0.3 < c.u < 4.0 for c in found)


@pytest.mark.long
def test_drift_at_rest_leaves_the_drift_over_k(quiet: Any) -> None:
    """5 deg/h times 60 s: 0.0833 degrees; without correction 5 - 9.667 deg/h: -0.0778."""
    assert quiet["error at rest"].estimate == pytest.approx(5.0 / 60.0, rel=1e-4)
    free = reduced(("rest",), corrected=0, **QUIET)["error at rest"]
    expected = (5.0 - 7.2921159e-5 * math.sin(40 * DEG) / DEG * 3600.0) / 60.0
    assert free.estimate == pytest.approx(expected, rel=1e-3) and free.closed == pytest.approx(expected, rel=1e-9)


@pytest.mark.long
def test_declination_makes_the_heading_true() -> None:
    values = {"declination": 10 * DEG, **QUIET}
    assert reduced(("rest",), **values)["error at rest"].estimate == pytest.approx(5.0 / 60.0, rel=1e-3)
    true = reduced(("rest",), true_heading=True, **values)["error at rest"]
    assert true.estimate == pytest.approx(5.0 / 60.0, rel=1e-3)


@pytest.mark.long
def test_error_in_the_turn_is_the_gyros_with_cut_off_and_the_limit_without(quiet: Any) -> None:
    """60 s: with cut-off 0.0833 + 5 deg/h 60 s = 0.1667 degrees.  Without, the limit of 2 deg/min follows the magnetic
    heading, whose error turns its sign half way: beyond 1 degree.
    """
    assert quiet["error in the turn"].estimate == pytest.approx(2.0 * 5.0 / 60.0, rel=2e-3)
    open_ = reduced(("after",), cut_off=0, **QUIET)
    assert open_["error in the turn"].estimate > 0.8 > 0.3 > quiet["error after the turn"].estimate


@pytest.mark.long
def test_magnetic_error_in_the_turn_is_that_of_the_tilted_plane(quiet: Any) -> None:
    """Tilted by delta = atan(v w / g): B.x' = -sin psi cos delta + tan I sin delta, B.y' = cos psi, over all psi."""
    delta = math.atan(50.0 * 3 * DEG / 9.80665)

    def off(psi: float) -> float:
        x = -math.sin(psi) * math.cos(delta) + math.tan(1.0472) * math.sin(delta)
        return -abs((math.atan2(-x, math.cos(psi)) - psi + math.pi) % (2.0 * math.pi) - math.pi)

    best = min(optimize.minimize_scalar(off, bounds=b, method="bounded").fun for b in ((0.0, 1.5), (1.5, 3.1)))
    assert quiet["magnetic error in the turn"].estimate == pytest.approx(-best / DEG, rel=0.01)


@pytest.mark.long
def test_a_disturbed_field_moves_it_by_the_limit_or_the_filter(quiet: Any) -> None:
    """10 degrees for 60 s: 2 deg/min and 5 deg/h make 2.083 degrees; 1 degree: 1 - 1/e of it.  scipy: the whole law."""
    found = quiet["error in the disturbed field"]
    assert found.estimate == pytest.approx(2.0833, rel=3e-3) and found.closed == pytest.approx(2.0833, rel=1e-3)
    small = reduced(("field",), field_step=1 * DEG, **QUIET)["error in the disturbed field"]
    assert small.estimate == pytest.approx(1.0 - math.exp(-1.0), rel=3e-3) and small.closed is not None
    limit, w = 2.0 / 60.0, 5.0 / 3600.0

    def flow(_: float, e: Any) -> Any:
        return w + np.clip((3.5 - e) / 60.0, -limit, limit)

    law = integrate.solve_ivp(flow, (0.0, 60.0), [w * 60.0], max_step=0.1).y[0, -1] - w * 60.0
    middle = reduced(("field",), field_step=3.5 * DEG, **QUIET)["error in the disturbed field"]
    assert middle.estimate == pytest.approx(law, rel=3e-3) and middle.closed is None


@pytest.mark.long
def test_random_heading_noise_is_that_of_the_two_filters() -> None:
    """White noise S of the magnetic heading: var S2 k/2; random walk N: N2/(2k).  Four times 1440 s: 48 independent."""
    noise, walk, k = 0.1 * DEG, 0.1 * DEG / 60.0, 1.0 / 60.0
    expected = math.sqrt(noise**2 * k / 2.0 + walk**2 / (2.0 * k)) / DEG
    squares = [result["heading noise"].estimate ** 2 for result in each(("rest",), 4)]
    assert math.sqrt(np.mean(squares)) == pytest.approx(expected, rel=0.25)  # 10 % of the rms


@pytest.mark.parametrize(
    ("date", "latitude", "longitude", "height", "D", "inclination", "H"),
    [
        ("2020-01-01", 80, 0, 0, -1.28, 83.14, 6572.0),
        ("2020-01-01", 0, 120, 100e3, 0.16, -15.55, 37636.9),
        ("2022-07-02", -80, -120, 0, 69.13, -72.09, 16885.0),
    ],
)
def test_field_of_a_day_is_the_world_magnetic_models(
    date: str, latitude: float, longitude: float, height: float, D: float, inclination: float, H: float
) -> None:
    """Test values that NOAA publishes with WMM2020 (the last one: of 2022.5)."""
    here = field.field_at(date, latitude * DEG, longitude * DEG, height)
    assert here.declination / DEG == pytest.approx(D, abs=0.006)
    assert here.inclination / DEG == pytest.approx(inclination, abs=0.006)
    assert here.horizontal * 1e9 == pytest.approx(H, abs=0.5) and here.model.endswith("2020")
    assert here.u_declination / DEG == pytest.approx(math.hypot(0.26, 5625.0 / H), rel=1e-3)


@pytest.mark.long
def test_date_and_site_give_the_sensor_its_field() -> None:
    """55.75 N, 37.6 E, 200 m: ppigrf with IGRF 14 has D 12.06, I 71.73 degrees, H 16.647 uT; the heading is true."""
    place = {"latitude": 55.75 * DEG, "longitude": 37.6 * DEG, "height": 200.0}
    values = {"date": "2026-07-02", "true_heading": True, **place, **QUIET}
    found = reduced(("rest",), **values)
    p = found.provenance["parameters"]
    assert p["sensor.declination"] / DEG == pytest.approx(12.06, abs=0.1)
    assert p["sensor.inclination"] / DEG == pytest.approx(71.73, abs=0.05)
    assert p["sensor.field"] == pytest.approx(16.647e-6, rel=2e-3)
    assert found["error at rest"].estimate == pytest.approx(5.0 / 60.0, rel=1e-3)
    (table,) = [t for t in found.tables if t.kind == "site.field"]
    assert "2025 on 2026-07-02" in table.caption and 0.3 < table.rows[0][2] < 0.5


def test_without_the_package_a_date_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    field.field_at.cache_clear()
    monkeypatch.setitem(sys.modules, "pygeomag", None)
    system = load_system(NAME)
    system.set("date", "2026-07-02")
    with pytest.raises(InvalidConfigurationError, match=r"pip install 'gyrobench\[magnetic\]'"):
        system.refuse()


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"true_heading": True}, "declination of the place is missing"),
        ({"latitude": 86 * DEG}, "beyond 85"),
        ({"date": "2026-02-30"}, "is not a day"),
        ({"date": "2031-01-01"}, "2015-01-01 to 2029-12-31"),
        ({"date": "2026-07-02", "declination": 0.1}, "give one of them"),
        ({"turn": 0.0}, "must have a rate"),
    ],
)
def test_refused(values: dict[str, Any], words: str) -> None:
    system = load_system(NAME)
    for name, value in values.items():
        system.set(name, value)
    with pytest.raises(InvalidConfigurationError, match=words):
        system.refuse()
