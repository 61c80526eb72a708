"""The table of errata and acceptance numbers in README.md: every erratum once, and only tests that exist."""

from __future__ import annotations

import re
from pathlib import Path

HERE = Path(__file__).parent
ROWS = [line for line in (HERE / "README.md").read_text(encoding="utf-8").splitlines() if "::" in line]


def test_every_erratum_is_named_once() -> None:
    named = [int(n) for line in ROWS for n in re.findall(r"\bE(\d+)\b(?!-)", line.split("|")[1])]
    assert sorted(named) == list(range(1, 54))


def test_every_test_exists() -> None:
    assert len(ROWS) > 35
    for line in ROWS:
        file, _, test = re.search(r"`([^`]+)`\s*\|$", line)[1].partition("::")  # type: ignore[index]
        assert f"\ndef {test}(" in (HERE / file).read_text(encoding="utf-8"), line
