"""Sentences of the answer: numbers with their uncertainty, and by what an isolation is limited."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from gyrobench.reduction.estimation.sentences import Sentence, plain, renewed, seconds, told, with_u
from gyrobench.reduction.loops.loop_summary import base_torques
from gyrobench.result import Coefficient, LoopResult

F_C = Coefficient("f_c", "gain crossover frequency", "Hz", 10.1512, 0.02345, 1.96, (10.105, 10.197))
PM = Coefficient("PM", "phase margin", "°", 62.861, 0.15, 1.96, (62.57, 63.16))
NONE = replace(PM, name="θ*", estimate=math.nan, u=math.nan, no_value="unsettled")
PLATFORM = {
    "viscous": 0.05, "k_t": 1.0, "k_e": 1.0, "R": 2.0, "L": 0.004, "ratio": 1.0, "J_motor": 0.0, "J": 2.0,
    "friction": 0.0, "stiction": 0.0, "presliding": 5e-5,
}  # fmt: skip


def test_numbers_of_a_sentence_have_their_uncertainty() -> None:
    """1.96 times 0.02345 is 0.04596; "(95 %)" is said once, behind the last number that has one."""
    (said,) = told([F_C, PM, NONE], "Crossover {f_c}, phase margin {PM}; stable.", "Off by {θ*}.", "")
    assert said == "Crossover 10.151 ± 0.046 Hz, phase margin 62.86 ± 0.29° (95 %); stable."
    loss = replace(F_C, unit="dB", estimate=-56.77, u=0.01, interval=(-56.7896, -56.7504))
    assert with_u(loss, negated=True) == "56.770 ± 0.020 dB"
    assert with_u(replace(F_C, unit="1", estimate=0.5, u=0.0)) == "0.5"


def test_an_interval_that_lies_to_one_side_is_written_by_its_ends() -> None:
    """U = 0.36/2 has two digits; an interval that leaves out zero, as that of a spread, says that it is not zero."""
    spread = replace(F_C, unit="°/h", estimate=0.379, u=0.18 / 1.96, interval=(0.272, 0.629))
    assert with_u(spread) == "0.38 (0.27 to 0.63) °/h"
    assert with_u(replace(spread, estimate=0.1, interval=(0.0, 0.5))) == (
        "0.10 (0.00 to 0.50) °/h, not distinguishable from zero"
    )
    assert with_u(spread, negated=True) == "−0.38 (−0.63 to −0.27) °/h"
    wide = replace(spread, estimate=2.0, u=3.2, interval=(1.0, 13.4))  # k u exceeds the estimate
    assert with_u(wide) == "2.0 (1.0 to 13.4) °/h"
    (said,) = told([spread], "Spread {f_c}.")
    assert said == "Spread 0.38 (0.27 to 0.63) °/h (95 %)."


def test_a_number_of_a_sentence_is_written_as_in_tables() -> None:
    assert [plain(x) for x in (0.0123, 99.6, 174.0, 83400.0, 2.04e7)] == ["0.012", "100", "170", "83000", "2·10⁷"]
    assert [plain(x, 3) for x in (-1649.0, 999999.0, 1.724e7)] == ["-1650", "1·10⁶", "1.72·10⁷"]
    assert [plain(x, 2, "+") for x in (174.0, 3.0, -0.5)] == ["+170", "+3", "-0.5"]


def test_a_long_time_has_no_power_of_ten() -> None:
    assert [seconds(t) for t in (0.01234, 15.44, 1287.6, 4500.0)] == ["0.0123 s", "15.4 s", "1290 s", "4500 s"]
    assert seconds(13512.0, 4) == "13510 s"


def test_a_value_below_its_uncertainty_is_not_stated_to_four_digits() -> None:
    """The acceleration of a vertical gyro "leaned it by 0.000467°", for 0.0005 with U = 0.0038."""
    lean = Coefficient("lean", "", "°", 0.000467, 0.0019, 1.96, (-0.0033, 0.0042))
    assert (
        Sentence("It leaned by {lean}.", [lean])
        == "It leaned by 0.0005 ± 0.0037°, not distinguishable from zero (95 %)."
    )


def test_sentences_follow_the_uncertainty_found_after_them() -> None:
    """The communication step's part comes into u when the sentences are there."""
    first = told([F_C], "Crossover {f_c}.")
    result = LoopResult(
        method="", sources=[], conventions=[], coefficients=[F_C], responses=[],
        summary=[*first, "Said."],
    )  # fmt: skip
    result = replace(result, coefficients=[replace(F_C, u=0.2)])
    result = replace(result, summary=renewed(result))
    assert result.summary == ["Crossover 10.15 ± 0.39 Hz (95 %).", "Said."]
    assert json.loads(json.dumps(result.as_dict()["summary"])) == list(result.summary)


def test_ways_of_the_base_into_the_platform() -> None:
    """At 1 Hz: B s = 0.314 N·m/rad, k_t k_e s/(R + L s) = 6.283/|2 + 0.0251j| = 3.141."""
    ways = base_torques({f"platform.{n}": x for n, x in PLATFORM.items()}, 1.0)
    assert {n: abs(way) for n, way in ways.items()} == pytest.approx(
        {"viscous friction": 0.31416, "the back EMF of the motor": 3.14135}, rel=1e-4
    )
    geared = PLATFORM | {"k_e": 0.0, "ratio": 3.0, "J_motor": 0.01, "stiction": 0.8}
    ways = base_torques({f"platform.{n}": x for n, x in geared.items()}, 1.0)
    # 3 · 2 · 0.01 (2 pi)²; K = 16000 N·m/rad and sqrt(16000 · 2.09) 2 pi of its damping
    assert abs(ways["the inertia of the motor"]) == pytest.approx(2.36871, rel=1e-5)
    assert ways["the sticking bearing"] == pytest.approx(complex(16000.0, 1148.98), rel=1e-5)
    assert base_torques({"platform.viscous": [0.1, 0.1, 0.1]}, 1.0) == {}
