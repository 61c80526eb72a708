"""Lessons: the list, and a page of each that runs in the browser."""

from __future__ import annotations

import asyncio
import hashlib
import json
from functools import partial
from html import escape
from pathlib import Path

from fastapi import FastAPI
from nicegui import ui
from starlette.responses import FileResponse, PlainTextResponse, Response

from gyrobench.errors import GyrobenchError
from gyrobench.report.language import ENGLISH
from gyrobench.studio.frame import CopyLines, Studio, frame, show_problem
from gyrobench.studio.words import heading, say
from gyrobench.workflow.lessons import Lesson, lesson, lessons, write_lesson


def page_of(studio: Studio, item: Lesson, language: str) -> Path:
    """Return the page of a lesson, made once and kept in the cache.  Raises what its export raises."""
    folder = studio.bench.systems()[item.system]
    sources = sorted(f.stat().st_mtime_ns for f in folder.rglob("*.*") if f.suffix in (".py", ".toml"))
    key = hashlib.sha256(json.dumps([str(folder), sources, language]).encode()).hexdigest()[:12]
    path = studio.bench.cache / "lessons" / f"{item.name}-{key}.html"
    if not path.is_file():
        write_lesson(item, path, language, studio.bench)
    return path


async def _shown(studio: Studio, item: Lesson, place: ui.element) -> None:
    """Put the page of a lesson into its place, or what stands against it."""
    problem = None
    try:
        await asyncio.to_thread(page_of, studio, item, say.code)
    except Exception as error:
        problem = error
    place.clear()
    with place:
        if problem is not None:
            show_problem(problem)
            return
        title, source = escape(item.texts(say.code)["title"]), f"/lesson/{say.code}/{item.name}"
        ui.html(f'<iframe class="report" src="{source}" title="{title}"></iframe>', sanitize=False)


def add_learn_pages(studio: Studio, app: FastAPI) -> None:
    """Register the pages."""

    @app.get("/lesson/{language}/{name}")
    def page(language: str, name: str) -> Response:
        """The page that runs."""
        try:
            return FileResponse(page_of(studio, lesson(name, studio.bench), language), media_type="text/html")
        except GyrobenchError as error:
            return PlainTextResponse(str(error), 404)

    @ui.page("/learn", response_timeout=60)
    async def learn() -> None:
        every = await asyncio.to_thread(lessons, studio.bench)
        with frame(studio, "Learn"):
            heading("Learn")
            ui.label(say("Each lesson is a simulation beside its closed formula, with sliders and an exercise."))
            with ui.element("div").classes("gallery"):
                for item in every:
                    texts = item.texts(say.code)
                    with ui.link(target=f"/learn/{item.name}").classes("card"), ui.element("div").classes("text"):
                        ui.label(f"{item.number}. {texts['title']}").classes("title")
                        ui.label(texts["question"]).classes("summary")

    @ui.page("/learn/{name}", response_timeout=60)
    def one(name: str) -> None:
        with frame(studio, "Learn"):
            item = lesson(name, studio.bench)
            with ui.element("div").classes("full") as place:
                ui.label(say("The lesson is being made: at the first time its simulation is compiled.")).props(
                    "role=status"
                )
            ui.timer(0.0, partial(_shown, studio, item, place), once=True)  # the page is there before its lesson
            language = f" --language {say.code}" if say.code != ENGLISH else ""
            every = lessons(studio.bench)
            at = [other.name for other in every].index(item.name)
            with ui.element("div").classes("bar"):
                for step in (at - 1, at + 1):
                    if 0 <= step < len(every):
                        other = every[step]
                        ui.link(f"{other.number}. {other.texts(say.code)['title']}", f"/learn/{other.name}")
            CopyLines().show(f"gyrobench learn {item.name}{language}", "")
