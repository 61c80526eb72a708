"""The plan of loop tests: parameters, duration, problems; recorded profiles."""

from __future__ import annotations

from pathlib import Path

import pytest

from gyrobench.record.csv_reader import DataError
from gyrobench.record.motion_profile import read_profile
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep


def test_parameters_of_the_exciter() -> None:
    plan = LoopPlan(
        [
            LoopPhase("step", "torque", "step", 2, 0.5, settle=1.0, dwell=2.0),
            LoopPhase("wave", "motion", "sine", 3, 0.01, frequency=4.0, settle=1.0, dwell=3.0),
            LoopPhase("rest", dwell=5.0),
        ]
    )
    p = plan.parameters("x")
    assert p["x.phases"] == 3
    assert p["x.kinds"] == [1, 4, 0] and p["x.shapes"] == [1, 2, 0] and p["x.axes"] == [2, 3, 1]
    assert p["x.amplitudes"] == [0.5, 0.01, 0.0] and p["x.frequencies"] == [0.0, 4.0, 0.0]
    assert plan.duration() == 3.0 + 4.5 + 5.0  # the sine fades for half of its settling
    assert plan.problems() == []
    row = plan.rows()[1]
    assert (row["phase"], row["mode"], row["unit"], row["frequency"]) == (2, "motion", "rad", 4.0)


def test_problems_name_phase_and_remedy() -> None:
    plan = LoopPlan(
        [
            LoopPhase("a", "torc", "square", 4, dwell=0.0, settle=-1.0),
            LoopPhase("b", "test", "sine", dwell=1.0),
            LoopPhase("c", "test", "sine", frequency=0.5, dwell=1.0),
        ]
    )
    text = "\n".join(plan.problems())
    for said in ("phase 1 'a': kind 'torc' is none of hold, torque", "shape 'square'", "axis 4", "dwell = 0 s",
                 "settle = -1", "phase 2 'b': frequency = 0 Hz",
                 "phase 3 'c': dwell = 1 s is less than one period"):  # fmt: skip
        assert said in text
    assert "0 phases" in LoopPlan().problems()[0]


def test_sweep_measures_whole_periods() -> None:
    """At least 6 periods or what fills the dwell, 2 to settle or what fills the settling: 0.5 Hz in 3 s -> 2 periods,
    10 Hz in 3 s -> 30; 10 Hz in 1.05 s of dwell -> 11."""
    slow, fast = sweep("s", "test", [0.5, 10.0], lambda f: 1.0 / f, axis=2, settle=3.0, dwell=1.05)
    assert (slow.settle, slow.dwell, slow.amplitude) == (4.0, 12.0, 2.0)
    assert (fast.settle, fast.dwell, fast.axis) == (3.0, 1.1, 2)
    assert slow.label == "s 0.5 Hz"


def test_profile(tmp_path: Path) -> None:
    file = tmp_path / "p.csv"
    file.write_text("# a ship\ntime [min];roll [deg];heading [mrad]\n1;0;1\n1.01;2;2\n1.02;3;3\n")
    p = read_profile(file, "m")
    assert p["m.preset"] == 9 and p["m.points"] == 3
    assert p["m.profile_t"] == pytest.approx([0.0, 0.6, 1.2])
    assert p["m.profile"][1] == pytest.approx([0.0, 0.0349066, 0.002], rel=1e-6)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("time [s],roll [deg]\n0,1\n2,2\n1,3\n", "time = 1 s does not come after 2 s"),
        (
            "time [s],roll [deg]\n0,1\n1,2\n2,3\n8,3\n9,1\n",
            "a gap of 6 s after time = 2 s, where the median interval is 1 s",
        ),
        ("time [s]\n0\n1\n2\n", "no column pitch, roll or heading"),
        ("time [s],roll [deg]\n" + "".join(f"{k},0\n" for k in range(900)), "900 points: .* every 3th row"),
        ("time [s],roll [m]\n0,1\n", "wrong unit"),
    ],
)
def test_profiles_that_cannot_be_played(text: str, says: str, tmp_path: Path) -> None:
    file = tmp_path / "p.csv"
    file.write_text(text)
    with pytest.raises(DataError, match=says):
        read_profile(file)
