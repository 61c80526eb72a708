"""Disturbance observer and friction compensation: transfer functions by hand, the contact against scipy, limits."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from wired import BENCH, begun

from gyrobench.linear.part_linearization import state_space
from gyrobench.packaging import load_part

Part = load_part("stabilizer_observer", BENCH)


started = partial(begun, Part)


def test_transfer_functions() -> None:
    """d = J wo2 s/(s + wo)2 m of the rate, -k_t wo2/(s + wo)2 i of the current; v = -gain (1 + wi/s) u - R/k_t d."""
    part = started(gain=8.0, integral=3.0, observer=20.0, J=1.5, k_t=0.5, R=4.0, K_u=2.0)
    model = state_space(part, ["u", "i_motor"], ["v", "disturbance"])
    for w in (0.7, 20.0, 150.0):
        s = 1j * w
        seen, told = 1.5 * 400.0 * s / (s + 20.0) ** 2 / 2.0, -0.5 * 400.0 / (s + 20.0) ** 2
        got = np.asarray(model(s))
        assert got[1] == pytest.approx([seen, told], rel=1e-9)
        assert got[0] == pytest.approx([-8.0 * (1.0 + 3.0 / s) - 8.0 * seen, -8.0 * told], rel=1e-9)


def test_the_observer_finds_a_torque() -> None:
    """J w' = M - F, i = 0: at a constant net torque of 0.3 N.m on 2 kg.m2 the rate grows by 0.15 rad/s2; after ten time
    constants d is 0.3, from a rate that is held over each step of 1 ms.
    """
    part = started(gain=0.0, observer=20.0)
    for k in range(600):
        part.set("u", 0.15 * (k + 0.5) * 1e-3)
        part.do_step(k * 1e-3, 1e-3)
    assert part.get("disturbance") == pytest.approx(0.3, rel=2e-3)


def test_the_contact_is_that_of_the_equations() -> None:
    """F = k z, z' = v - |v| z / z_s(v), to a reversal and back, by an integrator of its own."""
    values = {"contact_coulomb": 0.2, "contact_static": 0.3, "contact_presliding": 1e-4, "contact_slip_rate": 0.01}
    part = started(gain=0.0, observer=0.0, k_t=0.5, R=4.0, share=0.5, **values)
    way, rate = (lambda t: 4e-4 * np.sin(25.0 * t)), (lambda t: 0.01 * np.cos(25.0 * t))
    level = lambda v: (0.2 + 0.1 * np.exp(-((v / 0.01) ** 2))) / 2000.0  # noqa: E731
    t = np.arange(1, 401) * 1e-3
    law = solve_ivp(
        lambda t, z: rate(t) - abs(rate(t)) * z / level(rate(t)), (0.0, 0.4), [0.0], t_eval=t, rtol=1e-9, atol=1e-12
    )
    got = []
    for k, x in enumerate(t):
        part.set("theta", way(x))
        part.do_step(k * 1e-3, 1e-3)
        got.append(part.get("compensated"))
    assert np.abs(np.array(got) - 0.5 * 2000.0 * law.y[0]).max() < 1e-3 * 0.3
    assert part.get("v") == pytest.approx(8.0 * got[-1])


def test_no_wind_up() -> None:
    part = started(gain=10.0, integral=5.0, observer=0.0)
    part.set("u", -4.0)  # 40 V: limited to 27
    for k in range(100):
        part.do_step(k * 1e-3, 1e-3)
    assert part.get("v") == 27.0 and part.get("saturated") == 1.0
    part.set("u", 0.0)
    part.do_step(0.1, 1e-3)
    assert part.get("v") == pytest.approx(0.0, abs=1e-9)
