"""The page of the laboratory: its profile, and certificates of its runs."""

from __future__ import annotations

import asyncio
import hashlib
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from nicegui import ui

from gyrobench.bench import UsageError, display_path
from gyrobench.report.laboratory import FILE, Laboratory, laboratory_of, read_laboratory, write_laboratory
from gyrobench.studio.frame import CopyLines, Studio, frame, given_in_address, show_problem, told
from gyrobench.studio.request import CommandRequest
from gyrobench.studio.words import heading, say
from gyrobench.workflow.run_list import list_runs

LISTED = 100  # runs to choose from
#: key of a profile -> its label, and whether it has a line each
PROFILE = {
    "name": ("Name", False), "address": ("Address, one line each", True),
    "accreditation": ("Accreditation number", False), "country": ("Country, two letters", False),
    "logo": ("Logo, a file beside laboratory.toml", False),
    "language": ("Language of the certificate, en or zh", False),
    "statements": ("Statements of the certificate, one a line", True),
    "coefficients": ("Coefficients shown, one a line; none: all", True),
}  # fmt: skip
SIGNATORIES = "Signatories, ROLE: NAME, one a line"


def _profile_fields(there: Laboratory | None) -> dict[str, Any]:
    """Add the fields of a profile; return them by the name of the key."""
    made: dict[str, Any] = {}
    for key, (label, many) in PROFILE.items():
        value = getattr(there, key, "") or ""
        made[key] = ui.textarea(say(label), value="\n".join(value)) if many else ui.input(say(label), value=value)
    signs = "\n".join(f"{s.role}: {s.name}" for s in there.signatories) if there else ""
    made["signatories"] = ui.textarea(say(SIGNATORIES), value=signs)
    for field in made.values():
        field.props("dense outlined autogrow stack-label").classes("full")
    return made


def _profile(fields: dict[str, Any], file: Path) -> Laboratory:
    """Return the profile that the fields make.  Raises UsageError naming all that is wrong with it."""
    lines = {k: [s.strip() for s in (f.value or "").splitlines() if s.strip()] for k, f in fields.items()}
    content: dict[str, Any] = {k: v if PROFILE[k][1] else v[0] for k, v in lines.items() if v and k in PROFILE}
    if lines["signatories"]:
        pairs = (line.partition(":") for line in lines["signatories"])
        content["signatories"] = [{"role": role.strip(), "name": name.strip()} for role, _, name in pairs]
    return laboratory_of(content, file)


def certificate_request(studio: Studio, runs: list[str], number: str) -> CommandRequest:
    """Return the command that certifies runs, given by their places below reports/out."""
    if not runs:
        raise UsageError("choose the run of the instrument, or the runs of a lot")
    folder = f"certificates/{hashlib.sha256(repr((runs, number)).encode()).hexdigest()[:8]}"
    folders = [display_path(studio.run_folder(r)) for r in runs]
    numbered = [f"--number={number.strip()}"] if number.strip() else []
    return CommandRequest(
        ["certificate", *folders, *numbered, f"--out={display_path(studio.bench.out / folder)}"], folder=folder,
        form=f"/laboratory?{urlencode([*(('run', r) for r in runs), ('number', number.strip())])}",
    )  # fmt: skip


def add_laboratory_page(studio: Studio) -> None:
    """Register the page."""

    @ui.page("/laboratory", response_timeout=60)
    async def laboratory_page() -> None:
        file = studio.bench.home / FILE
        entries = await asyncio.to_thread(list_runs, studio.bench.out)
        with frame(studio, "Laboratory"):
            heading("Laboratory")
            there = None
            try:
                there = read_laboratory(file) if file.is_file() else None
            except UsageError as error:
                show_problem(error)
            with ui.element("div").classes("two"):
                with ui.element("div").classes("form"):
                    heading("Profile", 2)
                    ui.label(say("Certificates say this of the laboratory; it is kept in laboratory.toml.")).classes(
                        "soft"
                    )
                    fields = _profile_fields(there)
                    save = ui.button(say("Save"), icon="save").mark("save")
                with ui.element("div").classes("form"):
                    heading("Certificate", 2)
                    names = {
                        r.place: ", ".join(filter(None, (say(r.title or r.system, r.system), r.instrument, r.place)))
                        for r in entries[:LISTED]
                        if r.report
                    }
                    runs = ui.select(
                        names, multiple=True, label=say("Run of an instrument, runs of a lot"), with_input=True,
                        value=[r for r in given_in_address("run") if r in names],
                    )  # fmt: skip
                    runs.props("dense outlined use-chips").classes("full")
                    number = ui.input(
                        say("Number of the certificate"), value=next(iter(given_in_address("number")), "")
                    )
                    number.props("dense outlined").classes("full")
                    make = ui.button(say("Make the certificate"), icon="workspace_premium").mark("certify")
                    lines = CopyLines()
            for button in (save, make):
                button.set_visibility(not studio.read_only)

            def show() -> None:
                asked = certificate_request(studio, runs.value, number.value or "").command() if runs.value else ""
                lines.show(asked, "")

            def keep() -> None:
                if studio.read_only:
                    raise UsageError("the studio is read-only: nothing is kept")
                if file.is_file() and there is None:
                    raise UsageError(f"{display_path(file)} cannot be read; mend or remove it, it is not written over")
                write_laboratory(_profile(fields, file), file)
                ui.notify(say(f"Saved: {display_path(file)}"))

            def certify() -> None:
                asked = certificate_request(studio, runs.value or [], number.value or "")
                ui.navigate.to(f"/job/{studio.jobs.submit(asked)}")

            save.on_click(told(keep))
            make.on_click(told(certify))
            runs.on_value_change(show)
            number.on_value_change(show)
            show()
