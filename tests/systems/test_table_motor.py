"""Motor of a table: constants drawn at random come back; one run of each motor, and refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gyrobench as gb
from gyrobench.system.system import load_system

NAME = "table_motor_test"
DC, AC = {"drive": "motor_dc"}, {"drive": "motor_square_law"}


def drawn(seed: int) -> gb.Run:
    """One run of a motor drawn at random with its axis and noise; odd seeds: DC motor, even ones: square law."""
    rng = np.random.default_rng(seed)
    test = gb.load(NAME, parts=DC if seed % 2 else AC)
    if seed % 2:
        values: dict[str, Any] = {
            "drive.motor_K_t": rng.uniform(2.0, 4.0),
            "drive.motor_K_e": rng.uniform(2.0, 4.0),
            "drive.motor_R": rng.uniform(2.0, 6.0),
            "drive.motor_L": rng.uniform(0.01, 0.04),
        }
    else:
        values = {
            "drive.motor_K": rng.uniform(9e-4, 1.3e-3),
            "drive.motor_K_e": rng.uniform(0.0, 3.0),
            "drive.motor_offset": rng.normal(0.0, 0.5),
            "drive.motor_lag": rng.uniform(3e-4, 1e-3),
        }
    values |= {
        "J": rng.uniform(1.5, 4.0),
        "friction": rng.uniform(0.03, 0.2),
        "viscous": rng.uniform(0.01, 0.1),
        "body.axis_rumble": 10 ** rng.uniform(-4.0, -2.5),
        "voltmeter.noise_rms": 10 ** rng.uniform(-1.3, -0.7),
    }
    for name, value in values.items():
        test.set(name, float(value))
    return test.run(seed=seed, check_step=False)


@pytest.fixture(scope="module", params=[3, 4], ids=["dc", "square law"])
def run(request: pytest.FixtureRequest) -> gb.Run:
    return drawn(request.param)


def test_constants_come_back(run: gb.Run) -> None:
    """All within 3.5 u of what was drawn, and u a small part of them."""
    names = {c.name for c in run.result.coefficients}
    assert names in ({"K_t", "K_e", "R", "L", "J", "D", "M_C"}, {"K", "K_e", "K_s", "U_0", "lag", "J", "D", "M_C"})
    for c in run.result.coefficients:
        assert c.truth is not None and abs(c.estimate - c.truth) < 3.5 * c.u, c.name
        if c.name not in ("D", "M_C", "K_e", "U_0"):
            assert c.u < 0.01 * c.estimate, c.name


def test_hung_torque_is_the_standard(run: gb.Run) -> None:
    """A stated 1 % of the hung torque is 1 % of all torques and of J, and nothing of the winding or the lag."""
    record = run.record
    before = {c.name: c for c in run.result.coefficients}
    record.run.options["u_hung"] = 0.01
    result = load_system(NAME).reduce(record)
    record.run.options["u_hung"] = 0.0
    for c in result.coefficients:
        alone = before[c.name].u
        if c.name in ("K_t", "K", "J", "D", "M_C"):
            assert c.u == pytest.approx((alone**2 + (0.01 * c.estimate) ** 2) ** 0.5), c.name
        else:
            assert c.u == pytest.approx(alone), c.name
    assert "Not stated: u_voltage" in result.warnings[0] and "Not stated: u_hung" in run.result.warnings[0]


def test_momentum_of_a_coasting_table(run: gb.Run) -> None:
    """By hand: a coasting table loses M_C + D w; its rate at the two ends of the first coasting, from the counts."""
    found = {c.name: c.estimate for c in run.result.coefficients}
    channels, t = run.record.channels, run.record.channels["time"]
    inside = np.flatnonzero((channels["exciter.phase"] == 2.0) & (channels["exciter.gate"] > 0.5))
    x, n = channels["reader.angle_read"], 2000  # samples of 0.1 ms: rates over 0.2 s
    begin = (x[inside[n]] - x[inside[0]]) / (t[inside[n]] - t[inside[0]])
    end = (x[inside[-1]] - x[inside[-1 - n]]) / (t[inside[-1]] - t[inside[-1 - n]])
    way = x[inside[-1 - n // 2]] - x[inside[n // 2]]
    lost = found["J"] * (begin - end)
    braked = found["M_C"] * (t[inside[-1]] - t[inside[n]]) + found["D"] * way
    if "K" in found:  # V = U_0 - K_e w
        w = 0.5 * (begin + end)
        V = found["U_0"] - found["K_e"] * w
        braked -= found["K"] * 1e-6 * V * abs(V) * (t[inside[-1]] - t[inside[n]])
    assert lost == pytest.approx(braked, rel=0.03)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"torque": 0.0}, "torque"),
        ({"torque": 8.0}, "the steps take twice as much, the motor gives 14.9 N.m"),
        ({"hung": 0.3}, "hung = 0.3 N.m: friction of 0.1 N.m takes more than a quarter"),
    ],
)
def test_refusals(values: dict[str, Any], text: str) -> None:
    with pytest.raises(gb.GyrobenchError, match=text):
        gb.load(NAME, **values).run()


def test_without_shaper_is_refused() -> None:
    test = gb.load(NAME, parts=AC)
    test.set("drive.motor_shaper", 0)
    with pytest.raises(gb.GyrobenchError, match="constants of a shaper are sought"):
        test.run()


def test_inductance_of_a_quick_winding() -> None:
    """R / L = 600 1/s: the current bends within 0.1 ms.  Trapezoids err by h2/12 R (i'1 - i'0) / (L di), some 4e-4."""
    test = gb.load(NAME, coast=0.5)
    values = {"drive.motor_R": 6.0, "drive.motor_L": 0.01, "voltmeter.noise_rms": 1e-3, "ammeter.noise_rms": 1e-5}
    for name, value in values.items():
        test.set(name, value)
    result = test.run(seed=1, check_step=False).result
    assert result["L"].estimate == pytest.approx(10.0, rel=1e-4)


def test_a_voltage_that_does_not_come_to_its_limit_tells_no_inductance() -> None:
    test = gb.load(NAME, coast=0.5)
    test.set("drive.motor_U_max", 1000.0)
    result = test.run(seed=1, check_step=False).result
    assert "take a larger torque" in result["L"].no_value and abs(result["R"].z or 9.0) < 4.0
