"""Surroundings and thermostat in tests of an hour or more: every one has the slot, and what two of them make of it."""

from __future__ import annotations

import math
from typing import Any

import pytest

from gyrobench.bench import standard_folder
from gyrobench.engine.session import Session
from gyrobench.packaging.loading import load_part
from gyrobench.result import Result
from gyrobench.system.system import load_system

DPH = math.pi / 648000.0
HOUR = 3600.0
NAMES = sorted(p.parent.name for p in (standard_folder() / "systems").glob("*/system.py"))


def heated(name: str, values: dict[str, Any], part: str = "surroundings") -> Result:
    """Return what a run with a part in the slot surroundings finds."""
    system = load_system(name)
    system.request("surroundings")
    with Session(system, {"surroundings": part}) as session:
        record = session.run(values, seed=1)
    return system.with_values(record.run.options).reduce(record)


def has_slot(system: Any) -> bool:
    slots = {**system.slots, **{n: s for r in system.on_request.values() for n, s in r.slots.items()}}
    return any(s.socket == "Surroundings" for s in slots.values())


def feels_temperature(system: Any) -> bool:
    """Return whether a part with an inertial rate has an input for the temperature."""
    for slot in system.slots.values():
        if slot.part:
            ports = {x.name for x in load_part(slot.part, standard_folder()).layout if x.section == "input"}
            if {"temperature", "omega[1]"} <= ports:
                return True
    return False


@pytest.mark.parametrize("name", [n for n in NAMES if n != "drift_test_suite"])
def test_a_long_test_of_an_instrument_that_feels_temperature_has_the_slot(name: str) -> None:
    system: Any = load_system(name)
    duration = getattr(system.plan(), "duration", lambda: 0.0)()
    if duration >= HOUR and feels_temperature(system):
        assert has_slot(system)


@pytest.mark.parametrize(("part", "offset"), [("surroundings", 10.0), ("thermostat", -45.0)])
def test_torquer_at_another_temperature(part: str, offset: float) -> None:
    """k (1 + 1e-4/K 10 K) = 17.2172 deg/h/mA in a room of 10 K; behind two stages, 45 K below, that of its sheet."""
    plan = {"currents": "20 40 100", "range": "0.5deg", "range_large": "2deg", "windows": 10}
    K = heated("torquer_scale_factor", {**plan, "gyro.k_T": 1e-4, "surroundings.offset": offset}, part)["K"]
    expected = 17.2172 if part == "surroundings" else 17.2
    assert K.truth == pytest.approx(expected, rel=1e-7)
    assert abs(K.estimate - expected) < 4.0 * K.u and K.u < 1e-3


def test_bias_of_turn_ons_by_temperature() -> None:
    """0.01 K/s, 2 deg/h/K, hardly any lag of the coil: the biases of turn-ons a minute apart differ by 1.2 deg/h."""
    quiet = dict.fromkeys(
        ("switched.between_turn_ons", "switched.between_days", "switched.warm_1", "gyro.optical"), 0.0
    )
    warm = {"surroundings.ramp": 0.01, "gyro.bias_T": [2.0 * DPH, 0.0], "gyro.lag": 0.1}
    plan = {"days": 2, "turn_ons": 4, "dwell": 60.0, "window": 5.0}
    assert heated("turn_on_repeatability", {**plan, **quiet, **warm})["b_T"].estimate == pytest.approx(2.0, rel=0.02)
