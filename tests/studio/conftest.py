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


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    """The first address of a studio, and the folder it was started in."""
    home = tmp_path_factory.mktemp("bench")
    command = [sys.executable, "-m", "gyrobench", "studio", "--no-browser", "--port", "0"]
    process = subprocess.Popen(command, cwd=home, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    line = process.stdout.readline()
    address = re.search(r"http://\S+", line)
    assert address, line
    yield address[0], home
    process.terminate()
    process.wait(20)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        found = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield found
        found.close()


@pytest.fixture
def page(studio: tuple[str, Path], browser: Any) -> Iterator[Any]:
    """A page at the first address; every request, and every complaint of the page, is looked at in the end."""
    context = browser.new_context(viewport={"width": 1300, "height": 900})
    page = context.new_page()
    page.set_default_timeout(LIMIT)
    base = studio[0].partition("/?")[0]
    outside: list[str] = []
    complaints: list[str] = []
    page.on("request", lambda r: outside.append(r.url) if not r.url.startswith((base, "data:", "blob:")) else None)
    page.on("websocket", lambda w: None if w.url.startswith(base.replace("http", "ws")) else outside.append(w.url))
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda e: complaints.append(str(e)))
    page.goto(studio[0])
    yield page
    context.close()
    assert outside == [] and complaints == []
