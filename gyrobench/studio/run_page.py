"""The pages of jobs and runs: progress, report, signals, the list, the comparison."""

from __future__ import annotations

import asyncio
import contextlib
import shlex
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from nicegui import ui

from gyrobench.bench import UsageError, display_path
from gyrobench.record.run_document import RunDocument, SuiteDocument, read_run
from gyrobench.report.language import ENGLISH
from gyrobench.studio.chart import LiveChart, RecordSignals, SignalChart, signals_of
from gyrobench.studio.frame import CopyLines, PageSeen, Studio, address, counted, frame, inside, search_field, told
from gyrobench.studio.job_process import LIVE
from gyrobench.studio.jobs import StudioJob
from gyrobench.studio.picture import MovingPicture
from gyrobench.studio.request import CommandRequest, JobRequest, comparison_command, comparison_python, first_shown
from gyrobench.studio.words import content, heading, say, shown, spoken
from gyrobench.system.moving_bodies import parse_bodies
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.workflow.inputs import load_test
from gyrobench.workflow.run_comparison import compare_folders, comparison_folder
from gyrobench.workflow.run_folders import short_names
from gyrobench.workflow.run_list import RunEntry, list_runs

TICK = 0.4  # s between two looks at a job
LISTED = 300  # runs shown at a time
HOW = "The wheel or two fingers zoom, dragging moves; every point drawn is a sample of the record."


def add_run_pages(studio: Studio) -> None:
    """Register the pages."""
    _add_job_page(studio)
    _add_run_page(studio)
    _add_runs_page(studio)
    _add_comparison_page(studio)


# ---------------------------------------------------------------------------------------------- a job
def _test(name: str) -> System | Suite | None:
    """Return a system or suite; None for a command, and for one that is not there any more, or that has a fault."""
    with contextlib.suppress(Exception):
        return load_test(name)
    return None


def _title(request: JobRequest | CommandRequest) -> str:
    """Return the title of what runs: that of its system, where it is a run of one."""
    return say(getattr(_test(request.system), "title", ""), request.system) or request.system


def _place(studio: Studio, folder: str) -> str:
    """Return the place of a run below reports/out, "" for one elsewhere."""
    path, out = Path(folder).resolve(), studio.bench.out.resolve()
    return path.relative_to(out).as_posix() if folder and path.is_relative_to(out) else ""


def _add_job_page(studio: Studio) -> None:
    @ui.page("/job/{key}", response_timeout=60)
    def job_page(key: str) -> None:
        with frame(studio, "Run"):
            job = studio.jobs.find(key)
            command = isinstance(job.request, CommandRequest)
            ui.html(f"<h1>{escape(_title(job.request))}</h1>", sanitize=False)
            with ui.element("div").classes("bar"):
                state = ui.label().classes("tag").props("role=status").mark("state")
                words = ui.label().classes("soft")
            bar = ui.linear_progress(0.0, show_value=False).props(spoken("progress"))
            bar.set_visibility(not command)
            message, notes = ui.label().classes("problem"), ui.label().classes("printed" if command else "notes")
            goes_on = ui.label(say("“Resume” continues it.")).classes("soft")
            with ui.element("div").classes("bar"):
                stop = ui.button(say("Stop"), icon="stop", on_click=told(lambda: studio.jobs.stop(key))).mark("stop")
                again = ui.button(say("Resume"), icon="play_arrow", on_click=told(lambda: _resume(studio, key))).mark(
                    "resume"
                )
                done = ui.link(say("Its pages" if command else "Report and signals"), "#").mark("result")
                if job.request.form:
                    ui.link(say("Change its values"), job.request.form).mark("change")
            chart = LiveChart(studio.jobs.folder / key / LIVE)
            lines = CopyLines()
            lines.show(
                job.request.command(job.resume), job.request.python(isinstance(_test(job.request.system), Suite))
            )
            gone, seen = {"there": False}, PageSeen()

            def show() -> None:
                if not seen.now:
                    return
                now = studio.jobs.find(key)
                _show_state(now, state, words, bar)
                text = shown(now.report.message) or (say("its process was ended") if now.state == "lost" else "")
                message.set_text(text)
                goes_on.set_visibility(now.resumable and not studio.read_only)
                message.set_visibility(bool(message.text))
                notes.set_text("\n".join(map(shown, now.report.notes)))
                notes.classes(add="failed" if now.state == "failed" else "")  # a refusal is read, a table scrolls
                stop.set_visibility(now.active and not studio.read_only)
                again.set_visibility(now.resumable and not studio.read_only)
                place = _place(studio, now.report.folder)
                done.set_visibility(bool(place))
                if place:
                    done.props(f'href="{address("pages" if command else "run", place)}"')
                if now.state == "done" and place and not message.text and not gone["there"] and not command:
                    gone["there"] = True
                    ui.navigate.to(address("run", place))
                chart.look(last=not now.active)
                if not now.active:
                    timer.deactivate()

            timer = ui.timer(TICK, show, immediate=False)
            show()


