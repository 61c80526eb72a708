"""Supervision of a table: every kind of fault, two at once, detection times by hand, false alarms by their rate."""

from __future__ import annotations

import importlib
import math
from itertools import combinations

import numpy as np
import pytest

from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.uncertainty import clopper_pearson, poisson_interval
from gyrobench.result import LoopResult
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system

NAME = "table_supervision"
reduction = importlib.import_module(".reduction", type(load_system(NAME)).__module__)


@pytest.fixture(scope="module")
def record(session: Session) -> Record:
    return session.run({"quiet": 5.0, "repeats": 3, "pairs": 28}, seed=4)


@pytest.fixture(scope="module")
def found(session: Session, record: Record) -> LoopResult:
    result = session.system.reduce(record)
    assert isinstance(result, LoopResult)
    return result


def test_every_fault_and_every_pair_is_found_and_named(record: Record, found: LoopResult) -> None:
    w = record.windows
    assert w["fault"].size == 1 + 24 + 28  # the quiet time and the turns
    pairs = {(int(a), int(b)) for a, b in zip(w["fault"], w["also"], strict=True) if b}
    assert pairs == set(combinations(range(1, 9), 2))
    rows = found.tables[0].rows
    assert [r[1:4] for r in rows] == [[3, 3, 3]] * 8 + [[28, 28, 28]]
    assert found["missed"].estimate == 0.0
    assert found["missed"].interval[1] == pytest.approx(100.0 * (1.0 - 0.025 ** (1.0 / 52.0)))  # none of 52


def test_detection_times_are_those_of_the_sampling(found: LoopResult) -> None:
    """Supervisor: two samples of 10 ms, the first one 0 to 10 ms late: 15 ms.  Pressure 6e5 - 4e5 (1 - e^(-2 t)) passes
    4e5 at ln(2)/2 = 0.3466 s, temperature 308 + 75 (1 - e^(-2 t)) passes 343.15 at 0.3163 s.  Supply: two looks of
    0.1 s after the one to come, 0.25 s.  Rate: the monitor's limit of 2 rad/s is passed at 1.5/20 s: 0.075 + 0.25 s.
    """
    wanted = {
        "air pressure low": math.log(2.0) / 2.0 + 0.015,
        "over-temperature": -math.log(1.0 - 35.15 / 75.0) / 2.0 + 0.015,
        "encoder lost": 0.015,
        "supply voltage low": 0.25,
        "over-rate": 0.325,
    }
    for name, value in wanted.items():
        c = found[f"t {name}"]
        assert c.closed == pytest.approx(value, abs=1e-9)
        # three instants evenly spread over the period of the one that finds it: to half a third of it
        period = 0.1 if name in ("supply voltage low", "over-rate") else 0.01
        assert c.estimate == pytest.approx(value, abs=period / 6.0 + 6e-3), name
    for name in ("pulse frequency high", "pulse duty high", "pulse amplitude low"):
        assert 0.25 - 0.06 - 0.1 / 6.0 < found[f"t {name}"].estimate < 0.25 + 0.1 / 6.0


def test_a_table_that_is_switched_off_stops(record: Record, found: LoopResult) -> None:
    off = record.windows["tripped"] > 0.0
    assert off.sum() >= 12 and np.all(np.abs(record.windows["rate"][off]) < 1e-9)
    assert not found.reasons


@pytest.mark.long
def test_false_alarms_come_at_the_rate_of_their_noise(session: Session) -> None:
    """Noise of 0.4 half widths: a look is outside with p = 2 Phi(-2.5) = 0.01242; of four items 40 looks a second, so
    0.497 1/s with hold_off 1 and 40 p2/(1 + p) = 0.0061 1/s with 2: 298 +- 17 and 3.7 +- 1.9 in 600 s.
    """
    counts = {}
    for hold_off in (1, 2):
        values = {"quiet": 600.0, "repeats": 1, "pairs": 0, "reading": 0.4, "hold_off": hold_off}
        noisy = session.run(values, seed=6)
        counts[hold_off] = int(noisy.windows["false_alarms"][0])
        per_second = reduction.false_rate(noisy.run.parameters)
        assert per_second == pytest.approx({1: 0.497, 2: 0.0061}[hold_off], rel=0.01)
    assert abs(counts[1] - 298) < 4 * 17 and counts[2] < 12


def test_intervals_of_counts() -> None:
    """Of 0 in n: 1 - 0.025^(1/n); of 5 counts: 1.62 to 11.67 (tables)."""
    assert clopper_pearson(0, 20) == pytest.approx((0.0, 1.0 - 0.025 ** (1.0 / 20.0)))
    assert poisson_interval(5) == pytest.approx((1.62, 11.67), abs=0.01)
    assert poisson_interval(0) == pytest.approx((0.0, -math.log(0.025)))


def test_a_fault_under_another_name_and_an_alarm_before_it_are_counted(session: Session, record: Record) -> None:
    windows = {n: v.copy() for n, v in record.windows.items()}
    windows["first"][5], windows["reason"][5] = 2.0, 0.0  # supply voltage called over-temperature
    windows["t_alarm"][13] = windows["t_fault"][13] - 0.1
    result = reduction.Reduction.from_record(Record(windows, {}, record.run))
    assert result["misnamed"].estimate == pytest.approx(100.0 / 52.0)
    assert result["missed"].estimate == pytest.approx(100.0 / 52.0)
    assert "1 turns had an alarm before the fault" in result.warnings[0]


def test_too_many_turns_are_refused() -> None:
    with pytest.raises(InvalidConfigurationError, match="84 turns; at most 60"):
        load_system(NAME).with_values({"repeats": 7, "pairs": 28}).refuse()
