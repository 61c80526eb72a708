"""Sphinx configuration of the documentation site; docs/site/build.py prepares the pages and runs Sphinx."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import sys
from html import escape
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx import addnodes

sys.path.insert(0, str(Path(__file__).parent))
from docstrings import restructured
from equations import with_subscripts

# before autodoc has read its base class: pydantic cannot derive from that any more
importlib.import_module("gyrobench.report.provenance")

project = "gyrobench"
author = "the gyrobench authors"
version = release = importlib.metadata.version("gyrobench")
root_doc = "README"
extensions = ["myst_parser", "sphinx.ext.autodoc"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
myst_all_links_external = False
suppress_warnings = ["ref.python"]  # names that several modules have, in docstrings
nitpicky = False

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
#: what a module hands on in ``__all__`` is documented where it is defined
autodoc_default_options = {"members": True, "show-inheritance": True, "ignore-module-all": True}
OPTIONAL = ("distributed", "dask", "fsspec", "psutil", "SALib", "pandas", "pygeomag", "fmu_manipulation_toolbox")
#: of the studio: what only a type checker imports of them does not run
FRONT_END = ["fastapi", "nicegui", "starlette", "uvicorn"]
autodoc_mock_imports = [*(name for name in OPTIONAL if importlib.util.find_spec(name) is None), *FRONT_END]
python_use_unqualified_type_names = True
toc_object_entries = False

html_theme = "furo"
html_title = f"gyrobench {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_copyright = False
html_show_sphinx = False
html_copy_source = False
html_math_renderer = "mathml"
highlight_language = "text"  # indented blocks are equations
pygments_style = "default"
pygments_dark_style = "github-dark"


def mathml(self: Any, node: Any) -> None:
    """Set an equation as MathML, which browsers draw with their own fonts: no script, no network."""
    block = node.tagname == "math_block"
    text = tex2mathml(node.astext(), as_block=block)
    self.body.append(f'<div class="math">{text}</div>' if block else text)
    raise nodes.SkipNode


def docstring(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    lines[:] = restructured(lines)


def subscripts(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    if "body" in context:
        context["body"] = with_subscripts(context["body"])


def sidebar(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Put a short tree into the sidebar: the chapters, and the pages of the one that is open.

    Sphinx's own tree has every heading of every page, copied for every page: most of the time of a build.
    """
    env = app.env
    chapters = [(n["caption"], [ref for _, ref in n["entries"]]) for n in env.tocs[root_doc].findall(addnodes.toctree)]

    def entry(level: int, name: str, text: str, current: bool, inside: str = "") -> str:
        kind = f"toctree-l{level}" + (" current" if current else "")
        link = "#" if name == page else context["pathto"](name)
        return f'<li class="{kind}"><a class="reference internal" href="{link}">{escape(text)}</a>{inside}</li>'

    def tree(**options: Any) -> str:
        items = []
        for caption, names in chapters:
            here = page in names
            inside = "".join(entry(2, n, env.titles[n].astext(), n == page) for n in names) if here else ""
            items.append(entry(1, names[0], caption, here, f"<ul>{inside}</ul>" if here else ""))
        return f"<ul>{''.join(items)}</ul>"

    context["toctree"] = tree


def setup(app: Any) -> None:
    app.add_html_math_renderer("mathml", (mathml, None), (mathml, None))
    app.connect("autodoc-process-docstring", docstring)
    app.connect("html-page-context", subscripts)
    app.connect("html-page-context", sidebar, priority=400)  # before the theme, which calls it
