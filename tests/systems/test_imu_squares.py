"""Accelerometers whose bias follows the square of the specific force along them, in imu_positions.

square = 2e-5 s2/m makes 2e-5 G0 x 1e6 = 196.1 µg/g2: in the 12 positions, where an axis feels 0 or 0.71 g, it moves the
mean of the readings by 98 µg between them, 20 u of a bias.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imu_world import Unit, World, plan, poses

from gyrobench.bench import UsageError
from gyrobench.engine.session import Session
from gyrobench.frames import G0
from gyrobench.result import Result
from gyrobench.system.system import load_system

NAME = "imu_positions"
SQUARE = 2e-5
SHORT = {"dwell": 20.0, "turns": 2}
room = type(load_system(NAME)).__module__
budget: Any = importlib.import_module(".budget", room)
compensation: Any = importlib.import_module(".compensation", room)
reduction: Any = importlib.import_module(".reduction", room)


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


def test_products_that_the_residuals_do_not_show_are_in_wider_intervals() -> None:
    """16 positions as they come, one reading each of 0.3 mg: 1 mg/g2 by x y in the accelerometer y puts Sa_yx 3.4 u off
    and no test sees it.
    """
    rng = np.random.default_rng(14)
    places = plan([tuple(p) for p in rng.uniform(-np.pi, np.pi, (16, 2))], rate=0.0, count=1)
    unit, world = Unit.drawn(rng), World()
    windows = world.windows(places, unit)
    exact = world.windows(places, Unit(*(np.zeros(s) for s in (3, (3, 3), (3, 3), 3, (3, 3)))))
    x, y = (exact[f"mean_a{a}"] / G0 for a in "xy")
    windows["mean_ay"] = windows["mean_ay"] + 1e-3 * G0 * x * y + 3e-4 * G0 * rng.normal(size=x.size)
    setup = budget.ImuSetup(latitude=world.latitude, gravity=world.gravity, earth_rate=7.2921159e-5)
    result = reduction.Reduction(windows, setup).of_channel("ay").result()
    assert "residuals.contradict" not in {r.id for r in result.reasons}
    (reason,) = [r for r in result.reasons if r.id == "products.with"]
    true = unit.Sa[1, 0] / np.pi * 648000.0
    (low, high), (wide, most) = result["Sa_yx"].interval, reason.intervals["Sa_yx"]
    assert not low < true < high and wide < true < most


def test_squares_by_hand_that_no_test_sees_are_in_wider_intervals(tmp_path: Path) -> None:
    """A square K g u_x2 of the accelerometer x makes the sizes larger by K g u_x3, of which u_x, a bias, takes the
    mean of u_x4 over that of u_x2, 3/5 of directions all round: 400 ug/g2 are 240 ug, 4 u and more of 20 means with 100
    ug of noise.
    """
    rng = np.random.default_rng(0)
    force = 9.805 * np.array([p.inv().apply([0.0, 0.0, 1.0]) for p in poses(rng, 20)])
    file = tmp_path / "means.csv"
    head = "# attitudes = unknown\n# gravity = 9.805m/s2\n# type_b = none\nax [m/s2],ay [m/s2],az [m/s2]"
    read = force + 4e-4 * force**2 / G0 + 1e-4 * G0 * rng.normal(size=force.shape)
    np.savetxt(file, read, "%.9g", ",", header=head, comments="")
    system = load_system(NAME)
    result = system.reduce(system.read_measured(file, {}))
    assert "residuals.contradict" not in {r.id for r in result.reasons}
    (reason,) = [r for r in result.reasons if r.id == "squares.with"]
    for a in "xyz":
        c, (wide, most) = result[f"ba_{a}"], reason.intervals[f"ba_{a}"]
        assert c.estimate == pytest.approx(240.0, abs=4.0 * c.u) and c.interval[0] > 0.0 and wide < 0.0 < most
