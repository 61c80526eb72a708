"""The page of measured data: a file is dropped, its columns are mapped, its faults are listed, it is reduced."""

from __future__ import annotations

import asyncio
import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from nicegui import ui
from nicegui.events import UploadEventArguments

from gyrobench import reading, units
from gyrobench.bench import Bench, UsageError, display_path
from gyrobench.errors import GyrobenchError
from gyrobench.files import write_whole
from gyrobench.reading import visible
from gyrobench.record.column_proposal import FileColumn
from gyrobench.record.text_cells import cells_of_file
from gyrobench.studio.frame import CopyLines, Studio, dropped, frame, given_in_address, inside, pairs_in_address, told
from gyrobench.studio.request import FILES, KEPT, JobRequest
from gyrobench.studio.words import content, heading, say, shown, spoken
from gyrobench.system.system import System
from gyrobench.workflow.fit_columns import ColumnProposal, propose_columns
from gyrobench.workflow.gallery import gallery
from gyrobench.workflow.measured_run import find_faults
from gyrobench.workflow.user_errors import user_message

ROWS = 8  # of the preview
WIDE = 14  # columns of it
NAME = 80  # characters of the name of a file
NOT = "not in the file"


def kept_name(name: str) -> str:
    """Return the name under which a dropped file is kept: its own, without what could lead elsewhere."""
    plain = re.sub(r"[^\w.() +-]", "_", Path(name.replace("\\", "/")).name).lstrip(".")[-NAME:]
    return plain or "data"


def keep(studio: Studio, name: str, content: bytes) -> Path:
    """Keep a dropped file in the bench and return it; the same content has the same place."""
    folder = studio.bench.out / FILES / hashlib.sha256(content).hexdigest()[:12]
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / kept_name(name)
    write_whole(file, content)
    return file


def tests_of_data(studio: Studio) -> dict[str, str]:
    """Return name -> title of the systems that reduce measured data."""
    return {e.name: f"{say(e.title, e.name)} ({e.name})" for e in gallery(studio.bench) if e.measured}


@dataclass
class _Mapping:
    """A file on its way to a report: its proposal, as it was changed, and what is stated."""

    proposal: ColumnProposal
    lines: CopyLines
    factors: dict[str, float] = field(default_factory=dict)
    stated: dict[str, str] = field(default_factory=dict)
    changed: list[Callable[[], None]] = field(default_factory=list)

    @property
    def map_file(self) -> Path:
        return self.proposal.file.with_name(f"{self.proposal.test.name}.toml")

    def text(self) -> tuple[str, list[str]]:
        """Return the column map and what it lacks."""
        text, problems = self.proposal.text()
        for name, factor in self.factors.items():
            head = f"[columns.{name}]\n"
            text = text.replace(head, f"{head}factor = {factor!r}\n") if factor != 1.0 else text
        return text, problems

    def request(self) -> JobRequest:
        return JobRequest(
            self.proposal.test.name, values=dict(self.stated), data=display_path(self.proposal.file),
            columns=display_path(self.map_file), place=Path(*self.proposal.file.parts[-2:]).as_posix(),
            language=say.of_report(self.proposal.test.name, Bench.find().folder),
        )  # fmt: skip

    def write(self) -> JobRequest:
        """Write the map beside the file and return what reduces it."""
        write_whole(self.map_file, self.text()[0].encode())
        return self.request()

    def restore(self) -> None:
        """Take columns, units and signs as the map beside the file has them."""
        if not self.map_file.is_file():
            return
        there = {c.sources: c for c in self.proposal.layout.columns}
        found = {}
        kept = reading.toml(reading.read_text(self.map_file, UsageError), self.map_file, UsageError)
        for name, entry in kept.get("columns", {}).items():
            source = entry.get("from", [])
            if column := there.get(tuple(source) if isinstance(source, list) else (source,)):
                unit = entry.get("unit", column.unit)
                found[name] = replace(column, unit=unit, written=unit)
                self.factors[name] = entry.get("factor", 1.0)
        self.proposal = replace(self.proposal, found=found)

    def put(self, name: str, column: FileColumn | None) -> None:
        """Say which column of the file is a column of the test; None: there is none."""
        found = {n: c for n, c in self.proposal.found.items() if n != name}
        if column is not None:
            found[name] = column
        self.proposal = replace(self.proposal, found=found)
        self.now()

    def unit(self, name: str, text: str) -> str | None:
        """Say the unit of a column; return what is wrong with it."""
        try:
            if text:
                units.unit(text)
                if (wanted := self.proposal.wanted.get(name)) and not units.same_dimension(text, wanted):
                    return f"{text} is no unit of {wanted or '1'}"
        except GyrobenchError as error:
            return str(error)
        self.put(name, replace(self.proposal.found[name], unit=text, written=text))
        return None

    def now(self) -> None:
        request = self.request()
        self.lines.show(request.command(), request.python())
        for call in self.changed:
            call()


