"""Axes, points and the identity of runs: nothing is executed here, apart from a sweep with its design held."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gyrobench as gb
from gyrobench.bench import UsageError, standard_folder
from gyrobench.campaign.execution.axes import Axis, Distribution, draw, parse_axis
from gyrobench.campaign.execution.campaign_plan import CampaignPlan, make_plan
from gyrobench.campaign.execution.definition import from_mapping, read_definition

BENCH = Path(__file__).with_name("bench")


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(BENCH)


def plan(**asked: Any) -> CampaignPlan:
    return make_plan(from_mapping({"system": "weighing", **asked}))


@pytest.mark.parametrize(
    ("text", "unit", "shown"),
    [
        ("0deg..80deg:5", "deg", [0.0, 20.0, 40.0, 60.0, 80.0]),
        ("0..80deg:3", "deg", [0.0, 40.0, 80.0]),
        ("-1..1:3 deg/h", "deg/h", [-1.0, 0.0, 1.0]),
        ("1e-2..1:3log deg/h", "deg/h", [0.01, 0.1, 1.0]),
        ("0.1,0.3,1 deg/h/g", "deg/h/g", [0.1, 0.3, 1.0]),
        ("1deg,60arcmin", "deg", [1.0, 1.0]),
        ("1,2", "", [1.0, 2.0]),
        ("analog, pulse", "", ["analog", "pulse"]),
        ("[1, 2],[3, 4]", "", ["[1, 2]", "[3, 4]"]),
    ],
)
def test_values_as_a_person_writes_them(text: str, unit: str, shown: list[Any]) -> None:
    axis = parse_axis("x", text)
    assert isinstance(axis, Axis) and axis.unit == unit
    assert [p.shown for p in axis.points] == pytest.approx(shown) if unit or shown == [1.0, 2.0] else shown
    if unit:
        assert [str(p.given).split(" ", 1)[1] for p in axis.points] == [unit] * len(shown)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("0..1deg, 2", "some values have a unit and some have none"),
        ("1deg,2s", "does not convert"),
        ("1..2:1", "a grid has 2 to 1000000 points"),
        ("0deg..80deg", r"how many values\? write LOW..HIGH:N, such as 0deg..80deg:9"),
        ("-1..2:5log", "must be > 0"),
        ("gauss(0, 1)", "no such distribution; there are: uniform, normal"),
        ("uniform(1)", "takes 2 numbers"),
        ("uniform(2, 1) deg", "must be below the last"),
        ("normal(0, 0) deg", "must be > 0"),
        ("", "an empty value"),
    ],
)
def test_what_is_no_axis(text: str, problem: str) -> None:
    with pytest.raises((UsageError, ValueError), match=problem):
        found = parse_axis("x", text)
        assert isinstance(found, Axis) and all(isinstance(p.shown, float) for p in found.points), problem


def test_draws_have_their_distribution_and_designs_fill_space() -> None:
    texts = ["uniform(10, 20) arcsec", "normal(3, 2) deg/h", "loguniform(1, 100)", "triangular(0, 1, 4) K"]
    axes = [parse_axis(f"x{k}", t) for k, t in enumerate(texts)]
    assert all(isinstance(a, Distribution) for a in axes)
    for design in ("random", "lhs", "sobol"):
        found = draw(axes, 1024, design, seed=3)  # type: ignore[arg-type]
        x = np.array([[p[f"x{k}"].shown for k in range(4)] for p in found], dtype=float)
        # means: 15; 3; 99 / ln 100; (0 + 1 + 4) / 3.  Four standard errors of 1024 independent draws
        expected = np.array([15.0, 3.0, 99.0 / math.log(100.0), 5.0 / 3.0])
        assert np.all(np.abs(x.mean(0) - expected) < 4.0 * x.std(0) / 32.0)
        assert x[:, 1].std() == pytest.approx(2.0, rel=0.1)
        cells = np.floor((x[:, 0] - 10.0) / 10.0 * 1024.0)
        assert len(set(cells)) == 1024 if design != "random" else 560 < len(set(cells)) < 720  # 1 - 1/e of 1024: 647
        assert found == draw(axes, 1024, design, seed=3)  # type: ignore[arg-type]
    assert float(str(found[5]["x0"].given).split()[0]) == found[5]["x0"].shown  # to the bit
    with pytest.raises(UsageError, match="take a power of two, 64 or 128"):
        draw(axes, 100, "sobol")  # type: ignore[arg-type]


def test_blocks_are_combined_and_noise_is_drawn_anew_where_points_are_drawn() -> None:
    grid = plan(over={"source.offset": "1,2", "temperature": "280,300 K"}, seeds=3)
    assert len(grid.runs) == 12
    assert [r.seed for r in grid.runs] == [1, 2, 3] * 4
    drawn = plan(over={"source.offset": "uniform(0, 1)", "temperature": "280,300 K"}, runs=5, seeds=2)
    assert len(drawn.runs) == 20
    assert [r.seed for r in drawn.runs] == [*range(1, 11), *range(1, 11)]  # the two temperatures under equal noise
    assert [(a["name"], a["kind"]) for a in drawn.axes] == [
        ("temperature", "list"), ("source.offset", "random"), ("seed", "seed"),
    ]  # fmt: skip
    table = plan(table=[{"source.offset": 0.5, "seed": 7}, {"source.offset": 0.25, "temperature": "1K", "seed": 9}])
    assert [(r.seed, r.shown) for r in table.runs] == [
        (7, {"source.offset": 0.5}), (9, {"source.offset": 0.25, "temperature": 1.0}),
    ]  # fmt: skip


def test_parts_are_an_axis() -> None:
    found = plan(parts={"source": ["signal_source", "meter"]}, set={})
    assert [r.shown["source"] for r in found.runs] == ["signal_source", "meter"]
    assert len(found.setups) == 2 and found.runs[0].run != found.runs[1].run
    again = from_mapping({"system": "weighing", "over": {"source": "signal_source,meter"}})
    assert [r.run for r in make_plan(again).runs] == [r.run for r in found.runs]


def test_a_run_is_known_by_what_determines_its_result(tmp_path: Path) -> None:
    base = plan(set={"temperature": "300K"}).runs[0].run
    assert plan(set={"temperature": "3e2 K"}).runs[0].run == base  # equal values
    assert plan(set={"temperature": "26.85 degC"}).runs[0].run == base
    assert plan(over={"temperature": "300,300.0 K"}).repeated == 1
    for other in (
        {"set": {"temperature": "301K"}},
        {"set": {}},
        {"set": {"temperature": "300K"}, "step": "5ms"},
        {"set": {"temperature": "300K"}, "seeds": [2]},
        {"set": {"temperature": "300K"}, "check_step": True},
        {"set": {"temperature": "300K"}, "parts": {"source": "meter"}},
    ):
        assert plan(**other).runs[0].run != base
    # limits, what is kept, the name change no result
    assert plan(set={"temperature": "300K"}, keep="all", time_limit="1s", name="n").runs[0].run == base


def test_files(tmp_path: Path) -> None:
    text = 'system = "weighing"\ntable = "points.csv"\n[set]\nduration = "2s"\n[set.source]\noffset = 1\n'
    (tmp_path / "c.toml").write_text(text)
    (tmp_path / "points.csv").write_text("temperature [degC],fault,seed\n20,,4\n-5.5,failed,5\n")
    definition = read_definition(tmp_path / "c.toml")
    found = make_plan(definition)
    assert definition.name == "c" and definition.set == {"duration": "2s", "source.offset": "1"}
    assert [(r.seed, dict(r.shown)) for r in found.runs] == [
        (4, {"temperature": 20.0}), (5, {"temperature": -5.5, "fault": "failed"}),
    ]  # fmt: skip
    assert found.units == {"in.temperature": "degC"}
    (tmp_path / "rows.py").write_text(
        "def rows(n):\n    return [{'source.offset': k / 3, 'seed': k} for k in range(n)]\n"
    )
    (tmp_path / "d.toml").write_text('system = "weighing"\ntable = "rows.py:rows"\narguments = {n = 4}\n')
    assert [r.values["source.offset"] for r in make_plan(read_definition(tmp_path / "d.toml")).runs][3] == 1.0


@pytest.mark.parametrize(
    ("asked", "problem"),
    [
        ({"sytem": "weighing"}, "unknown key 'sytem'; did you mean system"),
        ({}, "what is run"),
        ({"system": "weighing", "keep": "some"}, "keep = some"),
        ({"system": "weighing", "over": {"tempreature": "1,2"}}, "no such option of weighing; options: temperature"),
        ({"system": "weighing", "over": {"source.ofset": "1,2"}}, "did you mean offset"),
        ({"system": "weighing", "over": {"sauce.offset": "1,2"}}, "no slot 'sauce'"),
        ({"system": "weighing", "over": {"temperature": "uniform(1, 2) K"}}, "how many points are drawn"),
        ({"system": "weighing", "runs": 5}, "nothing is drawn"),
        ({"system": "weighing", "seeds": 0}, "a number of seeds from 1 to"),
        ({"system": "weighing", "data": "none/*.csv"}, "no such file"),
        ({"system": "weighing", "memory_limit": "lots"}, "500MB or 1.5GB"),
        ({"system": "weighing", "set": {"temperature": "3K"}, "over": {"temperature": "1,2 K"}}, "leave out one"),
        ({"system": "weighing", "table": "none.csv"}, "none.csv: No such file"),
    ],
)
def test_what_is_refused_before_anything_runs(asked: dict[str, Any], problem: str) -> None:
    with pytest.raises(UsageError, match=problem):
        make_plan(from_mapping(asked))


def test_what_a_measured_record_may_say_can_be_said_of_a_lot(tmp_path: Path) -> None:
    """As of one file by ``reduce --set``; of simulated runs it says nothing, and any other name is refused at once."""
    (tmp_path / "a.csv").write_text("1.0\n", encoding="utf-8")
    lot = {"system": "weighing", "data": str(tmp_path / "*.csv")}
    said = {"type_b": "none", "arrangement": "checked", "operator": "Li"}
    assert make_plan(from_mapping({**lot, "set": said})).runs[0].values == said
    for asked in ({**lot, "set": {"type_c": "none"}}, {"system": "weighing", "set": {"type_b": "none"}}):
        with pytest.raises(UsageError, match="type_"):
            make_plan(from_mapping(asked))


def test_a_file_that_is_there_twice_is_named(tmp_path: Path) -> None:
    """Under two names, as a copied one of a lot: one run, and the lot is smaller than it looks."""
    for name, text in (("a", "1.0\n"), ("b", "2.0\n"), ("c", "1.0\n")):
        (tmp_path / f"{name}.csv").write_text(text, encoding="utf-8")
    plan = make_plan(from_mapping({"system": "weighing", "data": str(tmp_path / "*.csv")}))
    assert len(plan.runs) == 2 and plan.notes == ["c.csv holds what a.csv holds: the two count once"]


LOOP = {"system": "platform_single_axis", "over": {"platform.J": "2,4 kg.m2"}, "set": {"hold": "10s"}}


@pytest.mark.long
def test_a_design_that_follows_a_varied_part_is_told_and_can_be_held(monkeypatch: pytest.MonkeyPatch) -> None:
    """The gain of the loop is in proportion to the inertia it is designed for: of a sweep of the inertia each point is
    the same loop, unless the design is held; then twice the inertia halves the gain and costs phase margin.
    """
    pytest.importorskip("distributed")
    monkeypatch.chdir(standard_folder())
    (note,) = [n for n in make_plan(from_mapping(LOOP)).notes if "--fixed-design" in n]
    assert note.startswith("platform.J: the design of platform_single_axis follows it")
    held = make_plan(from_mapping({**LOOP, "fixed_design": True}))
    assert not [n for n in held.notes if "--fixed-design" in n] and held.nominal == {}
    assert not {r.run for r in held.runs} & {r.run for r in make_plan(from_mapping(LOOP)).runs}
    kept, following = (
        gb.sweep(**LOOP, fixed_design=f, workers=1, check_step=False)["PM.estimate"].tolist() for f in (True, False)
    )
    assert kept[0] == following[0]  # 2 kg m2 is nominal
    assert abs(following[1] - following[0]) < 1.0
    assert kept[0] - kept[1] > 5.0


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"over": {"crossover": "5,10 Hz"}}, "no parameter of a part is varied"),
        ({"parts": {"estimator": "estimator_none, estimator_kalman_rate"}}, "estimator is an axis of parts"),
        ({"fixed_design": "yes"}, "true or false is expected"),
    ],
)
def test_a_design_that_cannot_be_held_is_refused(more: dict[str, Any], words: str) -> None:
    with pytest.raises(UsageError, match=words):
        make_plan(from_mapping({**LOOP, "fixed_design": True, **more}))
