"""Thermostat of one to three stages: what of the room gets through, ramps, warm-up, sensors, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from native_parts import make
from scipy.integrate import solve_ivp
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.engine.session import Session
from gyrobench.packaging import build
from gyrobench.packaging.loading import load_part

Thermostat = load_part("thermostat", BENCH)
G, C, K_P, K_I, P_MAX = np.array([4.0, 2.0, 1.0]), np.array([2000.0, 1000.0, 500.0]), 50.0, 0.5, [150.0, 100.0, 60.0]
SET, TAU, ROOM = np.array([-20.0, -10.0, 0.0]), 300.0, -45.0


def through(stages: int, f: float) -> complex:
    """Instrument over room at f: all shells with what the inner ones take, solved as a linear system."""
    s, first = 2j * math.pi * f, 3 - stages
    A, b = np.zeros((3, 3), dtype=complex), np.zeros(3, dtype=complex)
    for k in range(3):
        A[k, k] = 1.0
        if k >= first:
            A[k, k] = C[k] * s + G[k] + K_P + K_I / s + (G[k + 1] if k < 2 else 0.0)
            if k > first:
                A[k, k - 1] = -G[k]
            if k < 2:
                A[k, k + 1] = -G[k + 1]
    b[first] = G[first]
    return complex(np.linalg.solve(A, b)[2] / (TAU * s + 1.0))


def driven(seconds: float, h: float, names: list[str], **values: object) -> tuple[np.ndarray, np.ndarray]:
    """Times and outputs of the native part."""
    made, rows = make("thermostat", "native"), []
    try:
        made.set(values)
        made.initialize(0.0)
        for k in range(round(seconds / h)):
            made.step(k * h, h)
            rows.append(made.get(names))
    finally:
        made.free()
    return h * np.arange(1, len(rows) + 1), np.array(rows)


@pytest.mark.parametrize("stages", [1, 2, 3])
def test_what_of_a_swinging_room_gets_through(stages: int) -> None:
    """2 K in 20 min: each stage takes its share; amplitude and phase by least squares from the last turns."""
    f = 1.0 / 1200.0
    t, y = driven(14400.0, 2.0, ["temperature"], stages=stages, swing=2.0, period=1200.0)
    late, w = t > 9600.0, 2.0 * math.pi * f
    X = np.column_stack([np.sin(w * t[late]), np.cos(w * t[late]), np.ones(late.sum())])
    a, b, mean = np.linalg.lstsq(X, y[late, 0], rcond=None)[0]
    assert complex(a, b) == pytest.approx(2.0 * through(stages, f), rel=0.02)
    assert abs(mean) < 1e-6 and abs(through(stages, f)) < 0.01 * 0.03 ** (stages - 1)


def test_slow_law_of_a_stage() -> None:
    """One stage alone: s G/(C s2 + (G + K_p) s + K_i) = G w/K_i of a day: 1 K swing leaves 0.145 mK."""
    day = 1.0 / 86400.0
    w = 2.0 * math.pi * day
    assert abs(through(1, day)) == pytest.approx(G[2] * w / K_I, rel=0.01)
    assert G[2] * w / K_I == pytest.approx(1.454e-4, rel=1e-3)
    assert abs(through(2, day)) == pytest.approx(G[1] * G[2] * (w / K_I) ** 2, rel=0.02)


@pytest.mark.parametrize(("stages", "left"), [(1, 1.111e-3), (2, 0.0)])
def test_a_room_that_warms(stages: int, left: float) -> None:
    """2 K/h: the heater must fall by G r in a second, so that e = -G r/K_i = 1.11 mK stays; a second stage takes it."""
    _, y = driven(14400.0, 5.0, ["temperature", "room"], stages=stages, ramp=2.0 / 3600.0)
    assert y[-1, 0] == pytest.approx(left, abs=2e-6) and y[-1, 1] == pytest.approx(ROOM + 8.0)


@pytest.mark.long
def test_cold_start_against_an_ode() -> None:
    """From the room's temperature, heaters at their limits at first, integrals held; scipy with the same clip."""

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        T, q, held = x[:3], x[3:6], x[6]
        e, out, d = SET - T, ROOM, np.zeros(7)
        flux = np.zeros(4)
        for k in range(3):
            flux[k], out = G[k] * (out - T[k]), T[k]
        for k in range(3):
            hold = G[k] * (SET[k] - (ROOM if k == 0 else SET[k - 1])) - (
                G[k + 1] * (SET[k + 1] - SET[k]) if k < 2 else 0
            )
            asked = hold + K_P * e[k] + K_I * q[k]
            d[k] = (min(max(asked, 0.0), P_MAX[k]) + flux[k] - flux[k + 1]) / C[k]
            d[3 + k] = 0.0 if (asked > P_MAX[k] and e[k] > 0) or (asked < 0 and e[k] < 0) else e[k]
        d[6] = (T[2] - held) / TAU
        return d

    t, y = driven(3600.0, 0.5, ["temperature", "shell[1]", "limited"], stages=3, cold=True)
    truth = solve_ivp(rate, (0.0, 3600.0), np.r_[np.full(3, ROOM), np.zeros(3), ROOM], t_eval=t[199::200], max_step=0.5,
                      rtol=1e-8)  # fmt: skip
    assert y[199::200, 0] == pytest.approx(truth.y[6], abs=0.02)
    assert y[199::200, 1] == pytest.approx(truth.y[0], abs=0.02)
    assert y[0, 2] == 1.0 and y[-1, 2] == 0.0
    assert abs(y[-1, 0]) < 0.3


