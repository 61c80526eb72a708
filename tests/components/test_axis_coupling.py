"""Secant gain, common readiness and the stop before gimbal lock."""

import math

import pytest
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

AxisCoupling = load_part("axis_coupling", BENCH)


def seen(**inputs):
    part = AxisCoupling(**inputs.pop("parameters", {}))
    part.initialize()
    for name, value in inputs.items():
        setattr(part, name, value)
    part.do_step(0.0, 1e-3)
    return part


@pytest.mark.parametrize("degrees", [0.0, 60.0, -60.0, 78.0, 180.0])
def test_gain_is_the_secant(degrees):
    # 60 degrees: twice; 180 degrees: the plate is upside down, the sign turns with the cosine
    part = seen(u=3e-3, angle=math.radians(degrees))
    assert part.u_outer == pytest.approx(3e-3 / math.cos(math.radians(degrees)), rel=1e-15)


@pytest.mark.parametrize(("x", "y"), [(0, 0), (0, 1), (1, 0), (1, 1)])
def test_in_position_when_both_are(x, y):
    assert seen(ready_x=float(x), ready_y=float(y)).in_position == x * y


def test_stops_before_gimbal_lock():
    # acos 0.2 = 78.46 degrees
    assert seen(u=1e-3, angle=math.radians(78.4)).u_outer > 0.0
    for angle in (78.5, -78.5, 90.0, 101.0):
        with pytest.raises(ComponentError, match="gimbal lock: inner angle"):
            seen(angle=math.radians(angle))
    with pytest.raises(ComponentError, match="gimbal lock"):
        seen(angle=math.radians(50.0), parameters={"least": 0.7})
    with pytest.raises(ComponentError, match="angle"):
        seen(angle=math.nan)
