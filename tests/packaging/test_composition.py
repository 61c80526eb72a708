"""Parts of parts: inheritance, mixins and blocks of other files, in every target; what would be lost is refused."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from gyrobench.bench import standard_folder
from gyrobench.component import Block, Component, ComponentError, Input, Noise, Output, Parameter, State, sampled
from gyrobench.packaging import SubsetError, load_part
from gyrobench.packaging.dependencies import followed, initial_dependencies, reached
from gyrobench.packaging.instance import TARGETS, make
from gyrobench.packaging.source import PartCode

PIECES = '''\
"""Pieces of a bench of its own: two mixins, a block, a function."""
from __future__ import annotations

from gyrobench.component import Block, Component, Discrete, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import Number, Vector, cross, dot, vector


class Heat(Component):
    """Temperature of a body: tau T' = T_outside - T."""

    tau = Parameter(50.0, "s", "time constant", above=0.0)
    outside = Input(20.0, "1", "temperature outside")
    inside = Output("1", "temperature inside")
    T = State(20.0, "1", "temperature")

    def start(self) -> None:
        self.refuse(self.tau > 1e4, "tau = {tau} s is too long")

    def flow(self) -> None:
        self.der.T = (self.outside - self.T) / self.tau

    def outputs(self) -> None:
        self.inside = self.T


class Counter(Component):
    """Counts the internal steps."""

    count = Output("1", "steps")
    n = Discrete(0.0, "1", "steps")

    @sampled(every=1)
    def tick(self) -> None:
        self.n = self.n + 1.0

    def outputs(self) -> None:
        self.count = self.n


class Walk(Block):
    """Random walk; shares the size where the part names one."""

    size = Noise(0.1, "V", "size of a step", per="step")
    limit = Parameter(1e3, "V", "largest value", above=0.0)
    x = Discrete(0.0, "V", "value")

    @sampled(every=2)
    def tick(self) -> None:
        self.x = self.x + self.noise.size
        self.refuse(self.x > self.limit, "{self} has walked beyond limit = {limit} V")

    def twice(self) -> Number:
        return 2.0 * self.x


def turned(m: Vector, v: Vector, scale: Number) -> Vector:
    return scale * (m @ v) + cross(v, m[0])
'''

MIXED = '''\
from __future__ import annotations

from components.pieces import Counter, Heat, Walk, turned
from gyrobench.component import Discrete, Input, Output, Parameter, Rotation, sampled
from gyrobench.component.math import Number, Vector, dot, vector


class Mixed(Heat, Counter):
    """A part of two mixins, two blocks, a function and procedures."""

    tau = Parameter(30.0, "s", "a shorter time constant", above=0.0)
    m = Rotation("rows: axes of the part")
    v = Input([0.3, -0.2, 0.5], "V", "a vector")
    left = Walk(size=0.25)
    right = Walk(size="left_size")
    y = Output("V", "a vector", shape=(3,))
    z = Output("V", "a number")
    kept = Discrete([[0.0, 0.0], [0.0, 0.0]], "V", "a matrix")

    def start(self) -> None:
        self.kept = vector([[1.0, 2.0], [3.0, 4.0]])

    def scaled(self, a: Vector, by: Number) -> Vector:
        return a * by - self.v / 4.0

    def store(self, row: Vector) -> None:
        self.kept[1] = row + self.v[0:2]
        self.kept = self.kept.T

    @sampled(every=1)
    def own(self) -> None:
        if self.n < 9.0:
            self.store(self.v[1:3])

    def outputs(self) -> None:
        w = turned(self.m, self.scaled(self.v, self.inside), 0.5)
        self.y = w if self.z > 0.0 else -w
        self.z = dot(w, self.v) + self.left.twice() - self.right.x + self.kept[0] @ self.kept[1]
'''

DERIVED = '''\
from __future__ import annotations

from components.floated_gyro.model import FloatedGyro
from gyrobench.component import Output, Parameter
from gyrobench.component.math import Number, Vector


