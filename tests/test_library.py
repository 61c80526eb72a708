"""The library: load, set, run, reduce, compare from Python, and what a notebook shows of them."""

from __future__ import annotations

import gc
import importlib.metadata
import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
from processes import unhurried

import gyrobench as gb
from gyrobench.commands.cli import main
from gyrobench.engine.run_errors import RunError
from gyrobench.engine.session import Session
from gyrobench.notebook import MissingPackageError
from gyrobench.result import Coefficient, LoopResult, Reason
from gyrobench.system.system import System
from gyrobench.system.values import InvalidValueError
from gyrobench.workflow.catalog import init_bench
from gyrobench.workflow.user_errors import PostRunError

NAME = "tumble_single_axis"
TINY = {"rate": "30deg/s", "dwell": "20", "settle": 0.5, "windows": 12}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def run() -> gb.Run:
    """A run in memory."""
    return gb.load(NAME, TINY).set("gyro.D_I", "0.9deg/h/g").run(seed=3)


# ------------------------------------------------------------------------------------------- import
def test_importing_gyrobench_imports_nothing_heavy() -> None:
    code = "import sys, gyrobench; dir(gyrobench); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"numpy", "scipy", "fmpy", "pydantic", "pandas", "matplotlib", "gyrobench.library"} & set(loaded)


def test_every_name_of_the_face_is_there_and_others_are_not() -> None:
    """Two of them are rooms, too, which an import puts in the place of the function."""
    for room in ("campaign", "design"):
        importlib.import_module(f"gyrobench.{room}")
    assert {n for n in gb.__all__ if callable(getattr(gb, n))} == set(gb.__all__) <= set(dir(gb))
    assert gb.__version__ == importlib.metadata.version("gyrobench") and "__version__" in dir(gb)
    with pytest.raises(AttributeError, match="module 'gyrobench' has no attribute 'laod'; it offers"):
        gb.laod  # noqa: B018


