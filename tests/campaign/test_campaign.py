"""Campaigns on a bench of the tests' own: what is run, what becomes of it, and that nothing is lost or done twice."""

from __future__ import annotations

import contextlib
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import gyrobench as gb
from gyrobench.bench import UsageError
from gyrobench.campaign.execution import campaign_execution
from gyrobench.campaign.execution.clusters import local_cluster
from gyrobench.campaign.execution.store import Campaign, CampaignError
from gyrobench.files import TEMPORARY
from gyrobench.workflow.user_errors import exit_code

pytestmark = pytest.mark.long

BENCH = Path(__file__).with_name("bench")
distributed = pytest.importorskip("distributed")


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(BENCH)


@pytest.fixture(scope="module")
def two() -> Iterator[Any]:
    """Two workers, for all tests of this file."""
    with local_cluster(2) as client:
        yield client


def rows(folder: Path) -> bytes:
    """The one file of the runs of a campaign that is complete."""
    (file,) = (folder / "runs").iterdir()
    return file.read_bytes()


AXES = {"source.offset": "1..2:3", "temperature": "250,300 K"}


def test_a_sweep_is_what_single_runs_give(two: Any, tmp_path: Path) -> None:
    states: list[str] = []
    frame = gb.sweep(
        "weighing", AXES, seeds=4, client=two, out=tmp_path / "c", set={"duration": "0.5s"},
        progress=lambda p: states.append(p.words),
    )  # fmt: skip
    assert len(frame) == 24 and set(frame["state"]) == {"done"}
    assert frame["in.source.offset"].tolist() == [x for x in (1.0, 1.5, 2.0) for _ in range(8)]
    assert frame["in.temperature"].tolist()[:8] == [250.0] * 4 + [300.0] * 4
    assert frame["seed"].tolist()[:4] == [1, 2, 3, 4]
    assert [len(w) for w in frame["warnings"]][:8] == [1] * 4 + [0] * 4
    test = gb.load("weighing", duration="0.5s", temperature="300K")
    test.set("source.offset", 1.5)
    for row in frame[(frame["in.source.offset"] == 1.5) & (frame["in.temperature"] == 300.0)].itertuples():
        c = test.run(seed=row.seed).result["mean"]
        found = frame.loc[row.Index]
        assert [found[f"mean.{k}"] for k in ("estimate", "u", "lo", "hi", "truth")] == [
            c.estimate, c.u, *c.interval, 1.5,
        ]  # fmt: skip
    assert frame.attrs["units"]["mean.u"] == "V" and frame.attrs["units"]["in.temperature"] == "K"
    assert any("of 24 runs" in s and "2 workers" in s for s in states)
    axes = Campaign.open(tmp_path / "c").axes
    assert [(a["name"], a["kind"], a["unit"]) for a in axes] == [
        ("source.offset", "grid", ""), ("temperature", "list", "K"), ("seed", "seed", ""),
    ]  # fmt: skip


def test_workers_and_order_change_no_bit_and_nothing_is_done_twice(two: Any, tmp_path: Path) -> None:
    times = tmp_path / "times"
    asked = {"system": "weighing", "over": AXES, "seeds": 3, "set": {"duration": "0.05s", "times": str(times)}}
    gb.campaign(asked, client=two, out=tmp_path / "two")
    with local_cluster(1) as one:
        (worker,) = one.run(os.getpid).values()
        gb.campaign(asked, client=one, out=tmp_path / "one")
        half = {**asked, "over": {**AXES, "temperature": "300 K"}}
        gb.campaign(half, client=one, out=tmp_path / "parts")
        assert len(times.read_text().split()) == 18 + 18 + 9
        gb.campaign(asked, client=two, out=tmp_path / "parts")  # runs added to the file run alone
        assert len(times.read_text().split()) == 18 + 18 + 18
    owners = [f.read_text() for f in Path(tempfile.gettempdir()).glob(f"{TEMPORARY}*/.lock")]
    assert str(worker) not in owners and str(os.getpid()) in owners
    gb.campaign(asked, out=tmp_path / "two")  # nothing to do: not even a cluster
    assert len(times.read_text().split()) == 54
    assert rows(tmp_path / "two") == rows(tmp_path / "one") == rows(tmp_path / "parts")


