"""Records and results of version 0.1.0 are read, reduced and reported: the same figures, warnings and verdicts."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path
from typing import Any

import pytest

import gyrobench as gb
from gyrobench.record.record import Record
from gyrobench.system.suite import load_test
from gyrobench.workflow.saved_run import reduce_saved_run

OLD = Path(__file__).parents[1] / "corpus" / "records_0_1_0"
NAMES = sorted(f.name for f in OLD.iterdir())
NUMBERS = ("estimate", "u", "k", "t", "p", "u_a", "dof", "closed", "truth", "z")


@pytest.fixture
def old(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    return Path(shutil.copytree(OLD / request.param, tmp_path / request.param))


def content(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return found


@pytest.mark.parametrize("old", NAMES, indirect=True)
@pytest.mark.long
def test_a_record_is_reduced_to_the_same_result(old: Path) -> None:
    """Of 1e-9: the same formulas, in another version of numpy perhaps."""
    then = content(old)
    assert then["provenance"]["versions"]["gyrobench"] == "0.1.0" and "reasons" not in then
    now = reduce_saved_run(old, load_test(Record.load(old).run.system), None, ("html",)).result
    assert now is not None and [c.name for c in now.coefficients] == [c["name"] for c in then["coefficients"]]
    for new, c in zip(now.coefficients, then["coefficients"], strict=True):
        assert (new.unit, new.verdict) == (c["unit"], c["verdict"]), new.name
        for key in NUMBERS:
            value = getattr(new, key)
            value = None if value is not None and math.isnan(value) else value
            assert value == (c[key] if c[key] is None else pytest.approx(c[key], rel=1e-9, abs=1e-12)), (new.name, key)
    assert now.verdict == then["verdict"] and set(now.warnings) == set(then["warnings"])


@pytest.mark.parametrize("old", NAMES, indirect=True)
def test_its_result_is_read(old: Path) -> None:
    then, result = content(old), gb.open_run(old).result
    assert result.verdict == then["verdict"] and result.withheld == then["withheld"]
    assert set(result.warnings) == set(then["warnings"])
    assert [t.title for t in result.tables] == [t["title"] for t in then["tables"]]
    assert result.as_dict()["summary"] == then["summary"]
