"""Requests of a page to the bench, and the same as a command and as lines of Python, ready to copy."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, ClassVar
from urllib.parse import quote, urlencode

from gyrobench.report.language import ENGLISH

FILES = Path("studio", "files")  # that were dropped, below reports/out
FIRST = 4  # signals shown at first
KEPT = "kept"  # in an address: the columns as the map beside the file has them


@dataclass(frozen=True)
class JobRequest:
    """A run of a system, or the reduction of a measured file.

    values: option or slot.parameter -> text with its unit.  parts: slot -> part or FMU.  maps: slot -> mapping file.
    data: measured file; columns: its column map, "" for a file of the template's layout.  spec: "" for none.
    place: of the file below the files of the studio.  language: of the report.
    """

    system: str
    values: dict[str, str] = field(default_factory=dict)
    parts: dict[str, str] = field(default_factory=dict)
    maps: dict[str, str] = field(default_factory=dict)
    seed: int | None = None
    spec: str = ""
    data: str = ""
    columns: str = ""
    place: str = ""
    language: str = ENGLISH

    @property
    def form(self) -> str:
        """The address of the form that asks for it, filled in; "" where there is none."""
        given = [(o, f"{n}={v}") for o, g in (("set", self.values), ("part", self.parts), ("map", self.maps))
                 for n, v in g.items()]  # fmt: skip
        if self.data:
            return (
                f"/data?{urlencode([('file', self.place), ('test', self.system), ('columns', KEPT), *given])}"
                if self.place
                else ""
            )
        given += [("seed", str(self.seed))] if self.seed is not None else []
        given += [("spec", self.spec)] if self.spec else []
        return f"/system/{quote(self.system)}" + (f"?{urlencode(given)}" if given else "")

    @property
    def resumable(self) -> bool:
        """True for a run, which goes on where it was stopped."""
        return not self.data

    def as_dict(self) -> dict[str, Any]:
        """Return the request, JSON-able."""
        return asdict(self)

    def command(self, resume: bool = False) -> str:
        """Return the command line that does the same."""
        words = ["gyrobench", "reduce" if self.data else "run", self.system]
        words += ["--data", self.data] if self.data else []
        words += ["--columns", self.columns] if self.columns else []
        for option, given in (("--set", self.values), ("--part", self.parts), ("--map", self.maps)):
            words += [w for name, value in given.items() for w in (option, f"{name}={value}")]
        words += ["--seed", str(self.seed)] if self.seed is not None else []
        words += ["--spec", self.spec] if self.spec else []
        words += ["--language", self.language] if self.language != ENGLISH else []
        return shlex.join([*words, *(["--resume"] if resume else [])])

    def python(self, suite: bool = False) -> str:
        """Return lines of Python that do the same; suite: the system is a suite of tests."""
        lines = ["import gyrobench as gb", ""]
        load = ["load_suite" if suite else "load", repr(self.system)]
        if self.values and not self.data:
            load.append(repr(self.values))
        load += [f"{n}={v!r}" for n, v in (("parts", self.parts), ("maps", self.maps)) if v]
        spec = [f"spec={self.spec!r}"] if self.spec else []
        lines.append(f"test = gb.{load[0]}({', '.join(load[1:])})")
        if self.data:
            columns = [f"columns={self.columns!r}"] if self.columns else []
            stated = [f"**{self.values!r}"] if self.values else []
            lines.append(f"run = test.reduce({', '.join([repr(self.data), *columns, *spec, *stated])})")
        else:
            seed = [str(self.seed)] if self.seed is not None else []
            seed = ["'suite'", *seed] if suite else seed  # a suite keeps its tests in a folder
            lines.append(f"run = test.run({', '.join([*seed, *spec])})")
        lines.append("print(run)")
        if not suite:
            language = f", language={self.language!r}" if self.language != ENGLISH else ""
            lines.append(f"run.report('report'{language})  # record, result.json, report.html, report.pdf")
        return "\n".join(lines)


@dataclass(frozen=True)
class CommandRequest:
    """Another command of the bench, with what it prints and the pages that it writes.

    words: of its line, without "gyrobench".  lines: of Python that do the same, "" for none.  folder: with its pages,
    below reports/out, "" for none.  form: address of the form that asked for it, filled in.
    """

    words: list[str]
    lines: str = ""
    folder: str = ""
    form: str = ""
    data: ClassVar[str] = ""

    @property
    def system(self) -> str:
        """Return the name of it in a list."""
        return " ".join(self.words[:2])

    @property
    def resumable(self) -> bool:
        """True for a command that goes on where it was stopped."""
        return self.words[0] == "sweep"

    def as_dict(self) -> dict[str, Any]:
        """Return the request, JSON-able."""
        return asdict(self)

    def command(self, resume: bool = False) -> str:
        """Return the command line."""
        return shlex.join(["gyrobench", *self.words])

    def python(self, suite: bool = False) -> str:
        """Return lines of Python that do the same."""
        return self.lines


def read_request(content: dict[str, Any]) -> JobRequest | CommandRequest:
    """Return the request that its ``as_dict`` wrote."""
    return CommandRequest(**content) if "words" in content else JobRequest(**content)


def comparison_command(runs: list[str], language: str = ENGLISH) -> str:
    """Return the command line that compares folders of runs."""
    return shlex.join(["gyrobench", "compare", *runs, *(["--language", language] if language != ENGLISH else [])])


def comparison_python(runs: list[str], language: str = ENGLISH) -> str:
    """Return lines of Python that compare folders of runs."""
    written = f"\nfound.write('comparison', language={language!r})" if language != ENGLISH else ""
    return f"import gyrobench as gb\n\nfound = gb.compare({', '.join(map(repr, runs))})\nprint(found){written}"


def first_shown(names: Sequence[str], shown: Sequence[Any]) -> list[str]:
    """Return the signals that are drawn at first: those that the system's report draws, else the first ones."""
    wanted = [n for entry in shown for n in (entry if isinstance(entry, list | tuple) else [entry])]
    found = [n for n in names if n in wanted or n.partition("[")[0] in wanted]
    return (found or list(names))[:FIRST]
