"""Every part of the standard bench as a parameter; parts written as text; FMUs built once a session."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from pathlib import Path

import fmpy
import pytest
from toybench import FORMS, HEAD, PARTS, TARGETS, TOYS

from gyrobench.component import Component
from gyrobench.files import temporary_folder, unzip_fmu
from gyrobench.packaging import build, load_part
from gyrobench.packaging.instance import Fmu, Instance, Plain, Unzipped

LONG_PARTS = {"gyro_vibratory_carrier"}  # a step has many periods: a hundred times the time of the others


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "part" in metafunc.fixturenames:
        marks = {p: (pytest.mark.long,) if p in LONG_PARTS else () for p in PARTS}
        metafunc.parametrize("part", [pytest.param(p, marks=marks[p]) for p in PARTS])
    if "target" in metafunc.fixturenames:
        metafunc.parametrize("target", TARGETS)
    if "form" in metafunc.fixturenames:
        metafunc.parametrize("form", FORMS)


@pytest.fixture(scope="session")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Builds a part of the standard bench (or, with ``toy=True``, of the toys)."""
    out = tmp_path_factory.mktemp("fmus")

    @functools.cache
    def built(part: str, target: str, fmi: int = 2, toy: bool = False) -> Path:
        return build(part, target, fmi=fmi, out=out, bench=TOYS if toy else None)

    return built


@pytest.fixture(scope="session")
def unzipped() -> Callable[[Path], Unzipped]:
    """Files and description of an FMU, shared by the instances of the session."""
    found: dict[Path, Unzipped] = {}

    def unzip(path: Path) -> Unzipped:
        if path not in found:
            folder = temporary_folder()
            unzip_fmu(path, folder)
            found[path] = Unzipped(fmpy.read_model_description(str(path), validate=False), folder)
        return found[path]

    return unzip


@pytest.fixture
def instance(fmu: Callable[..., Path], unzipped: Callable[[Path], Unzipped]) -> Iterator[Callable[..., Instance]]:
    """Makes instances ("plain", "native", "python", "native-fmi3") and frees them after the test."""
    made: list[Instance] = []

    def make(part: str, target: str, name: str = "slot", toy: bool = False, logging: bool = True) -> Instance:
        one: Instance
        if target == "plain":
            one = Plain(load_part(part, TOYS if toy else None), name)
        else:
            fmi = 3 if target.endswith("fmi3") else 2
            path = fmu(part, target.removesuffix("-fmi3"), fmi, toy)
            one = Fmu(path, name, like=unzipped(path), logging=logging)
        made.append(one)
        return one

    yield make
    for one in made:
        one.free()


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str, str], type[Component]]:
    """A part from the text of its class body: ``written("name", body)``; its bench is ``tmp_path``."""

    def write(name: str, body: str) -> type[Component]:
        folder = tmp_path / "components" / name
        folder.mkdir(parents=True)
        (folder / "model.py").write_text(HEAD + body, encoding="utf-8")
        return load_part(name, tmp_path)

    return write
