"""Coefficients of the size of the Earth rate: pointed out where they stand out from the drift of the gyro."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from gyrobench.reduction.diagnosis.plausibility import earth_rate_warnings

W = 7.292115e-5
SITE: Any = SimpleNamespace(earth_rate=W, latitude=math.radians(45.0))
LEVEL = math.degrees(W) * 3600.0 * math.cos(math.radians(45.0))  # 10.64 deg/h


def said(*values: float) -> list[str]:
    coefficients = [SimpleNamespace(name=f"D{k}", unit="°/h", estimate=v) for k, v in enumerate(values)]
    result: Any = SimpleNamespace(coefficients=coefficients)
    return [r.text for r in earth_rate_warnings(result, SITE)]


@pytest.mark.parametrize("others", [(), (0.5, -0.2), (LEVEL / 3.1,)])
def test_what_stands_out_is_said(others: tuple[float, ...]) -> None:
    (text,) = said(1.01 * LEVEL, *others)
    assert text.startswith("D0 = 10.74 °/h is close to")


@pytest.mark.parametrize("others", [(7.0,), (0.1, -LEVEL / 2.9)])
def test_a_gyro_whose_drift_is_that_large_is_not_asked(others: tuple[float, ...]) -> None:
    """Of 100 clean records of a gyro with 10 deg/h and 10 deg/h/g 16 were warned of."""
    assert not said(1.01 * LEVEL, *others)


def test_both_of_two_are_said() -> None:
    (text,) = said(LEVEL, -2.0 * LEVEL, 0.3)
    assert "D0 =" in text and "D1 =" in text
