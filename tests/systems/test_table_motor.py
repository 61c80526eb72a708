"""Motor of a table: constants drawn at random come back; one run of each motor, and refusals."""

from __future__ import annotations

import importlib
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import integrate

import gyrobench as gb
from gyrobench.result import LoopResult
from gyrobench.system.system import load_system

NAME = "table_motor_test"
reduction: Any = importlib.import_module(".reduction", type(load_system(NAME)).__module__)
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


@pytest.mark.long
def test_constants_come_back(run: gb.Run) -> None:
    """All within 3.5 u of what was drawn, and u a small part of them."""
    names = {c.name for c in run.result.coefficients}
    axis = {"J", "D", "M_C", "M_0", "c"}
    assert names in ({"K_t", "K_e", "R", "L"} | axis, {"K", "K_e", "K_s", "U_0", "lag"} | axis)
    for c in run.result.coefficients:
        truth = 0.0 if c.name == "M_0" else c.truth
        assert truth is not None and abs(c.estimate - truth) < 3.5 * c.u, c.name
        if c.name not in ("D", "M_C", "M_0", "c", "K_e", "U_0"):
            assert c.u < 0.01 * c.estimate, c.name


@pytest.mark.long
def test_hung_torque_is_the_standard(run: gb.Run) -> None:
    """A stated 1 % of the hung torque is 1 % of all torques and of J, and nothing of the winding or the lag."""
    record = run.record
    before = {c.name: c for c in run.result.coefficients}
    record.run.options["u_hung"] = 0.01
    result = load_system(NAME).reduce(record)
    record.run.options["u_hung"] = 0.0
    for c in result.coefficients:
        alone = before[c.name].u
        if c.name in ("K_t", "K", "J", "D", "M_C", "M_0", "c"):
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


def with_values(values: dict[str, Any], seed: int = 11) -> gb.Run:
    test = gb.load(NAME)
    for name, value in values.items():
        test.set(name, value)
    return test.run(seed=seed, check_step=False)


@pytest.mark.long
def test_a_cable_is_told_from_the_inertia() -> None:
    """0.05 N.m/rad about 1 rad, so 0.05 N.m at the angle 0.  Without c in the model J is 44 u and K_t 27 u off."""
    result = with_values({"body.axis_cable": 0.05, "body.axis_cable_zero": "1rad"}).result
    for c in result.coefficients:
        truth = 0.05 if c.name == "M_0" else c.truth
        assert truth is not None and abs(c.estimate - truth) < 3.5 * c.u, c.name
    assert result["c"].estimate == pytest.approx(0.05, abs=3.5 * result["c"].u) and result["c"].u < 1e-3
    assert not any("leaves holds" in w for w in result.warnings)


@pytest.mark.long
def test_a_torque_that_the_model_lacks_is_named() -> None:
    """0.05 kg.m on an axis tilted by 1 deg: 0.05 * 9.8066 * sin(1 deg) = 8.56e-3 N.m once a turn."""
    values: dict[str, Any] = {"body.axis_unbalance[1]": 0.05, "body.tilt[1]": "1deg"}
    run = with_values(values)
    result = run.result
    assert isinstance(result, LoopResult)
    said = [w for w in result.warnings if "torque once a turn, 0.008" in w]
    assert len(said) == 1 and "Balance the table" in said[0]
    rows = next(t.rows for t in result.tables if t.kind == "motor.left_out")
    assert rows[0][0] == "torque once a turn" and rows[0][1] == pytest.approx(8.56e-3, abs=4.0 * rows[0][2])
    judged = load_system(NAME).reduce(run.record, {"K_t": (2.0, 4.0)})
    assert judged["K_t"].verdict == "inconclusive"


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


@pytest.mark.long
def test_inductance_of_a_quick_winding() -> None:
    """R / L = 600 1/s: the current bends within 0.1 ms.  Trapezoids err by h2/12 R (i'1 - i'0) / (L di), some 4e-4."""
    test = gb.load(NAME, coast=0.5)
    values = {"drive.motor_R": 6.0, "drive.motor_L": 0.01, "voltmeter.noise_rms": 1e-3, "ammeter.noise_rms": 1e-5}
    for name, value in values.items():
        test.set(name, value)
    result = test.run(seed=1, check_step=False).result
    assert result["L"].estimate == pytest.approx(10.0, rel=1e-4)


@pytest.mark.long
def test_a_voltage_that_does_not_come_to_its_limit_tells_no_inductance() -> None:
    test = gb.load(NAME, coast=0.5)
    test.set("drive.motor_U_max", 1000.0)
    result = test.run(seed=1, check_step=False).result
    assert "take a larger torque" in result["L"].no_value and abs(result["R"].z or 9.0) < 4.0


# ------------------------------------------------------------------------- noise of torque, angle and meters
J, K_T, DENSITY, ANGLE_ERROR, METER = 2.5, 3.0, 2e-4, 4e-7, 1e-3
M_0, CABLE = 0.02, 0.01
SAMPLES, PIECES, PHASES = 20, 60, 8  # of a piece, of a phase, of the record


