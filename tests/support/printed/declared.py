"""What printed commands need beside the page, which are not run, and which run in the benchmark only: by pattern.

test_printed_commands.py fails where a pattern fits no printed command.
"""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from messy_file import messy

if TYPE_CHECKING:
    from printed.pages import Step
    from printed.reader import Reader

TESTS = Path(__file__).parents[2]

#: pattern -> why commands that it fits are not run
NOT_RUN = {
    r"^make ": "make test runs this test; make check and make docs are parts of it",
    r"^python3 -m venv|pip install|pre-commit": "installs from a package index: the wheel is installed before",
    r"^gyrobench sweep \.\.\.": "stands for any sweep",
    r"; \.\.\.'$": "the shortened end of an output: checks.shown_output",
    r"benchmarks/(data_sheets|instrument_mistakes)\.py": "minutes, in a checkout: it writes the page that prints it",
    r"reports/heading_after\.py": "in a checkout: it writes the page that prints it",
    r"real_(?:records|curves)\.py FOLDER": "records of others, which are no part of the bench",
    r"^dask |tcp://HOST": "a cluster; tests/campaign runs one on this machine",
}

#: commands of many seconds; tests/benchmarks/readme_commands.py alone runs them, which the continuous integration calls
LONG = (r"^gyrobench design ",)

#: what a block of Python has -> what the text around it takes for granted
PRELUDES = {
    "def parameters(self, parts: PartValues)": """\
from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gyrobench.record.record import Record
from gyrobench.reduction.toolkit import DriftReduction, SiteSetup
from gyrobench.result import Result, Specification
from gyrobench.system.families.option_groups import SITE, TORQUER, type_b
from gyrobench.system.families.rebalance_test import RebalanceTest
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option


class MySetup(SiteSetup):
    pass


""",
    "report.write(result": """\
import gyrobench as gb

a, b = (gb.load("fixed_position", dwell="60s").run(seed=seed).result for seed in (1, 2))
result = a
""",
}


def is_any(patterns: Iterable[str], text: str) -> bool:
    """Return whether a text fits one of the patterns."""
    return any(re.search(p, text) for p in patterns)


def prelude(step: Step) -> str:
    return "".join(text for mark, text in PRELUDES.items() if mark in step.text)


# --------------------------------------------------------------------------------------- preparations
@dataclass(frozen=True)
class Preparation:
    """Something that a command takes from the reader: a pattern of its name in commands, and how it is made."""

    pattern: str
    make: Callable[[Reader, str, Step], None]

    def missing(self, reader: Reader, step: Step) -> list[str]:
        """Return the names in a step that are not there."""
        names = dict.fromkeys(m[0] for m in re.finditer(self.pattern, step.text))
        return [n for n in names if not (reader.here / n).exists() or _is_template(reader.here / n)]


def _is_template(file: Path) -> bool:
    """Return whether a file is a record without rows, as --template prints it."""
    if file.suffix != ".csv":
        return False
    lines = [
        line
        for line in file.read_text(encoding="utf-8", errors="replace").splitlines()
        if line and not line.startswith("#")
    ]
    return len(lines) == 1


def _system(step: Step) -> str:
    """Return the system that a command is about."""
    match = re.search(r"gyrobench (?:run|reduce|design|export|sweep) (\w+)", step.text)
    return match[1] if match else "tumble_single_axis"


def _records(reader: Reader, name: str, step: Step) -> None:
    """Fill in the rows of a measured record: those of tests/corpus, of the guide's file for a drift record."""
    system = _system(step)
    file = TESTS / "corpus" / f"{system}.csv"
    if system == "drift_record":
        file = TESTS.parent / "docs" / "guides" / "drift_record" / "gyro.csv"
    shutil.copy(file, reader.here / name)


def _runs_of_days(reader: Reader, name: str, step: Step) -> None:
    """Write the file that the page shows, the one column `run`, and these runs: of one plan, each with its seed."""
    (text,) = (s.text for s in reader.steps if s.kind == "shown" and s.text.startswith("run\n"))
    folders = [reader.here / f for f in text.split()[1:]]
    _short_runs(reader, folders, folders[0].parent.name)
    reader.write(name, text)


def _saved_run(reader: Reader, name: str, step: Step) -> None:
    """Let an id in reports/out stand for a run that the page has made, else for a short one."""
    system = Path(name).parent.name
    made = [f for f in reader.runs if f.parent.name == system]
    used = {f.resolve() for f in (reader.here / name).parent.glob("*") if f.is_symlink()}
    left = [f for f in made if f.resolve() not in used] or made
    if not left:
        left = [reader.here / f"run_{Path(name).name}"]
        _short_runs(reader, left, system)
    (reader.here / name).parent.mkdir(parents=True, exist_ok=True)
    (reader.here / name).symlink_to(left[0].resolve())


SHORT = {
    "fixed_position": {"dwell": "60s"},
    "tumble_single_axis": {"rate": "30deg/s", "dwell": "60s", "windows": "36"},
    "platform_four_gimbal": {"law": "sign", "flight": "launch", "locked": "true"},
}


def _short_runs(reader: Reader, folders: list[Path], system: str, **values: str) -> None:
    """Make runs with different seeds in one process."""
    lines = [f"import gyrobench as gb\ntest = gb.load({system!r}, **{ {**SHORT.get(system, {}), **values}!r})"]
    lines += [f"test.run(seed={k}, out={str(folder)!r})" for k, folder in enumerate(folders, 1)]
    done = reader.run(str(reader.installed.python), "-c", "\n".join(lines))
    assert done.code == 0, done.err


