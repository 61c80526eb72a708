"""The studio in a browser: where it is, and what a page of a run shows."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
LIMIT = 300_000  # ms, for one thing to come: a machine that has others to serve too is slow, not wrong
TESTS = Path(__file__).parents[1]
NONE = "no chromium on PATH: the studio is not looked at"


def base_of(studio: tuple[str, Path]) -> str:
    return studio[0].partition("/?")[0]


def run_of(page: Any, home: Path) -> Path:
    """Return the folder of the run that a page shows."""
    page.wait_for_url("**/run/**")
    return home / "reports" / "out" / page.url.partition("/run/")[2]


def soon(look: Callable[[], Any], wanted: Any) -> None:
    """Assert that what is looked at becomes what is wanted: what was done a moment ago may still be on its way."""
    end = time.monotonic() + 1e-3 * LIMIT
    while (seen := look()) != wanted:
        assert time.monotonic() < end, f"{seen!r}, not {wanted!r}"
        time.sleep(0.05)


def at_rest(page: Any, look: Callable[[], Any], still: int) -> Any:
    """Return what is looked at once it has been the same for ``still`` ms."""
    end = time.monotonic() + 1e-3 * LIMIT
    seen = look()
    while True:
        page.wait_for_timeout(still)
        seen, before = look(), seen
        if seen == before:
            return seen
        assert time.monotonic() < end, f"{before!r}, then {seen!r}"


def fits(page: Any, width: int) -> None:
    """Assert that a page of this width, px, is laid out without a part outside of it."""
    page.wait_for_function("width => innerWidth === width", arg=width)
    soon(lambda: page.evaluate("document.documentElement.scrollWidth > innerWidth"), False)


#: the page has its connection, and nothing on it moves any more
AT_REST = """() => window.did_handshake
  && document.getAnimations().every((a) => a.playState !== 'running')"""


def settled(page: Any) -> None:
    """Wait until a page has its heading, its connection and no movement."""
    page.locator("h1").first.wait_for()
    page.wait_for_function(AT_REST)
