"""Report page that compares runs: differing settings, then differences of the coefficients."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from gyrobench.reduction.suite.ranking import difference
from gyrobench.report import comparison_summary, plots, ranking_section, replicates, responses
from gyrobench.report.numbers import write_number
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    CollapsedBlocks,
    Column,
    Page,
    PageTable,
    Picture,
    Pictures,
    Row,
    Section,
    Text,
    number_cell,
    text_cell,
)
from gyrobench.report.replicates import ComparedRun, Draws
from gyrobench.report.result_json import content_hash, plain, value_at
from gyrobench.report.result_page import date
from gyrobench.report.style import HALF, figure, styled, svg
from gyrobench.report.tables import compact
from gyrobench.result import Coefficient, DriftTestResult, LoopResult, Response, Result
from gyrobench.result_content import content, typed

Json = dict[str, Any]
SCHEMA = "gyrobench-comparison-1"
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
SAID = ("method", "noise model", "instrument", "date")  # settings whose values are said in the language of the page
_LONGEST = 60  # characters of a value
_ABREAST = 3  # runs in one table, so that it fits on paper


def comparison(results: Sequence[tuple[str, Result]], baseline: int = 0) -> Json:
    """Return the content of ``comparison.json``.

    Runs that differ in the seed alone are one candidate (:mod:`.replicates`).  Differences are run minus baseline;
    their standard uncertainty comes from the pairs of equal seeds, else takes the runs as independent and the larger
    coverage factor of the two; ``significant`` when the difference exceeds its expanded uncertainty,
    ``beyond_chance`` when it would among all of them.
    Raises ValueError for fewer than two results, repeated names or an unknown baseline.
    """
    names = [name for name, _ in results]
    if len(results) < 2:
        raise ValueError("a comparison needs at least two results")
    if len(set(names)) < len(names):
        raise ValueError(f"names of results must differ: {', '.join(names)}")
    if not 0 <= baseline < len(results):
        raise ValueError(f"baseline {baseline} is not one of the {len(results)} results (0 to {len(results) - 1})")
    runs = replicates.pool(results)
    if baseline >= len(runs):
        raise ValueError(f"baseline {baseline} is not one of the {len(runs)} candidates that the runs make up")
    facts = [_facts(run.result) for run in runs]
    keys = list(dict.fromkeys(k for f in facts for k in f))
    rows = [row for key in keys for row in _spread(key, [f.get(key) for f in facts])]
    drawn = [{r.name: r for r in reversed(_responses(run.result))} for run in runs]
    found: Json = {
        "baseline": baseline,
        "runs": [
            {"report_id": run.report_id}
            | {k: getattr(run.result, k) for k in ("system", "title", "instrument", "verdict", "simulated")}
            | {"name": run.name, "seeds": run.seeds}
            for run in runs
        ],
        "ranking": ranking_section.ranking(runs),
        "purposes": ranking_section.by_purpose(runs),
        "differing": [r for r in rows if any(v != r["values"][0] for v in r["values"])],
        "equal": [
            {"what": r["what"], "value": r["values"][0]} for r in rows if all(v == r["values"][0] for v in r["values"])
        ],
        "measures": [
            _measure(runs, *key, baseline)
            for key in dict.fromkeys((c.name, c.unit) for run in runs for c in run.result.coefficients)
        ],
        "responses": [
            {"name": name, "runs": [content(own.get(name)) for own in drawn]}
            for name in dict.fromkeys(r.name for run in runs for r in _responses(run.result))
        ],
    }
    comparison_summary.mark_beyond_chance(found["measures"])
    found["summary"] = comparison_summary.sentences(found, letters(len(runs)))
    found = plain(found)
    return {"schema": SCHEMA, "report_id": content_hash(found), **found}


def _responses(result: Result) -> list[Response]:
    return result.responses if isinstance(result, LoopResult) else []


def _measure(runs: Sequence[ComparedRun], name: str, unit: str, baseline: int) -> Json:
    found = [run.find(name, unit) for run in runs]
    kept = ("estimate", "u", "k", "interval", "truth")
    values = [
        None if f is None else {k: getattr(f[0], k) for k in kept} | ({"draws": f[1]} if f[1] else {}) for f in found
    ]
    meaning = next(f[0].meaning for f in found if f is not None)
    differences = [None if k == baseline else _difference(found[k], found[baseline]) for k in range(len(found))]
    return {"name": name, "unit": unit, "meaning": meaning, "runs": values, "differences": differences}


def _difference(run: tuple[Coefficient, Draws] | None, base: tuple[Coefficient, Draws] | None) -> Json | None:
    if run is None or base is None or not math.isfinite(run[0].estimate) or not math.isfinite(base[0].estimate):
        return None
    d = difference(ranking_section.candidate(*base), ranking_section.candidate(*run))
    if d.u is None or d.k is None:
        return {"value": d.value, "u": None, "U": None, "significant": None}
    return {"value": d.value, "u": d.u, "U": d.k * d.u, "significant": abs(d.value) > d.k * d.u}


def _facts(result: Result) -> dict[str, Any]:
    """Return everything about a run that may explain a difference, by name; of run.json every key that it has."""
    run = plain(result.provenance)
    facts: dict[str, Any] = {"system": result.system, "instrument": result.instrument, "method": result.method}
    facts |= {f"site {k}": plain(v) for k, v in result.site.items()}
    facts |= {k: run[k] for k in ("seed", "step", "engine") if run.get(k) is not None}
    facts |= {"execution order": run["order"]} if run.get("order") is not None else {}
    facts |= {k: run[k] for k in ("operator", "date") if run.get(k) is not None}
    for slot, part in (run.get("parts") or {}).items():
        items = part.items() if isinstance(part, dict) else [("name", part)]
        facts |= {f"part {slot}: {k}": v for k, v in items}
    facts |= {f"parameter {k}": v for k, v in (run.get("parameters") or {}).items()}
    facts |= {f"option {k}": v for k, v in (run.get("options") or {}).items()}
    facts |= {f"version {k}": v for k, v in (run.get("versions") or {}).items()}
    facts |= {f"plan phase {k + 1}": phase for k, phase in enumerate(run.get("plan") or [])}
    facts["noise model"] = result.noise.get("model") if isinstance(result, DriftTestResult) else None
    return facts


def _spread(what: str, values: list[Any]) -> list[Json]:
    """Return a fact as rows: lists and dictionaries that differ are taken apart, so that only what differs is shown."""
    differs = any(v != values[0] for v in values)
    if differs and all(isinstance(v, dict) for v in values):
        keys = list(dict.fromkeys(k for v in values for k in v))
        return [row for k in keys for row in _spread(f"{what}, {k}", [v.get(k) for v in values])]
    if differs and all(isinstance(v, list) and len(v) == len(values[0]) for v in values):
        parts = [(k, [v[k] for v in values]) for k in range(len(values[0]))]
        return [
            row for k, part in parts if any(p != part[0] for p in part) for row in _spread(f"{what}[{k + 1}]", part)
        ]
    return [{"what": what, "values": values}]


def page(doc: Json) -> Page:
    """Return the report of a comparison document."""
    runs = doc["runs"]
    base = _letter(doc["baseline"])
    head = [
        ("Report", doc["report_id"]),
        ("Baseline", f"{base}, {runs[doc['baseline']]['name']}"),
        ("Runs", _called(runs)),
    ]
    titles = dict.fromkeys(run["title"] for run in runs)
    with styled():
        sections = [
            Section("Summary", "summary", [BulletList(doc["summary"])]),
            ranking_section.section(doc, letters(len(runs))),
            Section("Differing settings", "differs", [_runs(doc), *_differing(doc)]),
            Section("Coefficients", "coefficients", [*_estimates(doc), *_differences(doc)]),
            Section(
                "Responses and estimates of all runs",
                "figures",
                [*_side_by_side(doc, doc["responses"]), *_figures(doc)],
            ),
            Section("Common settings", "equal", _equal(doc)),
        ]
    return Page(f"Comparison: {'; '.join(titles)}", doc["report_id"], head, sections).finish()


def own_texts(doc: Json) -> list[str]:
    """Return what is the same in every language: how the runs are called, names within the plan, values cut short."""
    named = [(_letter(k), run["name"]) for k, run in enumerate(doc["runs"])]
    calls = [form.format(*n) for n in named for form in ("{1}", "{0} {1}", "{0}, {1}", "{0} ({1})")]
    rows = [(r["what"], v) for r in (*doc["differing"], *doc["equal"]) for v in r.get("values", [r.get("value")])]
    parts = [p for what, v in rows for p in (what.partition(", ")[2], compact(v, _LONGEST).rpartition("… (")[0])]
    return [*calls, _called(doc["runs"]), *filter(None, parts)]


def _called(runs: Sequence[Json]) -> str:
    return ", ".join(f"{_letter(k)} {run['name']}" for k, run in enumerate(runs))


def side_tables(doc: Json) -> list[PageTable]:
    """Return the tables that stand side by side: runs, ranking, estimates and differences."""
    ranked = ranking_section.section(doc, letters(len(doc["runs"]))).blocks
    blocks = [_runs(doc), *ranked, *_estimates(doc), *_differences(doc)]
    return [b for b in blocks if isinstance(b, PageTable)]


def side_figure(doc: Json, key: str) -> str:
    """A loop, else the first response of the runs, all runs in it, with ids that begin with ``key``; "" without one."""
    loops_first = sorted(doc["responses"], key=lambda r: all(run is None or run["kind"] != "loop" for run in r["runs"]))
    with styled():
        blocks = _side_by_side(doc, loops_first[:1])
    return next((p.svg.replace(f"{p.key}-", f"{key}-") for b in blocks for p in b.items), "")


def _side_by_side(doc: Json, shown: Sequence[Json]) -> list[Any]:
    """Return a figure for each response that two runs or more have, all runs in it."""
    blocks: list[Any] = []
    for k, entry in enumerate(shown):
        named = [
            (f"{_letter(i)} {doc['runs'][i]['name']}", typed(Response, run))
            for i, run in enumerate(entry["runs"])
            if run is not None
        ]
        blocks += responses.of_all_runs(f"response-{k + 1}", named)
    return blocks


def _letter(k: int) -> str:
    return LETTERS[k] if k < len(LETTERS) else f"R{k + 1}"


def letters(count: int) -> list[str]:
    """Return what the runs of a comparison are called: A, B, C ..."""
    return [_letter(k) for k in range(count)]


def _runs(doc: Json) -> PageTable:
    pooled = any(run["seeds"] for run in doc["runs"])
    rows = [
        Row(
            [
                text_cell(_letter(k), "strong"),
                *(text_cell(run[c], own=True) for c in ("name", "system", "report_id")),
                *([text_cell(", ".join(map(str, run["seeds"])) or "–")] if pooled else []),
                text_cell(run["verdict"], run["verdict"]),
            ]
        )
        for k, run in enumerate(doc["runs"])
    ]
    columns = [Column(""), Column("name", wide=True), Column("system"), Column("report")]
    columns += [*([Column("seeds")] if pooled else []), Column("verdict")]
    means = " Runs that differ in the seed alone are one: estimates are means over the seeds, u their standard errors."
    return PageTable(columns, rows, f"Runs.{means if pooled else ''}")


def _differing(doc: Json) -> list[Any]:
    if not doc["differing"]:
        return [Text("No recorded setting differs between the runs.")]
    count = len(doc["runs"])
    blocks = []
    for start in range(0, count, _ABREAST):
        part = range(start, min(start + _ABREAST, count))
        rows = [
            Row([text_cell(row["what"]), *(_value(doc, ("differing", i, "values", k)) for k in part)])
            for i, row in enumerate(doc["differing"])
        ]
        columns = [Column("setting"), *(Column(_letter(k), wide=True) for k in part)]
        blocks.append(
            PageTable(
                columns, rows, "Components, parameters and settings that differ; parameters in SI units.", small=True
            )
        )
    return blocks


def _value(doc: Json, path: tuple[str | int, ...]) -> Cell:
    """Return a fact as text; numbers carry their full value and their place in ``comparison.json``.

    Values are as they were given, in every language; what the bench says of a method or a model is in that of the page.
    """
    cell = number_cell(doc, path, significant=8)
    if not cell.number:
        value = value_at(doc, *path)
        text = date(value) if isinstance(value, str) else compact(value, _LONGEST)
        said = value_at(doc, *path[:2])["what"] in SAID or text.endswith(" entries)")
        return Cell(_broken(text), own=not said)
    return Cell(cell.text, full=cell.full, pointer=cell.pointer, own=True)


def _broken(text: str) -> str:
    """Return the text, shortened where it is one long word (of a hash the first 16 digits)."""
    return text if len(text) < 40 or " " in text else text[:16] + "…"


def _estimates(doc: Json) -> list[Any]:
    blocks = []
    count = len(doc["runs"])
    for start in range(0, count, _ABREAST):
        part = range(start, min(start + _ABREAST, count))
        rows = []
        for i, m in enumerate(doc["measures"]):
            cells = [text_cell(m["name"], "strong"), text_cell(m["unit"])]
            for k in part:
                u = m["runs"][k]["u"] if m["runs"][k] else None
                cells += [number_cell(doc, ("measures", i, "runs", k, name), u) for name in ("estimate", "u")]
            rows.append(Row(cells))
        columns = [Column("name"), Column("unit")]
        for k in part:
            columns += [Column(_letter(k)), Column(f"u({_letter(k)})")]
        blocks.append(PageTable(columns, rows, "Estimates and their standard uncertainties."))
    return blocks


def _differences(doc: Json) -> list[Any]:
    base = doc["baseline"]
    others = [k for k in range(len(doc["runs"])) if k != base]
    all_of_them = [d for m in doc["measures"] for d in m["differences"] if d and d["significant"] is not None]
    marked = sum(bool(d["significant"]) for d in all_of_them)
    blocks: list[Any] = []
    for start in range(0, len(others), _ABREAST):
        part = others[start : start + _ABREAST]
        rows = []
        for i, m in enumerate(doc["measures"]):
            cells = [text_cell(m["name"], "strong"), text_cell(m["unit"])]
            for k in part:
                d = m["differences"][k]
                u, mark = (d["u"], "significant" if d["significant"] else "") if d else (None, "")
                path = ("measures", i, "differences", k)
                cells += [number_cell(doc, (*path, "value"), u, mark=mark), number_cell(doc, (*path, "U"), u)]
                cells.append(text_cell("" if d is None else "significant" if d["significant"] else "–", mark))
            rows.append(Row(cells))
        columns = [Column("name"), Column("unit")]
        for k in part:
            name = f"{_letter(k)} − {_letter(base)}"
            columns += [Column(name), Column("U (95 %)"), Column("")]
        caption = f"Differences from baseline {_letter(base)} with their expanded uncertainty; " + (
            "runs of equal seed are compared in pairs."
            if doc["runs"][base]["seeds"]
            else "the runs are treated as independent."
        )
        blocks.append(PageTable(columns, rows, caption))
    blocks.append(
        Text(
            f"{marked} of {len(all_of_them)} differences exceed their expanded uncertainty; about "
            f"{write_number(0.05 * len(all_of_them), significant=2).text} are expected by chance."
        )
    )
    return blocks


def _figures(doc: Json) -> list[Any]:
    pictures = []
    names = [f"{_letter(k)} {run['name']}" for k, run in enumerate(doc["runs"])]
    for i, m in enumerate(doc["measures"]):
        shown = [
            (n, (r["estimate"], *r["interval"]))
            for n, r in zip(names, m["runs"], strict=True)
            if r and None not in (r["estimate"], *r["interval"])
        ]
        if len(shown) < 2:
            continue
        fig, axes = figure(HALF, 15 + 5.5 * len(shown))
        base = m["runs"][doc["baseline"]]
        plots.strip(
            axes[0, 0], [n for n, _ in shown], [v for _, v in shown], m["unit"], m["name"], base and base["estimate"]
        )
        key = f"measure-{i + 1}"
        caption = f"{m['name']}, {m['meaning']}: estimates with 95 % coverage intervals; dashed: the baseline."
        alt = f"{m['name']} of all runs with intervals on one scale"
        pictures.append(Picture(key, svg(fig, key), caption, alt, half=True))
    return [Pictures(pictures)] if pictures else []


def _equal(doc: Json) -> list[Any]:
    if not doc["equal"]:
        return []
    rows = [Row([text_cell(row["what"]), _value(doc, ("equal", i, "value"))]) for i, row in enumerate(doc["equal"])]
    table = PageTable(
        [Column("setting"), Column("value", wide=True)], rows, "Equal in all runs; parameters in SI units.", small=True
    )
    return [CollapsedBlocks(f"{len(rows)} entries", [table])]
