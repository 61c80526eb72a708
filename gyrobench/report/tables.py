"""Report tables of JSON values: dictionaries, lists of rows, parameters, components."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from gyrobench.report.numbers import write_number
from gyrobench.report.page_model import (
    BulletList,
    Cell,
    CollapsedBlocks,
    Column,
    Row,
    Table,
    Text,
    number_cell,
    text_cell,
)
from gyrobench.report.result_json import value_at

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


def unit_groups(rows: Sequence[Mapping[str, Any]]) -> list[tuple[str, list[int]]]:
    """Numbers of the rows by their "unit", units in the order in which they come.

    Empty where most units have one row only, as in loop tests: there the unit belongs into a column, for headings
    would tear the table.
    """
    by_unit: dict[str, list[int]] = {}
    for k, row in enumerate(rows):
        by_unit.setdefault(str(row["unit"]), []).append(k)
    alone = sum(len(members) == 1 for members in by_unit.values())
    return [] if 2 * alone > len(by_unit) > 1 else list(by_unit.items())


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
            blocks.append(Table([Column("quantity"), Column("value"), Column("unit")], rows, caption))
        for k in nested:
            blocks += render_value(
                doc,
                (*path, k),
                f"{caption.rstrip('.')}: {words(k)[0]}." if len(nested) > 1 else caption,
                by_u,
                significant,
            )
        return blocks
    if _is_rows(value):
        keys = list(dict.fromkeys(k for row in value for k in row))
        us = [
            next((v for k, v in row.items() if k == "u" or k.startswith("u_")), None) if by_u else None for row in value
        ]
        rows = [Row([_cell(doc, (*path, i, k), us[i], significant) for k in keys]) for i in range(len(value))]
        return [Table([Column(*words(k)) for k in keys], rows, caption)]
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
    return Cell(cell.text, full=cell.full, pointer=cell.pointer)


def compact(value: Any, length: int = 72) -> str:
    """Return a list or dictionary in one line, cut where it gets long."""
    text = json.dumps(value, ensure_ascii=False, separators=(", ", ": "))
    if len(text) <= length:
        return text
    count = f" ({len(value)} entries)" if isinstance(value, list | dict) else ""
    return f"{text[:length]}…{count}"


def how_tables(doc: Any) -> list[Any]:
    """Parts, parameters, run and versions."""
    run = doc["provenance"]
    blocks: list[Any] = []
    if isinstance(run.get("parts"), Mapping) and run["parts"]:
        rows = []
        for slot, part in run["parts"].items():
            part = part if isinstance(part, Mapping) else {"name": part}
            rows.append(
                Row(
                    [
                        text_cell(slot, "strong"),
                        text_cell(part.get("name")),
                        text_cell(part.get("version")),
                        text_cell(" ".join(str(part[k]) for k in ("target",) if part.get(k))),
                        text_cell(part.get("fmi")),
                        number_cell(doc, ("provenance", "timing", slot), significant=3),
                        Cell(str(part.get("sha256") or "–"), mark="hash"),
                    ]
                )
            )
        heads = (
            ("slot", ""),
            ("component", ""),
            ("version", ""),
            ("target", ""),
            ("FMI", ""),
            ("time", "s"),
            ("SHA-256", ""),
        )
        columns = [Column(h, unit, wide=h == "SHA-256") for h, unit in heads]
        blocks.append(Table(columns, rows, "Components in their slots, with the computing time of each.", small=True))
    blocks += _changed(doc) + _defaults(doc)
    facts = [k for k in ("seed", "step", "engine", "complete", "stopped_at") if run.get(k) is not None]
    if facts:
        units = {"step": "s", "stopped_at": "s"}
        rows = [
            Row(
                [
                    text_cell({"stopped_at": "end of the run"}.get(k, k)),
                    _cell(doc, ("provenance", k), None, 8),
                    text_cell(units.get(k, "")),
                ]
            )
            for k in facts
        ]
        blocks.append(Table([Column("setting"), Column("value"), Column("unit")], rows, "Settings of the run."))
    if run.get("data"):
        blocks += render_value(doc, ("provenance", "data"), "Data reduced.")
    if run.get("notes"):
        blocks.append(BulletList([str(n) for n in run["notes"]]))
    if run.get("versions"):
        rows = [Row([text_cell(k), text_cell(v)]) for k, v in run["versions"].items()]
        blocks.append(
            CollapsedBlocks(
                "Package versions",
                [Table([Column("package"), Column("version")], rows, "Package versions.", small=True)],
            )
        )
    return blocks


def _changed(doc: Any) -> list[Any]:
    """Return what was changed against the defaults: parameters, options, swapped parts."""
    run = doc["provenance"]
    changed = [str(c) for c in (run.get("changed") or [])]
    if not changed:
        text = "No option, parameter or component differs from its default."
        return [Text(text)] if run.get("parameters") or run.get("options") else []
    rows = []
    for name in changed:
        where = next((k for k in ("parameters", "options") if name in (run.get(k) or {})), "")
        value = _plain(doc, ("provenance", where, name)) if where else text_cell("changed")
        rows.append(Row([text_cell(name, "strong"), value]))
    return [
        Table(
            [Column("changed"), Column("value (SI)")],
            rows,
            "Options, parameters and components that differ from their defaults, in SI units.",
            small=True,
        )
    ]


def _defaults(doc: Any) -> list[Any]:
    """Options and parameters that stand at their defaults, folded."""
    run = doc["provenance"]
    changed = {str(c) for c in (run.get("changed") or [])}
    blocks: list[Any] = []
    for key, what in (("options", "options of the system"), ("parameters", "parameters of the components")):
        names = [n for n in (run.get(key) or {}) if n not in changed]
        if names:
            rows = [Row([text_cell(n), _plain(doc, ("provenance", key, n))]) for n in names]
            caption = f"{what.capitalize()} at their default values, in SI units."
            table = Table([Column("name"), Column("value (SI)")], rows, caption, small=True)
            blocks.append(CollapsedBlocks(f"Defaults: {len(names)} {what}", [table]))
    return blocks
