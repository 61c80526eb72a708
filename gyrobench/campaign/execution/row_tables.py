"""Rows of runs as Arrow tables: their types and units, tables put together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

NUMBERS = ("estimate", "u", "lo", "hi", "truth")  # of a coefficient
FIRST = {
    "run": pa.string(),
    "index": pa.int64(),
    "system": pa.string(),
    "seed": pa.int64(),
    "data": pa.string(),
    "state": pa.string(),
    "reason": pa.string(),
}
LAST = {
    "verdict": pa.string(),
    "warnings": pa.list_(pa.string()),
    "warning_ids": pa.list_(pa.string()),  # in the same order; none in rows of version 0.1.0
    "report": pa.string(),
    "instrument": pa.string(),
    "date": pa.string(),
}
Row = Mapping[str, Any]


def as_table(rows: Sequence[Row], units: Mapping[str, str]) -> pa.Table:
    """Return rows as a table: columns in the order in which the rows, sorted by index, first have them."""
    rows = sorted(rows, key=lambda row: row["index"])
    names = dict.fromkeys([*FIRST, *(name for row in rows for name in row if name not in LAST), *LAST])
    fields = []
    for name in names:
        kind = FIRST.get(name) or LAST.get(name)
        if kind is None:
            texts = any(isinstance(row.get(name), str) for row in rows)
            kind = pa.string() if texts else pa.float64()
        unit = units.get(name)
        fields.append(pa.field(name, kind, metadata={"unit": unit} if unit is not None else None))
    columns = [pa.array([_plain(row.get(f.name), f.type) for row in rows], f.type) for f in fields]
    return pa.Table.from_arrays(columns, schema=pa.schema(fields))


def _plain(value: Any, kind: pa.DataType) -> Any:
    """Return a cell: numbers that are not there as null, an axis of texts and numbers as texts."""
    if value is None or (isinstance(value, float) and value != value):
        return None
    if kind == pa.string():
        return str(value).encode("utf-8", "backslashreplace").decode()  # bytes of a path
    return float(value) if kind == pa.float64() else value


def units_of(table: pa.Table) -> dict[str, str]:
    return {f.name: f.metadata[b"unit"].decode() for f in table.schema if f.metadata and b"unit" in f.metadata}


def concatenated(tables: Sequence[pa.Table]) -> pa.Table:
    """Return tables one after the other; a column that is text in one of them is text."""
    texts = {f.name for t in tables for f in t.schema if f.type == pa.string()}
    return pa.concat_tables([_texts(t, texts) for t in tables], promote_options="default") if tables else pa.table({})


def _texts(table: pa.Table, names: set[str]) -> pa.Table:
    """Return a table with these columns as text: a number as it is written."""
    for k, field in enumerate(table.schema):
        if field.name in names and field.type != pa.string():
            cells = [None if v is None else str(v) for v in table.column(k).to_pylist()]
            table = table.set_column(
                k, pa.field(field.name, pa.string(), metadata=field.metadata), pa.array(cells, pa.string())
            )
    return table


def merge(tables: Sequence[pa.Table]) -> pa.Table:
    """Return the rows of several tables by their index, each run once: the same whatever tables the rows came in.

    Columns of results are in the order in which the rows first have them.
    """
    if not tables:
        return as_table([], {})
    places: dict[str, tuple[int, int]] = {}
    for table in tables:
        index = table.column("index")
        for k, name in enumerate(table.column_names):
            if name in FIRST or name in LAST:
                continue
            row = pc.min(index.filter(pc.is_valid(table.column(name)))).as_py()
            if row is not None:
                places[name] = min(places.get(name, (row, k)), (row, k))
    names = dict.fromkeys(n for t in tables for n in t.column_names if n not in FIRST and n not in LAST)
    last = (1 << 62, 0)  # of what no run has a number of

    def order(name: str) -> tuple[bool, tuple[int, int], str, int]:
        base, _, number = name.rpartition(".")
        if name.startswith("in.") or number not in NUMBERS:
            return not name.startswith("in."), places.get(name, last), name, 0
        return True, places.get(f"{base}.estimate", last), base, NUMBERS.index(number)

    results = sorted((n for n in names if n in places or not n.startswith("in.")), key=order)
    rows = concatenated([*tables, as_table([], {})])  # rows of older versions have fewer columns
    seen: set[str] = set()
    first = []
    for run in rows.column("run").to_pylist():
        first.append(run not in seen)
        seen.add(run)
    rows = rows.filter(pa.array(first, pa.bool_())).sort_by("index")
    return rows.select([*FIRST, *results, *LAST]).combine_chunks()


def with_plan(table: pa.Table, plan: Mapping[str, Row], units: Mapping[str, str]) -> pa.Table:
    """Return rows with the columns that the plan knows as it has them now, in their order."""
    runs = table.column("run").to_pylist()
    if not runs:
        return table
    planned = as_table([{**plan[run], "run": run} for run in runs], units)
    row = {run: k for k, run in enumerate(planned.column("run").to_pylist())}
    planned = planned.take(pa.array([row[run] for run in runs]))
    inputs = [n for n in planned.column_names if n.startswith("in.")]
    table = table.drop_columns([n for n in table.column_names if n.startswith("in.")])
    for name in [n for n in dict.fromkeys(n for run in runs for n in plan[run]) if n not in inputs]:
        k = table.schema.get_field_index(name)
        table = table.set_column(k, planned.schema.field(name), planned.column(name))
    for k, name in enumerate(inputs, len(FIRST)):
        table = table.add_column(k, planned.schema.field(name), planned.column(name))
    return merge([table])
