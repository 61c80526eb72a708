"""Documentation in an FMU: documentation/index.html, made from the declarations, and licences.

Of FMI 3.0 also terminals: each vector or matrix of inputs or outputs is one, with the array as its only member.
"""

from __future__ import annotations

import importlib.metadata
import inspect
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from html import escape
from itertools import groupby
from pathlib import Path

from gyrobench.bench import standard_folder
from gyrobench.component import Component, Scalar

LICENCE = "BSD-3-Clause"
SECTIONS = {"parameter": "Parameters", "input": "Inputs", "output": "Outputs", "state": "States"}
STYLE = "body{font:16px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em}pre{overflow-x:auto;font-size:14px}"
STYLE += (
    "table{border-collapse:collapse;display:block;overflow-x:auto}td,th{padding:.15em .8em .15em 0;text-align:left}"
)


def is_standard(files: Iterable[Path]) -> bool:
    """Return whether files belong to the bench that ships with gyrobench: what others wrote has its own licence."""
    return all(Path(f).resolve().is_relative_to(standard_folder().resolve()) for f in files)


def licence_text() -> str:
    """Return the licence of gyrobench, whose code every FMU holds; "" where it is not installed beside it."""
    file = standard_folder() / "LICENSE"
    return file.read_text(encoding="utf-8") if file.is_file() else ""


def licences(python: bool = False) -> dict[str, bytes]:
    """Return the texts that a copy of an FMU must carry; python: it holds pythonfmu too."""
    texts = [f"The code that gyrobench has put into this FMU:\n\n{licence_text()}"]
    if python:
        files = importlib.metadata.distribution("pythonfmu").files or []
        found = [f.read_text() for f in files if f.name.startswith("LICENSE")]
        texts += [f"pythonfmu, in resources and binaries:\n\n{t}" for t in found]
    return {"documentation/licenses/license.txt": "\n\n".join(texts).encode()}


def index_page(title: str, summary: str, text: str, layout: Iterable[Scalar], whole: bool = True) -> dict[str, bytes]:
    """Return documentation/index.html: the text, and a table of parameters, inputs, outputs and states.

    whole: an array is one row, as it was declared.
    """
    rest = inspect.cleandoc(text)
    if rest.startswith(summary):  # a docstring, with its sources
        summary, _, rest = rest.partition("\n")
    body = [f"<h1>{escape(title)}</h1><p>{escape(summary)}</p><pre>{escape(rest.strip())}</pre>"]
    for section, group in groupby((s for s in layout if s.section in SECTIONS), lambda s: s.section):
        body.append(f"<h2>{SECTIONS[section]}</h2><table><tr><th>name<th>unit<th>start<th>meaning</tr>")
        seen = set()
        for s in group:
            array = whole and s.decl.shape
            name = s.decl.name + f"[{','.join(map(str, s.decl.shape))}]" if array else s.name
            if name not in seen:
                start = "" if array or section == "output" else f"{s.start:.9g}"
                cells = (name, s.decl.unit if s.decl.type is float else s.decl.type.__name__, start, s.decl.doc)
                body.append("<tr>" + "".join(f"<td>{escape(c)}" for c in cells) + "</tr>")
            seen.add(name)
        body.append("</table>")
    head = f'<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
    head += '<meta name="viewport" content="width=device-width">'
    return {"documentation/index.html": "\n".join([head, *body, "</html>\n"]).encode()}


def terminals(cls: type[Component]) -> dict[str, bytes]:
    """Return terminalsAndIcons/terminalsAndIcons.xml of FMI 3.0; nothing where no connector is an array."""
    root = ET.Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    parent = ET.SubElement(root, "Terminals")
    arrays = {s.decl.name: s.decl for s in cls.layout if s.section in ("input", "output") and s.decl.shape}
    for name, d in arrays.items():
        of = {"name": name, "matchingRule": "sequence", "terminalKind": "org.gyrobench.array", "description": d.doc}
        member = {"variableName": name, "variableKind": "signal"}
        ET.SubElement(ET.SubElement(parent, "Terminal", of), "TerminalMemberVariable", member)
    if not len(parent):
        return {}
    ET.indent(root)
    text = '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
    return {"terminalsAndIcons/terminalsAndIcons.xml": text.encode()}
