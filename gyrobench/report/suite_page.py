"""Report page of a suite: measurands by method, and consistency of the methods."""

from __future__ import annotations

from typing import Any

from gyrobench.report import method_section, result_page
from gyrobench.report.numbers import write_number, write_p
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    CollapsedBlocks,
    Column,
    Page,
    Picture,
    Pictures,
    ResultSummary,
    Row,
    Section,
    Table,
    Text,
    number_cell,
    text_cell,
)
from gyrobench.report.references import source_blocks
from gyrobench.report.signature_section import signing
from gyrobench.report.style import BLUE, HALF, INK, MUTED, VERMILION, axis_label, figure, styled, svg
from gyrobench.report.tables import compact, heading
from gyrobench.result import NO_VERDICT

Json = dict[str, Any]
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


def page(doc: Json) -> Page:
    """Return the report of a suite's result document (see :mod:`gyrobench.reduction.suite.method_comparison`)."""
    with styled():
        sections = [
            Section("Result and conformity", "answer", [_answer(doc)]),
            Section("Combined values", "coefficients", _combined(doc)),
            Section("Comparison of methods", "methods", []),
            Section("Consistency", "consistency", _consistency(doc), sub=True),
            Section("Measurands by method", "cross", _cross(doc), sub=True),
            Section("Normalized errors between methods", "pairs", _pairs(doc), sub=True),
            Section("Member tests", "tests", _tests(doc)),
            Section("Method and provenance", "how", []),
            Section("Comparison and conventions", "model", _how(doc), sub=True),
            Section("Provenance", "provenance", _provenance(doc), sub=True),
            Section("Values at full precision", "values", method_section.full_values(doc), sub=True),
            Section("Statements and signatures", "signatures", signing(doc)),
        ]
    return Page(doc["title"], doc["report_id"], _head(doc), sections).finish()


def _head(doc: Json) -> list[tuple[str, str]]:
    rows = [r for r in result_page.head(doc) if r[0] != "Site" or doc["site"]]
    members = doc["suite"]["members"]
    dates = sorted(str(m["date"]) for m in members if m.get("date"))
    tests = ", ".join(f"{LETTERS[k % 26]} {m['label']}" for k, m in enumerate(members))
    rows.insert(2, ("Test dates", " to ".join(dict.fromkeys(result_page.date(d) for d in (dates[:1] + dates[-1:])))))
    return [*rows, ("Tests", tests)]


def _answer(doc: Json) -> ResultSummary:
    box = result_page.answer(doc)
    consistency = f"methods {doc['suite']['consistency']}" if doc["suite"]["tested"] else "consistency not tested"
    plain = doc["verdict"] == NO_VERDICT
    box.verdict = f"{consistency}; {doc['verdict']}" if plain else doc["verdict"]
    box.rule = " ".join(filter(None, [doc["suite"]["rule"], box.rule]))
    return box


def _combined(doc: Json) -> list[Any]:
    text = (
        "Weighted mean over the methods that determine a measurand (generalized least squares with the full covariance "
        "of their values); the value of the method where only one determines it."
    )
    return [Text(text), *result_page.coefficients(doc)]


def _letters(doc: Json) -> dict[str, str]:
    return {m["label"]: LETTERS[k % 26] for k, m in enumerate(doc["suite"]["members"])}


def _consistency(doc: Json) -> list[Any]:
    letters = _letters(doc)
    rows = []
    for k, q in enumerate(doc["suite"]["quantities"]):
        if len(q["values"]) < 2:
            continue
        path: tuple[str | int, ...] = ("suite", "quantities", k)
        inconsistent = q["verdict"] == "disagree"
        rows.append(
            Row(
                [
                    text_cell(q["name"], "strong"),
                    text_cell("".join(letters[v["label"]] for v in q["values"])),
                    number_cell(doc, (*path, "Q"), significant=3),
                    number_cell(doc, (*path, "dof")),
                    number_cell(doc, (*path, "birge"), significant=3),
                    number_cell(doc, (*path, "p"), write=write_p),
                    number_cell(doc, (*path, "p_adjusted"), write=write_p, mark="warn" if inconsistent else ""),
                    number_cell(doc, (*path, "largest E_n"), significant=3),
                    text_cell(q["words"], "warn" if inconsistent else ""),
                ]
            )
        )
    if not rows:
        return [Text("No measurand is determined by two methods.")]
    heads = ("measurand", "methods", "Q", "dof", "Birge ratio", "p", "p, adjusted", "largest E_n")
    columns = [*(Column(h) for h in heads), Column("finding", wide=True)]
    caption = (
        "Consistency test of each measurand. Q: weighted sum of squared deviations from the weighted mean; p: of Q by "
        "Welch's test; p, adjusted: for the number of measurands (Holm). Letters: the member tests, as in the head."
    )
    failed = [f"{f['label']} gave no result: {f['reason']}" for f in doc["suite"]["failed"]]
    return [Table(columns, rows, caption), *([BulletList(failed, warn=True)] if failed else [])]


