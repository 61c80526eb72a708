"""Archives of the kinds that the SSP standard and OMSimulator's tests have: run, or refused for the right reason."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from archives import LAG, MAPPING, VALUE_SET, bound, real, write_archive

from gyrobench.engine.session import run
from gyrobench.exchange.gains import gain_fmu
from gyrobench.exchange.ssp_import import read_ssp
from gyrobench.system.execution_order import AlgebraicLoopError
from gyrobench.system.system import InvalidConfigurationError

Foreign = Callable[[str], Path]
Write = Callable[..., Path]
PORT = '<ssd:Connectors><ssd:Connector name="{}" kind="{}"><ssc:Real/></ssd:Connector></ssd:Connectors>'
LINK = '<ssd:Connection startElement="{}" startConnector="{}" endElement="{}" endConnector="{}"/>'
FILE = '<ssd:ParameterBindings><ssd:ParameterBinding source="v.ssv">{}</ssd:ParameterBinding></ssd:ParameterBindings>'
MAPPED = FILE.format('<ssd:ParameterMapping source="m.ssm"/>')
OMS = (
    '<ssd:Annotations><ssc:Annotation type="org.openmodelica"><oms:Annotations xmlns:oms="https://raw.githubusercontent'
    '.com/OpenModelica/OMSimulator/master/schema/oms.xsd"><oms:SimulationInformation {}</oms:Annotations>'
    "</ssc:Annotation></ssd:Annotations>"
)
VARIABLE = '><oms:VariableStepSolver description="cvode" maximumStepSize="0.1"/></oms:SimulationInformation>'
A, B = LAG.format("a", ""), LAG.format("b", "")
Y0 = bound(real("a.y0", 1.0))
DECAY = math.exp(-0.5 / 0.1)  # of a lag of 0.1 s from y0 = 1 with no input, after 0.5 s


@pytest.fixture
def write(foreign: Foreign, tmp_path: Path) -> Write:
    def written(*content: str, files: dict[str, str] | None = None, **more: Any) -> Path:
        every: dict[str, Path | str] = {"resources/lag.fmu": foreign("lag"), **(files or {})}
        return write_archive(tmp_path / "x.ssp", every, *content, **more)

    return written


def end_of(path: Path, step: float | None = 0.01, variable: str = "a.y") -> float:
    system = read_ssp(path, step)
    type(system).channels, type(system).channel_period = (variable,), 0.5
    return float(run(system).channels[variable][-1])


def test_values_of_connectors_that_feed_nothing(write: Write) -> None:
    """Start values of a system's connectors, which the standard allows: said, not refused."""
    path = write(A, values=PORT.format("C1", "input") + bound(real("C1", -10.5) + real("a.y0", 1.0)))
    system = read_ssp(path, 0.01)
    assert system.warnings() == ["the value of C1 sets nothing: its connector feeds no component"]
    assert end_of(path) == pytest.approx(DECAY, rel=1e-12)


def test_a_connection_against_its_names(write: Write) -> None:
    """To the standard the direction is that of the connectors: here from the input of b to the output of a."""
    path = write(A + B, LINK.format("b", "u", "a", "y"), Y0)
    assert read_ssp(path, 0.01).wires == "a.y -> b.u"
    # both connectors of the system's own: an input gives, an output takes
    ports = PORT.format("k", "input")
    link = '<ssd:Connection startElement="a" startConnector="u" endConnector="k"/>'
    path = write(A, link, ports + bound(real("k", 2.0)))
    assert end_of(path) == pytest.approx(2.0 * (1.0 - DECAY), rel=1e-12)


def test_entries_of_a_mapping_without_a_source(write: Write) -> None:
    entries = '<ssm:MappingEntry source="" target="a.T"/><ssm:MappingEntry source="start" target="a.y0"/>'
    files = {"v.ssv": VALUE_SET.format(real("start", 1.0) + real("other", 5.0)), "m.ssm": MAPPING.format(entries)}
    assert end_of(write(A, values=MAPPED, files=files)) == pytest.approx(DECAY, rel=1e-12)


def test_units_in_brackets_and_conversion_before_transformation(write: Write) -> None:
    assert read_ssp(write(A, values=bound(real("a.T", 200.0, "[ms]"))), 0.01).raw == {"a.T": pytest.approx(0.2)}
    port = PORT.replace("<ssc:Real/>", '<ssc:Real unit="{}"/>')
    link = LINK.format("a", "y", "b", "u").replace("/>", ">") + (
        '<ssc:LinearTransformation factor="2" offset="1"/></ssd:Connection>'
    )
    elements = LAG.format("a", port.format("y", "output", "m")) + LAG.format("b", port.format("u", "input", "mm"))
    system = read_ssp(write(elements, link), 0.01)  # mm: 2 * (1000 m) + 1
    assert (system.factors, system.offsets) == ({"a.y -> b.u": 2000.0}, {"a.y -> b.u": 1.0})


def test_types_of_ssp_2(write: Write) -> None:
    values = (
        '<ssv:Parameter name="a.y0"><ssv:Float64 value="1"/></ssv:Parameter>'
        '<ssv:Parameter name="a.add"><ssv:Int32 value="3"/></ssv:Parameter>'
    )
    path = write(A, values=bound(values), version="2.0")
    assert read_ssp(path, 0.01).raw == {"a.y0": 1.0, "a.add": 3}
    assert end_of(path) == pytest.approx(DECAY + 3.0 * (1.0 - DECAY), rel=1e-12)


