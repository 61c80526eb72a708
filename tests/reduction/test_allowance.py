"""What a source of a mean square may be at most: by hand, by spectra with phases, in words where nothing suffices."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gyrobench.reduction.estimation.allowance import BEYOND, allowances, at_most, largest_factor
from gyrobench.result import Coefficient, SetBy, VarianceShare


def test_independent_sources_by_hand() -> None:
    """3, 4 and 12 µrad are 13 together.  Wanted 14: 4 may be sqrt(14² − 9 − 144) = sqrt(43), 6.557/4 times as it is."""
    assert largest_factor([9.0 + 144.0, 0.0, 16.0], 14.0) == pytest.approx(math.sqrt(43.0) / 4.0, rel=1e-12)
    assert largest_factor([9.0 + 144.0, 0.0, 16.0], 12.0) is None  # 12.37 without it
    assert largest_factor([9.0, 0.0, 0.0], 12.0) == math.inf


def test_sources_that_go_together_and_one_of_second_order() -> None:
    """The factor, put into the spectra themselves, gives what was wanted; every smaller one gives less."""
    rng = np.random.default_rng(5)
    rest, first, second = rng.normal(size=(3, 400)) + 1j * rng.normal(size=(3, 400))
    first += 0.7 * rest
    second -= 0.4 * first

    def square(k: float) -> float:
        return float(np.sum(np.abs(rest + k * first + k * k * second) ** 2))

    def both(a: np.ndarray, b: np.ndarray) -> float:
        return float(np.sum(np.real(np.conj(a) * b)))

    powers = [
        both(rest, rest), 2 * both(rest, first), both(first, first) + 2 * both(rest, second),
        2 * both(first, second), both(second, second),
    ]  # fmt: skip
    for wanted in (1.05 * math.sqrt(powers[0]), 60.0, 300.0):
        k = largest_factor(powers, wanted)
        assert k is not None and square(k) == pytest.approx(wanted**2, rel=1e-9)
        assert all(square(x) <= wanted**2 * (1 + 1e-9) for x in np.linspace(0.0, k, 50))


def test_a_source_that_cancels_others_is_told_from_one_that_does_not() -> None:
    """J² = 25 − 24 k + 16 k²: 5 without it, 4.12 as it is; below 4.5 it is from 0.24 to 1.26 only."""
    assert largest_factor([25.0, -24.0, 16.0], 4.5) is None
    quantity = SetBy("amplitude", 1.0, "1")
    assert at_most(quantity, None, "5 µrad", cancels=True) == "cancels others: 5 µrad without it"
    assert at_most(quantity, None, "5 µrad") == "none suffices: 5 µrad without it"


def test_the_table_has_the_quantity_in_its_unit_and_power() -> None:
    """A density goes with the square of the amplitude; one whose model ends before is not stated."""
    set_by = [SetBy("psd", 3.0, "1", 2.0), SetBy("pixel", 20.0, "µrad", holds=(None, 35.0))]
    share = VarianceShare("jitter", "noise", [0.0, 0.0, 25.0], set_by)
    judged = [Coefficient("jitter", "", "µrad", 5.0, 0.1, 2.0, (4.8, 5.2), limit=(None, limit)) for limit in (10.0,)]
    (table,) = allowances([share], judged)
    assert [row[4] for row in table.rows] == [pytest.approx(12.0), BEYOND]
    assert table.id == "budget.allowance:jitter" and "10 µrad" in table.title
    assert allowances([share], [Coefficient("jitter", "", "µrad", 5.0, 0.1, 2.0, (4.8, 5.2))]) == []
