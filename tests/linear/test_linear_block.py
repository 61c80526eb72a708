"""A part in the linear model is found once for a point, and anew for every other one."""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench.component import Component
from gyrobench.linear.block import block_of, step_of
from gyrobench.linear.part_linearization import jacobians
from gyrobench.linear.sampled_model import sampled_step
from gyrobench.packaging import load_part

H = 1e-3


def gyro(**parameters: float) -> Component:
    part = load_part("floated_gyro")("gyro", **parameters)
    part.initialize()
    part.h = H
    return part


def test_the_same_point_is_taken_again() -> None:
    first = block_of(gyro(), ["i"], ["u"], H)
    assert block_of(gyro(), ["i"], ["u"], H) is first and first.held(H) is first.held(H)
    part = gyro()
    for name in "abcd":
        np.testing.assert_array_equal(getattr(first, name), jacobians(part, ["i"], ["u"])["abcd".index(name)])


def test_another_parameter_state_port_or_step_is_another_point() -> None:
    first = block_of(gyro(), ["i"], ["u"], H)
    stiff, moved = gyro(J=3e-4), gyro()
    moved.set(moved.states[0].name, 0.1)
    for part, inputs, step in (
        (stiff, ["i"], H),
        (moved, ["i"], H),
        (gyro(), ["i", "f[1]"], H),
        (gyro(), ["i"], 2 * H),
    ):
        other = block_of(part, inputs, ["u"], step)
        assert other is not first
        np.testing.assert_array_equal(other.a, jacobians(part, inputs, ["u"])[0])
        np.testing.assert_array_equal(other.b, jacobians(part, inputs, ["u"])[1])
    assert not np.array_equal(block_of(stiff, ["i"], ["u"], H).a, first.a)
    (ad, bd), (late, _) = first.held(H), first.held(2 * H)
    np.testing.assert_allclose(ad @ ad, late, rtol=1e-9, atol=1e-12)
    assert bd.shape == first.b.shape


def test_steps_of_samples_follow_the_parameters() -> None:
    def loop(K_p: float) -> Component:
        part = load_part("rebalance_analog")("rebalance", K_p=K_p, K_i=30.0, i_max=1e3)
        part.initialize()
        return part

    found = {K_p: step_of(loop(K_p), ["u"], ["i", "i_read"], H) for K_p in (2.0, 5.0, 2.0)}
    for K_p, one in found.items():
        assert one is not None and one.d[0, 0] == pytest.approx(K_p, rel=1e-7)
        own = sampled_step(loop(K_p), ["u"], ["i", "i_read"], H)
        assert own is not None
        np.testing.assert_array_equal(one.a, own.a)
