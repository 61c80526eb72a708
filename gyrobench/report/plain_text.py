"""Results as plain text: what a command prints and what ``print`` shows of a run."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from gyrobench.report.numbers import write_number
from gyrobench.report.ranking_section import place_text, probability_text
from gyrobench.result import NO_VERDICT, Result, StepCheck, SuiteResult

ARRANGEMENT = "arrangement.unstated"  # reason: mistakes, a reversed reading, that no residual of the record shows
WIDTH, NARROW = 120, 30  # characters of a line with a meaning, and of a meaning at least


def align_columns(rows: Sequence[Sequence[str]], left: set[int], indent: str = "") -> list[str]:
    """Return the rows as aligned lines; columns in ``left`` are flush left, the others flush right."""
    widths = [max(len(r[k]) for r in rows) for k in range(len(rows[0]))] if rows else []
    return [
        indent + "  ".join(x.ljust(w) if k in left else x.rjust(w) for k, (x, w) in enumerate(zip(r, widths))).rstrip()  # noqa: B905
        for r in rows
    ]


def with_meanings(lines: Sequence[str], meanings: Sequence[str]) -> list[str]:
    """Return the lines of a table (head first) with a last column of meanings, wrapped where the line gets long."""
    start = max(map(len, lines)) + 2
    out = [f"{lines[0].ljust(start)}meaning"]
    for line, meaning in zip(lines[1:], meanings, strict=True):
        wrapped = textwrap.wrap(meaning, max(NARROW, WIDTH - start)) or [""]
        out.append(f"{line.ljust(start)}{wrapped[0]}".rstrip())
        out += [" " * start + text for text in wrapped[1:]]
    return out


def format_result(result: Result) -> str:
    """Return the coefficient table, the answer, the warnings and the verdict; of a suite how far its methods agree."""
    truth = any(c.truth is not None for c in result.coefficients)
    judged = result.verdict != NO_VERDICT
    head = ["coefficient", "estimate", "u", "95 % interval", "unit"]
    rows = [head + (["truth", "z"] if truth else []) + (["verdict"] if judged else [])]
    for c in result.coefficients:
        lo, hi = (write_number(x, c.u).text for x in c.interval)
        estimate = "no value" if c.no_value else write_number(c.estimate, c.u).text
        row = [c.name, estimate, write_number(c.u, c.u).text, "–" if lo == hi == "–" else f"{lo} … {hi}", c.unit]
        if truth:
            row += [write_number(c.truth, c.u).text, "–" if c.z is None else f"{c.z:+.2f}".replace("-", "−")]
        rows.append(row + ([c.verdict] if judged else []))
    notes = [s.replace("No", "no", 1) for s in no_values((c.name, c.no_value) for c in result.coefficients)]
    notes += [f"warning: {w}" for w in [*_doubts(result), *result.warnings]]
    if not judged:  # a verdict that is taken away says it
        notes += [f"note: {r.text}" for r in result.reasons if r.id == ARRANGEMENT]
    if result.step_check:
        notes.append(step_sentence(result.step_check))
    if judged:
        notes.append(f"verdict: {result.verdict}")
    left = {0, 4} | ({len(rows[0]) - 1} if judged else set())
    agreement = _agreement(result) if isinstance(result, SuiteResult) else []
    table = with_meanings(align_columns(rows, left), [c.meaning for c in result.coefficients])
    answer = [] if isinstance(result, SuiteResult) else [*result.summary, ""]
    return "\n".join([result.title, "", *answer, *table, "", *notes, *agreement])


def _doubts(result: Result) -> list[str]:
    """Return what speaks against a record, where neither a verdict that was taken away nor a warning says so; missing
    statements apart.
    """
    from gyrobench.reduction.estimation.fit_result import UNSTATED

    said = {r.id for r in result.reasons}
    warned = {r.id for r in result.reasons if r.severity in ("error", "warning")}
    doubts = [r for r in result.reasons if r.severity == "doubt" and not r.id.endswith(UNSTATED)]
    doubts = [r for r in doubts if r.id not in warned and f"verdict.withheld:{r.id}" not in said]
    return list(dict.fromkeys(r.text for r in doubts))


def step_sentence(check: StepCheck) -> str:
    """Return what a step check has found, and its cost."""
    cost = f" ({check.seconds:.1f} s)" if check.seconds else ""
    worst = check.worst
    most = "" if worst is None else f", at most {write_number(worst, significant=2).text} times the u without it"
    if worst is not None and worst > 1.0:  # by how much, of which, is a sentence of its own
        most = ", larger than the u without it for some measures: see the warnings and the table of the step check"
    there = "taken out of estimates or in u" if any(row.taken for row in check.rows) else "in u"
    return f"step check{cost}: the effect of the communication step is {there}{most}"


def no_values(coefficients: Iterable[tuple[str, str]]) -> list[str]:
    """Return a sentence for each reason for which coefficients (name, reason; "" of those with a value) have none."""
    names: dict[str, list[str]] = {}
    for name, reason in coefficients:
        if reason:
            names.setdefault(reason, []).append(name)
    return [f"No value of {', '.join(of)}: {reason}." for reason, of in names.items()]


def _agreement(result: SuiteResult) -> list[str]:
    rows = [["measurand", "methods", "largest E_n", "p", ""]]
    for q in result.suite.quantities:
        if q.p is not None:
            rows.append([q.name, str(len(q.values)), f"{q.largest_E_n:.2f}", f"{q.p:.2g}", q.words])
    table = ["", *align_columns(rows, {0, 4})] if len(rows) > 1 else []
    return [*table, "", f"methods: {result.suite.consistency}", *result.summary]


def format_comparison(comparison: Mapping[str, Any]) -> str:
    """Return the estimates of all runs, a line for each coefficient, and the ranking where there is one."""
    rows = [["coefficient", *(str(run["name"]) for run in comparison["runs"]), "unit"]]
    for m in comparison["measures"]:
        shown = [write_number(r and r["estimate"], r and r["u"]).text for r in m["runs"]]
        marked = [d is not None and d["significant"] for d in m["differences"]]
        rows.append([m["name"], *(s + (" *" if k else "  ") for s, k in zip(shown, marked, strict=True)), m["unit"]])
    note = "* differs from the first run by more than the expanded uncertainty of the difference"
    table = align_columns(rows, {0, len(rows[0]) - 1})
    return "\n".join([*table, "", note, *([format_ranking(comparison)] if comparison["ranking"] else [])])


def format_summary(comparison: Mapping[str, Any]) -> str:
    """Return the opening sentences of a comparison and its ranking."""
    return "\n".join([*comparison["summary"], "", format_ranking(comparison)]).rstrip() + "\n"


def format_ranking(comparison: Mapping[str, Any]) -> str:
    """Return the runs of a comparison in the order of the measures that rank them; empty where none does."""
    if not comparison["ranking"]:
        return ""
    return "\n".join(_ranked(comparison, r) for r in (comparison["ranking"], *comparison["purposes"]))


def _ranked(comparison: Mapping[str, Any], ranked: dict[str, Any]) -> str:
    rows = [["", "run", ranked["name"], "u", "unit", "ratio to the smallest", "probability"]]
    for entry in ranked["order"]:
        value, u = (write_number(entry[k], entry["u"]).text for k in ("value", "u"))
        over = write_number(entry["over_best"], significant=3).text
        name = comparison["runs"][entry["run"]]["name"]
        rows.append([place_text(ranked, entry), name, value, u, ranked["unit"], over, probability_text(entry)])
    for entry in ranked["void"]:
        rows.append(["–", comparison["runs"][entry["run"]]["name"], "void", "–", ranked["unit"], "–", ""])
    reasons = [f"{comparison['runs'][v['run']]['name']} has no rank: {v['reason']}" for v in ranked["void"]]
    head = [f"{ranked['purpose']}:"] if "purpose" in ranked else []
    return "\n".join([*head, *align_columns(rows, {0, 1, 4}), *reasons, ""])