def _show_state(job: StudioJob, state: ui.label, words: ui.label, bar: ui.linear_progress) -> None:
    state.set_text(say(job.state))
    state.classes(replace=f"tag {job.state}")
    report = job.report
    words.set_text(say(f"{report.label}: {report.words}") if report.label and job.active else "")
    bar.set_value(1.0 if job.state == "done" else report.fraction)


def _resume(studio: Studio, key: str) -> None:
    ui.navigate.to(f"/job/{studio.jobs.resume(key)}")


# ---------------------------------------------------------------------------------------------- a run


def _add_run_page(studio: Studio) -> None:
    @ui.page("/run/{place:path}", response_timeout=60)
    async def run_page(place: str) -> None:
        with frame(studio, "Run"):
            folder = studio.run_folder(place)
            document = await asyncio.to_thread(read_run, folder)
            entry = next((r for r in await asyncio.to_thread(list_runs, studio.bench.out) if r.place == place), None)
            _head(document, place, entry)
            quoted = shlex.quote(display_path(folder))
            lines_of = (
                f"gyrobench report {quoted}\ngyrobench record {quoted} --to csv",
                f"import gyrobench as gb\n\nrun = gb.open_run({display_path(folder)!r})\nprint(run.result)",
            )
            if isinstance(document, SuiteDocument):
                _tests(document, place)
                report_frame(folder, place)
                CopyLines().show(*lines_of)
                return
            with ui.tabs().props("no-caps align=left dense") as tabs:
                names = ["Report", "Signals", "Moving picture", "As a command"]
                made = {n: ui.tab(n, say(n)) for n in names}
            with ui.tab_panels(tabs, value=made["Report"], animated=False, keep_alive=True).classes("full"):
                with ui.tab_panel(made["Report"]):
                    report_frame(folder, place)
                with ui.tab_panel(made["Signals"]):
                    body = ui.element("div").classes("rows")
                with ui.tab_panel(made["Moving picture"]):
                    moving = ui.element("div").classes("rows")
                with ui.tab_panel(made["As a command"]):
                    CopyLines().show(*lines_of)
            drawn: list[str] = []

            async def opened() -> None:
                if tabs.value in drawn:
                    return
                drawn.append(tabs.value)
                if tabs.value == "Signals":
                    with body:
                        await _signals(folder, document)
                if tabs.value == "Moving picture":
                    with moving:
                        await _picture(folder, document)

            tabs.on_value_change(opened)


def _head(document: RunDocument | SuiteDocument, place: str, entry: RunEntry | None) -> None:
    ui.html(f"<h1>{escape(say(document.title or document.system, document.system))}</h1>", sanitize=False)
    with ui.element("div").classes("bar"):
        if entry is not None and entry.verdict:
            ui.label(say(entry.verdict)).classes(f"tag {entry.verdict.split()[0]}").mark("verdict")
        if not document.complete:
            ui.label(say("incomplete")).classes("tag incomplete")
        ui.label(place).classes("soft")
        ui.link(say("The system"), f"/system/{quote(document.system)}")
        for name, text in (("report.pdf", "PDF"), ("result.json", "result.json")):
            ui.link(text, f"/files/{quote(place)}/{name}", new_tab=True)


