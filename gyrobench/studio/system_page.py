"""The page of a system: its parts, options and parameters, and the run of it."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from html import escape
from typing import Any
from urllib.parse import quote

from nicegui import ui

from gyrobench.bench import Bench
from gyrobench.component.declarations import Declaration
from gyrobench.errors import GyrobenchError
from gyrobench.report import wiring_figure
from gyrobench.studio.frame import CopyLines, Studio, frame, given_in_address, pairs_in_address, search_field, told
from gyrobench.studio.request import JobRequest
from gyrobench.studio.slot_fmu import drop_fmu
from gyrobench.studio.time_line import TimeLine
from gyrobench.studio.words import content, heading, say, spoken
from gyrobench.system.configurable import Option
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.system.values import flatten, parse
from gyrobench.system.wire_text import parse_wires
from gyrobench.units import convert, format_quantity
from gyrobench.workflow.fitting_parts import fitting_parts, load_parts, part_of, settable
from gyrobench.workflow.inputs import load_test

NONE = "none"
SEVERAL = 9  # elements of an array that have a row each
DRAWING = threading.Lock()  # the drawing library keeps one style at a time


def wiring_of(name: str) -> str:
    """Return the drawing of a system's wiring as an SVG, from what it declares; of a suite, its name alone."""
    test = load_test(name)
    if isinstance(test, Suite) or not test.slots:
        text = f'<text x="10" y="35">{escape(name)}</text>'
        return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 300 60">{text}</svg>'
    wires = [f"{a}.{x} -> {b}.{y}" for a, x, b, y in parse_wires(test.wires)]
    with DRAWING:
        return wiring_figure.draw(list(test.slots), wires, "wiring")


def _unit(unit: str | type) -> str:
    return {int: "whole number", bool: "true or false", str: "text"}.get(unit, "") if isinstance(unit, type) else unit


#: units in which a value may be shown: the one in which it is shortest, the first of equals
SMALL = 2e-3  # rad, below which an angle is shown in minutes or seconds of arc
ALSO = {"rad": ("deg", "arcmin", "arcsec", "rad"), "rad/s": ("deg/h", "deg/s", "rad/s")}


def _shown(value: Any, unit: str | type) -> str:
    """Return a value as a person writes it."""
    if isinstance(unit, type):
        return str(value).lower() if unit is bool else str(value)
    if unit not in ALSO or not isinstance(value, int | float):
        return format_quantity(value, unit)
    small = 0.0 < abs(value) < SMALL
    said = ((f"{convert(value, unit, u):.6g}", u) for u in ALSO[unit] if small or u not in ("arcmin", "arcsec"))
    number, name = min(said, key=lambda pair: len(pair[0]))
    return f"{number}°" if name == "deg" else f"{number} {name}"


def _range(low: float | None, high: float | None, unit: str | type, strict: bool = False) -> str:
    """Return the range of a value in words."""
    named = unit if isinstance(unit, str) else "1"
    more, less = (">", "<") if strict else ("≥", "≤")
    limits = [(more, low), (less, high)]
    return ", ".join(f"{sign} {_shown(x, named)}" for sign, x in limits if x is not None)


class _Choice:
    """Choices on a page: the request that they lead to, and what must be shown anew when one changes."""

    def __init__(self, test: System | Suite, lines: CopyLines) -> None:
        self.test, self.lines = test, lines
        self.request = JobRequest(test.name, language=say.of_report(test.name, Bench.find().folder))
        self.wrong: dict[str, str] = {}  # name -> why its text is no value
        self.changed: list[Callable[[], None]] = []

    def set(self, name: str, text: str, check: Callable[[str], Any]) -> str | None:
        """Take a value; return what is wrong with it.  An empty text takes it back."""
        self.wrong.pop(name, None)
        values = {k: v for k, v in self.request.values.items() if k != name}
        if text := (text or "").strip():
            values[name] = text
            try:
                check(text)
            except GyrobenchError as error:
                self.wrong[name] = str(error)
        self._now(replace(self.request, values=values))
        return self.wrong.get(name)

    def put(self, slot: str, part: str, own: str, mapping: str = "") -> None:
        """Put a part into a slot; its own one takes the choice back.  Values of the part before are dropped."""
        parts = {k: v for k, v in self.request.parts.items() if k != slot}
        maps = {k: v for k, v in self.request.maps.items() if k != slot}
        if part != own:
            parts[slot] = part
        if mapping:
            maps[slot] = mapping
        values = {k: v for k, v in self.request.values.items() if not k.startswith(f"{slot}.")}
        self.wrong = {k: v for k, v in self.wrong.items() if not k.startswith(f"{slot}.")}
        self._now(replace(self.request, parts=parts, maps=maps, values=values))

    def about(self, seed: float | None, spec: str | None) -> None:
        """Take seed and specification."""
        self._now(
            replace(self.request, seed=None if seed is None else int(seed), spec=spec if spec and spec != NONE else "")
        )

    def _now(self, request: JobRequest) -> None:
        self.request = request
        self.show()
        for call in self.changed:
            call()

    def show(self) -> None:
        self.lines.show(self.request.command(), self.request.python(isinstance(self.test, Suite)))


