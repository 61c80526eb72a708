"""What FMUs hold for their reader: documentation, licences, terminals, the experiment that a part is made for."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import pytest
from fmpy import read_model_description

from gyrobench.bench import Bench, standard_folder
from gyrobench.component import Component
from gyrobench.packaging import build, load_part
from gyrobench.packaging.description import default_experiment
from gyrobench.packaging.icon import PICTURES, SIZE, kind_of, picture


@pytest.mark.parametrize(("kind", "fmi"), [("native", 2), ("native", 3), ("python", 2)])
def test_the_icon_stands_where_the_standard_has_it(kind: str, fmi: int, tmp_path: Path) -> None:
    """A PNG that other readers take: strokes on a transparent ground, those of a table."""
    from matplotlib.image import imread

    with zipfile.ZipFile(build("table_rate", kind, fmi=fmi, out=tmp_path)) as archive:
        content = archive.read("model.png" if fmi == 2 else "terminalsAndIcons/icon.png")
    assert content == picture("table") and len(content) < 4000
    image = imread(io.BytesIO(content))
    assert image.shape == (SIZE, SIZE, 4)
    alpha = image[..., 3]
    assert alpha[0].max() == 0.0 and alpha.max() == 1.0 and 0.03 < alpha.mean() < 0.3
    assert alpha[SIZE - 21, SIZE // 2] == 1.0  # the foot: y = 16 % from below


def test_kinds_of_icons() -> None:
    """Of each kind there is a picture, all are different, and a class of the user's is found by its base."""
    assert len({picture(k) for k in PICTURES}) == len(PICTURES)
    assert {kind_of(load_part(p)) for p in Bench.find().parts()} == set(PICTURES) - {"part", "system"}
    parts = ("table_servo", "gyrocompass", "stabilizer_lti", "gyro_error_compensator")
    assert [kind_of(load_part(p)) for p in parts] == ["table", "compass", "controller", "estimator"]

    class Mine(load_part("floated_gyro")):  # type: ignore[misc]
        """Derived."""

    class Other(Component):
        """Of no kind."""

    assert (kind_of(Mine), kind_of(Other)) == ("gyro", "part")


@pytest.mark.parametrize("fmi", [2, 3])
def test_nominal_values_are_those_of_the_reference_run(fmi: int, tmp_path: Path) -> None:
    """Powers of ten: specific force up to 12 m/s2, J = 2e-4 kg.m2; none for what is 0 and not in the run."""
    description = read_model_description(str(build("floated_gyro", fmi=fmi, out=tmp_path)))
    found = {v.name: v.nominal for v in description.modelVariables}
    assert float(found["f[1]" if fmi == 2 else "f"]) == 10.0
    assert (float(found["J"]), found["turn_on"], found["float_angle"]) == (1e-4, None, None)
    assert float(found["omega[1]" if fmi == 2 else "omega"]) in (1e-4, 1e-3)
    assert float(found["mount[1,1]" if fmi == 2 else "mount"]) == 1.0


@pytest.mark.parametrize(("kind", "fmi"), [("native", 2), ("native", 3), ("python", 2)])
def test_the_page_has_all_variables_and_the_licences_are_there(kind: str, fmi: int, tmp_path: Path) -> None:
    file = build("table_rate", kind, fmi=fmi, out=tmp_path)
    with zipfile.ZipFile(file) as archive:
        names = archive.namelist()
        page = archive.read("documentation/index.html").decode()
        licence = archive.read("documentation/licenses/license.txt").decode()
    cls = load_part("table_rate")
    for d in cls.declarations.values():
        if not any(s.decl is d and s.section in ("discrete", "derivative") for s in cls.layout):
            shown = d.name + (f"[{','.join(map(str, d.shape))}]" if d.shape else "")
            assert f"<tr><td>{shown}<td>" in page, d.name
    assert "<td>face[3,3]<td>1<td><td>" in page and page.count("<h1>") == 1
    assert (standard_folder() / "LICENSE").read_text() in licence
    assert ("pythonfmu, in resources" in licence) == (kind == "python") == ("MIT License" in licence)
    assert ("terminalsAndIcons/terminalsAndIcons.xml" in names) == (fmi == 3)
    assert read_model_description(str(file)).license == "BSD-3-Clause"


def test_an_array_is_a_terminal_in_fmi_3(tmp_path: Path) -> None:
    from lxml import etree

    file = build("table_rate", fmi=3, out=tmp_path)
    with zipfile.ZipFile(file) as archive:
        data = archive.read("terminalsAndIcons/terminalsAndIcons.xml")
    schema = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"
    etree.XMLSchema(etree.parse(str(schema))).assertValid(etree.fromstring(data))
    members = {t.get("name"): [m.get("variableName") for m in t] for t in ET.fromstring(data).iter("Terminal")}
    cls = load_part("table_rate")
    ports = [s.decl for s in cls.layout if s.section in ("input", "output")]
    assert members == {d.name: [d.name] for d in ports if d.shape}
    shapes = {v.name: v.shape for v in read_model_description(str(file)).modelVariables}
    assert shapes["f_local"] == (3,) and shapes["face"] == (3, 3) and members.keys() <= shapes.keys()


def test_the_default_experiment_has_the_step_that_the_part_declares(tmp_path: Path) -> None:
    # gyrocompass: 0.1 s; the sampler takes a sample at any step; floated_gyro: states, no step of its own
    for name, step, stop in (("gyrocompass", "0.1", "100.0"), ("sampler", "0.001", "1.0"), ("site", "0.001", "1.0")):
        found = default_experiment(load_part(name))
        assert (found["stepSize"], found["stopTime"]) == (step, stop), name
    for name in Bench.find().parts():
        found = default_experiment(load_part(name))
        declared = load_part(name).declarations.get("step")
        assert declared is None or float(found["stepSize"]) <= declared.start, name
    read = read_model_description(str(build("gyrocompass", out=tmp_path))).defaultExperiment
    assert (read.stepSize, read.stopTime) == ("0.1", "100.0")


def test_a_part_of_the_users_own_is_not_said_to_have_our_licence(written: Callable, tmp_path: Path) -> None:
    written("mine", "    u = Input(0.0, 'V')\n    y = Output('V')\n    def outputs(self): self.y = self.u\n")
    file = build("mine", out=tmp_path, bench=tmp_path)
    assert read_model_description(str(file)).license is None
    with zipfile.ZipFile(file) as archive:  # what gyrobench has put into it has
        assert b"Redistribution and use" in archive.read("documentation/licenses/license.txt")
