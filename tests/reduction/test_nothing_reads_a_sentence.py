"""Sentences, titles and names are for readers: reworded, all of them, they change no figure, no verdict and no colour.

Every entry of a result is made with other words (its ids stay), as are the sources of error of the set-up.  What looks
for a word finds nothing then: a test that decides by a title or a sentence fails here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gyrobench.frames import rotation
from gyrobench.record.record import Record
from gyrobench.reduction.setup.sources import Effect
from gyrobench.report import render, result_page
from gyrobench.report.result_json import Report
from gyrobench.result import BudgetLine, Reason, Result, Table, Test
from gyrobench.result_entries import TypeB
from gyrobench.system.system import System, load_system

WORDS: dict[type, tuple[str, ...]] = {
    Table: ("title", "caption"),
    Test: ("name", "what", "finding"),
    BudgetLine: ("source", "note"),
    Reason: ("text",),
    TypeB: ("source",),
    Effect: ("note",),
}


def reworded(text: str) -> str:
    """Other letters; digits and signs stay, so that fields in braces do."""
    return re.sub(r"\{[^}]*\}|[^\W\d_]", lambda m: m[0] if m[0].startswith("{") else chr(0x3B1 + ord(m[0]) % 23), text)


@pytest.fixture
def other_words(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for cls, names in WORDS.items():
        made = cls.__init__

        def init(self: Any, *args: Any, made: Any = made, cls: type = cls, names: Any = names, **more: Any) -> None:
            made(self, *args, **more)
            for name in names:
                object.__setattr__(self, name, reworded(getattr(self, name)))

        monkeypatch.setattr(cls, "__init__", init)
    monkeypatch.setattr(Effect, "source", property(lambda e: reworded(e.kind.name)))
    yield


def figures(result: Result) -> dict[str, Any]:
    """All that is not words."""
    content = result.as_dict()
    kept: dict[str, Any] = {
        "coefficients": [{k: v for k, v in c.items() if k != "meaning"} for c in content["coefficients"]],
        "tests": [(t["id"], t["statistic"], t["p"]) for t in content["tests"]],
        "tables": [
            (t["id"], [[x for x in row if not isinstance(x, str)] for row in t["rows"]]) for t in content["tables"]
        ],
        "budget": [(b["id"], b["coefficient"], b["size"], b["contribution"]) for b in content["budget"]],
        "reasons": [(r["id"], r["blocks"], r["names"], r["severity"]) for r in content["reasons"]],
    }
    for key in ("verdict", "condition", "rank", "dof", "residual_std", "correlation", "acf", "repeatability"):
        kept[key] = content[key]
    return kept


def colours(result: Result) -> list[str]:
    """Classes of the cells and boxes of its page, in their order."""
    return re.findall(r'class="([^"]*)"', render.html(result_page.page(Report.of(result), None), None))


def runs() -> list[tuple[str, dict[str, Any], dict[str, tuple[float, float]]]]:
    """System, values and limits: a pass, a fail and a verdict withheld in each."""
    tilted = rotation([0.0, 0.0, 1.0], 2e-4).tolist()
    tumble = {"rate": 0.02, "windows": 36, "dwell": 20.0, "settle": 3.0, "gyro.mount": tilted}
    return [
        ("tumble_single_axis", tumble, {"D_I": (-2.0, 2.0), "D_F": (5.0, 6.0)}),
        ("fixed_position", {"dwell": 600.0}, {"ω_d": (-9.0, 9.0)}),
        ("stabilizer_sdf", {}, {"b_max": (0.0, 90.0)}),
    ]


@pytest.mark.parametrize(("name", "values", "limits"), runs(), ids=[r[0] for r in runs()])
@pytest.mark.long
def test_other_words_change_nothing(
    name: str, values: dict[str, Any], limits: dict[str, tuple[float, float]], request: pytest.FixtureRequest
) -> None:
    from gyrobench.engine.session import Session

    system: System = load_system(name)
    for key, value in values.items():
        system.set(key, value)
    with Session(system) as session:
        record: Record = session.run(seed=3)
    before = system.reduce(record, limits)
    assert {before.verdict, *(c.verdict for c in before.coefficients)} - {"no specification given"}
    seen, drawn = figures(before), colours(before)
    request.getfixturevalue("other_words")
    after = system.reduce(record, limits)
    assert after.warnings != before.warnings or not before.warnings
    np.testing.assert_equal(figures(after), seen)
    assert colours(after) == drawn
