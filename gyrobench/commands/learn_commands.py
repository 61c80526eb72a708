"""The command learn: lessons, and the page of one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gyrobench.bench import Bench, UsageError, display_path
from gyrobench.commands.app import app, echo


@app.command()
def learn(
    name: Annotated[str | None, typer.Argument(metavar="[LESSON]", help="Lesson; without it all are listed.")] = None,
    language: Annotated[str, typer.Option(metavar="CODE", help="Language of the page: en, zh.")] = "en",
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="File to write, .html.")] = None,
) -> None:
    """Write a lesson as a page that runs.

    A question, sliders, a simulation beside its closed formula, an exercise.  The page is one file; it runs in a
    browser, from disk, without network.

    \b
    Examples:
      gyrobench learn
      gyrobench learn keyhole
      gyrobench learn drift --language zh --out drift.html
    """
    from gyrobench.commands.arguments import require_suffix
    from gyrobench.workflow.lessons import lesson, lessons, write_lesson

    home = Bench.find()
    if name is None:
        if out is not None:
            raise UsageError("--out: name the lesson that is written")
        for each in lessons(home):
            texts = each.texts(language)
            echo(f"{each.number:2d}  {each.name:13s} {texts['title']}\n    {texts['question']}")
        return
    require_suffix("--out", out, ".html", "a page")
    path = out or home.products / f"lesson-{name}.html"
    item = lesson(name, home)
    item.texts(language)  # refused before it is said that something is made
    typer.echo("The simulation of the page is compiled; at the first time this takes a while.", err=True)
    write_lesson(item, path, language, home)
    echo(display_path(path))
