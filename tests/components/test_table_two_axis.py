"""Kinematics of the two-axis table: attitude against SERVO2-A and scipy, rates as derivatives of the attitude."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wired import BENCH, TableRate, begun

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

TableTwoAxis = load_part("table_two_axis", BENCH)

H = 0.01
G0 = 9.80665
ERRORS = {"squareness": 0.02, "wobble": [0.03, 0.05], "wobble_order": [2, 3], "wobble_phase": [0.4, -1.1]}


def started(**values):
    return begun(TableTwoAxis, **values)


def attitude(part):
    """C with v_face = C v_local, column by column, through f."""
    kept, columns = list(part.f_local), []
    for i in range(3):
        for j in range(3):
            part.set(f"f_local[{j + 1}]", float(i == j))
        columns.append([part.get(f"f[{j + 1}]") for j in range(3)])
    for j in range(3):
        part.set(f"f_local[{j + 1}]", kept[j])
    return np.array(columns).T


def rotation(seed):
    return Rotation.random(random_state=seed).as_matrix()


def passive(axis, angle):
    return Rotation.from_rotvec(np.eye(3)[axis] * angle).as_matrix().T


# --------------------------------------------------------------------------------------------- attitude
def test_matrix_of_the_method():
    """SERVO2-A: A(theta_x, theta_y), base and face of a random mount."""
    base, face = rotation(1), rotation(2)
    for x, y in np.random.default_rng(3).uniform(-4.0, 4.0, (10, 2)):
        part = started(base=base.tolist(), face=face.tolist(), angle0=[x, y])
        cx, sx, cy, sy = math.cos(x), math.sin(x), math.cos(y), math.sin(y)
        a = np.array([[cy, sx * sy, -cx * sy], [0.0, cx, sx], [sy, -cy * sx, cx * cy]])
        assert attitude(part) == pytest.approx(face @ a @ base, abs=1e-15)


def test_two_axis_tumble_of_the_method():
    """4.6: outer axis p = y(0), inner axis x: C = R_x(n th) R_y(m th) C0; gamma = -f / g in closed form."""
    latitude = math.radians(45.75)
    c, s = math.cos(latitude), math.sin(latitude)
    pole, second, west = np.array([0.0, c, s]), np.array([0.0, -s, c]), np.array([-1.0, 0.0, 0.0])
    c0 = np.array([second, pole, west])  # rows: gyro axes x, y, z at 0
    base = np.array([pole, second, np.cross(pole, second)])  # rows: outer, inner, Z
    face = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]  # gyro x on the inner axis, y on the outer
    for theta in np.linspace(0.1, 6.0, 7):
        m, n = 5.0 * theta, theta
        part = started(base=base.tolist(), face=face, angle0=[m, n])
        assert attitude(part) == pytest.approx(passive(0, n) @ passive(1, m) @ c0, abs=1e-14)
        gamma = [
            -c * math.cos(m),
            -c * math.sin(m) * math.sin(n) - s * math.cos(n),
            -c * math.sin(m) * math.cos(n) + s * math.sin(n),
        ]
        assert [-part.get(f"f[{i + 1}]") / G0 for i in range(3)] == pytest.approx(gamma, abs=1e-14)
        earth = 7.2921159e-5 * pole
        part.set("omega_local[2]", earth[1])
        part.set("omega_local[3]", earth[2])
        assert part.get("omega[1]") == pytest.approx(0.0, abs=1e-19)  # IA stays at right angles to the pole


def test_rates_of_the_method():
    """SERVO2-KIN: w_x = x' cy + w_X cy + w_Y sx sy - w_Z cx sy, w_y = y' + w_Y cx + w_Z sx."""
    part = started(mode_x=2.0, target_x=0.3, mode_y=2.0, target_y=-0.2, omega_local=[0.01, 0.02, 0.03])
    for k in range(700):
        part.do_step(k * H, H)
    x, y = part.angle_x, part.angle_y
    assert (part.rate_x, part.rate_y) == (0.3, -0.2)
    cx, sx, cy, sy = math.cos(x), math.sin(x), math.cos(y), math.sin(y)
    assert part.omega[0] == pytest.approx(0.3 * cy + 0.01 * cy + 0.02 * sx * sy - 0.03 * cx * sy, abs=1e-16)
    assert part.omega[1] == pytest.approx(-0.2 + 0.02 * cx + 0.03 * sx, abs=1e-16)


def test_errors_against_scipy():
    """Squareness turns the inner axis about Z, the wobble of an axis turns it about its two cross axes."""
    base, face = rotation(4), rotation(5)
    for x, y in np.random.default_rng(6).uniform(-4.0, 4.0, (5, 2)):
        part = started(base=base.tolist(), face=face.tolist(), angle0=[x, y], **ERRORS)
        outer = passive(2, 0.03 * math.sin(2 * x + 0.4)) @ passive(1, 0.03 * math.cos(2 * x + 0.4))
        inner = passive(0, 0.05 * math.sin(3 * y - 1.1)) @ passive(2, 0.05 * math.cos(3 * y - 1.1))
        c = passive(1, y) @ inner @ passive(2, 0.02) @ passive(0, x) @ outer @ base
        assert attitude(part) == pytest.approx(face @ c, abs=1e-15)
    # the inner axis of a table without wobble stands 90 deg + squareness from the outer
    part = started(squareness=0.02, angle0=[0.7, 1.3])
    assert math.asin(attitude(part)[1, 0]) == pytest.approx(-0.02, abs=1e-15)


# ----------------------------------------------------------------------------------- rates are derivatives
@pytest.mark.parametrize("errors", [{}, ERRORS])
@pytest.mark.long
def test_omega_and_alpha_are_derivatives(errors):
    """C' C^T = -[omega x] with a base at rest, and d(omega)/dt = alpha with one that turns."""
    h = 1e-3
    motion = {"mode_x": 1.0, "target_x": 0.6, "mode_y": 2.0, "target_y": 0.7}
    fixed = {
        "base": rotation(7).tolist(),
        "face": rotation(8).tolist(),
        "acceleration": [0.5, 0.3],
        "index_rate": [0.4] * 2,
    }
    still = started(**motion, **fixed, **errors)
    turning = started(**motion, **fixed, **errors, omega_local=[0.3, -0.2, 0.5])
    c, w, w_all, alpha = [], [], [], []
    for k in range(3000):
        still.do_step(k * h, h)
        turning.do_step(k * h, h)
        c.append(attitude(still))
        w.append(list(still.omega))
        w_all.append(list(turning.omega))
        alpha.append(list(turning.alpha))
    c, w, w_all, alpha = (np.array(z) for z in (c, w, w_all, alpha))
    corners = [t / h for row in (still.outer_t_s, still.inner_t_s) for t in row]
    smooth = np.array([all(abs(k + 2 - t) > 2 for t in corners) for k in range(len(c) - 2)])
    rate = (c[2:] - c[:-2]) / (2.0 * h) @ c[1:-1].transpose(0, 2, 1)
    found = np.stack([rate[:, 1, 2], rate[:, 2, 0], rate[:, 0, 1]], axis=1)  # -[w x] has w_x at (y, z)
    assert abs(found - w[1:-1])[smooth].max() < 2e-6
    slope = (w_all[2:] - w_all[:-2]) / (2.0 * h)
    assert abs(slope - alpha[1:-1])[smooth].max() < 3e-6
    assert abs(w).max() > 0.5 and abs(alpha).max() > 0.5
    # the part of the base is its rate in plate axes
    assert w_all - w == pytest.approx(c @ np.array([0.3, -0.2, 0.5]), abs=1e-14)


