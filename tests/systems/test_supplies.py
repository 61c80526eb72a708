"""Supplies of the gyro in the drift tests: what they do, as predicted; budget, corrections, refusals; intervals."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.reduction.drift.supplies import read_terms
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Result
from gyrobench.system.system import System, load_system
from gyrobench.system.values import InvalidValueError

DPH = math.pi / 648000.0
W = frames.EARTH_RATE / DPH
FIXED: dict[str, Any] = {
    "readings": 10,
    "dwell": 20.0,
    "settle": 3.0,
    "attitude": "N E",
    "latitude": math.radians(50.0),
}
TUMBLE: dict[str, Any] = {"rate": 0.15, "windows": 24, "dwell": 17.5, "settle": 2.0}
HELD: dict[str, Any] = {"dwell": 20.0, "cycles": 1, "settle": 2.0, "attitudes": "x down; x up; x north, z up"}
GYRO = {"gyro.D_pickoff": 0.5 * DPH, "gyro.D_torquer": -0.2 * DPH, "gyro.D_UI": 2.0 * DPH, "gyro.D_US": -1.0 * DPH,
        "gyro.D_PI": 1.0 * DPH, "gyro.D_PS": 3.0 * DPH, "gyro.k_E": 0.1}  # fmt: skip
OFF = {"supply.frequency_offset": 1e-4, "supply.voltage_offset": 2e-3, "supply.asymmetry_offset": -1e-3,
       "supply.pickoff_offset": 1e-3, "supply.torquer_offset": -2e-3, "supply.frequency_ramp": 1e-6,
       "supply.voltage_ramp": 1e-5, "supply.pickoff_ramp": -2e-5, "supply.torquer_ramp": 1e-5}  # fmt: skip


def system_of(name: str) -> System:
    system = load_system(name)
    system.request("supply")
    return system


@pytest.fixture(scope="module")
def sessions() -> Iterator[dict[str, Session]]:
    names = ("fixed_position", "tumble_single_axis", "servo_vertical_level")
    with Session(system_of(names[0])) as a, Session(system_of(names[1])) as b, Session(system_of(names[2])) as c:
        yield dict(zip(names, (a, b, c), strict=True))


def reduced(sessions: dict[str, Session], name: str, values: dict[str, Any], seed: int = 1) -> Result:
    quiet = {n: 0.0 for n in load_system(name).noises}
    result: Result = system_of(name).with_values(values).reduce(sessions[name].run({**quiet, **values}, seed=seed))
    return result


@pytest.mark.parametrize(
    ("name", "values"), [("fixed_position", FIXED), ("tumble_single_axis", TUMBLE), ("servo_vertical_level", HELD)]
)
def test_shifts_are_those_predicted(sessions: dict[str, Session], name: str, values: dict[str, Any]) -> None:
    """Every supply off and drifting: each estimate moves by the sum that the report predicts; 2 % and 2e-6 deg/h are
    left to the squares of the departures and to what a nuisance takes up.
    """
    values = {**values, **GYRO, "nuisances": "none"}
    plain, off = (reduced(sessions, name, {**values, **more}) for more in ({}, OFF))
    predicted = next(t for t in off.tables if t.id == "budget.predicted")
    total = {row[0]: row[-3] for row in predicted.rows}
    assert max(map(abs, total.values())) > 1e-3
    for a, b, row in zip(plain.coefficients, off.coefficients, predicted.rows, strict=True):
        assert b.estimate - a.estimate == pytest.approx(row[-3], rel=0.02, abs=2e-6), a.name


@pytest.mark.long
def test_shifts_of_a_channel_of_two_degrees_of_freedom() -> None:
    """The y channel holds the table: its own sensitivities, own axis for I, z for S, predict what the supplies do."""
    names = {"pickoff": 0.5, "torquer": -0.2, "voltage": 2.0, "voltage_z": -1.0, "phase": 1.0, "phase_z": 3.0}
    own = {f"gyro.Dy_{n}": x * DPH for n, x in names.items()} | {"gyro.k_E": 0.1}
    system = load_system("servo_vertical_level")
    system.set("channel", "y")
    system.request("supply")
    values = {**HELD, "attitudes": "x down; x up", **dict.fromkeys(system.noises, 0.0), **own, "nuisances": "none"}
    with Session(system) as session:
        records = [session.run({**values, **more}, seed=1) for more in ({}, OFF)]
    options = {n: v for n, v in values.items() if "." not in n}
    plain, off = (system.with_values(options).reduce(r) for r in records)
    predicted = next(t for t in off.tables if t.id == "budget.predicted")
    assert max(abs(row[-3]) for row in predicted.rows) > 1e-3
    for a, b, row in zip(plain.coefficients, off.coefficients, predicted.rows, strict=True):
        assert b.estimate - a.estimate == pytest.approx(row[-3], rel=0.02, abs=2e-6), a.name


def test_excitation_in_a_test_of_two_channels() -> None:
    """Dx_pickoff ((1 + e)^2 - 1) = 0.5 deg/h (1.01^2 - 1) = 0.01005 deg/h are in R_y = -Dx_0, none in R_x."""
    system = load_system("eight_position")
    system.request("supply")
    values = {"dwell": 1.5, "settle": 1.5, "readings": 2, **dict.fromkeys(system.noises, 0.0)}
    off = {"gyro.Dx_pickoff": 0.5 * DPH, "supply.pickoff_offset": 0.01}
    with Session(system) as session:
        records = [session.run({**values, **more}, seed=1) for more in ({}, off)]
    plain, moved = (system.reduce(r) for r in records)
    assert plain["R_y"].estimate - moved["R_y"].estimate == pytest.approx(0.01005, rel=1e-3)
    assert moved["R_x"].estimate == pytest.approx(plain["R_x"].estimate, abs=1e-6)


def test_budget_by_hand(sessions: dict[str, Session]) -> None:
    """Input axis north: omega_IA = W cos 50 deg; X = 0, and with the spin axis down Z = -f/g0 = +1 per g0 (E along O,
    S = N x E = -U).  Frequency: -W cos phi; pickoff: 2 D_pickoff; voltage: D_US gamma; phases: D_PS gamma.
    """
    u = {"u_wheel_frequency": 1e-3, "u_wheel_voltage": 1e-3, "u_wheel_phase": 1e-3, "u_pickoff_excitation": 1e-3}
    result = reduced(sessions, "fixed_position", {**FIXED, **GYRO, **u})
    lines = {b.id: b for b in result.budget}
    g = frames.normal_gravity(FIXED["latitude"], 0.0) / frames.G0
    expected = {"supply.frequency": -W * math.cos(FIXED["latitude"]), "supply.pickoff": 1.0, "supply.voltage": -g,
                "supply.phase": 3.0 * g}  # fmt: skip
    for source, slope in expected.items():
        assert lines[source].sensitivity == pytest.approx(slope, rel=1e-9), source
        assert lines[source].contribution == pytest.approx(1e-3 * abs(slope), rel=1e-9), source
    # over the record, of windows at 4 s to 22 s after the start: its mean change is u (13 s)/(18 s)
    drift = lines["supply.frequency.drift"]
    assert drift.contribution == pytest.approx(1e-3 * abs(expected["supply.frequency"]) * 13.0 / 18.0, rel=0.01)
    assert drift.sensitivity_unit == "°/h·s"


def test_a_measured_supply_is_taken_out(sessions: dict[str, Session]) -> None:
    """Its u stays: that of the correction."""
    values = {**FIXED, **GYRO, "supply.frequency_offset": 3e-4}
    stated = {"corrections": "supply.frequency = 300(10) ppm"}
    plain, off, right = (
        reduced(sessions, "fixed_position", v).coefficients[0]
        for v in ({**FIXED, **GYRO}, values, {**values, **stated})
    )
    assert off.estimate - plain.estimate == pytest.approx(-3e-4 * W * math.cos(FIXED["latitude"]), rel=1e-3)
    assert right.estimate == pytest.approx(plain.estimate, abs=1e-6)
    assert right.u == pytest.approx(1e-5 * W * math.cos(FIXED["latitude"]), rel=1e-2)


def test_frequency_is_nothing_to_a_tumble(sessions: dict[str, Session]) -> None:
    """Its input axis is at right angles to the pole: 1e-3 of the wheel's frequency, 0.015 deg/h of the Earth's rate."""
    plain, off = (
        reduced(sessions, "tumble_single_axis", {**TUMBLE, **more}) for more in ({}, {"supply.frequency_offset": 1e-3})
    )
    for a, b in zip(plain.coefficients, off.coefficients, strict=True):
        assert b.estimate == pytest.approx(a.estimate, abs=1e-6), a.name


def test_terms_and_refusals(sessions: dict[str, Session]) -> None:
    assert read_terms("D_pickoff=0.5deg/h, D_US = -1deg/h/g; k_E=1") == pytest.approx(
        {"D_pickoff": 0.5 * DPH, "D_US": -DPH, "k_E": 1.0}
    )
    for text, said in (("D_X=1", "not one of"), ("k_E=1, k_E=2", "stands twice"), ("D_UI=2mm", "does not convert")):
        with pytest.raises(ReductionError, match=said):
            read_terms(text)
        with pytest.raises(InvalidValueError, match=said):
            sessions["fixed_position"].run({**FIXED, "supply_terms": text})


def test_a_size_without_what_it_does_is_refused_of_measured_data(sessions: dict[str, Session], tmp_path: Any) -> None:
    """A line of 0 in the budget would be a small uncertainty that nobody stated."""
    record = sessions["fixed_position"].run(FIXED, seed=2)
    w = record.windows
    head = "# latitude = 50deg\n# k = 17.2deg/h/mA\n# attitude = N E\n# u_pickoff_excitation = 0.1%\n"
    rows = [
        f"{float(a)!r},{float(b)!r},{float(m)!r}" for a, b, m in zip(w["t_start"], w["t_end"], w["mean"], strict=True)
    ]
    (tmp_path / "lab.csv").write_text(
        head + "t_start [s],t_end [s],mean [A]\n" + "\n".join(rows) + "\n", encoding="utf-8"
    )
    lab = load_system("fixed_position")
    with pytest.raises(ReductionError, match="not what it does to the gyro; give supply_terms = D_pickoff"):
        lab.reduce(lab.read_measured(tmp_path / "lab.csv", {}))
    known = {"supply_terms": "D_pickoff=0.5deg/h"}
    result = lab.with_values(known).reduce(lab.read_measured(tmp_path / "lab.csv", known))
    assert {b.id: b.contribution for b in result.budget}["supply.pickoff"] == pytest.approx(1e-3)


@pytest.mark.long
def test_intervals_of_a_supply_that_drifts(sessions: dict[str, Session]) -> None:
    """Departures and drifts that the reduction does not know but by what is stated of them: of 40 intervals of coverage
    0.93 fewer than 31 hold the truth with probability 1e-3.  The counts of 1000 are of tests/benchmarks/coverage.py.
    """
    rng, hits = np.random.default_rng(4), 0
    u = {"u_wheel_frequency": 5e-3, "u_pickoff_excitation": 2e-2}
    for seed in range(40):
        a, b, c, d = rng.normal(size=4)
        off = {"supply.frequency_offset": 5e-3 * a, "supply.frequency_ramp": 5e-3 * b / 20.0}
        off |= {"supply.pickoff_offset": 2e-2 * c, "supply.pickoff_ramp": 2e-2 * d / 20.0}
        values = {**FIXED, **GYRO, **u, **off, "gyro.white": 0.02 * DPH}
        low, high = (found := reduced(sessions, "fixed_position", values, seed).coefficients[0]).interval
        hits += low <= found.truth <= high
    assert hits >= 31, hits
