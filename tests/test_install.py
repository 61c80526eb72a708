"""The built wheel in an empty environment: lists, runs, reports and makes benches without the checkout."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
NAME = "tumble_single_axis"
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
TINY = ["--set", "rate=30deg/s", "--set", "dwell=2", "--set", "settle=0.5", "--set", "windows=12"]
HERE = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    done = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def command(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """``gyrobench`` of an environment that holds the wheel; its dependencies are borrowed, the checkout is not."""
    folder = tmp_path_factory.mktemp("empty") / "v"
    venv.create(folder, with_pip=False, symlinks=os.name == "posix")
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    site = Path(
        subprocess.run(
            [str(python), "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
    )
    # a line in a .pth file is a path of modules; the .pth files there (an editable install) are not read again
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", str(python), "install", "--quiet"]
    subprocess.run([*pip, "--no-deps", "--no-index", str(wheel)], check=True, env=HERE)
    return python.with_name("gyrobench" + (".exe" if os.name == "nt" else ""))


def run(command: Path, folder: Path, *words: str) -> str:
    done = subprocess.run([str(command), *words], cwd=folder, capture_output=True, text=True, check=False, env=HERE)
    assert done.returncode == 0, done.stderr
    assert str(ROOT) not in done.stdout + done.stderr
    return done.stdout


def test_the_wheel_holds_tool_and_standard_bench(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        inside = {n for n in archive.namelist() if not n.endswith("/")}
    tool = {str(f.relative_to(ROOT)) for f in (ROOT / "gyrobench").rglob("*") if f.suffix in (".py", ".c", ".h")}
    assert tool <= inside
    for room in ("components", "systems", "docs", "reports/specs", "reports/templates"):
        files = [f for f in (ROOT / room).rglob("*") if f.is_file() and "__pycache__" not in f.parts]
        assert files and {f"gyrobench/_bench/{f.relative_to(ROOT)}" for f in files} <= inside
    assert {"gyrobench/_bench/reports/result.schema.json", "gyrobench/py.typed"} <= inside
    odd = [n for n in inside if re.search(r"__pycache__|/out/|\.fmu$|^(tests|fmus)/|\.pyc$", n)]
    assert not odd


def test_lists_shows_runs_and_reports_without_the_checkout(command: Path, tmp_path: Path) -> None:
    assert run(command, tmp_path, "--version") == f"gyrobench {VERSION}\n"
    found = json.loads(run(command, tmp_path, "list", "--json"))
    folders = {r["folder"] for title in ("parts", "systems") for r in found[title]}
    assert all(f.startswith(str(command.parents[1])) for f in folders)
    assert "plan: " in run(command, tmp_path, "show", NAME)
    text = run(command, tmp_path, "run", NAME, *TINY, "--spec", "floated_gyro", "--out", "r")
    assert text.endswith("r/result.json\nr/report.html\nr/report.pdf\n")
    assert "D_IS" in run(command, tmp_path, "report", "r")
    assert (tmp_path / "r" / "report.pdf").read_bytes().startswith(b"%PDF")
    assert run(command, tmp_path, "build", "site") == "fmus/site.fmu\n"
    assert run(command, tmp_path, "export", NAME, "--to", "ssp", "--out", "t.ssp") == "t.ssp\n"
    assert "polarity" in run(command, tmp_path, "reduce", NAME, "--template")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["fmus", "r", "t.ssp"]


def test_a_copied_part_can_be_changed_built_and_run(command: Path, tmp_path: Path) -> None:
    """In the copy the mass unbalance D_S acts twice as much as its parameter says; the test of it must find that."""
    assert "a copy; change its model.py" in run(command, tmp_path, "init", "mine", "--copy", "floated_gyro")
    bench = tmp_path / "mine"
    model = bench / "components" / "floated_gyro" / "model.py"
    text = model.read_text(encoding="utf-8")
    changed = text.replace("self.D_S * (", "2.0 * self.D_S * (")
    assert changed != text
    model.write_text(changed, encoding="utf-8")
    assert run(command, bench, "build", "floated_gyro") == "fmus/floated_gyro.fmu\n"
    quiet = [w for n in ("turn_on", "markov", "white", "pickoff") for w in ("--set", f"gyro.{n}=0")]
    run(command, bench, "run", NAME, *TINY, *quiet, "--set", "gyro.D_S=0.4deg/h/g", "--out", "r")
    found = json.loads((bench / "r" / "result.json").read_text(encoding="utf-8"))
    d = {c["name"]: c for c in found["coefficients"]}
    assert d["D_S"]["truth"] == pytest.approx(0.4)
    assert d["D_S"]["estimate"] == pytest.approx(0.8, abs=0.05)
    assert d["D_I"]["estimate"] == pytest.approx(d["D_I"]["truth"], abs=0.05)


def declared() -> dict[str, str]:
    """Requirements of the project and its extras: name -> the whole."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    every = [*project["dependencies"], *(r for extra in project["optional-dependencies"].values() for r in extra)]
    return {re.split(r"[<>=!\[ ;]", r)[0].lower(): r for r in every}


def test_licences_of_all_packages_are_listed() -> None:
    rows = re.findall(r"^\| ([^|]+) \| [^|]+ \| [^|]+ \|$", (ROOT / "docs/licences.md").read_text("utf-8"), re.M)
    listed = {name.strip().lower() for row in rows for name in row.split(",")} - {"package", "---"}
    assert listed == set(declared())


def test_constraints_are_within_the_requirements() -> None:
    """A version for every package but ziglang, whose wheel of 90 MB the tests do without."""
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    pinned = {canonicalize_name(n): v for n, v in (line.split("==") for line in lines if not line.startswith("#"))}
    for name, requirement in declared().items():
        if name != "ziglang":
            assert Requirement(requirement).specifier.contains(pinned[canonicalize_name(name)]), requirement
