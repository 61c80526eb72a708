"""A new test method from a family, in a bench of one's own: the file of the guide, from the folder to the report."""

from __future__ import annotations

import importlib
import json
import math
import shutil
import sys
import typing
from pathlib import Path

import pytest
from commanding import Command

from gyrobench.bench import Bench, UsageError, standard_folder
from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.result import Result
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.families.option_groups import SITE, type_b
from gyrobench.system.families.rebalance_test import RebalanceTest
from gyrobench.system.suite import Suite, load_test
from gyrobench.system.system import System, load_system
from gyrobench.workflow.catalog import init_bench

EXAMPLE = standard_folder() / "docs" / "guides" / "own_test" / "system.py"
NAME = "six_position"


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A new bench with the example as its only system."""
    folder = tmp_path / "mine"
    init_bench(folder, [])
    (folder / "systems" / NAME).mkdir(parents=True)
    shutil.copy(EXAMPLE, folder / "systems" / NAME)
    monkeypatch.chdir(folder)
    return folder


def test_it_is_short() -> None:
    assert len(EXAMPLE.read_text("utf-8").splitlines()) <= 40


@pytest.mark.long
def test_from_a_folder_to_a_report(bench: Path, command: Command) -> None:
    """Six coefficients of the standard gyro with their uncertainties; halving the step changes none of them."""
    code, out, err = command("run", NAME, "--set", "u_scale_factor=1e-4", "--check-step", "--seed", 4, pages=True)
    assert code == 0, err
    (folder,) = (bench / "reports" / "out" / NAME).iterdir()
    assert (folder / "report.pdf").stat().st_size > 10_000 and "misses" not in out
    result = json.loads((folder / "result.json").read_text("utf-8"))
    found = {c["name"]: c for c in result["coefficients"]}
    assert list(found) == ["D_F", "D_I", "D_O", "D_S", "D_II", "D_SS"]
    assert found["D_I"]["truth"] == pytest.approx(-0.9) and found["D_I"]["unit"] == "°/h/g"
    assert all(abs(c["z"]) < 4.0 and 1e-4 < c["u"] < 5e-3 for c in found.values())
    assert {line["id"] for line in result["budget"]} >= {"torquer.scale_factor", "type_a"}
    assert result["step_check"]["worst"] < 1e-3
    page = (folder / "report.html").read_text("utf-8")
    assert "Six-position test" in page and "mass unbalance along the spin axis" in page


@pytest.mark.long
def test_what_comes_along_from_the_family(bench: Path, command: Command) -> None:
    """Options, checks, order of execution and set-up errors, without a word of them in the file."""
    code, out, _ = command("show", NAME)
    assert code == 0
    for text in ("latitude", "45.75°", "torquer scale factor for the reduction", "delayed wires", "N -E"):
        assert text in out
    code, _, err = command("run", NAME, "--set", "gravity=9.5m/s2")
    assert code == 2 and "gravity 9.5 m/s² lies outside 9.7..9.9 m/s²" in err
    code, _, err = command("run", NAME, "--set", "gyro.mount=[[1,0,0],[0,1,0],[0,0,-1]]")
    assert code == 2 and "gyro.mount: determinant is -1" in err
    code, out, _ = command("run", NAME, "--set", "site.latitude=0deg", "--set", "dwell=100s")
    assert code == 0
    assert "misses the simulated truth" in out and "site.latitude = 0°, while plan and reduction assume 45.75°" in out


def test_a_family_without_parts_is_refused(bench: Path, command: Command) -> None:
    file = bench / "systems" / NAME / "system.py"
    line = next(n for n in file.read_text("utf-8").splitlines() if "with_parts" in n)
    file.write_text(file.read_text("utf-8").replace(line, line.replace('gyro="floated_gyro", ', "")), encoding="utf-8")
    with pytest.raises(InvalidConfigurationError, match=r'slot gyro: no part; name it by with_parts\(gyro="..."\)'):
        load_system(NAME, bench)
    code, _, err = command("run", NAME)
    assert code == 2 and 'slot gyro: no part; name it by with_parts(gyro="...")' in err
    file.write_text(EXAMPLE.read_text("utf-8").replace("rebalance=", "balance="), encoding="utf-8")
    with pytest.raises(InvalidConfigurationError, match="no slot 'balance' in RebalanceTest; slots: site, sequencer"):
        load_system(NAME, bench)


@pytest.mark.parametrize("template, method", [("tumble_single_axis", "faces"), ("servo_polar", "holds")])
def test_what_a_family_leaves_to_the_test_is_asked_for(
    bench: Path, command: Command, template: str, method: str
) -> None:
    folder = bench / "systems" / NAME
    shutil.copytree(standard_folder() / "systems" / template, folder, dirs_exist_ok=True)
    source = (folder / "system.py").read_text("utf-8")
    (folder / "system.py").write_text(source.replace(f"def {method}(", f"def other_{method}("), encoding="utf-8")
    code, _, err = command("run", NAME)
    assert code == 2 and f"has no {method}(), which its family leaves to the test" in err


@pytest.mark.long
def test_the_reduction_has_set_up_effects_corrections_and_a_verdict(bench: Path, command: Command) -> None:
    """10 arcsec of the fixture's tilt about east turn the level input axes against the pole: the Earth rate along them
    changes by W sin(45.75 deg) 10 arcsec = 5.2e-4 deg/h where the input axis is north, which the attitudes take for
    drift.  Stated as measured it is taken out, and its u is in the budget.
    """
    system = load_system(NAME, bench)
    with Session(system) as session:
        record = session.run({"u_scale_factor": 1e-4, "u_level": "5arcsec"}, seed=4)
    limits = {"D_I": (-1.0, -0.8), "D_F": (0.0, 0.1), "D_S": (-0.70001, -0.69999)}
    plain = system.reduce(record, limits)
    assert [plain[n].verdict for n in limits] == ["pass", "fail", "inconclusive"] and plain.verdict == "fail"
    lines = {(line.id, line.coefficient): line for line in plain.budget}
    assert lines["torquer.scale_factor", "D_I"].contribution > 0.0 and ("fixture.level", "D_F") in lines
    (table,) = [t for t in plain.tables if t.kind == "nuisances"]
    assert {row[0] for row in table.rows} == {"trend", "ε_IO", "ε_IS", "k_±", "δk"}  # weighed, or why they are not
    options = {**record.run.options, "corrections": "fixture.level = 10(1) arcsec"}
    corrected = system.reduce(Record(record.windows, {}, record.run.replace(options=options)))
    line, arcsec = lines["fixture.level", "D_F"], math.pi / 648000.0
    shift = corrected["D_F"].estimate - plain["D_F"].estimate
    assert shift == pytest.approx(-10.0 * arcsec * line.sensitivity, rel=0.1)
    assert any(row[0] == "level of the fixture about east" for t in corrected.tables for row in t.rows)


def test_a_source_is_declared_in_one_place(bench: Path) -> None:
    """In the file of the test alone: its option, its line of the budget, the shift that is predicted of the
    part's value that simulates it, which two runs of one seed show, and the correction that takes it out again.
    """
    system, arcsec = load_system(NAME, bench), math.pi / 648000.0
    option = system.options["u_level"]
    assert (
        option.unit == "rad"
        and option.default == 0.0
        and option.doc == "standard uncertainty of the level of the fixture about east"
    )
    values = {"dwell": "100s", "u_level": "5arcsec"}
    with Session(system) as session:
        level, tilted = (session.run({**values, **more}, seed=2) for more in ({}, {"table.tilt[1]": "100arcsec"}))
    assert [e.parameter for e in tilted.run.setup_errors] == ["table.tilt[1]"]
    plain, off = system.reduce(level), system.reduce(tilted)
    line = next(x for x in off.budget if (x.id, x.coefficient) == ("fixture.level", "D_F"))
    assert line.size == pytest.approx(5.0 * arcsec) and abs(line.contribution) > 1e-4
    (table,) = [t for t in off.tables if t.id == "budget.predicted"]
    shift = {row[0]: row[1] for row in table.rows}
    assert abs(shift["D_F"]) > 1e-3
    for name in ("D_F", "D_II", "D_SS"):
        assert off[name].estimate - plain[name].estimate == pytest.approx(shift[name], rel=0.02, abs=1e-6)
    options = {**tilted.run.options, "corrections": "fixture.level = 100(1) arcsec"}
    corrected = system.reduce(Record(tilted.windows, {}, tilted.run.replace(options=options)))
    assert corrected["D_F"].estimate == pytest.approx(plain["D_F"].estimate, abs=0.05 * abs(shift["D_F"]))


def test_a_source_without_its_option_is_named(bench: Path) -> None:
    """A reduction in a module of its own is loaded late: its options stand in system.py."""
    text = EXAMPLE.read_text("utf-8")
    folder = bench / "systems" / NAME
    (folder / "sums.py").write_text(text.split("class SixPosition(")[0] + "\n\nReduction = SixPositionReduction\n")
    late = text.replace("reduction = SixPositionReduction", 'reduction = "sums"')
    (folder / "system.py").write_text(late, encoding="utf-8")
    with pytest.raises(
        UsageError, match=r"u_level is no option of it, in which level\(\) .* fixture.level. Write options"
    ):
        load_system(NAME, bench).reduction_object()


def test_a_source_that_nothing_would_use_is_refused(bench: Path) -> None:
    file = bench / "systems" / NAME / "system.py"
    file.write_text(EXAMPLE.read_text("utf-8").replace("(RestTest)", ""), encoding="utf-8")
    with pytest.raises(TypeError, match=r"declares the source fixture\.level by @Source and is no DriftReduction"):
        load_system(NAME, bench)


def test_what_the_skeleton_leaves_to_a_reduction_is_asked_for_before_a_run(bench: Path) -> None:
    file = bench / "systems" / NAME / "system.py"
    bare = EXAMPLE.read_text("utf-8").replace("(RestTest)", "(DriftReduction)").replace("import Source", "import *")
    file.write_text(bare, encoding="utf-8")
    with pytest.raises(InvalidConfigurationError, match=r"SixPositionReduction has no account\(\), which its family"):
        load_system(NAME, bench)


def test_the_declared_reduction_of_every_system_is_one() -> None:
    """Loaded late, it is not seen by the type checker where it is called: its signature is held here."""
    for name in Bench(standard_folder()).systems():
        test = load_test(name)
        if isinstance(test, Suite) or not test.reduction:
            continue
        assert test.has_reduction and type(test).reduce is System.reduce
        module = importlib.import_module(f".{test.reduction}", type(test).__module__)
        function = getattr(module, "Reduction", module).from_record
        hints = typing.get_type_hints(function, vars(sys.modules[function.__module__]))
        assert hints["record"] is Record and "specification" not in hints, name
        assert issubclass(hints["return"], Result), name


def test_a_declared_reduction_that_is_missing_is_refused(bench: Path) -> None:
    file = bench / "systems" / NAME / "system.py"
    file.write_text(
        EXAMPLE.read_text("utf-8").replace("reduction = SixPositionReduction", 'reduction = "sums"'), encoding="utf-8"
    )
    with pytest.raises(InvalidConfigurationError, match=r'reduction = "sums": no file sums.py in .*six_position'):
        load_system(NAME, bench)


def test_groups_of_options() -> None:
    assert SITE["latitude"].sets == "site.latitude" and set(SITE) <= set(RebalanceTest.options)
    sizes = type_b("current", mount="of the gyro in its fixture")
    assert sizes["u_current"].unit == "A" and sizes["u_mount"].doc == "of the gyro in its fixture"
    with pytest.raises(KeyError):
        type_b("temperature")
