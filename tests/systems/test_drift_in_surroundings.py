"""Drift tests with temperature and magnetic field: the thermometer in the record, and what reductions make of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import servoing_two_axes
from servoing import DAY50, QUIET, polar_at_2_ms
from tumbling import DPH, NAMES, SHORT, load, quiet
from undiagnosed import reduce_undiagnosed

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.packaging import build
from gyrobench.record.record import Record
from gyrobench.result import DriftTestResult
from gyrobench.system.suite import Suite, load_test
from gyrobench.system.system import System, load_system

PER_KELVIN = 0.2 * DPH  # rad/s/K
FIELD = {"surroundings.field[3]": -44e-6, "gyro.D_B[1]": 2000.0 * DPH, "gyro.D_B[3]": -500.0 * DPH}


@pytest.fixture(scope="module")
def prepared() -> Iterator[Session]:
    system = load()
    system.request("surroundings")
    with Session(system) as session:
        yield session


@pytest.fixture(scope="module")
def ramp(prepared: Session) -> Record:
    """A tumble of 12 minutes in which the room warms by 20 K/h, and the gyro follows with 200 s."""
    values = {"surroundings.ramp": 20.0 / 3600.0, "surroundings.tau": 200.0, "gyro.D_T": PER_KELVIN}
    return prepared.run({**SHORT, **values}, seed=12)


def reduced(record: Record, **columns: Any) -> DriftTestResult:
    windows = {n: v for n, v in record.windows.items() if n in columns or n != "temperature"} | columns
    return reduce_undiagnosed(Record(windows, {}, record.run))


def test_the_record_has_the_mean_temperature_of_each_window(ramp: Record) -> None:
    """T = r (t - tau (1 - e^(-t/tau))), averaged over a window by its ends and middle (Simpson)."""

    def temperature(t: np.ndarray) -> np.ndarray:
        return np.asarray(20.0 / 3600.0 * (t - 200.0 * (1.0 - np.exp(-t / 200.0))))

    t0, t1 = ramp.windows["t_start"], ramp.windows["t_end"]
    mean = (temperature(t0) + 4.0 * temperature((t0 + t1) / 2.0) + temperature(t1)) / 6.0
    assert ramp.windows["temperature"] == pytest.approx(mean, abs=1e-6)
    assert ramp.run.window_units["temperature"] == "K"


def test_coefficients_and_drift_per_kelvin_come_back(ramp: Record) -> None:
    """D_F is that of the mean temperature: -0.3 + 0.2 x mean."""
    result = reduced(ramp, temperature=ramp.windows["temperature"])
    found = {c.name: c for c in result.coefficients}
    assert set(found) == {*NAMES, "temperature"}
    assert found["temperature"].truth == pytest.approx(0.2)
    assert found["D_F"].truth == pytest.approx(-0.3 + 0.2 * float(np.mean(ramp.windows["temperature"])))
    for c in result.coefficients:
        assert c.truth is not None and c.interval[0] < c.truth < c.interval[1], c.name
    assert found["temperature"].u < 0.02  # so that 0.2 is not found by chance


def test_without_the_thermometer_the_warming_is_a_trend(ramp: Record) -> None:
    """The drift grows by 0.2 x 20 K/h = 4 deg/h/h less what the gyro lags; the constant is that of the middle."""
    found = {c.name: c for c in reduced(ramp).coefficients}
    assert "temperature" not in found
    assert found["trend"].estimate == pytest.approx(3.6, rel=0.2)


@pytest.mark.long
def test_a_vertical_field_looks_like_unbalance(prepared: Session) -> None:
    """B = b U and (X, Y, Z) = -f/g0 = -gamma U on every axis: D_B . B = -(b/gamma) (D_B . (X, Y, Z)), so that D_I and
    D_S are too large by -b D_BI/gamma = +0.088 deg/h/g and -b D_BS/gamma = -0.022 deg/h/g, the others unchanged.
    """
    estimates = []
    for values in ({}, FIELD):
        record = prepared.run({**SHORT, **quiet(prepared.system), **values}, seed=1)
        estimates.append({c.name: c.estimate for c in reduced(record).coefficients})
    gamma = float(record.run.parameters["site.gravity"] or 9.806607) / 9.80665
    shift = {n: estimates[1][n] - estimates[0][n] for n in NAMES}
    assert shift["D_I"] == pytest.approx(0.088 / gamma, rel=1e-3)
    assert shift["D_S"] == pytest.approx(-0.022 / gamma, rel=1e-3)
    assert max(abs(v) for n, v in shift.items() if n not in ("D_I", "D_S")) < 1e-4


def test_surroundings_are_there_only_where_they_are_asked_for() -> None:
    plain, asked, swapped = load(), load(), load()
    asked.set("surroundings.ramp", "1K/h")
    with Session(swapped, {"surroundings": build("surroundings")}) as session:
        assert set(session.program.order) - set(plain.slots) == {"surroundings", "thermometer"}
    assert set(asked.slots) - set(plain.slots) == {"surroundings", "thermometer"}
    assert "surroundings" not in plain.slots and "surroundings" not in type(asked).slots
    assert plain.windows is not None and "temperature" not in plain.windows.columns
    assert asked.with_values({"dwell": 10.0}).slots == asked.slots


def shifts(system: System, values: dict[str, Any], *fields: dict[str, Any]) -> list[dict[str, float]]:
    """Changes of the estimates of a test by magnetic fields, deg/h per g^n."""
    system.request("surroundings")
    with Session(system) as session:
        runs = [session.run({**values, **field}, seed=1) for field in ({}, *fields)]
    plain, *others = ({c.name: c.estimate for c in system.with_values(values).reduce(r).coefficients} for r in runs)
    return [{n: found[n] - plain[n] for n in plain} for found in others]


@pytest.mark.long
def test_the_field_is_turned_into_the_axes_of_a_gyro_that_holds_its_table() -> None:
    """Vertical, b U: unbalance, as in the tumble.  East, b E: y = -E at angle 0 in both mounts, so that B_y = -b cos a,
    B_z = b sin a, while X Z = g2 s c cos a and X Y = g2 s c sin a in both: D_IS by -b D_BO / (g2 s c), D_IO by
    b D_BS / (g2 s c).
    """
    b, sensitivity = 44e-6, {1: 2000.0, 2: 800.0, 3: -500.0}
    values = {**DAY50, **QUIET, "route": "combination"} | {f"gyro.D_B[{k}]": x * DPH for k, x in sensitivity.items()}
    up, east = shifts(polar_at_2_ms(), values, {"surroundings.field[3]": b}, {"surroundings.field[1]": b})
    phi = math.radians(45.75)
    g = frames.normal_gravity(phi) / frames.G0
    product = g * g * math.sin(phi) * math.cos(phi)
    expected = {"D_I": -b * 2000.0 / g, "D_O": -b * 800.0 / g, "D_S": b * 500.0 / g}
    assert {n: up[n] for n in expected} == pytest.approx(expected, rel=2e-3)
    assert max(abs(v) for n, v in up.items() if n not in expected) < 1e-4, up
    expected = {"D_IS": -b * 800.0 / product, "D_IO": -b * 500.0 / product}
    assert {n: east[n] for n in expected} == pytest.approx(expected, rel=2e-3)
    assert max(abs(v) for n, v in east.items() if n not in expected) < 1e-4, east


@pytest.mark.long
def test_the_field_is_turned_on_two_axes() -> None:
    """Vertical, b U: unbalance by -b D_B / gamma along all three axes of a gyro that is tumbled by both axes."""
    b = 44e-6
    system = load_system("tumble_two_axis")
    system.step = 4e-3
    values = {"dwell": 10.0, "windows": 1, "settle": 3.0, **quiet(system), "nuisances": "none"}
    values |= {"gyro.D_B[1]": 2000.0 * DPH, "gyro.D_B[2]": 800.0 * DPH, "gyro.D_B[3]": -500.0 * DPH}
    (up,) = shifts(system, values, {"surroundings.field[3]": b})
    g = frames.normal_gravity(math.radians(45.75)) / frames.G0
    expected = {"D_I": -b * 2000.0 / g, "D_O": -b * 800.0 / g, "D_S": b * 500.0 / g}
    assert {n: up[n] for n in expected} == pytest.approx(expected, rel=2e-3)
    assert max(abs(v) for n, v in up.items() if n not in expected) < 1e-4, up


@pytest.mark.long
def test_the_field_is_turned_into_the_axes_of_a_gyro_that_holds_two_axes() -> None:
    """The same of both channels, over the attitudes of mounts 2 and 4."""
    b, values = 44e-6, servoing_two_axes.day(200.0, 72, **servoing_two_axes.QUIET)
    given = {"Dx_B": (2000.0, 800.0, -500.0), "Dy_B": (-1500.0, 400.0, 900.0)}
    values |= {f"gyro.{n}[{k}]": x * DPH for n, of in given.items() for k, x in enumerate(of, 1)}
    (up,) = shifts(load_system("servo_two_axis"), values, {"surroundings.field[3]": b})
    g = frames.normal_gravity(math.radians(45.75)) / frames.G0
    expected = {f"{n[:2]}_{axis}": -b * x / g for n, of in given.items() for axis, x in zip("xyz", of, strict=True)}
    assert {n: up[n] for n in expected} == pytest.approx(expected, rel=5e-3)
    assert max(abs(v) for n, v in up.items() if n not in expected) < 2e-4, up


@pytest.mark.long
def test_a_gyro_on_tilting_ground_reads_the_rate_of_the_tilt() -> None:
    """Input axis east, the ground turns by 100 arcsec/h about east: omega_IA and so k i is larger by 100/3600 deg/h;
    the drift rate omega_IA - k i that the reduction states with the Earth rate alone is smaller by it.  The spin axis,
    which points south here, and so D_S, see gravity by at most 100 arcsec of tilt: 0.7 deg/h/g x 5e-4 = 3e-4 deg/h.
    """
    system = load_system("fixed_position")
    options = {"attitude": "E U", "dwell": 600.0, "readings": 12, **quiet(system)}
    tilting = {"site.tilt_ramp[1]": 100.0 * math.pi / 648000.0 / 3600.0}
    with Session(system, {"site": build("ground_motion")}) as session:
        found = [system.reduce(session.run({**options, **v}, seed=1)).coefficients[0] for v in ({}, tilting)]
    assert found[1].estimate - found[0].estimate == pytest.approx(-100.0 / 3600.0, abs=1e-4)


def test_a_suite_hands_the_surroundings_to_its_tests() -> None:
    suite = load_test("drift_test_suite")
    assert isinstance(suite, Suite)
    suite.set("tests", "tumble_single_axis fixed_position")
    suite.set("surroundings.ramp", "1K/h")
    suite.set("fixed_position.surroundings.tau", "600s")
    members = suite.members()
    assert all("surroundings" in member.slots for member in members.values())
    assert "surroundings.tau" not in members["tumble_single_axis"].overrides
    assert list(suite.swaps(members, {"surroundings": "vendor.fmu"})["fixed_position"]) == ["surroundings"]
