"""The stored campaign: rows in any order and any number of files are one dataset, at any moment, and to the bit."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from gyrobench.campaign.execution.store import Campaign, CampaignError, CampaignStore
from gyrobench.files import FolderInUseError

DOCUMENT = {"name": "lot", "question": "", "system": "toy", "axes": [{"name": "T", "kind": "list", "unit": "K"}]}
UNITS = {"in.T": "K", "a.estimate": "°/h", "a.u": "°/h", "b.estimate": "1"}


def row(k: int, **more: Any) -> dict[str, Any]:
    return {"run": f"{k:016x}", "index": k, "system": "toy", "seed": k, "state": "done", "in.T": 300.0 + k, **more}


ROWS = [
    row(0, **{"a.estimate": 0.1, "a.u": 0.01, "verdict": "pass", "warnings": ["one"]}),
    row(1, **{"b.estimate": 2.0, "a.estimate": -0.0, "a.u": float("nan")}),
    {**row(2), "state": "refused", "reason": "T: must be <= 301 K"},
    row(3, **{"c.estimate": 1e-300, "c.truth": None, "a.estimate": 4.0}),
]
PLAN = {r["run"]: {"index": r["index"], "in.T": r["in.T"]} for r in ROWS}


def runs(folder: Path) -> bytes:
    """The one file of the runs."""
    (file,) = (folder / "runs").iterdir()
    return file.read_bytes()


def test_half_files_of_killed_writers_are_removed(tmp_path: Path) -> None:
    with CampaignStore(tmp_path / "c") as store:
        store.begin(DOCUMENT, PLAN, UNITS)
        store.append(ROWS, UNITS)
        half = tmp_path / "c" / "runs" / "0123.parquetx_y.part"
        half.write_bytes(b"PAR1")
        assert Campaign.open(tmp_path / "c").arrow().num_rows == 4
        store.consolidate()
    assert not half.exists() and runs(tmp_path / "c")


@pytest.mark.long
def test_order_and_files_of_the_rows_change_no_bit(tmp_path: Path) -> None:
    seen = set()
    for k, order in enumerate(itertools.permutations(ROWS)):
        with CampaignStore(tmp_path / f"c{k}") as store:
            assert store.begin(DOCUMENT, PLAN, UNITS) == {}
            cut = k % 4
            for part in (order[:cut], order[cut:]):
                store.append(part, UNITS)
            if k % 2:  # merged on the way
                store.consolidate()
                store.append([order[0]], UNITS)
            store.consolidate()
        seen.add(runs(tmp_path / f"c{k}"))
    assert len(seen) == 1
    campaign = Campaign.open(tmp_path / "c0")
    frame = campaign.table()
    assert list(frame.columns) == [
        "run", "index", "system", "seed", "data", "state", "reason", "in.T", "a.estimate", "a.u", "b.estimate",
        "c.estimate", "c.truth", "verdict", "warnings", "warning_ids", "report", "instrument", "date",
    ]  # fmt: skip
    assert frame["index"].tolist() == [0, 1, 2, 3]
    assert campaign.units == UNITS == frame.attrs["units"]
    assert frame["a.u"].isna().tolist() == [False, True, True, True]
    assert frame["reason"][2] == "T: must be <= 301 K"
    assert list(frame["warnings"][0]) == ["one"]


def test_a_changed_definition_takes_along_what_is_done_and_puts_the_rest_aside(tmp_path: Path) -> None:
    with CampaignStore(tmp_path / "c") as store:
        store.begin(DOCUMENT, PLAN, UNITS)
        store.append(ROWS, UNITS)
    place = {ROWS[3]["run"]: {"index": 0, "in.H": 7.0}, ROWS[0]["run"]: {"index": 5, "in.H": 8.0}}
    with CampaignStore(tmp_path / "c") as store:
        assert store.begin(DOCUMENT, place, {"in.H": "m"}) == {ROWS[3]["run"]: "done", ROWS[0]["run"]: "done"}
    campaign = Campaign.open(tmp_path / "c")
    frame = campaign.table()
    assert frame["index"].tolist() == [0, 5]
    assert frame["in.H"].tolist() == [7.0, 8.0] and "in.T" not in frame
    assert frame["a.estimate"].tolist() == [4.0, 0.1]
    assert campaign.units["in.H"] == "m" and campaign.units["a.estimate"] == "°/h"
    with CampaignStore(tmp_path / "c") as store:  # and back: nothing is lost
        assert store.begin(DOCUMENT, PLAN, UNITS) == {r["run"]: r["state"] for r in ROWS}
        store.consolidate()
    with CampaignStore(tmp_path / "d") as store:
        store.begin(DOCUMENT, PLAN, UNITS)
        store.append(ROWS, UNITS)
        store.consolidate()
    assert runs(tmp_path / "c") == runs(tmp_path / "d")


def test_a_merge_that_is_killed_between_its_steps_leaves_every_run_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with CampaignStore(tmp_path / "c") as store:
        store.begin(DOCUMENT, PLAN, UNITS)
        for r in ROWS:
            store.append([r], UNITS)
        with monkeypatch.context() as m, pytest.raises(KeyboardInterrupt):
            m.setattr(type(store.fs), "rm_file", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
            store.consolidate()
    assert len(list((tmp_path / "c" / "runs").iterdir())) == 5  # four and their merge
    assert Campaign.open(tmp_path / "c").table()["index"].tolist() == [0, 1, 2, 3]
    with CampaignStore(tmp_path / "c") as store:
        assert len(store.begin(DOCUMENT, PLAN, UNITS)) == 4
    assert len(list((tmp_path / "c" / "runs").iterdir())) == 1


def test_rows_are_forgotten_by_their_state(tmp_path: Path) -> None:
    with CampaignStore(tmp_path / "c") as store:
        store.begin(DOCUMENT, PLAN, UNITS)
        store.append(ROWS, UNITS)
        assert store.forget(["refused", "hung"]) == [ROWS[2]["run"]]
    assert Campaign.open(tmp_path / "c").table()["index"].tolist() == [0, 1, 3]


def test_kept_reports_are_named_in_their_rows_and_the_log_is_apart(tmp_path: Path) -> None:
    with CampaignStore(tmp_path / "c") as store:
        store.begin(DOCUMENT, PLAN, UNITS)
        store.keep(ROWS[1]["run"], {"report.html": b"<p>", "result.json": b"{}"})
        log = [{"run": r["run"], "worker": "w", "attempts": 1, "seconds": 0.1} for r in ROWS]
        store.append(ROWS[:2], UNITS, log[:2])
        store.append(ROWS[2:], UNITS, log[2:])
        store.consolidate()
    campaign = Campaign.open(tmp_path / "c")
    path = campaign.table()["report"][1]
    assert path == f"kept/{ROWS[1]['run']}/report.html" and campaign.read(path) == b"<p>"
    assert campaign.table()["report"].isna().sum() == 3
    assert sorted(campaign.log()["run"]) == sorted(r["run"] for r in ROWS)


def test_any_storage_that_fsspec_knows(tmp_path: Path) -> None:
    with CampaignStore("memory://campaigns/one") as store:
        store.begin(DOCUMENT, PLAN, UNITS)
        store.append(ROWS[::-1], UNITS)
        store.consolidate()
    with CampaignStore(tmp_path / "c") as store:
        store.begin(DOCUMENT, PLAN, UNITS)
        store.append(ROWS, UNITS)
        store.consolidate()
    stored = Campaign.open("memory://campaigns/one")
    assert stored.read(stored._files("runs")[0].split("campaigns/one/")[1]) == runs(tmp_path / "c")


def test_what_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match=r"no campaign there \(no campaign.json\)"):
        Campaign.open(tmp_path)
    (tmp_path / "thesis.tex").touch()
    with CampaignStore(tmp_path) as store, pytest.raises(CampaignError, match=r"holds other files; name a new folder"):
        store.begin(DOCUMENT, PLAN)
    with CampaignStore(tmp_path / "c") as store:
        with pytest.raises(FolderInUseError, match="another run writes here"):
            CampaignStore(tmp_path / "c").__enter__()
        store.begin(DOCUMENT, PLAN)
        store.append(ROWS, UNITS)
        with pytest.raises(CampaignError, match=r"a\.u: in °/s here, in °/h in other runs"):
            store.append(ROWS, {"a.u": "°/s"})
    (tmp_path / "c" / "runs" / "torn.parquet").write_bytes(b"PAR1")
    with pytest.raises(
        CampaignError, match=r"torn.parquet: changed after it was saved.*remove the file: the runs in it are run again"
    ):
        Campaign.open(tmp_path / "c")
    assert json.loads((tmp_path / "c" / "campaign.json").read_text())["schema"] == "gyrobench-campaign-1"
    assert pq.read_schema(next((tmp_path / "c" / "runs").glob("[0-9a-f]*.parquet"))).field("a.u").metadata == {
        b"unit": "°/h".encode()
    }
