"""Jobs of the studio: each in a process of its own, their state in the bench's folder."""

from __future__ import annotations

import json
import os
import random
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from short_plans import SHORT as SHORT_PLANS

from gyrobench.bench import Bench, UsageError
from gyrobench.report import report_files
from gyrobench.report.language import Language, catalogue
from gyrobench.report.page_model import Page
from gyrobench.studio import job_process
from gyrobench.studio.job_process import LIVE, REQUEST, STARTED, JobReport
from gyrobench.studio.jobs import StudioJob, StudioJobs
from gyrobench.studio.request import CommandRequest, JobRequest, comparison_command, comparison_python, read_request
from gyrobench.workflow.user_errors import PostRunError, record_kept

SHORT = JobRequest("fixed_position", {"dwell": "60s"}, seed=3)
LONG = JobRequest("fixed_position", {"dwell": "20000000s"})  # hours
LIMIT = 300.0  # s


@pytest.fixture
def jobs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[StudioJobs]:
    monkeypatch.chdir(tmp_path)
    made = StudioJobs(Bench.find(), most=1)
    yield made
    for job in made.all():  # of a test that failed
        if job.active:
            made.stop(job.key)


def until(jobs: StudioJobs, key: str, there: Callable[[StudioJob], bool]) -> StudioJob:
    """Return a job once it is as wanted."""
    end = time.monotonic() + LIMIT
    while not there(job := jobs.find(key)):
        assert time.monotonic() < end, job
        jobs.advance()
        time.sleep(0.05)
    return job


def ended(job: StudioJob) -> bool:
    return not job.active


def under_way(job: StudioJob) -> bool:
    return job.state == "running" and job.report.fraction > 0.0


def test_a_job_does_what_its_command_does(jobs: StudioJobs, tmp_path: Path) -> None:
    done = until(jobs, jobs.submit(SHORT), ended)
    assert (done.state, done.report.message) == ("done", "")
    folder = Path(done.report.folder)
    assert (folder / "report.html").is_file() and folder.is_relative_to(tmp_path / "reports" / "out" / "fixed_position")
    digest = json.loads((folder / "run.json").read_text())["tables"]
    shutil.rmtree(folder)
    words = shlex.split(SHORT.command())
    subprocess.run([sys.executable, "-m", *words, "--no-report"], check=True, capture_output=True)
    assert json.loads((folder / "run.json").read_text())["tables"] == digest, "another run, or in another folder"
    subprocess.run([sys.executable, "-c", SHORT.python()], check=True, capture_output=True)
    assert json.loads(Path("report/run.json").read_text())["tables"] == digest, "the lines of Python are another run"


@pytest.mark.long
def test_systems_of_other_kinds_run_by_their_shortest_plan(jobs: StudioJobs) -> None:
    """A loop that is captured, an alignment by sights; all the others: tests/benchmarks/studio_systems.py."""
    jobs.most = 2
    keys = [
        jobs.submit(JobRequest(name, SHORT_PLANS.get(name, {}), seed=1))
        for name in ("table_capture", "stand_alignment")
    ]
    for key in keys:
        done = until(jobs, key, ended)
        assert done.state == "done", done.report
        assert (Path(done.report.folder) / "report.html").is_file()
    assert set(SHORT_PLANS) <= set(Bench.find().systems())


@pytest.mark.long
def test_one_waits_for_the_other_and_can_be_stopped(jobs: StudioJobs) -> None:
    first, second = jobs.submit(LONG), jobs.submit(SHORT)
    file = jobs.folder / first / LIVE
    until(jobs, first, lambda job: under_way(job) and file.is_file() and len(json.loads(file.read_text())["time"]) > 10)
    assert jobs.find(second).state == "waiting"
    live = json.loads(file.read_text())
    assert live["names"] and len(live["units"]) == len(live["names"]) and all(live["units"])
    assert all(len(v) == len(live["time"]) for v in live["values"])
    assert sorted(live["time"]) == live["time"]
    jobs.stop(second)
    assert jobs.find(second).state == "stopped"
    jobs.stop(first)
    stopped = until(jobs, first, ended)
    assert stopped.state == "stopped" and stopped.report.advice == ["resume", "reduce"], stopped
    assert "interrupted at t = " in stopped.report.message and "--resume" not in stopped.report.message
    again = jobs.resume(first)
    assert jobs.find(again).request == LONG and jobs.find(again).resume
    on = until(jobs, again, under_way)
    assert on.report.fraction > stopped.report.fraction * 0.5, "it went on, it did not begin anew"
    jobs.stop(again)
    assert until(jobs, again, ended).state == "stopped"


