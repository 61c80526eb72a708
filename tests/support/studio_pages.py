"""The studio in a browser: where it is, and what a page of a run shows."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
LIMIT = 60_000  # ms, for one thing to come
TESTS = Path(__file__).parents[1]
NONE = "no chromium on PATH: the studio is not looked at"


def base_of(studio: tuple[str, Path]) -> str:
    return studio[0].partition("/?")[0]


def run_of(page: Any, home: Path) -> Path:
    """Return the folder of the run that a page shows."""
    page.wait_for_url("**/run/**")
    return home / "reports" / "out" / page.url.partition("/run/")[2]


#: the page has its connection, and nothing on it moves any more
AT_REST = """() => window.did_handshake
  && document.getAnimations().every((a) => a.playState !== 'running')"""


def settled(page: Any) -> None:
    """Wait until a page has its heading, its connection and no movement."""
    page.locator("h1").first.wait_for()
    page.wait_for_function(AT_REST)
