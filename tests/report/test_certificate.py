"""A certificate says what the reports say, warnings included, of reports that verify."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
from certified import certified
from other_results import unplotted
from reading import pdf_text
from simulated import tumble

from gyrobench.bench import UsageError
from gyrobench.report import certificate_page
from gyrobench.report.laboratory import Laboratory, read_laboratory
from gyrobench.report.numbers import write_number
from gyrobench.report.page_model import BulletList, PageTable
from gyrobench.report.render import html, pdf
from gyrobench.report.result_json import Report
from gyrobench.result import Reason

PROFILE = """
name = "Inertial laboratory"
address = ["Example street 1", "Example town"]
accreditation = "X-00"
statements = ["Traceable to the national standards."]
[[signatories]]
role = "Head"
name = "N. N."
"""


def of(**changes: object) -> certificate_page.Certified:
    return certificate_page.Certified(Report.of(dataclasses.replace(unplotted(tumble()), **changes)), "ab" * 32)


@pytest.fixture
def laboratory(tmp_path: Path) -> Laboratory:
    (tmp_path / "laboratory.toml").write_text(PROFILE, encoding="utf-8")
    return read_laboratory(tmp_path / "laboratory.toml")


def tables(page) -> list[PageTable]:
    return [b for s in page.sections for b in s.blocks if isinstance(b, PageTable)]


def test_one_instrument_every_coefficient_with_its_expanded_uncertainty(laboratory: Laboratory) -> None:
    made = of(simulated=False)
    page = certificate_page.page([made], laboratory, "2026-1")
    head = dict(page.head)
    assert head["Laboratory"] == "Inertial laboratory, Example street 1, Example town" and page.report_id == "2026-1"
    assert head["Accreditation"] == "X-00" and head["Certificate"] == "2026-1"
    values, reports = tables(page)
    for row, c in zip(values.rows, made.report.result.coefficients, strict=True):
        assert row.cells[0].text == c.name and row.cells[2].text == write_number(c.estimate, c.u).text
        assert float(row.cells[3].full) == pytest.approx(c.k * c.u)  # U = k u
        assert float(row.cells[4].full) == c.k
    assert [c.text for c in reports.rows[0].cells[1:]] == [made.report.report_id, "ab" * 32]


def test_the_profile_says_which_coefficients_in_which_order(laboratory: Laboratory) -> None:
    shown = laboratory.model_copy(update={"coefficients": ["D_S", "D_F"]})
    assert [r.cells[0].text for r in tables(certificate_page.page([of()], shown))[0].rows] == ["D_S", "D_F"]
    with pytest.raises(UsageError, match=r"no D_X in this test, but D_F, D_I"):
        certificate_page.page([of()], laboratory.model_copy(update={"coefficients": ["D_X"]}))


def test_nothing_that_a_report_warns_of_is_left_out(laboratory: Laboratory) -> None:
    cold, wet = Reason("cold", "cold"), Reason("wet", "wet", severity="doubt")
    page = certificate_page.page(
        [of(instrument="a", reasons=[cold]), of(instrument="b", reasons=[cold, wet])], laboratory
    )
    (remarks,) = (b for s in page.sections if s.slug == "remarks" for b in s.blocks if isinstance(b, BulletList))
    assert remarks.items == ["cold", "b: wet"] and remarks.warn
    assert "simulated" in page.sections[-1].blocks[0].statements[0] and page.title.startswith("Simulated test")
    # neither accreditation nor traceability is claimed of what was simulated
    assert (
        "Accreditation" not in dict(page.head)
        and laboratory.statements[0] not in page.sections[-1].blocks[0].statements
    )


def test_a_lot_names_who_failed_and_what(laboratory: Laboratory) -> None:
    found = [dataclasses.replace(c, verdict="pass") for c in of().report.result.coefficients]
    good = of(instrument="a", verdict="pass", coefficients=found)
    failed = [dataclasses.replace(c, verdict="fail") if c.name == "D_I" else c for c in found]
    bad = of(instrument="b", verdict="fail", coefficients=failed)
    page = certificate_page.page([good, bad], laboratory)
    lot, *values, _ = tables(page)
    assert [[c.text for c in r.cells][3:] for r in lot.rows] == [["pass", "–"], ["fail", "D_I (fail)"]]
    assert [len(t.columns) for t in values] == [6, 5]  # nine coefficients, five side by side
    texts = [b.text for s in page.sections if s.slug == "conformity" for b in s.blocks]
    assert texts[0] == "1 of 2 passed."


def test_only_reports_of_one_test(laboratory: Laboratory) -> None:
    with pytest.raises(UsageError, match="of one test, the runs are of servo_polar, tumble_single_axis"):
        certificate_page.page([of(), of(system="servo_polar")], laboratory)


def test_all_that_is_wrong_with_a_profile_is_named(tmp_path: Path) -> None:
    file = tmp_path / "laboratory.toml"
    with pytest.raises(UsageError, match="no profile of a laboratory"):
        read_laboratory(file)
    file.write_text('name = 5\nadress = ["x"]\ncountry = "Germany"\nlanguage = "de"\n[[signatories]]\nrol = "Head"\n')
    with pytest.raises(UsageError) as error:
        read_laboratory(file)
    text = str(error.value)
    assert "name = 5: " in text and "address: field required" in text, text
    assert "country = 'Germany': two capital letters are expected, such as DE" in text, text
    assert "language = 'de': no such language; there are: en" in text, text
    assert "adress: unknown key; did you mean address?" in text and "0.rol: unknown key" in text, text


SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="40" height="20"><rect width="40" height="20" fill="#123456"/></svg>'
)


def test_a_logo_is_on_both(tmp_path: Path) -> None:
    (tmp_path / "logo.svg").write_text(SVG)
    (tmp_path / "laboratory.toml").write_text(f'logo = "logo.svg"\n{PROFILE}', encoding="utf-8")
    made = certificate_page.page([of()], read_laboratory(tmp_path / "laboratory.toml"))
    assert '<img class="logo" src="data:image/svg+xml;base64,' in html(made)
    bare = certificate_page.page([of()], read_laboratory(tmp_path / "laboratory.toml").model_copy(update={"name": "x"}))
    assert len(pdf(made)) > 0 and made.logo == bare.logo != ""


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("logo.svg", None, "no such logo"),
        ("logo.gif", b"GIF89a", "a logo is a PNG or an SVG file"),
        ("logo.svg", b"<svg", "logo.svg"),
        ("logo.png", b"\x89PNG\r\n\x1a\n" + bytes(600_000), "600 kB; a logo has at most 500 kB"),
    ],
)
def test_a_logo_that_is_none(tmp_path: Path, name: str, content: bytes | None, problem: str) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    (tmp_path / "laboratory.toml").write_text(f'logo = "{name}"\n{PROFILE}', encoding="utf-8")
    with pytest.raises(UsageError, match=problem):
        read_laboratory(tmp_path / "laboratory.toml")


def test_two_pages_at_most_and_the_same_in_both_renderers(laboratory: Laboratory, tmp_path: Path) -> None:
    page = certificate_page.page([of(simulated=False)], laboratory, "2026-1")
    shown = html(page)
    assert "Traceable to the national standards." in shown and "— end of certificate —" in shown
    (tmp_path / "c.pdf").write_bytes(pdf(page))
    text = pdf_text(tmp_path / "c.pdf")
    assert text.count("\f") <= 2 and "Certificate 2026-1" in text and "Traceable to the national" in text


def test_values_that_lack_for_one_reason_are_one_remark() -> None:
    found = certified(0).report.result.coefficients
    lacking = [dataclasses.replace(c, no_value="the record is too short") for c in (*found, *found)]
    remarks = [text for _, text in certified(0, coefficients=lacking).remarks]
    names = ", ".join(c.name for c in lacking)
    assert [t for t in remarks if t.startswith("No value")] == [f"No value of {names}: the record is too short."]
