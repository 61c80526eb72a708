"""A system as a page that runs it: in Chromium, from its file, the numbers of its FMU; sliders; who is refused."""

from __future__ import annotations

import importlib.util
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from browser import LIMIT, Browser, needs_chromium
from fmpy import simulate_fmu

from gyrobench.component import Parameter
from gyrobench.exchange import html_page
from gyrobench.exchange.html_page import export_page
from gyrobench.exchange.ssp_export import ExportError, stop_time
from gyrobench.exchange.system_fmu import export_fmu
from gyrobench.system.system import load_system

LOOP, SHORT = "stabilizer_sdf", {"time": 2.0, "command": 1e-4}
needs_ziglang = pytest.mark.skipif(
    importlib.util.find_spec("ziglang") is None, reason="ziglang is not installed: no page is made"
)


def ended(browser: Browser) -> np.ndarray[Any, Any]:
    """The rows of the page once its run has ended: time and outputs."""
    deadline = time.monotonic() + LIMIT
    while browser.run("document.body.dataset.run") not in ("ended", "failed"):
        assert time.monotonic() < deadline, browser.console
        time.sleep(0.05)
    return np.array(browser.run("Array.from(table().subarray(0, count * width))")).reshape(
        -1, browser.run("content.outputs.length + 1")
    )


@needs_chromium
@needs_ziglang
@pytest.mark.long
def test_the_page_runs_as_the_fmu_does(tmp_path: Path) -> None:
    system = load_system(LOOP)
    chosen, values = ["platform.J", "gyro.D_F"], {**SHORT, "gyro.D_F": 6e-6}
    export_page(system, tmp_path / "loop.html", values=values, seed=3, expose=chosen)
    export_fmu(system, tmp_path / "loop.fmu", values=values, seed=3, expose=chosen)
    assert (tmp_path / "loop.html").stat().st_size < 3_000_000

    with Browser(tmp_path / "profile") as browser:
        browser.open(tmp_path / "loop.html", 1280)
        rows = ended(browser)
        names = browser.run("content.outputs.map(o => o.name)")
        every, step = browser.run("[content.every, content.step]")
        assert browser.run("content.charts.flat().length") >= 3 and len(rows) > 200

        def fmu(values: dict[str, float]) -> np.ndarray[Any, Any]:
            file, end = str(tmp_path / "loop.fmu"), rows[-1, 0]
            found = simulate_fmu(
                file, stop_time=end, step_size=every * step, output_interval=every * step, start_values=values
            )
            return np.column_stack([found[n] for n in ("time", *names)])

        def same(ours: np.ndarray[Any, Any], theirs: np.ndarray[Any, Any]) -> None:
            assert ours.shape == theirs.shape
            assert np.array_equal(ours[:, 1:], theirs[:, 1:])  # but for the time, which FMPy sums up

        there_and_back = "content.parameters[1].start * content.parameters[1].factor"
        assert browser.run(there_and_back) != 6e-6, "a slider in deg/h costs a last digit where it is moved, else not"
        same(rows, fmu({}))
        inertia = browser.run("content.parameters[0].start")
        browser.run(f"at('p0').value = {1.5 * inertia!r}; at('p0').dispatchEvent(new Event('change'))")
        other = ended(browser)
        same(other, fmu({"platform.J": 1.5 * inertia}))
        assert np.abs(other - rows).max() > 0.0

        browser.run("at('p0').value = -1; at('p0').dispatchEvent(new Event('change'))")  # an inertia is positive
        assert browser.run("at('state').textContent") == "platform.J: -1 is not allowed"
        assert browser.run("content.parameters[0].value") == pytest.approx(1.5 * inertia)
        browser.run("at('defaults').click()")
        same(ended(browser), rows)
        for width in (1280, 390):
            browser.open(tmp_path / "loop.html", width)
            ended(browser)
            assert browser.run("document.documentElement.scrollWidth") <= width
        assert browser.console == [], "no request, no error"


@needs_ziglang
@pytest.mark.long
def test_a_title_cannot_leave_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    system = load_system(LOOP)
    monkeypatch.setattr(type(system), "title", "</script><script>alert(1)</script>")
    export_page(system, tmp_path / "x.html", values=SHORT)
    assert "<script>alert" not in (tmp_path / "x.html").read_text(encoding="utf-8")


def test_a_foreign_part_is_refused(foreign: Any, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=r"html: .*no page can be made of it"):
        export_page(
            load_system("tumble_single_axis"), tmp_path / "x.html", {"gyro": foreign("vendor_gyro")},
            {"gyro": Path(__file__).parents[1] / "foreign" / "vendor_gyro.toml"},
        )  # fmt: skip
    assert not (tmp_path / "x.html").exists()


@pytest.mark.long
def test_without_a_compiler_for_it(tmp_path: Path, command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    there = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "ziglang" else there(name))
    code, out, err = command("export", LOOP, "--to", "html", "--out", tmp_path / "x.html")
    assert (code, out) == (2, "") and "pip install gyrobench[cross]" in err
    assert not (tmp_path / "x.html").exists()


def test_progress_is_that_of_the_plan_and_a_slider_says_what_its_option_means() -> None:
    """The end of rate_table_test allows a minute for the way to each of 61 rates; the plan alone takes 11 minutes."""
    system = load_system("rate_table_test")
    plan = system.plan().duration()
    assert html_page._planned(system, stop_time(system)) == pytest.approx(plan) and plan < 0.3 * stop_time(system)
    assert html_page._planned(system, 10.0) == 10.0
    system = load_system("gimbal_tracking")
    decl = Parameter(60.0, "s", "time the gate is open")
    scalar = SimpleNamespace(name="ride", start=60.0, reference=1, decl=decl)
    shown = html_page._parameter(SimpleNamespace(scalar=scalar), system)  # type: ignore[arg-type]
    assert shown["doc"] == system.options["ride"].doc != decl.doc
