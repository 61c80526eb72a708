"""The rule of the verdict (docs/verdict.md): intervals and limits, reasons, the worst of all; frozen results."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Iterator
from dataclasses import FrozenInstanceError, replace
from pathlib import Path
from typing import Any

import pytest

import gyrobench
from gyrobench.bench import standard_folder
from gyrobench.reduction.estimation.verdict import assess_conformity, conclude, worst_verdict
from gyrobench.result import NO_VERDICT, Coefficient, LoopResult, Reason

ROOMS = (Path(gyrobench.__path__[0]) / "reduction", standard_folder() / "systems")


def found(*reasons: Reason, **intervals: tuple[float, float]) -> LoopResult:
    """Findings with a coefficient for each interval."""
    each = [Coefficient(n, "", "V", sum(i) / 2.0, 0.1, 2.0, i) for n, i in intervals.items()]
    return LoopResult(method="m", sources=[], conventions=[], coefficients=each, responses=[], reasons=list(reasons))


@pytest.mark.parametrize(
    ("interval", "limit", "verdict"),
    [
        ((1.0, 2.0), (1.0, 2.0), "pass"),  # the limits belong to it
        ((1.0, 2.0), (0.0, 1.5), "inconclusive"),
        ((1.0, 2.0), (2.1, 3.0), "fail"),
        ((1.0, 2.0), (2.0, 3.0), "inconclusive"),  # they touch
        ((1.0, 2.0), (None, 2.5), "pass"),
        ((1.0, 2.0), (None, 0.5), "fail"),
        ((math.nan, math.nan), (0.0, 1.0), "void"),
        ((1.0, 2.0), (None, None), NO_VERDICT),
        ((1.0, 2.0), None, NO_VERDICT),
    ],
)
def test_an_interval_and_limits(interval: Any, limit: Any, verdict: str) -> None:
    assert assess_conformity(interval, limit) == verdict


def test_the_worst_of_all() -> None:
    assert worst_verdict(["pass", "inconclusive", "fail"]) == "fail"
    assert worst_verdict(["pass", "void", "fail"]) == "void"
    assert worst_verdict(["pass", NO_VERDICT]) == "pass" and worst_verdict([NO_VERDICT]) == NO_VERDICT


def test_reasons_take_away_what_they_block() -> None:
    """Of the coefficients that they name, or of all; a pass that nothing blocks stands, and so does a fail."""
    limits = {"a": (0.0, 3.0), "b": (0.0, 3.0), "c": (5.0, 6.0)}
    values = {n: (1.0, 2.0) for n in "abc"}

    def verdicts(*reasons: Reason) -> list[str]:
        return [c.verdict for c in conclude(found(*reasons, **values), None, limits).coefficients]

    assert verdicts() == ["pass", "pass", "fail"]
    assert verdicts(Reason("x", "", ("pass",), ("b",))) == ["pass", "inconclusive", "fail"]
    assert verdicts(Reason("x", "", ("pass", "fail"))) == ["inconclusive"] * 3
    assert verdicts(Reason("x", "", ("pass", "fail"), becomes="void")) == ["void"] * 3
    assert verdicts(Reason("x", "no more than said")) == ["pass", "pass", "fail"]
    wide = Reason("x", "", ("pass", "fail"), intervals={"a": (-1.0, 4.0), "b": (0.5, 2.5)})
    assert verdicts(wide) == ["inconclusive", "pass", "fail"]  # a alone would have another verdict


def test_what_is_taken_away_is_said_first() -> None:
    reason = Reason("x", "The mount is loose.", ("pass",), severity="doubt")
    result = conclude(found(Reason("w", "A remark."), reason, a=(1.0, 2.0)), None, {"a": (0.0, 3.0)})
    assert result.warnings == ["Inconclusive instead of pass: a. The mount is loose.", "A remark."]
    assert result.withheld == ["The mount is loose."] and result.verdict == "inconclusive"


def test_a_result_is_not_changed() -> None:
    result = conclude(found(a=(1.0, 2.0)), None, {"a": (0.0, 3.0)})
    for holder, name in (
        (result, "verdict"),
        (result.coefficients[0], "verdict"),
        (result.coefficients[0], "estimate"),
    ):
        with pytest.raises(FrozenInstanceError):
            setattr(holder, name, "pass")


def written_verdicts() -> Iterator[str]:
    """Places in reductions and systems where a call or a replacement is given a verdict."""
    for room in ROOMS:
        for file in sorted(room.rglob("*.py")):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Call) and any(k.arg == "verdict" for k in node.keywords):
                    yield f"{file.name}:{ast.unparse(node.func)}"
                if isinstance(node, ast.Assign | ast.AugAssign | ast.AnnAssign):
                    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                    if any(isinstance(t, ast.Attribute) and t.attr == "verdict" for t in targets):
                        yield f"{file.name}:{ast.unparse(node)}"


@pytest.mark.long
def test_one_function_writes_verdicts() -> None:
    """SuiteQuantity has a word of comparison (agree, disagree)."""
    assert set(written_verdicts()) == {"verdict.py:replace", "method_comparison.py:result_suite.SuiteQuantity"}


def test_finished_sentences_are_not_rewritten() -> None:
    """Their numbers were written where they were made: a name that looks like one stays."""
    text = "1.5e+02.csv: 1.7e+02"
    result = conclude(replace(found(Reason("r", text), a=(1.0, 2.0)), conventions=[text], summary=[text]))
    assert [r.text for r in result.reasons] == result.conventions == result.summary == [text]


#: files whose sentences are said before a run, and texts that a program reads
BEFORE = {
    "system",
    "refusals",
    "measured",
    "planning",
    "plans",
    "design",
    "row_checks",
    "window_checks",
    "geometry",
    "log",
}
READ = {
    "sentences",
    "step_effect",
    "table_errors",
    "description",
    "table_supervision",
    "table_rate_test",
    "closed",
    "log",
}


def formatted() -> Iterator[str]:
    """Yield the numbers of f-strings of reductions that are written with few digits, but not by ``plain``."""
    root = standard_folder()
    for file in [*root.glob("systems/**/*.py"), *root.glob("gyrobench/reduction/**/*.py")]:
        if not (BEFORE | READ).isdisjoint({file.stem, file.parent.name}):
            continue
        tree = ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        for node in (n for n in tree if isinstance(n, ast.FormattedValue) and n.format_spec is not None):
            if re.fullmatch(r"f'[+]?[.]\dg'", ast.unparse(node.format_spec)):
                yield f"{file.parent.name}/{file.name}: {ast.unparse(node.value)}"


@pytest.mark.long
def test_numbers_of_sentences_are_written_by_one_function() -> None:
    assert list(formatted()) == []
