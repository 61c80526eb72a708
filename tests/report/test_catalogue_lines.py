"""Lines of the catalogues against the code: one whose English nothing says any more is named."""

from __future__ import annotations

import functools
import re
from pathlib import Path

import pytest
from option_texts import option_texts

from gyrobench.bench import standard_folder
from gyrobench.report import language
from gyrobench.report.language import PLACEHOLDER

ROOT = standard_folder()
FILES = sorted(
    [
        *language.FOLDER.glob("*.toml"),
        *ROOT.glob("systems/*/zh.toml"),
        language.FOLDER.parents[1] / "campaign/site/zh.toml",
    ]
)
LETTERS = re.compile(r"[^\W\d_]+")
JOINED = re.compile(r"\\n|[\"']\s*[fr]?[\"']")  # a text that goes on in the next line of the code
LEAST = 8  # runs of four words, of which half are said: fewer are too few to judge
#: put together by code of single words
PUT_TOGETHER = re.compile("aliased with|the filter (over|under)states|its stated covariance|Error of the attitude in")

Runs = set[tuple[str, str, str, str]]


def runs(text: str) -> Runs:
    """Return the words of a text that follow one another, four by four."""
    words = LETTERS.findall(text.lower())
    return set(zip(words, words[1:], words[2:], words[3:], strict=False))


@functools.cache
def said() -> Runs:
    """Return what the code of bench, systems and parts says, and the bibliography, which reports print."""
    files = [f for folder in ("gyrobench", "systems", "components") for f in (ROOT / folder).rglob("*.py")]
    return set().union(*(runs(JOINED.sub(" ", f.read_text())) for f in [*files, ROOT / "docs" / "references.md"]))


def stale(english: str) -> bool:
    """Return whether a line of a catalogue is one that the code does not say."""
    its: Runs = set().union(*map(runs, PLACEHOLDER.split(english)))
    return len(its) >= LEAST and len(its & said()) < len(its) / 2 and not PUT_TOGETHER.search(english)


@pytest.mark.parametrize("file", FILES, ids=lambda f: f"{f.parent.name}-{f.stem}")
def test_every_line_of_a_catalogue_is_said_by_the_code(file: Path) -> None:
    lines = set(language._read(file)["texts"]) - option_texts(file)
    assert not [english for english in sorted(lines) if stale(english)]


def test_a_sentence_of_several_tests_stands_once() -> None:
    """In the catalogue of the bench, or, of options, of the studio; a word may be another one in another test."""
    places: dict[tuple[str, str], list[str]] = {}
    for file in FILES:
        for line in language._read(file)["texts"].items():
            if len(line[0].split()) > 3:
                places.setdefault(line, []).append(file.parent.name)
    assert len(places) > 2500, "the lines are read"
    assert not {line[0]: where for line, where in places.items() if len(where) > 1}


def test_a_line_that_nothing_says_is_found() -> None:
    """Of a sentence of the code the half is changed: 'The table axis is at right angles to the pole ...'."""
    assert not stale("The table axis is at right angles to the pole and sees no Earth rate.")
    assert stale("The table axis is perpendicular to the polar direction and does not see any rotation of the Earth.")
