"""The gallery of systems, by purpose."""

from __future__ import annotations

import asyncio
from html import escape

from nicegui import ui

from gyrobench.studio.frame import Studio, counted, frame, search_field
from gyrobench.studio.words import heading, marked, say
from gyrobench.workflow.gallery import PURPOSES, GalleryEntry, gallery

CHOICES = ("All", *PURPOSES)


def _card(entry: GalleryEntry) -> str:
    """Return the card of a system: a plain link, with the text that the search looks through."""
    said = (entry.name, entry.title, entry.summary, say(entry.title, entry.name), say(entry.summary, entry.name))
    purposes = " ".join(str(k) for k, name in enumerate(CHOICES) if name in ("All", *entry.purposes))
    about = ("problem", entry.problem) if entry.problem else ("summary", entry.summary)
    return f"""<a class="card" href="/system/{escape(entry.name)}" data-purposes="{purposes}"
        data-text="{escape(" ".join(said).lower())}"><img src="/picture/{escape(entry.name)}" alt="" loading="lazy">
        <div class="text">{marked(entry.title, entry.name, "title")}<div class="name">{escape(entry.name)}</div>
        {marked(about[1], entry.name, about[0])}</div></a>"""


def add_systems_page(studio: Studio) -> None:
    """Register the page."""

    @ui.page("/", response_timeout=60)
    async def systems() -> None:
        entries = await asyncio.to_thread(gallery, studio.bench)
        with frame(studio, "Systems"):
            heading("Systems")
            ui.label(say("A system is a test method or a loop: parts in slots, wired, run and reduced to a report."))
            with ui.element("div").classes("bar"):
                purpose = ui.toggle({p: say(p) for p in CHOICES}, value="All").props("no-caps")
                pressed = f"mounted_app.elements[{purpose.id}].props['model-value'] = k"  # at once
                purpose.on("update:model-value", js_handler=f"(k) => narrow('.gallery', {{ purpose: {pressed} }})")
                search_field("Search", ".gallery")
                counted(".gallery", lambda n: f"{n} / {len(entries)}", len(entries))
            ui.html("".join(map(_card, entries)), sanitize=False).classes("gallery")
