"""A studio, a browser, and a page of both."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from studio_pages import CHROMIUM, LIMIT

import gyrobench as gb

VIEW = {"width": 1300, "height": 900}


@pytest.fixture(scope="session")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """The first address of a studio, and the folder it was started in; one for all tests that run in a process."""
    home = tmp_path_factory.mktemp("bench")
    command = [sys.executable, "-m", "gyrobench", "studio", "--no-browser", "--port", "0"]
    process = subprocess.Popen(command, cwd=home, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    line = process.stdout.readline()
    address = re.search(r"http://\S+", line)
    assert address, line
    yield address[0], home
    process.terminate()
    process.wait(1e-3 * LIMIT)


@pytest.fixture(scope="module")  # not of the session: while it lives, no other test could run an event loop
def browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        found = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"], timeout=LIMIT)
        yield found
        found.close()


@pytest.fixture(scope="module")
def context(studio: tuple[str, Path], browser: Any) -> Iterator[Any]:
    """A browser that has opened the first address once: it has the cookie and keeps the scripts of the front end."""
    made = browser.new_context(viewport=VIEW)
    made.set_default_timeout(LIMIT)  # of all its pages
    page = made.new_page()
    page.goto(studio[0])
    page.close()
    yield made
    made.close()


@pytest.fixture
def page(studio: tuple[str, Path], context: Any) -> Iterator[Any]:
    """An empty page; every request, and every complaint of the page, is looked at in the end."""
    page = context.new_page()
    page.set_viewport_size(VIEW)
    base = studio[0].partition("/?")[0]
    outside: list[str] = []
    complaints: list[str] = []
    page.on("request", lambda r: outside.append(r.url) if not r.url.startswith((base, "data:", "blob:")) else None)
    page.on("websocket", lambda w: None if w.url.startswith(base.replace("http", "ws")) else outside.append(w.url))
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda e: complaints.append(str(e)))
    yield page
    page.close()
    assert outside == [] and complaints == []


@pytest.fixture(scope="session")
def two_runs(studio: tuple[str, Path]) -> list[Path]:
    """Folders of two short runs of the studio's bench, with their reports."""
    out = studio[1] / "reports" / "out" / "fixed_position"
    folders = [out / "run1", out / "run2"]
    for seed, folder in enumerate(folders, 1):
        gb.load("fixed_position", {"dwell": "60s"}).run(seed, check_step=False).report(folder)
    return folders
