"""Runs ranked by the measure their reduction names: order, ties, runs that cannot be ranked."""

from __future__ import annotations

import dataclasses
import json
import math

import pytest
from other_results import with_coefficient
from scipy import stats
from simulated import tumble

from gyrobench.report.comparison_page import comparison
from gyrobench.report.notebook_html import comparison_html, result_html
from gyrobench.report.plain_text import format_ranking
from gyrobench.report.result_json import document, load


def runs(*values, ranked_by="D_F", u=0.001):
    """Tumbles whose first coefficient, D_F, has these estimates."""
    found = []
    for k, value in enumerate(values):
        r = with_coefficient(tumble(windows=12), 0, name="D_F", estimate=value, u=u, k=2.0)
        found.append((f"run {k}", dataclasses.replace(r, ranked_by=ranked_by)))
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
    mixed[1] = ("run 1", dataclasses.replace(mixed[1][1], ranked_by="D_I"))
    assert comparison(mixed)["ranking"] == {}
    assert comparison(runs(1.0, 2.0, ranked_by="nothing"))["ranking"] == {}


def test_units_are_not_mixed():
    mixed = runs(1.0, 2.0)
    mixed[1] = ("run 1", with_coefficient(mixed[1][1], 0, unit="rad/s"))
    assert comparison(mixed)["ranking"] == {}


def test_void_runs_are_listed_last_and_have_no_rank():
    """An unstable run whose rest would be the smallest, and one that has no value of the ranked measure."""
    mixed = runs(2.0, 0.1, 1.0, 3.0)
    mixed[1] = ("run 1", dataclasses.replace(mixed[1][1], verdict="void"))
    nothing = {"estimate": math.nan, "u": math.nan, "interval": (math.nan, math.nan)}
    unstable = with_coefficient(mixed[3][1], 0, **nothing, verdict="void", no_value="unstable, pole at 1.59 Hz")
    mixed[3] = ("run 3", unstable)
    ranking = comparison(mixed)["ranking"]
    assert [e["run"] for e in ranking["order"]] == [2, 0]
    assert [v["run"] for v in ranking["void"]] == [1, 3]
    text = format_ranking(comparison(mixed))
    assert text.index("run 0") < text.index("run 1")
    assert "run 3 has no rank: unstable, pole at 1.59 Hz" in text
    assert "run 3" in comparison_html(comparison(mixed), "")


@pytest.mark.long
def test_a_result_without_a_value_keeps_its_reason_on_disk():
    nothing = {"estimate": math.nan, "u": math.nan, "interval": (math.nan, math.nan)}
    r = with_coefficient(tumble(windows=12), 0, **nothing, verdict="void", no_value="unstable, pole")
    again = load(json.dumps(document(r)))
    assert math.isnan(again.coefficients[0].estimate) and again.coefficients[0].no_value == "unstable, pole"
    assert document(again) == document(r)
    html = result_html(again)
    assert "no value" in html and f"No value of {r.coefficients[0].name}: unstable, pole." in html


def replicate(values_by_part, purposes=None):
    """Tumbles whose D_F has these values with seeds 1, 2, ...; name -> values."""
    found = []
    for part, values in values_by_part.items():
        for seed, value in enumerate(values, 1):
            ((_, r),) = runs(value)
            own = {"seed": seed, "parts": {"gyro": {"name": part}}}
            own["parameters"] = {"gyro.seed": 7 * seed, "gyro.H": 0.2}
            r = dataclasses.replace(r, purposes=purposes or {}, provenance={**r.provenance, **own})
            found.append((f"{part}/{seed}", r))
    return found


def test_runs_that_differ_in_the_seed_alone_are_one_candidate():
    """Seeds move both by 0.01, the parts differ by 0.0011 on average: told apart in pairs.

    Differences 0.0010, 0.0011, 0.0012: mean 0.0011, u = 1e-4/sqrt 3, t = 19.05 with 2 degrees of freedom.
    """
    doc = comparison(replicate({"b": [0.0310, 0.0211, 0.0112], "a": [0.03, 0.02, 0.01]}))
    assert [(r["name"], r["seeds"]) for r in doc["runs"]] == [("b", [1, 2, 3]), ("a", [1, 2, 3])]
    first, second = doc["ranking"]["order"]
    assert (first["run"], first["value"]) == (1, pytest.approx(0.02))
    assert first["u"] == pytest.approx(0.01 / math.sqrt(3.0))  # of the seeds 0.03, 0.02, 0.01
    assert second["place"] == 2
    assert second["probability"] == pytest.approx(stats.t.cdf(0.0011 / (1e-4 / math.sqrt(3.0)), 2))
    d = next(m for m in doc["measures"] if m["name"] == "D_F")["differences"][1]
    assert (d["value"], d["u"]) == (pytest.approx(-0.0011), pytest.approx(1e-4 / math.sqrt(3.0)))
    assert d["significant"]
    text = format_ranking(doc)
    assert "probability" in text and "0.999" not in text.splitlines()[1]
    html = comparison_html(doc, "")
    assert "1, 2, 3" in html and "Runs that differ in the seed alone are one" in html


def test_a_seed_without_a_value_leaves_its_candidate_without_rank():
    mixed = replicate({"b": [0.031, 0.021, 0.011], "a": [0.03, 0.02, 0.01]})
    nothing = {"estimate": math.nan, "u": math.nan, "interval": (math.nan, math.nan)}
    mixed[4] = ("a/2", with_coefficient(mixed[4][1], 0, **nothing, no_value="did not settle"))
    (void,) = comparison(mixed)["ranking"]["void"]
    assert void == {"run": 1, "reason": "no value with seed 2: did not settle"}


def test_runs_of_one_candidate_alone_are_compared_as_they_are():
    assert len(comparison(replicate({"a": [0.03, 0.02]}))["runs"]) == 2
    same = replicate({"a": [0.03, 0.02], "b": [0.01, 0.02]})
    names = [r["name"] for r in comparison([*same, ("again", same[0][1])])["runs"]]
    assert names == ["a/1", "a/2", "again", "b"]  # two runs of seed 1: what sets them apart is not the seed


def test_further_measures_rank_for_their_purpose():
    doc = comparison(replicate({"a": [0.03, 0.02, 0.01], "b": [0.0311, 0.0211, 0.0111]}, {"D_I": "Least of all"}))
    (ranked,) = doc["purposes"]
    assert (ranked["name"], ranked["purpose"]) == ("D_I", "Least of all")
    assert [e["place"] for e in ranked["order"]] == [1, 1]  # D_I is the same in all
    assert any(s.startswith("Least of all: no order by D_I") for s in doc["summary"])
    assert any(s.endswith("2 ranks are told apart, each step with a probability of more than 0.999.")
               for s in doc["summary"])  # fmt: skip
    assert "Least of all" in format_ranking(doc) and "Least of all" in comparison_html(doc, "")
