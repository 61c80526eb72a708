"""The linear step of parts with sampled methods: by hand, against the Riccati equation, and where there is none."""

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from gyrobench.linear.block import undelayed_of as undelayed
from gyrobench.linear.sampled_model import sampled_step
from gyrobench.packaging import load_part

H = 1e-3
MOVE = 1e-6


def started(name, **parameters):
    part = load_part(name)(**parameters)
    part.initialize()
    return part


def test_rebalance_by_hand():
    """q+ = q + h u;  flowed+ = present;  present+ = K_p u + K_i q+;  i_read = flowed, i = K_p u + K_i q."""
    found = sampled_step(started("rebalance_analog", K_p=2.0, K_i=30.0, i_max=1e3), ["u"], ["i", "i_read"], H)
    assert found.names == ["q", "present", "flowed"]
    np.testing.assert_allclose(found.a, [[1, 0, 0], [30, 0, 0], [0, 1, 0]], rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(found.b, [[H], [2 + 30 * H], [0]], rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(found.c, [[30, 0, 0], [0, 0, 1]], rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(found.d, [[2], [0]], rtol=1e-7, atol=1e-8)


def test_kalman_filter_has_its_steady_gain():
    """x+ = (I - K C) F x + K z with K of the Riccati equation."""
    q, r = 0.5, 1e-4
    found = sampled_step(started("estimator_kalman_rate", q=q, R=r, Ts=H), ["z"], ["estimate"], H)
    f, c = np.array([[1.0, H], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    p = solve_discrete_are(f.T, c.T, q * np.array([[H**3 / 3, H**2 / 2], [H**2 / 2, H]]), [[r]])
    k = p @ c.T / (p[0, 0] + r)
    at = [found.names.index(n) for n in ("x", "v")]
    np.testing.assert_allclose(found.a[np.ix_(at, at)], f - k @ c @ f, rtol=1e-6)
    np.testing.assert_allclose(found.b[at], k, rtol=1e-6)


def test_what_has_no_such_step():
    assert sampled_step(started("platform_single_axis"), ["v"], ["theta"], H) is None  # its contact carries no torque
    with pytest.raises(ValueError, match="memory"):
        sampled_step(started("estimator_moving_average", Ts=H), ["z"], ["estimate"], H)
    with pytest.raises(ValueError, match="one step is not like the next"):
        sampled_step(started("estimator_kalman_rate", Ts=2 * H), ["z"], ["estimate"], H)


def test_a_value_that_only_reports_leaves_the_part_continuous():
    """With L = 0 the platform keeps the current that flowed, which v reaches; no state takes it, only i_motor shows it.
    Its inertia is kept beside it and acts on the states, but no input reaches that."""
    part = started("platform_single_axis", L=0.0)
    assert sampled_step(part, ["v"], ["theta"], H) is None
    assert sampled_step(part, ["v"], ["theta", "i_motor"], H) is not None


def test_what_is_handed_on_a_step_later_has_a_model_without_the_delay():
    """q' = u, i = i_read = 30 q + 2 u: the current that flowed is that of now where the step is none."""
    part = started("rebalance_analog", K_p=2.0, K_i=30.0, i_max=1e3)
    a, b, c, d = undelayed(part, ["u"], ["i", "i_read"], H)
    np.testing.assert_allclose(a, [[0.0]], atol=1e-12)
    np.testing.assert_allclose(b, [[1.0]])
    np.testing.assert_allclose(c, [[30.0], [30.0]], rtol=1e-6)
    np.testing.assert_allclose(d, [[2.0], [2.0]], rtol=1e-4)  # 30 FINE H of 2 are left


def test_a_method_with_a_memory_of_its_own_has_none():
    """The filter keeps its estimate, with a sampling period; the pulse loop its integral, and rounds to clocks."""
    assert undelayed(started("estimator_kalman_rate", Ts=H), ["z"], ["estimate"], H) is None
    assert undelayed(started("rebalance_pwm"), ["u"], ["i"], H) is None


def one_column(part, name, step, kept, after):
    """Return the central difference of values after a step by a move of one, of a part that is set back before each."""
    ends = []
    for sign in (1.0, -1.0):
        part.set_state(kept)
        size = MOVE * max(1.0, abs(part.get(name)))
        part.set(name, part.get(name) + sign * size)
        part.do_step(part.t, step)
        ends.append(np.array([part.get(n) for n in after]))
    return (ends[0] - ends[1]) / (2.0 * size)


@pytest.mark.parametrize(("friction", "inductance"), [(0.0, 4e-3), (0.5, 0.0)])
def test_the_step_is_that_of_each_column_moved_alone(friction, inductance):
    """To the last bit, of a part with coupled axes, contacts that stick and currents that are handed on."""
    part = started("platform_three_axis", friction=[friction] * 3, L=[inductance] * 3, theta_0=[0.1, 0.2, 0.3])
    inputs, outputs, step = ["v[1]", "omega_b[2]", "M_load[3]"], ["omega[1]", "i_motor[1]"], 1e-4
    found, kept = sampled_step(part, inputs, outputs, step), part.get_state()
    columns = [one_column(part, n, step, kept, found.names) for n in [*found.names, *inputs]]
    part.set_state(kept)
    np.testing.assert_array_equal(np.hstack([found.a, found.b]), np.column_stack(columns))


def test_a_part_that_starts_in_another_mode_is_taken_where_it_stays():
    """The table first checks that it is slow and passes u on; then its networks are in the loop."""
    part, step = load_part("table_servo")(crossover=100.0 * np.pi, capture=0.0), 1e-4
    part.set("mode", 3.0)
    part.initialize()
    inputs, outputs = ["u", *(f"omega_local[{k}]" for k in (1, 2, 3))], ["angle"]
    whole = sampled_step(part, inputs, outputs, step)
    a, b, c, d = undelayed(part, inputs, outputs, step)
    for w in 2.0 * np.pi * np.array([3.0, 30.0]):
        z = np.exp(1j * w * step)
        by_step = whole.c @ np.linalg.solve(np.eye(len(whole.a)) - whole.a / z, whole.b) + whole.d
        plain = c @ np.linalg.solve(1j * w * np.eye(len(a)) - a, b) + d
        # u to angle; a step of 0.1 ms is 0.02 rad at 30 Hz
        np.testing.assert_allclose(plain[0, 0], by_step[0, 0], rtol=0.03)
