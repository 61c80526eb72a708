"""Texts and links of others on a page: shown, not obeyed."""

from __future__ import annotations

import re

import pytest

from gyrobench.reading import visible
from gyrobench.report.render import _plain, _unbroken


@pytest.mark.parametrize(
    "link", ["javascript:alert(1)", " JavaScript:alert(1)", "java\nscript:x", "data:text/html,x", "vbscript:x"]
)
def test_a_link_leads_to_a_file_or_into_the_web(link: str) -> None:
    assert _plain({"cells": [{"link": link, "text": link.strip()}]})["cells"][0]["link"] == ""


@pytest.mark.parametrize(
    "link", ["kept/0/report.html", "../a b/report.html", "#filter=state:failed", "https://a.example/b"]
)
def test_other_links_stay(link: str) -> None:
    assert _plain({"link": link, "text": "x"}) == {"link": link, "text": "x"}


def test_characters_that_are_obeyed_are_shown() -> None:
    assert visible("a\u202eb\x1b[2J\x9b\u2066") == "a⟨U+202E⟩b⟨U+001B⟩[2J⟨U+009B⟩⟨U+2066⟩"
    assert visible("ω_d = −1°\n\tµ é ليل") == "ω_d = −1°\n\tµ é ليل"


def test_a_unit_is_not_broken_at_its_stroke() -> None:
    """A browser breaks lines behind / and between a number and its unit; other strokes are left as they are."""
    said = "below 0.041 °/h/√h (95 %), in °/√h; 1/2, and/or a < b, --check-step"
    whole = re.findall('<span class="whole">(.*?)</span>', str(_unbroken(said)))
    assert whole == ["0.041 °/h/√h", "°/√h", "--check-step"]
    assert re.sub("<[^>]*>", "", str(_unbroken(said))) == said.replace("<", "&lt;")
