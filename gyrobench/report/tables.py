"""Report tables of JSON values: dictionaries, lists of rows, parameters, components."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from gyrobench.report.numbers import write_number, write_p
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    CollapsedBlocks,
    PageTable,
    Row,
    Text,
    columns,
    number_cell,
    text_cell,
)
from gyrobench.report.result_json import Report, value_at
from gyrobench.result import Coefficient, Table

# endings of names that tell the unit, longest first
_UNITS = {
    "_deg_per_h_per_g2": "°/h/g²",
    "_deg_per_h_per_g": "°/h/g",
    "_deg_per_sqrt_h": "°/√h",
    "_deg_per_h": "°/h",
    "_rad_per_s": "rad/s",
    "_m_per_s2": "m/s²",
    "_deg": "°",
    "_rad": "rad",
    "_mA": "mA",
    "_Hz": "Hz",
    "_min": "min",
    "_s": "s",
    "_h": "h",
    "_m": "m",
}
SYMBOLS = {"frequency": "f", "amplitude": "A"}  # of heads that have a column u(symbol)


def words(key: str) -> tuple[str, str]:
    """Return a field name as words and its unit: ``sigma_deg_per_h`` or ``sigma / (°/h)`` is ("sigma", "°/h")."""
    if " / " in key:
        name, unit = key.rsplit(" / ", 1)
        return name, unit[1:-1] if unit.startswith("(") and unit.endswith(")") else unit
    for ending, unit in _UNITS.items():
        if key.endswith(ending) and len(key) > len(ending):
            return key[: -len(ending)].replace("_", " "), unit
    return key.replace("_", " "), {"step": "s", "from": "s", "to": "s"}.get(key, "")


def heading(text: str) -> Row:
    return Row([], group=text)


def unit_groups(coefficients: Sequence[Coefficient]) -> list[tuple[str, list[int]]]:
    """Return the numbers of the coefficients by their unit, units in the order in which they come.

    Empty where most units have one row only, as in loop tests: there the unit belongs into a column, for headings
    would tear the table.
    """
    by_unit: dict[str, list[int]] = {}
    for k, c in enumerate(coefficients):
        by_unit.setdefault(c.unit, []).append(k)
    alone = sum(len(members) == 1 for members in by_unit.values())
    return [] if 2 * alone > len(by_unit) > 1 else list(by_unit.items())


def method_table(doc: Any, path: tuple[str | int, ...], table: Table, wide: Collection[str] = ()) -> list[Any]:
    """Return a table of a method as a block, none where it has no rows.  wide: heads that take the room that is left.

    Numbers are rounded to the column "u(symbol)" of their own or "u" where there is one; columns "p" and "probability"
    are written as probabilities, a "difference", which may be far below u, and multiples "of u" to two digits.
    """
    heads = [str(h) for h in table.columns]
    rows = []
    for i, values in enumerate(table.rows):
        beside = dict(zip(heads, values, strict=False))
        cells = []
        for j, head in enumerate(heads):
            u = beside.get(f"u({SYMBOLS.get(words(head)[0], words(head)[0])})") or beside.get("u")
            shown: dict[str, Any] = {"significant": 2} if head in ("difference", "of u") else {"u": u}
            if head in ("p", "probability") or head.startswith("p "):
                shown = {"write": write_p}
            cells.append(number_cell(doc, (*path, "rows", i, j), **shown))
        rows.append(Row(cells))
    caption = ". ".join(t.rstrip(".") for t in (table.title, table.caption) if t)
    return [PageTable(columns(*map(words, heads), wide=wide), rows, f"{caption}.")] if rows else []


def limit_text(limit: Sequence[float | None] | None) -> str:
    """ "−1.5 … 1.5", "≥ −1.5", "≤ 1.5", or a dash."""
    low, high = limit if limit is not None else (None, None)
    if low is None and high is None:
        return "–"
    if low is None:
        return f"≤ {write_number(high, significant=6).text}"
    if high is None:
        return f"≥ {write_number(low, significant=6).text}"
    return f"{write_number(low, significant=6).text} … {write_number(high, significant=6).text}"


def render_value(
    doc: Any, path: tuple[str | int, ...], caption: str, by_u: bool = False, significant: int = 4
) -> list[Any]:
    """Blocks for any JSON value: rows of a table for a list of dictionaries, name and value for a dictionary.

    With ``by_u`` the floats of a row are rounded to the standard uncertainty that stands in the row (``u``
    or ``u_...``).
    """
    value = value_at(doc, *path)
    if not value:
        return []
    if isinstance(value, str):
        return [Text(value)]
    if isinstance(value, Mapping):
        nested = {k: v for k, v in value.items() if isinstance(v, Mapping) or _is_rows(v)}
        flat = [k for k in value if k not in nested]
        blocks: list[Any] = []
        if flat:
            rows = []
            for k in flat:
                name, unit = words(k)
                rows.append(Row([text_cell(name), _cell(doc, (*path, k), None, significant), text_cell(unit)]))
            blocks.append(PageTable(columns("quantity", "value", "unit"), rows, caption))
        for k in nested:
            text = f"{caption.rstrip('.')}: {words(k)[0]}." if len(nested) > 1 else caption
            blocks += render_value(doc, (*path, k), text, by_u, significant)
        return blocks
    if _is_rows(value):
        keys = list(dict.fromkeys(k for row in value for k in row))
        us = [
            next((v for k, v in row.items() if k == "u" or k.startswith("u_")), None) if by_u else None for row in value
        ]
        rows = [Row([_cell(doc, (*path, i, k), us[i], significant) for k in keys]) for i in range(len(value))]
        return [PageTable(columns(*map(words, keys)), rows, caption)]
    return [Text(f"{caption.rstrip('.')}: {compact(value)}.")]


def _is_rows(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, Mapping) for v in value)


def _cell(doc: Any, path: tuple[str | int, ...], u: float | None = None, significant: int = 4) -> Cell:
    value = value_at(doc, *path)
    if isinstance(value, bool):
        return text_cell("yes" if value else "no")
    if isinstance(value, int | float) or value is None:
        return number_cell(doc, path, u, significant=significant)
    if "range" in str(path[-1]) and isinstance(value, list) and all(isinstance(v, int | float) for v in value):
        return text_cell(" … ".join(write_number(v, significant=significant).text for v in value))
    return text_cell(value if isinstance(value, str) else compact(value))


def _plain(doc: Any, path: tuple[str | int, ...]) -> Cell:
    """Return a parameter: all its digits that matter, not aligned, for magnitudes differ."""
    cell = _cell(doc, path, None, 8)
    said = isinstance(value_at(doc, *path), bool) or cell.text.endswith(" entries)")
    return Cell(cell.text, full=cell.full, pointer=cell.pointer, own=not said)


def compact(value: Any, length: int = 72) -> str:
    """Return a list or dictionary in one line, cut where it gets long."""
    text = json.dumps(value, ensure_ascii=False, separators=(", ", ": "))
    if len(text) <= length:
        return text
    count = f" ({len(value)} entries)" if isinstance(value, list | dict) else ""
    return f"{text[:length]}…{count}"


def how_tables(report: Report[Any]) -> list[Any]:
    """Return parts, parameters, settings of the run and versions."""
    run, doc = report.run, report.document
    blocks: list[Any] = []
    if run.parts:
        rows = []
        for slot, part in run.parts.items():
            names = [text_cell(part.name or None, own=True)]
            names += [text_cell(x or None) for x in (part.version, part.target, part.fmi)]
            time = number_cell(doc, ("provenance", "timing", slot), significant=3)
            rows.append(Row([text_cell(slot, "strong", own=True), *names, time, Cell(part.sha256 or "–", mark="hash")]))
        heads = columns("slot", "component", "version", "target", "FMI", ("time", "s"), "SHA-256", wide=("SHA-256",))
        blocks.append(PageTable(heads, rows, "Components in their slots, with the computing time of each.", small=True))
    blocks += _changed(report) + _defaults(report)
    facts = {"seed": "", "step": "s", "engine": "", "complete": "", "stopped_at": "s"}
    rows = [
        Row([text_cell("end of the run" if k == "stopped_at" else k), _cell(doc, ("provenance", k), None, 8),
             text_cell(unit)])
        for k, unit in facts.items()
        if value_at(doc, "provenance", k) is not None
    ]  # fmt: skip
    if rows:
        blocks.append(PageTable(columns("setting", "value", "unit"), rows, "Settings of the run."))
    blocks += render_value(doc, ("provenance", "data"), "Data reduced.")
    if run.notes:
        blocks.append(BulletList(run.notes))
    if run.versions:
        rows = [Row([text_cell(k, own=True), text_cell(v, own=True)]) for k, v in run.versions.items()]
        table = PageTable(columns("package", "version"), rows, "Package versions.", small=True)
        blocks.append(CollapsedBlocks("Package versions", [table]))
    return blocks


def _changed(report: Report[Any]) -> list[Any]:
    """Return what was changed against the defaults: parameters, options, swapped parts."""
    run = report.run
    if not run.changed:
        text = "No option, parameter or component differs from its default."
        return [Text(text)] if run.parameters or run.options else []
    rows = []
    for name in run.changed:
        where = "parameters" if name in run.parameters else "options" if name in run.options else ""
        value = _plain(report.document, ("provenance", where, name)) if where else text_cell("changed")
        rows.append(Row([text_cell(name, "strong", own=True), value]))
    caption = "Options, parameters and components that differ from their defaults, in SI units."
    return [PageTable(columns("changed", "value (SI)"), rows, caption, small=True)]


def _defaults(report: Report[Any]) -> list[Any]:
    """Options and parameters that stand at their defaults, folded."""
    run = report.run
    blocks: list[Any] = []
    for key, values, what in (
        ("options", run.options, "options of the system"),
        ("parameters", run.parameters, "parameters of the components"),
    ):
        names = [n for n in values if n not in run.changed]
        if names:
            rows = [Row([text_cell(n, own=True), _plain(report.document, ("provenance", key, n))]) for n in names]
            caption = f"{what.capitalize()} at their default values, in SI units."
            table = PageTable(columns("name", "value (SI)"), rows, caption, small=True)
            blocks.append(CollapsedBlocks(f"Defaults: {len(names)} {what}", [table]))
    return blocks
