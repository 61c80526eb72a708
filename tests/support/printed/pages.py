"""Commands and code that README and guides print, in the order of each page.

A command block is a fence of a shell, or an indented paragraph whose first word is a program; a ``$`` before a command
is a prompt, and what follows is its output.  Everything else that is fenced is Python, a file that the reader writes
(its name stands in the fence, or in a comment on its first line), or of a language that is only looked at.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

ROOT = Path(__file__).parents[3]
PATTERNS = (
    "README.md", "CONTRIBUTING.md", "docs/**/*.md", "docs/**/*.ipynb", "reports/README.md", "fmus/README.md",
    "systems/*/README.md", "components/*/README.md",
)  # fmt: skip
PROGRAMS = {
    "gyrobench", "python", "python3", "pip", "pipx", "uv", "make", "cd", "fmpy", "pythonfmu", "dask", "git", "export",
    "jupyter", "docker", "fmutool", "fmucontainer", "OMSimulator", "cosim", "sbatch", "srun", "chromium",
}  # fmt: skip
SHELLS = ("", "sh", "bash", "shell", "console")
LOOKED_AT = ("yaml", "nginx", "json", "xml", "c", "text", "html", "mermaid", "math")
CELL = "# %%\n"  # before each cell of a notebook
INLINE = re.compile(r"(?<!`)`((?:gyrobench|python) [^`]+)`")
STANDS_FOR = re.compile(r"\b[A-Z]{3,}\b|\.\.\.|\[")  # a word that is no value, in a command in a text
FENCE = re.compile(r"^```(\S*)(?: +(\S+))?$")
NAMED = re.compile(r"^# ([\w./-]+\.(?:toml|py|csv)):")


@dataclass(frozen=True)
class Step:
    """What a page tells the reader to do.

    kind: command, python, file (name: where it is written), shown (no more than looked at), notebook
    (text: its cells).
    """

    page: str
    line: int
    kind: str
    text: str
    name: str = ""

    @property
    def place(self) -> str:
        return f"{self.page}:{self.line}"


def pages() -> list[str]:
    """Return the pages that are read, relative to the repository."""
    return [f.relative_to(ROOT).as_posix() for p in PATTERNS for f in sorted(ROOT.glob(p))]


def is_command(line: str) -> bool:
    """Return whether a line begins with a program, after values of the environment and a prompt."""
    words = line.removeprefix("$ ").split()
    while words and re.match(r"[A-Z_]+=", words[0]):
        words = words[1:]
    return bool(words) and (words[0] in PROGRAMS or words[0].startswith((".venv/", "./")))


def _commands(page: str, first: int, lines: list[str]) -> Iterator[Step]:
    """Yield the commands of a block; one goes on after a backslash.  Comments and outputs are left out."""
    prompts = any(line.startswith("$ ") for line in lines)
    text, start = "", first
    for k, line in enumerate(lines, first):
        if not text and (not line.strip() or line.lstrip().startswith("#") or (prompts and not line.startswith("$ "))):
            continue
        start = start if text else k
        text += line.removeprefix("$ ").strip()
        if text.endswith("\\"):
            text = text[:-1]
            continue
        yield Step(page, start, "command", text)
        text = ""


def _fenced(page: str, line: int, language: str, name: str, lines: list[str]) -> Iterator[Step]:
    text = "\n".join(lines) + "\n"
    named = NAMED.match(text)
    if language in SHELLS and (language or is_command(lines[0])):
        yield from _commands(page, line, lines)
    elif name or named:
        yield Step(page, line, "file", text, name or (named[1] if named else ""))
    elif language == "python":
        yield Step(page, line, "python", text)
    else:
        assert language in ("", "toml", *LOOKED_AT), f"{page}:{line}: what is done with a block of {language!r}?"
        yield Step(page, line, "shown", text)


def read(page: str) -> list[Step]:
    """Return what a page tells the reader to do, in its order; blocks of Python without a command between are one."""
    joined: list[Step] = []
    for step in _read(page):
        if joined and joined[-1].kind == step.kind == "python":
            joined[-1] = replace(joined[-1], text=f"{joined[-1].text}\n{step.text}")
        elif step.kind != "shown" or not joined or joined[-1].kind != "python":
            joined.append(step)
    return joined


def _read(page: str) -> list[Step]:
    if page.endswith(".ipynb"):
        return [Step(page, 1, "notebook", "\n".join(f"{CELL}{c}" for c in _cells((ROOT / page).read_text("utf-8"))))]
    lines = (ROOT / page).read_text(encoding="utf-8").splitlines()
    steps: list[Step] = []
    k = 0
    while k < len(lines):
        if fence := FENCE.match(lines[k]):
            end = next(j for j in range(k + 1, len(lines)) if lines[j] == "```")
            steps += _fenced(page, k + 2, fence[1], fence[2] or "", lines[k + 1 : end])
            k = end + 1
        elif lines[k].startswith("    ") and not (k and lines[k - 1].strip()):
            end = next((j for j in range(k, len(lines)) if not lines[j].startswith("    ")), len(lines))
            body = [line[4:] for line in lines[k:end]]
            steps += (
                _commands(page, k + 1, body)
                if is_command(body[0])
                else [Step(page, k + 1, "shown", "\n".join(body) + "\n")]
            )
            k = end
        else:
            k += 1
    return steps


def _cells(notebook: str) -> list[str]:
    """Return the code of a notebook's cells."""
    return ["".join(c["source"]) for c in json.loads(notebook)["cells"] if c["cell_type"] == "code"]


def inline(page: str) -> list[Step]:
    """Return the whole commands in the text of a page: those with an argument, and no word that stands for a value."""
    if page.endswith(".ipynb"):
        return []
    text = (ROOT / page).read_text(encoding="utf-8")
    found = ((m, " ".join(m[1].split())) for m in INLINE.finditer(text))
    lines = ((text[: m.start()].count("\n") + 1, c) for m, c in found if not STANDS_FOR.search(c) and c.count(" ") > 1)
    return [Step(page, line, "inline", command) for line, command in lines]


#: pages whose commands change the repository: what they name is held against what there is, nothing is run
NOT_FOLLOWED = ("CONTRIBUTING.md",)
#: pages whose commands `make test` runs, but for declared.LONG
READ_FIRST = [
    page
    for page in pages()
    if not page.startswith(("systems/", "components/", *NOT_FOLLOWED)) and any(s.kind != "shown" for s in read(page))
]
