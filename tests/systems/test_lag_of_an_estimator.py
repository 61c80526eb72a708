"""The phase that an estimator takes at the crossover: by hand, and nothing where it hands the reading on."""

from __future__ import annotations

import cmath
import importlib
import math
from types import SimpleNamespace
from typing import Any

import pytest

from gyrobench.reduction.loops.loop_measures import Point
from gyrobench.system.system import load_system

MODULE = type(load_system("platform_single_axis")).__module__
measures: Any = importlib.import_module(".measures", MODULE)


def lag(points: list[Point]) -> tuple[float, float]:
    """Return the estimate and u, degrees, with a crossover at 10 Hz."""
    rows: list[Any] = []
    found = SimpleNamespace(estimates={"f_c": 10.0}, measure=lambda *row: rows.append(row))
    measures.lag(found, points)
    return rows[0][3], rows[0][4]


def test_a_delay_of_a_millisecond() -> None:
    """360 deg 10 Hz 1 ms = 3.6 deg at a sine; u of 1e-3 rad is 0.0573 deg."""
    points = [Point(f, cmath.exp(-2j * math.pi * f * 1e-3), 1e-3, 1.0) for f in (5.0, 10.0, 20.0)]
    assert lag(points) == pytest.approx((3.6, 0.0573), rel=1e-3)


def test_rounding_is_not_printed_as_a_lag() -> None:
    points = [Point(f, 1.0 + 1e-17j * f, 1e-17, 1.0) for f in (5.0, 10.0, 20.0)]
    assert lag(points) == (0.0, 0.0)
