"""The drift test suite on one virtual gyro: methods agree by CROSS-MAP in dynamic co-simulation, and where the gyro is
not the same in one of them that one is named; short plans of the member tests.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import servoing_two_axes
import tumbling
import two_channels
from servoing import DAY50, DPH, W50, polar_at_2_ms

from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.reduction.suite.method_comparison import Member, combine_methods, compare
from gyrobench.system.suite import Suite, load_test
from gyrobench.system.system import InvalidConfigurationError
from gyrobench.system.values import InvalidValueError

NAME = "drift_test_suite"
SHORT: dict[str, dict[str, Any]] = {
    "tumble_single_axis": tumbling.SHORT,
    "tumble_two_axis": {"dwell": 10.0, "settle": 3.0},
    "servo_polar": DAY50,
    "servo_vertical_level": {"dwell": 60.0, "cycles": 1, "windows": 10},
    "fixed_position": {"dwell": 120.0, "readings": 24, "settle": 3.0},
    "tumble_two_channel": two_channels.SHORT,
    "servo_two_axis": servoing_two_axes.day(200.0),
    "eight_position": {"cycles": 3, "readings": 2, "dwell": 10.0, "settle": 3.0},
}


@pytest.fixture(scope="module")
def sessions() -> Iterator[dict[str, Session]]:
    prepared = {name: Session(polar_at_2_ms() if name == "servo_polar" else name) for name in SHORT}
    yield prepared
    for session in prepared.values():
        session.close()


def suite(tests: str, **values: Any) -> Suite:
    found = load_test(NAME)
    assert isinstance(found, Suite)
    found.set("tests", tests)
    for name, value in values.items():
        found.set(name.replace("__", "."), value)
    return found


RAN: dict[str, Record] = {}


def ran(session: Session, values: dict[str, Any], seed: int) -> Record:
    """A run, each once: what is stated of its errors changes the reduction alone."""
    stated = {n: v for n, v in values.items() if n.startswith("u_")}
    key = repr((session.system.name, seed, sorted((n, v) for n, v in values.items() if n not in stated)))
    if key not in RAN:
        RAN[key] = session.run({n: v for n, v in values.items() if n not in stated}, seed=seed)
    record = RAN[key]
    return Record(record.windows, record.channels, record.run.replace(options={**record.run.options, **stated}))


def results(
    sessions: dict[str, Session],
    chosen: Suite,
    seed: int = 1,
    noise: bool = True,
    only: str = "",
    **more: dict[str, Any],
) -> dict[str, Any]:
    """Each test (or the one named) run as the suite runs it: its values, its seed."""
    out = {}
    for name, system in chosen.members().items():
        if only not in ("", name):
            continue
        quiet = {} if noise else {n: 0.0 for n in system.noises}
        values = {**SHORT[name], **more.get(name, {}), **chosen.given_to(chosen.members())[name], **quiet}
        record = ran(sessions[name], values, chosen.seed_of(seed, name))
        found = system.with_values(values).reduce(record)
        out[name] = replace(found, provenance=record.run.as_dict())
    return out


def report(found: dict[str, Any], chosen: Suite) -> Any:
    members = {n: Member(r) for n, r in found.items()}
    return combine_methods(members, system=NAME, title="", method="", sources=(), shared=chosen.shared)


def floated(seed: int, tests: str, **more: Any) -> tuple[Suite, dict[str, float]]:
    """A random gyro; its slow drift is fast, as plans of minutes would take one of 300 s for a constant."""
    true = tumbling.gyro(np.random.default_rng(seed))
    return suite(tests, **{**true, "gyro.markov_tau": 3.0, **more}), {n.split(".")[1]: v for n, v in true.items()}


# ------------------------------------------------------------------------------------------ agreement
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.long
def test_tumble_and_polar_servo_agree(sessions: dict[str, Session], seed: int) -> None:
    """[CROSS-MAP], noise on: two tables, two loops, one with the torquer and one without it; all nine coefficients."""
    chosen, true = floated(seed, "tumble_single_axis servo_polar")
    found = report(results(sessions, chosen, seed), chosen)
    assert found.suite.consistency == "consistent"
    names = [q.name for q in found.suite.quantities]
    assert names == [p.quantity for p in found.suite.pairs] and set(names) == set(true)
    assert sum(p.E_n > 1.0 for p in found.suite.pairs) <= 2  # 9 pairs, 5 % each
    for c in found.coefficients:
        assert c.truth == pytest.approx(true[c.name] / DPH, rel=1e-9)
        assert abs(c.estimate - c.truth) < 4.0 * c.u
    for p in found.suite.pairs:
        assert abs(p.difference) < 2.0 * p.U


@pytest.mark.long
def test_noise_off_leaves_what_the_loops_leave(sessions: dict[str, Session]) -> None:
    """The rebalance loop reads harmonics too large by a known fraction (tumbling.lag); nothing else parts them."""
    chosen, true = floated(5, "tumble_single_axis servo_polar")
    chosen.set("servo_polar.gyro.J", 2e-5)  # J/H alpha_O goes with the Earth rate, in this day fifty times too large
    found = results(sessions, chosen, noise=False, tumble_single_axis={"rate": 0.1})
    lag = tumbling.lag({f"gyro.{n}": v for n, v in true.items()}, 0.1)
    for c in compare(found, ()):
        assert c.found is None or all(v.u_a < 1e-5 for v in c.values)
        tumble, servo = (v.estimate for v in c.values)
        assert tumble - servo == pytest.approx(lag[c.quantity.name], abs=1.2e-6)
        assert max(lag.values()) > 1.2e-6  # so that the line above says something


@pytest.mark.long
def test_composite_drift_and_three_more_methods(sessions: dict[str, Session]) -> None:
    """One attitude, six attitudes and 36 positions against the tumble: each sees what it can and no more."""
    chosen, _ = floated(
        8, "tumble_single_axis tumble_two_axis fixed_position servo_vertical_level",
        **{"fixed_position.attitude": "N -E"},
    )  # fmt: skip
    found = report(results(sessions, chosen, 8), chosen)
    by_name = {q.name: [v.label for v in q.values] for q in found.suite.quantities}
    assert by_name["D_IS"] == ["tumble_single_axis", "tumble_two_axis"]  # six attitudes with one axis vertical
    assert by_name["D_II"] == ["tumble_single_axis", "tumble_two_axis", "servo_vertical_level"]
    assert by_name["ω_d"] == [*by_name["D_F"][:2], "fixed_position", "servo_vertical_level"]
    drift = next(q for q in found.suite.quantities if q.name == "ω_d")
    # input axis north, output axis west, spin axis up: X = Y = 0, Z = -f/g0 = -gamma
    assert drift.combination["D_S"] == pytest.approx(-1.0, abs=1e-3) and "D_IS" not in drift.combination
    assert found.suite.consistency == "consistent"


@pytest.mark.long
def test_both_channels_by_tumble_and_eight_positions(sessions: dict[str, Session]) -> None:
    """u_zx, u_x, R_y ... of Hu 1981 are combinations; noise off they are what the tumble says, but for its lag."""
    rng = np.random.default_rng(2)
    chosen = suite("tumble_two_channel eight_position", **two_channels.gyro(rng))
    found = results(sessions, chosen, noise=False)
    compared = {c.quantity.name: c for c in compare(found, ())}
    both = {n for n, c in compared.items() if len(c.values) == 2}
    assert both == {"Dx_0", "Dx_x", "Dx_y", "Dx_xx", "Dy_0", "Dy_x", "Dy_y", "Dy_yy", "u_x", "u_y"}
    assert len(compared["k_x"].values) == 1 and len(compared["Dx_xz"].values) == 1
    for name in both:
        a, b = (v.estimate for v in compared[name].values)
        assert a == pytest.approx(b, abs=1e-5), name


@pytest.mark.long
def test_both_channels_by_tumble_and_two_axis_servo(sessions: dict[str, Session]) -> None:
    """Eighteen coefficients, noise on: one table turning under two rebalance loops, two tables held by the gyro."""
    true = two_channels.gyro(np.random.default_rng(6))
    chosen = suite("tumble_two_channel servo_two_axis", **true, **{"gyro.markov_tau": 3.0})
    found = report(results(sessions, chosen, 6), chosen)
    assert found.suite.consistency == "consistent"
    assert len(found.suite.pairs) == 18 and sum(p.E_n > 1.0 for p in found.suite.pairs) <= 3
    for c in found.coefficients:
        assert c.truth == pytest.approx(true[f"gyro.{c.name}"] / DPH, rel=1e-9, abs=1e-15)
        assert abs(c.estimate - c.truth) < 4.0 * c.u


# ------------------------------------------------------------------------------------ a gyro that changed
FOUR = "tumble_single_axis tumble_two_axis servo_polar servo_vertical_level"


@pytest.fixture(scope="module")
def unchanged(sessions: dict[str, Session]) -> dict[str, Any]:
    """Of four tests on one gyro."""
    return results(sessions, floated(3, FOUR)[0], 3)


@pytest.mark.parametrize(("name", "culprit"), [("D_I", "servo_polar"), ("D_S", "servo_vertical_level")])
@pytest.mark.long
def test_a_gyro_that_changed_in_one_test_is_found(
    sessions: dict[str, Session], unchanged: dict[str, Any], name: str, culprit: str
) -> None:
    chosen, true = floated(3, FOUR)
    other = true[name] + 0.5 * DPH
    chosen.set(f"{culprit}.gyro.{name}", other)
    found = report({**unchanged, **results(sessions, chosen, 3, only=culprit)}, chosen)
    assert found.suite.consistency == "inconsistent"
    assert name in found.suite.disagreeing
    words = next(q.words for q in found.suite.quantities if q.name == name)
    assert words.startswith(f"{culprit} deviates by +0.5 °/h/g; the others are consistent")
    assert any(f"gyro.{name} = " in w and "Not the same in all tests" in w for w in found.warnings)


@pytest.mark.long
def test_a_wrong_scale_factor_is_one_error_of_all_that_use_it(sessions: dict[str, Session]) -> None:
    """k of the torquer taken 10 % too large in both tumbles; the servo does not use it.  The reduction reads all drift
    that 10 % too large.  With a standard uncertainty of 10 % stated, the three agree and the mean follows the servo;
    with none two wrong ones outvote the right one; were the two errors independent, they would still draw the mean.
    """
    right = 17.2e3 * DPH  # rad/s/A
    tests = "tumble_single_axis tumble_two_axis servo_polar"
    chosen, true = floated(4, tests, k=1.1 * right, u_scale_factor=0.1)
    found = results(sessions, chosen, 4)
    together = report(found, chosen)
    assert together.suite.consistency == "consistent" and together.suite.shared == ["torquer scale factor"]
    name = max(("D_I", "D_S"), key=lambda n: abs(true[n]))
    row = next(q for q in together.suite.quantities if q.name == name)
    for v in row.values[:2]:
        assert v.estimate == pytest.approx(1.1 * true[name] / DPH, rel=0.02)
        assert v.u_shared == pytest.approx(0.1 * abs(v.estimate), rel=0.02)
    assert row.values[2].weight > 0.95
    mean = next(c for c in together.coefficients if c.name == name)
    assert abs(mean.estimate - true[name] / DPH) < 3.0 * mean.u < 0.03 * abs(mean.estimate)

    blind, _ = floated(4, tests, k=1.1 * right)
    apart = report(results(sessions, blind, 4), blind)
    assert name in apart.suite.disagreeing
    words = next(q.words for q in apart.suite.quantities if q.name == name)
    assert words.startswith("servo_polar deviates by")  # what an unstated common error does


@pytest.mark.long
def test_two_methods_cannot_tell_which_is_off(sessions: dict[str, Session]) -> None:
    chosen, true = floated(3, "tumble_single_axis servo_polar")
    chosen.set("servo_polar.gyro.D_I", true["D_I"] + 0.5 * DPH)
    found = report(results(sessions, chosen, 3), chosen)
    words = next(q.words for q in found.suite.quantities if q.name == "D_I")
    assert "inconsistent: E_n of tumble_single_axis and servo_polar" in words and "cannot be identified" in words
    assert next(c for c in found.coefficients if c.name == "D_I").truth is None  # there are two


# -------------------------------------------------------------------------------------- what goes where
def test_values_go_to_all_tests_that_have_them() -> None:
    chosen = suite("tumble_single_axis servo_polar", **{"gyro.D_I": "1deg/h/g", "latitude": "60deg", "turns": 2})
    chosen.set("servo_polar.turns", 3)
    chosen.set("servo_polar.gyro.D_I", "2deg/h/g")
    chosen.set("rebalance.i_max", 0.1)
    tumble, polar = chosen.members().values()
    assert tumble["latitude"] == polar["latitude"] == pytest.approx(math.radians(60.0))
    assert (tumble["turns"], polar["turns"]) == (2, 3)
    assert (tumble.overrides["gyro.D_I"], polar.overrides["gyro.D_I"]) == ("1deg/h/g", "2deg/h/g")
    assert "rebalance.i_max" in tumble.overrides and "rebalance.i_max" not in polar.overrides


def test_seeds_differ_from_test_to_test() -> None:
    chosen = suite("floated")
    seeds = [chosen.seed_of(1, n) for n in chosen.tests()]
    assert len(set(seeds)) == len(seeds) == 6 and chosen.seed_of(2, chosen.tests()[0]) not in seeds


@pytest.mark.parametrize(
    ("tests", "text"),
    [
        (
            "tumble_single_axis tumble_two_channel",
            r"not of one gyro: tumble_single_axis: floated_gyro \(SdfGyro\); tumble",
        ),
        ("tumble_single_axis accelerometer_multipoint", "accelerometer_multipoint: no slot gyro"),
        ("tumble_single_axis stabilizer_sdf", "stabilizer_sdf: a test of a loop; a suite compares drift tests"),
        ("tumble_single_axis servo_pole", "no test 'servo_pole'; did you mean servo_polar"),
        ("tumble_single_axis drift_test_suite", "no test 'drift_test_suite'"),
        ("servo_polar servo_polar", "servo_polar: named twice"),
        ("servo_polar", "1 test: at least two"),
        ("", "0 test: at least two"),
    ],
)
def test_sets_that_are_none_are_refused(tests: str, text: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=text):
        suite(tests).members()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("gyr.D_I", "gyr.D_I: no test of the suite takes it: no slot 'gyr'; did you mean gyro"),
        ("turnes", "turnes: no test of the suite takes it: did you mean turns"),
        ("servo_polar.wheel.x", "servo_polar has no option wheel.x and no slot wheel"),
    ],
)
def test_values_for_no_test_are_refused(name: str, text: str) -> None:
    with pytest.raises(InvalidValueError, match=text):
        suite("tumble_single_axis servo_polar", **{name: 1.0}).members()


def test_every_test_of_the_sets_is_there() -> None:
    for words in ("floated", "two_axis"):
        assert len(suite(words).members()) == len(suite(words).tests())
    assert DAY50["site.earth_rate"] == W50
