"""Sources resolve: keys in the bibliography, ids of methods and errata in docs/, nothing cited by a file's name."""

from __future__ import annotations

import ast
import calendar
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from gyrobench.report.references import bibliography, cited, source_blocks

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
TEXT = {".py", ".md", ".csv", ".toml", ".json", ".c", ".h", ".html", ".typ", ".css", ".js", ".cfg", ".yml", ""}

#: A-B that are no ids of methods
WORDS = {
    "UTF-8",
    "AVX-512",
    "BY-NC-SA",
    "FG-1",
    "FG-2",
    "KG-0",
    "MIL-STD-810F",
    "UTF-16",
    "SHA-256",
    "BSD-3",
    "IMU-TK",
    "LN-100",
    "VN-100",
    "NO-BREAK",
    "SIM-1",
    "RIG-7",
    "TGP-3",
    "Z0-9",
    "TEST-",
    "TEST-A",
    "TEST-B",
}
ID = r"[A-Z][A-Z0-9]+(?:-[A-Z0-9]+(?:\+[A-Z]+|g(?![a-z]))?)+"
ERRATUM = r"E[RTXAG]?\d{1,2}"


def files(*rooms: str) -> Iterator[Path]:
    """Text files of the checkout, of the rooms or of all that is under version control."""
    for top in rooms or ("components", "docs", "fmus", "gyrobench", "reports", "systems", "tests"):
        for f in sorted((ROOT / top).rglob("*")):
            parts = f.relative_to(ROOT).parts
            if f.is_file() and f.suffix in TEXT and parts[:2] != ("reports", "out") and "__pycache__" not in parts:
                yield f
    if not rooms:
        yield from (f for f in ROOT.iterdir() if f.is_file() and f.suffix in TEXT)


@cache
def read(file: Path) -> str:
    return file.read_text(encoding="utf-8", errors="replace")


@cache
def headings() -> set[str]:
    """Ids that have a heading in docs/methods: "## TEST-8POS: eight positions", "### ACC, ACC-EXACT: ..."."""
    found: set[str] = set()
    for page in (DOCS / "methods").glob("*.md"):
        for line in re.findall(r"^#{2,3} ([^:\n]+):", read(page), flags=re.M):
            found |= {name.strip() for name in line.split(",")}
    return found


@cache
def errata() -> dict[str, tuple[str, ...]]:
    """Number -> cells of its row."""
    rows: dict[str, tuple[str, ...]] = {}
    for line in read(DOCS / "errata.md").splitlines():
        cells = [c.strip() for c in line.strip().strip("|").split("|")]
        if re.fullmatch(ERRATUM, cells[0]):
            assert cells[0] not in rows, f"{cells[0]} twice"
            rows[cells[0]] = tuple(cells)
    return rows


def prose(file: Path) -> str:
    """What a person reads to understand: a page, or the docstrings of a module."""
    if file.suffix != ".py":
        return read(file)
    nodes = (ast.Module, ast.ClassDef, ast.FunctionDef)
    return "\n\n".join(ast.get_docstring(n) or "" for n in ast.walk(ast.parse(read(file))) if isinstance(n, nodes))


# ------------------------------------------------------------------------------------------------ keys
@pytest.mark.long
def test_no_source_is_cited_by_a_file_or_by_hearsay() -> None:
    hearsay = r"\d{3}_[0-9a-f]{16}|\bspec d\d|\bseed eq|\b[Tt]he (?:book|thesis)\b|\b[Ss]pecification d\d"
    for file in files():
        if file != Path(__file__):
            found = re.search(hearsay, read(file))
            assert not found, f"{file}: '{found[0]}'; cite a key of docs/references.md or an id of docs/methods"


@pytest.mark.long
def test_every_key_is_in_the_bibliography() -> None:
    keys = r"\b[A-Z][a-z]+ (?:19|20)\d\d\b(?!-)|\bGSP ch\. \d|\bIEEE \d+|\bISO(?:/IEC)? \d+|\bTR ?\d{4}\.\d"
    cited_keys: set[str] = set()
    for file in files():
        if file.name in ("references.md", "LICENSE") or file == Path(__file__):
            continue
        for key in re.findall(keys, read(file)):
            if key.split()[0] not in (*calendar.month_name, "Std"):
                assert key in bibliography(), f"{file}: {key} is not in docs/references.md"
                cited_keys.add(key)
    assert {"Hu 1981", "Xia 2008", "Dong 2014", "GSP ch. 5"} <= cited_keys


def test_entries_say_who_what_and_when() -> None:
    for key, entry in bibliography().items():
        assert len(entry) > 40 and not re.search(r"[\u4e00-\u9fff]", entry), key  # Latin letters: every font has them
        year = re.search(r"(?:19|20)\d\d", key)
        assert not year or year[0] in entry, key


# ------------------------------------------------------------------------------------------------ ids
def named(text: str) -> Iterator[str]:
    """Ids in a text, those that go on from the one before included: "STAB-SDF-INT, -RATE", "GYRO-STATIC-8/-9"."""
    going_on = r"(?:(?:,? and |, |/) ?-[A-Z0-9]+)*"
    for whole in re.finditer(rf"(?<![\w./\-]){ID}{going_on}(?![\w*-])", text):
        first, *more = re.findall(rf"{ID}|(?<!\w)-[A-Z0-9]+", whole[0])
        if first not in WORDS and not re.fullmatch(rf"{ERRATUM}-(?:E[RTXAG]?)?\d+|A\d+-A?\d+", first):
            yield first
            parts = first.split("-")
            for tail in more:
                for kept in range(len(parts), 0, -1):
                    if "-".join(parts[:kept]) + tail in headings():
                        break
                else:
                    kept = len(parts)
                yield "-".join(parts[:kept]) + tail


