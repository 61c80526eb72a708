"""Error budget of the single-axis platform's ride: each source computed against a run with that source alone."""

from __future__ import annotations

import math
from typing import Any

import pytest

from gyrobench.engine.session import Session
from gyrobench.system.loop_plan import LoopPhase
from gyrobench.system.system import System, load_system

OFF = {"gyro.white": 0.0, "gyro.markov": 0.0, "gyro.pickoff": 0.0, "reading_noise": 0.0, "base": 0.0}
STILL = {f"gyro.D_{n}": 0.0 for n in ("F", "I", "O", "S", "II", "SS", "IO", "IS", "OS")}
BUDGET = "budget.sources"


Ridden = tuple[Any, dict[str, float], float]


def ridden(**values: Any) -> Ridden:
    """Result, rows of the budget (″) and measured platform error (″) of a ride of 30 s without any other phase."""
    (found,) = each(1, **values)
    return found


def each(runs: int, **values: Any) -> list[Ridden]:
    """The same of runs with the seeds 1, 2, ..."""
    system: System = load_system("platform_single_axis")
    plan = [LoopPhase("ride", "motion", "sine", 1, values.get("base", 0.0), 1.0, 2.0, 30.0)]
    system.phases = lambda: plan  # type: ignore[attr-defined]
    found = []
    with Session(system) as session:
        for seed in range(1, runs + 1):
            result = system.reduce(session.run({**OFF, **STILL, **values}, seed=seed))
            rows = [row for t in result.tables if t.kind == BUDGET for row in t.rows]
            found.append((result, {row[0]: row[3] for row in rows}, result["platform error"].estimate))
    return found


@pytest.mark.parametrize(
    ("source", "values"),
    [
        ("reading of the current", {"reading_noise": 3e-4}),
        ("drift rate of the gyro, white", {"gyro.white": 2e-5}),
        ("pickoff of the gyro", {"gyro.pickoff": 2e-6}),
    ],
)
@pytest.mark.long
def test_noise_of_one_source(source: str, values: dict[str, float]) -> None:
    """The rms of one run of 30 s scatters by 6 % (noise about 1 Hz counts most): four runs by 3 %, twice that.

    Each run has its own seed; the pickoff's amplitude keeps the torquer from its limit.
    """
    squares = []
    for _, rows, measured in each(4, **values):
        squares.append(measured**2)
        assert {n for n in rows if n.split()[0] not in ("together", "platform", "not")} == {source}
    assert rows[source] == pytest.approx(math.sqrt(sum(squares) / 4.0), rel=0.06)


@pytest.mark.long
def test_base_by_each_way() -> None:
    """1° at 1 Hz: without back EMF by viscous friction alone, and the other way round; together as in the whole run.

    By hand, at rest in space: 0.05 N·m·s/rad against k_t k_e/|R + L s| = 0.49996, a tenth.
    """
    degree = 0.017453292519943295
    _, rows, measured = ridden(base=degree, **{"platform.k_e": 0.0})
    assert rows["base about x, by viscous friction"] == pytest.approx(measured, rel=1e-3)
    _, rows, measured = ridden(base=degree, **{"platform.viscous": 0.0})
    assert rows["base about x, by the back EMF of the motor"] == pytest.approx(measured, rel=1e-3)
    result, rows, measured = ridden(base=degree)
    assert rows["together"] == pytest.approx(measured, rel=1e-3)
    ratio = rows["base about x, by viscous friction"] / rows["base about x, by the back EMF of the motor"]
    assert ratio == pytest.approx(0.05 / 0.49996, rel=1e-4)
    table = next(t for t in result.tables if t.kind == BUDGET)
    assert sum(row[4] for row in table.rows if row[4] is not None) == pytest.approx(100.0)
    assert any("the largest part is base about x, by the back EMF of the motor" in s for s in result.summary)


def test_friction_that_slips_has_no_budget_of_the_linear_model() -> None:
    result, rows, _ = ridden(base=0.017, **{"platform.friction": 0.5, "platform.stiction": 0.8})
    assert not rows and any("No error budget by source" in w for w in result.warnings)
