"""The rooms of the tool: imports go one way, files and functions are short, docstrings open as they should."""

from __future__ import annotations

import ast
import functools
import importlib.util
import re
from pathlib import Path

import pytest

import gyrobench
from gyrobench.bench import Bench, standard_folder

TOOL = Path(gyrobench.__file__).parent if gyrobench.__file__ else Path(gyrobench.__path__[0])
#: room -> rooms it may import.  Data goes one way: component -> FMU -> system -> engine ->
#: record -> reduction -> report.
#: A room may know what comes before it, never what comes after; bench, units and the like belong to no room.
COMMON = {"errors", "files", "bench", "units", "arrays", "frames", "attitudes", "drift", "notebook", "reading"}
COMMON |= {"result", "result_content", "result_entries", "result_suite", "callable_room", "boundary", "user_code"}
COMMON.add("side_by_side")
ROOMS: dict[str, set[str]] = {
    **{name: COMMON for name in COMMON},
    "component": {"errors"},  # a Python FMU carries a copy of both
    "packaging": COMMON | {"component"},
    "record": COMMON,  # the format: neither the system nor the engine that made it
    "system": COMMON | {"component", "packaging", "record", "reduction"},  # a test knows how it is reduced and judged
    "linear": COMMON | {"component", "packaging", "record", "system"},
    "engine": COMMON | {"component", "packaging", "record", "system", "linear"},
    "exchange": COMMON | {"component", "packaging", "record", "system", "linear", "engine"},
    "reduction": COMMON | {"component", "packaging", "record"},  # parts say what errors of a set-up they simulate
    "report": COMMON | {"record", "reduction"},
}
BELOW = {*ROOMS}
#: from a request to a result, for the commands and the library
ROOMS["workflow"] = BELOW
ROOMS["design"] = BELOW
ROOMS["tuning"] = BELOW
ROOMS["identification"] = BELOW
ROOMS["campaign"] = BELOW | {"workflow"}
ROOMS["library"] = BELOW | {"workflow", "design", "tuning", "identification", "campaign"}
#: the face in the browser; that of the shell is in FACES, and neither imports the other
ROOMS["studio"] = BELOW | {"workflow", "library", "tuning"}
#: rooms inside a room -> rooms beside them that they may import
INNER: dict[str, set[str]] = {
    "campaign.execution": set(),
    "campaign.analysis": {"campaign.execution"},
    "campaign.site": {"campaign.execution", "campaign.analysis"},
}


@functools.cache
def tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"))


