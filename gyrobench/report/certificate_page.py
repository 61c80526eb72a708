"""The certificate of a test: one or two pages of what a laboratory answers for, of one instrument or of a lot.

Its figures are those of the reports, whose ids and digests it names.  Nothing that a report warns of is left out.
[ISO/IEC 17025, 7.8.2 to 7.8.4, 7.8.6]
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gyrobench.bench import UsageError
from gyrobench.report.laboratory import SIGNATORIES, Laboratory
from gyrobench.report.language import Language, system_folder, used
from gyrobench.report.numbers import FormattedNumber, write_number
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    Page,
    PageTable,
    Row,
    Section,
    Signatures,
    Text,
    columns,
    text_cell,
)
from gyrobench.report.plain_text import no_values
from gyrobench.report.report_files import own_texts
from gyrobench.report.result_json import Report
from gyrobench.report.result_page import date, place, what_u_is
from gyrobench.report.standard_names import names_table
from gyrobench.report.tables import limit_text
from gyrobench.result import NO_VERDICT, Coefficient, Result

Known = Callable[[str], bool]  # whether a text can be said in the language of the certificate

Charts = Callable[[Sequence["Certified"], Laboratory], list[Any]]  # blocks of a lot

NOT_PASSED = ("fail", "inconclusive", "void")
ACROSS = 5  # coefficients side by side in the table of a lot
STATEMENTS = (
    "The results relate only to the items named, in their condition at the time of the test.",
    "U is the expanded uncertainty: standard uncertainty times the coverage factor k, for a coverage probability of "
    "about 95 % [GUM].",
    "This certificate shall not be reproduced except in full without approval of the laboratory.",
)
IN_REPORT = "see the report"  # of what has no translation: never half of a sentence, never left out
ESTIMATES = "Estimates with their expanded uncertainty U = k u"
SIMULATED = "All data are simulated: no item was tested, and no traceability is claimed."


@dataclass(frozen=True)
class Certified:
    """A report that a certificate speaks of.  digest: SHA-256 of its manifest."""

    report: Report[Result]
    digest: str

    @property
    def instrument(self) -> str:
        """The instrument; of a record that does not name it the file of its data, so that those of a lot differ."""
        data = getattr(self.report.about, "data", None)
        return self.report.result.instrument or (data.file if data else "") or "not named"

    @property
    def remarks(self) -> list[tuple[str, str]]:
        """Return id and sentence of every warning, of why a verdict is withheld, of why there is no value."""
        result = self.report.result
        reasons = [r for s in (("error", "warning"), ("doubt",)) for r in result.reasons if r.severity in s]
        none = no_values((c.name, c.no_value) for c in result.coefficients)
        return [*((r.id, r.text) for r in reasons), *(("no_value", text) for text in none)]


def page(
    of: Sequence[Certified],
    laboratory: Laboratory,
    number: str = "",
    language: str = "",
    bench: Path | None = None,
    charts: Charts | None = None,
) -> Page:
    """Return the certificate of one report, or of a lot of the same test.  number: its own; "": that of the report.

    language: default that of the profile.  bench: whose systems have catalogues.  charts: drawn of a lot.  Raises
    UsageError for reports of different tests, and for a coefficient of the profile that the test has not.
    """
    with spoken(of, laboratory, number, language, bench) as words:
        drawn = charts(of, laboratory) if charts and len(of) > 1 else []
        made = _page(of, laboratory, number, words.has if words else lambda text: True, drawn)
        return words.page(made, "the certificate") if words else made


def spoken(
    of: Sequence[Certified], laboratory: Laboratory, number: str, language: str, bench: Path | None
) -> AbstractContextManager[Language | None]:
    """Return the language of a certificate, to be used, that knows the texts of laboratory and user."""
    own = {t for c in of for t in own_texts(c.report)[0]} | _own(laboratory) | {number}
    names = {t for c in of for t in own_texts(c.report)[1]}
    folder = system_folder(of[0].report.result.system, bench)
    return used(language or laboratory.language, folder, own - {""}, names)


def number_of(of: Sequence[Certified]) -> str:
    """Return the number of a certificate that was given none: the id of the report, of a lot with its count."""
    first = of[0].report.report_id
    return first if len(of) == 1 else f"{first}-{len(of)}"


def chosen(certified: Certified, laboratory: Laboratory) -> list[Coefficient]:
    """Return the coefficients of a report that the profile shows, in its order.  Raises UsageError."""
    return _chosen(certified, _names(certified.report.result, laboratory))


def _own(laboratory: Laboratory) -> set[str]:
    roles = {text for s in laboratory.signatories for text in (s.role, s.name)} - {s.role for s in SIGNATORIES}
    return {_address(laboratory), laboratory.accreditation, *laboratory.statements, *roles}


def _address(laboratory: Laboratory) -> str:
    lines = [laboratory.name, *laboratory.address]
    return ("，" if any("一" <= c <= "鿿" for line in lines for c in line) else ", ").join(lines)


def _page(of: Sequence[Certified], laboratory: Laboratory, number: str, known: Known, charts: list[Any]) -> Page:
    """Return the certificate in English, without what is not known in its language: that is in the reports."""
    first = of[0].report
    systems = sorted({c.report.result.system for c in of})
    if len(systems) > 1:
        raise UsageError(f"a certificate is of one test, the runs are of {', '.join(systems)}")
    names = _names(first.result, laboratory)
    number = number or number_of(of)
    results = _one(of[0], names, known) if len(of) == 1 else _lot(of, names)
    sections = [
        Section("Results", "results", [*results, *names_table(_chosen(of[0], names))]),
        Section("Control charts", "control", charts),
        Section("Conformity", "conformity", _conformity(of)),
        Section("Remarks", "remarks", _remarks(of, known)),
        Section("Reports", "reports", [_reports(of)]),
        Section("Statements and signatures", "signatures", [_signatures(of, laboratory)]),
    ]
    title = first.result.title if known(first.result.title) else first.result.system
    title = f"{'Simulated test' if _simulated(of) else 'Test certificate'}: {title}"
    return Page(
        title, number, _head(of, laboratory, number, known), sections, what="Certificate", logo=laboratory.picture
    ).finish()


def _said(text: str, known: Known) -> str:
    return text if known(text) else IN_REPORT


def _names(result: Result, laboratory: Laboratory) -> list[str]:
    there = [c.name for c in result.coefficients]
    if missing := [n for n in laboratory.coefficients if n not in there]:
        raise UsageError(f"coefficients of the profile: no {', '.join(missing)} in this test, but {', '.join(there)}")
    return laboratory.coefficients or there


def _head(of: Sequence[Certified], laboratory: Laboratory, number: str, known: Known) -> list[tuple[str, str]]:
    result = of[0].report.result
    same = {n: {getattr(c.report.about, n) for c in of} for n in ("customer", "conditions", "equipment", "operator")}
    stated = [(n.capitalize(), values.pop() if len(values) == 1 else "see the reports") for n, values in same.items()]
    items = [("Instrument", of[0].instrument)] if len(of) == 1 else [("Items", f"{len(of)}, see the first table")]
    dates = sorted({date(c.report.about.date or "not recorded") for c in of})
    return [
        ("Laboratory", _address(laboratory)),
        *([("Accreditation", laboratory.accreditation)] if laboratory.accreditation and not _simulated(of) else []),
        ("Certificate", number),
        *items,
        *((name, text or "not stated") for name, text in stated),
        ("Date of test", dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"),
        ("Site", place(result.site) or "not stated"),
        ("Method", _said(result.method, known)),
        ("Sources", _said("; ".join(result.sources), known)),
    ]


def _number(value: float | None, u: float | None) -> Cell:
    written: FormattedNumber = write_number(value, u)
    return Cell(written.text, written.whole, written.rest, written.full, "", "", True)


def _one(certified: Certified, names: Sequence[str], known: Known) -> list[PageTable]:
    """Return the table of one instrument: a row for each coefficient."""
    rows = []
    limits = any(c.limit is not None for c in certified.report.result.coefficients)
    for c in _chosen(certified, names):
        u = None if c.no_value else c.k * c.u
        cells = [
            text_cell(c.name, "strong"),
            text_cell(_said(c.meaning, known)),
            text_cell("no value", "warn") if c.no_value else _number(c.estimate, c.u),
            _number(u, c.u),
            _number(None if c.no_value else c.k, 0.05),
            text_cell(c.unit),
        ]
        rows.append(Row([*cells, *_judged(c, limits)]))
    heads = ["quantity", "meaning", "estimate", "U (95 %)", "k", "unit", *(["limit", "verdict"] if limits else [])]
    return [PageTable(columns(*heads, wide=("meaning",)), rows, f"{ESTIMATES}; u: {what_u_is(certified.report)}.")]


def _chosen(certified: Certified, names: Sequence[str]) -> list[Coefficient]:
    by_name = {c.name: c for c in certified.report.result.coefficients}
    return [by_name[n] for n in names if n in by_name]


def _judged(c: Coefficient, limits: bool) -> list[Cell]:
    if not limits:
        return []
    return [text_cell(limit_text(c.limit)), text_cell("–" if c.limit is None else c.verdict, c.verdict)]


def _lot(of: Sequence[Certified], names: Sequence[str]) -> list[PageTable]:
    """Return who of a lot passed and what failed, then the estimates, a row for each instrument."""
    rows = []
    for c in of:
        result = c.report.result
        failed = [f"{x.name} ({x.verdict})" for x in result.coefficients if x.verdict in NOT_PASSED]
        cells = [c.instrument, c.report.report_id, date(c.report.about.date or "not recorded")]
        last = [text_cell(result.verdict, result.verdict), text_cell(", ".join(failed) or "–")]
        rows.append(Row([text_cell(cells[0], "strong"), *map(text_cell, cells[1:]), *last]))
    heads = columns("instrument", "report", "date of test", "verdict", "not passed", wide=("not passed",))
    tables = [PageTable(heads, rows, "The lot.")]
    kinds = "; ".join(dict.fromkeys(what_u_is(c.report) for c in of))
    caption = f"{ESTIMATES}; limits and k are in the reports; u: {kinds}."
    for start in range(0, len(names), ACROSS):
        shown = names[start : start + ACROSS]
        units = {c.name: c.unit for c in of[0].report.result.coefficients}
        rows = [Row([text_cell(c.instrument, "strong"), *_values(c, shown)]) for c in of]
        heads = columns("instrument", *((n, units[n]) for n in shown))
        tables.append(PageTable(heads, rows, caption, small=True))
    return tables


def _values(certified: Certified, names: Sequence[str]) -> list[Cell]:
    by_name = {c.name: c for c in certified.report.result.coefficients}
    return [_value(by_name[n]) if n in by_name else text_cell("–") for n in names]


def _value(c: Coefficient) -> Cell:
    if c.no_value:
        return text_cell("no value", "warn")
    mark = c.verdict if c.verdict in ("fail", "void") else ""
    return text_cell(f"{write_number(c.estimate, c.u).text} ± {write_number(c.k * c.u, c.u).text}", mark)


def _conformity(of: Sequence[Certified]) -> list[Text]:
    result = of[0].report.result
    if all(c.report.result.verdict == NO_VERDICT for c in of):
        return [Text("No specification was applied; conformity is not stated.")]
    rules = list(dict.fromkeys(c.report.result.decision_rule for c in of))
    verdicts = [c.report.result.verdict for c in of]
    said = f"Verdict: {result.verdict}." if len(of) == 1 else f"{verdicts.count('pass')} of {len(of)} passed."
    return [Text(said), *(Text(f"Decision rule: {rule}") for rule in rules if rule)]


def _remarks(of: Sequence[Certified], known: Known) -> list[BulletList]:
    """Return every warning of the reports and why a verdict is withheld, with the instruments that it is about."""
    said: dict[str, list[str]] = {}
    for c in of:
        for id, text in dict.fromkeys(c.remarks):
            said.setdefault(text if known(text) else f"Remark {id}: {IN_REPORT}.", []).append(c.instrument)
    items = [t if len(who) == len(of) else f"{', '.join(who)}: {t}" for t, who in said.items()]
    return [BulletList(items, warn=True)] if items else []


def _reports(of: Sequence[Certified]) -> PageTable:
    heads = columns("instrument", "report", "SHA-256 of its manifest", wide=("SHA-256 of its manifest",))
    rows = [Row([text_cell(c.instrument), text_cell(c.report.report_id), text_cell(c.digest, "hash")]) for c in of]
    return PageTable(heads, rows, "The full reports, part of this certificate: data, model, budget.", small=True)


def _signatures(of: Sequence[Certified], laboratory: Laboratory) -> Signatures:
    """Return the statements and who signs; what the laboratory states of measurements is not said of simulated data."""
    simulated = _simulated(of)
    said = [SIMULATED, *STATEMENTS] if simulated else [*STATEMENTS, *laboratory.statements]
    return Signatures(said, [(s.role, s.name) for s in laboratory.signatories])


def _simulated(of: Sequence[Certified]) -> bool:
    return any(c.report.result.simulated for c in of)
