# runs the cells of a notebook, CELLS, as a notebook does: names stay, and the value of a last line is shown
import ast
from typing import Any

NAMES: dict[str, Any] = {}
SHOWN: list[str] = []
for cell in CELLS:  # type: ignore[name-defined]  # noqa: F821
    tree = ast.parse(cell)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), NAMES)
    if isinstance(last, ast.Expr):
        value = eval(compile(ast.Expression(last.value), "cell", "eval"), NAMES)
        html = value._repr_html_() if hasattr(value, "_repr_html_") else None  # None of a figure
        SHOWN.append(html or repr(value))
