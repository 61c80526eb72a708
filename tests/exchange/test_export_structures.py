"""The archive of every system as importers read it: valid, units equal or left out, no factor that is not applied."""

from __future__ import annotations

import io
import zipfile
from functools import cache
from pathlib import Path
from xml.etree import ElementTree as ET

import fmpy.ssp
import pytest
from fmpy import read_model_description
from lxml import etree

from gyrobench.bench import Bench, standard_folder
from gyrobench.exchange.external_record import row_steps
from gyrobench.exchange.gains import Gains, gains_of
from gyrobench.exchange.ssp_annotation import read_gains
from gyrobench.exchange.ssp_export import OMS, export_ssp, prepare, stop_time, structure, unitless
from gyrobench.exchange.ssp_values import NS
from gyrobench.packaging import build
from gyrobench.system.fmu_variables import variables
from gyrobench.system.suite import Suite, load_test
from gyrobench.system.system import System, load_system
from gyrobench.system.wiring import Assembly
from gyrobench.units import same_dimension

SYSTEMS = [n for n in sorted(Bench(standard_folder()).systems()) if n != "drift_test_suite"]


@cache
def schema() -> etree.XMLSchema:
    """Return the schema of SSP 1.0."""
    folder = Path(fmpy.ssp.__file__).parent / "schema"
    return etree.XMLSchema(etree.parse(folder / "SystemStructureDescription.xsd"))


@pytest.mark.parametrize("name", SYSTEMS)
def test_structure(name: str) -> None:
    system = load_test(name)
    assert not isinstance(system, Suite)
    assembly, starts, _ = prepare(system, None, None, None, 1, None)
    system = assembly.system
    gains = gains_of(assembly)
    root = structure(assembly, gains, {**starts, **gains.starts()})
    schema().assertValid(etree.fromstring(ET.tostring(root)))
    units = {
        (c.get("name"), x.get("name")): x[0].get("unit")
        for c in root.iterfind(".//ssd:Component", NS)
        for x in c.iterfind("ssd:Connectors/ssd:Connector", NS)
    }
    fed = set()
    for c in root.iterfind(".//ssd:Connection", NS):
        a, b = (c.get("startElement"), c.get("startConnector")), (c.get("endElement"), c.get("endConnector"))
        assert units[a] == units[b] or None in (units[a], units[b]), f"{a} -> {b}: {units[a]} into {units[b]}"
        assert b not in fed and len(c) == 0  # no transformation
        fed.add(b)
    factors = {c.wire for c in assembly.connections if c.gain != 1.0 or c.offset}
    assert {c.wire for c in gains.parts.values()} == factors | set(system.factors)
    experiment = root.find("ssd:DefaultExperiment", NS)
    assert experiment is not None and float(experiment.get("stopTime", "0")) == stop_time(system) > 0.0
    steps = stop_time(system) / system.step
    assert abs(steps - round(steps)) < 1e-6  # the last step of an importer is as long as the others
    if system.stop is not None:
        assert round(steps) == round(system.stop / system.step)  # as many as in a run of the bench
    solver(root, system)
    same_units(assembly, gains)


def information(element: ET.Element) -> dict[str, str]:
    """Return what OMSimulator 3 reads of an element."""
    where = "ssd:Annotations/ssc:Annotation[@type='org.openmodelica']/oms:Annotations/oms:SimulationInformation"
    (found,) = element.iterfind(where, {**NS, "oms": OMS})
    return found.attrib


def solver(root: ET.Element, system: System) -> None:
    """Step and method at the system, the solver's name at each component, rows that a reduction takes."""
    top, experiment = root.find("ssd:System", NS), root.find("ssd:DefaultExperiment", NS)
    assert top is not None and experiment is not None
    assert information(top) == {"name": "solver1", "method": "oms_ma", "fixedStepSize": repr(system.step)}
    components = root.findall(".//ssd:Component", NS)
    assert components and all(information(c) == {"name": "solver1"} for c in components)
    results = information(experiment)
    rows = float(results["loggingInterval"]) / system.step + 0.5  # half a step less: rounding of the time loses no row
    assert rows == pytest.approx(row_steps(system), abs=1e-6)
    assert system.channel_period / system.step / row_steps(system) == pytest.approx(
        round(system.channel_period / system.step / row_steps(system))
    )


