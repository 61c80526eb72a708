"""The gallery of systems, by purpose."""

from __future__ import annotations

import asyncio

from nicegui import ui

from gyrobench.studio.frame import Studio, frame
from gyrobench.workflow.gallery import PURPOSES, GalleryEntry, gallery


def _card(entry: GalleryEntry) -> ui.link:
    with ui.link(target=f"/system/{entry.name}").classes("card") as card:
        ui.html(f'<img src="/picture/{entry.name}" alt="" loading="lazy">', sanitize=False)
        with ui.element("div").classes("text"):
            ui.label(entry.title).classes("title")
            ui.label(entry.name).classes("name")
            if entry.problem:
                ui.label(entry.problem).classes("problem")
            else:
                ui.label(entry.summary).classes("summary")
    return card


def _found(entry: GalleryEntry, purpose: str, words: list[str]) -> bool:
    text = f"{entry.name} {entry.title} {entry.summary}".lower()
    return purpose in ("All", *entry.purposes) and all(word in text for word in words)


def add_systems_page(studio: Studio) -> None:
    """Register the page."""

    @ui.page("/", response_timeout=60)
    async def systems() -> None:
        entries = await asyncio.to_thread(gallery, studio.bench)
        with frame(studio, "Systems"):
            ui.html("<h1>Systems</h1>", sanitize=False)
            ui.label("A system is a test method or a loop: parts in slots, wired, run and reduced to a report.")
            with ui.element("div").classes("bar"):
                purpose = ui.toggle(["All", *PURPOSES], value="All", on_change=lambda: show()).props("no-caps")
                search = ui.input("Search", on_change=lambda: show()).props("dense outlined clearable")
                count = ui.label().classes("soft")
            with ui.element("div").classes("gallery"):
                cards = [(entry, _card(entry)) for entry in entries]

            def show() -> None:
                words = (search.value or "").lower().split()
                shown = [_found(entry, purpose.value, words) for entry, _ in cards]
                for (_, card), there in zip(cards, shown, strict=True):
                    card.set_visibility(there)
                count.set_text(f"{sum(shown)} of {len(shown)}")

            show()
