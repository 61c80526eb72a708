"""The bibliography, ``docs/references.md``: what the keys in the sources of a result stand for."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Sequence
from typing import Any

from gyrobench.bench import standard_folder
from gyrobench.report.page_model import BulletList, Text

#: ids of methods and numbers of errata, as sources name them: TEST-TUMBLE1-SDF, E20, EX14
IDENTIFIER = re.compile(r"\b[A-Z][A-Z0-9]*-[A-Z0-9-]+\b|\bE[RTXAG]?\d+\b")
WHERE = "Identifiers of methods (TEST-...) and errata (E...): gyrobench documentation, docs/methods and docs/errata.md."


@functools.cache
def bibliography() -> dict[str, str]:
    """Return key -> author, title, publisher, year: headings and first paragraphs of the page.

    Empty where the page was not installed: a report then prints the keys alone.
    """
    page = standard_folder() / "docs" / "references.md"
    text = page.read_text(encoding="utf-8") if page.is_file() else ""
    entries = (entry.partition("\n") for entry in re.split(r"^## ", text, flags=re.M)[1:])
    return {key.strip(): " ".join(body.strip().split("\n\n")[0].split()) for key, _, body in entries}


def cited(texts: Iterable[str]) -> dict[str, str]:
    """Return the entries of the bibliography whose keys occur in ``texts``, in the order of the bibliography."""
    whole = "\n".join(texts)
    return {key: entry for key, entry in bibliography().items() if re.search(rf"(?<!\w){re.escape(key)}(?!\w)", whole)}


def source_blocks(sources: Sequence[str]) -> list[Any]:
    """Return the sources of a result as report blocks: the texts, then each work they cite in full."""
    if not sources:
        return []
    text = f"Sources: {'. '.join(sources)}."
    if any(IDENTIFIER.search(s) for s in sources):
        text += f" {WHERE}"
    works = [entry if entry.startswith(key) else f"{key}: {entry}" for key, entry in cited(sources).items()]
    return [Text(text, quiet=True), *([BulletList(works)] if works else [])]
