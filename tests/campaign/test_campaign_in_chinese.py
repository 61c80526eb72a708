"""Site of a campaign and comparison of two in Chinese: every sentence of page, table and script."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import synthetic_campaign as synthetic
from commanding import Command

import gyrobench as gb
from gyrobench.bench import standard_folder
from gyrobench.campaign.analysis.campaign_comparison import compare_campaigns
from gyrobench.campaign.execution.store import Campaign
from gyrobench.campaign.site import site_folder
from gyrobench.campaign.site.campaign_comparison_page import write_comparison
from gyrobench.campaign.site.site_folder import SCRIPT, write_site
from gyrobench.report.language import WORD, catalogue

pytestmark = pytest.mark.usefixtures("chinese_font")

HERE = Path(site_folder.__file__).parent
#: of the campaigns that are looked at: their names, questions, instruments, reasons, and what is typed into the filter
OWN = (
    "synthetic|Which gyros of the lot may be delivered.|Where does the latitude spoil the fixed drift.|gyro|name=text|"
)
OWN += "name<number|name>number|u.name.|z.name.|state=failed|row 7: 3 cells, expected 5|no progress in 60 s|"
OWN += "rate [\\d.]+: too close to the pole; at most 75 deg|This record contradicts itself: exchanged mounts.|lot|sweep"


def left(html: str) -> set[str]:
    """Return the English words of a page, of its figures too, but names and texts of the campaign."""
    figures = re.sub(r"<style.*?</style>|<script.*?</script>|<(?!text)[^>]*>", " ", html, flags=re.S)
    spoken = re.findall(r'(?:aria-label|alt|title|placeholder)="([^"]*)"', html)
    text = re.sub(OWN, " ", " ".join([figures, *spoken]).replace("&gt;", ">").replace("&lt;", "<"))
    return set(WORD.findall(text)) - catalogue("zh", HERE).names


def table(folder: Path) -> Any:
    text = (folder / "runs.js").read_text(encoding="utf-8")
    return json.loads(text.removeprefix("window.gyrobenchRuns = ").removesuffix(";\n"))


@pytest.mark.parametrize("kind", ["sweep", pytest.param("lot", marks=pytest.mark.long), "few"])
def test_no_english_sentence_on_a_site(kind: str, tmp_path: Path) -> None:
    """Of a sampled sweep with effects and failures, of a lot with outliers, and of too few runs to say anything."""
    made = {"sweep": (synthetic.sweep, 300), "lot": (synthetic.lot, 40), "few": (synthetic.sweep, 4)}[kind]
    found = gb.site(made[0](tmp_path / "c", made[1]), language="zh")
    html = found.index.read_text(encoding="utf-8")
    assert '<html lang="zh-CN">' in html and "批量运行：c" in html
    assert not left(html)
    runs = table(found.index.parent)
    assert {"序号", "状态", "结论"} < {c["head"] for c in runs["columns"]}
    assert runs["words"]["pass"] == "合格" and runs["words"]["No runs"] == "没有运行"
    assert set(SCRIPT) <= runs["words"].keys()
    assert "All" in json.loads((found.index.parent / "analysis.json").read_text())["answer"][0] or kind != "few"


def test_an_english_site_has_no_words_and_a_reason_without_a_translation_stays(tmp_path: Path) -> None:
    lot = synthetic.lot(tmp_path / "lot", 24)
    write_site(Campaign.open(lot))
    assert "words" not in table(lot / "site") and "<title>Campaign: lot" in (lot / "site/index.html").read_text()
    write_site(Campaign.open(lot), language="zh")
    assert "row 7: 3 cells, expected 5" in (lot / "site/index.html").read_text(encoding="utf-8")


def test_every_text_of_the_script_is_handed_to_it() -> None:
    """site.js says texts of its own by say(), others are values of rows."""
    script = (standard_folder() / "reports/templates/site.js").read_text(encoding="utf-8")
    found = re.findall(r'say\((?:[^"()]*\? )?"([^"]+)"|\[".", "([^"]+)", function', script)
    said = {one or other for one, other in found}
    assert len(said) > 10 and said <= set(SCRIPT)
    words = catalogue("zh", HERE).texts
    assert all(text in words for text in SCRIPT)


def test_no_english_sentence_in_a_comparison_of_campaigns(tmp_path: Path) -> None:
    """In pairs and independent, with differences beyond chance, other settings, a measure that one has alone."""
    a, b = synthetic.sweep(tmp_path / "sweep", 300), synthetic.sweep(tmp_path / "lot", 200, seed=2)
    document = json.loads((b / "campaign.json").read_text())
    document |= {"options": {"gyro": 5.0}, "versions": {"numpy": "2"}}
    (b / "campaign.json").write_text(json.dumps(document))
    for one, two, said in ((a, b, "两批按独立比较"), (a, a, "全部逐位相同")):
        doc = compare_campaigns(Campaign.open(one), Campaign.open(two))
        doc["tests"][0] |= {"beyond_chance": True}
        doc["only"] = [["D_F"], ["D_I"]]
        written = write_comparison(doc, tmp_path / "out", standard_folder(), "zh")
        html = written["html"].read_text(encoding="utf-8")
        assert said in html and not left(html)


def test_the_commands_have_the_language(gyrobench: Command, tmp_path: Path) -> None:
    few = synthetic.sweep(tmp_path / "few", 4)
    assert gyrobench("site", str(few), "--language", "zh")[0] == 0
    assert "批量运行：few" in (few / "site/index.html").read_text(encoding="utf-8")
    assert "no such language; there are: en, zh" in gyrobench("site", str(few), "--language", "xx")[2]
    out = tmp_path / "out"
    assert gyrobench("compare", str(few), str(few), "--out", str(out), "--language", "zh")[0] == 0
    assert "比较：few, few" in (out / "comparison.html").read_text(encoding="utf-8")
