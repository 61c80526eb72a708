"""The pages of commands that a form asks for: tune or identify a loop, find a plan, sweep values."""

from __future__ import annotations

import asyncio
import functools
import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

from nicegui import ui
from nicegui.events import UploadEventArguments

from gyrobench.bench import UsageError, display_path
from gyrobench.report.language import ENGLISH
from gyrobench.studio.data_page import keep
from gyrobench.studio.frame import CopyLines, Studio, dropped, frame, given_in_address, inside, told
from gyrobench.studio.request import FILES, CommandRequest
from gyrobench.studio.run_page import report_frame
from gyrobench.studio.words import heading, say
from gyrobench.system.system import load_system
from gyrobench.tuning.loop_ports import loops_of
from gyrobench.tuning.tune_loop import tunable
from gyrobench.workflow.gallery import gallery

OWN = ("tuning.html", "tuning.pdf", "identification.html", "identification.pdf")
PAGES = (*OWN, "site/index.html")  # that a command writes; certificates have names of their own
LISTED = 100  # runs to choose from
STRUCTURES = ("lead-lag", "pi", "pi+lead-lag", "pi+lead", "lead", "lag", "lead-lag+notch", "pi+lead-lag+notch")


@dataclass(frozen=True)
class FormField:
    """A field of a form.

    option: of the command.  argument: of the function in Python, "" for the first one behind the system.  kind: "list"
    or "dict" (an entry a line, the second as NAME=VALUE), "text", "number", "choice".
    """

    option: str
    argument: str
    label: str
    kind: str
    example: str = ""
    choices: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Its name in the address of the form."""
        return self.option.removeprefix("--")

    def entries(self, value: Any) -> list[str]:
        """Return what was given: the lines of a list, one text of any other kind, nothing where it was left out."""
        lines = [line.strip() for line in str("" if value is None else value).splitlines()]
        return [line.removesuffix(".0") if self.kind == "number" else line for line in lines if line]

    def literal(self, entries: list[str]) -> str:
        """Return the value in Python."""
        if self.kind == "dict":
            return repr({n.strip(): v.strip() for n, _, v in (e.partition("=") for e in entries)})
        return repr(entries) if self.kind == "list" else entries[0] if self.kind == "number" else repr(entries[0])


@dataclass(frozen=True)
class CommandForm:
    """A page with a form.  fixed: words that every command of it has.  under: folder of its pages, "" for none.

    subject: name of what the command is about, in the address of the form.
    """

    name: str
    command: str
    text: str
    fields: tuple[FormField, ...]
    fixed: tuple[str, ...] = ()
    under: str = ""
    subject: str = "system"

    def request(self, studio: Studio, system: str, given: dict[str, Any], place: str = "") -> CommandRequest:
        """Return the command that the fields ask for.  given: option -> value of its field.

        place: of a file that the command is about, as the address of the form names it.
        """
        words, arguments, query = [self.command, system], [repr(system)], [(self.subject, place or system)]
        for f in self.fields:
            if entries := f.entries(given.get(f.option)):
                query += [(f.key, e) for e in entries]
                words += [f"{f.option}={e}" for e in entries]
                arguments.append(f"{f.argument}={f.literal(entries)}" if f.argument else f.literal(entries))
        folder = ""
        if self.under:
            folder = f"{self.under}/{hashlib.sha256(repr(words).encode()).hexdigest()[:8]}"
            words.append(f"--out={display_path(studio.bench.out / folder)}")
        lines = f"import gyrobench as gb\n\nprint(gb.{self.command}({', '.join(arguments)}))"
        fixed = [*self.fixed, *([f"--language={say.code}"] if "--site" in self.fixed and say.code != ENGLISH else [])]
        return CommandRequest([*words, *fixed], lines, folder, f"/{self.name.lower()}?{urlencode(query)}")


SET = FormField("--set", "values", "Other values", "dict", "platform.J=0.7")
PLACES = ("", "plant input", "reference", "plant output")
IDENTIFY = CommandForm(
    "Identify", "identify",
    "Open loop, plant and margins of a real loop, with intervals, from its record: columns time, excitation, input (of "
    "the plant) and output, each with its unit.",
    (
        FormField("--at", "at", "Where the excitation enters; empty: by the file", "choice", choices=PLACES),
        FormField("--band", "band", "Frequencies to look at", "text", "0.5Hz..80Hz"),
        FormField("--period", "period", "Period of the excitation; empty: found in the record", "text", "4s"),
        FormField("--want", "want", "Margins that it must have", "list", "phase margin=40deg\ndisk margin=0.5"),
        FormField("--fit", "fit", "Physical parameters to find, or known", "list", "J\nviscous\ndelay"),
    ), under="identified", subject="file",
)  # fmt: skip
TUNE = CommandForm(
    "Tune", "tune",
    "The controller of a stabilizer loop for wanted margins, in the worst case over a spread of the parts, proven in "
    "co-simulation; or why it cannot be had.",
    (
        FormField("--want", "", "Wanted", "list", "phase margin=40deg\nbandwidth>10Hz\ndisk margin=0.5"),
        FormField("--over", "over", "Spread of the parts", "list", "platform.J=±30%"),
        FormField("--loop", "loop", "Loop", "choice", choices=("",)),
        FormField("--structure", "structure", "Structure of the controller", "choice", choices=STRUCTURES),
        SET,
    ), under="tuning",
)  # fmt: skip
DESIGN = CommandForm(
    "Design", "design",
    "The shortest plan of a test for wanted standard uncertainties, judged by runs; what no plan of it can show.",
    (
        FormField("--want", "", "Standard uncertainties wanted", "dict", "D_I=0.001deg/h/g\nD_F=0.002deg/h"),
        FormField("--time", "time", "Or the best in this time", "text", "4h"),
        FormField("--count", "count", "Runs that count the prediction", "number", "0"),
        replace(SET, example="latitude=45.75deg"),
    ),
)  # fmt: skip
SWEEP = CommandForm(
    "Campaign", "sweep",
    "Many runs of a system, a row each, on all cores: over values, parts, seeds; its site shows them. The same command "
    "goes on where it was stopped.",
    (
        FormField("--over", "", "Varied, all combinations", "dict",
              "latitude=0deg..80deg:9\ngyro.D_I=0.1,0.3 deg/h/g\ngyro.D_F=uniform(-1, 1) deg/h"),
        FormField("--seeds", "seeds", "Seeds at each point", "number", "1"),
        FormField("--runs", "runs", "Points that are drawn from distributions", "number", ""),
        FormField("--spec", "spec", "Acceptance specification", "choice"),
        replace(SET, argument="set", example="latitude=45.75deg"),
    ), fixed=("--site",), under="campaigns",
)  # fmt: skip


def systems_of(studio: Studio, form: CommandForm) -> dict[str, str]:
    """Return name -> title of the systems that a form is for."""
    files = (f / "system.py" for f in studio.bench.systems().values())
    able = _tunable(tuple(f.stat().st_mtime_ns for f in files)) if form is TUNE else ()
    return {
        e.name: f"{say(e.title, e.name)} ({e.name})"
        for e in gallery(studio.bench)
        if (e.suite or e.slots) and (form is not DESIGN or e.designs) and (form is not TUNE or e.name in able)
    }


@functools.lru_cache(maxsize=4)
def _tunable(_changed: tuple[int, ...]) -> tuple[str, ...]:
    return tuple(tunable())


def _field(f: FormField, studio: Studio) -> Any:
    """Add a field, with what the address of the page gives for it."""
    given = given_in_address(f.key)
    first = given[0] if given else ""
    if f.kind == "choice":
        choices = f.choices or ("", *studio.bench.specifications())
        value = first if first in choices else choices[0]
        return ui.select(list(choices), value=value, label=say(f.label)).props("dense outlined").classes("full")
    if f.kind == "number":
        number = float(first) if first.isdecimal() and len(first) < 16 else None
        made = ui.number(say(f.label), value=number, min=0, precision=0, placeholder=f.example)
        return made.props("dense outlined").classes("full")
    if f.kind == "text":
        return ui.input(say(f.label), value=first, placeholder=f.example).props("dense outlined").classes("full")
    lines = ui.textarea(say(f"{f.label}, one a line"), value="\n".join(given), placeholder=f.example)
    return lines.props("dense outlined autogrow stack-label debounce=250").classes("full")


def _add_form(studio: Studio, form: CommandForm) -> None:
    @ui.page(f"/{form.name.lower()}", response_timeout=60)
    async def form_page(system: str = "") -> None:
        systems = await asyncio.to_thread(systems_of, studio, form)
        with frame(studio, form.name):
            heading(form.name)
            ui.label(say(form.text))
            with ui.element("div").classes("two"):
                with ui.element("div").classes("form"):
                    first = system if system in systems else next(iter(systems), None)
                    chosen = ui.select(systems, value=first, label=say("System"), with_input=True)
                    chosen.props("dense outlined").classes("full")
                    fields = {f.option: _field(f, studio) for f in form.fields}
                asked = _asking(studio, form, fields, lambda: chosen.value or "")
            loop = next(iter(given_in_address("loop")), "")

            def changed() -> None:
                if form is TUNE:
                    _offer_loops(fields["--loop"], chosen.value, loop)
                asked()

            chosen.on_value_change(changed)
            changed()


def _offer_loops(field: ui.select, system: str, loop: str) -> None:
    """Let a loop be chosen where the system has several.  loop: chosen at first, where there is one of this name."""
    there = [*loops_of(load_system(system))] if system else []
    several = len(there) > 1
    first = loop if loop in there else there[0] if several else ""
    field.set_options(there if several else [""], value=first if several else "")
    field.set_visibility(several)


def _asking(
    studio: Studio, form: CommandForm, fields: dict[str, Any], subject: Callable[[], str], place: str = ""
) -> Callable[[], None]:
    """Add the lines to copy and the button that starts; return what shows them anew.

    subject: the system or the file that the command is about, "" while none is chosen.  place: of the file.
    """
    with ui.element("div").classes("aside"):
        go = ui.button(say("Start"), icon="play_arrow").mark("start")  # above what grows, as on the page of data
        go.set_visibility(not studio.read_only)
        lines = CopyLines()

    def asked() -> CommandRequest:
        if not subject():
            raise UsageError("choose a system")
        return form.request(studio, subject(), {o: f.value for o, f in fields.items()}, place)

    def show() -> None:
        if subject():
            lines.show(asked().command(), asked().python())

    go.on_click(told(lambda: ui.navigate.to(f"/job/{studio.jobs.submit(asked())}")))
    for field in fields.values():
        field.on_value_change(show)
    show()
    return show


def _add_identify_page(studio: Studio) -> None:
    @ui.page("/identify", response_timeout=60)
    def identify_page(file: str = "") -> None:
        with frame(studio, IDENTIFY.name):
            heading(IDENTIFY.name)
            ui.label(say(IDENTIFY.text))
            if studio.read_only:
                raise UsageError("the studio is read-only: no file is taken")
            there = inside(studio.bench.out / FILES, file) if file else None

            async def taken(event: UploadEventArguments) -> None:
                kept = keep(studio, event.file.name, await event.file.read())
                ui.navigate.to(f"/identify?file={quote(kept.relative_to(studio.bench.out / FILES).as_posix())}")

            dropped("Drop a file of your laboratory: text, or a log", taken, "File")
            if there is None:
                return
            ui.label(there.name).classes("option")
            with ui.element("div").classes("two"):
                with ui.element("div").classes("form"):
                    fields = {f.option: _field(f, studio) for f in IDENTIFY.fields}
                _asking(studio, IDENTIFY, fields, lambda: display_path(there), file)


# ---------------------------------------------------------------------------------------------- results
def pages_of(folder: Path) -> list[str]:
    """Return the pages that a command wrote into its folder, as they are named there."""
    certificates = [f.name for f in sorted(folder.glob("certificate-*")) if f.suffix in (".html", ".pdf")]
    return [*(name for name in PAGES if (folder / name).is_file()), *certificates]


def served(out: Path, file: Path) -> bool:
    """Return whether a file below the folder of results is a page of a command, or belongs to a campaign's site."""
    parts = file.relative_to(out.resolve()).parts
    named = file.name in OWN or file.match("certificates/*/certificate-*.*")
    return named or (parts[0] == "campaigns" and len(parts) > 3 and parts[2] == "site")


def add_command_pages(studio: Studio) -> None:
    """Register the pages."""
    for form in (TUNE, DESIGN, SWEEP):
        _add_form(studio, form)
    _add_identify_page(studio)

    @ui.page("/pages/{place:path}", response_timeout=60)
    def result_page(place: str) -> None:
        with frame(studio, "Result"):
            folder = studio.run_folder(place)
            ui.html(f"<h1>{escape(place)}</h1>", sanitize=False)
            found = pages_of(folder)
            with ui.element("div").classes("bar"):
                for name in found:
                    ui.link(name, f"/files/{quote(place)}/{quote(name)}", new_tab=True)
            for name in [n for n in found if n.endswith(".html") and "/" not in n][:1]:
                report_frame(folder, place, name)