def _named_runs(reader: Reader, name: str, step: Step) -> None:
    """Let RUN1, RUN2 stand for the page's runs in their order; what is missing is short runs of its system."""
    number = int(name.removeprefix("RUN"))
    system = Path(reader.page).parent.name if reader.page.startswith("systems/") else "fixed_position"
    if system == "drift_test_suite":
        system = ("tumble_single_axis", "fixed_position", "tumble_two_axis")[number - 1]
    elif len(reader.runs) >= number and reader.page.startswith("systems/"):
        (reader.here / name).symlink_to(reader.runs[number - 1].resolve())
        return
    _short_runs(reader, [reader.here / name], system)


def _laws(reader: Reader, name: str, step: Step) -> None:
    """Runs of the three laws of the fourth servo."""
    _short_runs(reader, [reader.here / name], "platform_four_gimbal", law=name.lower())


def _vendor_slot(step: Step) -> str:
    """Return the slot that the vendor's FMU is put into."""
    slot = re.search(r'--part (\w+)=vendor|parts=\{"(\w+)": "vendor', step.text)
    return next(filter(None, slot.groups())) if slot else "gyro"


def _vendor_fmu(reader: Reader, name: str, step: Step) -> None:
    """Build the vendor's FMU of the tests for the slot that it is put into; for a monitor the bench's own."""
    from foreign_fmus import make

    kind = _vendor_slot(step)
    if kind == "monitor":
        reader.gyrobench("build", "fault_monitor", "--out", ".")
        (reader.here / "fault_monitor.fmu").rename(reader.here / name)
    else:
        shutil.move(make(f"vendor_{kind}", reader.here), reader.here / name)


def _vendor_map(reader: Reader, name: str, step: Step) -> None:
    """Take the mapping file of the vendor's FMU, where the page prints none."""
    shutil.copy(TESTS / "foreign" / f"vendor_{_vendor_slot(step)}.toml", reader.here / name)


def _motion(reader: Reader, name: str, step: Step) -> None:
    """Write a recorded motion of the base: columns as the comment beside the command names them."""
    named = re.search(r"columns (time \[s\]\S*)", step.text)
    head = named[1] if named else "time [s],roll [deg]"
    rows = [",".join([str(k), *[f"{((7 * k) % 5 - 2) * 0.2:.1f}"] * head.count(",")]) for k in range(400)]
    reader.write(name, "\n".join([head, *rows, ""]))


def _program(reader: Reader, name: str, step: Step) -> None:
    """Write the program of positions that the page shows."""
    reader.write(name, next(s.text for s in reader.steps if s.kind == "shown" and s.text.startswith("kind,positions")))


def _campaign_file(reader: Reader, name: str, step: Step) -> None:
    reader.write(name, 'system = "fixed_position"\nseeds = 2\n[set]\ndwell = "60s"\n[over]\nlatitude = "0deg,45deg"\n')


def _campaign(reader: Reader, name: str, step: Step) -> None:
    """Let CAMPAIGN stand for one with reports."""
    values = ("--set", "dwell=60s", "--seeds", "2", "--keep", "all")
    reader.gyrobench("sweep", "fixed_position", "--over", "latitude=0deg,45deg", *values, "--out", name)


def _lot(reader: Reader, name: str, step: Step) -> None:
    """Write a lot of measured files: the first eight of tests/support/measured_lot.py."""
    made = reader.run(sys.executable, str(TESTS / "support" / "measured_lot.py"), name, "--count", "8")
    assert made.code == 0, made.err


def _other_tool(reader: Reader, name: str, step: Step) -> None:
    """Run the exported system in FMPy."""
    reader.gyrobench("export", _system(step), "--to", "fmu", "--out", "other_tool.fmu")
    simulate = ("fmpy", "simulate", "other_tool.fmu", "--output-interval", "1", "--output-file", name)
    assert reader.run("bash", "-c", " ".join(simulate)).code == 0


def _repository(reader: Reader, name: str, step: Step) -> None:
    """Let a folder of the repository be where the reader stands."""
    (reader.here / name).symlink_to(reader.installed.bench / name)


def _environment(reader: Reader, name: str, step: Step) -> None:
    """Let .venv be the environment that the wheel is installed in."""
    (reader.here / name).symlink_to(reader.installed.python.parents[1])


def _messy_file(reader: Reader, name: str, step: Step) -> None:
    """Write the file of a laboratory that knows nothing of the bench."""
    (reader.here / name).write_bytes(messy()[0])


PREPARED = [
    Preparation(r"\bmessung\.csv\b", _messy_file),
    Preparation(r"\bdays\.csv\b", lambda r, n, s: (_records if "servo" in s.text else _runs_of_days)(r, n, s)),
    Preparation(r"(?<=--data )\w+\.csv\b", _records),
    Preparation(r"reports/out/\w+/[0-9][0-9a-f]{7}\b", _saved_run),
    Preparation(r"\bRUN\d\b", _named_runs),
    Preparation(r"\b(?:SECANT|CONSTANT|SIGN)\b", _laws),
    Preparation(r"\bvendor\.fmu\b", _vendor_fmu),
    Preparation(r"\bvendor\.toml\b", _vendor_map),
    Preparation(r"(?<=profile=)\w+\.csv\b", _motion),
    Preparation(r"(?<=program=)\w+\.csv\b", _program),
    Preparation(r"\blot\.toml\b", _campaign_file),
    Preparation(r"\bCAMPAIGN\b", _campaign),
    Preparation(r"\blot(?=/\*\.csv)", _lot),
    Preparation(r"(?<=--from )run\.csv\b", _other_tool),
    Preparation(r"(?<=python )systems\b", _repository),
    Preparation(r"^\.venv\b", _environment),
]
