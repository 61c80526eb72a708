"""Three loops against the poles of the continuous ones, with motor and platform written out; limits; refusals."""

import math
from functools import partial

import control
import numpy as np
import pytest
from wired import BENCH, begun

from gyrobench.component import ComponentError
from gyrobench.linear.part_linearization import state_space
from gyrobench.packaging import load_part

ServoThreeLoop = load_part("servo_three_loop", BENCH)
H = 1e-4
R, L, K_T, J = 2.0, 4e-3, 1.0, 2.0


started = partial(begun, ServoThreeLoop)


def axis(part, seconds, *, load=0.0, h=H, command=0.0):
    """Motor and platform (i, w, theta) with held voltage, Euler's rule of 20 parts a step; rows of w, i, theta."""
    i = w = theta = 0.0
    rows = []
    for k in range(round(seconds / h)):
        part.u, part.i_motor, part.theta, part.command = part.K_u * w, i, theta, command
        part._dirty = True
        v = part.get("v")
        for _ in range(20):
            i += h / 20 * (v - R * i - K_T * w) / L
            w += h / 20 * (K_T * i + load) / J
            theta += h / 20 * w
        part.do_step(k * h, h)
        rows.append((w, i, theta))
    return np.array(rows).T


def test_open_loops_cross_where_they_should():
    """Current loop 500 Hz with 90 deg (it cancels L/R); rate loop 10 Hz, 90 - atan(2/10) - the current loop's share."""
    part = started()
    law = state_space(part, ["u", "i_motor"], ["v"])
    plant = control.ss(*[np.array(m) for m in ([[-R / L]], [[1 / L]], [[1.0]], [[0.0]])])
    _, phase, _, crossover = control.margin(-plant * law[0, 1])
    assert crossover == pytest.approx(2 * math.pi * 500, rel=1e-6)
    assert phase == pytest.approx(90.0, abs=1e-3)
    closed = control.feedback(plant, law[0, 1], sign=1)  # back EMF left out: K_t2 / J is far below
    rate = -control.tf([K_T], [J, 0.0]) * control.ss2tf(closed * law[0, 0])
    _, phase, _, crossover = control.margin(rate)
    assert crossover == pytest.approx(2 * math.pi * 10, rel=0.03)
    assert phase == pytest.approx(90.0 - math.degrees(math.atan(0.2)), abs=2.0)


@pytest.mark.long
def test_rate_command_and_load():
    """The rate follows the command; against a load the rate loop's integral leaves no rate, i = -load / K_t."""
    w, i, _ = axis(started(), 1.5, command=0.1)
    assert w[-1] == pytest.approx(0.1, rel=1e-4)
    near = np.flatnonzero(w > 0.1 * (1 - math.exp(-1)))[0] * H
    assert 0.5 / (2 * math.pi * 10) < near < 1.2 / (2 * math.pi * 10)
    w, i, _ = axis(started(), 2.0, load=5.0)
    assert abs(w[-1]) < 1e-6 and i[-1] == pytest.approx(-5.0, rel=1e-5)


@pytest.mark.long
def test_position_loop_holds_the_joint():
    """theta goes to theta_wish with the time constant 1/K_p, against a load, without error at rest."""
    part = started(K_p=2 * math.pi, theta_wish=0.02)
    _, _, theta = axis(part, 3.0, load=2.0)
    assert theta[-1] == pytest.approx(0.02, rel=1e-5)
    still = axis(started(), 1.0, load=2.0)[2]
    assert abs(still[-1]) < 0.01  # without it the joint stays where the disturbance left it: not at 0.02


def test_position_loop_is_sampled():
    """The rate asked for changes every 5 ms only; w_max limits it."""
    part = started(K_p=10.0, theta_wish=1.0, w_max=0.5)
    assert part.track == 0.5
    asked = []
    for k in range(200):
        part.theta = 0.97 + 1e-4 * k
        part.do_step(k * H, H)
        asked.append(part.track)
    changes = np.flatnonzero(np.diff(asked)) + 1
    assert changes.tolist() == [49, 99, 149, 199] and asked[49] == pytest.approx(10 * (1 - 0.97 - 49e-4))
    part = started(K_p=1.0, track_period=2.5e-4)
    with pytest.raises(ComponentError, match=r"track_period = 0.00025 s is not a multiple of the internal step"):
        part.do_step(0.0, H)


def test_limits_without_wind_up():
    part = started(i_max=1.0)
    part.u = 1.0
    for k in range(10000):
        part.do_step(k * H, H)
    assert part.i_wish == -1.0 and part.saturated == 1.0 and abs(part.q) < 1e-9
    part.i_motor = -1.0
    part._dirty = True
    part.u = -1e-3
    assert part.get("i_wish") == pytest.approx(0.12566, rel=1e-3)


@pytest.mark.parametrize("name", ["K_u", "K_w", "K_c", "i_max", "v_max", "w_max", "track_period"])
def test_refuses(name):
    with pytest.raises(ComponentError, match=f"{name} = 0 .* must be > 0"):
        started(**{name: 0.0})
