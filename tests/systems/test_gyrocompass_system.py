"""Gyrocompass in the co-simulation: periods, damping, settling, errors against formulas by hand and by scipy."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
import pytest
from scipy import integrate

from gyrobench.engine.session import run
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system

NAME = "gyrocompass"
oscillation = importlib.import_module(type(load_system(NAME)).__module__ + ".oscillation")
DEG, G0, W, R = math.pi / 180.0, 9.80665, 7.2921159e-5, 6.371e6
NORTH, UP = W * math.cos(40 * DEG), W * math.sin(40 * DEG)
K = G0 / (R * NORTH)  # mgl/H by Schuler's condition
OMEGA = math.sqrt((K + NORTH) * NORTH)
SPEED = math.atan2(10.0, R * NORTH) / DEG  # 1.61 degrees at 10 m/s north
QUIET = {"noise": 0.0, "random_drift": 0.0}


def reduced(seed: int = 1, specification: Any = None, **values: Any) -> Any:
    system = load_system(NAME)
    for name, value in values.items():
        system.set(name, value)
    return system.reduce(run(system, seed=seed), specification)


@pytest.fixture(scope="module")
def quiet() -> Any:
    return reduced(**QUIET)


@pytest.fixture(scope="module")
def liquid() -> Any:
    return reduced(damping="horizontal", phases="settling speed", settle="9h", **QUIET)


def near(result: Any, name: str, value: float, off: float, closed: float = 0.0) -> None:
    """The estimate, and the closed form of the report (to ``closed``, else to ``off``), are the value."""
    assert result[name].estimate == pytest.approx(value, abs=off), name
    assert result[name].closed == pytest.approx(value, abs=closed or off), name


@pytest.mark.long
def test_periods_and_damping(quiet: Any) -> None:
    """Without damping 84.32 min, longer by a2/16 at the swing a = 4.4 degrees; damped with 0.33: over sqrt(1 - 0.33^2).

    Schuler's 2 pi sqrt(R/g) = 84.41 min is that of a compass without w_N beside mgl/H: 1 - w_N^2 R/g = 0.99798.
    """
    assert 2.0 * math.pi / OMEGA / 60.0 == pytest.approx(84.32, abs=0.005)
    period = 2.0 * math.pi / OMEGA / 60.0
    assert quiet["period"].closed == pytest.approx(period, rel=1e-6)
    assert quiet["period"].estimate == pytest.approx(period * (1.0 + (4.4 * DEG) ** 2 / 16.0), rel=5e-5)
    near(quiet, "damped period", period / math.sqrt(1.0 - 0.33**2), 0.05)
    near(quiet, "damping ratio", 0.33, 2e-4)
    assert quiet["Schuler ratio"].closed == pytest.approx(1.0 / (1.0 + NORTH**2 * R / G0), rel=1e-9)


@pytest.mark.long
def test_latitude_error(quiet: Any, liquid: Any) -> None:
    """sin = -(D/mgl) tan L with D/H = 2 0.33 Omega, w_N beside mgl/H: -1.43 degrees; by a horizontal torque none."""
    error = -math.asin(2.0 * 0.33 * OMEGA * math.tan(40 * DEG) / (K + NORTH)) / DEG
    assert error == pytest.approx(-1.427, abs=1e-3)
    near(quiet, "latitude error", error, 2e-4)
    near(liquid, "latitude error", 0.0, 2e-4)


@pytest.mark.long
def test_liquid_damps_as_its_cubic(liquid: Any) -> None:
    """z^3 + z^2 + z + 1 - b = 0 with the pair z at the damping ratio 0.33; its damped period is 2 pi/(Omega Im z)."""
    y = liquid["damping ratio"].estimate
    assert y == pytest.approx(0.33, abs=3e-4)
    # z = u (-0.33 + j sqrt(1 - 0.33^2)) in the cubic: the imaginary part gives u
    c, s = -0.33, math.sqrt(1.0 - 0.33**2)
    u = max(np.roots([s * (3.0 * c * c - s * s), 2.0 * c * s, s]).real)
    near(liquid, "damped period", 2.0 * math.pi / (OMEGA * u * s) / 60.0, 0.05)


def test_settling_time_is_that_of_the_equations_in_angles() -> None:
    """From 120 degrees off, scipy in azimuth and tilt without small angles."""
    found = reduced(offset=120 * DEG, phases="settling", **QUIET)
    D = 2.0 * 0.33 * OMEGA

    def flow(_: float, y: Any) -> list[float]:
        az, el = y
        east = -K * math.sin(el) - NORTH * math.cos(az) * math.sin(el) + UP * math.cos(el)
        return [east / math.cos(el), NORTH * math.sin(az) - D * math.sin(el)]

    t = np.linspace(0.0, 19500.0, 19501)
    az = integrate.solve_ivp(flow, (0.0, 19500.0), [120 * DEG, 0.0], t_eval=t, rtol=1e-9, atol=1e-12).y[0]
    rest = math.asin(D * UP / (K + NORTH) / NORTH)
    last = t[np.flatnonzero(np.abs(az - rest) > DEG)[-1]] / 3600.0
    assert found["settling time"].estimate == pytest.approx(last, abs=2e-3)
    assert found["settling time"].closed == pytest.approx(last, abs=5e-3)  # small tilts
    assert any("beyond 30° it does not swing as a linear" in w for w in found.warnings)


@pytest.mark.long
def test_speed_error_is_tan_formula(quiet: Any, liquid: Any) -> None:
    """North at 10 m/s: 1.61 degrees; then 135 degrees: tan = V cos psi/(R w cos L + V sin psi).

    Beside it the latitude error in w_N + V_E/R and the element's swing under the Coriolis force, 0.005 degrees.
    """
    near(liquid, "speed error", SPEED, 0.006)
    near(quiet, "speed error", SPEED, 0.006)
    away = math.atan2(10.0 * math.cos(135 * DEG), R * NORTH + 10.0 * math.sin(135 * DEG)) / DEG
    near(quiet, "turn error", away - SPEED, 0.03, 2e-3 + 0.03)
    assert quiet["turn error"].estimate == pytest.approx(quiet["turn error"].closed, abs=5e-4)


@pytest.mark.long
def test_ballistic_deflection_and_schulers_condition(quiet: Any, liquid: Any) -> None:
    """(mgl/H) V/g moves the heading; by Schuler's condition that is the speed error, so that nothing is left.

    Tuned to 60 min it is more by (84.3/60)^2, over 300 s by sin(x)/x of x = Omega 300 s of what is left.
    """
    near(liquid, "ballistic deflection", K * 10.0 / G0 / DEG, 0.01)
    near(liquid, "ballistic error", 0.0, 0.01)
    assert quiet["ballistic error in the turn"].estimate == pytest.approx(
        quiet["ballistic error in the turn"].closed, abs=3e-3
    )
    short = reduced(damping="horizontal", period=3600.0, phases="settling speed", settle="9h", **QUIET)
    k = (2.0 * math.pi / 3600.0) ** 2 / NORTH - NORTH
    x = 300.0 * math.sqrt((k + NORTH) * NORTH)
    left = (k * 10.0 / G0 - 10.0 / (R * NORTH)) / DEG * math.sin(x) / x
    assert left > 1.5 and short["ballistic error"].estimate == pytest.approx(left, rel=0.01)


@pytest.mark.long
def test_damping_that_stays_on_adds_to_the_deflection(quiet: Any) -> None:
    """D turns the tilt under 10/300 m/s2 into az'' = -w_N D a/(H g), and keeps the latitude error, lost in the cut."""
    on = reduced(cut=False, phases="settling speed", settle="8h", **QUIET)
    assert on["ballistic error"].estimate == pytest.approx(on["ballistic error"].closed, abs=3e-3)
    D, a = 2.0 * 0.33 * OMEGA, 10.0 / 300.0 / G0
    # el falls behind by D a t/H, so that az' grows by K D a t: K D a t^2/2
    assert on["ballistic error"].estimate == pytest.approx(-K * D * a * 300.0**2 / 2.0 / DEG, rel=0.15)
    assert quiet["ballistic error"].estimate > 0.09 > 0.0 > on["ballistic error"].estimate


@pytest.mark.long
def test_rolling_between_the_quarters(quiet: Any) -> None:
    """-(mgl/H w_N)(1 + e2) <a_N s>/g, e = D/mgl, course 135 less the axis' azimuth; none on the cardinal courses."""
    a = 10.0 * 10 * DEG * (1.0 - (10 * DEG) ** 2 / 8.0) * (0.2 * math.pi) ** 2 / G0
    w, n = 0.2 * math.pi, 2.0 * math.pi / 60.0
    swing = (n * n / (n * n - w * w + 0.4j * n * w)).real  # in phase, of a/g
    e = 2.0 * 0.33 * OMEGA / K
    azimuth = 3.5 * DEG
    north = NORTH + 10.0 * math.sin(135 * DEG) / R
    moved = K / north * (1.0 + e * e) * 0.25 * a * a * swing * math.sin(2.0 * (135 * DEG - azimuth)) / DEG
    near(quiet, "rolling error", -moved, 3e-3)
    cardinal = reduced(damping="horizontal", phases="settling rolling", course=90 * DEG, **QUIET)
    assert abs(cardinal["rolling error"].estimate) < 1e-3


