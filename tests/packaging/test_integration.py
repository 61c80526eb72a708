"""The integrators against exact solutions, and the linearization they use."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
from toybench import TOYS

from gyrobench.component import ComponentError
from gyrobench.component.numerics import phi1
from gyrobench.packaging import load_part


def exact_phi1(z: np.ndarray) -> np.ndarray:
    """From the exponential of the augmented matrix: exp [[z, 1], [0, 0]] = [[exp z, phi1(z)], [0, 1]]."""
    n = len(z)
    big = np.zeros((2 * n, 2 * n))
    big[:n, :n], big[:n, n:] = z, np.eye(n)
    return scipy.linalg.expm(big)[:n, n:]


def rational_phi1(z: list[list[float]]) -> np.ndarray:
    """The power series sum z^k / (k + 1)! in exact arithmetic."""
    n = len(z)
    exact = [[Fraction(x) for x in row] for row in z]
    term = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
    total = [row[:] for row in term]
    for k in range(1, 50):
        term = [[sum(r[m] * exact[m][j] for m in range(n)) / (k + 1) for j in range(n)] for r in term]
        term = [[x.limit_denominator(10**60) for x in row] for row in term]
        total = [[x + y for x, y in zip(p, q, strict=True)] for p, q in zip(total, term, strict=True)]
    return np.array([[float(x) for x in row] for row in total])


@pytest.mark.parametrize("size", [1e-8, 1e-3, 0.3, 1.0, 4.0])
def test_phi1(size: float) -> None:
    """Against the exact series and, where scipy's expm itself is good to 1e-14 (not at 4), against that."""
    rng = np.random.default_rng(1)
    for n in (1, 2, 3):
        z = rng.normal(size=(n, n))
        z *= size / np.linalg.norm(z, np.inf)
        found = np.array(phi1(z.tolist()))
        assert np.linalg.norm(found - rational_phi1(z.tolist())) < 1e-14 * np.linalg.norm(found)
        if size <= 1.0:
            assert np.linalg.norm(found - exact_phi1(z)) < 1e-14 * np.linalg.norm(found)


def test_phi1_of_stiff_numbers() -> None:
    """(e^z - 1) / z for one number, by expm1; a stiff decay loses nothing in the doublings."""
    for z in (-1e-9, -0.1, -1.0, -30.0, -1e3, -1e6, 3.0, 30.0):
        assert phi1([[z]])[0][0] == pytest.approx(math.expm1(z) / z, rel=2e-14)
    assert phi1([[0.0, 0.0], [0.0, 0.0]]) == [[1.0, 0.0], [0.0, 1.0]]


def stable(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A random stable system: real and complex poles between 1 and 2000 1/s, in a random basis."""
    d = np.zeros((4, 4))
    a, b = 10 ** rng.uniform(0, 3.3, 2)
    w = 10 ** rng.uniform(0, 3)
    d[0, 0], d[1, 1] = -a, -b
    d[2:, 2:] = [[-0.1 * w, w], [-w, -0.1 * w]]
    basis = rng.normal(size=(4, 4)) + 3.0 * np.eye(4)
    return basis @ d @ np.linalg.inv(basis), rng.normal(size=(4, 2)) * 100.0


def configure(one: object, a: np.ndarray, b: np.ndarray) -> None:
    values = {f"A[{i + 1},{j + 1}]": a[i, j] for i in range(4) for j in range(4)}
    one.set(values | {f"B[{i + 1},{j + 1}]": b[i, j] for i in range(4) for j in range(2)})


@pytest.mark.parametrize("seed", range(8))
def test_exponential_step_is_exact_for_linear_parts(instance: Callable, seed: int) -> None:
    """Held inputs, 40 steps of 2.5 ms cut into internal steps of 1 ms: 1e-12 of the largest state.

    The exact step is that of the augmented matrix exp(h [[A, B u], [0, 0]]).
    """
    rng = np.random.default_rng(seed)
    a, b = stable(rng)
    h = 2.5e-3
    one = instance("linear", "native", toy=True)
    configure(one, a, b)
    one.initialize()
    x = np.zeros(4)
    names = [f"x[{k + 1}]" for k in range(4)]
    largest = 0.0
    for k in range(40):
        u = rng.normal(size=2)
        one.set({"u[1]": u[0], "u[2]": u[1]})
        one.step(k * h, h)
        x = scipy.linalg.expm(h * a) @ x + h * exact_phi1(h * a) @ (b @ u)
        largest = max(largest, float(np.max(np.abs(x))))
        assert np.max(np.abs(np.array(one.get(names)) - x)) < 1e-12 * largest


def swing(h: float, end: float) -> tuple[float, float]:
    part = load_part("swing", TOYS)("s", w=3.0)
    part.set("u", 0.5)
    part.initialize()
    for k in range(round(end / h)):
        part.do_step(k * h, h)
    return part.get("angle"), part.get("rate")


def test_rk4_has_order_four() -> None:
    """The pendulum driven by the time itself: halving the step divides the error by 16 (15 to 17)."""

    def flow(t: float, x: list[float]) -> list[float]:
        return [x[1], 0.5 - 9.0 * math.sin(x[0]) + math.sin(5.0 * t)]

    end = 1.6
    exact = scipy.integrate.solve_ivp(flow, (0, end), [1.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    errors = [np.linalg.norm(np.array(swing(h, end)) - exact) for h in (0.04, 0.02, 0.01)]
    assert 14.5 < errors[0] / errors[1] < 17.5
    assert 15.0 < errors[1] / errors[2] < 17.0


def test_rk4_is_the_same_in_every_target(instance: Callable) -> None:
    runs = []
    for target in ("plain", "native", "python"):
        one = instance("swing", target, toy=True)
        one.initialize()
        rows = []
        for k in range(50):
            one.set({"u": 0.1 * k})
            one.step(0.02 * k, 0.02)
            rows.append(one.get(["angle", "rate", "y"]))
        runs.append(rows)
    assert runs[0] == runs[1] == runs[2]


def test_nonlinear_parts_converge_with_order_two(written: Callable) -> None:
    """Exponential Euler with A anew at each step: halving the step divides the error by 4."""
    body = """\
    nonlinear = True
    step = Parameter(1.0, "s")
    x = State(1.0, "1")
    y = Output("1")
    def flow(self):
        self.der.x = -self.x * self.x * self.x
    def outputs(self):
        self.y = self.x
"""
    cls = written("cube", body)
    errors = []
    for h in (0.02, 0.01, 0.005):
        part = cls("a")
        part.initialize()
        for k in range(round(1.0 / h)):
            part.do_step(k * h, h)
        errors.append(abs(part.get("y") - 1.0 / math.sqrt(3.0)))  # x = 1 / sqrt(1 + 2 t)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.05)


def test_steps_are_cut_equally(instance: Callable) -> None:
    """2.5 ms in internal steps of at most 1 ms is 3 x 0.8333 ms; 3 ms is 3, for all its rounding; 0.4 ms is 1."""
    for target in ("plain", "native"):
        one = instance("lag", target, toy=True)
        one.initialize()
        expected, t = 0, 0.0
        for h, n in ((2.5e-3, 3), (3e-3, 3), (3 * 1e-3 + 1e-18, 3), (4e-4, 1), (3.1e-3, 4)):
            one.step(t, h)
            t += h
            expected += n
            assert one.get(["turns"]) == [expected // 2]  # the tick of every second internal step


def test_a_step_needs_a_beginning() -> None:
    part = load_part("lag", TOYS)("slot")
    with pytest.raises(ComponentError, match="slot: a step before initialization has succeeded"):
        part.do_step(0.0, 1e-3)