# ------------------------------------------------------------------------------------------- runs
@pytest.mark.long
def test_a_run_in_memory_leaves_no_file_and_is_that_of_the_command(
    folder: Path, run: gb.Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    again = gb.load(NAME, TINY, latitude="45.75deg").set("gyro.D_I", "0.9deg/h/g").run(seed=3)
    assert list(folder.iterdir()) == []
    words = [w for k, v in TINY.items() for w in ("--set", f"{k}={v}")]
    monkeypatch.setattr(
        sys, "argv",
        ["gyrobench", "run", NAME, *words, "--set", "gyro.D_I=0.9deg/h/g", "--seed", "3", "--out", "r", "--no-report"],
    )  # fmt: skip
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    opened = gb.open_run("r")
    for other in (again, opened):
        assert other.record.same_data(run.record)
        assert np.array_equal(other.result.array("estimate"), run.result.array("estimate"))


def test_results_and_records_are_arrays(run: gb.Run) -> None:
    result, c = run.result, run.result["D_I"]
    assert c.truth == pytest.approx(0.9) and result.names.index("D_I") == 1
    assert result.array("low")[1] == c.interval[0] and result.array("truth")[1] == c.truth
    assert np.isnan(result.array("dof")).any() or np.all(result.array("dof") > 0)
    covariance = result.covariance()
    assert covariance == pytest.approx(covariance.T) and np.sqrt(np.diag(covariance)) == pytest.approx(
        result.array("u")
    )
    assert run.record.windows["mean"].dtype == np.float64
    columns, units = run.record.table("channels")
    assert units["time"] == "s" and units["gyro.u"] == "V" and set(units) == set(columns)
    assert run.record.table("windows")[1]["mean"] == "A"  # what is wired to the sampler
    assert len(repr(result)) < 120 and len(repr(run.record)) < 120 and len(repr(run)) < 250
    assert str(run).splitlines()[0] == result.title and "D_OS" in str(run)


def test_results_and_records_are_data_frames(run: gb.Run) -> None:
    windows = run.record.frame("windows")
    assert isinstance(windows, pandas.DataFrame) and windows.attrs["units"]["mean"] == "A"
    assert np.array_equal(windows["mean"].to_numpy(), run.record.windows["mean"])
    assert next(iter(run.record.frame("channels"))) == "time"
    table = run.result.frame()
    assert table.loc["D_I", "estimate"] == run.result["D_I"].estimate and table.loc["D_I", "unit"] == "°/h/g"
    points = run.result.frame("series")
    assert len(points) == len(run.record.windows["mean"]) and points.attrs["units"]["y"] == "°/h"
    assert np.allclose(points["y"] - points["fit"], points["residual"])


def test_without_pandas_the_remedy_is_said(run: gb.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    for call in (run.record.frame, run.result.frame, gb.compare(run, run).frame):
        with pytest.raises(MissingPackageError, match="pip install pandas"):
            call()


@pytest.mark.long
def test_out_keeps_record_and_result_and_report_adds_the_pages(folder: Path, run: gb.Run) -> None:
    kept = gb.load(NAME, TINY).run(seed=5, out="r")
    files = {"run.json", "record.parquet", "channels.parquet", "result.json", "manifest.json"}
    assert kept.folder == folder / "r" and {f.name for f in (folder / "r").iterdir()} == files
    assert set(kept.report()) == {"json", "html", "pdf"}
    assert run.folder is None
    paths = run.report("s")  # a run in memory becomes a folder as any other
    assert paths["pdf"].read_bytes().startswith(b"%PDF")
    assert gb.open_run("s").record.same_data(run.record) and run.folder is None
    assert json.loads(paths["json"].read_text())["coefficients"][1]["estimate"] == run.result["D_I"].estimate
    with pytest.raises(gb.GyrobenchError, match="r: holds another run"):
        run.report("r")
    with pytest.raises(gb.GyrobenchError, match="name a folder"):
        run.report()


@pytest.mark.long
def test_values_stay_with_their_experiment_and_progress_is_called() -> None:
    calls: list[float] = []
    test = gb.load("servo_vertical_level", dwell=40, windows=8, cycles=1, settle="1 s")
    first = test.run(seed=1, progress=lambda status: calls.append(status.fraction))
    assert calls and test.values["dwell"] == 40.0
    second = test.set("dwell", 60).run(seed=1)
    assert (first.record.run.options["dwell"], second.record.run.options["dwell"]) == (40.0, 60.0)
    assert "dwell" in str(test) and "dwell" in repr(test)


@pytest.mark.long
def test_fmus_stay_loaded_between_runs_and_are_freed(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[Session] = []
    make = Session.__init__

    def counted(self: Session, *args: Any, **more: Any) -> None:
        make(self, *args, **more)
        opened.append(self)

    monkeypatch.setattr(Session, "__init__", counted)
    test = gb.load(NAME, TINY)
    records = [test.run(seed=seed).record for seed in (1, 2, 1)]
    assert len(opened) == 1 and records[0].same_data(records[2]) and not records[0].same_data(records[1])
    assert opened[0].folder.is_dir()
    changed = test.set("gyro.D_I", "0.5deg/h/g").run(seed=1)
    assert len(opened) == 2 and not opened[0].folder.exists() and changed.result["D_I"].truth == pytest.approx(0.5)
    assert changed.record.same_data(gb.load(NAME, TINY).set("gyro.D_I", "0.5deg/h/g").run(seed=1).record)
    del test
    gc.collect()
    assert not any(session.folder.exists() for session in opened)


@pytest.mark.long
def test_a_part_is_swapped_and_runs_are_compared(folder: Path) -> None:
    names = ("estimator_none", "estimator_moving_average")
    runs = [gb.load("estimator_bench", parts={"estimator": n}).run(seed=2) for n in names]
    assert all(isinstance(r.result, LoopResult) for r in runs)
    both = gb.compare(*runs, names=names)
    frame = both.frame()
    assert set(frame["run"]) == set(names) and {"estimate", "u", "difference", "U"} <= set(frame)
    assert "estimator_moving_average" in str(both)
    assert "EstimatorMovingAverage" in shown(both) and "<svg" in both._repr_html_()
    assert both.write(folder / "c")["html"].is_file()


# ------------------------------------------------------------------------------------------- measured data, suites
@pytest.mark.long
def test_measured_data_are_reduced(folder: Path) -> None:
    from gyrobench.bench import standard_folder

    table = standard_folder() / "systems" / "torquer_scale_factor" / "book_table.csv"
    measured = gb.reduce("torquer_scale_factor", table, operator="A. B.")
    assert measured.record.run.measured and measured.record.run.operator == "A. B." and list(folder.iterdir()) == []
    assert measured.result.array("u").min() > 0.0
    kept = gb.reduce("torquer_scale_factor", table, out="m")
    written = {f.name for f in (folder / "m").iterdir()}
    assert written == {"manifest.json", "record.parquet", "result.json", "run.json"}
    assert np.array_equal(kept.result.array(), measured.result.array())


@pytest.mark.long
def test_a_suite_runs_in_folders(folder: Path) -> None:
    plans = {
        f"{NAME}.rate": "30deg/s", f"{NAME}.dwell": 20, f"{NAME}.settle": 0.5, f"{NAME}.windows": 12,
        "fixed_position.dwell": 40, "fixed_position.readings": 20, "fixed_position.settle": 1,
    }  # fmt: skip
    suite = gb.load_suite("drift_test_suite", plans, tests=f"{NAME} fixed_position").set("gyro.markov_tau", 3)
    done = suite.run("s", seed=3)
    assert done.result.suite.consistency in ("consistent", "inconsistent") and not done.failed
    assert (done.runs[NAME].result["D_I"].u > 0.0 and done.runs[NAME].folder == folder / "s" / NAME) or Path("s") / NAME
    again = gb.load_suite("drift_test_suite").reduce(done.runs.values(), "again")
    assert again.result["D_F"].estimate == done.result["D_F"].estimate
    in_memory = gb.load(NAME, TINY).run()
    with pytest.raises(gb.GyrobenchError, match="run 1 of the suite is in memory only"):
        gb.load_suite("drift_test_suite").reduce([in_memory, in_memory], "other")


# ------------------------------------------------------------------------------------------- mistakes
MISTAKES: dict[str, tuple[Callable[[gb.Run], Any], str]] = {
    "system": (lambda r: gb.load("tumble_single_axes"), "did you mean tumble_single_axis"),
    "suite": (lambda r: gb.load("drift_test_suite"), "is a suite of tests: gyrobench.load_suite"),
    "no suite": (lambda r: gb.load_suite(NAME), "is one test, not a suite"),
    "option": (lambda r: gb.load(NAME, lattitude=1), "lattitude: no such option .*latitude"),
    "unit": (lambda r: gb.load(NAME, latitude="3 V"), "latitude"),
    "kind": (lambda r: gb.load(NAME, latitude=None), "latitude = None: a number is expected"),
    "parameter": (lambda r: gb.load(NAME, TINY).set("gyro.D_J", 1).run(), "D_J"),
    "part": (lambda r: gb.load(NAME, parts={"gyro": "no.fmu"}).run(), "slot gyro: no.fmu: .* no such file"),
    "map": (lambda r: gb.load(NAME, maps={"gyro": "no.toml"}), "slot gyro: no.toml: no such mapping file"),
    "seed": (lambda r: gb.load(NAME).run(seed=1.5), "seed = 1.5: a whole number"),  # type: ignore[arg-type]
    "engine": (lambda r: gb.load(NAME).run(engine="fast"), "engine 'fast': one of native"),
    "specification": (lambda r: gb.load(NAME).run(spec="gyro"), "no such file or acceptance specification"),
    "resume": (lambda r: gb.load(NAME).run(resume=True), "name the folder of the run in out"),
    "file": (lambda r: gb.reduce(NAME, "no.csv"), "no.csv: no such file of measured data"),
    "folder": (lambda r: gb.open_run("nothing"), "nothing"),
    "one run": (lambda r: gb.compare(r), "two runs or more"),
    "names": (lambda r: gb.compare(r, r, names=["a"]), "2 runs, 1 names"),
    "same names": (lambda r: gb.compare(r, r, names=["a", "a"]), "names must differ"),
    "coefficient": (lambda r: r.result["D_Z"], "D_Z: no such coefficient .* did you mean"),
    "number": (lambda r: r.result.array("mean"), "mean: no number of a coefficient"),
    "table": (lambda r: r.record.frame("signals"), "available: windows, channels"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_a_gyrobench_error(name: str, run: gb.Run, folder: Path) -> None:
    call, text = MISTAKES[name]
    with pytest.raises(gb.GyrobenchError, match=text):
        call(run)
    assert list(folder.iterdir()) == []


SYSTEM = '''
from gyrobench.system.system import Option, Slot, System


class Own(System):
    """A site, read once."""

    slots = {"site": Slot("Site", "site")}
    options = {"fails": Option(True, bool, "whether its reduction fails")}
    channels = ("site.f[3]",)
    stop = 3.0
    step = 0.1

    def findings(self, record):
        return {}["nothing"]
'''


def test_a_system_does_not_judge_itself() -> None:
    with pytest.raises(TypeError, match=r"returned by findings\(record\)"):
        type("Own", (System,), {"reduce": lambda self, record: None})


def test_an_error_of_ones_own_after_the_run_holds_the_record(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    init_bench(folder / "mine", [])
    for name, text in (("own", SYSTEM), ("bare", SYSTEM.split("    def findings")[0])):
        (folder / "mine" / "systems" / name).mkdir()
        (folder / "mine" / "systems" / name / "system.py").write_text(text, encoding="utf-8")
    monkeypatch.chdir(folder / "mine")
    with pytest.raises(
        PostRunError, match=r"system.py:\d+: KeyError: 'nothing'\nthe record is kept in memory"
    ) as error:
        gb.load("own").run()
    assert error.value.record is not None and error.value.record.channels["site.f[3]"][-1] > 9.0
    assert isinstance(error.value.__cause__, KeyError)
    bare = gb.load("bare").run()
    assert "0 windows, 1 channels" in str(bare)
    with pytest.raises(gb.GyrobenchError, match="bare has no reduction"):
        bare.result  # noqa: B018


@pytest.mark.long
def test_an_interrupted_run_holds_what_was_recorded(folder: Path) -> None:
    """Ctrl-C in a notebook: an error with the record until then, in memory or, with out, in the folder to resume."""

    def interrupt(status: object) -> None:
        signal.raise_signal(signal.SIGINT)

    test = gb.load(NAME)
    with unhurried(), pytest.raises(RunError, match="interrupted at t") as error:
        test.run(progress=interrupt)
    assert error.value.record is not None and not error.value.record.complete and list(folder.iterdir()) == []
    with unhurried(), pytest.raises(PostRunError, match="the record until then is kept in r"):
        test.run(out="r", progress=interrupt)
    assert repr(gb.open_run("r").record).endswith("incomplete>")


# ------------------------------------------------------------------------------------------- notebook
class Tags(HTMLParser):
    """Fails on tags that do not close each other."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def shown(displayed: Any) -> str:
    """What a notebook shows: well formed, no script, nothing from the network; returns its text."""
    html = displayed._repr_html_()
    tags = Tags()
    tags.feed(html)
    assert tags.open == [] and "<script" not in html
    assert not re.findall(r"(?:src|href)=\"(?!#)[^\"]*", html.replace('xlink:href="', 'href="'))
    return tags.text


@pytest.mark.long
def test_a_notebook_shows_tables_and_figures(run: gb.Run) -> None:
    text = shown(run)
    assert run.result.title in text and "mass unbalance" in text and "No specification given" in text
    assert "<svg" in run._repr_html_() and run._repr_html_() == run.result._repr_html_()  # type: ignore[operator]
    assert "mean / A" in shown(run.record) and "rebalance.i" in shown(run.record)
    assert "<svg" in run.record._repr_html_()  # type: ignore[operator]
    assert "geographic latitude" in shown(gb.load(NAME))
    both = gb.compare(run, run, names=("a", "b"))
    assert "Differences from baseline A" in shown(both) and "D_IS" in shown(both)


@pytest.mark.long
def test_a_verdict_is_shown_and_text_is_escaped(run: gb.Run) -> None:
    judged = gb.load(NAME, TINY).set("gyro.D_I", "3deg/h/g").run(seed=3, spec="floated_gyro")
    assert judged.result.verdict == "fail" and "Verdict: fail." in shown(judged) and "✗ fail" in shown(judged)
    evil = LoopResult(
        system="s", title="<b>title</b>", method="m", sources=[], conventions=[], responses=[],
        reasons=[Reason("escaped", "a < b & c")],
        coefficients=[Coefficient("<i>x</i>", "</td>", "V", 1.0, 0.1, 2.0, (0.8, 1.2))],
    )  # fmt: skip
    text = shown(evil)
    assert "<b>title</b>" in text and "<i>x</i>" in text and "a < b & c" in text and "</td>" in text


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("gyro.wite", 1.0, "gyro has no parameter 'wite'; nearest: white"),
        ("gyro.J", "-1 g.cm2", "gyro.J = -1 g.cm2: J must be > 0 kg.m2"),
        ("gyro.J", "2 kg", "does not convert to 'kg.m2'"),
        ("gyro.D_B", 3.0, "is an array; give all of it"),
        ("gyro.mount[1,4]", 1.0, "gyro has no parameter 'mount[1,4]'"),
    ],
)
def test_what_a_part_refuses_is_refused_when_it_is_set(name: str, value: object, words: str) -> None:
    test = gb.load(NAME, TINY)
    with pytest.raises(InvalidValueError, match=re.escape(words)):
        test.set(name, value)
    assert name not in test.system.overrides
    test.set("gyro.D_I", "0.9deg/h/g").set("gyro.mount", "[[1,0,0],[0,1,0],[0,0,1]]").set("gyro.reaction", "false")
    gb.load(NAME, TINY, parts={"gyro": "own.fmu"}).set(name, value)  # what an FMU has is known when it is loaded