def windows(rng: np.random.Generator) -> list[Any]:
    """Phases of one torque each: half motor, half hung; random torque integrated in fine steps, angles with errors."""
    T, m = reduction.PIECE, SAMPLES
    dt = T / m
    offset = np.arange(-m, m + 1)
    found = []
    for phase in range(PHASES):
        motor, hung = ((4.0, -2.0, 2.0, -4.0)[phase // 2], 0.0) if phase % 2 else (0.0, (1.0, -1.0)[phase // 2 % 2])
        rate = rng.uniform(0.2, 1.0) * (1.0, 1.0, -1.0, -1.0, -1.0, 1.0, 1.0, -1.0)[phase]
        known = motor + hung - 0.03 * rate - 0.1 * math.copysign(1.0, rate)
        kicks = DENSITY / math.sqrt(dt) * rng.normal(size=PIECES * m) / J * dt
        x = np.concatenate([[0.0], np.cumsum(np.cumsum(kicks))]) * dt  # in the middle of what a kick does to the angle
        x[::m] += ANGLE_ERROR * rng.normal(size=PIECES + 1)
        current = motor / K_T + METER * rng.normal(size=PIECES * m + 1)
        for place, k in enumerate(range(m, PIECES * m, m)):
            y = float(x[k + m] - 2.0 * x[k] + x[k - m]) + known * T**2 / J
            part = current[k - m : k + m + 1]
            angle = rate * (k + offset) * dt
            y += (M_0 - CABLE * angle[m]) * T**2 / J
            found.append(
                reduction.Window(phase, place, y, angle, np.full(2 * m + 1, rate), rate * T**2, part, part,
                                 (m - np.abs(offset)) * dt * dt, motor, hung)
            )  # fmt: skip
    return found


@pytest.fixture(scope="module")
def solved() -> list[Any]:
    """What is found in 60 records with nothing left out."""
    rng = np.random.default_rng(3)
    return [reduction.solve(windows(rng), reduction.QUANTUM, reduction._wound) for _ in range(60)]


@pytest.mark.long
def test_u_is_the_scatter_of_the_errors_where_angles_and_meter_are_the_noise(solved: list[Any]) -> None:
    """Random torque makes 2 T3/3 (2e-4/2.5)2, the angles 6 (4e-7)2, the ammeter 2 T3/3 2.5e-3 s (3 1e-3/2.5)2 of the
    variance of y: 5.3e-13, 9.6e-13 and 3.0e-13.  With angles that err by their rounding alone, 3.8e-13, and all
    the rest taken for torque u is 1.3 to 1.5 times as large.
    """
    truth = np.array([K_T, 1.0, 0.03, 0.1, M_0, CABLE]) / J
    z = np.array([(f.value - truth) / np.sqrt(np.diag(f.covariance)) for f in solved])
    assert np.sqrt(np.mean(z**2, axis=0)) == pytest.approx(np.ones(6), abs=0.25)
    assert np.mean([f.torque_density for f in solved]) == pytest.approx(DENSITY, rel=0.05)
    assert np.mean([f.angle_error for f in solved]) == pytest.approx(ANGLE_ERROR, rel=0.05)


def test_an_angle_errs_by_its_rounding_at_least() -> None:
    """Angles without errors: what is estimated is q/sqrt(12), not less."""
    ideal = windows(np.random.default_rng(4))
    found = reduction.solve(ideal, 10.0 * ANGLE_ERROR * math.sqrt(12.0), reduction._wound)
    assert found.angle_error == pytest.approx(10.0 * ANGLE_ERROR)


@pytest.mark.long
def test_terms_that_are_not_there_are_found_by_chance_only(solved: list[Any]) -> None:
    """60 records with nothing left out: p is uniform, the smallest of 120 rarely below 1e-3; one with w |w|."""
    p = [s.p for f in solved for s in f.left_out]
    assert 0.35 < np.mean(p) < 0.65 and min(p) > 1e-4

    square = windows(np.random.default_rng(5))
    for k, w in enumerate(square):
        square[k] = replace(w, y=w.y - 0.02 * float(w.rate[0] * abs(w.rate[0])) * reduction.PIECE**2 / J)
    first = reduction.solve(square, reduction.QUANTUM, reduction._wound).left_out[0]
    assert first.term.meaning.startswith("drag with the square") and first.p < 1e-3
    assert first.size == pytest.approx(0.02, abs=4.0 * first.u)


@pytest.mark.parametrize("voltage", [0.0, 0.05, -0.3, 2.0])
def test_noise_of_a_voltmeter_is_not_in_the_mean_of_the_square(voltage: float) -> None:
    """Mean of V |V| over normal errors of 0.2 V, by quadrature: the regressor is V |V| of what is measured."""
    s, m = 0.2, SAMPLES
    normal = lambda e: math.exp(-0.5 * (e / s) ** 2) / (s * math.sqrt(2.0 * math.pi))  # noqa: E731
    mean, _ = integrate.quad(lambda e: (voltage + e) * abs(voltage + e) * normal(e), -2.0, 2.0, points=[-voltage])
    weight = np.full(2 * m + 1, 1.0)
    none = np.zeros(2 * m + 1)
    w = reduction.Window(1, 0, 0.0, none, none, 0.0, np.full(2 * m + 1, voltage), none, weight, 1.0, 0.0)
    without, _, slope = reduction._square_law(w, 0.0, 0.0)
    taken, _, _ = reduction._square_law(w, 0.0, s)
    assert without - taken == pytest.approx(weight.sum() * (mean - voltage * abs(voltage)), abs=1e-9)
    assert slope == pytest.approx(2.0 * abs(voltage))
