"""What is imported while a run goes on: all that its report needs, nothing else, one after each report of progress."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from gyrobench.workflow import ahead

CORPUS = Path(__file__).parents[1] / "corpus" / "tumble_single_axis.csv"
REDUCE = """
import sys
from gyrobench.commands.cli import main
from gyrobench.workflow.ahead import MODULES
print(*[m for m in MODULES if m in sys.modules])
sys.argv = ["gyrobench", "reduce", "tumble_single_axis", "--data", sys.argv[1], "--out", sys.argv[2]]
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print("then", *[m for m in MODULES if m not in sys.modules])
"""


@pytest.mark.long
def test_a_report_needs_all_of_them_and_a_command_has_none_before(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", REDUCE, CORPUS, tmp_path / "out"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert (lines[0], lines[-1]) == ("", "then")
    assert (tmp_path / "out" / "report.pdf").is_file()


def test_one_after_each_report(monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[Any] = []
    monkeypatch.setattr(ahead, "MODULES", ("first", "missing", "last"))

    def imported(name: str) -> None:
        order.append(name)
        if name == "missing":
            raise ImportError(name)

    monkeypatch.setattr(ahead, "import_module", imported)
    progress = ahead.importing(order.append)  # type: ignore[arg-type]
    for k in range(5):
        progress(k)  # type: ignore[arg-type]
    assert order == [0, "first", 1, "missing", 2, "last", 3, 4]
    silent = ahead.importing(None)
    silent(0)  # type: ignore[arg-type]
    assert order[-1] == "first"
