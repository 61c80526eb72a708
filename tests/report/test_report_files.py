from __future__ import annotations

import dataclasses
import json
import math
import re
import subprocess
import sys

import jsonschema
import numpy as np
import pytest
from other_results import unplotted, with_coefficient
from reading import Written, pdf_text
from simulated import tumble

from gyrobench import report
from gyrobench import result as result_module
from gyrobench.report.assets import read_content
from gyrobench.report.result_json import SCHEMA, content_hash, document
from gyrobench.result import Reason, Table

NASTY = "<script>alert('x')</script> & #let x = 1 $a_b$ *bold* _under_ [c] \\ @ref `raw` //no comment -- \"quoted\""


def schema():
    return json.loads(read_content("result.schema.json"))


def as_number(text: str) -> tuple[float, float]:
    """The value of a rounded text and half a unit of its last digit."""
    text = text.replace("−", "-").replace("< ", "")
    mantissa, _, power = text.partition("·10")
    exponent = int(power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")) or 0)
    digits = len(mantissa.partition(".")[2])
    unit = 10.0 ** (exponent - digits)
    if digits == 0 and not power:
        unit *= 10.0 ** (len(mantissa) - len(mantissa.rstrip("0")))  # 1240 stands for tens
    return float(mantissa) * 10.0**exponent, 0.5 * unit


# ---- result.json


@pytest.mark.long
def test_json_follows_the_published_schema(written):
    jsonschema.Draft202012Validator.check_schema(schema())
    jsonschema.validate(written.json, schema())


def test_schema_knows_every_field_of_a_result():
    s = schema()
    kinds = result_module.KINDS.values()
    names = {f.name for kind in kinds for f in dataclasses.fields(kind)}
    assert {*names, *result_module.SAID, "kind", "schema", "report_id", "derived"} == set(s["properties"])
    assert set(s["properties"]["kind"]["enum"]) == set(result_module.KINDS)
    for kind in kinds:
        assert set(result_module.ABSENT) >= names - {f.name for f in dataclasses.fields(kind)}, kind
    for key, cls in (
        ("coefficient", "Coefficient"), ("series", "Series"), ("test", "Test"), ("budget", "BudgetLine"),
        ("reason", "Reason"), ("response", "Response"),
    ):  # fmt: skip
        fields = {f.name for f in dataclasses.fields(getattr(result_module, cls))}
        assert fields == set(s["$defs"][key]["properties"]), key


@pytest.mark.long
def test_json_holds_what_the_design_names(written):
    for key in ("system", "coefficients", "warnings", "provenance"):
        assert key in written.json
    first = written.json["coefficients"][0]
    assert {"name", "unit", "estimate", "u", "interval", "truth"} <= set(first)
    assert len(first["interval"]) == 2


@pytest.mark.long
def test_no_nan_in_json(tmp_path):
    r = with_coefficient(with_coefficient(tumble(windows=12), 0, estimate=math.nan), 1, z=np.float64("inf"))
    acf = dataclasses.replace(r.acf, bound=np.array(r.acf.bound))
    r = dataclasses.replace(r, condition=math.inf, acf=acf)
    r.noise["sigma_deg_per_h"] = np.float64("nan")
    r.series[0].y[3] = math.nan
    r.correlation[1][0] = math.nan
    written = Written(report.write(r, tmp_path))
    text = written.paths["json"].read_text(encoding="utf-8")
    assert not re.search(r"\b(NaN|Infinity)\b", text)
    jsonschema.validate(written.json, schema())
    assert written.json["coefficients"][0]["estimate"] is None
    assert written.json["condition"] is None
    assert not re.search(
        r"\b(nan|inf|none)\b", re.sub(r"<(svg|style|script).*?</\1>", "", written.html, flags=re.S).lower()
    )


def test_a_result_comes_back_from_json(written):
    r = tumble()
    again = report.load(written.paths["json"].read_text(encoding="utf-8"))
    assert again == r and document(again) == document(r)
    assert report.report_id(again) == report.report_id(r) == written.json["report_id"]


def as_saved(content):
    """The text of a result.json of other content, whose digest fits."""
    return json.dumps({"schema": SCHEMA, "report_id": content_hash(content), **content})


def test_each_kind_of_result_comes_back_as_that_kind(written):
    text = written.paths["json"].read_text(encoding="utf-8")
    assert written.json["kind"] == "drift_test" and isinstance(report.load(text), result_module.DriftTestResult)
    older = {k: v for k, v in json.loads(text).items() if k not in ("schema", "report_id", "kind")}  # before kinds
    assert isinstance(report.load(as_saved(older)), result_module.DriftTestResult)
    with pytest.raises(report.ResultError, match=r"missing or unknown fields: .*mood"):
        report.load(as_saved({**older, "mood": 1}))
    with pytest.raises(TypeError, match="a result is a DriftTestResult, a LoopResult, a DriftRecordResult or"):
        result_module.Result(system="", title="", method="", sources=[], conventions=[], coefficients=[])


def test_load_refuses_other_json():
    with pytest.raises(ValueError, match="schema"):
        report.load('{"coefficients": []}')


def test_report_id_stands_for_the_content():
    r = tumble()
    before = report.report_id(r)
    assert before == report.report_id(tumble())
    assert re.fullmatch("[0-9a-f]{10}", before)
    moved = math.nextafter(r.coefficients[0].estimate, 1.0)
    assert report.report_id(with_coefficient(r, 0, estimate=moved)) != before


# ---- the same numbers everywhere


@pytest.mark.parametrize("which", ["written", "compared"])
def test_every_number_of_the_page_is_that_of_the_json(which, request):
    written = request.getfixturevalue(which)
    numbers = written.numbers()
    assert len(numbers) > 100
    for pointer, full, text in numbers:
        if not pointer:
            continue
        assert float(full) == written.at(pointer), pointer  # bit for bit
        if text == "< 0.001":
            assert float(full) < 0.001
            continue
        shown, half = as_number(text)
        assert abs(shown - float(full)) <= half * 1.0000001, (pointer, text, full)


def test_every_coefficient_is_on_the_page(written):
    pointers = {p for p, _, _ in written.numbers()}
    for k in range(len(written.json["coefficients"])):
        for field in ("estimate", "u", "interval/0", "interval/1", "truth", "z", "k", "closed", "t", "p", "u_a", "dof"):
            assert f"/coefficients/{k}/{field}" in pointers
        assert f"/derived/U/{k}" in pointers


def test_the_pdf_says_the_same_as_the_page(written):
    text = written.pdf_text().replace("\N{NO-BREAK SPACE}", " ")
    words = set(text.split())
    for c in written.json["coefficients"]:
        for value in (c["estimate"], c["u"], *c["interval"]):
            assert repr(value) in words  # all digits, section Full values
    flat = re.sub(r"\s", "", text)
    missing = [(p, t) for p, _, t in written.numbers() if re.sub(r"\s", "", t) not in flat]
    assert not missing


def test_every_page_of_the_pdf_is_signed(written):
    pages = [p for p in written.pdf_text().split("\f") if p.strip()]
    for k, page in enumerate(pages):
        assert f"Report {written.json['report_id']}" in page
        assert f"Page {k + 1} of {len(pages)}" in page
    assert "— end of report —" in pages[-1]
    assert "— end of report —" in written.html


# ---- contents


def test_sections_in_order(written):
    titles = re.findall(r"<h2 id=\"[a-z]+\"><span>(\d+)</span> ([^<]+)</h2>", written.html)
    assert [t for _, t in titles] == [
        "Result and conformity", "Coefficients", "Measurement data", "Validity of the results", "Uncertainty budget",
        "Method and provenance", "Statements and signatures",
    ]  # fmt: skip
    assert [n for n, _ in titles] == ["1", "2", "3", "4", "5", "6", "7"]
    text = written.pdf_text()
    places = [text.index(f"{n} {t}" if f"{n} {t}" in text else f"{n}  {t}") for n, t in titles]
    assert places == sorted(places)


def test_all_figures_are_there_with_caption_and_alternative(written):
    keys = re.findall(r'<figure class="picture[^"]*" id="figure-([a-z0-9-]+)"', written.html)
    assert keys == [
        "fit-1", "residuals-time", "acf", "quantiles", "allan", "psd", "correlation", "scores", "budget", "system",
    ]  # fmt: skip
    for figure in re.findall(r'<figure class="picture.*?</figure>', written.html, flags=re.S):
        assert re.search(r'role="img" aria-label="[^"]{15,}"', figure)
        assert re.search(r"<figcaption><b>Figure \d+\.</b> [^<]{25,}", figure)


def test_ids_are_unique(written):
    ids = re.findall(r'\bid="([^"]+)"', written.html)
    assert len(ids) == len(set(ids))


def test_self_contained(written):
    assert not re.search(r'(src|href)="(?!#|data:,)', written.html.replace("xlink:href", "xref"))
    assert "http://" not in re.sub(r"http://www\.w3\.org/[\w/.]+", "", written.html)
    assert "https://" not in written.html
    assert "@import" not in written.html


def test_no_specification_is_said_and_is_no_pass(tmp_path):
    r = unplotted(tumble(windows=12, limits=False))
    w = Written(report.write(r, tmp_path, formats=("json", "html")))
    assert "<strong>no specification given</strong>" in w.html
    assert "✓" not in re.sub(r"<style>.*?</style>", "", w.html, flags=re.S)
    assert ">pass<" not in w.html
    assert "<th" in w.html and ">limit<" not in w.html


def test_measured_data_has_no_truth(tmp_path):
    r = unplotted(tumble(windows=12))
    untold = [dataclasses.replace(c, truth=None, z=None) for c in r.coefficients]
    r = dataclasses.replace(r, simulated=False, coefficients=untold)
    w = Written(report.write(r, tmp_path, formats=("json", "html")))
    assert ">truth<" not in w.html and "figure-scores" not in w.html
    jsonschema.validate(w.json, schema())


def test_a_bare_result_makes_a_report(tmp_path):
    """Nothing but coefficients: every optional part is left out, none is shown empty."""
    full = tumble(windows=12)
    r = result_module.DriftTestResult(
        system="torquer", title="Torquer scale factor", method="method", sources=[], conventions=[],
        coefficients=full.coefficients[:1], series=[], correlation=[[1.0]], condition=1.0, rank=1, dof=0.0, noise={},
        residual_std=0.0, residual_unit="°/h",
    )  # fmt: skip
    w = Written(report.write(r, tmp_path))
    jsonschema.validate(w.json, schema())
    assert "<tbody>\n</tbody>" not in w.html
    assert "<h2" in w.html and "figure-fit" not in w.html


@pytest.mark.long
def test_all_text_is_escaped(tmp_path):
    r = with_coefficient(tumble(windows=12), 0, name=NASTY, meaning=NASTY, unit=NASTY)
    r = dataclasses.replace(
        r, title=NASTY, method=NASTY, instrument=NASTY, decision_rule=NASTY, reasons=[Reason(NASTY, NASTY)],
        summary=[NASTY], conventions=[NASTY], sources=[NASTY], site={NASTY: NASTY},
    )  # fmt: skip
    r.series[0] = dataclasses.replace(r.series[0], label=NASTY, x_name=NASTY, y_unit=NASTY)
    r.tests[0] = dataclasses.replace(r.tests[0], finding=NASTY)
    r.budget[0] = dataclasses.replace(r.budget[0], source=NASTY)
    r.provenance["parameters"][NASTY] = NASTY
    r.provenance["operator"] = NASTY
    r.provenance["plan"][0]["label"] = NASTY
    r.provenance["order"][0] = NASTY
    w = Written(report.write(r, tmp_path))
    assert "<script>alert" not in w.html
    assert "&lt;script&gt;alert" in w.html
    text = re.sub(r"\s+", " ", pdf_text(w.paths["pdf"]))
    for piece in ("<script>", "#let x = 1", "$a_b$", "*bold*", "_under_", "`raw`", "//no comment"):
        assert piece in text


@pytest.mark.long
def test_an_equation_that_typst_cannot_read_is_shown_as_it_is(tmp_path):
    r = dataclasses.replace(unplotted(tumble(windows=12)), equation="k i = $ #broken( <b>")
    w = Written(report.write(r, tmp_path))
    assert "k i = $ #broken( &lt;b&gt;" in w.html
    assert "#broken(" in pdf_text(w.paths["pdf"])


def test_figures_keep_extremes_of_long_records():
    from gyrobench.report.style import envelope

    x = np.arange(200_000.0)
    y = np.sin(x / 700.0)
    y[123_457], y[98_765] = 9.0, -9.0
    ex, ey = envelope(x, y, 500)
    assert len(ex) <= 1000
    assert (max(ey), min(ey)) == (9.0, -9.0)
    assert ex == sorted(ex)
    assert ex[ey.index(9.0)] == 123_457.0


@pytest.mark.long
def test_channels_of_a_run_are_drawn(tmp_path):
    time_ = np.arange(0.0, 20_000.0, 0.5)
    record = {"time": time_, "gyro.u": np.sin(time_ / 500.0), "table.angle": time_ * 7e-4}
    w = Written(report.write(unplotted(tumble(windows=12)), tmp_path, formats=("json", "html"), record=record))
    assert "figure-channels" in w.html
    assert len(w.html) < 3_000_000


# ---- writing


@pytest.mark.long
def test_nothing_heavy_is_imported_before_a_report_is_written():
    code = (
        "import sys, gyrobench.report; "
        "assert not {'matplotlib', 'typst', 'jinja2', 'numpy', 'scipy'} & set(sys.modules), 'heavy import'"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.long
def test_others_are_written_when_one_format_fails(tmp_path):
    bench = tmp_path / "bench"
    (bench / "reports" / "templates").mkdir(parents=True)
    (bench / "reports" / "templates" / "report.html.j2").write_text("{{ nothing.there }}")
    with pytest.raises(report.ReportError, match=r"report\.html") as caught:
        report.write(unplotted(tumble(windows=12)), tmp_path / "out", bench=bench)
    assert set(caught.value.written) == {"json", "pdf"}
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["report.pdf", "result.json"]


def test_a_bench_may_bring_its_own_style(tmp_path):
    (tmp_path / "reports" / "templates").mkdir(parents=True)
    (tmp_path / "reports" / "templates" / "report.css").write_text("body { color: teal; }")
    w = Written(report.write(unplotted(tumble(windows=12)), tmp_path / "out", formats=("json", "html"), bench=tmp_path))
    assert "color: teal" in w.html


def test_unknown_format_is_refused(tmp_path):
    with pytest.raises(ValueError, match="'docx'; there are json, html, pdf"):
        report.write(tumble(windows=12), tmp_path, formats=("docx",))


@pytest.mark.long
def test_same_result_same_bytes(written, tmp_path):
    again = report.write(tumble(), tmp_path)
    assert set(again) == set(written.paths) == {"json", "html", "pdf"}
    for kind, path in again.items():
        assert path.read_bytes() == written.paths[kind].read_bytes()


@pytest.mark.long
def test_step_check_and_tables_of_the_method_are_shown(tmp_path):
    table = Table(
        "closed_form", "Least squares and closed form", "From the same windows",
        ["coefficient", "least squares", "difference", "u", "turn / (°/h)"], [["D_F", 0.29761, 1.2345e-5, 0.0025, 3]],
    )  # fmt: skip
    r = dataclasses.replace(unplotted(tumble(windows=12)), tables=[table])
    w = Written(report.write(r, tmp_path, formats=("json", "html")))
    texts = {p: t for p, _, t in w.numbers()}
    assert texts["/tables/0/rows/0/1"] == "0.2976"  # to the second digit of u
    assert texts["/tables/0/rows/0/2"] == "1.2·10⁻⁵"
    assert "/step_check/rows/3/ratio" in texts
    said = "the effect of the communication step is in u, at most 0.0001 times the u without it; step 0.5 ms."
    assert f"Step check (2.5 s): {said}" in w.html
    w = Written(report.write(dataclasses.replace(r, step_check=None), tmp_path, formats=("json", "html")))
    assert "The communication step was not checked in this run" in w.html


def test_wiring_drawing_stands_alone():
    """The wiring drawing also stands alone, from the connections of a system."""
    from gyrobench.report.wiring_figure import draw

    svg = draw(["a", "b"], ["a.x[1] -> b.y[1]", "b.z -> a.w"], "s")
    assert svg.startswith("<svg") and svg.rstrip().endswith("</svg>")
    assert "xmlns=" in svg


@pytest.mark.long
def test_delays_and_cuts_are_said(tmp_path):
    r = unplotted(tumble(windows=12))
    r.provenance["cuts"] = ["rebalance.i -> gyro.i: one step delay (no output depends on it at once)"]
    r.provenance["delays"] = {"rebalance.i -> gyro.i": 0.001, "table.angle -> sampler.angle": 0.002}
    w = Written(report.write(r, tmp_path, formats=("json", "html")))
    assert (
        "Delayed connection rebalance.i → gyro.i: one step delay (no output depends on it at once), 0.001 s." in w.html
    )
    assert "Delay on table.angle → sampler.angle: 0.002 s." in w.html
