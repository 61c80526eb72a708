"""The decouplers: T2 inverts T1 exactly, as a resolver with its errors, its limit, and what the loop gains by it."""

import math
import sys
from fractions import Fraction

import numpy as np
import pytest
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

T2 = load_part("decoupler_t2", BENCH)
MODULE = sys.modules[T2.__module__]  # now: who loads the part again gets another
Off = load_part("decoupler_none", BENCH)


def matrix(part, pitch=0.0, roll=0.0, azimuth=0.0):
    """The part's matrix from u to u_axes at these angles."""
    part.initialize()
    part.theta = [pitch, roll, azimuth]
    columns = []
    for k in range(3):
        part.u = [float(k == j) for j in range(3)]
        part.outputs()
        columns.append(list(part.u_axes))
    return np.array(columns).T


def t1(c, s, cm, mount):
    """Rates along the motor axes -> rates of the platform, base at rest.

    Mount 0, roll ring outside: the pitch ring turns with R1 (0, r', 0) + (f', 0, 0) = (f', cf r', ...), the platform
    with R3 of that: [[c, cf s], [-s, cf c]].  Mount 1: R2 (f', 0, 0) + (0, r', 0) = (cr f', r', ...).
    """
    zero = 0 * c
    one = zero + 1
    a, b = (one, cm) if mount == 0 else (cm, one)
    return [[c * a, s * b, zero], [-s * a, c * b, zero], [zero, zero, one]]


@pytest.mark.parametrize("mount", [0, 1])
def test_t1_t2_is_one_symbolically(mount, monkeypatch):
    """In exact arithmetic, cos = (1 - t2)/(1 + t2), sin = 2 t/(1 + t2): each entry is a rational function of the two t
    of degree below 10, so that an identity on a grid of 10 x 10 rational points is one for all angles."""
    part = T2(mount=mount, theta_f_max=1.5)
    part.initialize()
    exact = {}
    monkeypatch.setattr(MODULE, "cos", lambda x: exact[x][0])
    monkeypatch.setattr(MODULE, "sin", lambda x: exact[x][1])
    half = [Fraction(k, 11) for k in range(-4, 6)]  # tan(x / 2)
    for ta in half:
        for tm in half:
            (a, ca, sa), (m, cm, _) = (
                (2 * math.atan(t), (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)) for t in (ta, tm)
            )
            exact.clear()
            exact.update({a: (ca, sa)})
            exact.setdefault(m, (cm, Fraction(0)))
            part.theta = [m, m, a]
            for k in range(3):
                part.u = [Fraction(int(k == j)) for j in range(3)]
                part.outputs()
                back = [sum(x * y for x, y in zip(row, part.u_axes, strict=True)) for row in t1(ca, sa, cm, mount)]
                assert back == part.u


