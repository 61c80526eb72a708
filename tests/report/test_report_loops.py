"""Reports of loop tests: responses as figures, plan, comparison; the published schema holds them."""

from __future__ import annotations

import dataclasses
import json
import re
from typing import Any

import jsonschema
import numpy as np
import pytest
from reading import Written

from gyrobench import report
from gyrobench.bench import Bench
from gyrobench.report.assets import read_content
from gyrobench.report.channel_figure import panels, scaled
from gyrobench.report.comparison_page import comparison
from gyrobench.report.plots import by_axis
from gyrobench.report.responses import blocks, draw
from gyrobench.report.result_json import Report, document
from gyrobench.report.style import styled
from gyrobench.report.tables import unit_groups
from gyrobench.result import Coefficient, Curve, LoopResult, Response, Result
from gyrobench.result_entries import Series
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep
from gyrobench.system.system import load_system

PLAN = LoopPlan(
    [LoopPhase("load", "torque", "step", 1, 0.5, settle=1.0, dwell=2.0), *sweep("loop", "test", [1.0], 0.1)]
)


def responses(gain: float) -> list[Response]:
    f = np.geomspace(0.1, 10.0, 7)
    dense = np.geomspace(0.05, 20.0, 50)

    def loop(x: np.ndarray) -> Any:
        return gain / (1j * x * (1 + 0.2j * x))

    def phase(x: np.ndarray) -> list[float]:
        return np.degrees(np.unwrap(np.angle(loop(x)))).tolist()

    curve = Curve("linear, continuous", dense.tolist(), np.abs(loop(dense)).tolist(), phase(dense))
    t = np.linspace(0, 1, 50)
    axis = {"x_name": "frequency", "x_unit": "Hz"}
    return [
        Response("open loop", "loop", "Loop.", f.tolist(), **axis, y=np.abs(loop(f)).tolist(), y_name="gain",
                 y_unit="1", phase=phase(f), u=[0.01] * 6 + [None], coherence=[1.0] * 7, curves=[curve]),
        Response("isolation", "ratio", "Isolation.", f.tolist(), **axis, y=f.tolist(), y_name="isolation", y_unit="1",
                 phase=[0.0] * 7, u=[None] * 7),
        Response("load, angle", "step", "Step.", t.tolist(), "time", "s", y=(gain * (1 - np.exp(-5 * t))).tolist(),
                 y_name="angle", y_unit="″"),
    ]  # fmt: skip


def result(gain: float = 2.0) -> LoopResult:
    found = Coefficient(
        "f_c", "crossover frequency", "Hz", 0.3 * gain, 0.01, 1.96, (0.3 * gain - 0.02, 0.3 * gain + 0.02)
    )
    return LoopResult(
        system="loop", title="Loop test", method="by sines", sources=[], equation="L", conventions=[],
        coefficients=[found], responses=responses(gain),
        provenance={"plan": PLAN.rows(), "order": ["exciter", "gyro"], "step": 1e-3},
    )  # fmt: skip


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    return Written(report.write(result(), tmp_path_factory.mktemp("loop")))


@pytest.mark.long
def test_schema_holds_responses(written: Written) -> None:
    schema = json.loads(read_content("result.schema.json"))
    jsonschema.validate(written.json, schema)
    assert {f.name for f in dataclasses.fields(Response)} == set(schema["$defs"]["response"]["properties"])


def test_a_result_comes_back_from_its_dictionary() -> None:
    assert Result.from_dict(result().as_dict()) == result()
    older = {k: v for k, v in result().as_dict().items() if k != "kind"}
    assert Result.from_dict(older) == result()


def test_each_response_has_its_figure(written: Written) -> None:
    html = written.paths["html"].read_text(encoding="utf-8")
    for k in (1, 2, 3):
        assert f'id="figure-response-{k}"' in html
    assert re.findall(r'id="figure-response-(\d)"', html) == ["1", "2", "3"]
    turned = dataclasses.replace(result(), responses=responses(2.0)[::-1])  # step, ratio, open loop: that comes first
    keys = [b.items[0].key for b in blocks(Report.of(turned)) if hasattr(b, "items")]
    assert keys == ["response-3", "response-1", "response-2"]
    assert "The design matrix has rank" not in html and "Residual standard deviation" not in html


def test_plan_of_a_loop_shows_its_excitations(written: Written) -> None:
    rows = document(result())["derived"]["plan"]
    assert rows[0]["shape"] == "step" and rows[0]["amplitude"] == 0.5 and rows[0]["unit"] == "N.m"
    assert rows[1]["frequency_Hz"] == 1.0
    html = written.paths["html"].read_text(encoding="utf-8")
    assert "frequency" in html and "amplitude" in html and ">face<" not in html


@pytest.mark.long
def test_comparison_lays_responses_over_each_other(tmp_path: Any) -> None:
    runs = [("a", result(2.0)), ("b", result(4.0))]
    doc = comparison(runs)
    assert [r["name"] for r in doc["responses"]] == ["open loop", "isolation", "load, angle"]
    assert all(len(r["runs"]) == 2 for r in doc["responses"])
    html = Written(report.compare(runs, tmp_path)).paths["html"].read_text(encoding="utf-8")
    assert html.count('id="figure-response-') == 3
    runs[1][1].responses.pop()  # one that only one run has is no comparison
    html = Written(report.compare(runs, tmp_path)).paths["html"].read_text(encoding="utf-8")
    assert html.count('id="figure-response-') == 2


@pytest.mark.long
def test_phases_a_turn_apart_are_drawn_together() -> None:
    """The second run's phase is written 360 degrees lower: the figure is the same as with it at the same turn."""
    a = responses(2.0)[0]
    b = dataclasses.replace(a, phase=[p - 360.0 for p in a.phase])
    with styled():
        one, two = draw([("a", a), ("b", a)], "k"), draw([("a", a), ("b", b)], "k")
    assert one == two


