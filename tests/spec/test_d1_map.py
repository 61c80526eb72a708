"""The tables of acceptance numbers and refusals in README.md name only tests that exist."""

from __future__ import annotations

import re
from pathlib import Path

HERE = Path(__file__).parent
ROWS = [line for line in (HERE / "README.md").read_text(encoding="utf-8").splitlines() if "::" in line]


def test_every_test_exists() -> None:
    assert len(ROWS) > 25
    for line in ROWS:
        file, _, test = re.search(r"`([^`]+)`\s*\|$", line)[1].partition("::")  # type: ignore[index]
        assert f"\ndef {test}(" in (HERE / file).read_text(encoding="utf-8"), line
