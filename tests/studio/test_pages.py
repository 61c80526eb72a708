"""The studio in headless Chromium: the way of a new user from the first page to a report, by mouse and by keyboard."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from messy_file import messy
from studio_pages import CHROMIUM, LIMIT, NONE, at_rest, base_of, fits, run_of, settled, soon

import gyrobench as gb
from gyrobench.record.record import Record

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NONE)


def test_from_the_first_page_to_a_report(page: Any, studio: tuple[str, Path]) -> None:
    page.goto(studio[0])
    page.get_by_label("Search").fill("fixed-position")
    page.get_by_text("Fixed-position test", exact=True).click()
    page.get_by_label("dwell", exact=True).fill("60s")
    page.get_by_label("latitude", exact=True).fill("45.75deg")
    command = page.locator(".code").first
    page.wait_for_function("document.querySelector('.code')?.textContent.includes('45.75deg')")
    assert command.text_content() == "gyrobench run fixed_position --set dwell=60s --set latitude=45.75deg"
    assert "gb.load('fixed_position', {'dwell': '60s'" in (page.locator(".code").nth(1).text_content() or "")
    page.get_by_role("button", name="Run").click()
    folder = run_of(page, studio[1])
    report = page.frame_locator("iframe.report")
    report.get_by_text("Coefficients", exact=False).first.wait_for()
    options = json.loads((folder / "run.json").read_text())["options"]
    assert options["dwell"] == 60.0 and options["latitude"] == pytest.approx(0.7984881, abs=1e-6)  # 45.75 pi / 180
    page.get_by_role("tab", name="Signals").click()
    page.locator(".chart canvas").first.wait_for()
    page.goto(base_of(studio) + "/runs")
    page.get_by_role("link", name=f"fixed_position/{folder.name}").wait_for()


#: a page waits for its connection as long as a test does: after 20 s it would look for another way
PATIENT = f"""let made;
Object.defineProperty(window, "io", {{
  get: () => made,
  set: (io) => (made = (address, options) => io(address, {{ ...options, timeout: {LIMIT} }})),
}});"""


def test_the_gallery_needs_no_answer_of_the_studio(page: Any, studio: tuple[str, Path]) -> None:
    """Searched and left by a click where the studio hears nothing: cards are links, none moves later."""
    page.add_init_script(PATIENT)
    page.route_web_socket("**", lambda socket: None)  # it opens, and no message ever comes
    page.goto(base_of(studio) + "/")
    cards = page.locator(".card:visible")
    page.locator("[href='/system/fixed_position']").wait_for()
    every = cards.count()
    page.get_by_label("Search").fill("Fixed-POSITION test")
    assert [c.get_attribute("href") for c in cards.all()] == ["/system/fixed_position"]  # no waiting: it is so at once
    page.get_by_label("Search").fill("")
    page.get_by_role("button", name="I design a loop").click()
    assert 0 < cards.count() < every
    assert page.locator("[data-counts]").text_content() == f"{cards.count()} / {every}"
    page.get_by_role("button", name="All", exact=True).click()
    page.get_by_label("Search").fill("fixed_position")
    page.locator("[href='/system/fixed_position']").click()
    page.wait_for_url("**/system/fixed_position")


def test_what_is_typed_before_there_is_a_connection_counts(page: Any, studio: tuple[str, Path]) -> None:
    held: list[Any] = []
    page.add_init_script(PATIENT)
    page.route_web_socket("**", lambda socket: held.append(socket))  # it opens, and the studio does not know yet
    page.goto(base_of(studio) + "/system/fixed_position")
    page.get_by_label("latitude", exact=True).fill("12deg")
    page.get_by_label("dwell", exact=True).fill("60s")
    assert page.locator(".code").first.text_content() == "gyrobench run fixed_position" and len(held) == 1
    held[0].connect_to_server()
    said = "gyrobench run fixed_position --set latitude=12deg --set dwell=60s"
    page.wait_for_function("text => document.querySelector('.code')?.textContent === text", arg=said)


def test_a_wrong_value_is_said_where_it_is_written(page: Any, studio: tuple[str, Path]) -> None:
    page.goto(base_of(studio) + "/system/fixed_position")
    page.get_by_label("latitude", exact=True).fill("3 kg")
    page.locator(".q-field__messages").get_by_text(re.compile("latitude.*kg")).wait_for()
    page.get_by_label("latitude", exact=True).fill("45.75")
    page.locator(".q-field__messages").get_by_text("write for example latitude=45.75deg").wait_for()
    page.get_by_role("button", name="Run").click()
    page.locator(".q-notification").wait_for()
    lines = "getComputedStyle(document.querySelector('.q-notification__message')).whiteSpace"
    assert "/system/" in page.url and page.evaluate(lines) == "pre-line"  # a list of faults has a line for each


def test_what_is_not_there_is_said_with_what_is_near(page: Any, studio: tuple[str, Path]) -> None:
    for path, said in (
        ("/system/fixed_positio", "did you mean fixed_position"),
        ("/job/x", "no job 'x'"),
        ("/run/x/y", "x/y"),
    ):
        page.goto(base_of(studio) + path)
        page.get_by_role("alert").get_by_text(said).wait_for()


def test_a_part_is_swapped_and_its_parameters_follow(page: Any, studio: tuple[str, Path]) -> None:
    page.goto(base_of(studio) + "/system/tumble_single_axis")
    page.get_by_label("part in gyro").click()
    page.get_by_role("option", name="compliant_gyro").click()
    page.wait_for_function("document.querySelector('.code')?.textContent.includes('--part gyro=compliant_gyro')")
    soon(lambda: page.get_by_label("equations of gyro").get_attribute("href"), "/part/compliant_gyro")
    page.get_by_role("button", name="Parameters of gyro").click()
    page.get_by_label("gyro.H", exact=True).fill("0.3")
    page.wait_for_function("document.querySelector('.code')?.textContent.includes('--set gyro.H=0.3')")
    page.get_by_label("part in gyro").click()
    page.get_by_role("option", name="floated_gyro").click()
    page.wait_for_function("document.querySelector('.code')?.textContent === 'gyrobench run tumble_single_axis'")


def test_a_part_shows_its_equations(page: Any, studio: tuple[str, Path]) -> None:
    page.goto(base_of(studio) + "/part/cage")
    page.get_by_role("heading", name="Equations").wait_for()
    assert "i = K_p u" in page.locator("pre").first.text_content()
    assert page.get_by_role("cell", name="torquer current").count() >= 1, "the table of ports"
    page.goto(base_of(studio) + "/part/floated_gyro")
    page.get_by_text("omega_IA - omega_d", exact=False).first.wait_for()  # low lines are no emphasis
    page.goto(base_of(studio) + "/part/cag")
    page.get_by_role("alert").get_by_text("cage").wait_for()


@pytest.mark.long
def test_a_run_is_stopped_in_another_tab_and_goes_on(page: Any, studio: tuple[str, Path]) -> None:
    page.goto(base_of(studio) + "/system/fixed_position")
    page.get_by_label("dwell", exact=True).fill("20000000s")
    page.wait_for_function("document.querySelector('.code')?.textContent.includes('20000000s')")
    page.get_by_role("button", name="Run").click()
    page.wait_for_url("**/job/**")
    address = page.url
    page.get_by_role("heading", name="Fixed-position test").wait_for()
    page.get_by_role("link", name="Change its values").click()  # the form as it was filled in
    page.wait_for_function("document.querySelector('.code')?.textContent.includes('20000000s')")
    soon(lambda: page.get_by_label("dwell", exact=True).input_value(), "20000000s")
    page.goto(base_of(studio) + "/")  # the page of the run is closed
    page.goto(address)
    page.wait_for_function("parseFloat(document.querySelector('[role=progressbar]')?.ariaValueNow) > 0")
    left = "document.querySelector('[role=status]')?.nextElementSibling?.textContent"
    seen = "h => { Object.defineProperty(document, 'hidden', {value: h, configurable: true}); " + (
        "document.dispatchEvent(new Event('visibilitychange')); }"
    )
    page.evaluate(seen, True)  # another tab is in front of it: nothing is sent to it
    before = at_rest(page, lambda: page.evaluate(left), 1500)
    assert "steps/s" in before
    page.evaluate(seen, False)
    page.wait_for_function(f"said => ({left} ?? said) !== said", arg=before)
    page.get_by_role("button", name="Stop").click()
    page.get_by_text("“Resume” continues it.").wait_for()  # at a shell: the same command with --resume
    assert "--resume" not in (page.locator(".problem").text_content() or "")
    assert "gyrobench report" not in (page.locator(".problem").text_content() or "")
    page.get_by_role("button", name="Resume").click()
    page.wait_for_function("document.querySelector('[role=status]')?.textContent === 'running'")
    assert page.url != address, "it goes on as a job of its own"
    page.wait_for_function("parseFloat(document.querySelector('[role=progressbar]')?.ariaValueNow) > 0")
    page.get_by_role("button", name="Stop").click()
    page.get_by_role("button", name="Resume").wait_for()


@pytest.mark.long
def test_a_messy_file_is_dropped_mapped_and_reduced(page: Any, studio: tuple[str, Path], tmp_path: Path) -> None:
    """The same record as by the two commands, tests/record/test_messy_file.py."""
    data, mean = messy()
    (tmp_path / "Messung <b>1.csv").write_bytes(data)
    page.goto(base_of(studio) + "/data?test=fixed_position")
    page.locator("input[type=file]").set_input_files(tmp_path / "Messung <b>1.csv")
    page.get_by_text("Every column has its place").wait_for()
    page.get_by_text("Strom / mA").first.wait_for()
    page.get_by_text("Datum + Uhrzeit").first.wait_for()
    page.get_by_label("unit of mean").fill("deg")
    page.get_by_text("deg is no unit of").wait_for()
    page.get_by_label("unit of mean").fill("uA")
    page.get_by_role("button", name="Check the file").hover()
    page.mouse.down()
    page.get_by_text("others are called so, too").wait_for()  # the page grows under the pressed button
    page.mouse.up()
    page.get_by_text("faults:").wait_for()
    page.get_by_text("'latitude' is not given").wait_for()
    for name, value in (("latitude", "45.75deg"), ("k", "17.2deg/h/mA"), ("attitude", "E U -N")):
        page.get_by_label(name, exact=True).fill(value)
    page.wait_for_function("document.querySelector('.code')?.textContent.includes('attitude=E U -N')")
    page.get_by_role("button", name="Check the file").click()
    page.get_by_text("it can be reduced").wait_for()
    page.get_by_role("button", name="Reduce").click()
    page.get_by_role("link", name="Change its values").click()  # the mapping as it was made
    page.wait_for_function("document.querySelector('.code')?.textContent.includes('attitude=E U -N')")
    soon(lambda: page.get_by_label("latitude", exact=True).input_value(), "45.75deg")
    assert page.get_by_label("unit of mean").input_value() == "uA"
    page.get_by_role("button", name="Reduce").click()
    folder = run_of(page, studio[1])
    kept = [k for k in range(47) if k != 7]
    np.testing.assert_allclose(Record.load(folder).windows["mean"], mean[kept] * 1e-6, rtol=1e-12)  # µA, as was said


def test_two_runs_are_compared(page: Any, studio: tuple[str, Path], two_runs: list[Path]) -> None:
    page.goto(base_of(studio) + "/runs")
    page.get_by_label("Filter").fill("fixed_position/run")
    soon(lambda: page.locator(".runs tbody tr:visible").count(), 2)
    for folder in two_runs:
        page.get_by_label(f"choose fixed_position/{folder.name}").click()
    page.get_by_role("button", name="Compare").click()
    page.wait_for_url("**/compare?**")
    page.frame_locator("iframe.report").get_by_text("baseline", exact=False).first.wait_for()
    page.get_by_role("tab", name="Signals").click()
    page.locator(".chart canvas").first.wait_for()
    series = "getElement(document.querySelector('.chart').id.slice(1)).chart?.getOption()?.series?.map(s => s.name)"
    page.wait_for_function(f"() => {series}?.length === 4")  # it comes empty first
    assert len({n.partition(", ")[0] for n in page.evaluate(series)}) == 2, "two signals of two runs"


def test_a_run_that_was_stopped_early_is_not_compared(
    page: Any, studio: tuple[str, Path], two_runs: list[Path]
) -> None:
    early = two_runs[0].with_name("early")
    shutil.copytree(two_runs[0], early)
    document = json.loads((early / "run.json").read_text())
    (early / "run.json").write_text(json.dumps({**document, "complete": False}))
    page.goto(base_of(studio) + "/runs")
    page.get_by_label("choose fixed_position/run2").click()
    page.get_by_role("button", name="Compare").click()
    page.get_by_text("tick two runs or more").wait_for()
    page.get_by_label("choose fixed_position/early").click()
    page.get_by_role("button", name="Compare").click()
    page.get_by_text("fixed_position/early: not at its end").wait_for()
    assert page.url.endswith("/runs")
    close = page.locator(".q-notification button").first
    soon(lambda: close.evaluate("e => getComputedStyle(e).color"), "rgb(255, 255, 255)")  # on red


@pytest.mark.long
def test_by_the_keyboard_alone(page: Any, studio: tuple[str, Path]) -> None:
    page.goto(base_of(studio) + "/system/fixed_position")
    page.get_by_label("latitude", exact=True).wait_for()
    reached = set()
    for _ in range(150):
        page.keyboard.press("Tab")
        focus = page.evaluate("(e => e.getAttribute('aria-label') || e.textContent)(document.activeElement)") or ""
        reached.add(focus.strip())
        if focus == "latitude":
            page.keyboard.type("45deg")
        if focus == "dwell":
            page.keyboard.type("60s")
        if focus.strip().endswith("Run"):
            break
    assert {"latitude", "dwell"} <= reached, reached
    page.wait_for_function("document.querySelector('.code')?.textContent.includes('latitude=45deg')")
    page.keyboard.press("Enter")
    page.wait_for_url("**/run/**")


PAGES = (
    "/", "/system/fixed_position", "/data", "/runs", "/tune", "/design", "/identify", "/campaign", "/laboratory",
    "/part/cage", "/learn",
)  # fmt: skip


@pytest.mark.long
def test_every_page_fits_a_telephone_and_shuts_no_one_out(page: Any, studio: tuple[str, Path]) -> None:
    """390 px; axe-core: names of all controls, contrast of all texts in light and dark, the language."""
    from axe_playwright_python.sync_playwright import Axe

    axe, wide, found = Axe(), dict(page.viewport_size), []
    for path in PAGES:
        page.emulate_media(color_scheme="light")
        page.goto(base_of(studio) + path)
        settled(page)
        page.set_viewport_size({"width": 390, "height": 844})
        fits(page, 390)
        page.set_viewport_size(wide)
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            page.wait_for_function("d => document.body.classList.contains('body--dark') === d", arg=scheme == "dark")
            settled(page)
            rules = {"runOnly": ["color-contrast"]} if scheme == "dark" else {}  # the rest is the same
            violations = axe.run(page, options=rules).response["violations"]
            bad = [v for v in violations if v["impact"] in ("serious", "critical")]
            found += [(path, scheme, v["id"], v["nodes"][0]["html"]) for v in bad]
    assert found == []


@pytest.mark.parametrize(
    "path",
    [
        "/files/../../../../etc/passwd", "/files/..%2f..%2f..%2f..%2fetc/passwd", "/files/%2fetc%2fpasswd",
        "/files/fixed_position", "/files/studio/jobs", "/files/%00", "/files/" + "a" * 5000, "/picture/../x",
        "/picture/%2e%2e", "/wiring/<script>", "/run/../../..", "/job/..%2f..", "/system/..%2f..%2fetc",
        "/compare?run=../..", "/_nicegui/../../x", "/nothing",
    ],
)  # fmt: skip
def test_no_path_leads_out(studio: tuple[str, Path], path: str) -> None:
    token = studio[0].partition("token=")[2]
    port = re.search(r":(\d+)/", studio[0])
    assert port
    request = urllib.request.Request(base_of(studio) + path.replace("<", "%3C").replace(">", "%3E"))
    request.add_header("Cookie", f"gyrobench_studio_{port[1]}={token}")
    try:
        with urllib.request.urlopen(request, timeout=1e-3 * LIMIT) as answer:
            text = answer.read().decode("utf-8", "replace")
    except urllib.error.HTTPError as error:
        assert error.code < 500, error
        text = error.read().decode("utf-8", "replace")
    assert "root:" not in text and "Traceback" not in text and str(Path(os.devnull)) not in text


def test_without_the_token_nothing_is_shown(studio: tuple[str, Path]) -> None:
    for path in ("/", "/runs", "/files/x", "/_nicegui_ws/socket.io/?EIO=4&transport=polling"):
        with pytest.raises(urllib.error.HTTPError) as error:
            urllib.request.urlopen(base_of(studio) + path)
        assert error.value.code == 403


@pytest.mark.long
def test_a_second_studio_of_the_bench_only_looks_on(studio: tuple[str, Path]) -> None:
    command = [sys.executable, "-m", "gyrobench", "studio", "--no-browser", "--port", "0"]
    done = subprocess.run(command, cwd=studio[1], capture_output=True, text=True, timeout=1e-3 * LIMIT)
    assert done.returncode == 2 and "a studio has this bench open" in done.stderr
    command += ["--host", "0.0.0.0"]
    remote = subprocess.run(command, cwd=studio[1], capture_output=True, text=True, timeout=1e-3 * LIMIT)
    assert remote.returncode == 2 and "--allow-remote" in remote.stderr


@pytest.mark.long
def test_a_lesson_runs_in_its_page(page: Any, studio: tuple[str, Path]) -> None:
    page.goto(base_of(studio) + "/learn")
    page.get_by_text("Why 1/cos makes a keyhole").click()
    lesson = page.frame_locator("iframe.report")
    lesson.get_by_text("End at 19 s.").wait_for()
    lesson.get_by_label("Your answer, with its unit").fill("80.4 deg")
    lesson.get_by_role("button", name="Check").click()
    lesson.get_by_text("Right.").wait_for()
    assert page.locator(".code").first.text_content() == "gyrobench learn keyhole"
    page.goto(base_of(studio) + "/learn/keyhol")
    page.get_by_role("alert").get_by_text("no lesson 'keyhol'").wait_for()


def test_the_plan_follows_the_options(page: Any, studio: tuple[str, Path]) -> None:
    page.goto(base_of(studio) + "/system/tumble_single_axis")
    page.locator(".plan").wait_for()
    widths = "[...document.querySelectorAll('.phase')].map(e => e.getBoundingClientRect().width)"
    before = page.evaluate(widths)
    plan = gb.load("tumble_single_axis").system.plan()
    shares = np.array([p.duration() for p in plan.phases]) / plan.duration()
    np.testing.assert_allclose(np.array(before) / sum(before), shares, atol=0.01)
    page.get_by_label("turns", exact=True).fill("3")
    page.wait_for_function("document.querySelector('.keys')?.textContent.includes('15 h')")  # 2 x 3 turns of 2.4 h
    page.get_by_label("turns", exact=True).fill("x")
    page.locator(".q-field__messages").get_by_text(re.compile("turns")).wait_for()
    assert page.evaluate("document.querySelectorAll('.phase').length") == 4, "what is no plan leaves the last one"
