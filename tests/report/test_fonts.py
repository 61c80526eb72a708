"""Texts in any script: a font that has the characters, or no PDF; never boxes."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
from fontTools.fontBuilder import FontBuilder
from fontTools.pens.ttGlyphPen import TTGlyphPen
from other_results import unplotted
from simulated import tumble

from gyrobench import report
from gyrobench.report import fonts
from gyrobench.report.style import WIDE, figure, styled, svg

NAME = "测量"


@pytest.fixture
def bare_machine(monkeypatch):
    """A machine without fonts of its own."""
    monkeypatch.setattr("matplotlib.font_manager.findSystemFonts", lambda: [])
    fonts._machine.cache_clear()
    yield
    fonts._machine.cache_clear()


def square_font(path: Path, family: str, characters: str) -> None:
    """Write a font whose characters are filled squares."""
    pen = TTGlyphPen(None)
    for k, point in enumerate([(50, 0), (50, 700), (750, 700), (750, 0)]):
        (pen.lineTo if k else pen.moveTo)(point)
    pen.closePath()
    square = pen.glyph()
    names = [".notdef", *(f"uni{ord(c):04X}" for c in characters)]
    builder = FontBuilder(1000, isTTF=True)
    builder.setupGlyphOrder(names)
    builder.setupCharacterMap(dict(zip(map(ord, characters), names[1:], strict=True)))
    builder.setupGlyf({name: square for name in names})
    builder.setupHorizontalMetrics({name: (800, 50) for name in names})
    builder.setupHorizontalHeader(ascent=800, descent=-200)
    builder.setupNameTable({"familyName": family, "styleName": "Regular", "psName": family.replace(" ", "")})
    builder.setupOS2(sTypoAscender=800, usWinAscent=800, usWinDescent=200)
    builder.setupPost()
    path.parent.mkdir(parents=True)
    builder.save(path)


def result_of(instrument: str):
    return dataclasses.replace(unplotted(tumble()), instrument=instrument)


def test_latin_greek_cyrillic_and_units_need_no_other_font(bare_machine):
    assert fonts.fonts_for(["ω_d = −0.4 ± 0.1 °/h ″ µ √Hz Ω ≤ γ²", "Гироскоп № 3", "é ß ø ñ"]) == []


@pytest.mark.long
def test_no_font_no_pdf_the_other_files_stand(bare_machine, tmp_path):
    with pytest.raises(report.ReportError, match=r"report\.pdf.*no font of this machine has 测量; they would be") as e:
        report.write(result_of(f"gyro {NAME}"), tmp_path)
    assert set(e.value.written) == {"json", "html"} and NAME in (tmp_path / "report.html").read_text("utf-8")


@pytest.mark.long
def test_a_font_of_the_bench_is_taken_and_no_other(bare_machine, tmp_path):
    square_font(tmp_path / "reports" / "fonts" / "own.ttf", "Own Squares", NAME)
    (found,) = fonts.fonts_for([NAME], tmp_path)
    assert found.family == "Own Squares"
    pdf = report.write(result_of(f"gyro {NAME}"), tmp_path / "out", ["pdf"], bench=tmp_path)["pdf"].read_bytes()
    assert b"OwnSquares" in pdf and b"LastResort" not in pdf


def test_the_fewest_fonts_that_have_all(monkeypatch):
    several = [(fonts.Font(Path(n), n), frozenset(c)) for n, c in (("a", "测"), ("b", "测量"), ("c", "量ม"))]
    monkeypatch.setattr(fonts, "_machine", lambda folder: several)
    assert [f.family for f in fonts.fonts_for(["x测量ม"])] == ["b", "c"]
    with pytest.raises(fonts.MissingFontError, match="has ア;"):
        fonts.fonts_for(["测ア"])


def test_figures_take_the_same_fonts(monkeypatch, tmp_path):
    path = tmp_path / "f" / "own.ttf"
    square_font(path, "Own Figures", NAME)
    monkeypatch.setattr(fonts, "_machine", lambda folder: [(fonts.Font(path, "Own Figures"), frozenset(NAME))])
    with styled():
        drawn, axes = figure(WIDE, 40)
        axes[0, 0].set_title(f"run {NAME}")
        text = svg(drawn, "k")
    assert "OwnFigures" in text  # the outlines of its glyphs, by name of the font
