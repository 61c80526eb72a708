"""The gallery of systems, by purpose."""

from __future__ import annotations

import asyncio

from nicegui import ui

from gyrobench.studio.frame import Studio, frame
from gyrobench.studio.words import content, heading, say
from gyrobench.workflow.gallery import PURPOSES, GalleryEntry, gallery


def _card(entry: GalleryEntry) -> ui.link:
    with ui.link(target=f"/system/{entry.name}").classes("card") as card:
        ui.html(f'<img src="/picture/{entry.name}" alt="" loading="lazy">', sanitize=False)
        with ui.element("div").classes("text"):
            content(entry.title, entry.name).classes("title")
            ui.label(entry.name).classes("name")
            if entry.problem:
                content(entry.problem).classes("problem")
            else:
                content(entry.summary, entry.name).classes("summary")
    return card


def _found(entry: GalleryEntry, purpose: str, words: list[str]) -> bool:
    said = f"{say(entry.title, entry.name)} {say(entry.summary, entry.name)}"
    text = f"{entry.name} {entry.title} {entry.summary} {said}".lower()
    return purpose in ("All", *entry.purposes) and all(word in text for word in words)


def add_systems_page(studio: Studio) -> None:
    """Register the page."""

    @ui.page("/", response_timeout=60)
    async def systems() -> None:
        entries = await asyncio.to_thread(gallery, studio.bench)
        with frame(studio, "Systems"):
            heading("Systems")
            ui.label(say("A system is a test method or a loop: parts in slots, wired, run and reduced to a report."))
            with ui.element("div").classes("bar"):
                purpose = ui.toggle(
                    {p: say(p) for p in ("All", *PURPOSES)}, value="All", on_change=lambda: show()
                ).props("no-caps")
                search = ui.input(say("Search"), on_change=lambda: show()).props("dense outlined clearable")
                count = ui.label().classes("soft")
            with ui.element("div").classes("gallery"):
                cards = [(entry, _card(entry)) for entry in entries]

            def show() -> None:
                words = (search.value or "").lower().split()
                shown = [_found(entry, purpose.value, words) for entry, _ in cards]
                for (_, card), there in zip(cards, shown, strict=True):
                    card.set_visibility(there)
                count.set_text(say(f"{sum(shown)} of {len(shown)}"))

            show()