def report_frame(folder: Path, place: str, name: str = "report.html") -> None:
    """Add the report as it is; its scripts run without a way to the studio."""
    if not (folder / name).is_file():
        ui.label(say("There is no report: the run has no reduction, or it did not come to its end.")).classes("soft")
        return
    source = f"/files/{quote(place)}/{name}"
    ui.html(
        f'<iframe class="report" src="{source}" title="{say("Report")}" sandbox="allow-scripts allow-popups"></iframe>',
        sanitize=False,
    ).classes("full")


def _tests(document: SuiteDocument, place: str) -> None:
    heading("Tests of the suite", 2)
    with ui.element("div").classes("bar"):
        for name, test in document.tests.items():
            ui.link(name, address("run", f"{place}/{test.folder}"))


async def _signals(folder: Path, document: RunDocument) -> None:
    wait = ui.label(say("The record is being read.")).classes("soft").props("role=status")
    signals = await asyncio.to_thread(signals_of, folder)
    wait.delete()
    if not signals.names or not len(signals.time):
        ui.label(say("The record holds no signals over time.")).classes("soft")
        return
    first = first_shown(signals.names, _shown_by_report(document.system))
    await _chosen({folder.name: signals}, signals.names, first)


async def _picture(folder: Path, document: RunDocument) -> None:
    signals = await asyncio.to_thread(signals_of, folder)
    try:
        bodies = parse_bodies(getattr(load_test(document.system), "bodies", ""))
    except Exception:  # a run of a system that is not there any more
        bodies = []
    shown = MovingPicture(signals.record, bodies) if len(signals.time) else None
    if shown is None or not shown.names:
        ui.label(say("The record holds no angle of a body that moves.")).classes("soft")


def _shown_by_report(name: str) -> list[Any]:
    return list(getattr(_test(name), "shown", ()))


# ---------------------------------------------------------------------------------------------- all runs
def _add_runs_page(studio: Studio) -> None:
    @ui.page("/runs", response_timeout=60)
    async def runs_page() -> None:
        with frame(studio, "Runs"):
            heading("Runs")
            active = ui.element("div").classes("rows")
            entries = await asyncio.to_thread(list_runs, studio.bench.out)
            with ui.element("div").classes("bar"):
                search_field("Filter", ".runs").mark("filter")
                compare = ui.button(say("Compare"), icon="compare_arrows").mark("compare")
                counted(
                    ".runs",
                    lambda n: say(
                        f"{n} of {len(entries)} runs; tick two or more to compare, the oldest is the baseline"
                    ),
                    min(len(entries), LISTED),
                )
            chosen: dict[str, ui.checkbox] = {}
            _table(entries, chosen)

            def go() -> None:
                ticked = [r for r in reversed(entries) if r.place in chosen and chosen[r.place].value]
                places = [r.place for r in ticked]
                if len(places) < 2:
                    raise UsageError("tick two runs or more to compare them")
                if early := [r.place for r in ticked if not r.complete]:
                    raise UsageError(f"{', '.join(early)}: not at its end; resume it, or untick it")
                ui.navigate.to("/compare?" + "&".join(f"run={quote(p)}" for p in places))

            compare.on_click(told(go))
            _watch(studio, active)


def _table(entries: list[RunEntry], chosen: dict[str, ui.checkbox]) -> None:
    with ui.element("div").classes("scroll"), ui.element("table").classes("runs"):
        with ui.element("thead"), ui.element("tr"):
            for text in ("", "Run", "Test", "Verdict", "Date", "Changed"):
                with ui.element("th"):
                    ui.label(say(text))
        with ui.element("tbody"):
            for r in entries[:LISTED]:
                with ui.element("tr") as row:
                    with ui.element("td"):
                        chosen[r.place] = ui.checkbox().props("dense").props(spoken(f"choose {r.place}"))
                    with ui.element("td"):
                        ui.link(r.place, address("run", r.place))
                    with ui.element("td"):
                        content(r.title or r.system, r.system)
                    with ui.element("td"):
                        state = r.verdict or ("measured" if r.measured else "")
                        state = state if r.complete else "incomplete"
                        ui.label(say(state)).classes(f"tag {state.split()[0]}" if state else "")
                    with ui.element("td"):
                        ui.label(r.date[:16].replace("T", " "))
                    with ui.element("td"):
                        seed = [say(f"seed {r.seed}")] if r.seed is not None else []
                        ui.label(", ".join([*seed, *r.changed[:8]])).classes("soft")
                row.props["data-text"] = f"{r.place} {r.title} {r.verdict} {r.date} {' '.join(r.changed)}".lower()


