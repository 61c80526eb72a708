"""The static site of a campaign: a folder that opens from disk, without network and without a server.

``index.html``     the analysis (:mod:`.site_page`)
``runs.js``        the rows for its table (a script, since pages opened from disk may not read files)
``site.js``, ``site.css``
``runs.csv``       all rows, full precision, units in the header
``analysis.json``  the numbers of the page
``kept/<run>/``    reports of the runs, where the site is published; else they are linked in the campaign
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench import reading
from gyrobench.bench import Bench, UsageError
from gyrobench.campaign.analysis.campaign_analysis import analyse
from gyrobench.campaign.analysis.measures import CampaignMeasures, Json, error, numbers
from gyrobench.campaign.analysis.shown_files import without_folders
from gyrobench.campaign.execution.store import Campaign, CampaignError
from gyrobench.campaign.site.site_page import own_names, own_texts, page, recorded
from gyrobench.files import write_whole
from gyrobench.report.assets import read_content
from gyrobench.report.language import ENGLISH, Language, system_folder, used
from gyrobench.report.render import html
from gyrobench.report.result_json import plain

PUBLISHED = ("report.html", "report.pdf", "result.json")
KEPT = re.compile(r"kept/[\w-]+/report\.html")  # where a campaign keeps the report of a run
TRANSLATED = ("state", "verdict", "reason")  # columns whose values the page shows in its language
SCRIPT = (  # texts of site.js
    "{n} to {n2} of {n3} runs", "No runs", ", filtered from {n}", ". ", ".", "Report of run {n}",
    "no column {v}", "{v} holds texts: name=text", "{v}: {v2} is not a number",
    "First page", "Previous page", "Next page", "Last page", "all estimates", "estimate",
)  # fmt: skip
DIGITS = 7  # significant digits of the numbers in the table of the page


@dataclass(frozen=True)
class CampaignSite:
    """A written site: its page, and the sentences with which it opens."""

    index: Path
    answer: list[str]


def write_site(
    campaign: Campaign, out: Path | None = None, publish: Path | None = None, language: str = ENGLISH
) -> CampaignSite:
    """Write the site of a campaign, which may be that of others.

    out: folder of the site, default ``site`` in the campaign; reports are linked where they are.  publish: a folder
    that shall hold everything, reports included.  language: of the page; what runs warn of or failed for stays as it
    was recorded where it has no translation.  Raises UsageError, and CampaignError for a row whose report is not one of
    the campaign's.
    """
    if out and publish:
        raise UsageError("out and publish: name one; a published site holds the reports, one of out links them")
    folder = publish or out or (campaign.local / "site" if campaign.local else None)
    if folder is None:
        raise UsageError(f"{campaign.url}: not a folder of this machine; say where the site goes: --publish DIR")
    _require_own(folder)
    folder.mkdir(parents=True, exist_ok=True)
    rows = without_folders(campaign.table())
    kept = sorted({r for r in rows["report"].dropna()}) if "report" in rows else []
    if outside := [r for r in kept if not KEPT.fullmatch(r)]:
        raise CampaignError(
            f"{campaign.url}: {reading.visible(outside[0])}: not the place of a report of this campaign"
        )
    if publish:
        _publish_reports(campaign, folder, kept)
    link = _links(campaign, folder, published=publish is not None)
    measures = CampaignMeasures.of(rows, campaign.units, campaign.axes)
    doc = plain(analyse(campaign))
    bench = Bench.find().folder
    systems = filter(None, [system_folder(doc["system"], bench)])
    with used(language, Path(__file__).parent, own_texts(doc), own_names(doc), [*systems]) as words:
        if words:
            words.known |= {text: words.find(text) or text for text in recorded(doc)}
        shown, table = page(doc, measures, link), run_table(measures, link)
        if words:
            shown = words.page(shown, "the site")
            table |= _in_words(table, words)
    files = {
        "analysis.json": json.dumps(doc, indent=1, ensure_ascii=False, allow_nan=False) + "\n",
        "runs.csv": _csv(rows, campaign.units),
        "runs.js": f"window.gyrobenchRuns = {_script(table)};\n",
        "site.js": read_content("templates/site.js", bench),
        "site.css": read_content("templates/site.css", bench),
        "index.html": html(shown, bench),
    }
    for name, text in files.items():
        write_whole(folder / name, text.encode())
    return CampaignSite(folder / "index.html", doc["answer"])


def _require_own(folder: Path) -> None:
    """Refuse a folder that holds files of something else."""
    if folder.is_dir() and any(folder.iterdir()) and not (folder / "analysis.json").is_file():
        raise UsageError(f"{folder}: holds other files; name a new folder, or the folder of an earlier site")
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder}: is a file; name a folder")


def _links(campaign: Campaign, folder: Path, published: bool) -> Callable[[str], str]:
    """Return the link from the site to a report, given its path in the campaign; "" where a page cannot reach it."""
    if published:
        return lambda path: path
    if campaign.local is None:
        return lambda path: ""
    base = Path(os.path.relpath(campaign.local.resolve(), folder.resolve())).as_posix()
    return lambda path: f"{base}/{path}"


def _publish_reports(campaign: Campaign, folder: Path, reports: list[str]) -> None:
    """Copy the reports of the kept runs; remove those of an earlier site that are no longer kept."""
    runs = {Path(report).parent.name: Path(report).parent.as_posix() for report in reports}
    for old in (folder / "kept").iterdir() if (folder / "kept").is_dir() else ():
        if old.name not in runs:
            shutil.rmtree(old)
    for inside in runs.values():
        (folder / inside).mkdir(parents=True, exist_ok=True)
        for name in PUBLISHED:
            try:
                content = campaign.read(f"{inside}/{name}")
            except FileNotFoundError:
                continue
            write_whole(folder / inside / name, content)


def _csv(rows: Any, units: Mapping[str, str]) -> str:
    """Return the rows as text: units in the header, lists joined."""
    flat = rows.copy()
    for name in {"warnings", "warning_ids"} & set(flat):
        flat[name] = ["; ".join(map(str, w)) if w is not None else "" for w in flat[name]]
    heads = [f"{c} [{units[c]}]" if units.get(c) not in (None, "", "1") else c for c in flat.columns]
    return str(flat.to_csv(index=False, header=heads))


def _script(value: Json) -> str:
    """Return JSON that may stand in a script of a page."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")
    return reading.visible(text)


