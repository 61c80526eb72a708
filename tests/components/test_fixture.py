"""The mounts against what the tests of Hu 1981 say they see: Earth rate and gravity in instrument axes."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wired import BENCH, TableRate

from gyrobench.component import ComponentError
from gyrobench.frames import E, N, U, earth_rate_local, passive_z, polar_base, pole, tumble_faces
from gyrobench.packaging import load_part

Fixture = load_part("fixture", BENCH)
LATITUDE = math.radians(45.75)
C, S = math.cos(LATITUDE), math.sin(LATITUDE)
NAMES = [row[0] for row in vars(__import__("sys").modules[Fixture.__module__])["MOUNTS"]]


def number(name):
    return 1.0 + NAMES.index(name)


def matrix(name, **parameters):
    """The matrix from face to instrument axes, from unit vectors through all three ports."""
    part = Fixture(latitude=LATITUDE, **parameters)
    part.mount = number(name)
    part.initialize()
    columns = []
    for v in np.eye(3):
        part.omega_face, part.alpha_face, part.f_face = v.tolist(), (2.0 * v).tolist(), (-3.0 * v).tolist()
        part.do_step(0.0, 1e-3)
        assert np.array(part.alpha) == pytest.approx(2.0 * np.array(part.omega), abs=1e-15)
        assert np.array(part.f) == pytest.approx(-3.0 * np.array(part.omega), abs=1e-15)
        columns.append(list(part.omega))
    return np.transpose(columns)


def seen(name, base, angle):
    """(specific force in the sign of Hu 1981 over g, Earth rate over W) in instrument axes, the table at ``angle``."""
    m = matrix(name, base=base.tolist()) @ passive_z(angle) @ base
    return m @ -U, m @ pole(LATITUDE)


def test_every_mount_is_a_rotation_and_has_a_name_of_its_own():
    assert len(NAMES) == len(set(NAMES)) == 49
    for name in NAMES:
        m = matrix(name)
        assert m @ m.T == pytest.approx(np.eye(3), abs=1e-15)
        assert np.linalg.det(m) == pytest.approx(1.0, abs=1e-14)
    readme = (BENCH / "components/fixture/README.md").read_text(encoding="utf-8")
    for name in NAMES:
        assert f"| {number(name):.0f} | {name} |" in readme


def test_the_first_mount_is_none():
    assert (matrix("two-axis 1") == np.eye(3)).all()


# appendix 2 of ch. 3: Earth rate along the table's base axes, over W  [APP2]
TWELVE = [
    (0, C, S),
    (0, S, -C),
    (C, 0, -S),
    (C, S, 0),
    (0, 1, 0),
    (0, 0, -1),
    (S, C, 0),
    (S, 0, C),
    (1, 0, 0),
    (1, 0, 0),
    (0, 0, 1),
    (0, 1, 0),
]


@pytest.mark.parametrize("k", range(12))
def test_twelve_mounts_of_the_two_axis_table(k):
    assert seen(f"two-axis {k + 1}", np.eye(3), 0.0)[1] == pytest.approx(TWELVE[k], abs=1e-15)


EIGHT = [(E, N, U), (N, -E, U), (-E, -N, U), (-N, E, U), (U, E, N), (-E, U, N), (-U, -E, N), (E, -U, N)]


@pytest.mark.parametrize("k", range(8))
def test_eight_positions(k):
    assert matrix(f"eight positions {k + 1}") == pytest.approx(np.array(EIGHT[k]), abs=0.0)


def test_tumble_attitudes_are_those_of_the_bench():
    base = polar_base(LATITUDE)
    for name, face in tumble_faces(LATITUDE).items():
        assert matrix(f"tumble {name}", base=base.tolist()) == pytest.approx(face, abs=1e-15)


# specific force (sign of Hu 1981, over g) at its angle theta = -table angle, table axis on the pole [TUM1-GEOM]
TUMBLES = {
    "tumble mount 1": lambda c, s: (-C * s, -S, -C * c),  # 4.3
    "tumble mount 2": lambda c, s: (-C * s, S, C * c),
    "tumble 2DOF A 1": lambda c, s: (C * c, C * s, -S),  # 4.4
    "tumble 2DOF A 2": lambda c, s: (C * c, -C * s, S),
    "tumble 2DOF B 1": lambda c, s: (C * s, -C * c, -S),  # 4.5
    "tumble 2DOF B 2": lambda c, s: (C * s, C * c, S),
}


@pytest.mark.parametrize("name", TUMBLES)
@pytest.mark.parametrize("theta", [0.0, 0.7, 2.5])
def test_tumbles(name, theta):
    gamma, rate = seen(name, polar_base(LATITUDE), -theta)
    assert gamma == pytest.approx(TUMBLES[name](math.cos(theta), math.sin(theta)), abs=1e-14)
    assert rate[0] == pytest.approx(0.0, abs=1e-14)  # the measured axis is perpendicular to the pole


@pytest.mark.parametrize("theta", [0.0, 0.7, 2.5])
def test_polar_servo(theta):
    """5.4: theta right-handed about x, which lies along -pole (S) or +pole (N)."""
    c, s = math.cos(theta), math.sin(theta)
    gamma, rate = seen("polar servo S", polar_base(LATITUDE), -theta)
    assert gamma == pytest.approx([S, C * s, C * c], abs=1e-14)
    assert rate == pytest.approx([-1.0, 0.0, 0.0], abs=1e-14)
    gamma, rate = seen("polar servo N", polar_base(LATITUDE), theta)
    assert gamma == pytest.approx([-S, -C * s, -C * c], abs=1e-14)
    assert rate == pytest.approx([1.0, 0.0, 0.0], abs=1e-14)


def test_two_axis_tumble_and_static_servo_mounts():
    assert seen("two-axis tumble", np.eye(3), 0.0)[0] == pytest.approx([-C, -S, 0.0], abs=1e-15)  # 4.6 at theta 0
    for way, sign in (("down", 1.0), ("up", -1.0)):  # 5.1
        gamma, rate = seen(f"servo x {way}", np.eye(3), 0.0)
        assert (gamma[0], rate[0]) == (sign, pytest.approx(-sign * S, abs=1e-15))
    for to, earth in (("east", 0.0), ("north", C), ("west", 0.0), ("south", -C)):  # 5.2
        for turn, wanted in (("y up", (0, -1, 0)), ("y down", (0, 1, 0)), ("z down", (0, 0, 1)), ("z up", (0, 0, -1))):
            gamma, rate = seen(f"servo x {to}, {turn}", np.eye(3), 0.0)
            assert gamma.tolist() == list(wanted)
            assert rate[0] == pytest.approx(earth, abs=1e-15)


@pytest.mark.parametrize("theta", [0.0, 0.7, 2.5])
def test_accelerometer_multi_point(theta):
    """4.8: table axis north, x rises with theta = -table angle; a = two-axis 1, b = tumble static 4."""
    base = np.array([U, E, N])
    c, s = math.cos(theta), math.sin(theta)
    assert seen("two-axis 1", base, -theta)[0] == pytest.approx([-s, 0.0, -c], abs=1e-15)
    assert seen("tumble static 4", base, -theta)[0] == pytest.approx([-s, c, 0.0], abs=1e-15)


def test_behind_the_table():
    """Table and fixture in a row: the instrument sees Earth rate, table rate and gravity as to_face has them."""
    base = polar_base(LATITUDE)
    table = TableRate(base=base.tolist(), angle0=0.4)
    table.omega_local, table.f_local = earth_rate_local(LATITUDE).tolist(), [0.0, 0.0, 9.8]
    table.initialize()
    part = Fixture(latitude=LATITUDE, base=base.tolist())
    part.mount, part.omega_face, part.f_face = number("tumble mount 2"), table.omega, table.f
    part.initialize()
    m = tumble_faces(LATITUDE)["mount 2"] @ passive_z(0.4) @ base
    assert part.omega == pytest.approx(m @ earth_rate_local(LATITUDE), abs=1e-19)
    assert part.f == pytest.approx(m @ [0.0, 0.0, 9.8], abs=1e-14)


def test_misalignment():
    a = [0.01, -0.02, 0.03]
    nominal, turned = matrix("tumble mount 1"), matrix("tumble mount 1", misalignment=a)
    # turned about x, then about the new y, then about the new z: intrinsic; passive: the transpose
    wanted = Rotation.from_euler("XYZ", a).as_matrix().T @ nominal
    assert turned == pytest.approx(wanted, abs=1e-15)
    small = [1e-6, -2e-6, 3e-6]
    v = np.array([1.0, 2.0, 3.0])
    found = matrix("two-axis 1", misalignment=small) @ v
    assert found == pytest.approx(v - np.cross(small, v), abs=1e-10)


def test_a_change_of_mount_shows_at_once_and_mounts_can_be_replaced():
    part = Fixture(mounts=[[-1, 3]] * 49)
    part.f_face = [1.0, 2.0, 3.0]
    part.initialize()
    assert part.f == [-1.0, 3.0, 2.0]  # west, up, north: z = -E x U = N
    part = Fixture()
    part.f_face = [1.0, 2.0, 3.0]
    part.initialize()
    assert part.f == [1.0, 2.0, 3.0]
    part.set("mount", number("eight positions 2"))
    assert [part.get(f"f[{k}]") for k in (1, 2, 3)] == [2.0, -1.0, 3.0]


@pytest.mark.parametrize("mount", [0.0, 50.0, 1.5, -1.0])
def test_refuses_a_mount_that_is_none(mount):
    part = Fixture()
    part.mount = mount
    with pytest.raises(ComponentError, match=f"mount = {mount:g} must be a whole number from 1 to 49"):
        part.initialize()


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"base": [[1, 0, 0], [0, 1, 2e-9], [0, 0, 1]]}, "base is not a rotation matrix"),
        ({"base": [[1, 0, 0], [0, 0, 1], [0, 1, 0]]}, "base is left-handed"),
        ({"mounts": [[1, 2]] * 48 + [[2, -2]]}, "mounts: x and y of a mount must be two directions at right angles"),
        ({"mounts": [[1, 2]] * 48 + [[2, 4]]}, "mounts: x and y of a mount"),
        ({"mounts": [[0, 2]] + [[1, 2]] * 48}, "mounts: x and y of a mount"),
        ({"mounts": [[6, 2]] + [[1, 2]] * 48}, r"mounts\[1,1\] = 6 1 must be <= 5"),
        ({"latitude": 1.6}, "latitude = 1.6 rad must be <= 1.5708"),
        ({"misalignment": [0.0, 0.2, 0.0]}, r"misalignment\[2\] = 0.2 rad must be <= 0.1"),
    ],
)
def test_refuses(parameters, message):
    part = Fixture(**parameters)
    with pytest.raises(ComponentError, match=message):
        part.initialize()