def _cross(doc: Json) -> list[Any]:
    rows: list[Row] = []
    pictures = []
    some_b = any(v["u_b"] or v["u_shared"] for q in doc["suite"]["quantities"] for v in q["values"])
    split = ("u_a", "u_b", "u_shared") if some_b else ()
    for k, q in enumerate(doc["suite"]["quantities"]):
        path: tuple[str | int, ...] = ("suite", "quantities", k)
        true = "" if q["truth"] is None else f"; truth {write_number(q['truth'], significant=6).text}"
        rows.append(heading(f"{q['name']} in {q['unit']}{true}"))
        for j, v in enumerate(q["values"]):
            own = (*path, "values", j)
            rows.append(
                Row(
                    [
                        text_cell(v["label"]),
                        *(number_cell(doc, (*own, n), v["u"]) for n in ("estimate", "u", "U")),
                        *(number_cell(doc, (*own, n), v["u"]) for n in split),
                        number_cell(doc, (*own, "dof"), significant=3),
                        number_cell(doc, (*own, "weight"), significant=3),
                        text_cell(v["how"]),
                    ]
                )
            )
        if q["mean"]:
            u = q["mean"]["u"]
            mean = [number_cell(doc, (*path, "mean", n), u) for n in ("estimate", "u", "U")]
            rows.append(
                Row(
                    [text_cell("weighted mean", "strong"), *mean, *(text_cell("") for _ in (*split, 1, 2, 3))],
                    strong=True,
                )
            )
        if len(q["values"]) > 1:
            pictures.append(_forest(q, f"forest-{k + 1}"))
    heads = ["method", "estimate", "u", "U (95 %)", *("Type A", "Type B", "shared")[: len(split)], "dof", "weight"]
    columns = [*map(Column, heads), Column("source of the value", wide=True)]
    caption = (
        "Values of each measurand by every method that determines it. dof: degrees of freedom of the Type A "
        "component, a dash where they are infinite; weight: in the weighted mean."
    )
    if split:
        caption += " Type A, Type B, shared: components of u; shared: in several tests, see Method and provenance."
    return [Pictures(pictures), Table(columns, rows, caption, small=True)] if rows else []


def _forest(q: Json, key: str) -> Picture:
    """Return the estimates with 95 % intervals by method; the band is the weighted mean, dashed the truth."""
    values = q["values"]
    fig, axes = figure(HALF, 15 + 5.5 * len(values))
    ax = axes[0, 0]
    mean = q["mean"]
    if mean:
        ax.axvspan(mean["estimate"] - mean["U"], mean["estimate"] + mean["U"], color=BLUE, alpha=0.15, linewidth=0)
        ax.axvline(mean["estimate"], color=BLUE, linewidth=0.8)
    if q["truth"] is not None:
        ax.axvline(q["truth"], color=INK, linestyle="--", linewidth=0.9)
    for i, v in enumerate(values):
        deviates = q["verdict"] == "disagree" and q["words"].startswith(f"{v['label']} deviates")
        colour = VERMILION if deviates else MUTED
        ax.plot([v["estimate"] - v["U"], v["estimate"] + v["U"]], [i, i], "-", color=colour, linewidth=1.4)
        ax.plot([v["estimate"]], [i], "s" if deviates else "o", color=colour, markersize=4.5, markeredgewidth=0)
    ax.set_yticks(range(len(values)), [v["label"] for v in values])
    ax.set_ylim(len(values) - 0.4, -0.6)
    ax.locator_params(axis="x", nbins=4)
    ax.set_xlabel(axis_label(q["name"] if len(q["name"]) < 24 else q["name"][:22] + "…", q["unit"]))
    truth = "; dashed: truth" if q["truth"] is not None else ""
    caption = f"{q['name']}: estimates with 95 % coverage intervals; band: weighted mean with its interval{truth}."
    alt = f"{q['name']} by {len(values)} methods, with intervals on one scale"
    return Picture(key, svg(fig, key), caption, alt, half=True)


