"""Where things are: benches, what they lack, names that are near; what a bench lists and how one is made."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from gyrobench.bench import Bench, BenchError, display_path, standard_folder, suggest_names
from gyrobench.workflow import catalog
from gyrobench.workflow.catalog import init_bench, list_contents

ODD = '''"""A module."""
class Helper:
    """Derives from nothing."""
    title = "no"


class Mine(  # a comment
    Base,
    other.Base,
):

    """Test (of its own).

    More.
    """

    number = 1
    title = (
        "A title "
        "(in two lines)"
    )
    spec = ("TEST-A",
            "TEST-B")

    def check(self):
        title = "not this"


class Undocumented(Base):
    title = "not this"


title = "not this"
'''


# -------------------------------------------------------------------------------------------- benches
def test_the_nearest_folder_above_with_the_rooms_is_the_bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    init_bench(tmp_path / "mine", ["site"])
    inside = tmp_path / "mine" / "components" / "site"
    monkeypatch.chdir(inside)
    bench = Bench.find()
    assert bench.folder == (tmp_path / "mine").resolve()
    assert bench.out == bench.folder / "reports" / "out"
    assert bench.fmus == bench.products == bench.folder / "fmus"


def test_outside_of_a_bench_the_standard_one_is_used_and_results_stay_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    bench = Bench.find()
    assert bench.folder == standard_folder()
    assert bench.out == tmp_path / "reports" / "out"
    assert bench.products == tmp_path / "fmus"


def test_own_parts_come_before_standard_ones(tmp_path: Path) -> None:
    init_bench(tmp_path / "mine", ["site"])
    bench = Bench.find(tmp_path / "mine")
    assert bench.part_folder("site") == bench.folder / "components" / "site"
    assert bench.part_folder("floated_gyro") == standard_folder() / "components" / "floated_gyro"
    assert bench.system_folder("tumble_single_axis") == standard_folder() / "systems" / "tumble_single_axis"
    (bench.folder / "reports" / "specs" / "floated_gyro.toml").write_text("")
    assert bench.specifications()["floated_gyro"] == bench.folder / "reports" / "specs" / "floated_gyro.toml"


def test_unknown_names_are_answered_with_names_that_are_near(tmp_path: Path) -> None:
    bench = Bench(standard_folder())
    with pytest.raises(BenchError, match=r"no part 'floated_gyr'; did you mean floated_gyro\?"):
        bench.part_folder("floated_gyr")
    with pytest.raises(BenchError, match=r"no system 'tumble_single_axes'; did you mean tumble_single_axis\?"):
        bench.system_folder("tumble_single_axes")
    with pytest.raises(BenchError, match=r"is no bench: it has no folder components/ \(make one: gyrobench init NAME"):
        Bench.find(tmp_path)
    assert suggest_names("xyz", ["site", "table"]) == "there are: site, table"
    assert suggest_names("xyz", []) == "there are: none"
    assert suggest_names("j", ["mode", "J"]) == "did you mean J?"


def test_short_paths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert display_path(tmp_path / "a" / "b") == "a/b"
    assert display_path(Path("/somewhere/else")) == "/somewhere/else"


# --------------------------------------------------------------------------------- list and init
def test_listing_reads_what_each_part_says_of_itself() -> None:
    found = list_contents(Bench(standard_folder()))
    assert list(found) == ["parts", "systems", "sockets", "specifications", "instruments"]
    assert all(r["what"] for rows in found.values() for r in rows)
    rows = {r["name"]: r for title in ("parts", "systems") for r in found[title]}
    assert rows["floated_gyro"]["what"] == "Single-degree-of-freedom floated gyro"
    assert "GYRO-DYN-1" in rows["floated_gyro"]["spec"]
    assert rows["tumble_single_axis"]["what"] == "Single-axis tumble test"
    assert "TEST-TUMBLE1-SDF" in rows["tumble_single_axis"]["spec"]


def test_listing_finds_what_the_syntax_trees_hold(tmp_path: Path) -> None:
    """Docstring, title and spec of the last class that derives from another and has a docstring."""
    bench = Bench(standard_folder())
    files = [f / "model.py" for f in bench.parts().values()] + [f / "system.py" for f in bench.systems().values()]
    odd = tmp_path / "system.py"
    odd.write_text(ODD, encoding="utf-8")
    for file in (*files, odd):
        expected = ("", "", ())
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and node.bases and (doc := ast.get_docstring(node)):
                given = {ast.unparse(s.targets[0]): s.value for s in node.body if isinstance(s, ast.Assign)}
                title, spec = (ast.literal_eval(given[n]) if n in given else "" for n in ("title", "spec"))
                expected = doc.splitlines()[0], title, tuple(spec)
        doc, attributes = catalog._class_text(file)
        assert (doc.splitlines()[0], attributes.get("title", ""), tuple(attributes.get("spec", ()))) == expected
    assert expected == ("Test (of its own).", "A title (in two lines)", ("TEST-A", "TEST-B"))


def test_listing_survives_a_specification_that_cannot_be_read(tmp_path: Path) -> None:
    init_bench(tmp_path / "mine", [])
    (tmp_path / "mine" / "reports" / "specs" / "odd.toml").write_text("title =")
    rows = {r["name"]: r for r in list_contents(Bench.find(tmp_path / "mine"))["specifications"]}
    assert rows["odd"]["what"].startswith("cannot be read")


def test_init_copies_parts_and_systems(tmp_path: Path) -> None:
    lines = init_bench(tmp_path / "mine", ["site", "tumble_single_axis", "site"])
    assert len(lines) == 3
    bench = Bench.find(tmp_path / "mine")
    assert bench.part_folder("site").is_relative_to(bench.folder)
    assert bench.system_folder("tumble_single_axis").is_relative_to(bench.folder)
    # git keeps no empty folder: each room that makes a bench holds a file
    for room in ("components", "systems", "reports"):
        assert [f for f in (bench.folder / room).rglob("*") if f.is_file()]


def test_init_refuses(tmp_path: Path) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    with pytest.raises(BenchError, match="exists and is not empty"):
        init_bench(tmp_path / "full", [])
    with pytest.raises(BenchError, match="exists and is not empty"):
        init_bench(tmp_path / "full" / "file", [])
    with pytest.raises(BenchError, match=r"--copy gyro: no such part or system; did you mean .*gyro"):
        init_bench(tmp_path / "new", ["gyro"])
    assert not (tmp_path / "new").exists()
