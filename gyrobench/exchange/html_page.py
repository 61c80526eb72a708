"""A system as one web page that runs it: its C as WebAssembly, parameters as sliders, channels as live curves.

The page needs no server and no network.  Its rows are instants of the run, at most :data:`ROWS` of them, evenly spaced;
what a channel does between two rows is not drawn.  Not in the page: the reduction, the report, windows of a record.
The numbers are those of the system's FMU, bit for bit.
"""

from __future__ import annotations

import base64
import json
import math
import re
import tempfile
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from gyrobench import units
from gyrobench.exchange.ssp_export import stop_time
from gyrobench.exchange.system_fmu import linked_source
from gyrobench.exchange.system_source import Exposed, SystemSource, source_files
from gyrobench.files import write_whole
from gyrobench.packaging.compiler import compile_wasm
from gyrobench.system.system import System

HERE = Path(__file__).parent / "page"
ROWS = 20_000
READ = {"rad": "deg", "rad/s": "deg/h"}  # SI unit -> unit of a slider


def export_page(
    system: System,
    path: Path,
    parts: Mapping[str, Path | str] | None = None,
    maps: Mapping[str, Path] | None = None,
    values: Mapping[str, Any] | None = None,
    seed: int = 1,
    bench: Path | None = None,
    expose: Iterable[str] = (),
    lesson: Mapping[str, Any] | None = None,
) -> list[str]:
    """Write the page; return notes for the user.

    lesson: what the page says beside the system, and what of it is shown (:mod:`gyrobench.workflow.lessons`).

    expose: parameters that get a slider, "slot.parameter" or options; the default set is that of an FMU.
    Raises what :func:`~gyrobench.exchange.system_fmu.linked_source` raises, and CompilerError without ziglang.
    """
    linked = linked_source(system, parts, maps, values, seed, bench, expose, "html", "no page can be made of it")
    chosen, source = linked.system, linked.source
    with tempfile.TemporaryDirectory(prefix="gyrobench-") as name:
        folder = Path(name)
        for file, text in source_files(source, "", 2).items():
            (folder / file).write_text(text, encoding="utf-8")
        (folder / "page.c").write_text((HERE / "page.c").read_text(encoding="utf-8"), encoding="utf-8")
        code = compile_wasm(folder / "page.c")
    content = {**_content(chosen, source, lesson), "seed": seed, "wasm": base64.b64encode(code).decode()}
    text = (HERE / "page.html").read_text(encoding="utf-8")
    scripts = ["page.js", "lesson.js"] if lesson else ["page.js"]
    for mark, files in (("/* page.css */", ["page.css"]), ("/* page.js */", scripts)):
        text = text.replace(mark, "".join((HERE / f).read_text(encoding="utf-8") for f in files))
    data = json.dumps(content, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")
    path.parent.mkdir(parents=True, exist_ok=True)
    text = text.replace("{language}", lesson["language"] if lesson else "en")
    title = lesson["title"] if lesson else chosen.title
    write_whole(path, text.replace("{title}", _escaped(title)).replace("{content}", data).encode())
    return linked.notes


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;")


def _content(system: System, source: SystemSource, lesson: Mapping[str, Any] | None) -> dict[str, Any]:
    end, rows = (lesson["end"], lesson["rows"]) if lesson else (stop_time(system), ROWS)
    every = max(1, math.ceil(end / system.step / rows))
    outputs = [_named(e) for e in source.section("output")]
    return {
        "name": system.name,
        "title": system.title,
        "version": version("gyrobench"),
        "step": system.step,
        "every": every,
        "rows": math.floor(end / system.step / every + 1e-6),
        "planned": None if lesson else _planned(system, end),
        "done": next((i for i, o in enumerate(outputs) if o["name"] == system.done), -1),
        "parts": [[slot, name] for slot, (name, _) in source.parts.items()],
        "parameters": [_parameter(e, system) for e in source.section("parameter")],
        "outputs": outputs,
        "charts": _charts(system, [o["name"] for o in outputs]),
        "fast": units.FAST,
        **({"lesson": lesson} if lesson else {}),
    }


def _named(e: Exposed) -> dict[str, Any]:
    decl = e.scalar.decl
    return {"name": e.scalar.name, "unit": decl.unit, "shown": units.display(decl.unit), "doc": decl.doc}


def _planned(system: System, end: float) -> float:
    """Return s that a run takes by its plan, without the moves between phases; the end where there is no plan."""
    planned = float(system.plan().duration()) if system.stop is None else end
    return planned if 0.0 < planned < end else end


def _parameter(e: Exposed, system: System) -> dict[str, Any]:
    """Return what a slider shows: values in the unit it is read in, ``factor`` to SI, a range around the start."""
    decl, si = e.scalar.decl, e.scalar.start
    read = READ.get(decl.unit, decl.unit)
    factor = units.convert(1.0, read, decl.unit) if read != decl.unit else 1.0
    start = si / factor
    low, high = (start - 2.0 * abs(start), start + 2.0 * abs(start)) if start else (-1.0, 1.0)
    bounds = [None if b is None else b / factor for b in (decl.min, decl.max, decl.above, decl.below)]
    low = max([low, *(b for b in (bounds[0], bounds[2]) if b is not None)])
    high = min([high, *(b for b in (bounds[1], bounds[3]) if b is not None)])
    return {
        **_named(e),
        **({"doc": system.options[e.scalar.name].doc} if e.scalar.name in system.options else {}),
        "shown": units.display(read),
        "reference": e.scalar.reference,
        "factor": factor,
        "start": start,
        "low": low,
        "high": high,
        "bounds": bounds,
        "kind": decl.type.__name__,
    }


def _charts(system: System, names: list[str]) -> list[list[int]]:
    """Return the outputs of each chart: the channels, the elements of a vector together."""
    vectors: dict[str, list[int]] = {}
    for i, name in enumerate(names):
        if name in system.channels or re.sub(r"\[[\d,]+\]$", "", name) in system.channels:
            vectors.setdefault(re.sub(r"\[[\d,]+\]$", "", name), []).append(i)
    declared = [[i for n in entry.split() for i in vectors.get(n, [])] for entry in system.shown]
    return [chart for chart in declared if chart] or list(vectors.values()) or [[i] for i in range(len(names))]
