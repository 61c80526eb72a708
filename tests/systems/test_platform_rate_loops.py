"""The platform with rebalanced rate gyros and servos of three loops: closed forms, margins, budget, position loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gyrobench.engine.session import Session
from gyrobench.system.system import System, load_system

NAME = "platform_three_axis"
AXES = ("pitch", "roll", "azimuth")
J = (1.0, 2.0, 0.7)  # kg.m2, of the axes at joint angles 0
WC = 2.0 * math.pi * 10.0
WI = 0.2 * WC


def rates(**options: Any) -> System:
    system = load_system(NAME)
    system.set("loops", "rate")
    for name, value in options.items():
        system.set(name, value)
    return system


@pytest.fixture(scope="module")
def found() -> Any:
    with Session(rates()) as session:
        record = session.run({"swing": 0.087, "hold": 5.0}, seed=1)
    result = load_system(NAME).reduce(record)
    return record, {c.name: c for c in result.coefficients}, result


def gain(k: int) -> float:
    """K_w k_t, N.m.s/rad: |K_w k_t (1 + wi/s)/(J s)| = 1 at wc."""
    return WC * J[k] / math.hypot(1.0, WI / WC)


@pytest.mark.long
def test_stiffness_of_the_rate_loop_with_integral(found: Any) -> None:
    """K_w w + K_wi angle: a constant torque M turns an axis by M/(K_w wi), 266 arcsec about pitch, and no further.

    T2 at a pitch of 20 deg turns the roll axis' signal by its cosine.
    """
    coefficients = found[1]
    for k, axis in enumerate(AXES):
        seen = math.cos(math.radians(20.0)) if axis == "roll" else 1.0
        static = seen / (gain(k) * WI) * 180.0 / math.pi * 3600.0
        assert coefficients[f"peak {axis}"].estimate == pytest.approx(static, rel=0.01), axis


@pytest.mark.long
def test_isolation_by_the_closed_form(found: Any) -> None:
    """The base pulls by viscous friction alone, the current loop takes the back EMF out: B s / (J s2 + K_w (s + wi)).

    At joints of 20 and 30 deg the axes mix: 0.2 dB.
    """
    s = 2j * math.pi * 0.5
    expected = 20.0 * math.log10(abs(0.05 * s / (J[0] * s * s + gain(0) * (s + WI))))
    assert found[1]["isolation x"].estimate == pytest.approx(expected, abs=0.2)


@pytest.mark.long
def test_margins_of_the_linear_model(found: Any) -> None:
    """Gyro (b'' with J/C, rebalance of 100 Hz) and current loop of 500 Hz behind the rate loop, by hand."""
    coefficients = found[1]
    tau, wr, wcur = 2.5e-5 / 0.02, 2.0 * math.pi * 100.0, 2.0 * math.pi * 500.0
    for k, axis in enumerate(AXES):
        f = coefficients[f"f_c {axis}"].estimate
        s = 2j * math.pi * f
        gyro = wr / (s * (tau * s + 1.0) + wr)
        L = gain(k) * (1.0 + WI / s) / (J[k] * s + 0.05) * gyro * wcur / (s + wcur)
        margin = 180.0 + math.degrees(np.angle(L))
        assert coefficients[f"PM {axis}"].estimate == pytest.approx(margin, abs=2.5)  # joints of 20, 30 deg, step
        c = coefficients[f"PM {axis}"]
        assert abs(c.estimate - c.closed) < 4.0 * max(c.u, 0.1)


@pytest.mark.long
def test_budget_by_source_is_what_was_measured(found: Any) -> None:
    rows = next(t for t in found[2].tables if t.id == "budget.sources").rows
    for motion in ("base about x, 0.5 Hz", "base about y, 0.7 Hz"):
        by = {r[1]: r for r in rows if r[0] == motion}
        assert by["together"][2] == pytest.approx(by["measured"][2], rel=0.02)
        assert by["viscous friction"][3] > 99.0 and "back EMF of the motors" not in by


@pytest.mark.long
def test_commands_and_drift(found: Any) -> None:
    coefficients = found[1]
    assert coefficients["rate gain"].estimate == pytest.approx(1.0, abs=2e-4)
    assert coefficients["cross x"].estimate < 0.1  # %: T2 on commands and on signals
    for axis in "xyz":
        c = coefficients[f"drift {axis}"]
        assert abs(c.estimate - c.truth) < 4.0 * c.u


@pytest.mark.long
def test_position_loops_hold_the_joint_angles() -> None:
    """Outside of the rate loop with its integral: a constant torque leaves no angle, where the rate loop left 266″."""
    with Session(rates(track=1.0, swing=0.0, sweeps=False)) as session:
        record = session.run({"hold": 5.0}, seed=1)
    theta = record.channels["platform.theta[1]"]
    phase = record.channels["exciter.phase"]
    late = theta[np.flatnonzero(phase == 1)[-1]]
    assert abs(late - math.radians(20.0)) < 10.0 / 206265.0


@pytest.mark.parametrize(
    ("sets", "said"),
    [
        (["loops=three"], "loops = three: must be one of angle, rate"),
        (["track=1Hz"], "track: a position loop is one of loops = rate"),
        (["loops=rate", "track=3Hz"], "track = 3 Hz: the outer loop is slower than a fifth of the rate loop"),
    ],
)
def test_run_is_refused(refused: Callable[..., None], sets: list[str], said: str) -> None:
    refused(NAME, sets, [said])


@pytest.mark.long
def test_an_acquisition_card_in_front_of_the_loops() -> None:
    """Its estimate is in whole codes of 10 V / 2^14, at a gain of 2.5 V for 1 rad/s."""
    system = rates(swing=0.0, sweeps=False)
    system.request("estimator_x")
    with Session(system, {"estimator_x": "acquisition_card"}) as session:
        record = session.run({"hold": 5.0, "estimator_x.gain": 2.5}, seed=1)
    codes = record.channels["estimator_x.estimate"] * 2.5 * 2**14 / 10.0
    assert np.max(np.abs(codes - np.round(codes))) < 1e-6 and np.ptp(codes) >= 1.0
