"""Files of campaigns and tables of values: read, checked, made plain."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from gyrobench import reading, units
from gyrobench.bench import UsageError
from gyrobench.reading import shorten


def problem_of(error: ValidationError) -> str:
    """Return the first problem of a definition: key, what is wrong with its value, and the value."""
    first = error.errors()[0]
    own = str(first["ctx"]["error"]) if first["type"] == "value_error" else first["msg"]
    given = shorten(repr(first["input"]))
    return f"{'.'.join(map(str, first['loc'][:2]))} = {given}: {own[:1].lower()}{own[1:]}"


def read_table(file: Path) -> list[dict[str, Any]]:
    """Return the rows of a CSV file, each value with the unit of its column "name [unit]".  Raises UsageError."""
    text = reading.read_text(file, UsageError)
    try:
        cells_of = csv.reader(io.StringIO(text, newline=""))
        lines = [r for r in cells_of if any(x.strip() for x in r) and not r[0].startswith("#")]
    except csv.Error as error:
        raise UsageError(f"{file}: not a readable table: {error}") from None
    if len(lines) < 2:
        raise UsageError(f"{file}: a header and at least one row are expected")
    head = [h.strip() for h in lines[0]]
    names, unit = [], []
    for column in head:
        name, bracket, rest = column.rpartition(" [")
        names.append(name.strip() if bracket else column)
        unit.append(rest.rstrip("] ") if bracket else "")
        if unit[-1]:
            units.unit(unit[-1])
    rows = []
    for k, cells in enumerate(lines[1:], 2):
        if len(cells) != len(names):
            raise UsageError(f"{file}, row {k}: {len(cells)} values, expected {len(names)}")
        values = {}
        for name, u, cell in zip(names, unit, cells, strict=True):
            if value := cell.strip():
                values[name] = f"{value} {u}" if u else value
        rows.append(values)
    return rows


def as_texts(value: Any) -> Any:
    """Return numbers of a file as texts: the size of one without a unit is questioned, as on the command line."""
    if isinstance(value, dict):
        return {k: as_texts(v) for k, v in value.items()}
    if isinstance(value, list) and not any(isinstance(v, list | dict) for v in value):
        return [as_texts(v) for v in value]
    return repr(value) if isinstance(value, int | float) and not isinstance(value, bool) else value


def memory(given: Any) -> int:
    """Return bytes: "1.5GB", "500 MiB" or a number."""
    text = str(given).replace(" ", "")
    sizes = {"": 1, "B": 1, "kB": 1e3, "MB": 1e6, "GB": 1e9, "KiB": 1 << 10, "MiB": 1 << 20, "GiB": 1 << 30}
    number = text.rstrip("BkMGKi")
    try:
        size = float(number) * sizes[text[len(number) :]]
    except (KeyError, ValueError):
        raise UsageError(f"memory_limit = {given}: write for example 500MB or 1.5GB") from None
    if not 1e6 <= size < 1e18:
        raise UsageError(f"memory_limit = {shorten(text)}: no worker fits into that")
    return int(size)


def flat(content: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Return nested tables as dotted names: {"gyro": {"D_I": 1}} -> {"gyro.D_I": 1}."""
    found: dict[str, Any] = {}
    for name, value in content.items():
        found.update(flat(value, f"{before}{name}.") if isinstance(value, Mapping) else {f"{before}{name}": value})
    return found


def plain(value: Any) -> Any:
    """Return JSON values: paths and what else there is as text."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | range):
        return [plain(v) for v in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    return value if isinstance(value, str | int | float | bool | None) else str(value)
