"""Content of a report before it is HTML or PDF: sections of blocks.

Both renderers draw the same blocks, which is why they say the same.  Every text is plain text; each
renderer escapes it.  A number cell carries its rounded text, its full value and the JSON pointer it
was read from.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from typing import Any

from gyrobench.report.numbers import FormattedNumber, write_number
from gyrobench.report.result_json import pointer, value_at

Path = Sequence[str | int]

#: what the templates of HTML and PDF print beside the texts of a page
WORDS = {
    "table": "Table",
    "figure": "Figure",
    "page": "Page {n} of {n2}",
    "name": "Name",
    "signature": "Signature",
    "date": "Date",
    "verdict": "Verdict",
    "rule": "Decision rule",
    "warnings": "Warnings",
    "none": "No warnings.",
    "contents": "Contents",
    "skip": "Skip to the report",
    "zoom": "Drag over the figure to zoom|Zoom in|Zoom out|Earlier|Later|whole|Whole record",
    **{verdict: verdict for verdict in ("pass", "fail", "inconclusive", "void")},
}


@dataclass
class Cell:
    """One table cell: a text, or a number cut at its decimal sign."""

    text: str = ""
    whole: str = ""
    rest: str = ""
    full: str = ""  # repr of the full value
    pointer: str = ""  # where it stands in result.json
    mark: str = ""  # pass | fail | inconclusive | void | warn | strong | ""
    number: bool = False
    link: str = ""  # what the text leads to, on the page
    own: bool = False  # a name or a value: the same in every language


@dataclass
class Column:
    head: str
    unit: str = ""
    number: bool = False
    wide: bool = False  # may take the room that is left
    width: int = 0  # characters after the decimal sign, set by PageTable


def columns(*heads: str | tuple[str, str], wide: Collection[str] = ()) -> list[Column]:
    """Return columns by head, or head and unit; wide: heads of those that may take the room that is left."""
    named = [(h, "") if isinstance(h, str) else h for h in heads]
    return [Column(head, unit, wide=head in wide) for head, unit in named]


@dataclass
class Row:
    cells: list[Cell]
    group: str = ""  # not empty: a heading across the table, no cells
    strong: bool = False


@dataclass
class PageTable:
    columns: list[Column]
    rows: list[Row]
    caption: str
    kind: str = "table"
    number: int = 0
    small: bool = False

    def __post_init__(self) -> None:
        for k, column in enumerate(self.columns):
            cells = [row.cells[k] for row in self.rows if not row.group]
            column.number = column.number or any(c.number for c in cells)
            column.width = max((len(c.rest) for c in cells), default=0)


@dataclass
class Picture:
    key: str  # file stem, unique in the report
    svg: str
    caption: str
    alt: str
    half: bool = False  # drawn for half the page width
    zoom: bool = False
    number: int = 0


@dataclass
class Pictures:
    """Figures side by side where there is room."""

    items: list[Picture]
    kind: str = "pictures"


@dataclass
class Text:
    text: str
    kind: str = "text"
    quiet: bool = False
    link: str = ""  # a file beside the report, for the page


@dataclass
class BulletList:
    items: list[str]
    kind: str = "items"
    warn: bool = False


@dataclass
class Markup:
    """A piece of a page that a script fills; not for paper."""

    html: str
    kind: str = "markup"


@dataclass
class Equation:
    source: str  # Typst math
    svg: str = ""
    kind: str = "equation"


@dataclass
class ResultSummary:
    """The box a reader looks at first."""

    verdict: str
    rule: str
    summary: list[str]
    warnings: list[str]
    requirements: PageTable | None
    said: str = ""  # the verdict as it is printed; "": as it is
    kind: str = "answer"


@dataclass
class Signatures:
    """Statements, and beneath on the same page lines to sign on: role and, where it is known, name."""

    statements: list[str]
    items: list[tuple[str, str]]
    kind: str = "signatures"


@dataclass
class CollapsedBlocks:
    """Blocks folded away in HTML, printed in full in PDF."""

    title: str
    blocks: list[Any]
    kind: str = "fold"


@dataclass
class Section:
    title: str
    slug: str
    blocks: list[Any] = field(default_factory=list)
    sub: bool = False
    number: str = ""


@dataclass
class Page:
    """A whole report."""

    title: str
    report_id: str
    head: list[tuple[str, str]]
    sections: list[Section]
    pictures: list[Picture] = field(default_factory=list)
    what: str = "Report"
    logo: str = ""  # data URI
    language: str = "en"
    html_language: str = "en"
    words: dict[str, str] = field(default_factory=lambda: dict(WORDS))

    def finish(self) -> Page:
        """Number sections, tables and figures in reading order; drop sections without content."""
        self.words["end"] = f"— end of {self.what.lower()} —"
        kept = []
        for k, section in enumerate(self.sections):
            following = self.sections[k + 1 :]
            if section.blocks or (not section.sub and following and following[0].sub):
                kept.append(section)
        self.sections = kept
        major = minor = tables = 0
        for section in self.sections:
            major, minor = (major, minor + 1) if section.sub else (major + 1, 0)
            section.number = f"{major}.{minor}" if section.sub else str(major)
            for block in walk(section.blocks):
                if isinstance(block, PageTable):
                    tables += 1
                    block.number = tables
                elif isinstance(block, Pictures):
                    for picture in block.items:
                        self.pictures.append(picture)
                        picture.number = len(self.pictures)
        return self


def walk(blocks: list[Any]) -> list[Any]:
    """Return all blocks with those inside folds and answers, in order."""
    out: list[Any] = []
    for block in blocks:
        out.append(block)
        if isinstance(block, CollapsedBlocks):
            out += walk(block.blocks)
        elif isinstance(block, ResultSummary) and block.requirements:
            out.append(block.requirements)
    return out


def pictures(*items: Picture) -> list[Any]:
    """Return the pictures that have something to show, as one block; no block when none has."""
    shown = [p for p in items if p.svg]
    return [Pictures(shown)] if shown else []


def remarks(texts: Sequence[str]) -> list[Any]:
    """Return remarks as sentences, each with the sign of a warning; nothing without any."""
    return [BulletList([f"{t[:1].upper()}{t[1:]}." for t in texts], warn=True)] if texts else []


def document_id(doc: Any) -> str:
    """Return the number of a report whose document has none: it is that of the content."""
    return hashlib.sha256(json.dumps(doc, sort_keys=True).encode()).hexdigest()[:12]


def text_cell(value: Any, mark: str = "", link: str = "", own: bool = False) -> Cell:
    return Cell(text="" if value is None else str(value), mark=mark, link=link, own=own)


def number_cell(
    doc: Any,
    path: Path,
    u: float | None = None,
    write: Callable[..., FormattedNumber] = write_number,
    mark: str = "",
    significant: int = 4,
    trim: bool = True,
) -> Cell:
    """Return the number at ``path`` of the document; a text that stands there stays a text."""
    value = value_at(doc, *path)
    if isinstance(value, str | list | dict):
        return text_cell(value, mark)
    written = write_number(value, u, significant, trim) if write is write_number else write(value)
    return Cell(
        written.text, written.whole, written.rest, written.full, pointer(*path) if written.full else "", mark, True
    )
