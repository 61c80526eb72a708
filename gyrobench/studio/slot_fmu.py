"""An FMU of another tool, dropped on a slot: its mapping is proposed, shown, changed and kept beside it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

from nicegui import ui
from nicegui.events import UploadEventArguments

from gyrobench.bench import display_path
from gyrobench.files import write_whole
from gyrobench.studio.data_page import keep
from gyrobench.studio.frame import Studio, dropped
from gyrobench.studio.words import content, say, shown
from gyrobench.workflow.fit_mapping import write_mapping
from gyrobench.workflow.user_errors import user_message


def drop_fmu(studio: Studio, system: str, slot: str, chosen: Callable[[str, str], None]) -> None:
    """Add the place where an FMU is dropped for a slot, and its mapping below.

    chosen: called with the FMU and its mapping file, as a command names them.
    """
    body = ui.element("div").classes("rows")

    async def taken(event: UploadEventArguments) -> None:
        body.clear()
        file = keep(studio, event.file.name, await event.file.read())
        try:
            text, problems = await asyncio.to_thread(write_mapping, file, f"{system}.{slot}", None)
        except Exception as error:
            with body:
                content(shown(user_message(error, at_shell=False))).classes("problem").props("role=alert")
            return
        mapping = file.with_name(f"{system}.{slot}.toml")
        write_whole(mapping, text.encode())
        chosen(display_path(file), display_path(mapping))
        with body:
            _shown(file, mapping, text, problems)

    dropped("Drop an FMU of another tool", taken, f"FMU for {slot}", accept=".fmu")


def _shown(file: Path, mapping: Path, text: str, problems: list[str]) -> None:
    ui.label(say(f"{file.name}: check names, units and signs; the mapping is kept beside it.")).classes("soft")
    for problem in problems:
        content(shown(problem)).classes("problem")
    lines = (
        ui.textarea(say("Mapping"), value=text).props("dense outlined autogrow debounce=250").classes("full mapping")
    )
    lines.on_value_change(lambda: write_whole(mapping, (lines.value or "").encode()))
