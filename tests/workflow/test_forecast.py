"""The forecast of a long run: once, only of a long one, with options that do shorten the test."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gyrobench.engine.run_driver import ProgressReport
from gyrobench.system.system import load_system
from gyrobench.workflow.feedback import Feedback
from gyrobench.workflow.forecast import LONG, MEASURED, forecasting, shorter


def test_all_options_that_hold_the_length_are_named_and_none_else() -> None:
    """A servo test lasts a day or one turn, whichever is longer (a day is 236 s more than a turn): both are named."""
    system = load_system("servo_polar")
    assert shorter(system) == {"turns": "0", "time": "43200s"}
    whole = system.plan().duration()
    alone = [system.with_values({n: v}).plan().duration() for n, v in shorter(system).items()]
    assert min(alone) > 0.99 * whole  # one without the other saves nothing
    # of 24 h in each of two mounts, and two dwells of 1 h, remain 12 h in each and the dwells
    assert system.with_values(shorter(system)).plan().duration() == pytest.approx(0.5 * whole, rel=0.05)


def told(elapsed: list[float], left: float, saves: bool = True, kept: bool = True, checked: bool = False) -> list[str]:
    """Return the notes of a run of 100 s that has ``left`` s of wall time to go at each of some reports."""
    simulation = SimpleNamespace(needsExecutionTool=True, canGetAndSetFMUstate=saves, canSerializeFMUstate=saves)
    descriptions = {"gyro": SimpleNamespace(coSimulation=simulation)}
    assembly = SimpleNamespace(descriptions=descriptions)
    session: Any = SimpleNamespace(system=load_system("fixed_position"), assembly=assembly)
    notes: list[str] = []
    progress = forecasting(None, session, 1e-3, kept, checked, Feedback(notes.extend))
    for t in elapsed:  # the share that is done is t / (t + left)
        progress(ProgressReport(100.0 * t / (t + left), 100.0, round(1000 * t), 0, 1000.0, t))
    return notes


def test_a_long_run_says_once_how_long_and_what_instead() -> None:
    (note,) = told([0.5 * MEASURED, MEASURED, 2.0 * MEASURED], 3.0 * LONG)
    assert note.startswith("fixed_position: the run takes 6 min 00 s more (100,000 steps of 0.001 s, 1,000 a second")
    assert "not native code: gyro); shorter: --set dwell=1800s, or" in note
    assert "--step 0.002s; Ctrl-C keeps a checkpoint" in note
    (note,) = told([MEASURED], 3.0 * LONG, saves=False)
    assert note.endswith("Ctrl-C keeps the record until then")
    (note,) = told([MEASURED], 3.0 * LONG, kept=False)
    assert "Ctrl-C" not in note and "--check-step" not in note
    (note,) = told([MEASURED], 3.0 * LONG, checked=True)  # the step again, and half of it: 1 + 2 runs
    assert "--check-step then takes three times as long; Ctrl-C" in note


def test_a_run_of_a_minute_says_nothing() -> None:
    assert told([MEASURED, 2.0 * MEASURED], 0.5 * LONG) == []