def test_every_id_has_a_heading() -> None:
    missing: dict[str, str] = {}
    for file in files():
        if file != Path(__file__):
            for name in named(read(file)):
                if name not in headings():
                    missing.setdefault(name, str(file.relative_to(ROOT)))
    assert not missing, f"no heading in docs/methods: {missing}"


@pytest.mark.long
def test_what_stands_in_brackets_resolves() -> None:
    """[ACC; Hu 1981, eq. 3-38]: single words, too, are ids, keys or errata."""
    for file in files("components", "gyrobench", "systems", "tests"):
        if file.suffix not in (".py", ".md"):
            continue
        for bracket in re.findall(r"\[([^\[\]]{2,300})\]", prose(file)):
            if "..." in bracket or bracket.startswith("-"):  # words of a command
                continue
            for word in re.split(r"[;,\s]+", bracket):
                if re.fullmatch(r"[A-Z][A-Z0-9]{2,}", word):
                    known = word in headings() | errata().keys() or any(word in key.split() for key in bibliography())
                    assert known, f"{file}: [{bracket}]: {word} has no heading in docs/methods"


def test_ids_have_one_heading_each() -> None:
    names = [
        name.strip()
        for page in (DOCS / "methods").glob("*.md")
        for line in re.findall(r"^#{2,3} ([^:\n]+):", read(page), flags=re.M)
        for name in line.split(",")
    ]
    assert len(names) == len(set(names)), sorted({n for n in names if names.count(n) > 1})


@pytest.mark.parametrize("page", sorted((DOCS / "methods").glob("[!R]*.md")), ids=lambda p: p.stem)
def test_methods_name_their_source_code_tests_and_limits(page: Path) -> None:
    sections = re.split(r"^## ", read(page), flags=re.M)[1:]
    assert sections and len(read(page).splitlines()) < 400
    for section in sections:
        for word in ("Source", "Code", "Tests", "Limits"):
            assert f"**{word}**" in section, f"{page.name}, {section.splitlines()[0]}: no {word}"
    for path in re.findall(r"`((?:components|systems|gyrobench|tests)/[\w/.]+)`", read(page)):
        assert (ROOT / path).exists(), f"{page.name}: {path} does not exist"


# ------------------------------------------------------------------------------------------------ errata
def test_errata_are_numbered_without_gaps() -> None:
    for prefix in ("E", "ER", "ET", "EX", "EA", "EG"):
        numbers = [int(n[len(prefix) :]) for n in errata() if re.fullmatch(rf"{prefix}\d+", n)]
        assert numbers == list(range(1, len(numbers) + 1)), prefix
    assert "E54" in errata() and "E55" not in errata()


def test_errata_say_what_is_right_and_which_test_shows_it() -> None:
    for number, cells in errata().items():
        assert len(cells) == 6 and all(cells), f"{number}: no., where, printed, right, why, test"
        if cells[5] == "–":
            continue
        file, _, test = cells[5].strip("`").partition("::")
        assert f"\ndef {test}(" in read(ROOT / "tests" / file), f"{number}: {cells[5]}"


def test_tests_of_errata_are_named_there() -> None:
    """A test whose docstring begins with an erratum's number shows that erratum: the page says so."""
    for file in files("tests/spec"):
        for number in re.findall(rf'"""({ERRATUM}): ', read(file)):
            assert number in errata(), f"{file}: {number}"


@pytest.mark.long
def test_every_erratum_that_is_cited_exists() -> None:
    for file in files("components", "docs", "gyrobench", "systems"):
        if file.suffix in (".py", ".md"):
            for number in re.findall(rf"\b{ERRATUM}\b", prose(file)):
                assert number in errata(), f"{file}: {number}"


# ------------------------------------------------------------------------------------------------ report
def test_a_report_prints_its_sources_in_full() -> None:
    text, works = source_blocks(["TEST-8POS; Hu 1981, eq. 3-1..3-11, corrected by E17", "E_n: ISO 13528"])
    assert text.text.startswith("Sources: TEST-8POS; Hu 1981, eq. 3-1..3-11") and "docs/errata.md" in text.text
    assert works.items[0].startswith("Hu 1981: Hu Hengzhang (ed.), ") and works.items[0].endswith("Beijing, 1981.")
    assert works.items[1].startswith("ISO 13528, Statistical methods") and len(works.items) == 2
    assert source_blocks([]) == [] and len(source_blocks(["own derivation"])) == 1
    assert cited(["Hu 19811", "Welch 1951"]).keys() == {"Welch 1951"}


def stated(tree: ast.AST) -> Iterator[str]:
    """Texts of ``sources=[...]``, ``sources = (...)`` and ``SOURCES = [...]``."""
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg == "sources":
            value: ast.AST = node.value
        elif isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "").lower() == "sources":
            value = node.value
        else:
            continue
        if isinstance(value, ast.List | ast.Tuple):
            yield from (e.value for e in value.elts if isinstance(e, ast.Constant))


@pytest.mark.long
def test_every_source_of_a_system_cites_a_work() -> None:
    found = [(f, text) for f in files("systems") if f.suffix == ".py" for text in stated(ast.parse(read(f)))]
    assert len(found) > 30
    for file, text in found:
        assert cited([text]) or "own" in text, f"{file}: '{text}' cites no work of docs/references.md"
