"""Docstrings of gyrobench as reStructuredText: prose with its marks escaped, equations and tables as they stand."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import groupby

MARKED = re.compile(r"(:[a-z]+:`[^`]+`|``.+?``|`[^`]+`)")
ITEM = re.compile(r"\s*(?:[-*]|\d+\.) ")


def escaped(line: str) -> str:
    """Return a line of prose whose roles and literals are kept, and no other mark means anything."""
    words = MARKED.split(line)
    for k, word in enumerate(words):
        if k % 2 == 0:
            words[k] = re.sub(r"([\\*|`]|_(?!\w))", r"\\\1", word)
        elif word[0] == "`" and word[1] != "`":
            words[k] = f"`{word}`"
    return "".join(words)


def indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def paragraphs(lines: list[str]) -> Iterator[list[str]]:
    """Yield runs of lines without an empty one, split where text that stands further in begins or ends."""
    for empty, run in groupby(lines, lambda line: not line.strip()):
        if empty:
            continue
        part: list[str] = []
        for line in run:
            listed = bool(part) and ITEM.match(part[0]) is not None
            new = ITEM.match(line) if not part or indent(line) < 4 else None
            if part and (new or (not listed and (indent(line) > 0) != (indent(part[0]) > 0))):
                yield part
                part = []
            part.append(line)
        yield part


def restructured(lines: list[str]) -> list[str]:
    """Return the lines of a docstring as reStructuredText."""
    found: list[str] = []
    for part in paragraphs(lines):
        if (mark := ITEM.match(part[0])) and indent(part[0]) < 4:
            text = " ".join(line.strip() for line in part)[len(mark[0].strip()) :].strip()
            found += [f"{'#.' if mark[0].strip()[0].isdigit() else '-'} {escaped(text)}", ""]
        elif indent(part[0]) > 0:
            found += [".. code-block:: text", "", *(f"    {line}" for line in part), ""]
        else:
            found += [escaped(" ".join(part)), ""]
    return found
