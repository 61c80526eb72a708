"""The rate test of a table: time base and rates recovered, tracking, torque of a change of rate, refusals."""

from __future__ import annotations

import importlib.util
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gyrobench as gb

ERU, ARCSEC = 7.2921159e-5, math.pi / 648000
FOLDER = Path(__file__).parents[2] / "systems" / "table_rate_test"


def closed_form() -> Any:
    spec = importlib.util.spec_from_file_location("rate_closed_form", FOLDER / "closed_form.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules["rate_closed_form"] = module
    spec.loader.exec_module(module)
    return module


def test_run(parts: dict[str, str] | None = None, **values: Any) -> Any:
    test = gb.load("table_rate_test", parts=parts or {}, rates="1 100 1999.9", dwell="25s", settle="1s")
    for name, value in values.items():
        test.set(name.replace("__", "."), value)
    return test.run(seed=1)


test_run.__test__ = False  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def found() -> Any:
    return test_run(command__reference_clock=4e-6)


@pytest.mark.long
def test_time_base_and_rates_come_back(found: Any) -> None:
    r = found.result
    base = r["time base"]
    assert base.truth == pytest.approx(4.0) and abs(base.z) < 3 and base.u < 1.0
    for eru in ("1", "100", "1999.9"):
        c = r[f"error {eru} ERU"]
        assert abs(c.z) < 3
        # the readings alone: 0.18 arcsec / sqrt(6) over 0.9 of 25 s, both senses; scale errors on top
        counts = 0.18 * ARCSEC / math.sqrt(12) / (float(eru) * ERU * 0.9 * 25.0) * 1e6
        assert counts <= c.u < 4 * counts + 2500 / float(eru)
    assert r["error 1 ERU"].u > 100 * r["error 1999.9 ERU"].u


def test_three_readouts_agree(found: Any) -> None:
    """By gates of 10 s one count is 1.2e-3 of 1 ERU, by 1 deg marks the clock's 1e-4 s is 8e-4 of 1999.9 ERU."""
    table = found.result.tables[0]
    rows = {row[0]: row for row in table.rows}
    assert sum(row[3] is not None for row in rows.values()) >= 1  # a gate that began in the phase and ended in it
    for eru, row in rows.items():
        assert row[3] is None or abs(row[3]) < 1.3e3 / min(abs(eru), 100.0) + 50
        if abs(eru) >= 99:
            assert abs(row[4]) < 900
    slow = [row for eru, row in rows.items() if abs(eru) < 1.1]
    assert all(row[4] is None for row in slow)  # 239 s/deg: no interval in 25 s


def test_tracking_is_a_fraction_of_a_count(found: Any) -> None:
    for eru in ("1", "100", "1999.9"):
        assert 0.02 < found.result[f"ripple {eru} ERU"].estimate < 0.18
    assert all(abs(row[5]) < 0.02 for row in found.result.tables[0].rows)  # mean of the error, arcsec


def test_torque_of_the_largest_change_is_that_of_the_linear_loop(found: Any) -> None:
    c = found.result["peak torque"]
    assert c.closed == pytest.approx(2.94, abs=0.1)  # J a = 2.56 N.m and the correction of the feedback
    assert abs(c.estimate - c.closed) < 3 * c.u
    (step,) = [x for x in found.result.responses if x.kind == "step"]
    exact = np.interp(step.x, step.curves[0].x, step.curves[0].y)
    assert np.abs(np.array(step.y) - exact).max() < 0.55  # three counts


@pytest.mark.long
def test_without_feedforward_the_ramp_costs_the_acceleration_over_the_stiffness() -> None:
    run = test_run(feedforward="0", rates="1999.9", dwell="2s")
    (step,) = [x for x in run.result.responses if x.kind == "step"]
    stiffness = 547 * 9.80665e-5 / ARCSEC  # g.cm/arcsec, p = 0.5
    assert max(map(abs, step.y)) == pytest.approx(2.56 / stiffness / ARCSEC, abs=0.5)


@pytest.mark.long
def test_sampled_against_analogue_control(found: Any) -> None:
    analogue = test_run({"controller": "controller_analog"}, rates="100", dwell="5s")
    assert abs(analogue.result["error 100 ERU"].z) < 4
    assert "peak torque" not in analogue.result.names  # no closed loop of that kind
    # 40 times as many corrections: less ripple than a count, more noise of the torque
    assert analogue.result["ripple 100 ERU"].estimate < 0.15
    assert gb.compare(found, analogue)


# ------------------------------------------------------------------------------------------ closed forms
def test_linear_loop() -> None:
    loop = closed_form().SampledLoop
    for p in (0.1, 0.3, 0.7):  # without lags all poles are at p
        assert loop(2.56, 2.56, 5e-3, p, 0.0, 9.8, 0.0, 5e-4).radius() == pytest.approx(p, abs=1e-3)
    ideal = loop(2.56, 2.56, 5e-3, 0.0, 0.0, 9.8, 0.0, 5e-4)
    assert ideal.stiffness() == pytest.approx(2 * 2.56 / 25e-6 * 2 / 7, rel=1e-12)
    # a delay of 0.36 T takes deadbeat poles to the unit circle
    assert loop(2.56, 2.56, 5e-3, 0.0, 0.0, 9.8, 1.7e-3, 1e-4).radius() < 1
    assert loop(2.56, 2.56, 5e-3, 0.0, 0.0, 9.8, 1.9e-3, 1e-4).radius() > 1
    # and a multiplier loop of 100 Hz does alone
    assert loop(2.56, 2.56, 5e-3, 0.0, 0.0, 9.8, 0.0, 5e-4, 0.0, 200 * math.pi).radius() > 1


def test_a_step_of_the_rate_takes_two_and_a_half_J_w_over_T() -> None:
    loop = closed_form().SampledLoop(2.56, 2.56, 5e-3, 0.0, 0.0, 1e9, 0.0, 5e-3)
    torque = loop.ramp(1e-3, 1e9, 0.1)[2]
    # an infinite acceleration still turns the reference by half a step in its first period: 0.5 and 0.75 of it
    assert np.abs(torque).max() == pytest.approx(0.5 * 2.5 * 2.56 * 1e-3 / 5e-3, rel=0.5)


def test_scale_error_between_two_readings() -> None:
    """A sin(n x + phase), any phase: rms difference of two readings A sqrt(1 - cos n angle), none over whole turns."""
    rng = np.random.default_rng(2)
    phase = rng.uniform(0, 2 * math.pi, 200_000)
    for n, angle in ((1, 0.3), (2, 2.0), (720, 0.01)):
        difference = np.sin(n * angle + phase) - np.sin(phase)
        assert np.sqrt(np.mean(difference**2)) == pytest.approx(math.sqrt(1 - math.cos(n * angle)), rel=0.01)


# ---------------------------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"rates": "0.001"}, "0.01 to 1999.9 ERU"),
        ({"rates": "2000"}, "0.01 to 1999.9 ERU"),
        ({"rates": "1, fast"}, "numbers in ERU"),
        ({"rates": " ".join(["1"] * 50)}, "1 to 49 rates"),
        ({"rates": "1 15.041"}, "15.041: the command sets steps of 0.01 ERU"),
        ({"pole": "0"}, "the loop is unstable"),
        ({"command.reference_acceleration": "1.6"}, "saturates the motor at a change of rate"),
    ],
)
def test_refusals(values: dict[str, str], text: str) -> None:
    test = gb.load("table_rate_test", dwell="1s")
    with pytest.raises(gb.GyrobenchError, match=text):
        for name, value in values.items():
            test.set(name, value)
        test.run(seed=1)


def test_slow_rates_are_not_for_the_tachometer_loop() -> None:
    test = gb.load("table_rate_test", parts={"controller": "controller_analog"}, rates="1")
    test.set("controller.loop", 1)
    with pytest.raises(gb.GyrobenchError, match="below the range of the tachometer loop"):
        test.run(seed=1)
