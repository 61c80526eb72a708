"""Accelerometers whose bias follows the square of the specific force along them, in imu_positions.

square = 2e-5 s2/m makes 2e-5 G0 x 1e6 = 196.1 µg/g2: in the 12 positions, where an axis feels 0 or 0.71 g, it moves the
mean of the readings by 98 µg between them, 20 u of a bias.
"""

from __future__ import annotations

import importlib
from typing import Any

import pytest

from gyrobench.bench import UsageError
from gyrobench.engine.session import Session
from gyrobench.frames import G0
from gyrobench.result import Result
from gyrobench.system.system import load_system

NAME = "imu_positions"
SQUARE = 2e-5
SHORT = {"dwell": 20.0, "turns": 2}
compensation: Any = importlib.import_module(".compensation", type(load_system(NAME)).__module__)


def reduced(square: float, **options: Any) -> Result:
    system = load_system(NAME).with_values(SHORT | options)
    with Session(system, {"accelerometers": "accelerometer_mems"}) as session:
        return system.reduce(session.run({**SHORT, "accelerometers.square": square}, seed=4))


def test_a_square_is_taken_where_it_is_and_not_where_it_is_not() -> None:
    bent, straight = reduced(SQUARE), reduced(0.0)
    found = {c.name: c for c in bent.coefficients}
    for a in "xyz":
        assert abs(found[f"K2_{a}"].estimate - 196.1) < 3.5 * found[f"K2_{a}"].u
        assert abs(found[f"ba_{a}"].z or 0.0) < 3.5
    assert not any(c.name.startswith("K2") for c in straight.coefficients)
    assert not any(r.id == "residuals.contradict" for r in (*bent.reasons, *straight.reasons))
    with pytest.raises(UsageError, match="K2_x, K2_y, K2_z, squares of the specific force that the part does not have"):
        compensation.values_of(bent)


def test_the_sentence_says_what_the_table_says() -> None:
    """Value and u of an effect in the model are those of its coefficient."""
    result = reduced(SQUARE)
    for a in "xyz":
        c = result[f"K2_{a}"]
        (said,) = [s for s in result.summary if f"K2_{a} = " in s]
        assert f"K2_{a} = {c.estimate:.3g} µg/g² (u = {c.u:.2g} µg/g²," in said


def test_a_square_that_is_not_weighed_is_named() -> None:
    """1961 µg/g2, which no drift of the bias over 12 positions is like; 196 are held by the wider u of such a drift."""
    held = reduced(SQUARE, nuisances="none")
    assert all(abs(held[f"ba_{a}"].z or 0.0) < 3.0 for a in "xyz")
    result = reduced(10.0 * SQUARE, nuisances="none")
    named = {t.id for t in result.tests if t.id.startswith("square") and (t.p or 0.0) < 1e-4}
    assert named == {f"square:a{a}" for a in "xyz"}
    assert any(r.id == "residuals.contradict" for r in result.reasons)


def test_words_larger_than_their_noise_are_doubted() -> None:
    """Words of 14 mg are off by 14000/sqrt(12) = 4041 ug rms without noise, with noise of 10 words by nothing."""
    system = load_system(NAME).with_values(SHORT)
    word = 14e-3 * G0
    for white, said in ((1e-9, True), (word, False)):  # a density of N has the rms 10.5 N behind 50 Hz
        values = {**SHORT, "accelerometers.resolution": word, "accelerometers.white": white}
        with Session(system, {"accelerometers": "accelerometer_mems"}) as session:
            result = system.reduce(session.run(values, seed=4))
        words = [r for r in result.reasons if r.id == "accelerometers.words"]
        assert bool(words) == said
        assert not said or 4035 < int(words[0].text.split("off by ")[1].split()[0]) < 4042


def test_a_cubic_leaves_no_true_scale_factor() -> None:
    system = load_system(NAME).with_values(SHORT)
    for cubic, known in ((0.0, True), (1e-3 / G0**2, False)):
        with Session(system, {"accelerometers": "accelerometer_mems"}) as session:
            result = system.reduce(session.run({**SHORT, "accelerometers.cubic": cubic}, seed=4))
        assert (result["Sa_xx"].truth is not None) == known
        assert result["Sa_xy"].truth is not None