def test_nobody_else_reaches_the_scheduler_of_local_workers(two: Any) -> None:
    """Neither without TLS nor with a certificate of one's own: whoever is let in can have code executed here."""
    address = two.scheduler.address
    assert all(a.startswith("tls://127.0.0.1:") for a in (address, *two.nthreads()))
    for where, security in ((address.replace("tls:", "tcp:"), None), (address, distributed.Security.temporary())):
        with pytest.raises(OSError):
            distributed.Client(where, security=security, timeout="2s", set_as_default=False)


def test_threads_of_this_process_are_workers_too(two: Any, tmp_path: Path) -> None:
    asked = {"system": "weighing", "over": AXES, "set": {"duration": "0.05s"}}
    with distributed.Client(processes=False, n_workers=2, threads_per_worker=2, dashboard_address=None) as client:
        assert len(gb.campaign(asked, out=tmp_path / "a")) == 6  # the client of the notebook
        assert client.status == "running"
    gb.campaign(asked, client=two, out=tmp_path / "b")
    assert rows(tmp_path / "a") == rows(tmp_path / "b")


def test_a_worker_started_by_hand_needs_no_compiler_and_no_bench(two: Any, tmp_path: Path) -> None:
    asked = {"system": "weighing", "over": AXES, "set": {"duration": "0.05s"}}
    (tmp_path / "w").mkdir()
    (tmp_path / "w" / "sitecustomize.py").write_text('import sys\nsys.modules["ziglang"] = None  # not there either\n')
    env = {k: v for k, v in os.environ.items() if k not in ("CC", "PATH")}
    path = os.pathsep.join([str(tmp_path / "w"), str(Path(gb.__file__).parents[1])])
    env |= {"PATH": "", "PYTHONPATH": path, "GYROBENCH_CACHE": str(tmp_path / "w")}
    with distributed.LocalCluster(n_workers=0, dashboard_address=None) as cluster:
        command = [sys.executable, "-m", "distributed.cli.dask_worker", cluster.scheduler_address, "--nthreads", "1"]
        worker = subprocess.Popen(
            [*command, "--no-dashboard"], env=env, cwd=tmp_path / "w", stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            gb.campaign(asked, scheduler=cluster.scheduler_address, out=tmp_path / "a")
        finally:
            worker.terminate()
            worker.wait(60)
    gb.campaign(asked, client=two, out=tmp_path / "b")
    assert rows(tmp_path / "a") == rows(tmp_path / "b")
    assert set(Campaign.open(tmp_path / "a").arrow()["state"].to_pylist()) == {"done"}
    assert not list((tmp_path / "w").rglob("*.so"))


# -------------------------------------------------------------------------------------------- faults
FAULTS = {
    "": ("done", None),
    "refused": ("refused", "weighing refuses to run:\n  - fault = refused: no"),
    "failed": ("failed", "the scale has no plate"),
    "error": ("failed", "systems/weighing/reduction.py:31: ZeroDivisionError: by nothing"),
    "crash": ("crashed", "ended its worker process: Segmentation fault"),
    "exit": ("crashed", "ended its worker process, without a signal from inside"),
    "memory": ("memory", "more than 900 MB in use (memory_limit)"),
}


def test_every_fault_becomes_a_row_with_its_reason_and_the_others_go_on(two: Any, tmp_path: Path) -> None:
    """Runs that hang have a campaign of their own, with a limit that would end a good run on a slow machine."""
    asked = {
        "system": "weighing", "over": {"fault": list(FAULTS)}, "retries": 0, "memory_limit": "900MB", "keep": "none",
        "set": {"duration": "0.05s"},
    }  # fmt: skip
    frame = gb.campaign(asked, client=two, out=tmp_path / "c").set_index("in.fault")
    found = {fault: (frame["state"][fault], frame["reason"][fault]) for fault in FAULTS}
    found[""] = (found[""][0], None)
    assert found == FAULTS
    log = Campaign.open(tmp_path / "c").log().set_index("run")
    assert {int(log["attempts"][frame["run"][fault]]) for fault in FAULTS} == {1}
    assert len(gb.campaign(asked, client=two, out=tmp_path / "c")) == len(FAULTS)  # nothing is tried again

    hang = {**asked, "over": {"fault": ["hang"]}, "seeds": 3, "time_limit": "2s"}  # the third needs a new worker
    frame = gb.campaign(hang, client=two, out=tmp_path / "h")
    assert set(zip(frame["state"], frame["reason"], strict=True)) == {("hung", "no result within 2 s (time_limit)")}
    assert set(Campaign.open(tmp_path / "h").log()["attempts"]) == {1}


def test_a_run_that_lost_its_worker_once_is_done_the_second_time(two: Any, tmp_path: Path) -> None:
    asked = {
        "system": "weighing",
        "seeds": 6,
        "set": {"duration": "0.05s", "times": str(tmp_path / "t"), "fault": "once"},
    }
    frame = gb.campaign(asked, client=two, out=tmp_path / "c")
    assert set(frame["state"]) == {"done"}
    log = Campaign.open(tmp_path / "c").log()
    assert sorted(log["attempts"])[-1] == 2 and sorted(log["attempts"])[0] == 1
    assert "ended its worker process" in log[log["attempts"] == 2]["tries"].iloc[0]


def test_a_fault_that_is_told_before_its_worker_is_known_to_be_lost_is_not_tried_again(
    two: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    collect = campaign_execution._Execution._collect

    def told_first(execution: Any) -> None:
        while execution.flying and not execution.tries:
            time.sleep(0.02)
            execution._inquire()
        collect(execution)

    monkeypatch.setattr(campaign_execution._Execution, "_collect", told_first)
    asked = {"system": "weighing", "retries": 0, "set": {"duration": "0.05s", "fault": "crash"}}
    assert gb.campaign(asked, client=two, out=tmp_path / "c")["state"].tolist() == ["crashed"]
    assert Campaign.open(tmp_path / "c").log()["attempts"].tolist() == [1]


def test_a_full_disk_ends_the_campaign_and_nothing_is_lost(
    two: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = {"system": "weighing", "seeds": 8, "set": {"duration": "0.05s"}}
    monkeypatch.setattr(campaign_execution, "WRITE", 0.0)
    synced = os.fsync
    count = iter(range(1000))

    def full(handle: int) -> None:
        if next(count) >= 6:
            raise OSError(28, "No space left on device")
        synced(handle)

    with monkeypatch.context() as m:
        m.setattr(os, "fsync", full)
        with pytest.raises(
            CampaignError, match=r"No space left on device: make room; \d of 8 runs are stored in .*: the same"
        ):
            gb.campaign(asked, client=two, out=tmp_path / "c")
    before = Campaign.open(tmp_path / "c").arrow().num_rows
    assert 0 < before < 8
    gb.campaign(asked, client=two, out=tmp_path / "c")
    gb.campaign(asked, client=two, out=tmp_path / "d")
    assert rows(tmp_path / "c") == rows(tmp_path / "d")
    with pytest.raises(CampaignError, match=r"worker tls:.*: No space left on device; 0 of 8 runs are stored"):
        gb.campaign({**asked, "set": {"fault": "disk"}}, client=two, out=tmp_path / "e")
    assert exit_code(CampaignError("")) == 3


def of_session(session: int) -> list[int]:
    """The processes of a session that run."""
    found = []
    for pid in filter(str.isdigit, os.listdir("/proc") if os.path.isdir("/proc") else []):
        with contextlib.suppress(OSError):
            if os.getsid(int(pid)) == session:
                found.append(int(pid))
    return found


def test_a_campaign_that_is_killed_goes_on_where_it_was(two: Any, tmp_path: Path) -> None:
    """A third of the runs waits for the kill: however fast the others are, the campaign has not ended by then."""
    times, file = tmp_path / "times", tmp_path / "c.toml"
    file.write_text(f'system = "weighing"\nseeds = 150\n[set]\nfault = "wait"\ntimes = "{times}"\n')
    command = [sys.executable, "-m", "gyrobench", "campaign", str(file), "--out", str(tmp_path / "c"), "--workers", "1"]
    env = {**os.environ, "PYTHONPATH": str(Path(gb.__file__).parents[1])}
    process = subprocess.Popen(
        command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        while not list((tmp_path / "c" / "runs").glob("*.parquet")):
            assert process.poll() is None, process.communicate()
            time.sleep(0.05)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    deadline = time.monotonic() + 5.0
    while left := of_session(process.pid):
        assert time.monotonic() < deadline, f"workers outlive their campaign: {left}"
        time.sleep(0.1)
    stored = Campaign.open(tmp_path / "c").arrow()
    assert 0 < stored.num_rows < 150
    begun = len(times.read_text().split())
    times.with_suffix(".go").touch()
    gb.campaign(file, client=two, out=tmp_path / "c")
    # what is stored was not run again; what was on its way to the store was
    assert len(times.read_text().split()) - begun <= 150 - stored.num_rows
    gb.campaign(file, client=two, out=tmp_path / "d")
    assert rows(tmp_path / "c") == rows(tmp_path / "d")


# ---------------------------------------------------------------------------------------- what is kept, data
def test_what_is_kept(two: Any, tmp_path: Path) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text('title = "t"\n[coefficients.mean]\nmin = 0.0\nmax = 1.4\nunit = "V"\n')
    asked = {
        "system": "weighing",
        "over": {"source.offset": "1,1.2,1.5"},
        "set": {"duration": "0.2s"},
        "spec": str(spec),
    }
    failures = gb.campaign(asked, client=two, out=tmp_path / "failures")
    assert failures["verdict"].tolist() == ["pass", "pass", "fail"]
    assert failures["report"].notna().tolist() == [False, False, True]
    broken = gb.campaign({"system": "weighing", "set": {"fault": "failed"}}, client=two, out=tmp_path / "broken")
    assert {p.name for p in (tmp_path / "broken" / "kept" / broken["run"][0]).iterdir()} >= {"run.json"}  # its record
    extremes = gb.campaign({**asked, "keep": "extremes"}, client=two, out=tmp_path / "extremes")
    assert extremes["report"].notna().tolist() == [True, False, True]
    kept = tmp_path / "extremes" / extremes["report"][0]
    assert "<html" in kept.read_text()
    run = gb.open_run(kept.parent)
    assert run.result["mean"].estimate == extremes["mean.estimate"][0] == run.record.channels["source.z"].mean()


def test_measured_files(two: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for k in range(3):
        (tmp_path / f"gyro{k}.csv").write_text(f"{k}.0\n{k}.5\n")
    (tmp_path / "gyro1.csv").write_text("torn")
    frame = gb.campaign({"system": "weighing", "data": str(tmp_path / "*.csv")}, client=two, out=tmp_path / "c")
    assert frame["state"].tolist() == ["done", "refused", "done"]
    assert frame["reason"][1].endswith("gyro1.csv: not usable:\n  - could not convert string to float: 'torn'")
    assert frame["instrument"].tolist()[::2] == ["gyro0", "gyro2"] and frame["seed"].isna().all()
    assert frame["mean.estimate"][2] == 2.25 and math.isnan(frame["mean.truth"][2])
    with monkeypatch.context() as m:  # workers that do not see these files get them sent
        m.setattr(campaign_execution, "is_local", lambda client: False)
        gb.campaign({"system": "weighing", "data": str(tmp_path / "*.csv")}, client=two, out=tmp_path / "sent")
    assert rows(tmp_path / "sent") == rows(tmp_path / "c")
    (tmp_path / "gyro1.csv").write_text("7.0")  # mended: it alone is reduced, its old row is put aside
    frame = gb.campaign({"system": "weighing", "data": str(tmp_path / "*.csv")}, client=two, out=tmp_path / "c")
    assert frame["mean.estimate"].tolist() == [0.25, 7.0, 2.25]
    assert Campaign.open(tmp_path / "c").log()["run"].nunique() == 4


def test_commands(two: Any, tmp_path: Path, command: Any) -> None:
    words = ["sweep", "weighing", "--over", "source.offset=1,2", "--seeds", 2, "--set", "duration=0.05s"]
    local = {"processes": False, "protocol": "tcp://", "dashboard_address": "127.0.0.1:0"}
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, **local) as cluster:
        code, out, err = command(*words, "--out", tmp_path / "c", "--scheduler", cluster.scheduler_address)
    assert code == 0 and "4 runs: 4 done" in out and "dashboard: http" in err
    code, _, err = command(*words, "--out", tmp_path / "t", "--scheduler", two.scheduler.address)
    assert code == 3 and "TLS needs certificates, distributed.comm.tls" in err  # those of local workers are nobody's
    code, out, _ = command(*words, "--out", tmp_path / "c")
    assert "4 runs: 4 done (4 were stored before)" in out and "mean" in out
    code, _, err = command("sweep", "weighing")
    assert code == 2 and "nothing is varied" in err
    code, _, err = command("sweep", "weighing", "--over", "tempreature=1,2")
    assert code == 2 and "tempreature: no such option of weighing; options: temperature" in err
    code, _, err = command("campaign", tmp_path / "none.toml")
    assert code == 2 and "none.toml: No such file" in err
    with pytest.raises(UsageError, match=r"source\.ofset: source has no such parameter; did you mean offset"):
        gb.sweep("weighing", {"source.ofset": [1.0, 2.0]}, workers=1)
