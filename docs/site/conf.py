"""Sphinx configuration of the documentation site; docs/site/build.py prepares the pages and runs Sphinx."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import sys
from pathlib import Path
from typing import Any

from docutils.utils.math.latex2mathml import tex2mathml

sys.path.insert(0, str(Path(__file__).parent))
from docstrings import restructured

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
autodoc_default_options = {"members": True, "show-inheritance": True}
OPTIONAL = ("distributed", "dask", "fsspec", "psutil", "SALib", "pandas", "pygeomag", "fmu_manipulation_toolbox")
autodoc_mock_imports = [name for name in OPTIONAL if importlib.util.find_spec(name) is None]
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
pygments_style = "default"
pygments_dark_style = "monokai"


def mathml(self: Any, node: Any) -> None:
    """Set an equation as MathML, which browsers draw with their own fonts: no script, no network."""
    block = node.tagname == "math_block"
    text = tex2mathml(node.astext(), as_block=block)
    self.body.append(f'<div class="math">{text}</div>' if block else text)
    from docutils.nodes import SkipNode

    raise SkipNode


def docstring(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    lines[:] = restructured(lines)


def setup(app: Any) -> None:
    app.add_html_math_renderer("mathml", (mathml, None), (mathml, None))
    app.connect("autodoc-process-docstring", docstring)
