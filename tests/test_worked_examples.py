"""docs/worked_examples.md: every worked number of the sources recomputed; no row says what its numbers do not."""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "docs" / "worked_examples"))
import others  # noqa: E402  (docs/worked_examples is no package)
from example import ContradictionError, Example, compare  # noqa: E402


def load_build() -> object:
    """The validation page has a build.py too: this one by its path."""
    import importlib.util

    spec = importlib.util.spec_from_file_location("worked_build", ROOT / "docs" / "worked_examples" / "build.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def build() -> object:
    return load_build()


@pytest.fixture(scope="module")
def made(build: object) -> dict[str, str]:
    return build.made()  # type: ignore[attr-defined,no-any-return]


def cells(table: str) -> list[list[str]]:
    return [[c.strip() for c in line.strip("|").split("|")] for line in re.findall(r"^\|.*", table, re.M)]


@pytest.mark.parametrize("name", ["counts", "hu_gyros", "hu_tables", "xia", "dong", "gsp"])
def test_the_page_says_what_is_computed(build: object, made: dict[str, str], name: str) -> None:
    """Another machine may round the last of six digits in another way."""
    page = {m[2]: m[0] for m in build.PART.finditer(build.PAGE.read_text(encoding="utf-8"))}  # type: ignore[attr-defined]
    old, new = cells(page[name]), cells(made[name])
    assert len(old) == len(new) > 5
    for was, now in zip(old[2:], new[2:], strict=True):
        if name == "counts":
            assert was == now
            continue
        assert was[:4] + was[5:] == now[:4] + now[5:]
        if was[4] != "–":
            assert float(now[4]) == pytest.approx(float(was[4]), rel=2e-5, abs=1e-9)


def test_errata_that_are_named_exist(made: dict[str, str]) -> None:
    known = set(re.findall(r"^\| (E[A-Z]?\d+) \|", (ROOT / "docs" / "errata.md").read_text(encoding="utf-8"), re.M))
    named = set(re.findall(r"\bE[RTXAG]?\d+\b", " ".join(made.values())))
    assert len(named) > 20 and named <= known


def test_digits_decide() -> None:
    """Half a unit of the last printed digit; a number that is cut; a bound; a size; what the inputs leave."""
    assert compare("1.5", 1.5499) == "agrees" and compare("1.5", 1.61) == ""
    assert compare("0.66", 2.0 / 3.0) == "agrees, cut off" and compare("0.67", 0.6611) == ""
    assert compare("0.1", 0.2) == ""  # a cut number has more than one digit
    assert compare("<5", 4.9) and not compare("<5", 5.1) and compare(">5", 5.1)
    assert compare("≈8", 8.9) and not compare("≈8", 9.1)
    assert compare("4.26e-2", 0.04264) and not compare("4.26e-2", 0.0427)
    assert not compare("2.00", 2.02) and compare("2.00", 2.02, within=0.02)
    assert compare("30 numbers", 30.0) == "" and compare("1.0", math.nan) == ""


def test_a_row_cannot_say_what_its_numbers_do_not() -> None:
    row = ("place", "what", "1.50", "s", "by")
    for wrong in (
        Example(*row, 1.70),  # unexplained
        Example(*row, 1.50, "E1", "1.70"),  # agrees: no misprint
        Example(*row, 1.80, "E1", "1.70"),  # the right value is not what comes out
        Example(*row, 1.50, why="lost"),  # comes out
    ):
        with pytest.raises(ContradictionError):
            wrong.verdict()
    assert Example(*row, 1.70, "E1", "1.70").verdict() == "misprint E1: 1.70"
    assert Example(*row, 1.50, "E1").verdict() == "agrees, input E1"


def test_runs_are_made_as_counted() -> None:
    for n1, n2, runs in ((97, 103, 69), (89, 111, 33), (100, 99, 118)):
        x = others.symbols(n1, n2, runs)
        assert x.sum() == n1 and x.size == n1 + n2 and 1 + (x[1:] != x[:-1]).sum() == runs
