"""Equations in plain text, as they stand in indented blocks, with subscripts: D_IO becomes D with a low IO."""

from __future__ import annotations

import re

EQUATIONS = re.compile(r'(<div class="highlight-(?:none|text) notranslate">.*?</div>)', re.S)
COMMAND = re.compile(r"\b(?:gyrobench|python|dask|fmpy) |://")
SUBSCRIPT = re.compile(r"(?<![\w.])([A-Za-z\u0370-\u03ff]['\u0300-\u036f]*)_([A-Za-z0-9]{1,3})(?!\w)|  +")


def equation(line: str) -> str:
    """Return a line of an equation with its subscripts set, columns after wide gaps in their places."""
    saved = 0.0  # columns that subscripts have saved since the last gap, ch

    def put(match: re.Match[str]) -> str:
        nonlocal saved
        if match[1] is None:
            gap, saved = saved, 0.0
            return f'{match[0]}<span class="gap" style="width:{gap:.2f}ch"></span>' if gap else match[0]
        saved += 1.0 + 0.28 * len(match[2])  # the line is not shown, sub has 0.72 of the size
        return f'{match[1]}<span class="line">_</span><sub>{match[2]}</sub>'

    return SUBSCRIPT.sub(put, line)


def with_subscripts(body: str) -> str:
    """Return the HTML of a page, subscripts set in its blocks of plain text that hold no command."""

    def block(match: re.Match[str]) -> str:
        return match[0] if COMMAND.search(match[0]) else "\n".join(map(equation, match[0].split("\n")))

    return EQUATIONS.sub(block, body)