@pytest.mark.long
def test_a_killed_studio_loses_nothing_and_a_killed_run_goes_on(jobs: StudioJobs) -> None:
    """A new object has what a new studio has: the folders alone."""
    key = jobs.submit(LONG)
    until(jobs, key, under_way)
    new = StudioJobs(Bench.find(), most=1)
    assert new.find(key).state == "running" and not new._started
    waiting = new.submit(SHORT)
    new.advance()
    assert new.find(waiting).state == "waiting", "the run of the studio before counts"
    process = new._process(key)
    assert process is not None
    os.kill(process, signal.SIGKILL)
    jobs._started[key].wait()  # it is no child of a new studio
    assert until(new, key, ended).state == "lost"
    assert until(new, waiting, ended).state == "done", "what waited was started by the new studio"
    on = until(new, new.resume(key), lambda j: under_way(j) or ended(j))
    assert on.state == "running", on
    new.stop(on.key)
    assert until(new, on.key, ended).state == "stopped"


@pytest.mark.long
def test_a_run_that_a_killed_studio_has_just_started_is_not_lost(jobs: StudioJobs) -> None:
    """A new studio gives it the time to take its lock; one that never began, or was killed, is lost and goes on."""
    jobs.most = 0
    key = jobs.submit(SHORT)
    (jobs.folder / key / STARTED).touch()  # the studio before was killed here
    assert StudioJobs(Bench.find()).find(key).state == "starting"
    os.utime(jobs.folder / key / STARTED, (0.0, 0.0))
    assert jobs.find(key).state == "lost" and jobs.find(key).resumable
    jobs.most = 1
    assert until(jobs, jobs.resume(key), ended).state == "done", "there is nothing yet to go on from"


@pytest.mark.long
def test_what_cannot_run_says_why(jobs: StudioJobs) -> None:
    failed = until(jobs, jobs.submit(JobRequest("fixed_position", {"latitude": "3 kg"})), ended)
    assert failed.state == "failed" and "latitude" in failed.report.message
    words = ["sweep", "fixed_position", "--over=latitude=0deg..80deg", "--out=reports/out/campaigns/x"]
    sweep = until(jobs, jobs.submit(CommandRequest(words, folder="campaigns/x")), ended)
    assert sweep.state == "failed" and sweep.report.folder == "", "a folder without pages is no link to them"
    missing = until(jobs, jobs.submit(JobRequest("fixed_positio")), ended)
    assert "did you mean fixed_position?" in missing.report.message and not missing.resumable


def test_a_show_starts_nothing(jobs: StudioJobs) -> None:
    show = StudioJobs(Bench.find(), read_only=True)
    for action in (lambda: show.submit(SHORT), lambda: show.stop("x"), lambda: show.resume("x")):
        with pytest.raises(UsageError):
            action()
    assert not show.folder.exists()


@pytest.mark.parametrize("key", ["", ".", "..", "../..", "a/b", "/etc", "none", "x\0y"])
def test_no_key_leads_out(jobs: StudioJobs, key: str) -> None:
    with pytest.raises(UsageError, match="no job"):
        jobs.find(key)


def test_damaged_jobs_are_left_out(jobs: StudioJobs) -> None:
    for name, text in (("a", "{"), ("b", "[]"), ("c", '{"request": {"x": 1}, "resume": false, "created": 1}')):
        (jobs.folder / name).mkdir(parents=True)
        (jobs.folder / name / REQUEST).write_text(text)
    (jobs.folder / "d").mkdir()
    assert jobs.all() == []
    jobs.advance()


