"""Commands that README and guides print: each is run, here or by the benchmark, or listed with the reason why not.

test_install.py runs those of the pages that are read first, tests/benchmarks/readme_commands.py all of them.  Of what
only the benchmark runs, what it names is held against what there is.
"""

from __future__ import annotations

import re
import shlex

import pytest
import typer
from printed import checks, declared, pages
from printed.pages import ROOT, Step

from gyrobench.bench import Bench
from gyrobench.campaign.execution.axes import parse_axis
from gyrobench.commands import cli
from gyrobench.commands.arguments import parse_settings
from gyrobench.packaging import load_part
from gyrobench.system.suite import Suite
from gyrobench.workflow.inputs import find_specification
from gyrobench.workflow.settings import load_with_values

ALL = [step for page in pages.pages() for step in pages.read(page)]
COMMANDS = [s for s in ALL if s.kind == "command"]
LISTS = {
    "NOT_RUN": declared.NOT_RUN, "LONG": declared.LONG, "AFTER": checks.AFTER,
    "PREPARED": [p.pattern for p in declared.PREPARED],
}  # fmt: skip


@pytest.mark.parametrize("name", LISTS)
def test_every_entry_of_the_lists_fits_a_printed_command(name: str) -> None:
    texts = [s.text for s in ALL if s.kind in ("command", "python")]
    assert [p for p in LISTS[name] if not any(re.search(p, t) for t in texts)] == []


@pytest.mark.parametrize("marks", [declared.PRELUDES, checks.NAMES], ids=["PRELUDES", "NAMES"])
def test_every_mark_is_in_a_printed_block(marks: dict[str, object]) -> None:
    texts = [s.text for s in ALL if s.kind in ("python", "file", "notebook")] + ["CELLS = "]
    assert [m for m in marks if not any(m in t for t in texts)] == []


# ------------------------------------------------------------------ what the benchmark alone runs
ELSEWHERE = [
    s
    for s in COMMANDS
    if (s.page not in pages.READ_FIRST or declared.is_any(declared.LONG, s.text))
    and not declared.is_any(declared.NOT_RUN, s.text)
]
GROUP = typer.main.get_command(cli.app)


@pytest.mark.parametrize(
    "step", ELSEWHERE + [s for page in pages.pages() for s in pages.inline(page)], ids=lambda s: s.place
)
def test_what_a_command_names_exists(step: Step) -> None:
    """Command, options, system with its values, parts and their parameters, specification."""
    words = shlex.split(step.text, comments=True)
    for path in (w.partition("::")[0] for w in words if w.startswith(("tests/", "docs/", "reports/spec", "systems/"))):
        assert (ROOT / path).exists(), path
    if words[0].endswith("python"):
        return
    assert words[0].endswith("gyrobench")
    name, words = words[1], words[2 : words.index(">") if ">" in words else None]
    with GROUP.commands[name].make_context(name, words) as context:  # type: ignore[attr-defined]
        given = context.params
    for axis in given.get("over") or []:
        parse_axis(*axis.split("=", 1))
    if given.get("spec"):
        find_specification(given["spec"])
    if not given.get("system") or given["system"].endswith(".ssp"):
        return
    values = parse_settings([v for v in given.get("values") or [] if not v.startswith("@")])
    test = load_with_values(given["system"], values)
    if isinstance(test, Suite):
        return
    parts = dict(p.split("=") for p in given.get("part") or [])
    slots = test.all_slots()
    for slot, part in parts.items():
        assert slot in slots and (part.endswith(".fmu") or part in Bench.find().parts()), f"--part {slot}={part}"
    for slot, _, parameter in (v.partition(".") for v in values if "." in v):
        part = parts.get(slot, slots[slot].part)
        assert part.endswith(".fmu") or parameter.partition("[")[0] in load_part(part).declarations, parameter