def _row(
    choice: _Choice, name: str, doc: str, unit: str | type, default: Any, limits: str, check: Callable[[str], Any]
) -> tuple[str, ui.element]:
    """Add a row for a value; return the text that the search looks through, and the row."""
    with ui.element("div").classes("setting") as row:
        with ui.element("div").classes("about"):
            ui.label(name).classes("option")
            content(doc, choice.test.name)
            kind = _unit(unit)
            ui.label("; ".join(x for x in (say(kind) if kind != "1" else "", limits) if x)).classes("range")
        shown = _shown(default, unit)
        given = choice.request.values.get(name, "")
        field = ui.input(placeholder=shown, value=given, validation=lambda text: choice.set(name, text, check))
        field.props("dense outlined hide-bottom-space debounce=250").props(f'aria-label="{escape(name)}"')
    return f"{name} {doc} {say(doc, choice.test.name)}".lower(), row


def _option_check(name: str, option: Option) -> Callable[[str], Any]:
    return lambda text: option.parse(name, text)


def _parameter_check(name: str, d: Declaration) -> Callable[[str], Any]:
    def check(text: str) -> None:
        value = parse(name, text, d.unit, d.type)
        if not isinstance(value, list) and (broken := d.bound_broken(float(value))):
            raise GyrobenchError(f"{name} = {text}: must be {broken} ({d.unit})")

    return check


def _searched_options(choice: _Choice) -> None:
    """Add the options, and a field that narrows them."""
    heading("Options", 2)
    search_field("Search the options", ".options", "full")
    with ui.element("div").classes("rows options"):
        for text, row in _options(choice):
            row.props["data-text"] = text


def _options(choice: _Choice) -> list[tuple[str, ui.element]]:
    return [
        _row(
            choice, name, o.doc, o.unit, choice.test.values[name], _range(o.min, o.max, o.unit), _option_check(name, o)
        )
        for name, o in choice.test.options.items()
    ]  # fmt: skip


def _parameters(studio: Studio, choice: _Choice, system: System, slot: str) -> list[tuple[str, ui.element]]:
    """Add the rows of the parameters of the part in a slot; return them as :func:`_row` does."""
    part = part_of(studio.bench, choice.request.parts.get(slot, system.all_slots()[slot].part))
    if part is None:
        ui.label(say("An FMU of another tool: set its parameters by --set SLOT.NAME=VALUE.")).classes("soft")
        return []
    owned = system.owned()
    rows = []
    for d in settable(part).values():
        unit: str | type = d.unit if d.type is float else d.type
        limits = _range(d.min, d.max, d.unit) or _range(d.above, d.below, d.unit, strict=True)
        starts = flatten(d.name, d.start)
        for name, start in starts.items() if len(starts) <= SEVERAL else ((d.name, d.start),):
            full = f"{slot}.{name}"
            doc = f"{d.doc} (set by an option of the system)" if full in owned else d.doc
            rows.append(_row(choice, full, doc, unit, start, limits, _parameter_check(full, d)))
    if not rows:
        ui.label(say("no parameters")).classes("soft")
    return rows


def _slots(studio: Studio, choice: _Choice, system: System, fitting: dict[str, list[str]]) -> None:
    """Add a menu for each slot, and below it what can be set of its part."""
    search = ui.input(say("Search the parameters of all parts")).props("dense outlined clearable").classes("full")
    drawn: dict[str, list[tuple[str, ui.element]]] = {}
    opened: dict[str, ui.expansion] = {}
    bodies: dict[str, ui.element] = {}

    def draw(slot: str) -> None:
        bodies[slot].clear()
        with bodies[slot]:
            drawn[slot] = _parameters(studio, choice, system, slot)
        narrow()

    def narrow() -> None:
        words = (search.value or "").lower().split()
        for slot, rows in drawn.items():
            hits = [all(w in text for w in words) for text, _ in rows]
            for (_, row), hit in zip(rows, hits, strict=True):
                row.set_visibility(hit)
            opened[slot].set_visibility(not words or any(hits))
            if words and any(hits):
                opened[slot].open()

    def find() -> None:
        for slot in opened if (search.value or "").strip() else ():
            if slot not in drawn:
                draw(slot)
        narrow()

    asked = choice.request
    dropped = {asked.parts[s]: file for s, file in asked.maps.items() if s in asked.parts}  # FMU -> its mapping

    def foreign(slot: str, menu: ui.select, file: str, mapping: str) -> None:
        dropped[file] = mapping
        menu.set_options([*fitting[slot], file], value=file)

    for slot, declared in system.all_slots().items():
        with ui.element("div").classes("setting"):
            with ui.element("div").classes("about"):
                ui.label(slot).classes("option")
                name = declared.socket if isinstance(declared.socket, str) else declared.socket.name
                here = "" if slot in system.slots else ", on request"
                ui.label(say(f"socket {name}{here}")).classes("range")
                part = asked.parts.get(slot, declared.part)
                about = ui.link(say("Equations, ports, limits"), f"/part/{quote(part, safe='')}", new_tab=True)
                about.props(spoken(f"equations of {slot}")).set_visibility(part not in dropped)
            offered = fitting[slot] if part in fitting[slot] else [*fitting[slot], part]
            menu = ui.select(offered, value=part).props("dense outlined").props(spoken(f"part in {slot}"))
            menu.mark(f"slot {slot}")
        with ui.expansion(say(f"Parameters of {slot}")).props("dense").classes("full") as expansion:
            bodies[slot] = ui.element("div").classes("rows")
            if not studio.read_only:
                drop_fmu(studio, system.name, slot, partial(foreign, slot, menu))
        opened[slot] = expansion

        def chosen(e: Any, slot: str = slot, own: str = declared.part, about: ui.link = about) -> None:
            choice.put(slot, e.value, own, dropped.get(e.value, ""))
            about.set_visibility(e.value not in dropped)
            about.props(f'href="/part/{e.value}"')
            if slot in drawn:
                draw(slot)

        menu.on_value_change(chosen)
        expansion.on_value_change(lambda e, slot=slot: draw(slot) if e.value and slot not in drawn else None)
    search.on_value_change(find)


