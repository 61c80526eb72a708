"""Archives of other tools: nested systems, their connectors, units, offsets, parameter mappings; what is refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from archives import LAG, bound, real, write_archive
from commanding import Command

from gyrobench.engine.session import run
from gyrobench.exchange.ssp_import import read_ssp
from gyrobench.system.system import InvalidConfigurationError

Foreign = Callable[[str], Path]
INNER = """<ssd:System name="inner">
  <ssd:Connectors>
    <ssd:Connector name="in" kind="input"><ssc:Real/></ssd:Connector>
    <ssd:Connector name="out" kind="output"><ssc:Real/></ssd:Connector>
    <ssd:Connector name="tau" kind="parameter"><ssc:Real/></ssd:Connector>
  </ssd:Connectors>
  <ssd:Elements>{lag}</ssd:Elements>
  <ssd:Connections>
    <ssd:Connection startConnector="in" endElement="l" endConnector="u"/>
    <ssd:Connection startElement="l" startConnector="y" endElement="" endConnector="out">
      <ssc:LinearTransformation factor="3" offset="0.5"/></ssd:Connection>
    <ssd:Connection startConnector="tau" endElement="l" endConnector="T"/>
  </ssd:Connections>
</ssd:System>"""
INTO = """<ssd:Connection startElement="a" startConnector="y" endElement="inner" endConnector="in">
  <ssc:LinearTransformation factor="2" offset="1"/></ssd:Connection>"""
OUT_OF = '<ssd:Connection startElement="inner" startConnector="out" endElement="b" endConnector="u"/>'
FIXED = """<ssd:Annotations><ssc:Annotation type="org.openmodelica"><oms:Annotations xmlns:oms="x">
  <oms:SimulationInformation><oms:FixedStepMaster stepSize="0.02"/></oms:SimulationInformation></oms:Annotations>
