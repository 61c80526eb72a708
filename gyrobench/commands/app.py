"""The application that the commands join: its options, and what several of them do."""

from __future__ import annotations

from typing import Annotated

import typer

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)

echo = typer.echo


def exit_on_fail(verdict: str, strict: bool) -> None:
    """End the command with exit code 1 where a verdict is void, fail or inconclusive and --strict is set."""
    if strict and verdict in ("void", "fail", "inconclusive"):
        raise typer.Exit(1)


def print_version(wanted: bool) -> None:
    """Print the version and end the command."""
    if wanted:
        from importlib.metadata import PackageNotFoundError, version

        try:
            echo(f"gyrobench {version('gyrobench')}")
        except PackageNotFoundError:
            echo("gyrobench, not installed")
        raise typer.Exit


@app.callback()
def root(
    show_version: Annotated[
        bool, typer.Option("--version", callback=print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """FMI co-simulation bench for inertial instruments: test methods as systems of FMUs, ending in a report.

    \b
    Start here:
      gyrobench list
      gyrobench show tumble_single_axis
      gyrobench run tumble_single_axis
      gyrobench COMMAND --help

    Exit codes: 0 done, 1 a validation fails, a loop cannot be tuned as wanted or has not the wanted
    margins or, with --strict, a verdict is fail, inconclusive or void (there is no value to judge),
    2 invalid request, configuration or data, 3 a run, its reduction or its report failed,
    130 interrupted.
    """
