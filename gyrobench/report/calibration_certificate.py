"""Digital Calibration Certificate: the certificate as XML for machines, by the DCC schema 3.3.0 and D-SI 2.2.1 of PTB.

Values are in SI, with the unit in the form of D-SI (``\\radian\\second\\tothe{-1}``), expanded uncertainty, coverage
factor and probability; the text beside them has the printed unit.  The report and the digest of its manifest are named
in a statement, the certificate for people is attached.  Not stated, since a record has them not: quantity kinds of
QUDT, equipment item by item, electronic signatures within the XML.  DCC 3.3.0 of PTB, D-SI 2.2.1.
"""

from __future__ import annotations

import base64
import importlib.metadata
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence

from gyrobench import units
from gyrobench.bench import UsageError
from gyrobench.report.certificate_page import STATEMENTS, Certified, chosen
from gyrobench.report.laboratory import Laboratory
from gyrobench.report.numbers import write_number
from gyrobench.result import NO_VERDICT, Coefficient

DCC, SI = "https://ptb.de/dcc", "https://ptb.de/si"
VERSION = "3.3.0"
LOCATION = f"{DCC} https://ptb.de/dcc/v{VERSION}/dcc.xsd"
BASE = ("kilogram", "metre", "second", "ampere", "kelvin", "mole", "candela", "radian")  # in the order of units.BASE
DECIBEL = "\\decibel"
PROBABILITY = "0.95"
DATE = re.compile(r"\d{4}-\d\d-\d\d(?=T|$)")
Say = Callable[[str], str | None]  # a text in the language of the certificate, None where it has none


def xml(
    of: Sequence[Certified], laboratory: Laboratory, number: str, pdf: bytes, code: str = "en", say: Say | None = None
) -> bytes:
    """Return the certificate of an instrument or a lot.  pdf: the certificate for people, attached.

    code, say: language of the certificate beside English.  Raises UsageError naming all that it needs and has not.
    """
    if problems := _lacking(of, laboratory):
        raise UsageError("\n".join(["no digital calibration certificate:", *(f"  - {p}" for p in problems)]))
    return _Writer(of, laboratory, number, code, say or (lambda text: None)).document(pdf)


def dsi(unit: str) -> tuple[float, str]:
    """Return the factor to SI and the unit of a printed one in D-SI: 4.8e-6, ``\\radian\\second\\tothe{-1}``.

    Raises UnitError.
    """
    if unit == "dB":
        return 1.0, DECIBEL
    known = units.unit(unit)
    if known.offset:
        raise units.UnitError(f"'{unit}' has a zero of its own")
    turned = [x[-1:] + x[:-1] for x in (BASE, known.exponents)]  # rad comes first, then what multiplies
    powers = sorted(((s, p) for s, p in zip(*turned, strict=True) if p), key=lambda power: power[1] < 0)
    parts = [f"\\{symbol}" + ("" if power == 1 else f"\\tothe{{{float(power):g}}}") for symbol, power in powers]
    return known.factor, "".join(parts) or "\\one"


def _lacking(of: Sequence[Certified], laboratory: Laboratory) -> list[str]:
    """Return what a record or the profile must state for a digital certificate."""
    found = [] if laboratory.country else ["the profile of the laboratory: country, two letters, as country = 'DE'"]
    for c in of:
        result, about = c.report.result, c.report.about
        if result.simulated:
            found.append(f"{c.instrument}: simulated data; no item was calibrated")
        if not DATE.match(about.date):
            found.append(f"{c.instrument}: the record states no date as 2026-03-12 (date = '{about.date}')")
        for x in chosen(c, laboratory):
            try:
                dsi(x.unit)
            except units.UnitError as error:
                found.append(f"{x.name} in '{x.unit}' has no unit in D-SI: {error}")
    return list(dict.fromkeys(found))


