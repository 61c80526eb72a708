"""The double loop: both loops by hand, integral without wind-up, tachometer errors, the linear model of the part."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest
from wired import BENCH, begun

from gyrobench.linear.part_linearization import state_space
from gyrobench.packaging import load_part

Part = load_part("stabilizer_double_loop", BENCH)


started = partial(begun, Part)


def test_by_hand() -> None:
    """w = -5 (0.01 + 0.002) = -0.06 rad/s; v = 100 (-0.06 - 0.1 * 1.02) = -16.2 V."""
    part = started(K_p=5.0, K_v=100.0, tacho_scale_error=0.02)
    part.u, part.test, part.rate = 0.01, 0.002, 0.1
    part._dirty = True
    assert part.get("wished") == pytest.approx(-0.06) and part.get("e") == pytest.approx(0.012)
    assert part.get("v") == pytest.approx(-16.2) and part.get("saturated") == 0.0


def test_transfer_functions() -> None:
    """From u: -K_v K_p (1 + wi/s); from the rate: -K_v."""
    part = state_space(started(K_p=5.0, K_v=100.0, integral=3.0), ["u", "rate"], ["v"])
    for w in (0.5, 3.0, 40.0):
        got = np.asarray(part(1j * w)).ravel()
        assert got[0] == pytest.approx(-500.0 * (1.0 + 3.0 / (1j * w)), rel=1e-9)
        assert got[1] == pytest.approx(-100.0, rel=1e-9)


def test_integral_is_exact_and_waits_at_a_limit() -> None:
    part = started(K_p=5.0, K_v=100.0, integral=2.0)
    part.u = 0.01
    for k in range(50):
        part.do_step(k * 0.01, 0.01)
    assert part.get("q") == pytest.approx(2.0 * 0.01 * 0.5, rel=1e-9)  # integral * e * t
    part.u = 1.0  # 5 rad/s wished, more than w_max: q waits
    before = part.get("q")
    for k in range(50, 80):
        part.do_step(k * 0.01, 0.01)
    assert part.get("q") == before and part.get("wished") == -1.0 and part.get("v") == -27.0
    assert part.get("saturated") == 1.0
    part.u = -0.02  # out of the limit it goes on
    part.do_step(0.8, 0.01)
    assert part.get("q") == pytest.approx(before - 2.0 * 0.02 * 0.01, rel=1e-9)


def test_ripple_of_the_tachometer() -> None:
    part = started(K_p=0.0, K_v=10.0, tacho_ripple=0.1, tacho_cycles=4)
    part.rate, part.theta = 0.5, math.pi / 8.0
    part._dirty = True
    assert part.get("v") == pytest.approx(-10.0 * 0.5 * 1.1)