@pytest.mark.long
def test_units_of_a_loop_stand_in_a_column(tmp_path: Any) -> None:
    """Gain margin in dB, crossover in Hz, stiffness in N·m/rad: headings would make as many groups as rows."""
    loop = result()
    first = loop.coefficients[0]
    loop.coefficients.extend(dataclasses.replace(first, name=f"other {unit}", unit=unit) for unit in ("Hz", "s", "V"))
    html = Written(report.write(loop, tmp_path)).paths["html"].read_text(encoding="utf-8")
    assert ">unit<" in html and ">Hz<" in html and ">in Hz<" not in html
    loop.coefficients.extend(dataclasses.replace(first, name=f"further {unit}", unit=unit) for unit in ("Hz", "s", "V"))
    html = Written(report.write(loop, tmp_path)).paths["html"].read_text(encoding="utf-8")
    assert ">in Hz<" in html and ">in s<" in html


@pytest.mark.long
def test_a_ratio_of_one_is_no_figure_of_rounding_errors() -> None:
    ratio = responses(1.0)[1]
    n = len(ratio.x)
    flat, rounded = (
        dataclasses.replace(ratio, y=[1.0 - k * 1e-16 * (i % 3) for i in range(n)], u=[0.0] * n) for k in (0, 1)
    )
    with styled():
        one, other = (
            re.sub(r"f-p\w+", "", draw([("measured", r)], "f")) for r in (flat, rounded)
        )  # without clip names
    assert one == other


def test_channels_that_tell_nothing_give_way() -> None:
    moving = {f"gyro.{n}": [0.1, 0.2] for n in "abcdef"}
    record = {"time": [0.0, 1.0], "exciter.phase": [1.0, 2.0], "gyro.still": [0.5, 0.5], **moving}
    units = {"exciter.phase": "1", "gyro.still": "rad"}
    assert panels(record, units) == [[n] for n in moving]
    few = {k: record[k] for k in ("time", "exciter.phase", "gyro.still", "gyro.a")}
    assert panels(few, units) == [["exciter.phase"], ["gyro.still"], ["gyro.a"]]


def test_a_system_says_which_channels_matter() -> None:
    """The attitude is the 8th quantity of the record; its elements share a panel, one that never moved is left out."""
    early = {f"exciter.{n}": [0.1, 0.2] for n in "abcdefg"}
    attitude = {f"platform.attitude[{k}]": [0.0, float(k != 2)] for k in (1, 2, 3)}
    record = {"time": [0.0, 1.0], **early, **attitude, "pitch.e": [0.0, 1.0], "roll.e": [0.0, 2.0], "lock": [0.0, 0.0]}
    declared = ("platform.attitude", "pitch.e roll.e", "lock", "absent")
    assert panels(record, {}, declared) == [["platform.attitude[1]", "platform.attitude[3]"], ["pitch.e", "roll.e"]]


@pytest.mark.long
def test_declared_channels_are_drawn_and_the_others_named(tmp_path: Any) -> None:
    loop = result()
    loop.provenance.update(
        {"shown": ["platform.attitude"], "units": {"platform.attitude": "rad", "exciter.phase": "1"}}
    )
    t = np.linspace(0.0, 10.0, 50)
    record = {"time": t, "exciter.phase": 1.0 + (t > 4.0), "platform.attitude": np.sin(t)}
    html = Written(report.write(loop, tmp_path, ("json", "html"), record)).paths["html"].read_text(encoding="utf-8")
    assert "Recorded channels against time: platform.attitude" in html and "Not drawn: exciter.phase" in html
    assert 'id="channels-spanlabel-1"' in html  # load, then test


@pytest.mark.parametrize("name", sorted(set(Bench.find().systems()) - {"drift_test_suite"}))
def test_systems_show_channels_that_they_record(name: str) -> None:
    system = load_system(name)
    recorded = {re.sub(r"\[\d+\]$", "", n) for n in system.channels}
    assert {n for entry in system.shown for n in entry.split()} <= recorded
    assert system.shown or not system.loops


def test_fast_rates_are_shown_in_degrees_a_second() -> None:
    assert scaled([0.5], "rad/s")[1] == "°/s" and scaled([1e-3], "rad/s")[1] == "°/h"
    assert scaled([1.0], "N.m")[1] == "N·m"


def test_one_unit_or_few_units_of_many_rows_are_groups() -> None:
    def rows(*units: str) -> list[Coefficient]:
        return [dataclasses.replace(result().coefficients[0], unit=unit) for unit in units]

    drift = rows("°/h", "°/h/g", "°/h/g", "°/h/g²", "°/h/g²")
    assert unit_groups(drift) == [("°/h", [0]), ("°/h/g", [1, 2]), ("°/h/g²", [3, 4])]
    assert unit_groups(drift[:1]) == [("°/h", [0])]
    assert unit_groups(rows("s", "Hz", "s", "V")) == []


def test_each_quantity_has_axes_of_its_own() -> None:
    """Two rates in deg/h share a label where they are the same quantity alone."""
    x = ("table angle", "°")

    def series(label: str, name: str, unit: str) -> Series:
        return Series.of(label, ([0.0, 1.0, 2.0, 3.0], *x), ([0.0, 1.0, 0.0, 1.0], name, unit), [0.5] * 4, [0.5] * 4)

    drawn = [
        series("mount 1", "drift rate", "°/h"), series("mount 2", "drift rate", "°/h"),
        series("table", "rate of the table", "°/h"),
    ]  # fmt: skip
    assert [[s.label for s in alike] for alike in by_axis(drawn)] == [["mount 1", "mount 2"], ["table"]]
