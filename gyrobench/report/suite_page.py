"""Report page of a suite: measurands by method, and consistency of the methods."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gyrobench.record.run_document import SuiteTestRun
from gyrobench.report import method_section, result_page
from gyrobench.report.numbers import write_number, write_p
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    CollapsedBlocks,
    Column,
    Page,
    PageTable,
    Picture,
    Pictures,
    ResultSummary,
    Row,
    Section,
    Text,
    number_cell,
    text_cell,
)
from gyrobench.report.references import source_blocks
from gyrobench.report.result_json import Report, value_at
from gyrobench.report.signature_section import signing
from gyrobench.report.style import BLUE, HALF, INK, MUTED, VERMILION, axis_label, chart, styled, svg
from gyrobench.report.tables import compact, heading
from gyrobench.result import NO_VERDICT, SuiteResult
from gyrobench.result_suite import SuiteMember, SuiteQuantity

LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


def page(report: Report[SuiteResult]) -> Page:
    """Return the page of the report of a suite (see :mod:`gyrobench.reduction.suite.method_comparison`)."""
    with styled():
        sections = [
            Section("Result and conformity", "answer", [_answer(report)]),
            Section("Combined values", "coefficients", _combined(report)),
            Section("Comparison of methods", "methods", []),
            Section("Consistency", "consistency", _consistency(report), sub=True),
            Section("Measurands by method", "cross", _cross(report), sub=True),
            Section("Normalized errors between methods", "pairs", _pairs(report), sub=True),
            Section("Member tests", "tests", _tests(report)),
            Section("Method and provenance", "how", []),
            Section("Comparison and conventions", "model", _how(report.result), sub=True),
            Section("Provenance", "provenance", _provenance(report), sub=True),
            Section("Values at full precision", "values", method_section.full_values(report), sub=True),
            Section("Statements and signatures", "signatures", signing(report)),
        ]
    return Page(report.result.title, report.report_id, _head(report), sections).finish()


def _test(member: SuiteMember) -> SuiteTestRun:
    """Return what run.json says of a test."""
    return SuiteTestRun.model_validate(member.test)


def _head(report: Report[SuiteResult]) -> list[tuple[str, str]]:
    rows = [r for r in result_page.head(report) if r[0] != "Site" or report.result.site]
    members = report.result.suite.members
    dates = sorted(date for m in members if (date := _test(m).date))
    tests = ", ".join(f"{LETTERS[k % 26]} {m.label}" for k, m in enumerate(members))
    rows.insert(2, ("Test dates", " to ".join(dict.fromkeys(result_page.date(d) for d in (dates[:1] + dates[-1:])))))
    return [*rows, ("Tests", tests)]


def _answer(report: Report[SuiteResult]) -> ResultSummary:
    box, suite = result_page.answer(report), report.result.suite
    if report.result.verdict == NO_VERDICT:
        consistency = f"methods {suite.consistency}" if suite.tested else "consistency not tested"
        box.verdict = f"{consistency}; {box.verdict}"
    box.rule = " ".join(filter(None, [suite.rule, box.rule]))
    return box


def _combined(report: Report[SuiteResult]) -> list[Any]:
    text = (
        "Weighted mean over the methods that determine a measurand (generalized least squares with the full covariance "
        "of their values); the value of the method where only one determines it."
    )
    return [Text(text), *result_page.coefficients(report)]


def _letters(result: SuiteResult) -> dict[str, str]:
    return {m.label: LETTERS[k % 26] for k, m in enumerate(result.suite.members)}


def _consistency(report: Report[SuiteResult]) -> list[Any]:
    doc, suite, letters = report.document, report.result.suite, _letters(report.result)
    rows = []
    for k, q in enumerate(suite.quantities):
        if len(q.values) < 2:
            continue
        path: tuple[str | int, ...] = ("suite", "quantities", k)
        inconsistent = q.verdict == "disagree"
        cells = [
            text_cell(q.name, "strong"),
            text_cell("".join(letters[v.label] for v in q.values)),
            number_cell(doc, (*path, "Q"), significant=3),
            number_cell(doc, (*path, "dof")),
            number_cell(doc, (*path, "birge"), significant=3),
            number_cell(doc, (*path, "p"), write=write_p),
            number_cell(doc, (*path, "p_adjusted"), write=write_p, mark="warn" if inconsistent else ""),
            number_cell(doc, (*path, "largest E_n"), significant=3),
            text_cell(q.words, "warn" if inconsistent else ""),
        ]
        rows.append(Row(cells))
    if not rows:
        return [Text("No measurand is determined by two methods.")]
    heads = ("measurand", "methods", "Q", "dof", "Birge ratio", "p", "p, adjusted", "largest E_n")
    columns = [*(Column(h) for h in heads), Column("finding", wide=True)]
    caption = (
        "Consistency test of each measurand. Q: weighted sum of squared deviations from the weighted mean; p: of Q by "
        "Welch's test; p, adjusted: for the number of measurands (Holm). Letters: the member tests, as in the head."
    )
    failed = [f"{f.label} gave no result: {f.reason}" for f in suite.failed]
    return [PageTable(columns, rows, caption), *([BulletList(failed, warn=True)] if failed else [])]


def _cross(report: Report[SuiteResult]) -> list[Any]:
    doc, quantities = report.document, report.result.suite.quantities
    rows: list[Row] = []
    pictures = []
    some_b = any(v.u_b or v.u_shared for q in quantities for v in q.values)
    split = ("u_a", "u_b", "u_shared") if some_b else ()
    for k, q in enumerate(quantities):
        path: tuple[str | int, ...] = ("suite", "quantities", k)
        true = "" if q.truth is None else f"; truth {write_number(q.truth, significant=6).text}"
        rows.append(heading(f"{q.name} in {q.unit}{true}"))
        for j, v in enumerate(q.values):
            own = (*path, "values", j)
            cells = [
                text_cell(v.label),
                *(number_cell(doc, (*own, n), v.u) for n in ("estimate", "u", "U")),
                *(number_cell(doc, (*own, n), v.u) for n in split),
                number_cell(doc, (*own, "dof"), significant=3),
                number_cell(doc, (*own, "weight"), significant=3),
                text_cell(v.how),
            ]
            rows.append(Row(cells))
        if q.mean:
            u = q.mean.u
            mean = [number_cell(doc, (*path, "mean", n), u) for n in ("estimate", "u", "U")]
            rows.append(
                Row(
                    [text_cell("weighted mean", "strong"), *mean, *(text_cell("") for _ in (*split, 1, 2, 3))],
                    strong=True,
                )
            )
        if len(q.values) > 1:
            pictures.append(_forest(q, f"forest-{k + 1}"))
    heads = ["method", "estimate", "u", "U (95 %)", *("Type A", "Type B", "shared")[: len(split)], "dof", "weight"]
    columns = [*map(Column, heads), Column("source of the value", wide=True)]
    caption = (
        "Values of each measurand by every method that determines it. dof: degrees of freedom of the Type A "
        "component, a dash where they are infinite; weight: in the weighted mean."
    )
    if split:
        caption += " Type A, Type B, shared: components of u; shared: in several tests, see Method and provenance."
    return [Pictures(pictures), PageTable(columns, rows, caption, small=True)] if rows else []


def _forest(q: SuiteQuantity, key: str) -> Picture:
    """Return the estimates with 95 % intervals by method; the band is the weighted mean, dashed the truth."""
    values = q.values
    fig, ax = chart(HALF, 15 + 5.5 * len(values))
    mean = q.mean
    if mean:
        ax.axvspan(mean.estimate - mean.U, mean.estimate + mean.U, color=BLUE, alpha=0.15, linewidth=0)
        ax.axvline(mean.estimate, color=BLUE, linewidth=0.8)
    if q.truth is not None:
        ax.axvline(q.truth, color=INK, linestyle="--", linewidth=0.9)
    for i, v in enumerate(values):
        deviates = v.label == q.deviating
        colour = VERMILION if deviates else MUTED
        ax.plot([v.estimate - v.U, v.estimate + v.U], [i, i], "-", color=colour, linewidth=1.4)
        ax.plot([v.estimate], [i], "s" if deviates else "o", color=colour, markersize=4.5, markeredgewidth=0)
    ax.set_yticks(range(len(values)), [v.label for v in values])
    ax.set_ylim(len(values) - 0.4, -0.6)
    ax.locator_params(axis="x", nbins=4)
    ax.set_xlabel(axis_label(q.name if len(q.name) < 24 else q.name[:22] + "…", q.unit))
    truth = "; dashed: truth" if q.truth is not None else ""
    caption = f"{q.name}: estimates with 95 % coverage intervals; band: weighted mean with its interval{truth}."
    alt = f"{q.name} by {len(values)} methods, with intervals on one scale"
    return Picture(key, svg(fig, key), caption, alt, half=True)


def _pairs(report: Report[SuiteResult]) -> list[Any]:
    doc, pairs, letters = report.document, report.result.suite.pairs, _letters(report.result)
    if not pairs:
        return []
    worst: dict[tuple[str, str], int] = {}
    for k, p in enumerate(pairs):
        for both in ((p.a, p.b), (p.b, p.a)):
            if both not in worst or p.E_n > pairs[worst[both]].E_n:
                worst[both] = k
    compared = [n for n in letters if any(n in both for both in worst)]
    rows = []
    for a in compared:
        cells = [text_cell(f"{letters[a]} {a}", "strong")]
        for b in compared:
            k = worst.get((a, b), -1)
            apart = k >= 0 and pairs[k].E_n > 1.0
            cells.append(
                number_cell(doc, ("suite", "pairs", k, "E_n"), 0.01, mark="warn" if apart else "")
                if k >= 0
                else text_cell("–" if a == b else "")
            )
        rows.append(Row(cells))
    matrix = PageTable(
        [Column("largest E_n", wide=True), *(Column(letters[b]) for b in compared)], rows,
        "Largest normalized error E_n between two methods over all measurands that both determine; above 1 the values "
        "are inconsistent with their expanded uncertainties.",
    )  # fmt: skip
    pair_rows: list[Row] = []
    for name in dict.fromkeys(p.quantity for p in pairs):
        numbers = [k for k, p in enumerate(pairs) if p.quantity == name]
        pair_rows.append(heading(f"{name} in {pairs[numbers[0]].unit}"))
        for k in numbers:
            p = pairs[k]
            path: tuple[str | int, ...] = ("suite", "pairs", k)
            mark = "warn" if p.E_n > 1.0 else ""
            cells = [
                text_cell(f"{p.a} − {p.b}"),
                number_cell(doc, (*path, "difference"), p.U / 2.0 if p.U else None),
                number_cell(doc, (*path, "U"), p.U),
                number_cell(doc, (*path, "E_n"), 0.01, mark=mark),
            ]
            pair_rows.append(Row(cells))
    columns = [Column("pair", wide=True), Column("difference"), Column("U of the difference (95 %)"), Column("E_n")]
    table = PageTable(columns, pair_rows, "Normalized errors of all pairs.", small=True)
    return [matrix, CollapsedBlocks(f"All {len(pairs)} pairs", [table])]


def _tests(report: Report[SuiteResult]) -> list[Any]:
    rows, doc, members = [], report.document, report.result.suite.members
    for k, m in enumerate(members):
        path, test = ("suite", "members", k), _test(m)
        numbers = [
            number_cell(doc, (*path, name), significant=digits)
            for name, digits in (("duration", 6), ("phases", 4), ("windows", 4), ("residual_std", 3))
        ]
        date = result_page.date(test.date or "not recorded")
        texts = [text_cell(LETTERS[k % 26], "strong"), *map(text_cell, (m.title, test.report_id, date))]
        rows.append(Row([*texts, *numbers, text_cell(m.unit)]))
    columns = [Column(""), Column("test", wide=True), Column("report"), Column("date"), Column("duration", "s")]
    columns += [Column("phases"), Column("windows"), Column("residual"), Column("unit")]
    caption = "Member tests, each with a report of its own; residual: residual standard deviation of the windows."
    blocks: list[Any] = [PageTable(columns, rows, caption, small=True)]
    for k, m in enumerate(members):
        test = _test(m)
        where = f" Run and report in {test.folder}." if test.folder else ""
        text = f"{LETTERS[k % 26]}  {m.label}, report {test.report_id}. {m.method}.{where}"
        blocks.append(Text(text, link=f"{test.folder}/report.html" if test.folder else ""))
        sentences = [*m.summary] if report.result.site else [f"Site: {result_page.place(m.site)}.", *m.summary]
        if test.step_check is not None:
            worst = write_number(test.step_check, significant=2).text
            sentences.append(f"Halving the communication step changes no coefficient by more than {worst} u.")
        sentences += [f"Warning: {w}" for w in m.warnings]
        sentences += [] if test.complete else ["The record is incomplete."]
        if sentences:
            blocks.append(BulletList(sentences))
    return blocks


def _how(result: SuiteResult) -> list[Any]:
    suite = result.suite
    shared = (
        f"Errors shared by the tests: {', '.join(suite.shared)}. An equal shared error cancels in a difference; it "
        "is not reduced by averaging."
        if suite.shared
        else "No test states an uncertainty component in common with another test; all errors are treated as "
        "independent from test to test."
    )
    text = (
        "E_n = |a − b| / √(U_a² + U_b²), with the expanded uncertainties U (95 %, Student t for Type A) reduced by the "
        "components that both methods share [ISO 13528]. Random errors of different tests are independent, as each "
        "test has a record of its own."
    )
    blocks: list[Any] = [Text(text), Text(shared), BulletList(result.conventions)]
    rows = []
    for q in suite.quantities:
        if len(q.combination) > 1:
            sizes = {n: write_number(abs(x), significant=6).text for n, x in q.combination.items()}
            signs = {n: "−" if x < 0.0 else "+" for n, x in q.combination.items()}
            terms = " ".join(f"{signs[n]} {size} {n}" for n, size in sizes.items() if size != "0")
            rows.append(Row([text_cell(q.name, "strong"), text_cell(terms.removeprefix("+ "))]))
    if rows:
        caption = "Measurands that are combinations of coefficients (factors in powers of g)."
        blocks.append(PageTable([Column("measurand"), Column("combination", wide=True)], rows, caption))
    return [*blocks, *source_blocks(result.sources)]


def _provenance(report: Report[SuiteResult]) -> list[Any]:
    doc, run, members = report.document, report.suite, report.result.suite.members
    rows, hashes = [], []
    parts: dict[tuple[str, str, str, str], list[str]] = {}
    for k, m in enumerate(members):
        test = _test(m)
        changed = ", ".join(test.changed) or "nothing"
        cells = [
            text_cell(m.label, "strong"),
            number_cell(doc, ("suite", "members", k, "seed")),
            number_cell(doc, ("suite", "members", k, "step")),
            text_cell(test.engine),
            text_cell(_versions(test.versions)),
            text_cell(changed if len(changed) < 160 else changed[:157] + "…"),
        ]
        rows.append(Row(cells))
        for what, sha in (("record", test.record_sha256), ("result", test.result_sha256)):
            if sha:
                hashes.append(Row([text_cell(m.label, "strong"), text_cell(what), Cell(sha, mark="hash")]))
        if test.data:
            data = text_cell(compact(value_at(doc, "suite", "members", k, "data"), 90))
            hashes.append(Row([text_cell(m.label, "strong"), text_cell("data"), data]))
        for slot, p in test.parts.items():
            parts.setdefault((slot, p.name, p.version, p.sha256), []).append(LETTERS[k % 26])
    columns = [Column("test"), Column("seed"), Column("step", "s"), Column("engine"), Column("versions")]
    columns.append(Column("changed", wide=True))
    blocks: list[Any] = [PageTable(columns, rows, "Run settings of each test, with changed defaults.", small=True)]
    columns = [Column("test"), Column("file"), Column("SHA-256", wide=True)]
    blocks.append(PageTable(columns, hashes, "Records and results of the tests, with their hash.", small=True))
    if parts:
        rows = [
            Row(
                [
                    text_cell(slot, "strong", own=True),
                    *(text_cell(x, own=True) for x in (*about, "".join(who))),
                    Cell(sha, mark="hash"),
                ]
            )
            for (slot, *about, sha), who in sorted(parts.items())
        ]
        columns = [*map(Column, ("slot", "component", "version", "tests")), Column("SHA-256", wide=True)]
        blocks.append(PageTable(columns, rows, "Components of the simulated tests.", small=True))
    given = ", ".join(f"{n} = {v}" for n, v in run.changed.items())
    facts = [("set", given), ("seed of the suite", run.seed), ("versions", _versions(run.versions))]
    settings = [f"{name[0].upper()}{name[1:]}: {value}" for name, value in facts if value not in (None, "")]
    return [*blocks, *([Text("; ".join(settings) + ".", quiet=True)] if settings else [])]


def _versions(versions: Mapping[str, str] | None) -> str:
    return ", ".join(f"{k} {v}" for k, v in (versions or {}).items())
