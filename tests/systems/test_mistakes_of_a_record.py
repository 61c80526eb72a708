"""The page of mistakes in records of rate gyros and inertial units holds what its benchmark finds."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
WORDS = {"named", "withheld", "asked for", "harmless", "not seen"}


@pytest.fixture(scope="module")
def bench() -> Any:
    with pytest.MonkeyPatch.context() as path:
        path.syspath_prepend(str(BENCHMARKS))
        return importlib.import_module("instrument_mistakes")


def rows(bench: Any) -> list[list[str]]:
    lines = bench.PAGE.read_text(encoding="utf-8").split("| --- | --- | --- | --- |\n")[1].split("\n\n")[0]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines.splitlines()]


def test_every_mistake_is_on_the_page(bench: Any) -> None:
    assert [row[:3] for row in rows(bench)] == [[s.name, m.kind, m.what] for s in bench.SHEETS for m in s.mistakes]
    assert {row[3] for row in rows(bench)} <= WORDS


@pytest.mark.parametrize("name", ["rate_table_test", "gyro_bandwidth"])
@pytest.mark.long
def test_the_page_says_what_is_found(bench: Any, name: str) -> None:
    sheet = next(s for s in bench.SHEETS if s.name == name)
    found = [[name, m.kind, m.what, said] for m, said in bench.outcomes(sheet)]
    assert found == [row for row in rows(bench) if row[0] == name]