# -------------------------------------------------------------------------------------------------- table of runs
def run_table(measures: CampaignMeasures, link: Callable[[str], str]) -> Json:
    """Return the columns of the table of runs: key, head, unit, kind, measure it belongs to, values.

    kind: "text", "count", "number", or "value" and "u" for a measure's numbers, which are rounded to its u.
    """
    rows = measures.rows
    columns: list[Json] = []

    def add(key: str, values: Any, kind: str = "text", unit: str = "", measure: str = "", head: str = "") -> None:
        if kind == "text":
            values = [v if isinstance(v, str) else "" for v in values]
        else:
            values = [_short(v) for v in np.asarray(values, float)]
        if any(v not in ("", None) for v in values):
            columns.append(
                {"key": key, "head": head or key, "unit": unit, "kind": kind, "measure": measure, "values": values}
            )

    add("index", numbers(rows, "index"), "count")
    if measures.is_lot:
        add("instrument", measures.instrument())
        add("date", [d[:10] if isinstance(d, str) else "" for d in rows["date"]])
    add("state", rows["state"])
    add("verdict", rows["verdict"])
    if rows["system"].nunique() > 1:
        add("system", rows["system"])
    for axis in measures.axes:
        column = f"in.{axis['name']}"
        if column in rows and axis["kind"] != "data" and axis["name"] != "seed":
            numeric = rows[column].dtype.kind in "fiu"
            add(axis["name"], rows[column], "number" if numeric else "text", axis.get("unit") or "")
    add("seed", numbers(rows, "seed"), "count")
    for name in measures.names:
        estimate, u = numbers(rows, f"{name}.estimate"), numbers(rows, f"{name}.u")
        with np.errstate(divide="ignore", invalid="ignore"):
            z = error(rows, name) / u
        add(name, estimate, "value", measures.unit(name), name)
        add(f"u({name})", u, "u", measures.unit(name), name)
        for key in ("lo", "hi", "truth"):
            add(f"{key}({name})", numbers(rows, f"{name}.{key}"), "value", measures.unit(name), name)
        add(f"z({name})", z, "number", "", name)
    add("reason", _reasons(rows))
    if measures.is_lot:
        add("file", rows["data"])
    links = [link(r) if isinstance(r, str) else "" for r in rows["report"]] if "report" in rows else []
    return {"columns": columns, "measures": measures.names, "links": links, "rows": len(rows)}


def _in_words(table: Json, words: Language) -> Json:
    """Return the columns of a table with their heads in a language, and its words: what the script says, and values."""
    values = {v for c in table["columns"] if c["key"] in TRANSLATED for v in c["values"]}
    said = {text: words.find(text) for text in (*SCRIPT, *sorted(values))}
    columns = [{**c, "head": words.find(c["head"]) or c["head"]} for c in table["columns"]]
    return {"columns": columns, "words": {text: found for text, found in said.items() if found}}


def _reasons(rows: Any) -> list[str]:
    """Return why a run has no result, else its warnings."""
    return [
        reason if isinstance(reason, str) else "; ".join(map(str, warnings)) if warnings is not None else ""
        for reason, warnings in zip(rows["reason"], rows["warnings"], strict=True)
    ]


def _short(value: float) -> float | int | None:
    if not np.isfinite(value):
        return None
    rounded = float(f"{value:.{DIGITS}g}")
    return int(rounded) if rounded.is_integer() and abs(rounded) < 1e15 else rounded