class _Writer:
    def __init__(self, of: Sequence[Certified], laboratory: Laboratory, number: str, code: str, say: Say) -> None:
        self.of, self.laboratory, self.number, self.code, self.say = of, laboratory, number, code, say

    def document(self, pdf: bytes) -> bytes:
        ET.register_namespace("dcc", DCC)
        ET.register_namespace("si", SI)
        ET.register_namespace("xsi", "http://www.w3.org/2001/XMLSchema-instance")
        root = ET.Element(_dcc("digitalCalibrationCertificate"), {"schemaVersion": VERSION})
        root.set("{http://www.w3.org/2001/XMLSchema-instance}schemaLocation", LOCATION)
        self._administration(_add(root, "administrativeData"))
        results = _add(root, "measurementResults")
        for k, c in enumerate(self.of, 1):
            self._result(_add(results, "measurementResult", refId=f"item{k}"), c)
        file = _add(root, "document")
        _add(file, "fileName", f"certificate-{self.number.replace('/', '-')}.pdf")
        _add(file, "mimeType", "application/pdf")
        _add(file, "dataBase64", base64.b64encode(pdf).decode())
        ET.indent(root)
        text: bytes = ET.tostring(root, encoding="utf-8")
        return b'<?xml version="1.0" encoding="UTF-8"?>\n' + text + b"\n"

    def _text(self, parent: ET.Element, name: str, text: str, own: bool = False) -> ET.Element:
        """Add a text, in English and, unless it is the user's own, in the language of the certificate."""
        found = _add(parent, name)
        if own:
            _add(found, "content", text)
            return found
        _add(found, "content", text, lang="en")
        if self.code != "en" and (said := self.say(text)):
            _add(found, "content", said, lang=self.code)
        return found

    def _administration(self, data: ET.Element) -> None:
        software = _add(_add(data, "dccSoftware"), "software")
        self._text(software, "name", "gyrobench", own=True)
        _add(software, "release", importlib.metadata.version("gyrobench"))
        _add(software, "type", "application")
        self._core(_add(data, "coreData"))
        items = _add(data, "items")
        for k, c in enumerate(self.of, 1):
            item = _add(items, "item", id=f"item{k}")
            self._text(item, "name", c.instrument, own=True)
            identification = _add(_add(item, "identifications"), "identification")
            _add(identification, "issuer", "other")
            _add(identification, "value", _word(c.instrument))
            self._text(identification, "name", "Name in the record of the test")
        laboratory = _add(data, "calibrationLaboratory")
        if self.laboratory.accreditation:
            _add(laboratory, "calibrationLaboratoryCode", _word(self.laboratory.accreditation))
        self._contact(_add(laboratory, "contact"), self.laboratory.name, self.laboratory.address)
        persons = _add(data, "respPersons")
        for k, s in enumerate(self.laboratory.signatories):
            person = _add(persons, "respPerson")
            self._text(_add(person, "person"), "name", s.name or s.role, own=True)
            _add(person, "role", _word(s.role))
            _add(person, "mainSigner", str(k == len(self.laboratory.signatories) - 1).lower())
        customers = list(dict.fromkeys(c.report.about.customer for c in self.of if c.report.about.customer))
        self._contact(_add(data, "customer"), "; ".join(customers) or "not stated", [])
        self._statements(_add(data, "statements"))

    def _core(self, core: ET.Element) -> None:
        dates = sorted(DATE.findall(c.report.about.date)[0] for c in self.of)
        languages = list(dict.fromkeys(("en", self.code)))
        _add(core, "countryCodeISO3166_1", self.laboratory.country)
        for code in languages:
            _add(core, "usedLangCodeISO639_1", code)
        _add(core, "mandatoryLangCodeISO639_1", self.code)
        _add(core, "uniqueIdentifier", _word(self.number))
        _add(core, "beginPerformanceDate", dates[0])
        _add(core, "endPerformanceDate", dates[-1])
        _add(core, "performanceLocation", "laboratory")

    def _contact(self, contact: ET.Element, name: str, address: Sequence[str]) -> None:
        self._text(contact, "name", name, own=bool(address))
        location = _add(contact, "location")
        if not address:
            self._text(location, "further", "not stated")
            return
        further = _add(location, "further")
        for line in address:
            _add(further, "content", line)
        _add(location, "countryCode", self.laboratory.country)

    def _statements(self, statements: ET.Element) -> None:
        for text in STATEMENTS:
            self._text(_add(statements, "statement"), "declaration", text)
        for text in self.laboratory.statements:
            self._text(_add(statements, "statement"), "declaration", text, own=True)
        for c in self.of:
            statement = _add(statements, "statement", refType="gyrobench_manifest")
            self._text(statement, "name", "Full report, part of this certificate")
            _add(statement, "reference", f"report {c.report.report_id}")
            _add(statement, "reference", f"SHA-256 of its manifest.json: {c.digest}")
            for _, text in dict.fromkeys(c.remarks):
                remark = _add(statements, "statement", refType="gyrobench_remark")
                self._text(remark, "declaration", text)

    def _result(self, found: ET.Element, c: Certified) -> None:
        result = c.report.result
        self._text(found, "name", result.title)
        method = _add(_add(found, "usedMethods"), "usedMethod")
        self._text(method, "name", result.method)
        for source in result.sources:
            _add(method, "reference", _word(source))
        one = _add(_add(found, "results"), "result")
        self._text(one, "name", "Coefficients")
        data = _add(one, "data")
        for x in chosen(c, self.laboratory):
            self._quantity(_add(data, "quantity"), x)
        if result.verdict != NO_VERDICT:
            meta = _add(_add(found, "measurementMetaData"), "metaData")
            self._text(meta, "declaration", f"Verdict: {result.verdict}. Decision rule: {result.decision_rule}")
            if result.verdict in ("pass", "fail"):
                _add(meta, "conformity", result.verdict)

    def _quantity(self, quantity: ET.Element, c: Coefficient) -> None:
        self._text(quantity, "name", c.meaning)
        if c.no_value:
            self._text(quantity, "noQuantity", f"No value of {c.name}: {c.no_value}.")
            return
        printed = f"{c.name} = {write_number(c.estimate, c.u).text} ± {write_number(c.k * c.u, c.u).text} {c.unit}"
        _add(_add(quantity, "description"), "content", printed)
        factor, unit = dsi(c.unit)
        real = _add(quantity, "real", space=SI)
        for name, text in (("label", c.name), ("value", repr(c.estimate * factor)), ("unit", unit)):
            _add(real, name, text, space=SI)
        uncertainty = _add(real, "measurementUncertaintyUnivariate", space=SI)
        if c.k < 1.0:  # of a mixture, which the schema has not
            _add(_add(uncertainty, "standardMU", space=SI), "valueStandardMU", repr(abs(c.u * factor)), space=SI)
            return
        expanded = _add(uncertainty, "expandedMU", space=SI)
        _add(expanded, "valueExpandedMU", repr(abs(c.k * c.u * factor)), space=SI)
        _add(expanded, "coverageFactor", repr(c.k), space=SI)
        _add(expanded, "coverageProbability", PROBABILITY, space=SI)


def _word(text: str) -> str:
    """Return a text as the schema wants one: not empty, no space at its ends."""
    return " ".join(text.split()) or "-"


def _dcc(name: str) -> str:
    return f"{{{DCC}}}{name}"


def _add(parent: ET.Element, name: str, text: str = "", space: str = DCC, **attributes: str) -> ET.Element:
    element = ET.SubElement(parent, f"{{{space}}}{name}", attributes)
    element.text = text or None
    return element
