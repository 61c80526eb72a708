"""Drift tests take a gyro by its masses and compliances: the coefficients follow, and are the truth in the report."""

from __future__ import annotations

from typing import Any

import pytest

from gyrobench.bench import Bench, standard_folder
from gyrobench.engine.session import Session
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.families.physical_form import physical_drift
from gyrobench.system.part_values import PartValues
from gyrobench.system.suite import load_test
from gyrobench.system.system import System, load_system

G0 = 9.80665
FLOAT = "m=0.25kg, l_S=0.3um, l_I=-0.2um, M_O=2e-7N.m, K_SS=3nm/N, K_II=1nm/N"
ROTOR = "m=0.5kg; l_z=0.3um; l_x=-0.2um; outer=1e-7kg.m"
DRIFT_TESTS = [
    n for n in sorted(Bench(standard_folder()).systems()) if "physical" in getattr(load_test(n), "options", {})
]


def derived(name: str, text: str, **chosen: Any) -> dict[str, float]:
    system = load_system(name).with_values({"physical": text})
    return physical_drift(system, PartValues(system, None, chosen))


def test_coefficients_by_hand() -> None:
    """H = 0.2: D_F = -M_O/H = -1e-6; D_I = -m g0 l_S/H, D_S = +m g0 l_I/H; D_IS = -m2 g02 (K_SS - K_II)/H."""
    found = derived("fixed_position", FLOAT)
    a, q = 0.25 * G0 / 0.2, (0.25 * G0) ** 2 / 0.2
    expected = {"D_F": -1e-6, "D_I": -a * 0.3e-6, "D_S": -a * 0.2e-6, "D_IS": -q * 2e-9}
    assert found == {f"gyro.{n}": pytest.approx(v) for n, v in expected.items()}
    assert derived("fixed_position", FLOAT, **{"gyro.H": 0.4})["gyro.D_F"] == pytest.approx(-0.5e-6)
    found = derived("eight_position", ROTOR)  # the outer gimbal acts about the outer axis only
    b = G0 / 0.2
    assert found["gyro.Dx_x"] == pytest.approx(-0.5 * b * 0.3e-6)
    assert found["gyro.Dy_y"] == pytest.approx(-(0.5 * 0.3e-6 + 0.1e-6) * b)
    assert found["gyro.Dx_z"] == pytest.approx(-0.5 * b * 0.2e-6) and set(found) == {
        "gyro.Dx_x", "gyro.Dy_y", "gyro.Dx_z",
    }  # fmt: skip


def test_every_drift_test_has_the_option() -> None:
    assert DRIFT_TESTS == [
        "eight_position", "fixed_position", "open_loop_drift", "position_sensitivity", "servo_polar", "servo_two_axis",
        "servo_vertical_level", "tumble_single_axis", "tumble_two_axis", "tumble_two_channel",
    ]  # fmt: skip
    for name in DRIFT_TESTS:
        system = load_test(name)
        assert isinstance(system, System)
        text = ROTOR if system.slots["gyro"].socket == "TwoAxisGyro" else FLOAT
        values = system.with_values({"physical": text})
        found = derived(name, text)
        assert found and found.items() <= values.parameters(PartValues(values)).items()


def test_run_has_them_as_truth() -> None:
    values = {"dwell": 20.0, "readings": 10, "settle": 3.0, "attitude": "U E", "physical": FLOAT}
    with Session("fixed_position") as session:
        record = session.run(values)
    found = derived("fixed_position", FLOAT)
    assert {n: record.run.parameters[n] for n in found} == found
    result = load_system("fixed_position").with_values(values).reduce(record)
    c = result.coefficients[0]  # I up, O east, S north: X = -g, so omega_d = D_F - D_I g + D_II g2
    g = 9.80629 / G0  # WGS84 at 45.75 degrees, to 1e-5
    p = record.run.parameters
    truth = p["gyro.D_F"] - p["gyro.D_I"] * g + p["gyro.D_II"] * g * g
    assert c.truth == pytest.approx(truth * 3600.0 * 180.0 / 3.141592653589793, rel=1e-4)
    assert abs(c.estimate - c.truth) < 5.0 * c.u


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("l_S=1um", "m, the mass of the float, is missing"),
        ("m=0.25kg, l_S=1kg", "kg"),
        ("m=0.25kg, what", "'what': entries are m=0.25kg"),
        ("m=0.25kg, m=1kg", "'m=1kg' stands twice"),
        ("m=0.25kg, l_Q=1um", "'l_Q' unknown"),
        ("m=0.25kg, outer=1kg.m", "this gyro has none"),
    ],
)
def test_what_is_wrong_is_said(text: str, said: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=said):
        derived("fixed_position", text)


def test_a_coefficient_set_in_both_forms() -> None:
    with pytest.raises(InvalidConfigurationError, match=r"gyro\.D_I: set, and by the option physical too"):
        derived("fixed_position", FLOAT, **{"gyro.D_I": 1e-6})