def same_units(assembly: Assembly, gains: Gains) -> None:
    """OMSimulator compares the dimensions that the FMUs of the archive declare themselves."""
    known = {}
    for name in gains.order:
        description = assembly.descriptions.get(name)
        lost = unitless(assembly, gains, name)
        for v in variables(description).values() if description is not None else ():
            known[name, v.name] = "" if v.array in lost else v.unit
        if description is None:
            assert lost == {"u", "y"}
    for c in gains.links:
        a, b = known.get((c.source, c.output.variable), ""), known.get((c.target, c.input.variable), "")
        assert not (a and b) or same_dimension(a, b), f"{c.source}.{c.output.variable} [{a}] -> {c.target} [{b}]"


@pytest.mark.long
def test_every_file_of_an_archive(tmp_path: Path) -> None:
    """Step and end of the system in all FMUs, one name of all sets, a start value for each input that is connected."""
    system = load_system("stabilizer_floated_2dof")  # two gains
    export_ssp(system, tmp_path / "s.ssp")
    with zipfile.ZipFile(tmp_path / "s.ssp") as z:
        files = {n: z.read(n) for n in z.namelist()}
    schema().assertValid(etree.fromstring(files["SystemStructure.ssd"]))
    names = set()
    for n in (n for n in files if n.endswith(".fmu")):
        experiment = read_model_description(io.BytesIO(files[n])).defaultExperiment
        assert (float(experiment.stepSize), float(experiment.stopTime)) == (1e-4, stop_time(system)), n
        names.add(Path(n).stem)
    assert names == {*system.slots, "gain_01", "gain_02"}
    gain = read_model_description(io.BytesIO(files["resources/gain_01.fmu"]))
    assert {v.name: v.unit for v in gain.modelVariables} == {"factor": "1", "offset": "1", "u": None, "y": None}
    sets = {n: ET.fromstring(d) for n, d in files.items() if n.endswith(".ssv")}
    assert {s.get("name") for s in sets.values()} == {system.name}
    given = {p.get("name") for p in sets["resources/parameters.ssv"].iterfind(".//ssv:Parameter", NS)}
    root = ET.fromstring(files["SystemStructure.ssd"])
    fed = {f"{c.get('endElement')}.{c.get('endConnector')}" for c in root.iterfind(".//ssd:Connection", NS)}
    assert fed and fed <= given
    assert read_gains(root) == {"gain_01", "gain_02"}


def test_initial_unknowns_and_the_time_of_fmi_3(tmp_path: Path) -> None:
    """Where dependencies are left out an importer takes all; OMSimulator takes 0 among them for the first variable."""
    gyro = read_model_description(str(build("floated_gyro", out=tmp_path)))
    assert gyro.initialUnknowns and all(u.dependencies is not None for u in (*gyro.initialUnknowns, *gyro.outputs))
    u = next(x for x in gyro.initialUnknowns if x.variable.name == "u")
    assert {d.name for d in u.dependencies} == {"K_sg", "u_max", "pickoff", "seed", "float_angle", "pickoff_excitation"}
    of_3 = read_model_description(str(build("floated_gyro", fmi=3, out=tmp_path)))
    at_0 = [v for v in of_3.modelVariables if v.valueReference == 0]
    assert [(v.name, v.causality) for v in at_0] == [("time", "independent")]
    unknowns = (*of_3.initialUnknowns, *of_3.outputs)
    assert all(x.dependencies is not None and at_0[0] not in x.dependencies for x in unknowns)
