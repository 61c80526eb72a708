"""Pages in another language: every text of a page and of its figures goes through one catalogue, at the end.

    with language.used("zh", system="servo_polar") as words:
        page = words.page(made())       # raises UntranslatedError with the sentences that the catalogue lacks

Code writes English, and no logic reads it.  ``catalogue/zh.toml`` has the texts of the bench, ``systems/NAME/zh.toml``
those of a test: English = translation.  In both, ``{placeholders}`` stand for a text, which is translated too, ``{n}``,
``{n2}`` for numbers and dates, ``{v}`` for names and values that stay.  A word of two senses has a line with its unit
or with the head of its column: "phase / °", "shape: step".  A text that is no line is taken apart at full stops,
semicolons, colons, commas, brackets and " and "; ``[joints]`` are what the parts are joined by.  Symbols, numbers,
units and names stay.  A test whose catalogue has ``report = true`` has all texts of its report, else those of its
certificate.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gyrobench import reading
from gyrobench.bench import UsageError, standard_folder
from gyrobench.errors import GyrobenchError
from gyrobench.report.page_model import (
    BulletList,
    CollapsedBlocks,
    Page,
    PageTable,
    Pictures,
    ResultSummary,
    Signatures,
    Text,
)

FOLDER = Path(__file__).parent / "catalogue"
ENGLISH = "en"
PLACEHOLDER = re.compile(r"\{(\w+)\}")
NUMERIC, VERBATIM = re.compile(r"n\d*"), re.compile(r"v\d*")
NUMBER = r"(?:[\d\s.,·:…−+±%<>=≤≥⁻⁰¹²³⁴⁵⁶⁷⁸⁹/-]|e(?=[+-]\d))+(?: UTC)?"
#: English words: letters that are no symbol and no part of an identifier (table.angle, u_a, --set, x.csv)
WORD = re.compile(r"(?<![\w./\\@-])(?:[A-Za-z][a-z]{2,}|of|to|no|in|by|at|is|on|or|as|up|eq|ch)(?![\w\\@]|[./-]\w)")
#: three words that follow one another
PROSE = re.compile(r"(?<![\w./\\@-])[a-z]{2,}(?: [a-z]{2,}){2}(?![\w\\@]|[./-]\w)")
SENTENCE = re.compile(r"(?<=[.!?])(?<!\bch\.)(?<!\bpar\.)(?<!\beq\.)(?<!\bed\.)\s+(?=[^a-z\s(=]|[a-z]\b|[a-z]+[/(:])")
DATE = re.compile(r"\b(\d{4})-(\d\d)-(\d\d)\b")


class UntranslatedError(GyrobenchError):
    """A page that would be half English: sentences that the catalogue lacks."""

    def __init__(self, what: str, code: str, sentences: Collection[str]) -> None:
        self.sentences = list(sentences)
        count = f"{len(self.sentences)} sentence{'s' * (len(self.sentences) > 1)}"
        shown = [f"  - {s}" for s in self.sentences[:5]]
        more = [f"  - and {len(self.sentences) - 5} more"] if len(self.sentences) > 5 else []
        head = f"{what} has {count} without a translation ({code}); without --language it is in English:"
        super().__init__("\n".join([head, *shown, *more]))


@dataclass(frozen=True)
class Catalogue:
    """Texts of a language.  texts: English -> translation; names: words that stay; joints: signs between parts."""

    code: str
    texts: Mapping[str, str]
    names: frozenset[str]
    joints: Mapping[str, str]
    html: str = ENGLISH
    reports: bool = True  # whether a test has all texts of its report, not of its certificate alone

    @functools.cached_property
    def templates(self) -> list[tuple[re.Pattern[str], str]]:
        """Patterns of the texts with placeholders, the most specific first."""
        found = sorted((t for t in self.texts if PLACEHOLDER.search(t)), key=lambda t: -len(PLACEHOLDER.sub("", t)))
        return [(_pattern(t), self.texts[t]) for t in found]


def _pattern(template: str) -> re.Pattern[str]:
    parts = PLACEHOLDER.split(template)
    for k in range(1, len(parts), 2):
        last = "(?<![.])" if k == len(parts) - 2 and not parts[-1] else ""
        parts[k] = f"(?P<{parts[k]}>{NUMBER if NUMERIC.fullmatch(parts[k]) else '.+?'}{last})"
    return re.compile("".join(p if k % 2 else re.escape(p) for k, p in enumerate(parts)), re.S)


def codes() -> list[str]:
    """Return the languages there are, English first."""
    return [ENGLISH, *sorted(p.stem for p in FOLDER.glob("*.toml"))]


def check_code(code: str) -> str:
    """Return a language that there is.  Raises UsageError."""
    if code not in codes():
        raise UsageError(f"{code}: no such language; there are: {', '.join(codes())}")
    return code


@functools.lru_cache(maxsize=64)
def catalogue(code: str, folder: Path | None = None, *others: Path) -> Catalogue:
    """Return the catalogue of a language, with those of a system in its folder and of others that it speaks of.

    Raises UsageError for a wrong file.
    """
    own = _read(FOLDER / f"{check_code(code)}.toml")
    texts, names, more = dict(own["texts"]), set(own["names"]), {}
    for place in filter(None, (*others, folder)):  # the system's own texts win
        if (file := place / f"{code}.toml").is_file():
            more = _read(file)
            texts |= more["texts"]
            names |= set(more.get("names", ()))
        else:
            more = {}
    return Catalogue(code, texts, frozenset(names), own["joints"], own["html"], bool(more.get("report", False)))


def system_folder(system: str, bench: Path | None = None) -> Path | None:
    """Return the folder of a system, in a bench or in the standard one; None where neither has it."""
    roots = [bench, standard_folder()] if bench else [standard_folder()]
    return next((f for root in roots if (f := root / "systems" / system).is_dir()), None)


def _read(file: Path) -> dict[str, Any]:
    return reading.toml(reading.read_text(file, UsageError), file, UsageError)


@dataclass
class Language:
    """A language in use.

    own: texts of the user, which stay as they are; names: of parts, slots and options, which stay where they are no
    text of the catalogue; missing: what had no translation.
    """

    catalogue: Catalogue
    own: frozenset[str] = frozenset()
    names: frozenset[str] = frozenset()
    missing: dict[str, None] = field(default_factory=dict)
    known: dict[str, str | None] = field(default_factory=dict)

    def short(self, text: str, shorten: Callable[[str], str]) -> str:
        """Return a text in the language, shortened, which is not translated once more."""
        found = shorten(self.text(text))
        self.known[found] = found
        return found

    def text(self, text: str) -> str:
        """Return a text in the language; one that has no translation stays and is noted in ``missing``."""
        found = self.find(text)
        if found is None:
            self.missing[text] = None
            return text
        self.known[found] = found  # what is said is not translated once more
        return found

    def has(self, text: str) -> bool:
        """Return whether a text can be said in the language."""
        return self.find(text) is not None

    def find(self, text: str) -> str | None:
        """Return a text in the language, None where the catalogue lacks it or a part of it."""
        if text not in self.known:
            self.known[text] = None  # a part that is the whole again is not taken apart once more
            self.known[text] = self._find(text)
        return self.known[text]

    def _find(self, text: str) -> str | None:
        if text in self.own or not text.strip():
            return text
        text = text.replace("\N{NO-BREAK SPACE}", " ")
        for form in (text, text[:1].lower() + text[1:], text[:1].upper() + text[1:]):
            if form in self.catalogue.texts and (form == text or text not in self.names):  # the slot table is no Table
                return self.catalogue.texts[form]
        if ": " not in text and self.catalogue.names.issuperset(WORD.findall(text)):
            return DATE.sub(lambda m: self.catalogue.joints["date"].format(*map(int, m.groups())), text)
        for form in dict.fromkeys((text, text[:1].upper() + text[1:], text[:1].lower() + text[1:])):
            for pattern, said in self.catalogue.templates:
                if (match := pattern.fullmatch(form)) and (made := self._filled(said, match)) is not None:
                    return made
        return self._named(text) or self._apart(text)

    def _named(self, text: str) -> str | None:
        """Return a name, several ones in lines, one broken after "_", or what one is called that "…" cuts short."""
        if text.endswith("…"):
            return next((self.find(name) for name in sorted(self.names) if name.startswith(text[:-1])), None)
        lines = text.replace("_\n", "_")
        return text if self.names.issuperset(lines.split("\n")) or lines.replace("\n", " ") in self.names else None

    def _filled(self, said: str, match: re.Match[str]) -> str | None:
        if any(v.count(a) != v.count(b) for v in match.groupdict().values() for a, b in ("“”", "()")):
            return None  # not a part of one text and of the next
        parts = {n: self._kept(v) if VERBATIM.fullmatch(n) else self.find(v) for n, v in match.groupdict().items()}
        if None in parts.values():
            return None
        return PLACEHOLDER.sub(lambda m: str(parts[m[1]]), said)

    def _kept(self, text: str) -> str | None:
        """Return a name or a value that stays as it is; None of words that make a sentence, half English."""
        return None if PROSE.search(text) and not (self.own | self.names).issuperset([text]) else text

    def _apart(self, text: str) -> str | None:
        """Return a text that is made of others: sentences, clauses, name and text, a list, a remark in brackets."""
        joints = self.catalogue.joints
        for gap in SENTENCE.finditer(text):
            if (made := self._all([text[: gap.start()], text[gap.end() :]])) is not None:
                return made[0] + " " * made[0].isascii() + made[1]
        for sign in ("\n", " / ", "; ", ": ", ", ", " and "):
            if sign in text and (made := self._all(text.split(sign))) is not None:
                return joints[sign].join(made)
        name, sign, said = text.partition(": ")
        if sign and (made := self._all([name, said])) is not None:
            return joints[sign].join(made)
        if text.endswith((".", ":")) and (made1 := self.find(text[:-1])) is not None:
            return made1 + joints[text[-1]]
        for opening, closing in (("(", ")"), ("[", "]"), ("“", "”")):
            before, sign, rest = text.partition(opening)
            inner, closed, after = rest.rpartition(closing)
            if sign and closed and before + after + inner != text:
                made2 = self._all([before.rstrip(), inner, after.lstrip()])
                if made2 is not None:
                    return f"{made2[0]}{joints[opening]}{made2[1]}{joints[closing]}{made2[2]}"
        return None

    def _all(self, parts: list[str]) -> list[str] | None:
        made = [self.find(part) for part in parts]
        return None if None in made else [str(m) for m in made]

    def page(self, page: Page, what: str = "the report") -> Page:
        """Return a page in the language, in place.  Raises UntranslatedError where it would be half English."""
        page.language, page.html_language = self.catalogue.code, self.catalogue.html
        page.title, page.what = self.text(page.title), self.text(page.what)
        page.words = {name: self.text(word) for name, word in page.words.items()}
        page.head = [(self.text(name), self.text(value)) for name, value in page.head]
        for section in page.sections:
            section.title = self.text(section.title)
            for block in section.blocks:
                self._block(block)
        if self.missing:
            raise UntranslatedError(what, self.catalogue.code, self.missing)
        return page

    def _block(self, block: Any) -> None:
        if isinstance(block, PageTable):
            self._table(block)
        elif isinstance(block, Pictures):
            for picture in block.items:
                picture.caption, picture.alt = self.text(picture.caption), self.text(picture.alt)
        elif isinstance(block, Text):
            block.text = self.text(block.text)
        elif isinstance(block, BulletList):
            block.items = [self.text(i) for i in block.items]
        elif isinstance(block, Signatures):
            block.statements = [self.text(s) for s in block.statements]
            block.items = [(self.text(role), name) for role, name in block.items]
        elif isinstance(block, CollapsedBlocks):
            block.title = self.text(block.title)
            for inner in block.blocks:
                self._block(inner)
        elif isinstance(block, ResultSummary):
            block.said = self.text(block.verdict)
            block.rule = self.text(block.rule)
            block.summary = [self.text(s) for s in block.summary]
            block.warnings = [self.text(s) for s in block.warnings]
            if block.requirements:
                self._table(block.requirements)

    def _table(self, table: PageTable) -> None:
        table.caption = self.text(table.caption)
        heads = [column.head for column in table.columns]
        for column in table.columns:
            column.head = self._within(column.head, f"{column.head} / {column.unit}").removesuffix(f" / {column.unit}")
        for row in table.rows:
            row.group = self.text(row.group)
            for head, cell in zip(heads, row.cells, strict=False):
                if not (cell.number or cell.own or cell.mark == "hash"):
                    cell.text = self._within(cell.text, f"{head}: {cell.text}")

    def _within(self, text: str, whole: str) -> str:
        """Return a text by the line that tells its sense, with its unit or its column, where there is one."""
        return self.catalogue.texts.get(whole) or self.text(text)


def reports_there(code: str, system: str, bench: Path | None = None) -> bool:
    """Return whether the report of a test has its texts in a language.  Raises UsageError for no language."""
    return check_code(code) == ENGLISH or catalogue(code, system_folder(system, bench)).reports


def require_reports(code: str, system: str, bench: Path | None = None) -> None:
    """Raise UsageError for a language that there is not, and for one in which a test has no texts of its report."""
    if not reports_there(code, system, bench):
        raise UsageError(
            f"--language {code}: the report of {system} has no translation, it would be half English; its certificate "
            f"has (gyrobench certificate RUN --language {code})"
        )


@contextmanager
def reports_in(code: str, system: str, bench: Path | None = None) -> Iterator[None]:
    """Make a language that of the reports written within.  Raises as :func:`require_reports`, before any run."""
    require_reports(code, system, bench)
    token = _chosen.set(code)
    try:
        yield
    finally:
        _chosen.reset(token)


def chosen() -> str:
    """Return the language of the reports that are written."""
    return _chosen.get()


_chosen: ContextVar[str] = ContextVar("chosen", default=ENGLISH)
_in_use: ContextVar[Language | None] = ContextVar("language", default=None)


@contextmanager
def used(
    code: str,
    folder: Path | None = None,
    own: Collection[str] = (),
    names: Collection[str] = (),
    others: Collection[Path] = (),
) -> Iterator[Language | None]:
    """Make a language that of the figures drawn within; None is English.

    folder: of the system; own, names: as in :class:`Language`; others: folders of the tests of a suite.
    """
    known = None if code == ENGLISH else catalogue(code, folder, *others)
    language = Language(known, frozenset(own), frozenset(names)) if known else None
    token = _in_use.set(language)
    try:
        yield language
    finally:
        _in_use.reset(token)


def in_use() -> Language | None:
    """Return the language of the figures, None of English."""
    return _in_use.get()
