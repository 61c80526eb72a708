"""Values as the pages show them, and what a system is for."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("nicegui")

from gyrobench.studio.system_page import _shown
from gyrobench.system.values import parse
from gyrobench.workflow.gallery import DATA, GYRO, LOOP, purposes_of
from gyrobench.workflow.inputs import load_test

DEG = math.pi / 180.0


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (3.0 * DEG / 3600.0, "rad", "3 arcsec"), (1e-5, "rad", "1e-05 rad"), (45.75 * DEG, "rad", "45.75°"),
        (-90.0 * DEG, "rad", "-90°"), (1.0, "rad/s", "1 rad/s"), (1e-3, "rad/s", "0.001 rad/s"),
        (5.0 * DEG / 3600.0, "rad/s", "5 deg/h"), (36.0 * DEG, "rad/s", "36 deg/s"), (0.0, "rad", "0°"),
    ],
)  # fmt: skip
def test_a_value_is_shown_in_the_unit_in_which_it_is_short_and_can_be_typed_so(
    value: float, unit: str, text: str
) -> None:
    assert _shown(value, unit) == text
    assert parse("x", text, unit, float) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "expected"),
    [("test_start_up", {GYRO}), ("gyro_bandwidth", {GYRO, DATA}), ("gyro_dynamics", {GYRO, DATA}),
     ("gimbal_tracking", {LOOP}), ("tumble_single_axis", {GYRO, DATA})],
)  # fmt: skip
def test_tests_of_an_instrument_are_found_under_it(name: str, expected: set[str]) -> None:
    assert {p for p in purposes_of(load_test(name)) if p in (GYRO, DATA, LOOP)} == expected
