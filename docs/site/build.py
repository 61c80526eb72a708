"""Build the documentation site:  python docs/site/build.py [--out build/site]

Copies the Markdown pages and what they link to, adds a page for each module of gyrobench, the notebook with its outputs
and systems that run in a page, and runs Sphinx in strict mode.  Nothing is fetched: neither here nor by an opened page.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from links import LINK, links, pages, prose
from live import PAGE, export_live, live_page
from notebook import markdown

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
NOTEBOOK = Path("docs/guides/first_runs.ipynb")

#: caption of the sidebar -> pages in their order, by pattern
CONTENTS = {
    "Guides": ["docs/guides/first_runs", "docs/guides/*"],
    "Tests and loops": ["live", "docs/tests_and_loops", "docs/shared_options", "docs/gallery", "systems/*/README"],
    "Parts": ["docs/parts", "docs/shared_ports", "components/*/README"],
    "Methods": ["docs/methods/README", "docs/methods/*", "docs/verdict", "docs/errata", "docs/references"],
    "Reference": ["docs/systems", "docs/public_interface", "instruments/README", "reports/README", "fmus/README"],
    "Python API": ["api/gyrobench", "api/*"],
    "Figures": [
        "docs/speed",
        "docs/validation",
        "docs/worked_examples",
        "docs/real_records",
        "docs/data_sheets",
        "docs/heading_after_minutes",
        "docs/mistakes_of_a_record",
        "tests/benchmarks/README",
        "tests/spec/README",
    ],
    "Project": ["CONTRIBUTING", "docs/architecture", "CHANGELOG", "docs/licences", "docs/README"],
}


def modules() -> dict[str, Path]:
    """Return the modules of gyrobench that are documented, by name."""
    found = {}
    for file in sorted((ROOT / "gyrobench").rglob("*.py")):
        parts = file.relative_to(ROOT).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        if not any(part.startswith("_") for part in name.split(".")):
            found[name] = file
    return found


def rewritten(page: Path, text: str) -> str:
    """Return a page whose links to folders and modules lead to pages of the site."""

    def place(match: re.Match[str]) -> str:
        target = match[3]
        if re.match(r"[a-z]+:|#", target):
            return match[0]
        file = Path(os.path.normpath(page.parent / target.partition("#")[0]))
        inside = file.relative_to(ROOT)
        if inside.parts[:1] == ("gyrobench",) and (file.is_dir() or file.suffix == ".py"):
            package = inside if file.is_dir() else inside.parent
            to = ROOT / "api" / f"{'.'.join(package.parts)}.rst"
        elif file.is_dir():
            to = file / "README.md"
        elif inside == NOTEBOOK:
            to = file.with_suffix(".md")
        else:
            return match[0]
        return match[0].replace(f"({target})", f"({os.path.relpath(to, page.parent)})")

    bare = prose(text)
    out, end = [], 0
    for match in LINK.finditer(bare):
        out += [text[end : match.start()], place(LINK.match(text, match.start()) or match)]
        end = match.end()
    return "".join([*out, text[end:]])


def write(file: Path, text: str) -> None:
    """Write a file where its text differs: Sphinx reads again what is newer."""
    if not file.is_file() or file.read_text(encoding="utf-8") != text:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")


def api(source: Path, written: set[Path]) -> None:
    """Write a page for each package, with its modules one after the other."""
    every = modules()
    packages = [name for name, file in every.items() if file.name == "__init__.py"]
    for package in packages:
        text = f"{package}\n{'=' * len(package)}\n\n"
        if package == "gyrobench":
            text += ".. toctree::\n   :maxdepth: 1\n\n" + "".join(f"   {p}\n" for p in packages[1:]) + "\n"
        text += f".. automodule:: {package}\n   :no-members:\n\n"
        for name, file in every.items():
            if file.name != "__init__.py" and name.rpartition(".")[0] == package:
                short = name.removeprefix("gyrobench.")
                text += f"{short}\n{'-' * len(short)}\n\n.. automodule:: {name}\n\n"
        written.add(source / "api" / f"{package}.rst")
        write(source / "api" / f"{package}.rst", text)


def contents(source: Path, written: set[Path]) -> str:
    """Return the tables of contents, of every page that was written, once."""
    left = sorted(str(p.relative_to(source).with_suffix("")) for p in written)
    text = []
    for caption, patterns in CONTENTS.items():
        names: list[str] = []
        for pattern in patterns:
            fit = [n for n in left if Path(n).match(pattern) and n.count("/") == pattern.count("/")]
            names += [n for n in fit if n not in names]
        text += ["", "```{toctree}", ":hidden:", f":caption: {caption}", "", *names, "```", ""]
    return "\n".join(text)


def stage(source: Path) -> None:
    """Copy pages and what they link to into the folder that Sphinx reads, and remove what is no longer there."""
    written: set[Path] = set()
    for page in pages(ROOT):
        text = page.read_text(encoding="utf-8")
        for _, target in links(text):
            file = page.parent / target.partition("#")[0]
            if file.is_file() and file.suffix not in (".md", ".ipynb"):
                copy = source / Path(os.path.normpath(file)).relative_to(ROOT)
                copy.parent.mkdir(parents=True, exist_ok=True)
                if not copy.is_file() or copy.stat().st_mtime != file.stat().st_mtime:
                    shutil.copy2(file, copy)
        copy = source / page.relative_to(ROOT)
        written.add(copy)
        if page != ROOT / "README.md":
            write(copy, rewritten(page, text))
    api(source, written)
    copy = source / NOTEBOOK.with_suffix(".md")
    write(copy, markdown(ROOT / NOTEBOOK))
    written.add(copy)
    write(source / PAGE, live_page())
    written.add(source / PAGE)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    write(source / "README.md", rewritten(ROOT / "README.md", readme) + contents(source, written))
    for old in (*source.rglob("*.md"), *source.rglob("*.rst")):
        if old not in written:
            old.unlink()


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    options.add_argument("--out", type=Path, default=ROOT / "build" / "site")
    given = options.parse_args()
    source = given.out.with_name(given.out.name + "-source")
    stage(source)
    # not by -W: with it a warning ends Sphinx while its workers still write to it, and both wait for ever
    warnings = source / "warnings.txt"
    command = [sys.executable, "-m", "sphinx", "-q", "-j", "auto", "-w", str(warnings), "-b", "html", "-c", str(HERE)]
    done = subprocess.run([*command, str(source), str(given.out)], check=False)
    if done.returncode or warnings.read_text(encoding="utf-8").strip():
        return done.returncode or 1
    shutil.copy(given.out / "README.html", given.out / "index.html")
    if problems := export_live(given.out / "live"):
        print(*problems, sep="\n", file=sys.stderr)
        return 1
    print(given.out / "index.html")
    return 0


if __name__ == "__main__":
    sys.exit(main())