def test_the_innermost_sensor_is_the_thermostat() -> None:
    """What it reads too much makes the instrument so much too cold; an outer sensor's error is taken by the stage."""
    _, y = driven(10800.0, 5.0, ["temperature"], stages=2, **{"sensor_error[3]": 0.01, "sensor_error[2]": 0.05})
    assert y[-1, 0] == pytest.approx(-0.01, abs=1e-5)
    _, y = driven(21600.0, 5.0, ["temperature"], stages=1, **{"sensor_3": 0.02, "seed": 3})
    assert 1e-5 < np.std(y[1000:, 0]) < 2e-3  # 0.02 K/sqrt(Hz) through K_p/(C s + ...) and the instrument's lag


def test_power_holds_the_set_points() -> None:
    """Outer heater: 4 (25) - 2 (10) = 80 W, then 2 (10) - 1 (10) = 10 W, then 10 W; the room has what they give."""
    _, y = driven(10.0, 1.0, ["heat[1]", "heat[2]", "heat[3]", "temperature"], stages=3)
    assert y[-1] == pytest.approx([80.0, 10.0, 10.0, 0.0], abs=1e-9)
    assert y[-1, :3].sum() == pytest.approx(G[0] * (SET[0] - ROOM))


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"offset": 5.0}, "a heater would have to cool"),
        ({"stages": 3, "set_point": [-20.0, -20.0, 0.0]}, "they rise from the room to the innermost"),
        ({"stages": 1, "power": [150.0, 100.0, 40.0]}, "or to give more than its power"),
        ({"stages": 4}, "stages"),
        ({"tau": 0.0}, "tau"),
    ],
)
def test_refusals(values: dict[str, object], text: str) -> None:
    with pytest.raises(ComponentError, match=text):
        Thermostat(**values).initialize()


@pytest.mark.long
def test_a_gyro_in_a_thermostat_drifts_less() -> None:
    """Fixed position, D_T = 0.05 deg/h/K, a room that swings by 3 K in 20 min: the record's temperature shrinks by the
    stages, and with it what the room does to the drift."""
    spread = {}
    for part in ("surroundings", "thermostat"):
        with Session("fixed_position", {"surroundings": build(part)}) as session:
            values = {"dwell": "40min", "settle": "10s", "surroundings.swing": "3K", "surroundings.period": "20min",
                      "gyro.D_T": "0.05deg/h/K"}  # fmt: skip
            record = session.run({**values, **dict.fromkeys(session.system.noises, 0.0)}, seed=1, step=5e-3)
        spread[part] = np.ptp(record.windows["temperature"]), np.ptp(record.windows["mean"])
    assert spread["surroundings"][0] > 5.0 and spread["thermostat"][0] < 2e-3
    assert spread["thermostat"][1] < 0.01 * spread["surroundings"][1]
