"""Runs ranked by the measure their reduction names: order, ties, runs that cannot be ranked."""

from __future__ import annotations

import dataclasses
import json
import math

import pytest
from simulated import tumble

from gyrobench.report.comparison_page import comparison
from gyrobench.report.notebook_html import comparison_html, result_html
from gyrobench.report.plain_text import format_ranking
from gyrobench.report.result_json import document, load


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
    assert [e["place"] for e in ranking["order"]] == [1, 1, 3]
    text = format_ranking(comparison(runs(0.02, 0.01, 0.0125)))
    assert text.splitlines()[1].split()[:2] == ["1", "="]
    assert text.splitlines()[-1].startswith("3")


def test_ties_are_told_from_the_first_of_their_place():
    """0.010, 0.012, 0.014: each is near the one before it, but the third is apart from the first, U = 0.0028."""
    order = comparison(runs(0.010, 0.012, 0.014))["ranking"]["order"]
    assert [e["place"] for e in order] == [1, 1, 3]


def test_a_comparison_opens_with_what_chance_does_not_explain():
    """Three differences of D_F and those of the other measures, which are the same in all runs: 0.1 of U = 0.0028."""
    doc = comparison(runs(0.01, 0.0101, 0.05))
    a_b, a_c, *others = doc["summary"]
    assert a_b.startswith("B (run 1) agrees with A (run 0) in all")
    assert "C (run 2) differs from A (run 0) in D_F (" in a_c and "by +0.0400 ± 0.0028" in a_c
    assert "The smallest D_F" in others[-1] and "A (run 0), B (run 1) share the first place" in others[-1]


def test_a_difference_of_a_little_more_than_u_is_no_opening():
    """3.1 u of one in 18 differences: beyond its own U = 2 sqrt 2 u, within Bonferroni's 2.99/1.96 of it."""
    doc = comparison(runs(0.01, 0.01 + 1.1 * 2.0 * math.sqrt(2.0) * 0.001))
    assert "agrees" in doc["summary"][0] and "1 more difference exceeds its own U" in doc["summary"][1]
    d = doc["measures"][0]["differences"][1]
    assert d["significant"] and not d["beyond_chance"]


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


def test_void_runs_are_listed_last_and_have_no_rank():
    """An unstable run whose rest would be the smallest, and one that has no value of the ranked measure."""
    mixed = runs(2.0, 0.1, 1.0, 3.0)
    mixed[1][1].verdict = "void"
    nothing = {"estimate": math.nan, "u": math.nan, "interval": (math.nan, math.nan)}
    mixed[3][1].coefficients[0] = dataclasses.replace(
        mixed[3][1].coefficients[0], **nothing, verdict="void", no_value="unstable, pole at 1.59 Hz"
    )
    ranking = comparison(mixed)["ranking"]
    assert [e["run"] for e in ranking["order"]] == [2, 0]
    assert [v["run"] for v in ranking["void"]] == [1, 3]
    text = format_ranking(comparison(mixed))
    assert text.index("run 0") < text.index("run 1")
    assert "run 3 has no rank: unstable, pole at 1.59 Hz" in text
    assert "run 3" in comparison_html(comparison(mixed), "")


def test_a_result_without_a_value_keeps_its_reason_on_disk():
    r = tumble(windows=12)
    nothing = {"estimate": math.nan, "u": math.nan, "interval": (math.nan, math.nan)}
    r.coefficients[0] = dataclasses.replace(r.coefficients[0], **nothing, verdict="void", no_value="unstable, pole")
    again = load(json.dumps(document(r)))
    assert math.isnan(again.coefficients[0].estimate) and again.coefficients[0].no_value == "unstable, pole"
    assert document(again) == document(r)
    html = result_html(again)
    assert "no value" in html and f"No value of {r.coefficients[0].name}: unstable, pole." in html