@pytest.mark.long
def test_correctors_take_away_what_they_can() -> None:
    """What is left of the speed is the swing under the Coriolis force; of the ballistic error nothing is taken."""
    found = reduced(latitude_correction=True, speed_correction=True, phases="settling speed", settle="8h",
                    **QUIET)  # fmt: skip
    assert abs(found["latitude error"].estimate) < 5e-4 and abs(found["speed error"].estimate) < 6e-3
    assert found["ballistic error"].estimate == pytest.approx(found["ballistic error"].closed, abs=3e-3)


@pytest.mark.parametrize("seed", [3, 4])
@pytest.mark.long
def test_noise_stays_within_the_intervals(seed: int) -> None:
    """Reading noise ten times, drift fifty times the default: every measure within 3.3 u, u not too large."""
    found = reduced(seed, phases="settling speed", noise="0.1deg/sqrt(Hz)", random_drift="0.01deg/sqrt(h)")
    for c in found.coefficients:
        assert abs(c.estimate - c.closed) < 3.3 * c.u, c.name
    assert 0.005 < found["latitude error"].u < 0.1 and found["damping ratio"].u < 0.03


@pytest.mark.long
def test_fit_covers_with_drift_in_the_signal() -> None:
    """24 synthetic records of a swing under drift in tilt and noise: the errors are as large as u says.

    Exact steps of 20 s: az' = -k el + n_az, el' = w_N az - d el + n_el.
    """
    rng, d = np.random.default_rng(5), 2.0 * 0.33 * OMEGA
    A = np.array([[0.0, -K], [NORTH, -d]])
    F = np.eye(2) + 20.0 * A + 200.0 * A @ A + 8000.0 / 6.0 * A @ A @ A
    poles = np.array([0.3 * OMEGA, 1.05 * OMEGA])
    z = []
    for _ in range(24):
        x, y = np.array([3 * DEG, 0.0]), []
        for _ in range(960):
            x = F @ x + rng.normal(size=2) * 1e-6 * math.sqrt(20.0)
            y.append(x[0] + 1e-4 * rng.normal())
        found = oscillation.fit(120.0 * np.arange(160), np.mean(np.reshape(y, (160, 6)), axis=1), poles)
        z.append([(found.settled) / found.u_settled, (found.period[0] - 2.0 * math.pi / OMEGA) / found.period[1]])
    assert np.all(np.abs(np.mean(z, axis=0)) < 0.65)
    assert np.all((np.std(z, axis=0) > 0.5) & (np.std(z, axis=0) < 1.5))  # 24: 14 %


