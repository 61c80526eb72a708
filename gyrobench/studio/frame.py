"""The frame of all pages: the state that they share, messages, lines to copy."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from urllib.parse import quote

from nicegui import app, ui
from nicegui.events import Handler, UploadEventArguments

from gyrobench.bench import Bench, UsageError
from gyrobench.reading import visible
from gyrobench.studio.gate import UPLOAD
from gyrobench.studio.jobs import StudioJobs
from gyrobench.studio.words import NAMES, content, say, shown, spoken
from gyrobench.workflow.user_errors import user_message

MARK = "#0b5cad"  # of buttons: white on it is read at 4.5:1 and better
STYLE = Path(__file__).with_name("studio.css")
NARROW = Path(__file__).with_name("narrow.js")
SEEN = """document.addEventListener('visibilitychange', () => emitEvent('seen', !document.hidden));
if (document.hidden) emitEvent('seen', false);"""
NUMBER = "987654"  # stands for the number in the words of a count
PAGES = (
    ("Systems", "/"), ("Data", "/data"), ("Runs", "/runs"), ("Design", "/design"), ("Tune", "/tune"),
    ("Identify", "/identify"), ("Campaign", "/campaign"), ("Laboratory", "/laboratory"), ("Learn", "/learn"),
)  # fmt: skip
DARK: dict[bool | None, tuple[bool | None, str]] = {  # mode -> the next one, and what the button says of it
    None: (True, "Colours: as the system"),
    True: (False, "Colours: dark"),
    False: (None, "Colours: light"),
}


@dataclass
class Studio:
    """Things that the pages of one studio share.  dark: None for what the browser prefers."""

    bench: Bench
    jobs: StudioJobs
    read_only: bool = False
    dark: bool | None = None
    title: str = field(default="gyrobench studio")

    def run_folder(self, place: str) -> Path:
        """Return the folder of a run by its place below reports/out.  Raises UsageError for any other folder."""
        return inside(self.bench.out, place)


def inside(root: Path, place: str) -> Path:
    """Return a folder or file below ``root``, links resolved.  Raises UsageError where it is not below it."""
    wrong = UsageError(f"{visible(place)[:80]}: no such place in this bench")
    if "\0" in place or len(place) > 1000:
        raise wrong
    try:
        path = (root / place).resolve()
        if path.is_relative_to(root.resolve()) and path.exists():
            return path
    except (OSError, ValueError, RuntimeError):
        raise wrong from None
    raise wrong


def given_in_address(key: str) -> list[str]:
    """Return what the address of the page says of a field of its form."""
    found: list[str] = ui.context.client.request.query_params.getlist(key)
    return found


def pairs_in_address(key: str) -> dict[str, str]:
    """Return name -> value of the NAME=VALUE that the address of the page has."""
    return {name: value for name, sign, value in (text.partition("=") for text in given_in_address(key)) if sign}


def address(page: str, place: str) -> str:
    """Return the address of a run's page."""
    return f"/{page}/{quote(place)}"


@contextlib.contextmanager
def frame(studio: Studio, title: str) -> Iterator[None]:
    """Head and body of a page; what goes wrong inside is shown there."""
    app.config.language = "zh-CN" if say.code == "zh" else "en-US"  # of what the front end says by itself
    ui.page_title(f"{say(title)}: gyrobench")
    ui.add_css(STYLE)
    ui.add_head_html(f'<script>document.documentElement.lang = "{say.html}";</script>')
    ui.add_head_html(f"<script>{NARROW.read_text(encoding='utf-8')}</script>")
    ui.colors(primary=MARK)
    mode = ui.dark_mode(studio.dark)

    def change() -> None:
        studio.dark = DARK[studio.dark][0]
        mode.set_value(studio.dark)
        named_colours()

    def named_colours() -> None:
        text = DARK[studio.dark][1]
        button.props(f'title="{say(text)}"').props(spoken(text))

    def switch() -> None:
        say.use(say.other)
        ui.navigate.reload()

    ui.html(f'<a class="skip" href="#content">{say("To the content")}</a>', sanitize=False)
    with ui.element("header").classes("head"):
        ui.link("gyrobench", "/").classes("brand")
        with ui.element("nav").props(spoken("Pages")):
            for name, target in PAGES:
                ui.link(say(name), target).classes("here" if name == title else "")
        if studio.read_only:
            ui.label(say("read-only")).classes("tag")
        other = ui.button(NAMES.get(say.other, say.other), on_click=switch).props("flat dense").mark("language")
        other.props(f'lang="{say.other}"')
        button = ui.button(icon="contrast", on_click=change).props("flat dense round")
        named_colours()
    with ui.element("div").props("id=content").classes("content"):
        try:
            yield
        except Exception as error:
            show_problem(error)


