"""Pages in Chinese: every text of the catalogue, no English sentence, no box in place of a character."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import replace
from pathlib import Path

import pytest
from certified import certified
from option_texts import option_texts
from reading import pdf_text

from gyrobench.bench import UsageError, standard_folder
from gyrobench.record.run_document import SetupError
from gyrobench.report import fonts, language, write
from gyrobench.report.certificate_page import page
from gyrobench.report.laboratory import Laboratory, read_laboratory
from gyrobench.report.language import ENGLISH, PLACEHOLDER, WORD, Language, UntranslatedError, catalogue
from gyrobench.report.page_model import BulletList, PageTable, Row, columns, text_cell
from gyrobench.report.plots import short
from gyrobench.report.render import html, pdf
from gyrobench.report.standard_names import NAMES, names_table
from gyrobench.result import Reason

pytestmark = pytest.mark.usefixtures("chinese_font")

FILES = sorted(
    [
        *language.FOLDER.glob("*.toml"),
        *standard_folder().glob("systems/*/zh.toml"),
        language.FOLDER.parents[1] / "campaign/site/zh.toml",
    ]
)
LABORATORY = Laboratory.model_validate({"name": "惯性实验室", "address": ["示例路 1 号"], "language": "zh"})
OPTION = re.compile(r"\w+ = \"?[\w.]+\"?")  # as it is written: type_b = none
TEXTS = {
    "Constant drift": "常值漂移",
    "{x} of {y} = {n} {unit}": "{y} 的{x} = {n} {unit}",
    "no value": "无值",
    "time": "时间",
    "Record longer.": "延长记录。",
    "Use {v}.": "请用 {v}。",
}


def small(**more: object) -> Language:
    chinese = catalogue("zh")
    return Language(language.Catalogue("zh", TEXTS, chinese.names, chinese.joints), **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("file", FILES, ids=lambda f: f"{f.parent.name}-{f.stem}")
def test_both_languages_of_a_line_have_the_same_placeholders_and_no_word_is_left(file: Path) -> None:
    content = language._read(file)
    names = {*catalogue("zh").names, *content.get("names", ())}
    options = option_texts(file)
    for english, said in content["texts"].items():
        assert sorted(PLACEHOLDER.findall(english)) == sorted(PLACEHOLDER.findall(said)), english
        values = set(WORD.findall(english)) if english in options else set()  # are written as they are in a command
        rest = set(WORD.findall(OPTION.sub("", PLACEHOLDER.sub("1", said)))) - names - values
        assert said.strip() and not rest, f"{said}: {rest}"


@pytest.mark.parametrize(
    ("english", "said"),
    [
        ("constant drift", "常值漂移"),
        ("Constant drift: no value", "常值漂移：无值"),
        ("Constant drift of D_F = −0.30 ± 0.01 °/h", "D_F 的常值漂移 = −0.30 ± 0.01 °/h"),
        ("Record longer. No value.", "延长记录。无值。"),
        ("time / h", "时间 / h"),
        ("no value (D_F, D_I)", "无值（D_F, D_I）"),
        ("2026-03-14 09:30 UTC", "2026年3月14日 09:30 UTC"),
        ("Use --step 0.1ms.", "请用 --step 0.1ms。"),
        ("gyro.D_I and u_scale of floated.toml", None),
        ("the drift wanders", None),
        ("Constant drift of the drift = 1 m", None),
    ],
)
def test_a_text_is_said_whole_or_not_at_all(english: str, said: str | None) -> None:
    words = small()
    assert words.find(english) == said
    words.text(english)
    assert list(words.missing) == ([] if said else [english])


def test_texts_of_the_user_stay_names_stay_where_they_are_no_text() -> None:
    words = small(own=frozenset({"no value"}), names=frozenset({"time", "table"}))
    assert (words.text("no value"), words.text("table"), words.text("time")) == ("no value", "table", "时间")


@pytest.mark.parametrize("file", FILES, ids=lambda f: f"{f.parent.name}-{f.stem}")
def test_no_line_lets_a_sentence_of_english_through(file: Path) -> None:
    """Lines of little but placeholders ("{v} in {v2}") fit parts of many sentences: English in them is refused."""
    words = Language(catalogue("zh", None if file.parent == language.FOLDER else file.parent))
    for english in language._read(file)["texts"]:
        kinds = PLACEHOLDER.findall(english)
        if all(language.NUMERIC.fullmatch(k) for k in kinds):
            continue
        filled = PLACEHOLDER.sub(
            lambda m: "3" if language.NUMERIC.fullmatch(m[1]) else "the platform wobbles twice a turn", english
        )
        assert words.find(filled) is None, english


def test_warnings_of_rows_and_of_set_up_errors_in_chinese() -> None:
    """As outliers.py and run_document.py put them together."""
    words = Language(catalogue("zh"))
    error = SetupError(parameter="site.latitude", value=-0.5, assumed=0.8, unit="rad", option="latitude")
    rows = "4 (+0.3 °/h, 9 standard deviations); 9 (−0.3 °/h, 8 standard deviations)"
    ask = "Look for the cause, and leave them out only if it is one."
    said = [
        error.sentence(),
        error.model_copy(update={"option": ""}).sentence(),
        f"Possible causes among the values set: set-up error {error.comparison()}; part gyro_x in slot gyro.",
        f"Rows {rows} and 3 more lie outside the noise of the others. They are in the estimates; without them "
        f"Constant drift = 0.25 °/h (u = 0.03) in place of 0.3 (u = 0.05). {ask}",
    ]
    for english in said:
        found = words.find(english)
        assert found is not None and not english_words(found, {"set", "latitude", "gyro"}), found or english


def test_up_is_a_word() -> None:
    """A label whose one word it is was taken for a name, and stayed."""
    words = Language(catalogue("zh", standard_folder() / "systems" / "vibration_rectification"))
    texts = ["up, 1 g", "down, 1.4 g", "x up, 1 g rms", "up, about north"]
    assert [words.text(t) for t in texts] == ["朝上，1 g", "朝下，1.4 g", "x 向上，1 g rms", "朝上，绕北向"]


def english_words(text: str, allowed: set[str]) -> set[str]:
    """Return the words of a text in PDF that are neither names of the catalogue nor allowed."""
    return set(WORD.findall(OPTION.sub("", text))) - catalogue("zh").names - allowed


@pytest.mark.parametrize("count", [1, 3])
def test_no_english_sentence_and_no_box_in_a_chinese_certificate(count: int, tmp_path: Path) -> None:
    made = page([certified(k) for k in range(count)], LABORATORY, "2026-1")
    file = tmp_path / "c.pdf"
    file.write_bytes(pdf(made))
    text = pdf_text(file)
    assert "证书结束" in text and "固定位置测试" in text and "2026年3月12日" in text.replace(" ", "")
    assert not english_words(text, {"ab" * 32, "last"})
    assert '<html lang="zh-CN">' in html(made)
    every_character_has_a_font(file, text)


def every_character_has_a_font(file: Path, text: str) -> None:
    """Check that of the fonts that a PDF names one has each of its characters."""
    named = {n.decode() for n in re.findall(rb"/BaseFont\s*/(?:[A-Z]{6}\+)?([\w-]+)", file.read_bytes())}
    assert any("CJK" in n or "SC" in n for n in named), named
    has = set(map(chr, fonts._own()))
    for font, characters in fonts._machine(None):
        chosen = font.of("zh")
        if any(n.lower().startswith(chosen.family.replace(" ", "").lower()) for n in named):
            has |= characters
    assert not {c for c in unicodedata.normalize("NFKC", text) if c.isprintable() and c not in has}


def test_what_has_no_translation_is_named_by_its_id_never_left_out() -> None:
    odd = Reason("odd.reason", "The moon was full.")
    made = page([certified(0, reasons=[odd], method="By the moon.")], LABORATORY, "1")
    (remarks,) = (b for s in made.sections if s.slug == "remarks" for b in s.blocks if isinstance(b, BulletList))
    assert remarks.items == ["备注 odd.reason：内容见报告。"] and dict(made.head)["测试方法"] == "见报告"


def test_verdicts_keep_their_sign_and_colour(tmp_path: Path) -> None:
    judged = [replace(c, limit=(-9.0, 9.0), verdict="pass") for c in certified(0).report.result.coefficients]
    made = page([certified(0, coefficients=judged)], LABORATORY, "1")
    (values, *_) = (b for s in made.sections for b in s.blocks if isinstance(b, PageTable))
    assert (values.rows[0].cells[-1].mark, values.rows[0].cells[-1].text) == ("pass", "合格")
    (tmp_path / "c.pdf").write_bytes(pdf(made))
    assert "✓ 合格" in pdf_text(tmp_path / "c.pdf")


@pytest.mark.long
def test_a_report_in_chinese_and_what_it_lacks(tmp_path: Path) -> None:
    found = certified(0).report.result
    written = write(found, tmp_path, language="zh")
    text = pdf_text(written["pdf"])
    run = found.provenance
    names = {*run["options"], *run.get("parameters", {}), *run.get("versions", {}), "result", "json", "docs", "methods"}
    assert not english_words(text, names | {"errata", "auto", "current", "last"})
    every_character_has_a_font(written["pdf"], text)
    with pytest.raises(UntranslatedError, match=r"the report of fixed_position has 1 sentence without a translation"):
        write(certified(0, reasons=[Reason("odd", "The moon was full.")]).report.result, tmp_path / "b", language="zh")
    assert not (tmp_path / "b" / "report.html").exists()


def test_a_test_without_its_texts_is_refused_before_it_runs(tmp_path: Path) -> None:
    (tmp_path / "systems" / "mine").mkdir(parents=True)
    with (
        pytest.raises(UsageError, match="the report of mine has no translation, it would be half English"),
        language.reports_in("zh", "mine", tmp_path),
    ):
        pass
    with pytest.raises(UsageError, match="xx: no such language; there are: en, zh"), language.reports_in("xx", "a"):
        pass
    with language.reports_in("zh", "fixed_position"):
        assert language.chosen() == "zh"
    assert language.chosen() == ENGLISH


def test_what_a_name_says_is_said_with_the_name_and_a_name_broken_in_a_figure_stays() -> None:
    words = small(names=frozenset({"angle_x_read", "in_position"}))
    said = words.find("gx: Constant drift, time. gy: Constant drift, no value.")
    assert said == "gx：常值漂移，时间。gy：常值漂移，无值。"
    assert words.find("angle_\nx_\nread\nin_\nposition") == "angle_\nx_\nread\nin_\nposition"


def test_a_label_is_shortened_in_the_language_of_the_page() -> None:
    """Of ten letters 常值漂移 takes eight, so that one more character and the sign of the cut do not fit."""
    texts = {**TEXTS, "Constant drift of the gyro": "常值漂移，陀螺仪", "Constant drift in time": "常值漂移：时间"}
    chinese = catalogue("zh")
    words = Language(language.Catalogue("zh", texts, chinese.names, chinese.joints))
    token = language._in_use.set(words)
    try:
        shown = [short(t, 10) for t in ("Constant drift of the gyro", "Constant drift in time", "time")]
    finally:
        language._in_use.reset(token)
    assert shown == ["常值漂移…", "常值漂移", "时间"]
    assert [words.text(t) for t in shown] == shown and not words.missing
    assert short("Constant drift of the gyro", 10) == "Constant …"


def test_a_suite_has_the_texts_of_its_tests_and_its_own_come_first(tmp_path: Path) -> None:
    for name, lines in {"suite": '"a" = "甲"', "one": '"a" = "乙"\n"b" = "丙"'}.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "zh.toml").write_text(f"report = {str(name == 'suite').lower()}\n[texts]\n{lines}\n")
    found = catalogue("zh", tmp_path / "suite", tmp_path / "one")
    assert (found.texts["a"], found.texts["b"], found.reports) == ("甲", "丙", True)


def test_whole_reports_are_all_but_those_that_the_guide_names() -> None:
    text = (standard_folder() / "docs" / "guides" / "run_a_test.md").read_text()
    (said,) = re.findall(r"All tests have their certificate(.+?)their whole report", " ".join(text.split()))
    systems = {f.parent.name for f in standard_folder().glob("systems/*/system.py")}
    whole = {name for name in systems if catalogue("zh", language.system_folder(name)).reports}
    assert set(re.findall(r"`(\w+)`", said)) == systems - whole and whole


def test_a_profile_says_the_language(tmp_path: Path) -> None:
    file = tmp_path / "laboratory.toml"
    file.write_text('name = "A"\naddress = ["b"]\nlanguage = "zh"\n')
    assert read_laboratory(file).language == "zh"
    file.write_text('name = "A"\naddress = ["b"]\nlanguage = "klingon"\n')
    with pytest.raises(UsageError, match="no such language; there are: en, zh"):
        read_laboratory(file)


def test_names_in_standards_both_ieee_and_chinese() -> None:
    """IEEE's in English, as the standard has it, the other in Chinese; none where only one defines the quantity."""
    one = certified(0).report.result["ω_d"]
    made = page([certified(0, coefficients=[replace(one, meaning="angle random walk")])], LABORATORY, "1")
    found = [b for s in made.sections for b in s.blocks if isinstance(b, PageTable)][1]
    assert [c.text for c in found.rows[0].cells] == [
        "ω_d", "IEEE Std 952", "angle random walk", "GJB 2426A-2015", "随机游走系数",
    ]  # fmt: skip
    assert all(catalogue("zh").texts[n.gjb[1]] for n in NAMES.values())
    assert not names_table([one])


def test_a_word_of_two_senses_is_said_by_its_unit_or_its_column_and_a_name_in_a_drawing_stays() -> None:
    texts = {
        "phase": "阶段",
        "phase / °": "相位 / °",
        "step": "步长",
        "shape: step": "阶跃",
        "shape": "波形",
        "Table": "表",
    }
    chinese = catalogue("zh")
    names = frozenset({"table", "motion_angle", "gate", "error in the field"})
    words = Language(language.Catalogue("zh", texts, chinese.names, chinese.joints), names=names)
    table = PageTable(
        columns("phase", ("phase", "°"), "shape"), [Row([text_cell(t) for t in ("phase", "", "step")])], ""
    )
    words._block(table)
    assert [c.head for c in table.columns] == ["阶段", "相位", "波形"]
    assert [c.text for c in table.rows[0].cells] == ["阶段", "", "阶跃"] and words.text("step") == "步长"
    assert [words.text(t) for t in ("table", "motion_\nangle\ngate", "2\ntable")] == [
        "table",
        "motion_\nangle\ngate",
        "2\ntable",
    ]
    assert words.text("error in the…") == "error in the field" and not words.missing
