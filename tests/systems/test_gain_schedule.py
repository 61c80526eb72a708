"""A gain schedule holds the bandwidth of a gimbal's outer axis over the inner joint angle."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest
from support.gimbal_rides import RIDE

from gyrobench.engine.session import Session
from gyrobench.linear.crossovers import crossovers

NODES = [math.radians(7.5 * k) for k in range(9)]
#: kg.m2 of the inner gimbal: a long payload, which the outer axis turns at 60 degrees with 2.45 times as much inertia
I_X, I_Y, I_Z, MOTOR_AND_OUTER = 0.17, 0.2, 0.045, 0.035
GIMBAL = RIDE | {
    "platform.I_inner[1,1]": I_X, "platform.I_inner[2,2]": I_Y, "platform.I_inner[3,3]": I_Z,
    "decoupler.theta_max": 1e-3,  # no secant: that is for the schedule
    "platform.i_max[2]": 200.0, "platform.v_max[2]": 400.0,  # room for the test sines
}  # fmt: skip


def inertia(theta: float) -> float:
    """Return that about the outer axis, by hand: J + A33 + sin2 B22 + cos2 B33 of GIMBAL-2AXIS."""
    return MOTOR_AND_OUTER + math.sin(theta) ** 2 * I_Y + math.cos(theta) ** 2 * I_Z


def gain(theta: float) -> float:
    return inertia(theta) / inertia(0.0) / math.cos(theta)


@pytest.fixture(scope="module")
def sessions() -> Iterator[tuple[Session, Session, dict[str, Any]]]:
    """Yield a session with fixed gains, one with scheduled ones, and the values: those of the design at 0."""
    with (
        Session("gimbal_stabilization") as fixed,
        Session("gimbal_stabilization", {"yaw": "stabilizer_scheduled"}) as own,
    ):
        yaw = {n: fixed.prepare(GIMBAL)[2].parameters[f"yaw.{n}"] for n in ("num", "den")}
        yield fixed, own, GIMBAL | {f"yaw.{n}[{k}]": x for n, row in yaw.items() for k, x in enumerate(row, 1)}


def table(nodes: list[float]) -> dict[str, float]:
    found: dict[str, float] = {"yaw.points": len(nodes)}
    for k, theta in enumerate(nodes, 1):
        found |= {f"yaw.at[{k}]": theta, f"yaw.gain[{k}]": gain(theta)}
    return found


def crossed(session: Session, values: dict[str, Any], degrees: float) -> tuple[float, float]:
    """Return crossover (Hz) and phase margin (deg) of the linear loop of the outer axis at an inner angle."""
    models = session.prepare(values | {"pitch": math.radians(degrees)})[2].linear
    assert models is not None and models.loops["yaw"].discrete is not None
    (found,) = crossovers(models.loops["yaw"].discrete, 12.0)
    return found


@pytest.mark.long
def test_bandwidth_is_constant_over_the_schedule(sessions: tuple[Session, Session, dict[str, Any]]) -> None:
    """Fixed gains: the loop gain falls to cos 60 / 2.45 = 0.204, the crossover with it; scheduled: not."""
    fixed, own, values = sessions
    ratio = gain(NODES[-1])
    assert ratio == pytest.approx(2.0 * 0.19625 / 0.08)
    nominal, margin = crossed(fixed, values, 0.0)
    assert nominal == pytest.approx(12.0, rel=0.01)
    assert crossed(fixed, values, 60.0)[0] == pytest.approx(nominal / ratio, rel=0.15)  # the integral bends |L|
    for degrees in (0.0, 26.25, 48.75, 60.0):
        f, pm = crossed(own, values | table(NODES), degrees)
        assert f == pytest.approx(nominal, rel=0.015) and pm == pytest.approx(margin, abs=0.5), degrees
    # chords of the convex k: 15 degrees apart they lie above it by its second derivative, half as far a quarter of that
    coarse = crossed(own, values | table(NODES[::2]), 52.5)[0] / nominal - 1.0
    fine = crossed(own, values | table(NODES), 48.75)[0] / nominal - 1.0
    assert 0.04 < coarse < 0.07 and 0.0 < fine < 0.5 * coarse


@pytest.mark.long
def test_measured_margin_within_the_schedule(sessions: tuple[Session, Session, dict[str, Any]]) -> None:
    """Test sines in co-simulation, 52.5 degrees and the 0.07 that it drifts: those of the linear loop."""
    _, own, values = sessions
    values = values | table(NODES) | {"pitch": math.radians(52.5), "sweeps": True, "ride": 36.0, "psd": "none"}
    system, *_ = own.prepare(values)
    result = system.reduce(own.run(values, seed=1))
    f, pm = crossed(own, values, 52.57)
    for name, linear in (("f_c yaw", f), ("PM yaw", pm)):
        c = result[name]
        assert abs(c.estimate - linear) < c.k * c.u + 1e-3 * linear, name
    assert result["f_c yaw"].estimate == pytest.approx(12.04, abs=0.06)
