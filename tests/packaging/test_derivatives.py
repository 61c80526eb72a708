"""Derivatives: the plain class, the native FMU and, as oracle, CasADi tracing the same class."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import casadi
import control
import numpy as np
import pytest
from toybench import PARTS, TOYS

import gyrobench.component.math
from gyrobench.bench import Bench, standard_folder
from gyrobench.component import Component, ComponentError
from gyrobench.linear.part_linearization import state_space
from gyrobench.packaging import load_part
from gyrobench.packaging.dependencies import reached
from gyrobench.packaging.reference import read_reference
from gyrobench.packaging.source import PartCode

SIZES = {"rad/s": 1e-3, "A": 1e-3, "V": 1e-3, "1": 1e3}


class Traced:
    """A CasADi expression with its value: conditions are decided by the value, so the branch taken is traced."""

    def __init__(self, sx: Any, v: float) -> None:
        self.sx, self.v = sx, v

    @staticmethod
    def of(x: Any) -> Traced:
        return x if isinstance(x, Traced) else Traced(casadi.SX(float(x)), float(x))

    def __neg__(self) -> Traced:
        return Traced(-self.sx, -self.v)

    def __pos__(self) -> Traced:
        return self

    def __bool__(self) -> bool:
        return self.v != 0.0

    def __int__(self) -> int:
        return int(self.v)

    __hash__ = None  # type: ignore[assignment]


def _applied(f: Callable[..., Any], a: Traced, b: Any) -> Traced:
    return Traced(f(a.sx, Traced.of(b).sx), f(a.v, Traced.of(b).v))


def _operators() -> None:
    import operator

    for name in ("add", "sub", "mul", "truediv"):
        f = getattr(operator, name)
        setattr(Traced, f"__{name}__", lambda a, b, f=f: NotImplemented if isinstance(b, list) else _applied(f, a, b))
        setattr(Traced, f"__r{name}__", lambda a, b, f=f: Traced(f(Traced.of(b).sx, a.sx), f(Traced.of(b).v, a.v)))
    for name in ("lt", "le", "gt", "ge", "eq", "ne"):
        f = getattr(operator, name)
        setattr(Traced, f"__{name}__", lambda a, b, f=f: f(a.v, Traced.of(b).v))


_operators()


def traced(name: str) -> Callable[..., Traced]:
    plain = getattr(gyrobench.component.math, name)
    if name in ("where", "fabs", "minimum", "maximum", "clip"):
        return plain  # written with comparisons and arithmetic only
    if name in ("floor", "sign"):
        return lambda x: Traced(casadi.SX(plain(Traced.of(x).v)), plain(Traced.of(x).v))

    def f(*args: Any) -> Traced:
        a = [Traced.of(x) for x in args]
        return Traced(getattr(casadi, name)(*(x.sx for x in a)), plain(*(x.v for x in a)))

    return f


def trace(part: Component, monkeypatch: pytest.MonkeyPatch) -> tuple[np.ndarray, list[str]]:
    """d(state derivatives, outputs) / d(parameters, inputs, states), by CasADi at the part's present point."""
    source = PartCode(type(part))
    codes = [c for k in ("flow", "outputs") for _, code in source.equations[k] for c in reached(code, source)]
    for names in {id(c.function.__globals__): c.function.__globals__ for c in codes}.values():
        for name in gyrobench.component.math.FUNCTIONS:
            if name in names:
                monkeypatch.setitem(names, name, traced(name))
    real = [s for s in part.layout if s.section in ("parameter", "input", "state") and s.decl.type is float]
    symbols = casadi.SX.sym("z", len(real))
    twin = copy.deepcopy(part)
    for k, s in enumerate(real):
        box, last = holder(twin, s.path)
        value = Traced(symbols[k], part._at(s))
        if isinstance(last, str):
            setattr(box, last, value)
        else:
            box[last] = value
    twin.flow()
    twin.outputs()
    results = []
    for section in ("derivative", "output"):
        for s in (x for x in part.layout if x.section == section):
            box, last = holder(twin, s.path)
            results.append(Traced.of(getattr(box, last) if isinstance(last, str) else box[last]).sx)
    f = casadi.Function("f", [symbols], [casadi.jacobian(casadi.vertcat(*results), symbols)])
    return np.array(f([part._at(s) for s in real])), [s.name for s in real]


def holder(part: Component, path: tuple[Any, ...]) -> tuple[Any, Any]:
    box: Any = part
    for key in path[:-1]:
        box = getattr(box, key) if isinstance(key, str) else box[key]
    return box, path[-1]


def running(one: Any, name: str) -> Any:
    """A part in the middle of its reference run (standard parts) or of a run of its own (toys)."""
    if name in PARTS:
        reference = read_reference(Bench(standard_folder()).part_folder(name) / "reference.csv")
        one.set(reference.parameters)
        rows, h, inputs = min(40, len(reference.time)), reference.step, reference.inputs
    else:
        rng = np.random.default_rng(3)
        u = {"lag": ["u[1]", "u[2]"], "linear": ["u[1]", "u[2]"], "swing": ["u"]}[name]
        if name == "linear":
            matrix = rng.normal(size=(4, 4))
            one.set({f"A[{i + 1},{j + 1}]": float(matrix[i, j]) for i in range(4) for j in range(4)})
            one.set({"B[1,1]": 1.0, "B[4,2]": -2.0, "C[1,3]": 3.0, "D[2,1]": 4.0})
        rows, h, inputs = 20, 1e-3, {n: rng.normal(size=20).tolist() for n in u}
    one.initialize()
    for k in range(rows):
        one.set({n: x[k] for n, x in inputs.items()})
        one.step(k * h, h)
    return one


