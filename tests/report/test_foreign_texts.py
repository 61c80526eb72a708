"""Texts and links of others on a page: shown, not obeyed."""

from __future__ import annotations

import pytest

from gyrobench.reading import visible
from gyrobench.report.render import _plain


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
