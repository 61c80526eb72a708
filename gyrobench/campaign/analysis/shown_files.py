"""Paths of a machine, which a site does not print: files by their places in the folder that holds all of them."""

from __future__ import annotations

import re
from typing import Any

#: of either kind of machine: a campaign may be that of others
ABSOLUTE = re.compile(r"(?:/[^/\n]+){2,}|[A-Za-z]:[/\\].+")
#: what two paths have in common
FOLDER = re.compile(r"(.+[/\\]).*\0\1", re.DOTALL)


def without_folders(rows: Any) -> Any:
    """Return the rows of a campaign with files of measurements and parts, and what is said of them, without the folder
    that all of them lie in.
    """
    rows = rows.copy()
    for name in [c for c in rows if c == "data" or c.startswith("in.")]:
        paths = sorted({v for v in rows[name] if isinstance(v, str) and ABSOLUTE.fullmatch(v)})
        if paths and (folder := FOLDER.match(f"{paths[0]}\0{paths[-1]}")):  # and all that are sorted between
            for column in (name, "reason", "warnings"):
                rows[column] = [_cut(v, folder[1]) for v in rows[column]]
    return rows


def _cut(value: Any, folder: str) -> Any:
    if isinstance(value, str) or value is None or not hasattr(value, "__iter__"):
        return value.replace(folder, "") if isinstance(value, str) else value
    return [_cut(v, folder) for v in value]


def names_alone(value: Any) -> Any:
    """Return values of a campaign's definition with files by their names."""
    if isinstance(value, dict):
        return {name: names_alone(v) for name, v in value.items()}
    if isinstance(value, list):
        return [names_alone(v) for v in value]
    return re.split(r"[/\\]", value)[-1] if isinstance(value, str) and ABSOLUTE.fullmatch(value) else value