def _start(studio: Studio, choice: _Choice) -> None:
    """Add seed, specification and the button that runs the system."""
    specs = [NONE, *studio.bench.specifications()]
    with ui.element("div").classes("bar"):
        asked = choice.request
        seed = ui.number(say("Seed of the noise"), value=asked.seed, min=0, precision=0, placeholder="1")
        seed.props("dense outlined clearable")
        names = {s: say(s) if s == NONE else s for s in specs}
        spec = ui.select(names, value=asked.spec or NONE, label=say("Acceptance specification"))
        spec.props("dense outlined")
        for field in (seed, spec):
            field.on_value_change(lambda: choice.about(seed.value, spec.value))

    def go() -> None:
        if choice.wrong:
            raise GyrobenchError("\n".join(choice.wrong.values()))
        ui.navigate.to(f"/job/{studio.jobs.submit(choice.request)}")

    if not studio.read_only:
        ui.button(say("Run"), icon="play_arrow", on_click=told(go)).mark("run")
    if isinstance(choice.test, System) and not choice.test.slots:
        ui.label(say("This system has nothing to run: it reduces measured data.")).classes("soft")


def add_system_page(studio: Studio) -> None:
    """Register the page."""

    @ui.page("/system/{name}", response_timeout=60)
    async def system(name: str) -> None:
        given = {key: pairs_in_address(key) for key in ("set", "part", "map")}
        seed, spec = (next(iter(given_in_address(key)), "") for key in ("seed", "spec"))

        def load() -> tuple[System | Suite, dict[str, list[str]]]:
            studio.bench.system_folder(name)  # refuses what is no name
            test = load_test(name)
            return test, {} if isinstance(test, Suite) else fitting_parts(test, load_parts(studio.bench))

        try:
            test, fitting = await asyncio.to_thread(load)
        except Exception as error:
            with frame(studio, "System"):
                raise error
            return
        with frame(studio, test.title or name):
            ui.html(f"<h1>{escape(say(test.title or name, name))}</h1>", sanitize=False)
            doc = (type(test).__doc__ or "").strip().partition("\n\n")[0]
            content(" ".join(doc.split()).partition(" [")[0], name)
            ui.label(", ".join([test.name, *test.spec])).classes("soft")
            with ui.element("div").classes("two"):
                with ui.element("div") as left:
                    pass
                with ui.element("div").classes("aside"):
                    if not isinstance(test, Suite):
                        ui.html(
                            f'<img class="wiring" src="/wiring/{name}" alt="{say(f"Wiring of {name}")}">',
                            sanitize=False,
                        )
                    line = TimeLine(test) if isinstance(test, System) and test.slots else None
                    begin = ui.element("div").classes("begin")
                    lines = CopyLines()
                    choice = _Choice(test, lines)
                    choice.request = replace(
                        choice.request, values=given["set"], parts=given["part"], maps=given["map"],
                        seed=int(seed) if seed.isdecimal() and len(seed) < 16 else None,
                        spec=spec if spec in studio.bench.specifications() else "",
                    )  # fmt: skip
                    if line:
                        choice.changed.append(lambda: line.show(choice.request.values))
                        line.show(choice.request.values)
                    choice.show()
                    with begin:
                        _start(studio, choice)
            with left:
                _searched_options(choice)
                if isinstance(test, System) and test.slots:
                    heading("Parts", 2)
                    with ui.element("div").classes("rows"):
                        _slots(studio, choice, test, fitting)
