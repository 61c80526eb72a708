"""The table of a result in the terminal: names of measures have their meaning beside them."""

from __future__ import annotations

from dataclasses import replace

from gyrobench.report.plain_text import WIDTH, format_result
from gyrobench.result import Coefficient, LoopResult, Reason


def test_measures_have_their_meanings_beside_them() -> None:
    long = "share of the gain at which the loop becomes unstable, " * 3
    rows = [
        Coefficient("θ*", "platform angle under the load, at rest", "″", 12.547, 0.037, 1.96, (12.47, 12.62)),
        Coefficient("S", long.strip(), "N·m/rad", 16439.0, 49.0, 1.96, (16343.0, 16535.0)),
    ]
    result = LoopResult(
        system="s", title="Loop", method="", sources=[], conventions=[], coefficients=rows, responses=[],
        summary=["Crossover 10.15 ± 0.39 Hz (95 %)."],
    )  # fmt: skip
    text = format_result(result)
    lines = text.splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("coefficient"))
    at = lines[head].index("meaning")
    assert lines[2] == "Crossover 10.15 ± 0.39 Hz (95 %)." and head == 4
    assert lines[head + 1][at:] == "platform angle under the load, at rest"
    assert " ".join(line[at:] for line in lines[head + 2 :]).strip() == long.strip()  # wrapped beneath itself
    assert max(map(len, lines)) <= WIDTH


def test_what_speaks_against_a_record_is_said_without_a_verdict_too() -> None:
    """A doubt takes a verdict away; where none was asked for it is still said, but not what was left unstated, and not
    twice where the reason of an inconclusive verdict has its words."""
    reasons = [
        Reason("noise.none", "The data lie on the model.", ("pass",), severity="doubt"),
        Reason("type_b.unstated", "No type B.", ("pass",), severity="doubt"),
        Reason("level.shift", "The level is another one.", ("pass",), severity="doubt"),
        Reason("noise.none", "The data lie on the model."),  # in the report, too, with what is not judged
        Reason("verdict.withheld:level.shift", "Inconclusive: The level is another one.", severity="error"),
    ]
    result = LoopResult(
        system="s", title="Loop", method="", sources=[], conventions=[], responses=[], reasons=reasons,
        coefficients=[Coefficient("S", "stiffness", "N·m/rad", 16439.0, 49.0, 1.96, (16343.0, 16535.0))],
    )  # fmt: skip
    warnings = [line for line in format_result(result).splitlines() if line.startswith("warning: ")]
    assert warnings == ["warning: The data lie on the model.", "warning: Inconclusive: The level is another one."]


def test_mistakes_that_no_residual_shows_are_named_where_no_verdict_is() -> None:
    """A tumble with its current reversed fits as well as the truth: all signs of its coefficients are wrong."""
    unshown = Reason("arrangement.unstated", "No residual shows: the reading reversed.", ("pass",), severity="doubt")
    withheld = Reason("verdict.withheld:arrangement.unstated", "Inconclusive: no residual would show", severity="error")
    result = LoopResult(
        system="s", title="Tumble", method="", sources=[], conventions=[], responses=[], reasons=[unshown],
        coefficients=[Coefficient("D_F", "drift", "°/h", 0.28, 0.03, 1.96, (0.22, 0.34))],
    )  # fmt: skip
    assert "\nnote: No residual shows: the reading reversed." in format_result(result)
    judged = replace(result, verdict="inconclusive", reasons=[unshown, withheld])
    text = format_result(judged)
    assert "note:" not in text and "\nwarning: Inconclusive: no residual would show" in text