def test_a_job_that_was_changed_is_not_run_as_another(jobs: StudioJobs) -> None:
    """Bits of 200 places of what is asked: no job of another request is found, and its process does not begin."""
    blocker = jobs.submit(LONG)
    key = jobs.submit(SHORT)  # waits
    file = jobs.folder / key / REQUEST
    content, draw = file.read_bytes(), random.Random(3)
    for _ in range(200):
        changed = bytearray(content)
        changed[draw.randrange(len(changed))] ^= 1 << draw.randrange(8)
        file.write_bytes(bytes(changed))
        with pytest.raises(UsageError, match="no job"):
            jobs.find(key)
    assert job_process.main(file.parent) == 3
    file.write_bytes(content)
    assert "changed after it was written" in jobs.find(key).report.message
    jobs.stop(blocker)


def test_a_run_that_failed_after_a_checkpoint_goes_on() -> None:
    def failed(*advice: str) -> StudioJob:
        return StudioJob("k", JobRequest("a"), False, 0.0, "failed", JobReport(state="failed", advice=[*advice]))

    assert failed("resume").resumable and not failed().resumable and not failed("reduce").resumable


def test_a_report_goes_into_the_language_of_the_studio(jobs: StudioJobs, monkeypatch: pytest.MonkeyPatch) -> None:
    """In Chinese as its command says; where a sentence has no translation in English, and it is said."""
    asked = replace(SHORT, language="zh")
    assert shlex.split(asked.command())[-2:] == ["--language", "zh"]
    assert "run.report('report', language='zh')" in asked.python()

    def end() -> JobReport:
        """Run it in this process."""
        jobs.most = 0
        key = jobs.submit(asked)
        assert job_process.main(jobs.folder / key) == 0
        return jobs.find(key).report

    page = Path(end().folder, "report.html")
    assert '<html lang="zh-CN"' in page.read_text(encoding="utf-8")
    shutil.rmtree(page.parent)
    monkeypatch.setattr(
        report_files, "page_in", lambda *_: Language(catalogue("zh")).page(Page("An own title", "", [], []))
    )
    report = end()
    assert '<html lang="en"' in page.read_text(encoding="utf-8")
    assert any("1 sentence without a translation (zh)" in note for note in report.notes)


def test_what_fails_after_the_run_names_no_command_in_the_studio(tmp_path: Path) -> None:
    """The message of the page and the line of the shell are one error."""
    for cause in (KeyError("x"), KeyboardInterrupt()):
        with pytest.raises(PostRunError) as stopped, record_kept(tmp_path / "a b"):
            raise cause
        assert "the record is kept in" in stopped.value.text and "gyrobench report" not in stopped.value.text
        assert str(stopped.value).endswith(f": gyrobench report '{tmp_path / 'a b'}'")


def test_lines_of_a_request() -> None:
    request = JobRequest(
        "tumble", {"latitude": "45.75deg", "tests": "a b"}, {"gyro": "v 1.fmu"}, {"gyro": "m.toml"}, 0, "limits"
    )
    assert read_request(json.loads(json.dumps(request.as_dict()))) == request
    assert shlex.split(request.command()) == [
        "gyrobench", "run", "tumble", "--set", "latitude=45.75deg", "--set", "tests=a b", "--part", "gyro=v 1.fmu",
        "--map", "gyro=m.toml", "--seed", "0", "--spec", "limits",
    ]  # fmt: skip
    address = "set=latitude%3D45.75deg&set=tests%3Da+b&part=gyro%3Dv+1.fmu&map=gyro%3Dm.toml&seed=0&spec=limits"
    assert request.form == f"/system/tumble?{address}"
    compile(request.python(), "lines", "exec")
    measured = JobRequest("tumble", {"latitude": "1deg"}, data="it's.csv", columns="m.toml")
    assert shlex.split(measured.command())[:5] == ["gyrobench", "reduce", "tumble", "--data", "it's.csv"]
    for text in (measured.python(), comparison_python(["a", "b'c"]), request.python(suite=True)):
        compile(text, "lines", "exec")
    assert shlex.split(comparison_command(["a b", "c"])) == ["gyrobench", "compare", "a b", "c"]
    assert comparison_command(["a", "c"], "zh").endswith("--language zh")
    assert "language='zh'" in comparison_python(["a", "c"], "zh")
