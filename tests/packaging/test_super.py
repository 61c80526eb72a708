"""Procedures that a subclass extends by super(): the same bits in every target, in parts, mixins and blocks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gyrobench.component import ComponentError
from gyrobench.packaging import SubsetError, load_part
from gyrobench.packaging.instance import TARGETS, make
from gyrobench.packaging.native_target import c_source

BASES = '''\
"""A gyro, what may be mixed into it, and two blocks."""
from __future__ import annotations

from gyrobench.component import Block, Component, Discrete, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import Number, Vector, sin, vector


class Gyro(Component):
    """First-order gyro with a drift that subclasses extend."""

    D = Parameter([0.1, 0.2, 0.3], "rad/s", "drift along each axis")
    limit = Parameter(50.0, "1", "largest count", above=0.0)
    f = Input([0.3, -0.2, 0.5], "1", "specific force")
    rate = State(0.0, "rad/s", "rate")
    n = Discrete(0.0, "1", "count")
    y = Output("rad/s", "reading")

    def static_drift(self, x: Vector) -> Number:
        return self.D @ x

    def axes(self, x: Vector) -> Vector:
        return vector([x[1], x[2], x[0]])

    def count(self, by: Number) -> None:
        self.n = self.n + by
        self.refuse(self.n > self.limit, "counted beyond limit = {limit}")

    @sampled()
    def tick(self) -> None:
        self.count(1.0)

    def flow(self) -> None:
        self.der.rate = self.static_drift(self.axes(self.f)) - 20.0 * self.rate

    def outputs(self) -> None:
        self.y = self.rate + 1e-3 * self.n


class Quadratic(Gyro):
    """Adds a quadratic drift and turns the axes twice."""

    Q = Parameter(0.05, "rad/s", "quadratic drift")

    def static_drift(self, x: Vector) -> Number:
        return super().static_drift(x) + self.Q * x[0] * x[0]

    def axes(self, x: Vector) -> Vector:
        return super().axes(super().axes(x)) * 0.5

    def count(self, by: Number) -> None:
        super().count(2.0 * by)


class Thermal(Component):
    """Drift that follows the temperature, to be mixed in before a gyro."""

    T = Input(20.0, "1", "temperature")

    def static_drift(self, x: Vector) -> Number:
        return super().static_drift(x) + 0.01 * sin(self.T) * x[0]


class Lag(Block):
    """First-order lag of a gain that subclasses change."""

    tau = Parameter(0.02, "s", "time constant", above=0.0)
    x = State(0.0, "1", "state")

    def gain(self, u: Number) -> Number:
        return 2.0 * u

    def follow(self, u: Number) -> None:
        self.der.x = (self.gain(u) - self.x) / self.tau


class SoftLag(Lag):
    """Softer for large inputs; its input is bounded."""

    most = Parameter(3.0, "1", "largest input", above=0.0)

    def gain(self, u: Number) -> Number:
        return super().gain(u) / (1.0 + u * u)

    def follow(self, u: Number) -> None:
        self.refuse(u > self.most, "{self}: input beyond most = {most}")
        super().follow(u)
'''

MODEL = '''\
from __future__ import annotations

from components.bases import Quadratic, SoftLag, Thermal
from gyrobench.component import Output
from gyrobench.component.math import Number, Vector


class Warm(Thermal, Quadratic):
    """Three classes on top of one another; equations call those beneath, too."""

    lag = SoftLag(tau=0.01)
    z = Output("1", "drift of the classes beneath, and the lag")

    def static_drift(self, x: Vector) -> Number:
        return 2.0 * super().static_drift(x)

    def flow(self) -> None:
        self.lag.follow(self.f[0])

    def outputs(self) -> None:
        self.z = super().static_drift(self.f) + self.lag.x
'''


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    (tmp_path / "components" / "warm").mkdir(parents=True)
    for room in ("systems", "reports"):
        (tmp_path / room).mkdir()
    (tmp_path / "components" / "bases.py").write_text(BASES)
    (tmp_path / "components" / "warm" / "model.py").write_text(MODEL)
    return tmp_path


def run(target: str, bench: Path, steps: int = 20) -> tuple[list[list[float]], Any]:
    names = [s.name for s in load_part("warm", bench).layout if s.section in ("output", "state")]
    one = make("warm", target, bench=bench)
    one.initialize()
    rows = []
    for k in range(steps):
        one.set({"f[1]": 0.1 * k, "f[3]": -0.3, "T": 20.0 + k})
        one.step(k * 1e-3, 1e-3)
        rows.append(one.get(names))
    return rows, one


@pytest.mark.long
def test_all_targets_have_the_same_bits(bench: Path) -> None:
    plain, part = run("plain", bench)
    assert len({tuple(r) for r in plain}) == len(plain)
    # two a step, by Quadratic.count; x = axes(axes(f)) / 2 = (f3, f1, f2) / 2, in static_drift of Warm, Thermal, ...
    f, T, D, Q = part.part.f, part.part.T, part.part.D, part.part.Q
    x = [f[2] / 2, f[0] / 2, f[1] / 2]
    drift = 2.0 * (np.dot(D, x) + Q * x[0] ** 2 + 0.01 * np.sin(T) * x[0])
    assert part.part.n == 40.0
    assert part.part.static_drift(part.part.axes(f)) == pytest.approx(drift, rel=1e-14)
    beneath = np.dot(D, f) + Q * f[0] ** 2 + 0.01 * np.sin(T) * f[0]
    assert part.part.z == pytest.approx(beneath + part.part.lag_x, rel=1e-14)
    for target in TARGETS[1:]:
        rows, one = run(target, bench)
        assert rows == plain, target
        one.free()


def test_derivatives_have_the_same_bits_and_are_right(bench: Path) -> None:
    _, plain = run("plain", bench)
    part = plain.part
    unknown = [s.name for section in ("derivative", "output") for s in part.layout if s.section == section]
    known = ["f[1]", "f[2]", "f[3]", "D[2]", "Q", "T", "lag_x", "lag_tau", "rate"]
    for target in ("native", "native-fmi3"):
        _, one = run(target, bench)
        for name in known:
            der, out = part.tangent({name: 1.0})
            assert one.derivative(unknown, {name: 1.0}) == der + out, name
        one.free()
    assert part.tangent({"Q": 1.0})[0][0] == pytest.approx(2.0 * (part.f[2] / 2.0) ** 2, rel=1e-14)
    u = part.f[0]  # d/du of 2 u / (1 + u u) / tau
    assert part.tangent({"f[1]": 1.0})[0][1] == pytest.approx(200.0 * (1 - u * u) / (1 + u * u) ** 2, rel=1e-13)


@pytest.mark.parametrize("how", TARGETS)
def test_refusals_of_what_super_calls(bench: Path, how: str) -> None:
    with pytest.raises(Exception, match=r"counted beyond limit = 50"):
        run(how, bench, 30)
    one = make("warm", how, bench=bench)
    one.initialize()
    one.set({"f[1]": 4.0})
    with pytest.raises(Exception, match=r"lag: input beyond most = 3"):
        one.step(0.0, 1e-3)
    one.free()


def test_each_class_is_a_function_of_its_name_in_c(bench: Path) -> None:
    text = c_source(load_part("warm", bench), "guid")
    assert "static inline double Gyro_static_drift_(Part *part" in text
    assert "return (2.0 * Thermal_static_drift_(part" in text


# ----------------------------------------------------------------------------------------------- refused
WRONG: list[tuple[type[Exception], str, str, str]] = [
    (ComponentError, "def flow(self):", "super().flow()", r"run by themselves.*leave out super\(\)\.flow\(\); what"),
    (ComponentError, "def more(self):", "super().tick()", r"leave out super\(\)\.tick\(\)"),
    (SubsetError, "def flow(self):", "self.der.rate = super().drift(1.0)", r"super\(\)\.drift is not a procedure of"),
    (SubsetError, "def flow(self):", "self.der.rate = super(Warm, self).count(1.0)", r"write super\(\)\.count\(\.\.\."),
    (SubsetError, "def flow(self):", "self.der.rate = super().Q", r"only self\.X, self\.der\.X"),
    (SubsetError, "def flow(self):", "super().count(1.0)", r"flow\(\) does not write super\(\)\.count"),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "head", "line", "message"), WRONG)
def test_what_super_cannot_do(bench: Path, kind: type[Exception], head: str, line: str, message: str) -> None:
    model = bench / "components" / "warm" / "model.py"
    text = MODEL.partition("    def flow")[0] + f"    {head}\n        {line}\n"
    model.write_text(text)
    where = rf"warm/model\.py:{len(text.splitlines())}: .*"
    with pytest.raises(kind, match=where + message):
        c_source(load_part("warm", bench), "guid")
