from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import pytest
from other_results import unplotted, with_coefficient
from reading import pdf_text
from simulated import tumble

from gyrobench import report
from gyrobench.workflow.run_comparison import compare_folders


def measure(doc, name):
    return next(m for m in doc["measures"] if m["name"] == name)


@pytest.mark.long
def test_differences_and_their_uncertainty(compared):
    m = measure(compared.json, "D_S")
    a, b = m["runs"][0], m["runs"][1]
    d = m["differences"][1]
    assert m["differences"][0] is None
    assert d["value"] == b["estimate"] - a["estimate"]
    assert d["u"] == pytest.approx(math.sqrt(a["u"] ** 2 + b["u"] ** 2), rel=1e-12)
    assert d["U"] == pytest.approx(max(a["k"], b["k"]) * d["u"], rel=1e-12)
    assert d["significant"] is True  # the second gyro was simulated with 0.05 °/h/g more, some ten times U
    assert measure(compared.json, "D_I")["differences"][1]["significant"] is False


def test_what_differs_comes_first_and_only_that(compared):
    names = {row["what"]: row["values"] for row in compared.json["differing"]}
    assert names["parameter gyro.J"] == [2e-4, 3e-4, 2e-4]
    assert names["seed"] == [1, 2, 3]
    assert "parameter gyro.H" not in names
    assert "parameter gyro.H" in {row["what"] for row in compared.json["equal"]}
    html = compared.html
    assert html.index("gyro.J") < html.index(">D_F<") < html.index("gyro.H")


def test_long_lists_show_only_the_entry_that_differs():
    from gyrobench.report.comparison_page import comparison

    a, b = tumble(windows=12), tumble(windows=12)
    b.provenance["parameters"]["sequencer.target"] = [0.0] * 41 + [0.5] + [0.0] * 57
    b.provenance["plan"][2]["dwell"] = 2400.0
    differing = comparison([("a", a), ("b", b)])["differing"]
    assert {r["what"]: r["values"] for r in differing} == {
        "parameter sequencer.target[42]": [0.0, 0.5],
        "plan phase 3, dwell": [1200.0, 2400.0],
    }


def test_one_figure_per_measure(compared):
    assert compared.html.count('<figure class="picture') == len(compared.json["measures"])


@pytest.mark.long
def test_coefficients_of_other_name_or_unit_are_not_subtracted(tmp_path):
    a = tumble(windows=12)
    b = with_coefficient(with_coefficient(a, 0, name="D_F + D_OO·X²"), 1, unit="rad/s")
    paths = report.compare([("a", a), ("b", b)], tmp_path, formats=("json", "html"))
    import json

    doc = json.loads(paths["json"].read_text(encoding="utf-8"))
    assert measure(doc, "D_F")["runs"][1] is None
    assert measure(doc, "D_F")["differences"] == [None, None]
    assert sum(m["name"] == "D_I" for m in doc["measures"]) == 2


@pytest.mark.long
def test_five_runs_fit_on_paper(tmp_path):
    runs = [(f"run number {k} with a long name", tumble(seed=k, windows=12)) for k in range(1, 6)]
    paths = report.compare(runs, tmp_path, baseline=2)
    text = pdf_text(paths["pdf"])
    for letter in "ABDE":
        assert f"{letter} − C" in text


@pytest.mark.parametrize(
    ("names", "baseline", "message"),
    [(["a"], 0, "at least two"), (["a", "a"], 0, "must differ"), (["a", "b"], 2, "0 to 1")],
)
def test_refusals(names, baseline, message, tmp_path):
    r = tumble(windows=12)
    with pytest.raises(ValueError, match=message):
        report.compare([(n, r) for n in names], tmp_path, baseline=baseline)


def test_measured_runs_are_named_by_their_instruments(tmp_path: Path) -> None:
    """Folders have names of runs; a reader knows the instruments.  Two runs of one keep the folders'."""
    for folder, instrument in (("a", "FG-1"), ("b", "FG-2"), ("c", "FG-2")):
        found = dataclasses.replace(unplotted(tumble()), instrument=instrument, simulated=False)
        report.write(found, tmp_path / folder, ["json"])
    folders = [tmp_path / name for name in "abc"]
    assert [name for name, _ in compare_folders(folders[:2]).results] == ["FG-1", "FG-2"]
    assert [name for name, _ in compare_folders(folders[1:]).results] == ["b", "c"]
