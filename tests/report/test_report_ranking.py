"""Runs ranked by the measure their reduction names: order, ties, runs that cannot be ranked."""

from __future__ import annotations

import dataclasses

import pytest
from simulated import tumble

from gyrobench.report.comparison_page import comparison


def runs(*values, ranked_by="D_F", u=0.001):
    """Tumbles whose first coefficient, D_F, has these estimates."""
    found = []
    for k, value in enumerate(values):
        r = tumble(windows=12)
        r.ranked_by = ranked_by
        r.coefficients[0] = dataclasses.replace(r.coefficients[0], name="D_F", estimate=value, u=u, k=2.0)
        found.append((f"run {k}", r))
    return found


def test_order_and_what_lies_apart():
    # U of a difference: 2 sqrt(2) 0.001 = 0.0028
    ranking = comparison(runs(0.02, 0.01, 0.0125))["ranking"]
    assert ranking["name"] == "D_F"
    assert [e["run"] for e in ranking["order"]] == [1, 2, 0]
    assert [e["apart"] for e in ranking["order"]] == [None, False, True]
    assert [e["over_best"] for e in ranking["order"]] == pytest.approx([1.0, 1.25, 2.0])


def test_a_best_of_zero_has_no_ratio():
    assert [e["over_best"] for e in comparison(runs(0.0, 0.1))["ranking"]["order"]] == [None, None]


def test_runs_that_name_no_measure_or_not_the_same_are_not_ranked():
    assert comparison(runs(1.0, 2.0, ranked_by=""))["ranking"] == {}
    mixed = runs(1.0, 2.0)
    mixed[1][1].ranked_by = "D_I"
    assert comparison(mixed)["ranking"] == {}
    assert comparison(runs(1.0, 2.0, ranked_by="nothing"))["ranking"] == {}


def test_units_are_not_mixed():
    mixed = runs(1.0, 2.0)
    mixed[1][1].coefficients[0] = dataclasses.replace(mixed[1][1].coefficients[0], unit="rad/s")
    assert comparison(mixed)["ranking"] == {}