SMOOTH = ["lag", "linear", "swing", *PARTS]


@pytest.mark.parametrize("name", SMOOTH)
def test_plain_class_and_native_fmu_agree_bit_for_bit(instance: Callable, name: str) -> None:
    toy = name not in PARTS
    plain, native, three = (running(instance(name, t, toy=toy), name) for t in ("plain", "native", "native-fmi3"))
    part = plain.part
    unknown = [s.name for s in part.layout if s.section == "derivative"]
    unknown += [s.name for s in part.layout if s.section == "output"]
    known = [s.name for s in part.layout if s.section in ("parameter", "input", "state")]
    rng = np.random.default_rng(5)
    before = native.get([s.name for s in part.layout if s.section != "derivative" and s.decl.type is float])
    chosen = [rng.choice(known, size=min(4, len(known)), replace=False) for _ in range(10)]
    directions = [{str(n): float(rng.normal()) for n in some} for some in chosen]
    for seeds, (der, out) in zip(directions, part.tangents(directions), strict=True):
        assert native.derivative(unknown, seeds) == three.derivative(unknown, seeds) == der + out
    after = native.get([s.name for s in part.layout if s.section != "derivative" and s.decl.type is float])
    assert before == after  # asking for a derivative changes nothing


@pytest.mark.parametrize("name", SMOOTH)
def test_casadi_agrees(instance: Callable, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    part = running(instance(name, "plain", toy=name not in PARTS), name).part
    oracle, names = trace(part, monkeypatch)
    monkeypatch.undo()
    for k, (der, out) in enumerate(part.tangents({n: 1.0} for n in names)):
        largest = np.max(np.abs(oracle[:, k]))
        # terms that cancel are some times as large as what is left of them, the largest of the column
        np.testing.assert_allclose(der + out, oracle[:, k], rtol=1e-12, atol=1e-13 * largest)


@pytest.mark.parametrize("name", ["lag", "linear", "swing", "floated_gyro", "rebalance_analog"])
def test_finite_differences_agree(instance: Callable, name: str) -> None:
    """Central differences of the state derivatives by inputs and states: 1e-5 of the largest in the column."""
    part = running(instance(name, "plain", toy=name not in PARTS), name).part
    for s in part.layout:
        if s.section not in ("input", "state"):
            continue
        x, e = part._at(s), 1e-6 * SIZES.get(s.decl.unit, 1.0)
        ends = []
        for sign in (1, -1):
            part._put(s, x + sign * e)
            ends.append(np.array(part._flow()))
        part._put(s, x)
        found = np.array(part.tangent({s.name: 1.0})[0])
        rough = (ends[0] - ends[1]) / (2 * e)
        rounding = 1e-15 * np.max(np.abs(ends)) / e
        assert np.max(np.abs(found - rough)) <= 1e-5 * np.max(np.abs(rough)) + rounding


def test_state_space() -> None:
    """The matrices of a linear part come back; unknown names are refused."""
    a = [[-1.0, 2.0, 0.0, 0.0], [0.0, -3.0, 0.0, 1.0], [0.5, 0.0, -2.0, 0.0], [0.0, 0.0, 0.0, -4.0]]
    b = [[1.0, 0.0], [0.0, 2.0], [0.0, 0.0], [3.0, 4.0]]
    c, d = [[1.0, 0.0, 0.0, 5.0], [0.0, 6.0, 0.0, 0.0]], [[0.0, 7.0], [8.0, 0.0]]
    part = load_part("linear", TOYS)("slot", A=a, B=b, C=c, D=d)
    part.initialize()
    system = state_space(part, ["u[1]", "u[2]"], ["y[1]", "y[2]"])
    for found, given in zip((system.A, system.B, system.C, system.D), (a, b, c, d), strict=True):
        assert found.tolist() == given
    one = state_space(part, ["u[2]"], ["y[2]"])
    assert one.B.tolist() == [[0.0], [2.0], [0.0], [4.0]] and one.C.tolist() == [c[1]] and one.D.tolist() == [[0.0]]
    with pytest.raises(ComponentError, match=r"no input 'y\[1\]'; it has u\[1\], u\[2\]"):
        state_space(part, ["y[1]"], [])


def test_margins_of_the_rebalance_loop() -> None:
    """Gyro and rebalance loop opened at the pickoff: closed poles, worked out by hand in the part's text.

    J s3 + C s2 + K_sg H k (K_p s + K_i) ... with the defaults: poles at -11.25, -100 and -888.7 1/s.
    """
    gyro, loop = load_part("floated_gyro")("gyro"), load_part("rebalance_analog")("loop")
    for p in (gyro, loop):
        p.initialize()
    forward = state_space(loop, ["u"], ["i"]) * state_space(gyro, ["i"], ["u"])
    closed = control.feedback(forward, 1, sign=1)  # the gyro's own sign makes it negative feedback
    poles = np.sort(np.real(closed.poles()))
    np.testing.assert_allclose(poles, [-888.7, -100.0, -11.25], rtol=2e-4)
