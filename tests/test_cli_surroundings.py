"""Commands where something is missing, full, closed or strange: they go on, or name what is wrong; no traceback."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from fuzzing import CORPUS

from gyrobench.commands.streams import spelled

pytestmark = pytest.mark.skipif(os.name == "nt", reason="shell, pipes and limits of POSIX")

LIMIT = "ulimit -v 6000000; "  # kB: a device that never ends shall not take the memory of the machine
REDUCE = "reduce fixed_position --data m.csv --out out --no-report"
#: surroundings -> shell around the command "$@", variables, command, exit code, what its output says
CASES: dict[str, tuple[str, dict[str, str], str, int, str]] = {
    "cp1252": ('"$@"', {"PYTHONIOENCODING": "cp1252"}, REDUCE, 0, r"drift omega_d = -0\.402 .* \xb0/h"),
    "C locale": ('"$@"', {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, REDUCE, 0, "omega_d.* deg/h"),
    "closed stdin and stderr": ('"$@" <&- 2>&-', {}, REDUCE, 0, "ω_d"),
    "closed stderr, error": ('"$@" 2>&-', {}, "list --nonsense", 2, ""),
    "closed stdout": ('"$@" >&-', {}, REDUCE, 0, ""),
    "full stdout": ('"$@" >/dev/full', {}, "list", 2, "gyrobench: No space left on device"),
    "limit of the size of files": ('ulimit -f 1; "$@"', {}, REDUCE, 2, r"gyrobench: .*out.*: File too large"),
    "cache below a file": ('"$@"', {"GYROBENCH_CACHE": "/dev/null/x"}, "build meter", 0, "note: /dev/null/x/"),
    "home is a file": ('"$@"', {"HOME": "/dev/null", "GYROBENCH_CACHE": ""}, "build meter", 0, "/dev/null/.c"),
    "no temporary folder": ('"$@"', {"TMPDIR": "/dev/null/x"}, "build meter", 0, "meter.fmu"),
    "path not in UTF-8": ('mv m.csv "$F.csv"; "$@"', {}, REDUCE.replace("m.csv", "{F}.csv"), 0, "ω_d"),
    "folder not in UTF-8": ('"$@"', {}, REDUCE.replace(" out", " {F}"), 0, r"m\\udcff/result\.json"),
    "working folder removed": ('mkdir d; cd d; rmdir ../d; "$@"', {}, "list", 2, "the working folder does not exist"),
}  # fmt: skip


def run(folder: Path, shell: str, variables: dict[str, str], command: list[str]) -> tuple[int, str]:
    """Return exit code and all output of a command in a shell."""
    done = subprocess.run(
        ["sh", "-c", LIMIT + shell, "sh", sys.executable, *command], cwd=folder, env={**os.environ, **variables},
        capture_output=True, timeout=100,
    )  # fmt: skip
    encoding = "cp1252" if "cp1252" in variables.values() else "utf-8"
    return done.returncode, (done.stdout + done.stderr).decode(encoding, "backslashreplace")


@pytest.mark.parametrize("case", CASES)
@pytest.mark.long
def test_a_command_goes_on_or_names_what_is_wrong(case: str, tmp_path: Path) -> None:
    shell, variables, words, code, says = CASES[case]
    (tmp_path / "m.csv").write_bytes(CORPUS["fixed_position"])
    name = os.fsdecode(b"m\xff")
    command = ["-m", "gyrobench", *(w.format(F=name) for w in words.split())]
    ended, said = run(tmp_path, shell, {"F": name, **variables}, command)
    assert ended == code and re.search(says, said) and "Traceback" not in said, (ended, said)
    if code == 0 and "--out out" in words:
        assert (tmp_path / "out" / "run.json").is_file()


ENDLESS = [
    "reduce fixed_position --data p", "reduce fixed_position --data /dev/zero", "reduce drift_record --data /dev/zero",
    "run fixed_position --set @/dev/zero", "campaign /dev/zero", "sweep fixed_position --table /dev/zero",
    "reduce fixed_position --from /dev/zero", "reduce fixed_position --data m.csv --spec /dev/zero",
]  # fmt: skip
EACH = """
import sys
from gyrobench.commands import cli
for words in sys.argv[1:]:
    sys.argv = ["gyrobench", *words.split()]
    try:
        cli.main()
    except SystemExit as end:
        print(f"{words}: {end.code}", file=sys.stderr)
"""


@pytest.mark.long
def test_pipes_and_devices_are_refused_as_files(tmp_path: Path) -> None:
    """Of a process each, in one: a pipe that nobody writes to would wait, a device fill the memory."""
    os.mkfifo(tmp_path / "p")
    (tmp_path / "m.csv").write_bytes(CORPUS["fixed_position"])
    code, said = run(tmp_path, '"$@"', {}, ["-c", EACH, *ENDLESS])
    assert code == 0, said
    for words in ENDLESS:
        assert f"{words}: 2" in said, said
    assert said.count("a pipe or a device, which cannot be read twice: write it to a file first") >= len(ENDLESS) - 1


@pytest.mark.parametrize(
    ("letter", "text"),
    [("ω", "omega"), ("Σ", "Sigma"), ("″", '"'), ("é", "e"), ("−", "-"), ("中", "\\u4e2d"), ("\udcff", "\\udcff")],
)
def test_a_letter_that_an_encoding_lacks_is_spelled(letter: str, text: str) -> None:
    assert spelled(letter) == text
