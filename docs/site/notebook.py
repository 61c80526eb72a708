"""The notebook as a Markdown page, with what its cells show."""

from __future__ import annotations

import ast
import contextlib
import io
import json
import os
import tempfile
from html import escape
from pathlib import Path
from typing import Any


def shown(source: str, names: dict[str, Any]) -> str:
    """Run a cell in the names of those before; return what a notebook shows beneath it, as HTML."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    value = None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, "cell", "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    text = f"<pre>{escape(printed.getvalue())}</pre>" if printed.getvalue() else ""
    if value is None:
        return text
    return text + (value._repr_html_() if hasattr(value, "_repr_html_") else f"<pre>{escape(repr(value))}</pre>")


def markdown(notebook: Path, run: bool) -> str:
    """Return a page of the notebook's cells; run: with their output."""
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    text: list[str] = []
    names: dict[str, Any] = {}
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for cell in cells:
                source = "".join(cell["source"])
                if cell["cell_type"] == "markdown":
                    text += [source, ""]
                    continue
                text += ["```python", source, "```", ""]
                if run and (html := shown(source, names)):
                    text += ["```{raw} html", f'<div class="output">{html}</div>', "```", ""]
        finally:
            os.chdir(before)
    return "\n".join(text)