def test_printed_5_1_12_does_not_invert_t1():
    """Printed U_y = k (u_x cos a + u_y sin a); right is u_x sin a + u_y cos a, which the part has."""
    f, a = 0.4, 0.3
    ours = matrix(T2(), pitch=f, azimuth=a)
    direct = np.array(t1(math.cos(a), math.sin(a), math.cos(f), 0))
    np.testing.assert_allclose(direct @ ours, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(ours[1, :2], [math.sin(a) / math.cos(f), math.cos(a) / math.cos(f)], rtol=1e-15)
    printed = ours.copy()
    printed[1, :2] = ours[1, 1::-1]
    assert np.max(np.abs(direct @ printed - np.eye(3))) > 0.1


def test_ideal_resolver_is_t2_and_its_errors_are_as_defined():
    rng = np.random.default_rng(3)
    for _ in range(20):
        f, r, a = rng.uniform(-1.0, 1.0, 3)
        k, offset, imbalance, quadrature = 1 + 0.1 * rng.normal(), *(0.05 * rng.normal(size=3))
        for mount, middle in ((0, f), (1, r)):
            angles = {"pitch": f, "roll": r, "azimuth": a}
            assert np.array_equal(matrix(T2(form=1, mount=mount), **angles), matrix(T2(mount=mount), **angles))
            errors = {"k": k, "offset": offset, "imbalance": imbalance, "quadrature": quadrature}
            c = k * math.cos(a + offset)
            s = k * (1 + imbalance) * math.sin(a + offset + quadrature)
            hand = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
            hand[1 - mount] /= math.cos(middle)
            np.testing.assert_allclose(matrix(T2(form=1, mount=mount, **errors), **angles), hand, atol=1e-14)
            assert np.array_equal(matrix(T2(mount=mount, **errors), **angles), matrix(T2(mount=mount), **angles))


def test_offset_costs_its_own_angle():
    """T1 T2(offset) is a rotation by it at pitch 0: eigenvalues exp(+-j offset), crosstalk sin(offset)."""
    for a in (0.0, 1.0, 4.0):
        loop = np.array(t1(math.cos(a), math.sin(a), 1.0, 0)) @ matrix(T2(form=1, offset=0.03), azimuth=a)
        assert sorted(np.angle(np.linalg.eigvals(loop[:2, :2]))) == pytest.approx([-0.03, 0.03], rel=1e-9)
        assert abs(loop[0, 1]) == pytest.approx(math.sin(0.03), rel=1e-9)


@pytest.mark.parametrize("mount", [0, 1])
def test_secant_is_held_beyond_its_limit(mount):
    part = T2(mount=mount)
    for angle, secant, held in (
        (1.0, 1 / math.cos(1.0), 0),
        (1.2, 2.0, 1),
        (-1.2, 2.0, 1),
        (1.6, -2.0, 1),  # turned over: cos is below 0
        (-2.0, -2.0, 1),
        (3.0, 1 / math.cos(3.0), 0),
    ):
        found = matrix(part, **{("pitch", "roll")[mount]: angle})
        assert found[1 - mount, 1 - mount] == pytest.approx(secant, rel=1e-12)
        assert found[mount, mount] == 1.0 and part.saturated == held


def test_without_t2_a_degree_of_azimuth_costs_a_degree_of_margin():
    """The loop of PLATFORM-1AXIS (10 Hz, PM 53.6 deg) on x and y: det(I + L(s) T1 T2) over the eigenvalues of T1 T2."""
    wc = 2 * math.pi * 10
    num = np.polymul(np.polymul([1.0, wc / 15], [4 / wc, 1.0]), [1.0])
    den = np.polymul(np.polymul([1 / (4 * wc), 1.0], [1.25e-3, 1.0]), [2.0, 0.0, 0.0, 0.0])
    s = 1j * wc
    num = num / abs(np.polyval(num, s) / np.polyval(den, s))
    margin = 180.0 + math.degrees(np.angle(np.polyval(num, s) / np.polyval(den, s)))
    assert margin % 360 == pytest.approx(53.6, abs=0.05)

    def stable(part, pitch, azimuth):
        loop = np.array(t1(math.cos(azimuth), math.sin(azimuth), math.cos(pitch), 0)) @ matrix(
            part, pitch=pitch, azimuth=azimuth
        )
        return all(np.max(np.roots(np.polyadd(den, e * num)).real) < 0 for e in np.linalg.eigvals(loop))

    edge = margin % 360
    assert stable(Off(), 0.0, math.radians(edge - 0.1)) and not stable(Off(), 0.0, math.radians(edge + 0.1))
    for a in (40.0, 60.0, 80.0, 179.0):
        assert stable(Off(), 0.3, math.radians(a)) == (a < 50.0)
        assert stable(T2(), 0.3, math.radians(a))
    assert stable(T2(form=1, offset=math.radians(edge - 0.1)), 0.0, 1.0)
    assert not stable(T2(form=1, offset=math.radians(edge + 0.1)), 0.0, 1.0)


def test_none_passes_on():
    assert np.array_equal(matrix(Off(), 0.3, 0.4, 0.5), np.eye(3))


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"k": 0.0}, "parameter k = 0 1 must be > 0"),
        ({"imbalance": -1.0}, "parameter imbalance = -1 1 must be > -1"),
        ({"quadrature": math.pi / 2}, "parameter quadrature = 1.5708 rad must be < 1.5708"),
        ({"theta_f_max": math.pi / 2}, "parameter theta_f_max = 1.5708 rad must be < 1.5698"),
        ({"form": 2}, "parameter form = 2 1 must be <= 1"),
    ],
)
def test_refusals(parameters, message):
    with pytest.raises(ComponentError, match=message):
        T2(**parameters).initialize()