# --------------------------------------------------------------------------------------------- motion
@pytest.mark.long
def test_each_axis_moves_as_table_rate_and_is_read_as_it():
    wrong = [
        {"encoder_amplitude": [3e-3, -2e-3], "encoder_phase": [0.4, 1.1]},
        {"encoder_amplitude": [1e-3, 4e-3], "encoder_phase": [-0.3, 2.0]},
    ]
    both = {name: [one[name] for one in wrong] for name in wrong[0]}
    commands = [(2.0, 0.2), (1.0, 1.5), (2.0, -0.3), (0.0, 0.0), (1.0, -0.2)]
    part = started(acceleration=[0.4, 0.2], index_rate=[0.1, 0.3], angle0=[0.3, -0.1], quantum=1e-4, **both)
    lone = [
        TableRate(acceleration=0.4, index_rate=0.1, angle0=0.3, quantum=1e-4, **wrong[0]),
        TableRate(acceleration=0.2, index_rate=0.3, angle0=-0.1, quantum=1e-4, **wrong[1]),
    ]
    for one in lone:
        one.initialize()
    seen = set()
    for k in range(1500):
        lone[0].mode, lone[0].target = commands[k // 300]
        lone[1].mode, lone[1].target = commands[4 - k // 300]
        part.mode_x, part.target_x, part.mode_y, part.target_y = *commands[k // 300], *commands[4 - k // 300]
        for one in (part, *lone):
            one.do_step(k * H, H)
        assert (part.angle_x, part.rate_x, part.angle_x_read) == (lone[0].angle, lone[0].rate, lone[0].angle_read)
        assert (part.angle_y, part.rate_y, part.angle_y_read) == (lone[1].angle, lone[1].rate, lone[1].angle_read)
        assert part.in_position == lone[0].in_position * lone[1].in_position
        seen.add((lone[0].in_position, lone[1].in_position))
    assert len(seen) == 4


def test_outer_axis_alone_is_table_rate():
    """Inner axis at rest: the table of one axis, with the outer axis as its third."""
    base, face, earth = rotation(9), rotation(10), [3e-5, -4e-5, 5e-5]
    swap = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])  # rows Y, Z, X: the third is the outer axis
    two = started(base=base.tolist(), face=face.tolist(), omega_local=earth, mode_x=2.0, target_x=0.3)
    one = TableRate(base=(swap @ base).tolist())
    one.face, one.omega_local, one.mode, one.target = (face @ swap.T).tolist(), earth, 2.0, 0.3
    one.initialize()
    for k in range(500):
        one.do_step(k * H, H)
        two.do_step(k * H, H)
        for name in ("omega", "alpha", "f"):
            assert getattr(two, name) == pytest.approx(getattr(one, name), abs=1e-14)


def test_inner_axis_stops_at_its_limit():
    part = started(mode_y=2.0, target_y=0.1, limits_y=[-0.5, 0.5])
    with pytest.raises(ComponentError, match=r"inner axis: 0\.50\d* rad is beyond limits_y"):
        for k in range(1000):
            part.do_step(k * H, H)
    assert part.t == pytest.approx(5.5, abs=2 * H)  # 0.5 s and 0.05 rad of start, 0.5 rad: 1 s up, then 4.5 s


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"base": [[1, 0, 0], [0, 1, 2e-9], [0, 0, 1]]}, "base is not a rotation matrix"),
        ({"base": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "base is left-handed"),
        ({"acceleration": [0.1, 0.0]}, r"acceleration\[2\] = 0 rad/s2 must be > 0"),
        ({"limits_y": [1.0, -1.0]}, "limits_y: the lower must be below the upper"),
        ({"limits_y": [0.1, 1.0]}, "angle0.* is outside limits_y"),
        ({"squareness": 0.2}, "squareness = 0.2 rad must be <= 0.1"),
        ({"wobble": [-1.0, 0.0]}, r"wobble\[1\] = -1 rad must be >= 0"),
        ({"wobble_order": [0, 1]}, r"wobble_order\[1\] = 0 1 must be >= 1"),
    ],
)
def test_refuses(parameters, message):
    with pytest.raises(ComponentError, match=message):
        started(**parameters)


@pytest.mark.parametrize(
    "inputs, message",
    [
        ({"mode_x": 3.0}, r"axis 1 \(1 outer, 2 inner\): mode = 3 must be 0 hold, 1 index or 2 rate"),
        ({"mode_y": -1.0}, r"axis 2 .*: mode = -1 must be"),
        ({"mode_y": 2.0, "target_y": 11.0}, "axis 2 .*: rate 11 rad/s exceeds its rate_max"),
        ({"mode_y": 1.0, "target_y": 1.1, "limits_y": [-1.0, 1.0]}, "target 1.1 rad is outside limits_y"),
    ],
)
def test_refuses_commands(inputs, message):
    part = started(**inputs)
    with pytest.raises(ComponentError, match=message):
        part.do_step(0.0, H)
