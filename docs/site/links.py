"""Links of the Markdown pages: where they lead, and the anchors that a page offers."""

from __future__ import annotations

import re
from pathlib import Path

FENCE = re.compile(r"^ {0,3}(`{3,}|~{3,}).*?^ {0,3}\1`*\s*$", re.M | re.S)
INDENTED = re.compile(r"^(?: {4,}|\t).*$", re.M)
CODE = re.compile(r"(`+)(?!`).+?(?<!`)\1(?!`)", re.S)
LINK = re.compile(r"(!?)\[((?:[^\[\]]|!\[[^\]]*\]\([^)]*\))*)\]\(([^()\s]+)\)")
HEADING = re.compile(r"^#{1,6} +(.+?) *#*$", re.M)

#: folders whose Markdown files are pages, and single pages
ROOMS = ("docs", "systems", "components")
SINGLE = (
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "fmus/README.md",
    "instruments/README.md",
    "reports/README.md",
    "tests/benchmarks/README.md",
    "tests/spec/README.md",
)


def pages(root: Path) -> list[Path]:
    """Return the Markdown pages of the repository, README.md first."""
    single = [root / name for name in SINGLE if (root / name).is_file()]
    return single + [page for room in ROOMS for page in sorted((root / room).rglob("*.md"))]


def blank(match: re.Match[str]) -> str:
    """Return as many lines, empty: places in the text stay."""
    return re.sub(r"[^\n]", " ", match[0])


def prose(text: str) -> str:
    """Return a page without its code, at the same places."""
    for code in (FENCE, INDENTED, CODE):
        text = code.sub(blank, text)
    return text


def links(text: str) -> list[tuple[int, str]]:
    """Return the links and pictures of a page, those within links too: the line, and where it leads."""
    bare = prose(text)
    found = [(m.start(3), m[3]) for m in LINK.finditer(bare)]
    found += [(m.start(1), m[1]) for m in re.finditer(r"!\[[^\]]*\]\(([^()\s]+)\)", bare)]
    return [(bare.count("\n", 0, place) + 1, target) for place, target in sorted(set(found))]


def anchors(text: str) -> set[str]:
    """Return the anchors of a page's headings, as GitHub and the site make them."""
    found: set[str] = set()
    for heading in HEADING.findall(FENCE.sub(blank, text)):
        words = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        slug = re.sub(r"[^\w\- ]", "", words.strip().lower()).replace(" ", "-")
        name, number = slug, 0
        while name in found:
            number += 1
            name = f"{slug}-{number}"
        found.add(name)
    return found


def dead(page: Path) -> list[str]:
    """Return what is wrong with the links of a page, a sentence each."""
    problems = []
    for line, target in links(page.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = page if not name else page.parent / name
        if not file.exists():
            problems.append(f"{page}:{line}: {target}: there is no such file")
        elif anchor and (file.suffix != ".md" or anchor not in anchors(file.read_text(encoding="utf-8"))):
            problems.append(f"{page}:{line}: {target}: the page has no heading of this name")
    return problems