def _watch(studio: Studio, place: ui.element) -> None:
    """Show the jobs that have not ended, as they are now."""
    rows: dict[str, tuple[ui.element, ui.label, ui.label]] = {}  # kept while the job is under way: its link is clicked
    seen = PageSeen()

    def look() -> None:
        if not seen.now:
            return
        jobs = {j.key: j for j in studio.jobs.all() if j.active}
        for key in [*rows]:
            if key not in jobs:
                rows.pop(key)[0].delete()
        for key, job in jobs.items():
            if key not in rows:
                with place, ui.element("div").classes("bar") as row:
                    state = ui.label().classes("tag")
                    ui.link(job.request.system, f"/job/{key}")
                    rows[key] = row, state, ui.label().classes("soft")
            rows[key][1].set_text(say(job.state))
            rows[key][2].set_text(f"{100.0 * job.report.fraction:.0f} %")

    look()
    ui.timer(1.0, look)


# ---------------------------------------------------------------------------------------------- comparison
def _add_comparison_page(studio: Studio) -> None:
    @ui.page("/compare", response_timeout=60)
    async def comparison_page(client: Any = None) -> None:
        asked = ui.context.client.request.query_params.getlist("run")
        with frame(studio, "Compare"):
            heading("Comparison")
            folders = [inside(studio.bench.out, p) for p in asked]
            found = await asyncio.to_thread(compare_folders, folders)
            if found.note:
                content(found.note).classes("soft")
            shown = [display_path(f) for f in folders]
            target = comparison_folder(folders)
            said = {say.of_report(result.system, studio.bench.folder) for _, result in found.results}
            language = said.pop() if len(said) == 1 else ENGLISH
            if not studio.read_only:
                await asyncio.to_thread(found.write, target, language=language)
            with ui.element("div").classes("bar"):
                for place in asked:
                    ui.link(place, address("run", place))
            with ui.tabs().props("no-caps align=left dense") as tabs:
                made = {n: ui.tab(n, say(n)) for n in ("Report", "Signals", "As a command")}
            with ui.tab_panels(tabs, value=made["Report"], animated=False, keep_alive=True).classes("full"):
                with ui.tab_panel(made["Report"]):
                    if target.is_dir():
                        report_frame(target, target.relative_to(studio.bench.out).as_posix(), "comparison.html")
                with ui.tab_panel(made["Signals"]):
                    body = ui.element("div").classes("rows")
                with ui.tab_panel(made["As a command"]):
                    CopyLines().show(comparison_command(shown, language), comparison_python(shown, language))
            drawn: list[str] = []

            async def opened() -> None:
                if tabs.value == "Signals" and not drawn:
                    drawn.append(tabs.value)
                    with body:
                        await _overlay(folders)

            tabs.on_value_change(opened)


async def _overlay(folders: list[Path]) -> None:
    """Draw the signals of several runs over each other."""
    names = short_names(folders)
    records = {n: await asyncio.to_thread(signals_of, f) for n, f in zip(names, folders, strict=True)}
    common = [n for n in next(iter(records.values())).names if all(n in s.names for s in records.values())]
    if not common:
        ui.label(say("The runs have no signal in common.")).classes("soft")
        return
    document = await asyncio.to_thread(read_run, folders[0])
    await _chosen(records, common, first_shown(common, _shown_by_report(document.system))[:2])


async def _chosen(records: dict[str, RecordSignals], names: list[str], first: list[str]) -> None:
    """Add a menu of signals and their chart."""
    menu = ui.select(names, value=first, multiple=True, label=say("Signals"), with_input=True)
    menu.props("dense outlined use-chips").props(spoken("Signals")).classes("full")
    ui.label(say(HOW)).classes("soft")
    chart = SignalChart(records)
    menu.on_value_change(lambda e: chart.show(e.value or []))
    await chart.show(first)
