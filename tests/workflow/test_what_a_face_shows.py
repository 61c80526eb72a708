"""Parts that fit a slot, systems by purpose, the list of runs: what a face of the bench shows."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gyrobench.bench import Bench, standard_folder
from gyrobench.packaging import build
from gyrobench.system.binding import SocketMismatchError, fit
from gyrobench.system.fmu_variables import read_description
from gyrobench.system.sockets import SOCKETS, socket
from gyrobench.system.system import System
from gyrobench.workflow.catalog import init_bench
from gyrobench.workflow.fitting_parts import fitting_parts, load_parts, mismatch, settable
from gyrobench.workflow.gallery import PURPOSES, gallery
from gyrobench.workflow.inputs import load_test
from gyrobench.workflow.run_list import list_runs

BENCH = Bench(standard_folder())


@pytest.mark.long
def test_every_part_fits_the_slot_it_is_in() -> None:
    parts = load_parts(BENCH)
    assert set(parts) == set(BENCH.parts())
    count = 0
    for name in BENCH.systems():
        test = load_test(name)
        for slot, declared in test.all_slots().items() if isinstance(test, System) else ():
            wanted = socket(declared.socket).standing_for(declared.quantities)
            assert mismatch(wanted, parts[declared.part], slot) == [], f"{name}.{slot}"
            count += 1
    assert count > 200


@pytest.mark.parametrize("name", ["floated_gyro", "table_servo", "rebalance_two_axis", "platform_three_axis"])
def test_a_declaration_fits_where_its_fmu_fits(name: str) -> None:
    """Against the description that the FMU itself has, for all sockets."""
    part, description = load_parts(BENCH)[name], read_description(build(name, target="python"))
    fits = 0
    for wanted in SOCKETS.values():
        try:
            fit(wanted, description)
            there = True
        except SocketMismatchError:
            there = False
        assert (mismatch(wanted, part) == []) == there, wanted.name
        fits += there
    assert 0 < fits < len(SOCKETS)


def test_menus_hold_what_fits_and_what_can_be_set() -> None:
    system = load_test("tumble_single_axis")
    assert isinstance(system, System)
    parts = load_parts(BENCH)
    menus = fitting_parts(system, parts)
    assert menus["gyro"][0] == "floated_gyro" and "compliant_gyro" in menus["gyro"]
    assert "gyro_2dof" not in menus["gyro"] and "surroundings" in menus
    assert {"H", "D_I", "white"} <= set(settable(parts["floated_gyro"]))
    assert "omega" not in settable(parts["floated_gyro"])


def test_the_gallery_holds_every_system_and_says_what_does_not_load(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    init_bench(tmp_path / "mine", [])
    monkeypatch.chdir(tmp_path / "mine")
    (tmp_path / "mine" / "systems" / "broken").mkdir()
    (tmp_path / "mine" / "systems" / "broken" / "system.py").write_text("x = 1 / 0\n")
    entries = {e.name: e for e in gallery(Bench.find())}
    assert set(entries) == {*BENCH.systems(), "broken"}
    assert "ZeroDivisionError" in entries["broken"].problem
    found = [p for e in entries.values() for p in e.purposes]
    assert all(found.count(p) > 5 for p in PURPOSES)
    assert all(e.title and e.summary and e.purposes for e in entries.values() if not e.problem)


@pytest.mark.long
def test_runs_are_listed_whatever_lies_beside_them(tmp_path: Path) -> None:
    for place, content in (
        ("a/1", {"system": "a", "date": "2026-01-02", "seed": 3, "changed": ["latitude"]}),
        ("b/2", {"system": "b", "date": "2026-01-03", "complete": False}),
        ("suite/3/a", {"system": "a", "date": "2026-01-01"}),
    ):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / "run.json").write_text(json.dumps(content))
    (tmp_path / "a/1/result.json").write_text('{"verdict": "pass"}')
    for place, text in (("c/1", "{"), ("c/2", "[]"), ("c/3", '"x"')):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / "run.json").write_text(text)
    runs = list_runs(tmp_path)
    assert [r.place for r in runs if r.system] == ["b/2", "a/1", "suite/3/a"]
    assert (runs[1].verdict, runs[1].seed, runs[1].changed) == ("pass", 3, ["latitude"])
    assert not runs[0].complete
    assert list_runs(tmp_path / "none") == []