class WarmGyro(FloatedGyro):
    """The standard gyro with a drift of its own and an output more."""

    k = Parameter(0.1, "rad/s/A", "torquer scale factor", above=0.0)
    warm = Parameter(1e-6, "rad/s", "drift more")
    twice = Output("rad", "twice the float angle")

    def static_drift(self, x: Vector) -> Number:
        return self.polynomial(self.warm, x * self.D_F, x)

    def outputs(self) -> None:
        self.twice = 2.0 * self.b
'''


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """A bench with two composed parts and the file that their pieces stand in."""
    for room in ("components", "systems", "reports"):
        (tmp_path / room).mkdir()
    (tmp_path / "components" / "pieces.py").write_text(PIECES)
    for name, text in (("mixed", MIXED), ("floated_gyro", DERIVED)):
        (tmp_path / "components" / name).mkdir()
        (tmp_path / "components" / name / "model.py").write_text(text)
    return tmp_path


def outputs(part: str, target: str, bench: Path, changed: dict[str, float], steps: int = 40) -> list[list[float]]:
    names = [s.name for s in load_part(part, bench).layout if s.section == "output"]
    one = make(part, target, bench=bench)
    one.set(changed)
    one.initialize()
    rows = [one.get(names)]
    for k in range(steps):
        one.set({"v[2]": 0.1 * k} if part == "mixed" else {"omega[1]": 1e-4 * k, "i": 1e-5 * k, "f[3]": 9.8})
        one.step(k * 1e-3, 1e-3)
        rows.append(one.get(names))
    one.free()
    return rows


@pytest.mark.parametrize("name", ["mixed", "floated_gyro"])
def test_composed_parts_are_bit_equal_in_all_targets(bench: Path, name: str) -> None:
    plain = outputs(name, "plain", bench, {"seed": 4})
    assert len({tuple(r) for r in plain}) == len(plain)
    for target in TARGETS[1:]:
        assert outputs(name, target, bench, {"seed": 4}) == plain, target


def test_nothing_of_the_bases_is_lost(bench: Path) -> None:
    """Every scalar, equation and refusal of the standard gyro, and two more."""
    gyro, base = load_part("floated_gyro", bench), load_part("floated_gyro", standard_folder())
    assert {s.name for s in gyro.layout} == {s.name for s in base.layout} | {"warm", "twice"}
    assert [n.name for n in gyro.noises] == [n.name for n in base.noises]  # so the noise of a seed is the same
    assert gyro.declarations["k"].start == 0.1 and base.declarations["k"].start != 0.1
    assert {k: len(p) for k, p in gyro.pieces.items()} == {k: len(p) + (k == "outputs") for k, p in base.pieces.items()}
    one = gyro(terms=7)
    with pytest.raises(ComponentError, match="terms = 7 is not a static model"):
        one.initialize()
    mount = gyro(mount=[[1, 0, 0], [0, 1, 0], [0, 1e-3, 1]])
    with pytest.raises(ComponentError, match="mount is not a rotation matrix"):
        mount.initialize()
    mixed = load_part("mixed", bench)
    assert {"tau", "left_size", "left_limit", "left_x", "right_limit", "right_x", "m", "seed", "step"} < set(
        mixed.declarations
    )
    assert "right_size" not in mixed.declarations and [n.name for n in mixed.noises] == ["left_size"]


@pytest.mark.parametrize("how", TARGETS)
def test_refusals_of_bases_and_blocks_name_their_place(bench: Path, how: str) -> None:
    with pytest.raises(Exception, match=r"tau = 20000 s is too long"):
        outputs("mixed", how, bench, {"tau": 2e4})
    with pytest.raises(Exception, match=r"right has walked beyond limit = 0.01 V \(t = 0\.0\d+ s\)"):
        outputs("mixed", how, bench, {"right_limit": 0.01, "seed": 3})


def test_a_changed_piece_is_built_again(bench: Path) -> None:
    before = outputs("mixed", "native", bench, {}, 2)
    file = bench / "components" / "pieces.py"
    file.write_text(PIECES.replace("return scale * (m @ v)", "return 3.0 * scale * (m @ v)"))
    assert outputs("mixed", "native", bench, {}, 2) != before


def test_the_standard_bench_is_found_from_a_part_without_its_checkout(bench: Path, tmp_path: Path) -> None:
    """In a process that stands in the user's bench: `from components...` needs neither path nor package."""
    code = "from gyrobench.packaging import load_part; print(load_part('floated_gyro').__mro__[1].__name__)"
    done = subprocess.run([sys.executable, "-c", code], cwd=bench, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "FloatedGyro"


def test_equations_stand_in_two_files_at_most(part: str) -> None:
    """The part's own and one of the blocks (the check of a rotation matrix apart); a part that is put together of more
    names each block in its README, where the reader finds what it does.
    """
    source = PartCode(load_part(part, standard_folder()))
    files = {
        Path(c.path).name for pieces in source.equations.values() for _, code in pieces for c in reached(code, source)
    }
    if len(files - {"rotation.py"}) <= 2:
        return
    readme = (standard_folder() / "components" / part / "README.md").read_text(encoding="utf-8")
    blocks = {type(b).__name__ for c in source.cls.__mro__ for b in vars(c).values() if isinstance(b, Block)}
    assert blocks - {"Rotation"} <= set(re.findall(r"\w+", readme)), (files, blocks)


# ----------------------------------------------------------------------------------------------- refused
class One(Component):
    a = Parameter(1.0, "V")
    x = State([0.0, 0.0], "V")

    def flow(self) -> None:
        self.der.x = -self.x


class Other(Component):
    a = Parameter(2.0, "V")


class Piece(Block):
    p = Parameter(1.0, "V")


def test_two_bases_that_declare_one_name() -> None:
    with pytest.raises(ComponentError, match="Other and One both declare 'a': rename one"):
        type("Both", (Other, One), {})


def test_a_constant_or_a_method_that_hides_a_declaration() -> None:
    with pytest.raises(ComponentError, match=r"Sub\.a hides a declaration of One: .*a = Parameter\(\.\.\.\)"):
        type("Sub", (One,), {"a": 3.0})
    with pytest.raises(ComponentError, match=r"Sub\.x hides a declaration of One"):
        type("Sub", (One,), {"x": lambda self: 1.0})


def test_a_declaration_of_another_kind_or_shape() -> None:
    with pytest.raises(ComponentError, match=r"Sub\.a must be declared as in One: Parameter"):
        type("Sub", (One,), {"a": Input(1.0, "V")})
    with pytest.raises(ComponentError, match=r"Sub\.x must be declared as in One: State of shape \(2,\)"):
        type("Sub", (One,), {"x": State(0.0, "V")})


def test_a_declaration_inside_a_list() -> None:
    with pytest.raises(ComponentError, match="gains: a declaration inside a list is lost"):
        type("Sub", (Component,), {"gains": [Parameter(1.0, "V")]})
    with pytest.raises(ComponentError, match="gains: a declaration inside a list is lost"):
        type("Sub", (Component,), {"gains": {"p": Piece()}})


def test_an_equation_that_calls_that_of_its_base() -> None:
    def flow(self: One) -> None:
        super(One, self).flow()

    with pytest.raises(
        ComponentError, match=r"test_composition.py:279: .* by themselves.*leave out super\(\)\.flow\(\)"
    ):
        type("Sub", (One,), {"flow": flow})


def test_blocks_that_do_not_fit() -> None:
    def block(name: str, **given: object) -> type:
        piece = Piece(**given)
        piece.name = name
        return type("Sub", (Component,), {name: piece})

    with pytest.raises(ComponentError, match=r"Sub\.b: Piece declares no 'q'; it has p"):
        block("b", q=1.0)
    with pytest.raises(ComponentError, match=r"Sub\.b shares 'k', which Sub does not declare"):
        block("b", p="k")
    with pytest.raises(ComponentError, match=r"Sub\.b: p is a Parameter of Piece, not Output"):
        block("b", p=Output("V"))
    with pytest.raises(ComponentError, match=r"p: the start value has shape \(2,\), not \(\)"):
        block("b", p=[1.0, 2.0])
    with pytest.raises(ComponentError, match=r"'b_p' is declared by Sub\.b_p and by Sub\.b"):
        type("Sub", (Component,), {"b_p": Noise(1.0, "V"), "b": Piece()})


def test_equations_without_a_file_are_refused_where_they_are_built() -> None:
    names: dict[str, object] = {}
    exec("def outputs(self):\n    self.y = 1.0\n", names)
    cls = type("Sub", (Component,), {"y": Output("V"), "outputs": names["outputs"]})
    with pytest.raises(SubsetError, match="equations must stand in a file"):
        PartCode(cls)


def test_a_recursion_is_refused(bench: Path) -> None:
    folder = bench / "components" / "endless"
    folder.mkdir()
    (folder / "model.py").write_text(
        "from gyrobench.component import Component, Output\n\n\nclass Endless(Component):\n    y = Output('V')\n\n"
        "    def f(self, a):\n        return self.f(a)\n\n    def outputs(self):\n        self.y = self.f(1.0)\n"
    )
    with pytest.raises(SubsetError, match=r"model.py:8: f calls itself"):
        make("endless", "native", bench=bench)


def test_calling_a_kind_of_equation_runs_all_of_it() -> None:
    class Sub(One):
        y = Output("V")

        @sampled(every=1)
        def tick(self) -> None:
            pass

        def flow(self) -> None:
            self.der.x[1] = 7.0

    one = Sub()
    one.x = [1.0, 2.0]
    one.flow()
    assert one.der.x == [-1.0, 7.0]


def test_blocks_within_a_block_that_add_nothing_to_its_name(bench: Path) -> None:
    """Both have a start and a sampled method of one name, which are two functions in C; what reads their discretes from
    outside changes with them.
    """
    folder = bench / "components" / "pair"
    folder.mkdir()
    (folder / "model.py").write_text(
        "from gyrobench.component import Block, Component, Discrete, Output, Parameter, sampled\n"
        + "".join(
            f"\n\nclass {name}(Block):\n    {p} = Parameter({p[1]}.0, 'V', 'first')\n    {q} = Discrete(0.0, 'V')\n\n"
            f"    def start(self):\n        self.{q} = self.{p}\n\n"
            f"    @sampled(every=1)\n    def tick(self):\n        self.{q} = {k} * self.{q}\n"
            for name, p, q, k in (("Twice", "p2", "q2", "2.0"), ("Thrice", "p3", "q3", "3.0"))
        )
        + "\n\nclass Two(Block):\n    suffixes = {'a': '', 'b': ''}\n    a = Twice()\n    b = Thrice()\n\n"
        "    def sum(self):\n        return self.a.q2 + self.b.q3\n"
        "\n\nclass Pair(Component):\n    two = Two()\n    y = Output('V')\n\n"
        "    def outputs(self):\n        self.y = self.two.sum()\n"
    )
    for target in TARGETS:
        one = make("pair", target, bench=bench)
        one.initialize()
        seen = [one.get(["y"])[0]]
        for k in range(2):
            one.step(k * 1e-3, 1e-3)
            seen.append(one.get(["y"])[0])
        one.free()
        assert seen == [5.0, 4.0 + 9.0, 8.0 + 27.0], target  # 2 + 3, each times its factor at each step
    assert followed(PartCode(load_part("pair", bench))) is None


def test_a_declaration_of_a_block_is_found_by_its_name_in_the_part() -> None:
    """Of a block within a block, one shared, and the transpose of an array, which is no block."""
    friction = initial_dependencies(PartCode(load_part("table_body")))["der.axis_w"]
    assert {"axis_friction", "axis_friction_static"} <= friction
    assert "base" in initial_dependencies(PartCode(load_part("fixture")))["f"]  # self.base.T @ ...