</ssc:Annotation></ssd:Annotations>"""


@pytest.fixture
def archive(foreign: Foreign, tmp_path: Path) -> Callable[..., Path]:
    return lambda *content, **more: write_archive(
        tmp_path / "x.ssp", {"resources/lag.fmu": foreign("lag")}, *content, **more
    )


def test_nested_systems_transformations_and_their_parameters(archive: Callable[..., Path]) -> None:
    # a.y -> 2 y + 1 -> inner.l -> 3 y + 0.5 -> b; values by the names of an outer system go before inner ones
    elements = LAG.format("a", bound(real("y0", 7.0))) + INNER.format(lag=LAG.format("l", "")) + LAG.format("b", "")
    values = bound(real("a.y0", 1.0) + real("inner.tau", 0.05) + real("b.T", 0.2))
    system = read_ssp(archive(elements, INTO + OUT_OF, values, end=FIXED))
    assert system.step == 0.02
    assert list(system.slots) == ["a", "inner_l", "b"]
    e = {n: -math.expm1(-0.02 / t) for n, t in {"a": 0.1, "l": 0.05, "b": 0.2}.items()}
    a, m, b = 1.0, 0.0, 0.0
    for _ in range(25):
        a += (0.0 - a) * e["a"]
        m += (2.0 * a + 1.0 - m) * e["l"]
        b += (3.0 * m + 0.5 - b) * e["b"]
    system = read_ssp(archive(elements, INTO + OUT_OF, values, end=FIXED), step=0.02)
    type(system).channels = ("a.y", "inner_l.y", "b.y")
    type(system).channel_period = 0.5
    found = run(system)
    np.testing.assert_allclose([found.channels[f"{n}.y"][-1] for n in ("a", "inner_l", "b")], [a, m, b], rtol=1e-12)


def test_units_of_connectors(archive: Callable[..., Path]) -> None:
    # the FMU declares no units; the archive says degC out of a and K into b: + 273.15; and furlong by its own list
    out = '<ssd:Connectors><ssd:Connector name="y" kind="output"><ssc:Real unit="{}"/></ssd:Connector></ssd:Connectors>'
    into = '<ssd:Connectors><ssd:Connector name="u" kind="input"><ssc:Real unit="{}"/></ssd:Connector></ssd:Connectors>'
    units = (
        '<ssd:Units><ssc:Unit name="Celsius"><ssc:BaseUnit K="1" offset="273.15"/></ssc:Unit>'
        '<ssc:Unit name="furlong"><ssc:BaseUnit m="1" factor="201.168"/></ssc:Unit></ssd:Units>'
    )
    link = '<ssd:Connection startElement="a" startConnector="y" endElement="b" endConnector="u"{}/>'
    for a, b, attributes, expected in (
        ("Celsius", "K", "", (1.0, 273.15)),
        ("furlong", "m", "", (201.168, 0.0)),
        ("furlong", "m", ' suppressUnitConversion="true"', (1.0, 0.0)),
    ):
        elements = LAG.format("a", out.format(a)) + LAG.format("b", into.format(b))
        system = read_ssp(archive(elements, link.format(attributes), units=units), 0.01)
        wire = "a.y -> b.u"
        assert (system.factors.get(wire, 1.0), system.offsets.get(wire, 0.0)) == pytest.approx(expected, rel=1e-15)
    elements = LAG.format("a", out.format("furlong")) + LAG.format("b", into.format("K"))
    with pytest.raises(InvalidConfigurationError, match=r"a\.y -> b\.u: furlong into K: the dimensions differ"):
        read_ssp(archive(elements, link.format(""), units=units), 0.01)


def test_parameter_mappings(archive: Callable[..., Path]) -> None:
    """With a mapping only its entries count; a factor and a unit are applied; a prefix belongs to the source."""
    entry = (
        '<ssm:MappingEntry source="set.tau" target="a.T"><ssc:LinearTransformation factor="0.5"/></ssm:MappingEntry>'
    )
    values = bound(real("tau", 80.0, "ms") + real("T", 9.0), entry, 'prefix="set."')
    elements = LAG.format("a", "")
    system = read_ssp(archive(elements, values=values), 0.01)
    assert system.raw == {"a.T": pytest.approx(0.04, rel=1e-15)}  # T is declared in s: 80 ms / 2
    assert run(system).run.parameters["a.T"] == pytest.approx(0.04, rel=1e-15)
    with pytest.raises(InvalidConfigurationError, match=r"no parameter 'tau' in the set for a\.T"):
        read_ssp(archive(elements, values=bound(real("t", 1.0), entry.replace("set.tau", "tau"))), 0.01)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (bound(real("a.TT", 1.0)), r"parameter 'a\.TT': nothing has it; nearest: a\.T"),
        (bound(real("c.T", 1.0)), r"parameter 'c\.T': nothing has it; nearest: a\.T"),
        (bound(real("a.T", 1.0, "m")), "m into s: the dimensions differ"),
        (
            bound('<ssv:Parameter name="a.T"><ssv:String value="x"/></ssv:Parameter>'),
            r"a\.T: a value of the type String",
        ),
        ('<ssd:ParameterBindings><ssd:ParameterBinding source="no.ssv"/></ssd:ParameterBindings>', "no such file"),
    ],
)
def test_values_that_are_refused(archive: Callable[..., Path], values: str, words: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=words):
        read_ssp(archive(LAG.format("a", ""), values=values), 0.01)


@pytest.mark.long
def test_a_missing_step_is_asked_for(archive: Callable[..., Path], command: Command, tmp_path: Path) -> None:
    path = archive(LAG.format("a", ""), values=bound(real("a.y0", 1.0)))
    code, _, err = command("run", path, "--out", tmp_path / "run")
    assert code == 2
    assert "the archive names no communication step: give it by --step, for example --step 1ms" in err
    assert command("run", path, "--step", "1ms", "--out", tmp_path / "run")[0] == 0


def test_what_is_not_read_is_refused(archive: Callable[..., Path]) -> None:
    dictionary = '<ssd:SignalDictionaryReference name="bus" dictionary="d"/>'
    package = '<ssd:Component name="p" type="application/x-ssp-package" source="p.ssp"/>'
    with pytest.raises(InvalidConfigurationError) as caught:
        read_ssp(archive(LAG.format("a", "") + dictionary + package), 0.01)
    assert "'bus': a SignalDictionaryReference is not read" in str(caught.value)
    assert "component 'p': application/x-ssp-package is not read, only FMUs are" in str(caught.value)


def test_numbers_that_are_none(archive: Callable[..., Path]) -> None:
    elements = LAG.format("a", "") + LAG.format("b", "")
    link = '<ssd:Connection startElement="a" startConnector="y" endElement="b" endConnector="u">'
    bad = f'{link}<ssc:LinearTransformation factor="x"/></ssd:Connection>'
    with pytest.raises(InvalidConfigurationError, match="not an archive that can be read: could not convert"):
        read_ssp(archive(elements, bad), 0.01)