class PageSeen:
    """``now``: does the browser show the page?  What nobody sees is neither sent nor drawn."""

    def __init__(self) -> None:
        self.now = True
        ui.on("seen", lambda e: setattr(self, "now", bool(e.args)))
        ui.run_javascript(SEEN)


def show_problem(error: BaseException) -> None:
    """Show the message of an error, as the command prints it but for the advice for a shell."""
    content(shown(user_message(error, at_shell=False))).classes("problem").props("role=alert")


def told(action: Callable[[], None]) -> Callable[[], None]:
    """Return an action whose error is shown as a notification."""

    def guarded() -> None:
        try:
            action()
        except Exception as error:
            words, close = say(shown(user_message(error, at_shell=False))), say("Close")
            ui.notify(words, type="negative", multi_line=True, close_button=close, timeout=0)

    return guarded


def dropped(text: str, taken: Handler[UploadEventArguments], label: str, accept: str = "") -> None:
    """Add the place where a file is dropped or chosen, by mouse or keyboard.

    label: by which it is called aloud.  accept: ".fmu", "" for any file.
    """
    drop = ui.upload(on_upload=taken, auto_upload=True).props(f"flat bordered max-file-size={UPLOAD - 4096}")
    drop.props(f'accept="{accept}"' if accept else "").classes("full").props["aria-label"] = say(label)
    drop.add_slot(
        "header",
        f"""<div class="pick"><label>{escape(say(text))}<q-uploader-add-trigger /></label>
        <q-btn flat dense round icon="attach_file" {spoken(f"{label}: choose a file")} @click="props.pickFiles"
        /></div>""",
    )


def search_field(label: str, items: str, classes: str = "") -> ui.input:
    """Add a field whose text narrows, in the page itself, the items of a list; see narrow.js."""
    field = ui.input(say(label)).props("dense outlined clearable").classes(classes)
    return field.on("update:model-value", js_handler=f"(text) => narrow('{items}', {{ text }})")


def counted(items: str, said: Callable[[str], str], count: int) -> None:
    """Add how many items of a list are shown.  said: the words for a number."""
    words = escape(said(NUMBER).replace(NUMBER, "#"))  # the catalogue asks for a number
    now = words.replace("#", str(count))
    ui.html(f'<span class="soft" data-counts="{items}" data-said="{words}">{now}</span>', sanitize=False)


class CopyLines:
    """The command line and the lines of Python of what a page does, with a button each that copies them."""

    def __init__(self) -> None:
        self.text = {"In the shell": "", "In Python": ""}
        self.shown: dict[str, ui.html] = {}
        self.boxes: dict[str, ui.element] = {}
        with ui.element("section").classes("lines").props(spoken("The same as a command and in Python")):
            for name in self.text:
                with ui.element("div").classes("line") as self.boxes[name]:
                    with ui.element("div").classes("line-head"):
                        ui.label(say(name)).classes("small-head")
                        copy = ui.button(icon="content_copy", on_click=lambda n=name: self._copy(n))
                        copy.props(f'flat dense round size=sm title="{say("Copy")}"').props(spoken(f"Copy: {name}"))
                    self.shown[name] = ui.html("", sanitize=False).classes("code").props("tabindex=0")

    def _copy(self, name: str) -> None:
        ui.clipboard.write(self.text[name])
        ui.notify(say("Copied"))

    def show(self, command: str, python: str) -> None:
        """Show other lines."""
        whole = r'<span class="word">\g<0></span>'  # no line ends within a word of a command
        html = {"In the shell": re.sub(r"\S+", whole, escape(command)), "In Python": escape(python)}
        for name, text in zip(self.text, (command, python), strict=True):
            self.text[name] = text
            self.shown[name].set_content(html[name])
            self.boxes[name].set_visibility(bool(text))
