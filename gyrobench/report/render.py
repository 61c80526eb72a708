"""The two renderers: HTML by jinja2, PDF by Typst.  Both draw the same :class:`Page`."""

from __future__ import annotations

import base64
import functools
import json
import re
import shutil
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gyrobench.files import temporary_folder
from gyrobench.reading import visible
from gyrobench.report.assets import content_dir, read_content
from gyrobench.report.page_model import Equation, Page, walk
from gyrobench.report.style import WIDE, clean_svg, themed

#: options (--step), and units with a stroke (°/√h), with the number before them: a browser breaks behind - and /
WHOLE = re.compile(
    r"--[a-z][a-z-]*"
    r"|[−+-]?\d+(?:[.,]\d+)? [^\s&<(]*[^\s&<(\d]/[^\s&<]*[^\s&<.,;:)]"
    r"|°/[^\s&<]*[^\s&<.,;:)]"
)
SCHEME = re.compile(r"[\s\x00-\x20]*([A-Za-z][\w+.\-\s]*):")


def equations(page: Page) -> None:
    """Typeset the equations of a page; one that Typst does not understand stays without picture."""
    for section in page.sections:
        for k, block in enumerate(b for b in walk(section.blocks) if isinstance(b, Equation)):
            block.svg = equation_svg(block.source, f"equation-{section.slug}-{k}")


def _texts(value: Any) -> Iterator[str]:
    """Yield every text of a page."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from _texts(inner)


def _typst(files: dict[str, bytes], **options: Any) -> Any:
    """Compile in memory; the files are named as in the source, "main.typ" first."""
    import typst

    compile_: Any = typst.compile  # its type stub leaves out the dictionary of files
    return compile_(files, ignore_system_fonts=True, **options)


def equation_svg(source: str, key: str) -> str:
    """Typst math as an SVG in the colour of the text; "" when it cannot be read."""
    import typst

    data = json.dumps({"equation": source}).encode()
    main = (
        "#set page(width: auto, height: auto, margin: 1pt, fill: none)\n#set text(size: 12pt)\n"
        '#math.equation(block: true, eval(json("data.json").equation, mode: "math"))'
    )
    try:
        drawn = _typst({"main.typ": main.encode(), "data.json": data}, format="svg")
    except (RuntimeError, typst.TypstError):
        return ""
    text = drawn[0] if isinstance(drawn, list) else drawn
    return clean_svg(text.decode(), key).replace("#000000", "currentColor")


def html(page: Page, bench: Path | None = None) -> str:
    """Return the page as one self-contained HTML file."""
    import markupsafe

    name = "templates/report.html.j2"
    template = _environment(content_dir(bench, name)).get_template(name)
    data = _plain(asdict(page))
    for section in data["sections"]:
        for block in section["blocks"]:
            _theme(block)
    css = markupsafe.Markup(read_content("templates/report.css", bench))
    script = markupsafe.Markup(read_content("templates/zoom.js", bench))
    text: str = template.render(page=_Attributes.of(data), css=css, script=script)
    return text


def pdf(page: Page, bench: Path | None = None) -> bytes:
    """Return the page as a PDF (A4, searchable text, vector figures).

    Raises MissingFontError where it has characters that no font of the machine has.
    """
    from gyrobench.report.fonts import fonts_for

    data = _plain(asdict(page))
    files: dict[str, bytes] = {"main.typ": read_content("templates/report.typ", bench).encode()}
    for picture in page.pictures:
        files[f"figures/{picture.key}.svg"] = picture.svg.encode()
    data.pop("pictures")
    for section in data["sections"]:
        for block in section["blocks"]:
            _strip(block)
    if page.logo:
        head, _, content = page.logo.partition(",")
        data["logo"] = "logo.png" if "png" in head else "logo.svg"
        files[data["logo"]] = base64.b64decode(content)
    others = fonts_for(_texts(data), bench, page.language)
    data["fonts"] = [font.family for font in others]
    files["data.json"] = json.dumps(data, ensure_ascii=False).encode()
    folder = _font_folder(tuple(path for font in others for path in font.files))
    made: bytes = _typst(files, font_paths=[str(folder)])
    return made


@functools.lru_cache(maxsize=8)
def _font_folder(others: tuple[Path, ...]) -> Path:
    """Return a folder with DejaVu Sans and other fonts alone: matplotlib's own holds one that draws boxes."""
    import matplotlib

    folder = temporary_folder()
    own = sorted((Path(matplotlib.get_data_path()) / "fonts" / "ttf").glob("DejaVuSans*.ttf"))
    for k, path in enumerate((*own, *others)):
        shutil.copyfile(path, folder / f"{k}{path.suffix}")
    return folder


def _plain(value: Any, key: str = "") -> Any:
    """Return a page whose texts, which may be those of others, are shown and not obeyed, and whose links lead to files.

    A link with a scheme (``javascript:``) is left out, unless it is one of the web.
    """
    if isinstance(value, dict):
        return {name: _plain(inner, name) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if not isinstance(value, str):
        return value
    scheme = SCHEME.match(value) if key == "link" else None
    return "" if scheme and scheme[1].lower() not in ("http", "https") else visible(value)


def _theme(block: dict[str, Any]) -> None:
    """Let figures follow the reader's colours, and be drawn to one scale: a narrow one takes its share of the page."""
    for picture in block.get("items", []) if block["kind"] == "pictures" else []:
        picture["share"] = min(_width(picture["svg"]) / (72.0 * WIDE), 1.0)
        picture["svg"] = themed(picture["svg"])
    for inner in block.get("blocks", []):
        _theme(inner)


def _strip(block: dict[str, Any]) -> None:
    """Typst reads the figures from files; it needs their width in pt beside."""
    if block["kind"] == "equation":
        block["svg"] = "typeset" if block["svg"] else ""
    for picture in block.get("items", []) if block["kind"] == "pictures" else []:
        picture["width"] = _width(picture.pop("svg"))
    for inner in block.get("blocks", []):
        _strip(inner)


def _width(svg: str) -> float:
    """Return the width of a figure, pt."""
    match = re.search(r'width="([\d.]+)pt"', svg)
    return float(match.group(1)) if match else 72.0 * WIDE


@functools.lru_cache(maxsize=8)
def _environment(folder: Path) -> Any:
    """Return jinja2 with the templates of a folder, compiled once and again when they change."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),  # from its file, which then stands in a traceback
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["unbroken"] = _unbroken
    return environment


def _unbroken(text: str) -> Any:
    """Return a text that breaks neither its options of the command line (--step) nor a number from its unit (5 °/h)."""
    import markupsafe

    escaped = str(markupsafe.escape(text))
    return markupsafe.Markup(WHOLE.sub(r'<span class="whole">\g<0></span>', escaped))


class _Attributes(dict[str, Any]):
    """A dictionary whose keys win over dict methods in templates (``block.items`` is the list)."""

    def __getattribute__(self, name: str) -> Any:
        return self[name] if name in self else super().__getattribute__(name)

    @classmethod
    def of(cls, value: Any) -> Any:
        if isinstance(value, dict):
            return cls({k: cls.of(v) for k, v in value.items()})
        return [cls.of(v) for v in value] if isinstance(value, list | tuple) else value
