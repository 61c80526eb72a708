"""The built wheel in an empty environment: what README and guides print works there, without the checkout.

tests/benchmarks/readme_commands.py runs commands of many seconds, and what the pages of parts and systems print, too;
test_printed_commands.py holds what those name against what there is.
"""

from __future__ import annotations

import json
import re
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from printed import declared, pages
from printed.reader import ROOT, Installed, Reader, build_wheel, install

NAME = "tumble_single_axis"
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
TINY = ["--set", "rate=30deg/s", "--set", "dwell=2", "--set", "settle=0.5", "--set", "windows=12"]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_wheel(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    return install(wheel, tmp_path_factory.mktemp("installed"))


def run(installed: Installed, folder: Path, *words: str) -> str:
    done = installed.run(folder, str(installed.command), *words)
    assert done.returncode == 0, done.stderr
    assert str(ROOT) not in done.stdout + done.stderr
    return done.stdout


@pytest.mark.long
def test_the_wheel_holds_tool_and_standard_bench(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        inside = {n for n in archive.namelist() if not n.endswith("/")}
    tool = {str(f.relative_to(ROOT)) for f in (ROOT / "gyrobench").rglob("*") if f.suffix in (".py", ".c", ".h")}
    assert tool <= inside
    for room in ("components", "systems", "docs", "instruments", "reports/specs", "reports/templates"):
        files = [f for f in (ROOT / room).rglob("*") if f.is_file() and "__pycache__" not in f.parts]
        assert files and {f"gyrobench/_bench/{f.relative_to(ROOT)}" for f in files} <= inside
    assert {"gyrobench/_bench/reports/result.schema.json", "gyrobench/py.typed"} <= inside
    odd = [n for n in inside if re.search(r"__pycache__|/out/|\.fmu$|^(tests|fmus)/|\.pyc$", n)]
    assert not odd


def test_nothing_of_the_checkout_is_in_use(installed: Installed, tmp_path: Path) -> None:
    """Modules and contents are those of the wheel; commands write what they say and nothing else."""
    assert run(installed, tmp_path, "--version") == f"gyrobench {VERSION}\n"
    found = json.loads(run(installed, tmp_path, "list", "--json"))
    folders = {r["folder"] for title in ("parts", "systems") for r in found[title]}
    assert all(f.startswith(str(installed.bench)) for f in folders)
    assert "plan: " in run(installed, tmp_path, "show", NAME)
    path = installed.run(tmp_path, str(installed.python), "-c", "import sys; print(sys.path)").stdout
    assert str(ROOT / "gyrobench") not in path and f"'{ROOT}'" not in path
    assert run(installed, tmp_path, "build", "site") == "fmus/site.fmu\n"
    assert [p.name for p in tmp_path.iterdir()] == ["fmus"]


@pytest.mark.long
def test_a_copied_part_can_be_changed_built_and_run(installed: Installed, tmp_path: Path) -> None:
    """In the copy the mass unbalance D_S acts twice as much as its parameter says; the test of it must find that."""
    assert "a copy; change its model.py" in run(installed, tmp_path, "init", "mine", "--copy", "floated_gyro")
    bench = tmp_path / "mine"
    model = bench / "components" / "floated_gyro" / "model.py"
    text = model.read_text(encoding="utf-8")
    changed = text.replace("self.D_S * (", "2.0 * self.D_S * (")
    assert changed != text
    model.write_text(changed, encoding="utf-8")
    assert run(installed, bench, "build", "floated_gyro") == "fmus/floated_gyro.fmu\n"
    quiet = [w for n in ("turn_on", "markov", "white", "pickoff") for w in ("--set", f"gyro.{n}=0")]
    run(installed, bench, "run", NAME, *TINY, *quiet, "--set", "gyro.D_S=0.4deg/h/g", "--out", "r")
    found = json.loads((bench / "r" / "result.json").read_text(encoding="utf-8"))
    d = {c["name"]: c for c in found["coefficients"]}
    assert d["D_S"]["truth"] == pytest.approx(0.4)
    assert d["D_S"]["estimate"] == pytest.approx(0.8, abs=0.05)
    assert d["D_I"]["estimate"] == pytest.approx(d["D_I"]["truth"], abs=0.05)


@pytest.mark.parametrize("page", pages.READ_FIRST)
@pytest.mark.long
def test_a_page_does_what_it_prints(page: str, installed: Installed, tmp_path: Path) -> None:
    reader = Reader(installed, page, tmp_path / "reader")
    for step in reader.steps:
        if not declared.is_any((*declared.NOT_RUN, *declared.LONG), step.text):
            reader.follow(step)


def requirements() -> dict[str, str]:
    """Requirements of the project and its extras: name -> the whole."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    every = [*project["dependencies"], *(r for extra in project["optional-dependencies"].values() for r in extra)]
    return {re.split(r"[<>=!\[ ;]", r)[0].lower(): r for r in every}


def test_licences_of_all_packages_are_listed() -> None:
    rows = re.findall(r"^\| ([^|]+) \| [^|]+ \| [^|]+ \|$", (ROOT / "docs/licences.md").read_text("utf-8"), re.M)
    listed = {name.strip().lower() for row in rows for name in row.split(",")} - {"package", "---"}
    assert listed == set(requirements())


def test_constraints_are_within_the_requirements() -> None:
    """A version for every package."""
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    pinned = {canonicalize_name(n): v for n, v in (line.split("==") for line in lines if not line.startswith("#"))}
    for name, requirement in requirements().items():
        assert Requirement(requirement).specifier.contains(pinned[canonicalize_name(name)]), requirement
