"""The studio in Chinese: every label of every page, the switch, and what stays English is marked as English."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from studio_pages import CHROMIUM, NONE, base_of, fits, settled
from studio_requests import Door

import gyrobench as gb
from gyrobench.bench import Bench, standard_folder
from gyrobench.report.language import PLACEHOLDER, WORD, catalogue
from gyrobench.studio import words
from gyrobench.studio.command_pages import DESIGN, SWEEP, TUNE
from gyrobench.studio.data_page import NOT
from gyrobench.studio.frame import DARK, PAGES
from gyrobench.studio.jobs import ENDED
from gyrobench.studio.laboratory_page import PROFILE, SIGNATORIES
from gyrobench.studio.picture import LEGEND
from gyrobench.studio.run_page import HOW
from gyrobench.system.moving_bodies import parse_bodies
from gyrobench.workflow.gallery import PURPOSES, entry
from gyrobench.workflow.inputs import load_test

FOLDER = Path(words.__file__).parent
SAID = ("say", "heading", "spoken", "UsageError")
SHELL = ("gate.py", "server.py", "job_process.py")  # what they refuse is said in the shell
RIDES = {"vehicle", "ship", "helicopter", "aircraft", "truck"}  # values of an option, as they are typed
STAY = RIDES | {
    "min",
    "gyrobench",
    "Python",
    "FMU",
    "PDF",
    "json",
    "result",
    "toml",
    "laboratory",
    "SLOT",
    "NAME",
    "VALUE",
    "set",
    "auto",  # values of options
    "none",
    "down",
    "both",
    "gyro",
    "coefficients",  # a slot
    "by",  # an option
}
VALUES = {"current", "rate", "pitch"}  # of an option of the system that is looked at, names of its loops


@pytest.fixture
def chinese() -> Iterator[None]:
    words.say.use("zh")
    yield
    words.say.use("en")


def literals() -> set[str]:
    """Texts that the code hands over to be said, names and numbers in them as 7."""
    found = {HOW, LEGEND, SIGNATORIES, NOT, *PURPOSES, *(name for name, _ in PAGES), *(t for _, t in DARK.values())}
    found |= {label for label, _ in PROFILE.values()} | {*ENDED, "waiting", "starting", "running"}
    for form in (TUNE, DESIGN, SWEEP):
        found |= {form.name, form.text, *(f.label for f in form.fields)}
    for file in FOLDER.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            called = getattr(node.func, "id", "") if isinstance(node, ast.Call) else ""
            if called in SAID and node.args and not (called == "UsageError" and file.name in SHELL):
                text = node.args[0]
                if isinstance(text, ast.Constant):
                    found.add(str(text.value))
                elif isinstance(text, ast.JoinedStr):
                    found.add("".join(str(v.value) if isinstance(v, ast.Constant) else "7" for v in text.values))
    return found


def test_every_label_has_its_line(chinese: None) -> None:
    every = literals()
    assert len(every) > 120
    assert [text for text in sorted(every) if words.say.find(text) is None] == []


@pytest.mark.parametrize("name", Bench(standard_folder()).systems())
def test_every_system_is_said_in_chinese(chinese: None, name: str) -> None:
    """Title, summary, options: of one system in its zh.toml, of several in that of the studio, as bodies that move."""
    shown, system = entry(Bench(standard_folder()), name), load_test(name)
    texts = [shown.title, shown.summary, *(o.doc for o in system.options.values())]
    texts += [f"body: {b.name}" for b in parse_bodies(getattr(system, "bodies", ""))]
    assert [text for text in texts if words.say.find(text, name) is None] == []


def test_a_report_without_a_translation_is_asked_for_in_english(chinese: None, tmp_path: Path) -> None:
    (tmp_path / "systems" / "own").mkdir(parents=True)
    assert [words.say.of_report(name, tmp_path) for name in ("own", "fixed_position")] == ["en", "zh"]


def test_what_a_comparison_remarks_is_said_in_chinese(chinese: None) -> None:
    said = words.say(
        "runs of different systems (servo_polar, tumble_two_axis): equal names may not mean equal quantities"
    )
    assert "（servo_polar, tumble_two_axis）" in said


def test_no_english_word_is_left_in_a_line() -> None:
    chinese = catalogue("zh", FOLDER)
    own = {e: s for e, s in chinese.texts.items() if catalogue("zh").texts.get(e) != s}
    assert len(own) > 100
    for english, said in own.items():
        assert sorted(PLACEHOLDER.findall(english)) == sorted(PLACEHOLDER.findall(said)), english
        left = set(WORD.findall(PLACEHOLDER.sub("1", said))) - STAY - chinese.names
        assert not left, f"{said}: {left}"


#: texts of a page, of what it shows and of what it reads aloud; not what it marks as English, code or a name
TEXTS = """() => {
  const found = [];
  const names = '.code, .option, .name, .brand, .range, .notes, .printed, td a, td .soft, .setting .q-field';
  const own = (e) => e.closest(`[lang=en], ${names}, script, style, svg, i`);
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let n = walk.nextNode(); n; n = walk.nextNode()) if (!own(n.parentElement)) found.push(n.textContent);
  for (const e of document.querySelectorAll('[aria-label], [title]')) {
    if (!own(e)) found.push(e.getAttribute('aria-label') ?? '', e.getAttribute('title') ?? '');
  }
  return found.filter((t) => /[A-Za-z]/.test(t));
}"""


@pytest.mark.skipif(CHROMIUM is None, reason=NONE)
@pytest.mark.long
def test_no_english_label_on_a_page_in_chinese(page: Any, studio: tuple[str, Path], two_runs: list[Path]) -> None:
    """The switch leads to Chinese and back."""
    base, left = base_of(studio), {}
    slots = set(gb.load("fixed_position").system.all_slots())
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(base + "/runs")
    page.get_by_role("button", name="中文").click()
    try:
        page.get_by_role("heading", name="运行记录").wait_for()
        for path in (
            "/", "/system/fixed_position", "/data", "/data?test=drift_record", "/runs", "/tune", "/identify", "/design",
            "/campaign", "/laboratory", "/learn", "/run/fixed_position/run1",
            "/compare?run=fixed_position/run1&run=fixed_position/run2",
        ):  # fmt: skip
            page.goto(base + path)
            settled(page)
            assert page.evaluate("document.documentElement.lang") == "zh-CN"
            fits(page, 390)
            if path.startswith("/system"):
                assert page.locator(".code").first.inner_text().endswith("--language zh")
            found = {w for text in page.evaluate(TEXTS) for w in WORD.findall(text)}
            left[path] = found - STAY - slots - VALUES - {"English", "reports", "out", "run"}
        assert {path: found for path, found in left.items() if found} == {}
    finally:
        page.goto(base + "/runs")
        page.get_by_role("button", name="English").click()
        page.get_by_role("heading", name="Runs").wait_for()
    page.wait_for_function("document.documentElement.lang.startsWith('en')")


@pytest.mark.long
def test_a_studio_begins_in_the_language_it_is_asked_for(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "gyrobench", "studio", "--no-browser", "--port", "0", "--language", "zh"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        address = re.search(r"http://\S+", process.stdout.readline())
        assert address
        answer = Door.of(address[0]).get("/laboratory")[2].decode()
        process.terminate()
    assert "zh-CN" in answer and "资料" in answer
