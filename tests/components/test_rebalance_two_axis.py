"""Two-axis rebalance with a cross term: the spiral of both channels, a turning case, steady readings, limit."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
import pytest
from wired import Native, Wired

from gyrobench.drift import NAMES_2DOF

Gyro = partial(Native, "gyro_2dof")
TwoAxis = partial(Native, "rebalance_two_axis")
QUIET = dict.fromkeys(("markov_x", "markov_y", "white_x", "white_y", "pickoff_x", "pickoff_y"), 0.0)
DRIFTLESS = dict.fromkeys((*NAMES_2DOF["x"], *NAMES_2DOF["y"]), 0.0)
WIRES = [
    ("gyro.u_y", "x.u"),
    ("gyro.u_x", "x.u_cross"),
    ("gyro.u_x", "y.u"),
    ("gyro.u_y", "y.u_cross"),
    ("x.i", "gyro.i_x"),
    ("y.i", "gyro.i_y"),
]
K_PHI, STEP = 20.0, 1e-4  # 1/s, s


def gyro(**parameters: Any) -> Any:
    return Gyro(**{**DRIFTLESS, **QUIET, "u_max": 1.0, **parameters})


def loop(k_q: float, K_i: float = 0.0, **parameters: Any) -> Wired:
    """Both channels with the decay K_PHI and the cross rate k_q."""
    rotor = gyro(**parameters)
    channels = {}
    for name, k, sense in (("x", rotor.k_x, 1.0), ("y", rotor.k_y, -1.0)):
        per = k * 10.0  # V/rad of both pickoffs
        channels[name] = TwoAxis(K_p=K_PHI / per, K_q=sense * k_q / per, K_i=K_i, i_max=10.0, meter=0.0)
    parts = {"gyro": rotor, **channels}
    return Wired(parts, ["gyro", "x", "y"], WIRES)


def run(bench: Wired, time: float, step: float = STEP) -> np.ndarray:
    rotor = bench.parts["gyro"]
    out = []
    for _ in range(round(time / step)):
        bench.step(step)
        out.append(complex(rotor.psi_x, rotor.psi_y))
    return np.array(out)


def push(bench: Wired, alpha: float, beta: float) -> None:
    bench.parts["gyro"].set("psi_x", alpha)
    bench.parts["gyro"].set("psi_y", beta)


@pytest.mark.parametrize("k_q", [0.0, 30.0, -12.0])
def test_the_rotor_comes_back_in_a_spiral(k_q: float) -> None:
    """alpha + j beta = z_0 exp(-(k_phi + j k_q) t)."""
    bench = loop(k_q)
    bench.step(STEP)
    push(bench, 1e-4, -5e-5)
    bench.step(STEP)  # the loop has seen it
    z = run(bench, 0.1)
    rate = np.log(z[-1] / z[0]) / (STEP * (z.size - 1))
    # one step of delay: lambda e^(lambda h) = -(k_phi + j k_q), 0.4 % here
    assert rate == pytest.approx(complex(-K_PHI, -k_q), rel=8e-3)


def test_it_takes_out_a_turning_case() -> None:
    """A case that turns about z at 3 rad/s makes alpha' = w_z beta, beta' = -w_z alpha: k_q = -3 undoes it."""
    for k_q, turned in ((0.0, -3.0), (-3.0, 0.0)):
        bench = loop(k_q)
        bench.parts["gyro"].omega = [0.0, 0.0, 3.0]
        bench.step(STEP)
        push(bench, 1e-4, 0.0)
        bench.step(STEP)
        z = run(bench, 0.1)
        assert np.angle(z[-1] / z[0]) / 0.1 == pytest.approx(turned, abs=0.03)


def test_readings_at_rest_do_not_depend_on_it() -> None:
    """With integrals both pickoffs go to null: k_x i_x = w_y, k_y i_y = w_x, whatever K_q."""
    for k_q in (0.0, 15.0):
        bench = loop(k_q, K_i=1e3)
        rotor = bench.parts["gyro"]
        rotor.omega = [2e-5, -3e-5, 0.0]
        run(bench, 3.0, 2e-3)
        assert rotor.k_x * bench.parts["x"].i_read == pytest.approx(-3e-5, rel=1e-6)
        assert rotor.k_y * bench.parts["y"].i_read == pytest.approx(2e-5, rel=1e-6)


def test_limit_holds_for_the_sum() -> None:
    part = TwoAxis(K_p=10.0, K_i=0.0, K_q=5.0, i_max=0.02, meter=0.0)
    part.initialize()
    part.u, part.u_cross = 1e-3, 1e-3
    part.do_step(0.0, 1e-3)
    assert part.i == pytest.approx(0.015) and part.saturated == 0.0
    part.u_cross = 3e-3
    part.do_step(1e-3, 1e-3)
    assert part.i == 0.02 and part.saturated == 1.0
    assert math.isclose(part.q, 1e-6, rel_tol=1e-9)  # the second step pushed further: held
