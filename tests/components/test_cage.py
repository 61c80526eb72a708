"""Caging: the float follows, stands off by rate over gain, and is let go in servo mode."""

import math

import pytest
from wired import BENCH, DEG_H, NO_DRIFT, QUIET, FloatedGyro, Wired

from gyrobench.packaging import load_part

Cage = load_part("cage", BENCH)
WIRES = [("gyro.u", "cage.u"), ("cage.i", "gyro.i")]
GAIN = 10.0 * 17.2e3 * DEG_H * 120.0  # (H / C) K_sg k K_p with H = C, 1/s


def caged(h=1e-3, **cage):
    parts = {"gyro": FloatedGyro(**QUIET, **NO_DRIFT), "cage": Cage(**cage)}
    return Wired(parts, ["gyro", "cage"], WIRES), h


def advance(bench, h, steps):
    for _ in range(steps):
        bench.step(h)
    return bench.parts["gyro"], bench.parts["cage"]


def test_float_stands_off_by_rate_over_gain():
    # b' = w - GAIN b: after 20 time constants b = w / GAIN, and k i = w
    bench, h = caged()
    w = 7.292e-5
    bench.parts["gyro"].omega[0] = w
    gyro, cage = advance(bench, h, 200)
    assert abs(GAIN - 100.07) < 0.01
    assert gyro.b == pytest.approx(w / GAIN, rel=1e-6)
    assert gyro.k * cage.i == pytest.approx(w, rel=1e-6)
    assert cage.saturated == 0.0


def test_let_go_in_servo_mode():
    # torquer idle: the float integrates, b' = w (H = C), after a delay of J / C = 1 ms
    bench, h = caged()
    w = 7.292e-5
    bench.parts["gyro"].omega[0] = w
    advance(bench, h, 200)
    bench.parts["cage"].mode = 3.0
    gyro, cage = advance(bench, h, 1)
    assert cage.i == 0.0
    before = gyro.b
    gyro, _ = advance(bench, h, 1000)
    assert gyro.b - before == pytest.approx(w * 1.0, rel=2e-3)


def test_limit():
    part = Cage(i_max=0.02)
    part.initialize()
    part.u = 1e-3
    part.do_step(0.0, 1e-3)
    assert part.i == 0.02 and part.saturated == 1.0
    part.u = -1e-4
    part.do_step(1e-3, 1e-3)
    assert math.isclose(part.i, -0.012) and part.saturated == 0.0