def test_steps_of_the_annotations(write: Write) -> None:
    three = OMS.format('name="solver1" method="oms_ma" fixedStepSize="0.02"/>')
    elements = LAG.format("a", OMS.format('name="solver1"/>'))
    assert read_ssp(write(elements, values=Y0, end=three)).step == 0.02
    assert read_ssp(write(A, values=Y0, end=OMS.format(VARIABLE))).check() == [
        "the archive names no communication step: give it by --step, for example --step 1ms"
    ]


def test_a_file_with_a_blank_in_its_name(write: Write, foreign: Foreign) -> None:
    elements = A.replace("resources/lag.fmu", "resources/my%20lag.fmu")
    path = write(elements, values=Y0, files={"resources/my lag.fmu": foreign("lag")})
    assert end_of(path) == pytest.approx(DECAY, rel=1e-12)


def test_what_the_schema_forbids_but_can_be_read(write: Write) -> None:
    path = write(A, values=PORT.format("C1", "input").replace('kind="input"', 'kind="input" type="Real"') + Y0)
    (said,) = read_ssp(path, 0.01).warnings()
    assert said.startswith("against the schema of SSP 1.0: SystemStructure.ssd, line ")
    assert "Element 'Connector', attribute 'type': The attribute 'type' is not allowed" in said
    assert end_of(path) == pytest.approx(DECAY, rel=1e-12)


def test_a_namespace_that_is_no_address(write: Write) -> None:
    """One reader of XML takes it, the schema's own does not: refused, for its values would not be found."""
    values = VALUE_SET.format(real("a.y0", 1.0)).replace("http://ssp", "http://:ssp")
    with pytest.raises(InvalidConfigurationError, match=r"v\.ssv: xmlns:ssd: .* is not a valid URI"):
        read_ssp(write(A, "", FILE.format(""), files={"v.ssv": values}), 0.01)


REFUSED = {
    "no component": (("",), {}, "it has no component: there is nothing to run"),
    "a value of the schema": (
        (A, "", FILE.format("")),
        {"v.ssv": VALUE_SET.format('<ssv:Parameter name="a.y0"><ssv:Real val="1"/></ssv:Parameter>')},
        r"v\.ssv, line 1: Element 'Real', attribute 'val'[\s\S]*parameter 'a\.y0' = '': not a value of the type Real",
    ),
    "a mapping without a target": (
        (A, "", MAPPED),
        {"v.ssv": VALUE_SET.format(real("x", 1.0)), "m.ssm": MAPPING.format('<ssm:MappingEntry source="x"/>')},
        r"m\.ssm, line 1: .*'target' is required[\s\S]*parameter mapping: the entry of x has no target",
    ),
    "a value that nothing has": ((A, "", bound(real("a.gain", 1.0))), {}, r"parameter 'a\.gain': nothing has it"),
    "a table": (
        (A + '<ssd:Component name="t" type="text/csv" source="t.csv"/>', LINK.format("t", "u", "a", "u")),
        {"t.csv": "time,u\n0,1\n"},
        r"component 't': text/csv is not read, only FMUs are$",  # and not a word of its connection
    ),
    "model exchange": (
        (A.replace(' source="r', ' implementation="ModelExchange" source="r'),),
        {},
        "component 'a': it is to run as model exchange; the bench runs co-simulation",
    ),
    "two sources": (
        (A + B, LINK.format("a", "y", "b", "u") + LINK.format("b", "y", "b", "u")),
        {},
        r"b\.y -> b\.u: it is fed by a\.y -> b\.u already",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_refused_for_the_right_reason(write: Write, kind: str) -> None:
    content, files, words = REFUSED[kind]
    with pytest.raises(InvalidConfigurationError, match=words):
        read_ssp(write(*content, files=files), 0.01)


def test_times_of_an_experiment(write: Write) -> None:
    with pytest.raises(InvalidConfigurationError, match="its experiment begins at t = 2 s; a run of the bench begins"):
        read_ssp(write(A, times='startTime="2" stopTime="3"'), 0.01)
    system = read_ssp(write(A, times=""), 0.01)
    assert system.stop == 1.0 and system.warnings() == ["the archive names no stop time: the run ends at 1 s"]


def test_a_loop_of_direct_feedthrough(write: Write) -> None:
    """x = 0.5 y + 1, y = 0.5 x: refused in order; coupled in parallel each takes the other's value before the step."""
    gain = A.replace("lag.fmu", "gain.fmu").replace('name="a"', 'name="{}"')
    values = bound(real("x.factor", 0.5) + real("x.offset", 1.0) + real("y.factor", 0.5))
    path = write(
        gain.format("x") + gain.format("y"), LINK.format("x", "y", "y", "u") + LINK.format("y", "y", "x", "u"), values
    )
    with zipfile.ZipFile(path, "a") as z:
        z.writestr("resources/gain.fmu", gain_fmu(None))
    system = read_ssp(path, 0.1)
    with pytest.raises(AlgebraicLoopError, match=r"algebraic loop: [\s\S]*--coupling parallel"):
        run(system)
    system = read_ssp(path, 0.1)
    system.coupling = "parallel"
    found = {e: run(system, engine=e).channels for e in ("native", "reference")}
    x, y = (found["native"][f"{n}.y"] for n in "xy")
    assert len(x) == 6
    np.testing.assert_array_equal(x[1:], 0.5 * y[:-1] + 1.0)
    np.testing.assert_array_equal(y[1:], 0.5 * x[:-1])
    assert all(np.array_equal(c, found["reference"][n]) for n, c in found["native"].items())