def test_unsettled_is_void() -> None:
    found = reduced(phases="settling speed", settle="1h", **QUIET)
    assert found.verdict == "void"
    for name in ("settling time", "latitude error", "speed error", "ballistic error", "damped period"):
        assert math.isnan(found[name].estimate) and found[name].no_value, name
    assert any("Give settle more time" in w for w in found.warnings)


def test_a_swing_before_a_manoeuvre_spoils_the_deflection() -> None:
    found = reduced(phases="settling speed", settle="2.2h", **QUIET)
    assert "the axis swung by 0." in found["ballistic deflection"].no_value
    assert found["speed error"].estimate == pytest.approx(SPEED, abs=0.02)


@pytest.mark.long
def test_far_from_the_meridian_nothing_is_passed() -> None:
    """80 degrees, 25 m/s: 17 degrees of speed error; closed forms of small angles, the verdict is withheld."""
    found = reduced(phases="settling speed", latitude=80 * DEG, speed=25.0, specification={"speed error": (0.0, 90.0)})
    assert found["speed error"].estimate == pytest.approx(math.atan2(25.0, R * W * math.cos(80 * DEG)) / DEG, abs=0.5)
    assert found["speed error"].verdict == "inconclusive"
    assert any("horizontal Earth rate is 0.17" in w for w in found.warnings)
    assert any("off the meridian" in w for w in found.warnings)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"latitude": 86 * DEG}, "beyond 85"),
        ({"phases": "settling dive"}, "'dive' is none of"),
        ({"damping": "oil"}, "must be one of vertical, horizontal, none"),
        ({"damping": "none"}, "begin with a settled compass"),
        ({"damping": "horizontal", "damping_ratio": 0.6}, "0.45 at most"),
        ({"period": "50h"}, "without pendulum"),
        ({"turn": 0.0}, "must have a rate"),
    ],
)
def test_refused(values: dict[str, Any], words: str) -> None:
    system = load_system(NAME)
    for name, value in values.items():
        system.set(name, value)
    with pytest.raises(InvalidConfigurationError, match=words):
        system.refuse()
