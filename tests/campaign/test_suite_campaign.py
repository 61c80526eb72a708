"""A suite as a campaign: names of its tests, rows with each test's coefficients, the site."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import gyrobench as gb
from gyrobench.bench import UsageError
from gyrobench.campaign.execution.campaign_plan import make_plan
from gyrobench.campaign.execution.definition import from_mapping

distributed = pytest.importorskip("distributed")
TESTS = ("tumble_single_axis", "fixed_position")
#: short plans; the second point's fixed position is refused: a negative dwell
ASKED: dict[str, Any] = {
    "system": "drift_test_suite",
    "set": {
        "tests": " ".join(TESTS), "tumble_single_axis.rate": "0.15rad/s", "tumble_single_axis.windows": 12,
        "tumble_single_axis.dwell": "10s", "tumble_single_axis.settle": "2s",
    },
    "over": {"fixed_position.dwell": "60s,-1s", "gyro.D_F": "0.3 deg/h"},
    "keep": "all",
}  # fmt: skip


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    with distributed.Client(processes=False, n_workers=1, threads_per_worker=1, dashboard_address=None) as one:
        yield one


@pytest.mark.long
def test_a_row_has_what_the_suite_says_and_what_each_test_says(client: Any, tmp_path: Path) -> None:
    """A test that fails leaves the row with its reason, and with what the other one found."""
    frame = gb.campaign(ASKED, client=client, out=tmp_path / "c")
    done, half = frame.iloc[0], frame.iloc[1]
    assert (done["state"], half["state"]) == ("done", "failed")
    alone = gb.load("tumble_single_axis", rate="0.15rad/s", windows=12, dwell="10s", settle="2s")
    suite = gb.load_suite("drift_test_suite")
    same = alone.set("gyro.D_F", "0.3deg/h").run(seed=suite.suite.seed_of(1, "tumble_single_axis")).result
    for name in ("D_F", "D_I"):
        c = same[name]
        assert done[f"tumble_single_axis.{name}.estimate"] == half[f"tumble_single_axis.{name}.estimate"] == c.estimate
        assert done[f"tumble_single_axis.{name}.u"] == c.u
    assert frame.attrs["units"]["tumble_single_axis.D_I.estimate"] == "°/h/g"
    assert half["reason"].startswith("fixed_position: ")
    own = [c for c in frame.columns if c.startswith("fixed_position.")]
    assert {"fixed_position.ω_d.estimate", "fixed_position.ω_d.truth"} <= set(own)
    assert done[own].notna().all() and half[own].isna().all()
    site = gb.site(tmp_path / "c")
    assert "1 of 2 runs have a result" in site.answer[0]
    names = {m["name"] for m in json.loads((site.index.parent / "analysis.json").read_text())["coverage"]}
    assert {"D_F", "tumble_single_axis.D_F"} <= names


@pytest.mark.long
def test_names_are_those_of_the_tests_that_are_chosen() -> None:
    """Values of tests that are not in the suite's own choice; a name that no test has."""
    asked = {"system": "drift_test_suite", "set": {"tests": "tumble_two_channel eight_position"}}
    plan = make_plan(from_mapping({**asked, "over": {"eight_position.dwell": "20s,30s", "gyro.Dx_x": "1deg/h/g"}}))
    assert len(plan.runs) == 2 and set(plan.setups[0]) == {"tumble_two_channel", "eight_position"}
    with pytest.raises(UsageError, match=r"tumble_single_axis.rate: no test of the suite takes it"):
        make_plan(from_mapping({**asked, "over": {"tumble_single_axis.rate": "0.1rad/s"}}))
    both = {"tests": ["tumble_two_channel eight_position", "tumble_single_axis fixed_position"]}
    plan = make_plan(from_mapping({"system": "drift_test_suite", "over": both, "set": {"fixed_position.dwell": "60s"}}))
    assert len(plan.setups) == 2