def _pairs(doc: Json) -> list[Any]:
    pairs = doc["suite"]["pairs"]
    if not pairs:
        return []
    letters = _letters(doc)
    worst: dict[tuple[str, str], int] = {}
    for k, p in enumerate(pairs):
        for both in ((p["a"], p["b"]), (p["b"], p["a"])):
            if both not in worst or (p["E_n"] or 0.0) > (pairs[worst[both]]["E_n"] or 0.0):
                worst[both] = k
    compared = [n for n in letters if any(n in both for both in worst)]
    rows = []
    for a in compared:
        cells = [text_cell(f"{letters[a]} {a}", "strong")]
        for b in compared:
            k = worst.get((a, b), -1)
            apart = k >= 0 and (pairs[k]["E_n"] or 0.0) > 1.0
            cells.append(
                number_cell(doc, ("suite", "pairs", k, "E_n"), 0.01, mark="warn" if apart else "")
                if k >= 0
                else text_cell("–" if a == b else "")
            )
        rows.append(Row(cells))
    matrix = Table(
        [Column("largest E_n", wide=True), *(Column(letters[b]) for b in compared)], rows,
        "Largest normalized error E_n between two methods over all measurands that both determine; above 1 the values "
        "are inconsistent with their expanded uncertainties.",
    )  # fmt: skip
    pair_rows: list[Row] = []
    for name in dict.fromkeys(p["quantity"] for p in pairs):
        numbers = [k for k, p in enumerate(pairs) if p["quantity"] == name]
        pair_rows.append(heading(f"{name} in {pairs[numbers[0]]['unit']}"))
        for k in numbers:
            p = pairs[k]
            path: tuple[str | int, ...] = ("suite", "pairs", k)
            mark = "warn" if (p["E_n"] or 0.0) > 1.0 else ""
            pair_rows.append(
                Row(
                    [
                        text_cell(f"{p['a']} − {p['b']}"),
                        number_cell(doc, (*path, "difference"), p["U"] / 2.0 if p["U"] else None),
                        number_cell(doc, (*path, "U"), p["U"]),
                        number_cell(doc, (*path, "E_n"), 0.01, mark=mark),
                    ]
                )
            )
    columns = [Column("pair", wide=True), Column("difference"), Column("U of the difference (95 %)"), Column("E_n")]
    table = Table(columns, pair_rows, "Normalized errors of all pairs.", small=True)
    return [matrix, CollapsedBlocks(f"All {len(pairs)} pairs", [table])]


def _tests(doc: Json) -> list[Any]:
    rows = []
    members = doc["suite"]["members"]
    for k, m in enumerate(members):
        path: tuple[str | int, ...] = ("suite", "members", k)
        rows.append(
            Row(
                [
                    text_cell(LETTERS[k % 26], "strong"),
                    text_cell(m["title"]),
                    text_cell(m["report_id"]),
                    text_cell(result_page.date(str(m.get("date") or "not recorded"))),
                    number_cell(doc, (*path, "duration"), significant=6),
                    number_cell(doc, (*path, "phases")),
                    number_cell(doc, (*path, "windows")),
                    number_cell(doc, (*path, "residual_std"), significant=3),
                    text_cell(m["unit"]),
                ]
            )
        )
    columns = [Column(""), Column("test", wide=True), Column("report"), Column("date"), Column("duration", "s")]
    columns += [Column("phases"), Column("windows"), Column("residual"), Column("unit")]
    caption = "Member tests, each with a report of its own; residual: residual standard deviation of the windows."
    blocks: list[Any] = [Table(columns, rows, caption, small=True)]
    for k, m in enumerate(members):
        where = f" Run and report in {m['folder']}." if m["folder"] else ""
        text = f"{LETTERS[k % 26]}  {m['label']}, report {m['report_id']}. {m['method']}.{where}"
        blocks.append(Text(text, link=f"{m['folder']}/report.html" if m["folder"] else ""))
        sentences = [*m["summary"]] if doc["site"] else [f"Site: {result_page.place(m['site'])}.", *m["summary"]]
        if m.get("step_check") is not None:
            worst = write_number(m["step_check"], significant=2).text
            sentences.append(f"Halving the communication step changes no coefficient by more than {worst} u.")
        sentences += [f"Warning: {w}" for w in m["warnings"]]
        sentences += [] if m.get("complete", True) else ["The record is incomplete."]
        if sentences:
            blocks.append(BulletList(sentences))
    return blocks


