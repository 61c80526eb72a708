"""The notebook: what its cells show, stored in it, and as a Markdown page.

    python docs/site/notebook.py --write [NOTEBOOK]     # runs its cells in their order and stores what they show

The cells run in this process, in an empty folder, as a kernel of Jupyter would run them; none is needed.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import hashlib
import io
import json
import os
import sys
import tempfile
from html import escape
from pathlib import Path
from typing import Any

FILE = Path(__file__).parents[2] / "docs" / "guides" / "first_runs.ipynb"
Output = dict[str, Any]  # as nbformat 4 has it


def picture(value: Any) -> str | None:
    """Return a figure of matplotlib as PNG in base64; None for anything else."""
    if not hasattr(value, "savefig"):
        return None
    file = io.BytesIO()
    value.savefig(file, format="png", dpi=90, metadata={"Software": None})
    return base64.b64encode(file.getvalue()).decode()


def shown(source: str, names: dict[str, Any]) -> list[Output]:
    """Run a cell in the names of those before; return what a notebook shows beneath it."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    value = None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, "cell", "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    found: list[Output] = []
    if text := printed.getvalue():
        found.append({"output_type": "stream", "name": "stdout", "text": text.splitlines(True)})
    if value is None:
        return found
    data: dict[str, Any] = {"text/plain": repr(value).splitlines(True)}
    if (image := picture(value)) is not None:
        data["image/png"] = image
    elif hasattr(value, "_repr_html_"):
        data["text/html"] = value._repr_html_().splitlines(True)
    return [*found, {"output_type": "execute_result", "metadata": {}, "data": data}]


def html(output: Output) -> str:
    """Return an output as HTML."""
    if output["output_type"] == "stream":
        return f"<pre>{escape(''.join(output['text']))}</pre>"
    data = output["data"]
    if "image/png" in data:
        return f'<img alt="figure" src="data:image/png;base64,{data["image/png"]}">'
    return "".join(data.get("text/html", ())) or f"<pre>{escape(''.join(data['text/plain']))}</pre>"


def sources(notebook: dict[str, Any]) -> str:
    """Return the digest of the code of a notebook, which its outputs belong to."""
    code = ["".join(c["source"]) for c in notebook["cells"] if c["cell_type"] == "code"]
    return hashlib.sha256(json.dumps(code).encode()).hexdigest()


def run(notebook: dict[str, Any]) -> None:
    """Run the cells and store what they show, in place."""
    names: dict[str, Any] = {}
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for k, cell in enumerate((c for c in notebook["cells"] if c["cell_type"] == "code"), 1):
                cell["execution_count"] = k
                cell["outputs"] = shown("".join(cell["source"]), names)
                for output in cell["outputs"]:
                    if output["output_type"] == "execute_result":
                        output["execution_count"] = k
        finally:
            os.chdir(before)
    notebook["metadata"]["gyrobench"] = {"sources": sources(notebook)}


def markdown(file: Path) -> str:
    """Return a page of the notebook's cells, with their stored outputs."""
    text: list[str] = []
    for cell in json.loads(file.read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            text += [source, ""]
            continue
        text += ["```python", source, "```", ""]
        if beneath := "".join(map(html, cell["outputs"])):
            text += ["```{raw} html", f'<div class="output">{beneath}</div>', "```", ""]
    return "\n".join(text)


def main(*words: str) -> None:
    file = Path(next((w for w in words if not w.startswith("-")), FILE))
    notebook = json.loads(file.read_text(encoding="utf-8"))
    run(notebook)
    if "--write" in words:
        file.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