def _preview(mapping: _Mapping) -> None:
    """Add the first rows of the file as they are."""
    layout = mapping.proposal.layout
    rows: list[list[str]] = []
    for number, cells in cells_of_file(mapping.proposal.text_file, layout.encoding, layout.delimiter):
        if number > layout.skip:
            if not rows and not layout.names:
                rows.append(["", *map(str, range(1, len(cells[:WIDE]) + 1))])
            rows.append([str(number), *cells[:WIDE]])
        if len(rows) > ROWS:
            break
    decimal = "comma" if layout.decimal == "," else "point"
    said = [layout.encoding, f"separator {layout.delimiter!r}", f"decimal {decimal}", f"{layout.skip} lines above"]
    ui.label(say(", ".join(said))).classes("soft")
    with ui.element("div").classes("scroll"), ui.element("table").classes("runs"):
        for k, row in enumerate(rows):
            with ui.element("tr"):
                for cell in row:
                    with ui.element("td" if k else "th"):
                        ui.label(visible(cell)[:40])


def _columns(mapping: _Mapping) -> None:
    """Add a row for each column of the test: which of the file it is, its unit, its sign; of a record of any columns
    without names, one for each of the file, too.
    """
    columns = mapping.proposal.layout.columns
    names = {}
    for k, c in enumerate(columns):
        name = " + ".join(map(str, c.sources)) if len(c.sources) > 1 else c.name  # a date and a clock time
        names[k] = f"{name} [{c.unit or c.written}]" if c.unit or c.written else name
    any_names = not mapping.proposal.layout.names and "channel" in mapping.proposal.test.options
    free = [c.name for c in columns if any_names]  # what they are is said by their units
    for name in dict.fromkeys([*mapping.proposal.wanted, *mapping.proposal.found, *free]):
        wanted = mapping.proposal.wanted.get(name, "")
        with ui.element("div").classes("setting mapped"):
            with ui.element("div").classes("about"):
                ui.label(name).classes("option")
                ui.label(say(f"as {wanted}") if wanted not in ("", "1") else "").classes("range")
            with ui.element("div").classes("bar"):
                held = mapping.proposal.found.get(name)
                at = next((k for k, c in enumerate(columns) if held and c.sources == held.sources), -1)
                menu = ui.select({-1: say(NOT), **names}, value=at).props("dense outlined")
                menu.props(spoken(f"column for {name}"))
                check = _unit_check(mapping, name)
                unit = ui.input(value=held.unit if held else "", placeholder=say("unit"), validation=check)
                unit.props("dense outlined hide-bottom-space debounce=250").classes("narrow")
                unit.props(spoken(f"unit of {name}"))
                sign = ui.checkbox(say("reversed"), value=mapping.factors.get(name, 1.0) < 0.0).props("dense")
        _follow(mapping, name, menu, unit, sign)


def _unit_check(mapping: _Mapping, name: str) -> Callable[[Any], str | None]:
    def check(text: Any) -> str | None:
        return mapping.unit(name, str(text or "").strip()) if name in mapping.proposal.found else None

    return check


def _follow(mapping: _Mapping, name: str, menu: Any, unit: Any, sign: Any) -> None:
    def chosen() -> None:
        column = None if menu.value is None or menu.value < 0 else mapping.proposal.layout.columns[menu.value]
        mapping.put(name, column)
        unit.set_value(column.unit if column else "")

    def turned() -> None:
        mapping.factors[name] = -1.0 if sign.value else 1.0
        mapping.now()

    menu.on_value_change(chosen)
    sign.on_value_change(turned)


