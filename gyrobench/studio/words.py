"""The language of the studio: its labels by the catalogue that reports use, with the texts of the face beside.

Code writes English.  ``zh.toml`` in this folder has the labels and what options of several systems mean,
``systems/NAME/zh.toml`` titles, summaries and options; what a part says of its parameters stays English and is marked
as such (lang="en").
"""

from __future__ import annotations

import functools
import os
import re
import tempfile
from html import escape
from pathlib import Path

from nicegui import ui

from gyrobench.bench import Bench, display_path
from gyrobench.files import TEMPORARY
from gyrobench.reading import visible
from gyrobench.report.language import ENGLISH, Language, catalogue, check_code, codes, reports_there, system_folder
from gyrobench.studio.request import FILES

HERE = Path(__file__).parent
NAMES = {"en": "English", "zh": "中文"}


class _Words:
    """Labels in the language in use, that of the whole studio: ``say("Run")``."""

    code = ENGLISH

    def use(self, code: str) -> None:
        """Choose a language.  Raises UsageError for one that there is not."""
        self.code = check_code(code)

    @property
    def html(self) -> str:
        """The language as a page states it."""
        return catalogue(self.code).html if self.code != ENGLISH else ENGLISH

    @property
    def other(self) -> str:
        """The language that follows in the switch."""
        every = codes()
        return every[(every.index(self.code) + 1) % len(every)]

    def of_report(self, system: str, bench: Path) -> str:
        """Return the language of the reports of a test: that of the pages, where they are translated."""
        return self.code if reports_there(self.code, system, bench) else ENGLISH

    def __call__(self, text: str, system: str = "") -> str:
        """Return a text in the language; one that the catalogue lacks stays."""
        return self.find(text, system) or text

    def find(self, text: str, system: str = "") -> str | None:
        """Return a text in the language, None where the catalogue lacks it.  system: whose texts are looked at, too."""
        return text if self.code == ENGLISH else _found(self.code, system, text)


@functools.lru_cache(maxsize=8192)
def _found(code: str, system: str, text: str) -> str | None:
    folder = system_folder(system) if system else None
    return Language(catalogue(code, HERE, *filter(None, [folder]))).find(text)


say = _Words()


def shown(text: str) -> str:
    """Return what the bench says as a page shows it: files that were dropped by their own names, without the folders
    that keep them and those of their texts for a while.
    """
    out = Bench.find().out
    kept = "|".join(re.escape(f"{place}{os.sep}{FILES}{os.sep}") + r"\w+" for place in (out, display_path(out)))
    text_of_log = re.escape(os.path.join(tempfile.gettempdir(), TEMPORARY)) + r"\w+[/\\]\w+"
    return visible(re.sub(rf"({kept}|{text_of_log})[/\\]", "", text))


def content(text: str, system: str = "") -> ui.label:
    """Add a label of what a system or a part says; where it stays English the page says so."""
    found = say.find(text, system)
    label = ui.label(text if found is None else found)
    return label.props('lang="en"') if found is None else label


def marked(text: str, system: str, classes: str) -> str:
    """Return the HTML of what a system says, in the language; where it stays English it is marked so."""
    found = say.find(text, system)
    english = ' lang="en"' if found is None else ""
    return f'<div class="{classes}"{english}>{escape(text if found is None else found)}</div>'


def spoken(text: str) -> str:
    """Return the property that names an element aloud, in the language."""
    return f'aria-label="{escape(say(text))}"'


def heading(text: str, level: int = 1) -> ui.html:
    """Add a heading in the language."""
    return ui.html(f"<h{level}>{escape(say(text))}</h{level}>", sanitize=False)
