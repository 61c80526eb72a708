"""Comparisons of runs in Chinese: every sentence, every label, no English word but names and values."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path
from typing import Any

import pytest
from certified import certified
from other_results import with_coefficient
from reading import pdf_text

from gyrobench.bench import UsageError
from gyrobench.report import compare, comparison_page, comparison_summary
from gyrobench.report.language import WORD, Language, catalogue, system_folder
from gyrobench.report.report_files import own_texts
from gyrobench.report.result_json import Report
from gyrobench.result import Result
from gyrobench.workflow.run_comparison import compare_results

pytestmark = pytest.mark.usefixtures("chinese_font")

NOTHING = {"estimate": math.nan, "u": math.nan, "interval": (math.nan, math.nan)}


def run(value: float, seed: int | None = None, purposes: dict[str, str] | None = None, **own: Any) -> Result:
    """Return a result of the fixed position with this estimate; own: of its run.json."""
    found = certified(1, ranked_by="ω_d", purposes=purposes or {}, simulated=seed is not None).report.result
    changed = with_coefficient(found, 0, estimate=value, u=0.001, k=2.0, interval=(value - 0.002, value + 0.002))
    known = {} if seed is None else {"seed": seed, "parameters": {"gyro.seed": seed, "gyro.H": own.pop("H", 0.2)}}
    return dataclasses.replace(changed, provenance={**found.provenance, **known, **own})


def said(results: list[tuple[str, Result]]) -> list[str]:
    """Return the summary of a comparison in Chinese; all of it has a translation."""
    doc = comparison_page.comparison(results)
    own, names = own_texts(Report.of(results[0][1]))
    words = Language(
        catalogue("zh", system_folder("fixed_position")),
        frozenset({*own, *comparison_page.own_texts(doc)}),
        frozenset(names),
    )
    found = [words.text(s) for s in doc["summary"]]
    assert not words.missing
    return found


def test_the_sentences_of_a_summary() -> None:
    """U of a difference: 2 sqrt(2) 0.001 = 0.0028."""
    first, last, order = said([("a", run(0.01, 1)), ("a run with a long name, twice", run(0.05, 1, H=0.3))])[:3]
    assert (
        first.startswith("B (a run with a long name, twice) 与 A (a) 不同：ω_d（")
        and "相差 +0.0400 ± 0.0028 °/h；" in first
    )
    assert (
        last == "设置不同：参数 gyro.H。" and order.startswith("ω_d（") and "最小的是 A (a)。可区分 2 个名次" in order
    )
    same = said([("a", run(0.01, 1)), ("b", run(0.01, 1))])
    assert same[0] == "B (b) 与 A (a) 的全部 1 个量在差值的不确定度范围内一致。"
    assert same[1] == "部件、选项和参数均相同。" and same[2].startswith("按ω_d（") and same[2].endswith("无法区分。")


@pytest.mark.parametrize(
    ("english", "chinese"),
    [
        (["option dwell", "parameter gyro.H", "part table: name", "plan phase 1, dwell", "plan phase 2, dwell"],
         "部件 table，选项 dwell，参数 gyro.H，计划"),
        (["option dwell", "option settle", "site latitude / °"], "选项 dwell，选项 settle，地点：纬度 / °"),
        (["part gyro: name", *(f"option a{k}" for k in range(9))], "部件 gyro，选项 a0，选项 a1，选项 a2，另有 6 项"),
    ],
)  # fmt: skip
def test_what_is_set_differently(english: list[str], chinese: str) -> None:
    text = comparison_summary._settings(english)
    assert Language(catalogue("zh")).find(text) == f"设置不同：{chinese}。"


def test_several_differences_in_one_sentence() -> None:
    measures = [
        {"name": n, "meaning": m, "unit": u}
        for n, m, u in (("D_F", "drift (mean)", "°/h"), ("N", "gain, at 1 Hz", "1"))
    ]
    differences = [{"value": 0.5, "u": 0.05, "U": 0.1, "significant": True, "beyond_chance": True}]
    doc = {"measures": [{**m, "differences": [None, *differences]} for m in measures]}
    text = comparison_summary._differs(doc, 1, "B (b)", "A (a)")
    texts = {**catalogue("zh").texts, "drift (mean)": "漂移（平均）", "gain, at 1 Hz": "1 Hz 处增益"}
    words = Language(dataclasses.replace(catalogue("zh"), texts=texts))
    both = "D_F（漂移（平均））相差 +0.50 ± 0.10 °/h，N（1 Hz 处增益）相差 +0.50 ± 0.10"
    assert words.find(text) == f"B (b) 与 A (a) 不同：{both}；2 个量中 0 个一致。"


def left(path: Path, allowed: set[str]) -> set[str]:
    """Return the English words of a page, but names of the catalogue and those of rows of settings."""
    text = pdf_text(path)
    rows = [line for line in text.splitlines() if not re.match(r"\s*(参数|选项|部件|计划阶段|版本|执行顺序)", line)]
    return set(WORD.findall("\n".join(rows))) - catalogue("zh").names - allowed


@pytest.mark.long
def test_no_english_sentence_in_a_comparison(tmp_path: Path) -> None:
    """Ranked, for a purpose too, with seeds in pairs, without a value, and lists that are cut short."""
    plan = [{"phase": k, "label": "to the start of it all", "dwell": 60.0 * k} for k in range(1, 9)]
    purpose = {"ω_d": "Temperature"}
    runs = [(f"a/{s}", run(0.01 + 0.001 * s, s, purpose, plan=plan)) for s in (1, 2)]
    runs += [(f"b/{s}", run(0.05 + 0.001 * s, s, purpose, plan=plan, H=0.3)) for s in (1, 2)]
    void = [
        with_coefficient(run(0.0, s, purpose, plan=plan[:5], H=0.4), 0, **NOTHING, no_value="white") for s in (1, 2)
    ]
    runs += [(f"c/{s}", result) for s, result in enumerate(void, 1)]
    written = compare(runs, tmp_path, ("html", "pdf"), language="zh")
    assert not left(written["pdf"], {"fixed", "native", "dwell"})
    assert '<html lang="zh-CN">' in written["html"].read_text(encoding="utf-8")
    assert not (tmp_path / "comparison.json").exists()


def test_a_test_without_its_texts_is_refused() -> None:
    results = [(name, dataclasses.replace(run(0.01), system="mine")) for name in "ab"]
    with pytest.raises(UsageError, match="the report of mine has no translation"):
        compare_results(results).write(Path("nowhere"), language="zh")
    assert not Path("nowhere").exists()
