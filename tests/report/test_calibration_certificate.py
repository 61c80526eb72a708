"""The digital certificate says what the certificate says, in SI, and by the schema where that is at hand."""

from __future__ import annotations

import base64
import os
import random
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest
from certified import certified
from lxml import etree

from gyrobench.bench import UsageError
from gyrobench.report.calibration_certificate import DCC, SI, dsi, xml
from gyrobench.report.certificate_page import Certified, spoken
from gyrobench.report.laboratory import Laboratory
from gyrobench.units import UnitError

LABORATORY = Laboratory.model_validate(
    {
        "name": "Inertial laboratory",
        "address": ["Example street 1", "Example town"],
        "country": "DE",
        "accreditation": "X",
    }
)
NAMES = {"dcc": DCC, "si": SI}
#: folder with dcc.xsd 3.3.0, its imports found from it; it is free (LGPL 3) and no part of the bench
SCHEMA = os.environ.get("GYROBENCH_DCC_SCHEMA", "")
#: children that the schema requires, in its order; those in brackets may be missing
ORDER = {
    "digitalCalibrationCertificate": "administrativeData measurementResults [document]",
    "administrativeData": "dccSoftware coreData items calibrationLaboratory respPersons customer [statements]",
    "coreData": "countryCodeISO3166_1 usedLangCodeISO639_1 [usedLangCodeISO639_1] mandatoryLangCodeISO639_1 "
    "uniqueIdentifier beginPerformanceDate endPerformanceDate performanceLocation",
    "software": "name release type",
    "item": "name identifications",
    "identification": "issuer value name",
    "calibrationLaboratory": "[calibrationLaboratoryCode] contact",
    "contact": "name location",
    "customer": "name location",
    "respPerson": "person role mainSigner",
    "measurementResult": "name usedMethods results [measurementMetaData]",
    "result": "name data",
    "quantity": "name [noQuantity] [description] [real]",
    "real": "label value unit measurementUncertaintyUnivariate",
    "expandedMU": "valueExpandedMU coverageFactor coverageProbability",
    "document": "fileName mimeType dataBase64",
}  # fmt: skip


def read(of: list[Certified], **more: object) -> ET.Element:
    return ET.fromstring(xml(of, LABORATORY, "2026-1", b"%PDF", **more))  # type: ignore[arg-type]


def name(element: ET.Element) -> str:
    return element.tag.rpartition("}")[2]


def check_structure(root: ET.Element) -> None:
    for element in root.iter():
        children = [name(c) for c in element]
        if name(element) in ORDER:
            left = list(children)
            for wanted in ORDER[name(element)].split():
                if left and left[0] == wanted.strip("[]"):
                    left.pop(0)
                else:
                    assert wanted.startswith("["), f"{name(element)}: {children}"
            assert not left, f"{name(element)}: {children}"
        text = (element.text or "").strip()
        assert bool(children) != bool(text), f"{name(element)} is empty, or has text beside elements"


@pytest.mark.parametrize("count", [1, 3])
def test_structure_and_schema(count: int) -> None:
    made = xml([certified(k) for k in range(count)], LABORATORY, "2026-1", b"%PDF")
    check_structure(ET.fromstring(made))
    if SCHEMA:  # else the next test says so
        etree.XMLSchema(etree.parse(Path(SCHEMA) / "dcc.xsd")).assertValid(etree.fromstring(made))


def test_schema_at_hand() -> None:
    if not SCHEMA:
        pytest.skip("GYROBENCH_DCC_SCHEMA names no folder with dcc.xsd of PTB: checked by the order of elements alone")
    assert 'version="3.3.0"' in (Path(SCHEMA) / "dcc.xsd").read_text("utf-8")


def test_values_in_si_with_expanded_uncertainty() -> None:
    """1 °/h is π/180/3600 rad/s."""
    made = certified(0)
    c = made.report.result["ω_d"]
    (real,) = read([made]).iter(f"{{{SI}}}real")
    to_si = 3.141592653589793 / 180.0 / 3600.0
    assert float(real.findtext("si:value", "", NAMES)) == pytest.approx(c.estimate * to_si, rel=1e-12)
    assert real.findtext("si:unit", "", NAMES) == "\\radian\\second\\tothe{-1}"
    expanded = next(real.iter(f"{{{SI}}}expandedMU"))
    assert float(expanded.findtext("si:valueExpandedMU", "", NAMES)) == pytest.approx(c.k * c.u * to_si, rel=1e-12)
    assert [float(x.text or "") for x in list(expanded)[1:]] == [c.k, 0.95]


def test_digest_certificate_and_remarks_are_there() -> None:
    made = certified(0)
    root = read([made])
    said = ["".join(s.itertext()) for s in root.iter(f"{{{DCC}}}statement")]
    assert any(made.digest in s and made.report.report_id in s for s in said)
    assert all(any(text in s for s in said) for _, text in made.remarks) and made.remarks
    assert base64.b64decode(root.findtext(".//dcc:dataBase64", "", NAMES)) == b"%PDF"


def test_verdicts_of_the_schema_alone() -> None:
    failed = read([certified(0, verdict="fail", decision_rule="Guard band.")])
    assert failed.findtext(".//dcc:conformity", "", NAMES) == "fail"
    open_ = read([certified(0, verdict="inconclusive")])
    assert open_.find(".//dcc:conformity", NAMES) is None and "Verdict: inconclusive" in ET.tostring(open_, "unicode")


def test_no_value_is_said_and_a_small_k_is_no_expanded_uncertainty() -> None:
    one = certified(0).report.result["ω_d"]
    void = read([certified(0, coefficients=[replace(one, no_value="not settled")])])
    assert "not settled" in "".join(void.find(".//dcc:noQuantity", NAMES).itertext())  # type: ignore[union-attr]
    small = read([certified(0, coefficients=[replace(one, k=0.9)])])
    assert float(small.findtext(".//si:valueStandardMU", "", NAMES)) == pytest.approx(one.u * dsi("°/h")[0])


def test_both_languages() -> None:
    of = [certified(0)]
    with spoken(of, LABORATORY, "1", "zh", None) as words:
        assert words is not None
        root = read(of, code="zh", say=words.find)
    names = root.find(".//dcc:quantity/dcc:name", NAMES)
    assert names is not None and [c.get("lang") for c in names] == ["en", "zh"]
    check_structure(root)


def test_all_that_is_lacking_is_named() -> None:
    with pytest.raises(UsageError) as error:
        xml([certified(0, simulated=True)], LABORATORY.model_copy(update={"country": ""}), "1", b"")
    text = str(error.value)
    assert "country, two letters" in text and "KG-0: simulated data; no item was calibrated" in text


@pytest.mark.parametrize(
    ("unit", "form"),
    [
        ("1", "\\one"), ("°/h/g", "\\radian\\second\\metre\\tothe{-1}"), ("dB", "\\decibel"),
        ("°/√h", "\\radian\\second\\tothe{-0.5}"),
        ("N·m/rad", "\\kilogram\\metre\\tothe{2}\\radian\\tothe{-1}\\second\\tothe{-2}"),
    ],
)  # fmt: skip
def test_units_of_dsi(unit: str, form: str) -> None:
    assert dsi(unit)[1] == form


def test_no_unit_is_made_up() -> None:
    draw = random.Random(3)
    with pytest.raises(UnitError):
        dsi("".join(draw.choices("qxz", k=5)))