def _how(doc: Json) -> list[Any]:
    suite = doc["suite"]
    shared = (
        f"Errors shared by the tests: {', '.join(suite['shared'])}. An equal shared error cancels in a difference; it "
        "is not reduced by averaging."
        if suite["shared"]
        else "No test states an uncertainty component in common with another test; all errors are treated as "
        "independent from test to test."
    )
    text = (
        "E_n = |a − b| / √(U_a² + U_b²), with the expanded uncertainties U (95 %, Student t for Type A) reduced by the "
        "components that both methods share [ISO 13528]. Random errors of different tests are independent, as each "
        "test has a record of its own."
    )
    blocks: list[Any] = [Text(text), Text(shared), BulletList(doc["conventions"])]
    rows = []
    for q in suite["quantities"]:
        if len(q["combination"]) > 1:
            sizes = {n: write_number(abs(x), significant=6).text for n, x in q["combination"].items()}
            signs = {n: "−" if x < 0.0 else "+" for n, x in q["combination"].items()}
            terms = " ".join(f"{signs[n]} {size} {n}" for n, size in sizes.items() if size != "0")
            rows.append(Row([text_cell(q["name"], "strong"), text_cell(terms.removeprefix("+ "))]))
    if rows:
        caption = "Measurands that are combinations of coefficients (factors in powers of g)."
        blocks.append(Table([Column("measurand"), Column("combination", wide=True)], rows, caption))
    return [*blocks, *source_blocks(doc["sources"])]


def _provenance(doc: Json) -> list[Any]:
    run, members = doc["provenance"], doc["suite"]["members"]
    rows, hashes = [], []
    for k, m in enumerate(members):
        changed = ", ".join(m.get("changed") or []) or "nothing"
        rows.append(
            Row(
                [
                    text_cell(m["label"], "strong"),
                    number_cell(doc, ("suite", "members", k, "seed")),
                    number_cell(doc, ("suite", "members", k, "step")),
                    text_cell(m.get("engine")),
                    text_cell(_versions(m.get("versions"))),
                    text_cell(changed if len(changed) < 160 else changed[:157] + "…"),
                ]
            )
        )
        for what in ("record_sha256", "result_sha256"):
            if m.get(what):
                cells = [text_cell(m["label"], "strong"), text_cell(what.split("_")[0]), Cell(m[what], mark="hash")]
                hashes.append(Row(cells))
        if m.get("data"):
            hashes.append(Row([text_cell(m["label"], "strong"), text_cell("data"), text_cell(compact(m["data"], 90))]))
    columns = [Column("test"), Column("seed"), Column("step", "s"), Column("engine"), Column("versions")]
    columns.append(Column("changed", wide=True))
    blocks: list[Any] = [Table(columns, rows, "Run settings of each test, with changed defaults.", small=True)]
    columns = [Column("test"), Column("file"), Column("SHA-256", wide=True)]
    blocks.append(Table(columns, hashes, "Records and results of the tests, with their hash.", small=True))
    parts: dict[tuple[str, str, str, str], list[str]] = {}
    for m in members:
        for slot, p in (m.get("parts") or {}).items():
            key = (slot, str(p.get("name")), str(p.get("version")), str(p.get("sha256")))
            parts.setdefault(key, []).append(_letters(doc)[m["label"]])
    if parts:
        rows = [
            Row([text_cell(slot, "strong"), *map(text_cell, (*about, "".join(who))), Cell(sha, mark="hash")])
            for (slot, *about, sha), who in sorted(parts.items())
        ]
        columns = [*map(Column, ("slot", "component", "version", "tests")), Column("SHA-256", wide=True)]
        blocks.append(Table(columns, rows, "Components of the simulated tests.", small=True))
    given = ", ".join(f"{n} = {v}" for n, v in (run.get("changed") or {}).items())
    facts = [("set", given), ("seed of the suite", run.get("seed")), ("versions", _versions(run.get("versions")))]
    settings = [f"{name[0].upper()}{name[1:]}: {value}" for name, value in facts if value not in (None, "")]
    return [*blocks, *([Text("; ".join(settings) + ".", quiet=True)] if settings else [])]


def _versions(versions: Any) -> str:
    return ", ".join(f"{k} {v}" for k, v in versions.items()) if isinstance(versions, dict) else ""
