"""`gyrobench validate`: what it finds wrong, and that it finds nothing wrong with what we build."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from fmpy.model_description import ModelDescription, ScalarVariable
from fmpy.validation import _validate_variable_names
from toybench import TOYS

from gyrobench.bench import Bench, BenchError, standard_folder
from gyrobench.packaging import compiler
from gyrobench.packaging.reference import write_reference
from gyrobench.packaging.validate import STRUCTURED, validate


@pytest.mark.long
def test_parts_have_no_problems(part: str) -> None:
    """FMPy's validation of the Python FMU and of the native FMUs (FMI 2, FMI 3), units, reference runs.

    The reference run is repeated bit for bit by the plain class and the three FMUs: see the last test here.
    """
    assert validate(part) == []


def changed(path: Path, to: Path, edit: Callable[[str], str], drop: str = "nothing") -> Path:
    """A copy of an FMU with another model description, or without some of its files."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(to, "w") as new:
        for name in old.namelist():
            if not name.startswith(drop):
                data = old.read(name)
                new.writestr(name, edit(data.decode()) if name == "modelDescription.xml" else data)
    return to


def test_an_unknown_unit(fmu: Callable, tmp_path: Path) -> None:
    """Foreign units are told once each, with the variable and what would do; not those that the FMU itself defines."""

    def edit(text: str) -> str:
        text = re.sub(r'<Unit name="rad/s2">.*?</Unit>', '<Unit name="furlong/s2" />', text, flags=re.S)
        text = re.sub(r'unit="rad/s2"( displayUnit="deg/s2")?', 'unit="furlong/s2"', text)
        return text.replace('generationTool="gyrobench"', 'generationTool="other"')

    (problem,) = validate(changed(fmu("floated_gyro", "native"), tmp_path / "a.fmu", edit))
    assert problem.startswith("ramp: unit 'furlong/s2': unknown symbol 'furlong'")

    def defined(text: str) -> str:
        return edit(text).replace('"furlong/s2" />', '"furlong/s2"><BaseUnit rad="1" s="-2" factor="2.5" /></Unit>')

    assert validate(changed(fmu("floated_gyro", "native"), tmp_path / "b.fmu", defined)) == []


def test_a_wrong_structure(fmu: Callable, tmp_path: Path) -> None:
    def edit(text: str) -> str:
        return re.sub(r"<InitialUnknowns>.*</InitialUnknowns>", "", text, flags=re.S)

    (problem,) = validate(changed(fmu("floated_gyro", "native"), tmp_path / "a.fmu", edit))
    assert "InitialUnknowns does not contain the expected set" in problem


def test_no_binary_for_this_platform(fmu: Callable, tmp_path: Path) -> None:
    path = changed(fmu("site", "native"), tmp_path / "a.fmu", str, drop="binaries")
    (problem,) = validate(path)
    assert problem.startswith(f"no binary for {compiler.this_platform()}; it has")


def test_not_an_fmu(tmp_path: Path) -> None:
    path = tmp_path / "a.fmu"
    path.write_text("nothing")
    assert validate(path)[0].startswith("not a readable FMU")
    with pytest.raises(BenchError, match="no such file"):
        validate(tmp_path / "b.fmu")
    with pytest.raises(BenchError, match="no part 'nothing'"):
        validate("nothing")


@pytest.mark.long
def test_another_run_than_the_reference(tmp_path: Path, fmu: Callable) -> None:
    """A bench whose reference run was made by another model."""
    for room in ("components/site", "systems", "reports"):
        (tmp_path / room).mkdir(parents=True)
    folder = tmp_path / "components" / "site"
    (folder / "model.py").write_text(Path(TOYS.parent.parent.parent / "components/site/model.py").read_text())
    write_reference("site", folder / "reference.csv", bench=tmp_path, rows=5)
    assert validate("site", tmp_path) == []
    text = (folder / "model.py").read_text()
    other = "\n    def outputs(self) -> None:\n        self.g = 2.0 * self.local_g\n"
    (folder / "model.py").write_text(text + other)
    problems = validate("site", tmp_path)
    assert len(problems) == 4  # plain class and three FMUs
    assert problems[0].startswith("plain class: g at t = 0 s is 19.6")
    (folder / "model.py").write_text(text.replace('version = "1.0.0"', 'version = "1.1.0"'))
    assert any("site 1.1.0, but the reference run is that of 1.0.0" in p for p in validate("site", tmp_path))
    (folder / "reference.csv").unlink()
    assert validate("site", tmp_path) == ["site has no reference.csv beside its model.py"]


LEGAL = [
    "a",
    "_",
    "A1_b",
    "a[1]",
    "a[1,22].b",
    "der(a)",
    "der(a.b[3],2)",
    "'a#b'",
    "der('q'[1])",
    "a.'['.b[0]",
    "'a b'",
]
ILLEGAL = [
    "1a",
    "a[",
    "a[]",
    "a[1,]",
    "a[x]",
    "a..b",
    ".a",
    "a.",
    "der(a",
    "der()",
    "der(a,)",
    "a[1][2]",
    "é",
    "''",
    "'a",
]
ILLEGAL += ["a-b", "der(der(a))", "der(a)[1]", "'é'", "", "a b", "a\n"]


@pytest.mark.parametrize("name", [*LEGAL, *ILLEGAL])
def test_names_of_variables_as_the_grammar_has_them(name: str) -> None:
    """The convention "structured" by a general parser of FMPy."""
    description = ModelDescription()
    description.modelVariables = [ScalarVariable(name, 1)]
    description.variableNamingConvention = "structured"
    assert (_validate_variable_names(description) == []) == (name in LEGAL)
    assert (STRUCTURED.fullmatch(name) is not None) == (name in LEGAL)


def test_escapes_in_names() -> None:
    """Those of the standard; FMPy takes a backslash before any character."""
    for c in "'\"?\\abfnrtv":
        assert STRUCTURED.fullmatch(f"'a\\{c}b'")
    assert not STRUCTURED.fullmatch("'a\\xb'") and not STRUCTURED.fullmatch("'a'b'")


def test_an_illegal_name(fmu: Callable, tmp_path: Path) -> None:
    path = changed(fmu("site", "native"), tmp_path / "a.fmu", lambda text: text.replace('name="g"', 'name="g-1"'))
    (problem,) = validate(path)
    assert re.fullmatch(r'"g-1" \(line \d+\) is not a legal name of the naming convention "structured"', problem)
    flat = changed(path, tmp_path / "b.fmu", lambda text: text.replace('Convention="structured"', 'Convention="flat"'))
    assert "legal" not in "".join(validate(flat))


def test_a_system_that_has_the_name_of_a_part(fmu: Callable, tmp_path: Path) -> None:
    """It is not the part, whose reference run has another version, other inputs and outputs."""
    home, name = Bench(standard_folder()), "vertical_gyro"
    assert name in home.systems() and name in home.parts()

    def of_the_system(text: str) -> str:
        return text.replace('modelName="VerticalGyro"', f'modelName="{name}"')

    path = changed(
        fmu(name, "native"),
        tmp_path / "part.fmu",
        lambda text: re.sub(r'(?<!xml) version="[^"]*"', ' version="9"', text),
    )
    (problem,) = validate(path)
    assert problem.startswith("vertical_gyro 9, but the reference run is that of ")
    assert validate(changed(path, tmp_path / "system.fmu", of_the_system)) == []
