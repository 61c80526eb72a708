"""The linear model of a system against the co-simulation it describes, pole by pole and step by step."""

from __future__ import annotations

import math
from typing import Any

import control
import numpy as np
import pytest

from gyrobench.engine.session import Session
from gyrobench.linear.linear_model import LinearizationError, loops
from gyrobench.record.frequency_response import poles, unstable
from gyrobench.record.run_document import LinearModel
from gyrobench.reduction.loops.margins import model_response

NAME = "stabilizer_power_2dof"
STILL = {f"gyro.{n}_{c}": 0.0 for n in ("turn_on", "markov", "white", "pickoff") for c in "xy"} | {
    f"gyro.D{c}_{k}": 0.0 for c in "xy" for k in ("0", "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz")
}
SHORT = {**STILL, "hold": 1.0}


def linear(step: float = 1e-4, **values: Any) -> tuple[dict[str, Any], list[str]]:
    """What a run would write into run.json, without running."""
    from gyrobench.packaging import load_part
    from gyrobench.system.parameters import resolve

    with Session(NAME) as s:
        system = s.system.with_values({**SHORT, **values})
        _, parameters, _ = resolve(s.assembly, system, 1, s.base)
        return loops(s.assembly, parameters, lambda slot: load_part(s.names[slot]), step)


def matrices(m: dict[str, Any]) -> list[np.ndarray]:
    n = len(m.states)
    shapes = ((n, n), (n, len(m.inputs)), (len(m.outputs), n), (len(m.outputs), len(m.inputs)))
    return [np.reshape(getattr(m, k), shape) for k, shape in zip("ABCD", shapes, strict=True)]


def test_loop_of_the_power_stabilizer_by_hand() -> None:
    """L = H K_m / (s (J_x J_y s2 + (J_y C_x + J_x C_y) s + H2 + C_x C_y)) (5-20), opened at the potentiometer."""
    found, said = linear()
    f = np.geomspace(0.1, 100.0, 30)
    s = 2j * np.pi * f
    by_hand = 1000.0 / (s * (0.01 * s * s + 1.2 * s + 120.0))
    got = model_response(found.loops["stabilizer"].continuous, f)[:, 0, 0]
    np.testing.assert_allclose(got, by_hand, rtol=1e-10)
    assert not [t for t in said if "unstable" in t]


def test_closing_the_open_loop_gives_the_closed_one() -> None:
    """1 + L = 0 at the poles of the closed system: python-control's feedback has them all."""
    found, _ = linear()
    for kind in ("continuous", "discrete"):
        m = found.loops["stabilizer"].of(kind)
        closed = control.feedback(control.ss(*matrices(m), m.step), 1)
        own = np.sort_complex(np.linalg.eigvals(matrices(found.closed.of(kind))[0]))
        theirs = np.sort_complex(closed.poles())
        np.testing.assert_allclose(own, theirs, atol=1e-6 * np.max(np.abs(own)))


def test_discrete_model_is_the_co_simulation() -> None:
    """Step by step: channels of a run without noise against the model driven by the recorded excitations."""
    with Session(NAME) as s:
        system = s.system
        system.channel_period = 1e-3
        record = s.run(SHORT, step=1e-3)
    m = record.run.linear.closed.discrete
    a, b, c, d = matrices(m)
    assert m.step == 1e-3
    drive = {n: record.channels.get(n) for n in m.inputs}
    time = record.channels["time"]
    stop = int(np.flatnonzero(time > 3.0)[0])  # the load step and part of the servo torque: only torques are at work
    x = np.zeros(a.shape[0])
    rows = []
    for k in range(1, stop):
        u = np.array([0.0 if drive[n] is None else drive[n][k] for n in m.inputs])
        rows.append(c @ x + d @ u)
        x = a @ x + b @ u
    got = np.array(rows)
    for name in ("gyro.alpha", "gyro.beta", "stabilizer.e"):
        here = record.channels[name][1:stop]
        np.testing.assert_allclose(got[:, m.outputs.index(name)], here, atol=1e-9 * np.ptp(here))


def test_a_loop_that_only_its_step_makes_unstable_is_told_so() -> None:
    """K_m = 1400 of 1440 is stable; with a step of 2 ms, whose delay costs 109 h/2 rad = 6 degrees, it is not."""
    found, said = linear(step=2e-3, K_m=1400.0)
    assert not unstable(found.closed.continuous) and unstable(found.closed.discrete)
    assert any("the loop with its step of 0.002 s is unstable: pole +" in t for t in said)
    assert not any("unstable" in t for t in linear(K_m=1400.0)[1])


def test_an_unstable_loop_is_told_with_its_pole() -> None:
    """K_m = 2000: the root of 0.01 s3 + 1.2 s2 + 120 s + 20000 with the positive real part."""
    found, said = linear(K_m=2000.0, allow_unstable=True)
    root = max(np.roots([0.01, 1.2, 120.0, 20000.0]), key=lambda p: p.real)
    text = next(t for t in said if "unstable" in t)
    assert f"pole {root.real:+.4g} ± {abs(root.imag):.4g}j rad/s" in text
    assert unstable(found.closed.continuous)[0] == pytest.approx(complex(root.real, abs(root.imag)), rel=1e-9)


def test_poles_of_a_model() -> None:
    """z = exp(s h) and back; a pure delay (z = 0) is no pole of the s plane."""
    empty: dict[str, list] = {k: [] for k in ("A", "B", "C", "D", "inputs", "outputs", "states")}
    m = LinearModel(**{**empty, "A": np.diag([math.exp(-0.02), 0.0]).tolist()}, step=0.01)
    assert poles(m) == [pytest.approx(-2.0)]
    assert poles(LinearModel(**empty, step=0.0)) == []


def test_a_break_that_is_no_wired_input() -> None:
    from gyrobench.linear.linear_model import Linear, operating_point
    from gyrobench.packaging import load_part
    from gyrobench.system.parameters import resolve

    with Session(NAME) as s:
        _, parameters, _ = resolve(s.assembly, s.system.with_values(SHORT), 1, s.base)
        parts = operating_point(s.assembly, parameters, lambda slot: load_part(s.names[slot]))
        with pytest.raises(LinearizationError, match=r"break point stabilizer\.nothing: not a connected input"):
            Linear(s.assembly, parts, 1e-4).continuous("stabilizer.nothing")


def test_states_that_are_not_between_input_and_output_have_no_effect() -> None:
    """u -> x1 -> y with x1' = u - 2 x1: y/u = 1/(s + 2), 1/2 at rest.  x2' = 0 is moved by nothing, x3' = x1 seen by
    nothing; both would be divided by s = 0.
    """
    a, b, c = [[-2.0, 5.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [[1.0], [0.0], [0.0]], [[1.0, 3.0, 0.0]]
    m = LinearModel(A=a, B=b, C=c, D=[[0.0]], inputs=["u"], outputs=["y"], states=["x1", "x2", "x3"], step=0.0)
    assert model_response(m, [0.0, 1.0])[:, 0, 0] == pytest.approx([0.5, 1.0 / (2j * math.pi + 2.0)], rel=1e-14)
