"""The pages: no dead link, figures as in docs/figures.toml, picture and changelog of this version."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.version import Version
from PIL import Image

import gyrobench as gb

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "docs"), str(ROOT / "docs" / "site"), str(ROOT / "reports")]
import docstrings  # noqa: E402
import equations  # noqa: E402
import figures  # noqa: E402
import front_picture  # noqa: E402
import links  # noqa: E402
import notebook  # noqa: E402

PAGES = links.pages(ROOT)
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]


# ------------------------------------------------------------------------------------------------ links
def test_no_link_is_dead() -> None:
    assert len(PAGES) > 170 and sum(len(links.links(p.read_text(encoding="utf-8"))) for p in PAGES) > 300
    problems = [problem for page in PAGES for problem in links.dead(page)]
    assert not problems, "\n".join(problems)


def test_dead_links_are_found(tmp_path: Path) -> None:
    (tmp_path / "there.md").write_text("# A heading, of `code`\n\n## Twice\n\n## Twice\n", encoding="utf-8")
    page = tmp_path / "page.md"
    page.write_text(
        "# Here\n[a](there.md#a-heading-of-code) [b](there.md#twice-1) [c](#here) `[d](no.md)`\n\n    [e](no.md)\n\n"
        "```\n[f](no.md)\n```\n[g](no.md) [h](there.md#none) ![i](no.svg)\n[![j](no.png)](there.md)\n",
        encoding="utf-8",
    )
    found = [problem.partition("page.md:")[2] for problem in links.dead(page)]
    assert found == [
        "9: no.md: there is no such file",
        "9: there.md#none: the page has no heading of this name",
        "9: no.svg: there is no such file",
        "10: no.png: there is no such file",
    ]


def test_every_page_of_docs_is_in_its_list() -> None:
    listed = {target for _, target in links.links((ROOT / "docs" / "README.md").read_text(encoding="utf-8"))}
    pages = {str(p.relative_to(ROOT / "docs")) for p in (ROOT / "docs").rglob("*.md")}
    assert {p for p in pages if not p.startswith("methods/") and p != "README.md"} <= listed


# ------------------------------------------------------------------------------------------------ figures
def test_quoted_figures_are_those_of_the_file() -> None:
    known = figures.load()
    quoted: set[str] = set()
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        quoted |= set(figures.keys(text))
        assert figures.put(text, known) == text, f"{page}: python docs/figures.py --write"
        assert not re.search(r"^\s*<!--(fig|/)", text, re.M), f"{page}: a line that begins with a mark is no prose"
    assert quoted == set(known), "figures that no page quotes"


def test_figures_say_how_they_were_measured(tmp_path: Path) -> None:
    known = figures.load()
    for key, entry in known.items():
        assert tuple(entry) == figures.FIELDS, key
        program, script = entry["command"].split()[:2]
        assert program == "python" and (ROOT / script).is_file(), key
        assert Version(entry["version"]) <= Version(VERSION), f"{key}: measured at a later version"
    copy = tmp_path / "figures.toml"
    figures.dump(known, copy)
    assert figures.load(copy) == known


def test_another_figure_is_put_into_its_places() -> None:
    """A number in a text, and a row whose cells follow the heads of its columns, whatever their order."""
    page = (
        "x <!--fig a.b-->1.0<!--/-->\n\n| | q | p |\n|---|---|---|\n| row <!--row a.c--> | 1 | 2 |\n| other | 1 | 2 |\n"
    )
    known = {"a.b": {"value": "2.5"}, "a.c": {"value": {"p": "30", "q": "40"}}}
    assert figures.put(page, known) == page.replace("1.0", "2.5").replace("--> | 1 | 2 |", "--> | 40 | 30 |")
    assert figures.keys(page) == ["a.b", "a.c"]


# ------------------------------------------------------------------------------------------------ version
def test_the_picture_of_the_readme_is_of_this_version() -> None:
    with Image.open(front_picture.FILE) as picture:
        said = {name: picture.info.get(name) for name in ("gyrobench", "command")}
    assert said == {**front_picture.written_by(), "gyrobench": VERSION}, "python reports/front_picture.py"


def test_the_changelog_begins_with_this_version() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    heads = re.findall(r"^## (\S+)", text, re.M)
    assert heads[0] == VERSION and [Version(h) for h in heads] == sorted(map(Version, heads), reverse=True)
    for bullet in re.findall(r"^- (?:.*\n)(?:  .*\n)*", text, re.M):
        assert bullet.count("\n") <= 2, bullet


def test_the_citation_is_of_this_version() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^(version|license): (\S+)$", text, re.M) == [("version", VERSION), ("license", "BSD-3-Clause")]


def test_public_names_have_docstrings() -> None:
    assert [name for name in gb.__all__ if not (getattr(gb, name).__doc__ or "").strip()] == []


# ------------------------------------------------------------------------------------------------ site
def test_docstrings_become_restructured_text() -> None:
    """Marks of prose are escaped, roles and literals kept, what is set in stands as it is."""
    lines = ["A *vector* x_ of :func:`f`, ``a*b`` and `c`:", "", "    k i = w_I | d", "", "- one", "  two", "1.  three"]
    assert docstrings.restructured(lines) == [
        r"A \*vector\* x\_ of :func:`f`, ``a*b`` and ``c``:",
        "",
        ".. code-block:: text",
        "",
        "        k i = w_I | d",
        "",
        "- one two",
        "",
        "#. three",
        "",
    ]


def test_equations_have_subscripts_and_keep_their_columns() -> None:
    """_IO takes three columns, a low IO 2 x 0.72: the gap that follows is 1.56 columns wider."""
    block = '<div class="highlight-none notranslate"><pre>D_IO = 1   u_angle1\nb  c</pre></div>'
    low = 'D<span class="line">_</span><sub>IO</sub> = 1   <span class="gap" style="width:1.56ch"></span>u_angle1'
    assert equations.with_subscripts(block) == block.replace("D_IO = 1   u_angle1", low)
    command = block.replace("D_IO", "gyrobench run D_IO")
    assert equations.with_subscripts(command) == command and equations.with_subscripts("<p>D_IO</p>") == "<p>D_IO</p>"


def test_the_notebook_has_the_outputs_of_its_code() -> None:
    """Stored by docs/site/notebook.py --write; each cell shows something, the tumble curve is a picture."""
    stored = json.loads(notebook.FILE.read_text(encoding="utf-8"))
    assert stored["metadata"]["gyrobench"]["sources"] == notebook.sources(stored), "its code has changed since"
    assert (stored["nbformat"], stored["nbformat_minor"]) == (4, 5)  # since then each cell has an "id"
    assert len({c["id"] for c in stored["cells"]}) == len(stored["cells"])
    cells = [c for c in stored["cells"] if c["cell_type"] == "code"]
    assert all(c["outputs"] for c in cells) and [c["execution_count"] for c in cells] == [*range(1, len(cells) + 1)]
    assert sum("image/png" in o.get("data", ()) for c in cells for o in c["outputs"]) == 1
    page = notebook.markdown(notebook.FILE)
    assert page.count("```python") == len(cells) and page.count('class="output"') == len(cells)
    assert "pandas" in page and "jupyter lab" in page


def test_a_cell_shows_what_it_prints_and_its_last_value() -> None:
    names: dict[str, object] = {}
    assert notebook.shown("a = 2", names) == []
    printed, value = notebook.shown("print('<x>')\na + 1", names)
    assert notebook.html(printed) == "<pre>&lt;x&gt;\n</pre>" and value["data"]["text/plain"] == ["3"]
    figure = notebook.shown("import matplotlib.pyplot as plt\nplt.figure()", names)[0]
    assert notebook.html(figure).startswith('<img alt="figure" src="data:image/png;base64,iVBOR')


@pytest.mark.long
@pytest.mark.skipif(
    not all(map(importlib.util.find_spec, ("myst_parser", "furo"))), reason='needs the extra: pip install -e ".[docs]"'
)
def test_the_site_is_built_without_a_warning_and_without_network(tmp_path: Path) -> None:
    command = [sys.executable, str(ROOT / "docs/site/build.py"), "--out", str(tmp_path / "site")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    listed = re.findall(r'href="(live/\w+\.html)"', (tmp_path / "site" / "live.html").read_text(encoding="utf-8"))
    assert len(listed) >= 5 and all((tmp_path / "site" / name).is_file() for name in listed)
    for page in (tmp_path / "site").rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r"<(?:script|img|link|iframe|source)[^>]*?(?:src|href)=[\"'](https?:)?//[^\"']*", text)
        assert not loaded, f"{page}: {loaded}"