def _stated(mapping: _Mapping) -> None:
    """Add a field for each value that the test needs to know beside the file."""

    def take(name: str, text: str) -> None:
        mapping.stated.pop(name, None)
        if text.strip():
            mapping.stated[name] = text.strip()
        mapping.now()

    for name, example in mapping.proposal.stated.items():
        option = mapping.proposal.test.options.get(name)
        with ui.element("div").classes("setting"):
            with ui.element("div").classes("about"):
                ui.label(name).classes("option")
                content(option.doc if option else "", mapping.proposal.test.name)
            value = ui.input(value=mapping.stated.get(name, ""), placeholder=say(example))
            value.props("dense outlined debounce=250")
            value.props["aria-label"] = name
            value.on_value_change(lambda e, n=name: take(n, e.value or ""))


def _mapped(studio: Studio, proposal: ColumnProposal) -> None:
    """Add the mapping of a file, the list of its faults and the button that reduces it."""
    with ui.element("div").classes("two"):
        with ui.element("div") as left:
            pass
        with ui.element("div").classes("aside"):
            with ui.element("div").classes("bar"):  # above what grows: no click counts where a button moved under it
                check = ui.button(say("Check the file"), icon="rule")
                go = ui.button(say("Reduce"), icon="play_arrow")
            faults = ui.element("section").classes("rows").props("role=status").props(spoken("What is wrong"))
            mapping = _Mapping(proposal, CopyLines(), stated=pairs_in_address("set"))
            if KEPT in given_in_address("columns"):
                mapping.restore()
            with ui.expansion(say("Column map")).classes("full"):
                text = ui.label().classes("code")
    with left:
        heading("File", 2)
        _preview(mapping)
        heading("Columns", 2)
        ui.label(say("Check columns, units and signs: names do not tell them all.")).classes("soft")
        _columns(mapping)
        heading("What the test needs to know", 2)
        _stated(mapping)

    def listed(lines: list[str], head: str) -> None:
        faults.clear()
        with faults:
            ui.label(say(head)).classes("small-head")
            for line in lines:
                content(shown(line)).classes("problem")

    def lacks() -> None:
        written, problems = mapping.text()
        text.set_text(written)
        listed(problems, "The map still lacks:" if problems else "Every column has its place and its unit.")

    async def examine() -> None:
        try:
            test, request = mapping.proposal.test, mapping.write()
            assert isinstance(test, System)
            found = await asyncio.to_thread(find_faults, test, proposal.file, request.values, mapping.map_file)
        except Exception as error:
            listed([user_message(error, at_shell=False)], "The file cannot be read so:")
            return
        listed(found, f"{len(found)} faults:" if found else "Nothing is wrong with the file: it can be reduced.")

    def reduce() -> None:
        ui.navigate.to(f"/job/{studio.jobs.submit(mapping.write())}")

    check.on_click(examine)
    go.on_click(told(reduce))
    mapping.changed.append(lacks)
    mapping.now()


def add_data_page(studio: Studio) -> None:
    """Register the page."""

    @ui.page("/data", response_timeout=60)
    async def data_page(file: str = "", test: str = "") -> None:
        tests = await asyncio.to_thread(tests_of_data, studio)
        with frame(studio, "Data"):
            heading("Measured data")
            ui.label(
                say("Choose the test and drop its record: columns are proposed, faults listed; then it is reduced.")
            )
            if studio.read_only:
                raise UsageError("the studio is read-only: no file is taken")
            chosen = ui.select(tests, value=test if test in tests else None, label=say("Test"), with_input=True)
            chosen.props("dense outlined").classes("full")
            there = inside(studio.bench.out / FILES, file) if file else None

            def show() -> None:
                if chosen.value and there is not None:
                    ui.navigate.to(f"/data?file={file}&test={chosen.value}")

            async def taken(event: UploadEventArguments) -> None:
                kept = keep(studio, event.file.name, await event.file.read())
                place = kept.relative_to(studio.bench.out / FILES).as_posix()
                ui.navigate.to(f"/data?file={place}&test={chosen.value or ''}")

            chosen.on_value_change(show)
            dropped("Drop a file of your laboratory: text, or a log", taken, "File")
            if there is None:
                return
            if test not in tests:
                ui.label(say(f"{there.name}: choose the test that it is of.")).classes("soft")
                return
            _mapped(studio, await asyncio.to_thread(propose_columns, there, test))
