"""A scheduled controller: one point is stabilizer_lti; frozen gains by scipy.signal; gains that change; refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import signal
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

H = 1e-3  # s
NUM, DEN = [2.0, 0.5, 0.01], [1.0, 0.3, 0.004]


def nine(*values: float, rest: float = 0.0) -> list[float]:
    return [*values, *[rest] * (9 - len(values))]


def started(part: str = "stabilizer_scheduled", sigma: float = 0.0, **given: Any) -> Any:
    found = load_part(part, BENCH)(form=1, num=nine(*NUM), den=nine(*DEN), **given)
    if part == "stabilizer_scheduled":
        found.schedule = sigma
    found.initialize()
    return found


def played(part: Any, u: np.ndarray) -> np.ndarray:
    y = np.zeros(u.size)
    for k, x in enumerate(u):
        part.u = float(x)
        part._dirty = True
        part.do_step(k * H, H)
        y[k] = part.v
    return y


@pytest.mark.parametrize("given", [{}, {"Ts": 2e-3, "discretize": 2}, {"conditioned": 1, "v_max": 1.0}])
def test_one_point_is_the_linear_controller_bit_for_bit(given: dict[str, float]) -> None:
    u = np.random.default_rng(1).normal(size=300)
    assert np.array_equal(played(started(**given), u), played(started("stabilizer_lti", **given), u))


@pytest.mark.parametrize("sigma, k, corner", [(-3.0, 2.0, 8.0), (1.5, 3.0, 6.0), (4.0, 5.0, 2.0), (9.0, 5.0, 2.0)])
def test_frozen_gains_are_those_of_the_table(sigma: float, k: float, corner: float) -> None:
    """at 0, 3, 4: gain 2, 4, 5, corner 8, 4, 2; at 1.5 halfway 3 and 6, beyond the ends theirs.  Held inputs: exact."""
    part = started(
        sigma=sigma, points=3, at=nine(0.0, 3.0, 4.0), gain=nine(2.0, 4.0, 5.0), corner=nine(8.0, 4.0, 2.0), v_max=1e9
    )
    assert part.scale == k and part.beyond == float(sigma < 0.0 or sigma > 4.0)
    u = np.random.default_rng(2).normal(size=200)
    num = k * np.polymul([1.0, corner], NUM[::-1])
    den = np.polymul([1.0, 0.0], DEN[::-1])
    zeros, poles, _ = signal.cont2discrete((num, den), H, "zoh")
    # the part answers at the end of a step with its input held through it: lfilter, one sample ahead of the states
    x = signal.lfilter(zeros.ravel(), poles, np.append(u, u[-1]))
    ahead = x[1:] - zeros.ravel()[0] * (np.append(u, u[-1])[1:] - u)
    assert played(part, u) == pytest.approx(-ahead, rel=1e-9, abs=1e-9)


def test_a_change_of_gain_leaves_the_voltage_of_the_integral() -> None:
    """G = 1, k = sigma, w_i = 5: 0.4 s of e = 0.1 V at k = 2, s = 2 . 5 . 0.1 . 0.4 = 0.4 V; e = 0, k = 4: v stays."""
    part = load_part("stabilizer_scheduled", BENCH)(
        points=2, at=nine(0.0, 10.0), gain=nine(0.0, 10.0), corner=nine(5.0, 5.0)
    )
    part.schedule, part.u = 2.0, 0.1
    part.initialize()
    for k in range(400):
        part.do_step(k * H, H)
    assert part.v == pytest.approx(-(2.0 * 0.1 + 0.4), rel=1e-12)
    part.schedule, part.u = 4.0, 0.0
    part.do_step(0.4, H)
    assert part.v == pytest.approx(-0.4, rel=1e-12)


def test_the_integral_waits_at_the_limit() -> None:
    part = load_part("stabilizer_scheduled", BENCH)(v_max=1.0, corner=nine(5.0, rest=0.0))
    part.u = 2.0
    part.initialize()
    for k in range(1000):
        part.do_step(k * H, H)
    assert (part.v, part.s, part.saturated) == (-1.0, 0.0, 1.0)
    part.u = 0.5
    part.do_step(1.0, H)
    assert part.v == pytest.approx(-(0.5 + 0.5 * 5.0 * H))


@pytest.mark.parametrize(
    "given, message",
    [
        ({"points": 3, "at": nine(0.0, 2.0, 2.0)}, "at does not rise: its first 3 values"),
        ({"corner": nine(1.0), "Ts": H}, "a corner takes a continuous controller, Ts = 0"),
        ({"gain": nine(-1.0)}, r"gain\[1\] = -1 1 must be >= 0"),
        ({"points": 10}, "points = 10 1 must be <= 9"),
    ],
)
def test_refuses(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ComponentError, match=message):
        started(**given)
