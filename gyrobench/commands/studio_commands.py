"""The command studio: the bench in the browser."""

from __future__ import annotations

from typing import Annotated

import typer

from gyrobench.commands.app import app, echo
from gyrobench.notebook import MissingPackageError


@app.command()
def studio(
    port: Annotated[
        int | None, typer.Option(metavar="N", help="Port; default: the first free one from 8765.", min=0, max=65535)
    ] = None,
    host: Annotated[str, typer.Option(metavar="ADDRESS", help="Address to listen at.")] = "127.0.0.1",
    read_only: Annotated[bool, typer.Option("--read-only", help="Show runs and systems; start nothing.")] = False,
    language: Annotated[
        str, typer.Option(metavar="CODE", help="Language of the pages at first: en, zh; a button changes it.")
    ] = "en",
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Print the address; open no browser.")] = False,
    allow_remote: Annotated[
        str | None,
        typer.Option(
            "--allow-remote",
            metavar="NAME",
            help="Host name under which others reach the studio, through a proxy with authentication and TLS.",
        ),
    ] = None,
) -> None:
    """Open the bench in the browser.

    The address that is printed holds a token of this start: who has it may use the studio.  Runs go on when the studio
    is closed; Ctrl-C ends the studio.

    \b
    Example: gyrobench studio
    """
    try:
        from gyrobench.studio.server import serve
    except ImportError as error:
        raise MissingPackageError(
            f"the studio needs {error.name}, which is not installed: pip install 'gyrobench[studio]'"
        ) from None

    def opened(address: str) -> None:
        echo(f"gyrobench studio: {address}\nCtrl-C ends it; runs go on.")
        if not no_browser:
            import webbrowser

            webbrowser.open(address)

    serve(host, port, read_only, allow_remote, opened, language)
