"""Start of a gyro test by program: every fault is named, none without one; self-tests and times by hand."""

from __future__ import annotations

import importlib
import math
from itertools import pairwise

import pytest

from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.result import NO_VERDICT, LoopResult
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system

NAME = "test_start_up"
system = importlib.import_module(type(load_system(NAME)).__module__)
#: step and words of the reason of each fault, written down from the README
NAMED = {
    "heater weak": (1, "temperature not reached"),
    "wheel drag": (2, "wheel not synchronous"),
    "wheel voltage": (2, "wheel not synchronous"),
    "wheel voltage lost": (8, "wheel not synchronous"),
    "reference": (3, "reference outside its limits"),
    "pickoff null": (4, "pickoff null outside its limits"),
    "pickoff range": (5, "pickoff beyond its range"),
    "torquer polarity": (6, "torquer polarity"),
    "torquer scale": (6, "torquer scale factor"),
    "loop hunting": (7, "loop hunting"),
    "loop dead": (7, "loop not captured"),
    "loop slow": (8, "loop does not answer a step"),
    "table angle": (9, "table angle wrong"),
    "wheel brake": (12, "wheel does not run down"),
}
#: figure -> its step; the wheel is braked after a test that was broken off, too
FIGURES = {"t heat": 1, "t wheel": 2, "reference": 3, "null": 4, "torquer": 6, "t close": 7, "loop": 8, "angle": 9}
SHORT = {"dwell": 6.0}


def reduced(session: Session, record: Record) -> LoopResult:
    result = session.system.reduce(record)
    assert isinstance(result, LoopResult)
    return result


def test_the_list_of_faults_is_whole() -> None:
    assert {"none", *NAMED} == set(system.FAULTS)


@pytest.mark.parametrize("fault", NAMED)
def test_a_fault_breaks_the_start_off_by_its_name(session: Session, fault: str) -> None:
    step, name = NAMED[fault]
    record = session.run({"fault": fault, **SHORT, **({"dwell": 60.0} if "lost" in fault else {})}, seed=3)
    found = reduced(session, record)
    assert [r.text for r in found.reasons if r.id == "start.broken"] == [
        f"The start failed in step {step}: {name}. The program has broken it off there."
    ]
    judged = conclude(found, record)
    assert (judged.verdict, judged["start"].verdict) == ("fail", "fail")
    assert judged["start"].meaning.endswith(f": {name}, in step {step}")
    for c in judged.coefficients:
        own = FIGURES.get(c.name, step)
        if own > step:
            assert c.no_value == f"not reached: {name}, in step {step}" and c.verdict == NO_VERDICT, c.name
        elif own < step:
            assert c.verdict == "pass", c.name
    w = record.windows
    assert w["step"][-1] == 13  # all is off in the end
    line = {row[0]: row for row in found.tables[0].rows}
    assert [n for n, row in line.items() if row[-1] == name] == [system_steps()[step - 1]]
    if step < 10:
        assert line["test"][-1] == "not entered" and (w["step"] != 10).all()
    if step == 1:
        assert line["wheel braked"][-1] == "not entered"  # what was never on is not switched off


def system_steps() -> tuple[str, ...]:
    steps: tuple[str, ...] = importlib.import_module(".reduction", system.__package__).STEPS
    return steps


def test_without_a_fault_all_is_gone_through(session: Session) -> None:
    """Wheel: run-up -J/D ln(1 - D n/M) = -80 s ln(1 - 2.5e-3/8e-3) = 29.975 s, and 2 s of confirmation; run-down from
    2500 to 10 rad/s 80 s ln((2.5e-3 + 4e-3)/(1e-5 + 4e-3)) = 38.641 s.
    """
    record = session.run(SHORT, seed=5)
    found = reduced(session, record)
    assert found.verdict == "pass" and not found.reasons
    assert found["start"].estimate == 0.0
    assert found["t wheel"].estimate == pytest.approx(-80.0 * math.log(1.0 - 0.3125) + 2.0, abs=5e-3)
    assert found["t brake"].estimate == pytest.approx(80.0 * math.log(6.5e-3 / 4.01e-3), abs=5e-3)
    for name in ("reference", "null", "torquer", "angle"):
        c = found[name]
        assert c.truth is None or abs(c.estimate - c.truth) < 5.0 * c.u
    assert found["loop"].estimate == pytest.approx(1.0, abs=5.0 * found["loop"].u)
    rows = found.tables[0].rows
    assert [r[-1] for r in rows] == ["done"] * 13
    assert all(a[1] + a[2] == pytest.approx(b[1], abs=2e-3) for a, b in pairwise(rows))


def test_the_torquer_is_measured_not_believed(session: Session) -> None:
    """A torquer of 0.97 of its data sheet, within the tolerance, is seen as 0.97; no start is broken off."""
    values = {**SHORT, "gyro.k": 0.97 * 17.2e3 / 3600.0 * math.pi / 180.0, "program.gain": 0.83387953}
    found = reduced(session, session.run(values, seed=6))
    assert found["torquer"].estimate == pytest.approx(0.97, abs=1e-3)
    assert found["torquer"].interval[0] < 0.97 < found["torquer"].interval[1]


@pytest.mark.long
def test_no_false_alarm_in_thirty_starts(session: Session) -> None:
    """And the intervals of the noisy self-tests hold the truth in at least 102 of 120, five standard deviations below
    the 114 of 95 %.
    """
    inside = 0
    for seed in range(30):
        record = session.run(SHORT, seed=100 + seed)
        assert not record.windows["reason"].any(), seed
        found = reduced(session, record)
        for name, truth in (("reference", 5.0), ("null", 0.0), ("torquer", 1.0), ("loop", 1.0)):
            low, high = found[name].interval
            inside += low <= truth <= high
    assert inside >= 102


def test_an_unknown_fault_is_refused() -> None:
    with pytest.raises(InvalidConfigurationError, match="unknown; available faults: none, heater weak"):
        load_system(NAME).with_values({"fault": "gremlins"}).refuse()
