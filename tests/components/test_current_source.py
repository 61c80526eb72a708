"""The current source: ramp, exact arrival, idle outside servo mode, ammeter."""

from functools import partial

import pytest
from wired import BENCH, begun

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

CurrentSource = load_part("current_source", BENCH)
H = 1e-3


started = partial(begun, CurrentSource, meter=0.0)


def advance(part, steps, start=0):
    for k in range(steps):
        part.do_step((start + k) * H, H)


def test_ramp_and_arrival():
    """0.1 A/s: 1e-4 A a step of 1 ms; 3 mA is reached after 30 steps, to the last bit, and -3 mA 60 steps later."""
    part = started()
    part.command, part.mode = 3e-3, 3.0
    advance(part, 10)
    assert part.i == pytest.approx(1e-3, rel=1e-12)
    advance(part, 25, 10)
    assert part.i == 3e-3 and part.i_read == 3e-3
    part.command = -3e-3
    advance(part, 30, 35)
    assert part.i == pytest.approx(0.0, abs=1e-15)
    advance(part, 35, 65)
    assert part.i == -3e-3


def test_idle_outside_servo_mode():
    part = started()
    part.command, part.mode = 3e-3, 1.0
    advance(part, 10)
    assert part.i == 0.0
    part.mode = 3.0
    advance(part, 40, 10)
    part.mode = 0.0
    advance(part, 40, 50)
    assert part.i == 0.0


def test_ammeter():
    part = started(error=1e-3, slew=10.0)
    part.command, part.mode = 1e-2, 3.0
    advance(part, 2)
    assert part.i == 1e-2 and part.i_read == pytest.approx(1.001e-2, rel=1e-14)


def test_too_much_is_refused():
    part = started()
    part.command, part.mode = 0.2, 3.0
    with pytest.raises(ComponentError, match=r"0\.2 A is beyond i_max = 0\.12 A"):
        advance(part, 1)
