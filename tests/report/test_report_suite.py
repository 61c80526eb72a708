"""Page of a suite: which method deviates is drawn by its label, whatever the sentence beside it says."""

from __future__ import annotations

import dataclasses
import re

import pytest
from other_results import with_coefficient
from simulated import tumble

from gyrobench.record.run_document import SuiteTestRun
from gyrobench.reduction.suite.method_comparison import Member, combine_methods
from gyrobench.report import render, report_files
from gyrobench.report.result_json import Report
from gyrobench.report.style import VERMILION
from gyrobench.result import Result, SuiteResult


@pytest.fixture(scope="module")
def suite() -> SuiteResult:
    """Three tests of one gyro, the D_I of the third one too large by 1 °/h/g: hundreds of its u."""
    results = [dataclasses.replace(tumble(seed=k, windows=12), provenance={}) for k in (1, 2, 3)]
    results[2] = with_coefficient(results[2], 1, estimate=results[2].coefficients[1].estimate + 1.0)
    members = {f"test {k}": Member(r, SuiteTestRun(folder=f"run{k}")) for k, r in enumerate(results)}
    return combine_methods(members, system="suite", title="Suite", method="means", sources=[])


def drawn(suite: SuiteResult) -> list[str]:
    """Figures of the measurands, in which the deviating method has a colour and a square of its own."""
    return [p.svg for p in report_files.page(Report.of(suite)).pictures if p.key.startswith("forest")]


def colours(suite: SuiteResult) -> list[str]:
    return re.findall(r'class="([^"]*)"', render.html(report_files.page(Report.of(suite)), None))


@pytest.mark.long
def test_the_deviating_method_is_known_by_its_label(suite: SuiteResult) -> None:
    assert {q.name: q.deviating for q in suite.suite.quantities if q.verdict == "disagree"} == {"D_I": "test 2"}
    coloured = [VERMILION in svg for svg in drawn(suite)]
    assert coloured == [q.name == "D_I" for q in suite.suite.quantities]


@pytest.mark.long
def test_other_words_change_no_figure_and_no_colour(suite: SuiteResult) -> None:
    quantities = [dataclasses.replace(q, words="Other words.") for q in suite.suite.quantities]
    other = dataclasses.replace(suite, suite=dataclasses.replace(suite.suite, quantities=quantities))
    assert drawn(other) == drawn(suite) and colours(other) == colours(suite)


def test_a_suite_comes_back_from_its_dictionary(suite: SuiteResult) -> None:
    assert Result.from_dict(suite.as_dict()) == suite