@functools.cache
def imports(file: Path) -> set[str]:
    """Modules of gyrobench that a file imports, anywhere in it, as absolute names."""
    package = ["gyrobench", *file.relative_to(TOOL).parent.parts]
    found: set[str] = set()
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.Import):
            found |= {a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            found |= {f"{module}.{a.name}" for a in node.names} if module == "gyrobench" else {module}
    return {m for m in found if m == "gyrobench" or m.startswith("gyrobench.")}


def room(file: Path) -> str:
    return file.relative_to(TOOL).parts[0].removesuffix(".py")


FILES = sorted(f for f in TOOL.rglob("*.py") if "_bench" not in f.parts)


@pytest.mark.parametrize("file", FILES, ids=[str(f.relative_to(TOOL)) for f in FILES])
def test_imports_go_one_way(file: Path) -> None:
    if room(file) in FACES:
        return
    for module in imports(file):
        there = module.split(".")[1] if "." in module else ""
        assert there in ROOMS[room(file)] | {room(file), ""}, f"{file}: imports {module}"


def inner_room(module: str) -> str:
    """Room inside a room that a module is in: "campaign.site" of gyrobench.campaign.site.site_page; else ""."""
    return next((name for name in INNER if f"{module}.".startswith(f"gyrobench.{name}.")), "")


def test_imports_between_the_rooms_of_a_room_go_one_way() -> None:
    for name, allowed in INNER.items():
        files = [f for f in FILES if inner_room(module_of(f)) == name]
        assert len(files) > 2, name
        for file in files:
            others = {inner_room(m) for m in imports(file)} - {"", name}
            assert others <= allowed, f"{file}: imports {others - allowed}"
    for name in {name.partition(".")[0] for name in INNER}:
        loose = [f.name for f in (TOOL / name).glob("*.py")]
        assert loose == ["__init__.py"], f"gyrobench/{name}: {loose}"


def module_of(file: Path) -> str:
    parts = ("gyrobench", *file.relative_to(TOOL).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported_modules(file: Path, modules: set[str]) -> set[str]:
    """Modules of gyrobench that a file imports when it runs, in functions too; not what only the type checker reads."""
    package = ["gyrobench", *file.relative_to(TOOL).parent.parts]
    pending: list[ast.AST] = [tree(file)]
    names: set[str] = set()
    while pending:
        node = pending.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            pending += node.orelse
            continue
        pending += ast.iter_child_nodes(node)
        if isinstance(node, ast.Import):
            names |= {a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            names |= {f"{module}.{a.name}" if f"{module}.{a.name}" in modules else module for a in node.names}
    return names & modules - {module_of(file)}


def cycle(graph: dict[str, set[str]]) -> list[str]:
    """A closed path through the graph; empty where there is none."""
    done: set[str] = set()

    def search(path: list[str]) -> list[str]:
        for module in sorted(graph[path[-1]]):
            if module in path:
                return [*path[path.index(module) :], module]
            if module not in done and (found := search([*path, module])):
                return found
        done.add(path[-1])
        return []

    return next((found for start in sorted(graph) if start not in done and (found := search([start]))), [])


@pytest.mark.long
def test_no_module_imports_itself_by_way_of_others() -> None:
    modules = {module_of(f) for f in FILES}
    graph = {module_of(f): imported_modules(f, modules) for f in FILES}
    assert sum(map(len, graph.values())) > 300, "the imports are read"
    assert cycle(graph) == []
    assert cycle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c", "b"]


FACES = {"commands", "__main__", "__init__"}  # they see everything


def test_every_room_is_known() -> None:
    assert {room(f) for f in FILES} <= set(ROOMS) | FACES


def test_no_two_modules_of_one_name() -> None:
    names = [f.stem for f in FILES if f.stem not in ("__init__", "__main__")]
    assert len(set(names)) == len(names), sorted({n for n in names if names.count(n) > 1})


@pytest.mark.long
def test_no_two_public_classes_of_one_name() -> None:
    places: dict[str, list[str]] = {}
    bench = standard_folder()
    for top in (TOOL, bench / "components", bench / "systems"):
        for file in sorted(f for f in top.rglob("*.py") if "_bench" not in f.parts):
            for node in tree(file).body:  # the class of a system's reduction is Reduction, of each
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_") and node.name != "Reduction":
                    places.setdefault(node.name, []).append(f"{top.name}/{file.relative_to(top)}")
    assert len(places) > 500, "the classes are read"
    twice = {name: files for name, files in places.items() if len(files) > 1}
    assert not twice, f"two classes of one name: {twice}"


#: calls of more than ten arguments that stay: flat records of a result or of a fit, each made in one place
FLAT = {
    ("reduction/estimation/noise_mixture_fit.py", "NoiseEstimate"),  # of estimated noise, of white noise
    ("drift_record/reduction.py", "RecordChannel"),
}


@pytest.mark.long
def test_no_call_in_a_reduction_takes_more_than_ten_arguments() -> None:
    long, calls = set(), 0
    for top in (TOOL / "reduction", standard_folder() / "systems"):
        for file in sorted(f for f in top.rglob("*.py") if "_bench" not in f.parts):
            for node in ast.walk(tree(file)):
                if isinstance(node, ast.Call):
                    calls += 1
                    if len(node.args) + len(node.keywords) > 10:
                        name = file.relative_to(TOOL if top.parent == TOOL else top).as_posix()
                        long.add((name, ast.unparse(node.func)))
    assert calls > 10_000, "the calls are read"
    assert long == FLAT, f"build it in steps, group what belongs together: {long - FLAT}; gone: {FLAT - long}"


@pytest.mark.long
def test_no_function_of_a_reduction_or_a_system_is_longer_than_80_lines() -> None:
    lengths: dict[str, int] = {}
    for top in (TOOL / "reduction", standard_folder() / "systems"):
        for file in sorted(f for f in top.rglob("*.py") if "_bench" not in f.parts):
            for node in ast.walk(tree(file)):
                if isinstance(node, ast.FunctionDef):
                    lengths[f"{file.relative_to(top)}:{node.lineno} {node.name}"] = node.end_lineno - node.lineno + 1  # type: ignore[operator]
    assert len(lengths) > 3000, "the functions are read"
    assert not {name: n for name, n in lengths.items() if n > 80}


def test_no_file_is_longer_than_400_lines() -> None:
    """One idea in one place: a file that has two is split."""
    folders = ("gyrobench", "systems", "components", "tests/benchmarks", "tests/support")
    bench = standard_folder()
    files = [f for top in folders for f in (bench / top).rglob("*.py") if "_bench" not in f.parts]
    lengths = {f.relative_to(bench).as_posix(): len(f.read_text(encoding="utf-8").splitlines()) for f in files}
    assert len(lengths) > 900, "the files are read"
    assert not {name for name, n in lengths.items() if n > 400}


@pytest.mark.long
def test_docstrings_open_with_what_is_returned_or_done() -> None:
    """Not with a fragment: "Return the parameters ...", "Parameters of ...", and not "Of all parts, ..."."""
    fragment = re.compile(r"(What|Of|As|Whether)\b")
    for file in (*FILES, *(standard_folder() / "components").rglob("*.py")):
        if "reduction" in file.parts:
            continue
        for node in ast.walk(tree(file)):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                text = ast.get_docstring(node) or ""
                assert not fragment.match(text), f"{file}: '{text.splitlines()[0]}'"


@pytest.mark.long
def test_the_tool_names_no_content() -> None:
    """gyrobench works on any bench: no part, system or specification is named in its code."""
    bench = Bench(standard_folder())
    names = {n for n in (*bench.parts(), *bench.systems(), *bench.specifications()) if "_" in n}  # no plain words
    names.remove("gyro_bandwidth")  # an option has this name, too: the bandwidth of the gyro of a line of sight
    rooms = ("components", "systems", "fmus")
    for file in FILES:
        assert not {m.split(".")[0] for m in imports(file)} & set(rooms)
        texts = {
            n.value
            for n in ast.walk(tree(file))
            if isinstance(n, ast.Constant) and isinstance(n.value, str) and n.value in names
        }
        assert not texts, f"{file} names {texts}"


def test_what_the_benchmarks_import_exists() -> None:
    """They are not run by the tests; some hold programs as text."""
    for file in sorted((Path(__file__).parent / "benchmarks").glob("*.py")):
        text = file.read_text(encoding="utf-8")
        for module, names in re.findall(r"^\s*from (gyrobench[\w.]*) import ([\w, ]+)", text, re.M):
            for name in re.findall(r"(\w+)(?: as \w+)?", names):
                found = hasattr(importlib.import_module(module), name)
                assert found or importlib.util.find_spec(f"{module}.{name}"), f"{file.name}: {module} has no {name}"


def test_files_of_tests_are_tests() -> None:
    """What tests share is in tests/support, on the path by pyproject.toml; each room of tests is one of the tool."""
    tests = Path(__file__).parent
    others = {"benchmarks", "support", "foreign", "corpus"}
    for folder in (f for f in tests.iterdir() if f.is_dir() and f.name not in {*others, "__pycache__"}):
        assert folder.name in {*ROOMS, "components", "systems", "spec"}, f"{folder}: which room of the tool is it of?"
        for file in folder.glob("*.py"):
            assert file.name == "conftest.py" or file.name.startswith("test_"), f"{file}: to tests/support"
            assert "sys.path.insert" not in file.read_text(encoding="utf-8"), file
    names = [f.name for f in tests.rglob("test_*.py")]  # the rooms are no packages: pytest imports them by these names
    assert len(names) == len(set(names)), f"twice: {sorted({n for n in names if names.count(n) > 1})}"
