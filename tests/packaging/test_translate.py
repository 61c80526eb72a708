"""The subset of Python that equations may use: what is refused, and how, and what comes out."""

from __future__ import annotations

import re
import subprocess
import textwrap
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from toybench import HEAD, TOYS

from gyrobench.component import Component, ComponentError
from gyrobench.packaging import SubsetError, compiler, load_part, native_target
from gyrobench.packaging.dependencies import dependencies, initial_dependencies
from gyrobench.packaging.instance import elements, make
from gyrobench.packaging.source import PartCode

Written = Callable[[str, str], type[Component]]

DECLARED = """\
    p = Parameter(1.0, "1")
    n = Parameter(3, int, min=1, max=9)
    m = Parameter([[1, 2], [3, 4]], "1")
    u = Input([0.0, 0.0], "1")
    w = Input(0.0, "1")
    x = State(0.0, "1")
    q = Discrete(0.0, "1")
    y = Output("1")
    z = Output("1", shape=(2,))

    def rate(self, a, b):
        return a * b

    def store(self, a):
        self.q = a

    def flow(self):
        self.der.x = -self.x

    def outputs(self):
"""
FIRST = len((HEAD + DECLARED).splitlines()) + 1  # line of the first statement under test

REFUSED = {
    "self.y = self.x ** 2": "write x * x",
    "self.y **= 2.0": "write x * x",
    "while self.x > 0:\n    self.y = 1.0": "no while: write `for k in range(n)`",
    "a = self.u[0:1]\na[0] = 1.0": "the elements of 'a' are only read: copy it by vector()",
    "self.y = self.u[0:3]": "the slice self.u[0:3]: self.u has the elements 0 to 1",
    "self.y = self.u[self.w:2]": "an index is a loop variable",
    "self.y = self.u[0:2:1]": "must be [a:b] with whole numbers that are fixed",
    "self.y = foo": "unknown name 'foo'",
    "self.p = 1.0": "parameters and inputs are only read; use a local or a Discrete",
    "self.u[0] = 1.0": "outputs() does not write self.u[0]",
    "self.x = 1.0": "it writes outputs only",
    "self.der.x = 1.0": "outputs() does not write self.der.x",
    "self.t = 0.0": "outputs() does not write self.t",
    "self.y = clip(self.x, lo=0.0, hi=1.0)": "no keyword arguments",
    "a, b = 1.0, 2.0": "write one line for each",
    "self.y = self.q = 1.0": "write one line for each",
    "for v in self.u:\n    self.y = v": "only `for k in range(n)`",
    "for k in range(0, 4, 2):\n    self.y = 1.0": "only `for k in range(n)`",
    "for k in range(self.n):\n    self.y = 1.0": "index(expression)",
    'self.y = "a"': "equations contain numbers only",
    "self.y = True": "equations contain numbers only",
    "self.y = math.sin(self.x)": "from gyrobench.component.math import sin",
    "self.y = int(self.x)": "write floor",
    "self.y = abs(self.x)": "write fabs",
    "self.y = self.x % 2.0": "write x - y * floor(x / y)",
    "print(self.x)": "`print(self.x)` is outside the subset",
    "self.y = self.u": "self.u is an array (2): take one element",
    "a = self.z": "self.z is an array, assigned to a local as it is: write vector(self.z), a copy",
    "a = vector(self.u)\nb = a": "write vector(a), a copy",
    "self.z = self.m": "self.z is an array (2), what is assigned to it an array (2 x 2)",
    "self.z = self.x": "self.z is an array (2), what is assigned to it a number",
    "self.y = self.u + self.u": "self.u + self.u is an array (2): take one element",
    "self.z = self.u + self.w": "an array (2) and a number are not added",
    "self.z = self.u * self.u": "write @, dot or cross, or a for loop",
    "self.z = 1.0 / self.u": "only a number divides",
    "self.z = self.m @ self.w": "self.w is a number: a vector or a matrix is needed here",
    "self.z = vector([1.0, 2.0, 3.0]) @ self.m": "an array (3) and an array (2 x 2) do not fit",
    "self.y = dot(self.u, self.m)": "two vectors of one length",
    "self.z = cross(self.u, self.u)": "two vectors of three",
    "self.z = self.u.T": "only a matrix is transposed",
    "a = [1.0, 2.0]\nself.z = a + self.u": "a is a list: write a = vector([...])",
    "self.z = a": "unknown name 'a'",
    "self.y = vector(self.x)": "self.x is a number: write vector([...])",
    "self.z = self.u if self.x > 0.0 else self.w": "both must be of one shape",
    "self.z = self.u if self.x > 0.0 else (self.m @ self.u) @ self.m": "an array is computed in one branch only",
    "self.rate(1.0, 2.0)": "self.rate returns a value: assign it",
    "self.y = self.store(1.0)": "self.store returns nothing: call it on a line of its own",
    "self.store(1.0)": "outputs() does not write self.store: it writes outputs only",
    "self.y = outside(1.0)": "'outside' is not callable in equations",
    "self.y = self.m[0, 1]": "write self.m[i][j]",
    "self.y = self.x[0]": "self.x is a number",
    "self.y = self.u[2]": "self.u has the elements 0 to 1",
    "self.y = self.u[-1]": "a whole number from 0 on",
    "for k in range(3):\n    self.y = self.u[k]": "k runs over 0 to 2: self.u has the elements 0 to 1",
    "for k in range(2):\n    self.y = self.u[k - 1]": "k - 1 runs over -1 to 0",
    "self.y = self.u[self.w]": "an index is a loop variable",
    "self.y = self.der.foo": "self.der.X of a State",
    "self.y = self.noise.foo": "self.noise.X of a Noise",
    "self.y = self.foo": "self.foo is not declared in Toy",
    "a = [1.0, 2.0]\nself.y = a[2]": "a has the elements 0 to 1",
    "a = [[1.0, 2.0], [3.0]]": "lists of equal length",
    "a = 1.0\na = [1.0, 2.0]": "'a' is something else already",
    "if self.x > 0.0:\n    a = 1.0\nself.y = a": "'a' is not assigned on every path",
    "for k in range(2):\n    pass\nself.y = k": "unknown name 'k'",
    "self.y = sin(self.x, self.x)": "sin takes 1 argument, not 2",
    "self.y = self.rate(self.x)": "self.rate takes 2 arguments, not 1",
    "self.y = self.start()": "self.start is not a procedure of this part",
    "self.y = self.x and self.w": "write 1.0 if self.x and self.w else 0.0",
    "self.y = 1e400": "is not finite",
    "return 1.0": "outputs returns nothing",
    'self.refuse(self.x > 1.0, "no {foo}")': "{foo} is not a scalar of this part",
    'self.refuse(self.x > 1.0, f"{self.x}")': 'write self.refuse(condition, "message with {H}")',
}


@pytest.mark.parametrize("body", REFUSED)
def test_refused_with_file_line_and_what_to_write(written: Written, tmp_path: Path, body: str) -> None:
    cls = written("toy", DECLARED + textwrap.indent(body, " " * 8) + "\n")
    with pytest.raises(SubsetError) as e:
        native_target.c_source(cls, "guid")
    assert REFUSED[body] in str(e.value)
    path, line = re.match(r"(.*):(\d+): ", str(e.value)).groups()
    assert path == str(tmp_path / "components/toy/model.py")
    assert FIRST <= int(line) < FIRST + len(body.splitlines())


def test_methods_have_plain_arguments(written: Written) -> None:
    body = (
        '    y = Output("1")\n    def rate(self, a, b=1.0):\n        return a\n    def outputs(self):\n        pass\n'
    )
    with pytest.raises(SubsetError, match="takes plain arguments without defaults"):
        native_target.c_source(written("one", body), "guid")
    body = '    y = Output("1")\n    def rate(self, a):\n        if a > 0.0:\n            return a\n'
    with pytest.raises(SubsetError, match="returns a number on every path"):
        native_target.c_source(written("two", body), "guid")


def test_names_of_component_are_taken(written: Written) -> None:
    with pytest.raises(ComponentError, match="take another name"):
        written("toy", '    reset = Parameter(1.0, "1")\n')


ACCEPTED = """\
    NAN = Parameter(2.0, "1", "a name of the C library */")
    X0 = Parameter(3.0, "1")
    double = Input(4.0, "1")
    tick = Output("1")
    y = Output("1", shape=(9,))
    gain = Parameter([0.5, 0.25], "1")
    turns = Parameter(2, int)
    SCALE = 10

    def outer(self, a):
        return self.inner(a, GAIN) + 1.0

    def inner(self, a, b):
        if a > b:
            return a
        elif a == b:
            return 0.0
        else:
            return b

    def outputs(self):
        \"\"\"Comments, names and arrays.\"\"\"
        seed = [self.NAN, self.X0]
        table = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
        part: float = self.SCALE + GAIN
        part += 1
        for k in range(1, 3):
            table[k - 1][k] = seed[k - 1] * k
        self.y[0] = table[0][1] + table[1][2]
        self.y[1] = self.outer(part)
        self.y[2] = 1.0 if not (part > 0.0 and seed[0] < 1.0) or part == 2.0 else 0.5
        self.y[3] = 1.0 if 0.0 < part < 20.0 else 0.0
        for k in range(index(self.turns)):
            self.y[4] = self.y[4] + self.gain[k]
        self.y[5] = where(part > 2.0, minimum(1.0, part), 3.0) + maximum(sign(-part), -0.5)
        if part > 100.0:
            return
        self.y[6] = -pi * +part / 3
        self.y[7] = self.double + (part > 3.0)
        self.y[8] = tan(0.1) + asin(0.2) + atan(0.3) + log(2.0) + floor(-2.5) + fabs(-1.5) + clip(part, 0.0, 1.0)
        self.tick = 1.0
"""


def test_accepted_and_equal(written: Written, tmp_path: Path) -> None:
    """By hand: SCALE + GAIN + 1 = 13.5; loops, arrays, helpers; then all of it equal in the native FMU."""
    cls = written("toy", ACCEPTED)
    part = cls("a")
    part.initialize()
    y = [part.get(f"y[{k + 1}]") for k in range(9)]
    assert y[:5] == [2.0 * 1 + 3.0 * 2, 14.5, 1.0, 1.0, 0.75]
    assert y[5] == 1.0 - 0.5 and y[7] == 5.0
    native_fmu = make("toy", "native", bench=tmp_path)
    native_fmu.initialize()
    assert native_fmu.get([f"y[{k + 1}]" for k in range(9)]) == y
    native_fmu.free()


def warnings(source: Path, *how: str) -> str:
    """What the compiler says with all warnings on."""
    cc = compiler.command(compiler.this_platform())
    assert cc is not None
    flags = ("-Wall", "-Wextra", "-Wpedantic", *how, "-S", f"-I{source.parent}", "-o", str(source.with_suffix(".s")))
    return subprocess.run([*cc, *compiler.FLAGS, *flags, source], capture_output=True, text=True, check=True).stderr


def strict(cls: type[Component], folder: Path, once: bool = False) -> None:
    """-O1 sees the flow of values, and is quicker than the build's -O3.

    The unit that a build makes of the model, and the one unit of an FMU's sources.  once: parsed only, and for FMI 3.
    """
    for fmi in (3,) if once else (2, 3):
        for name, text in native_target.source_files(cls, "guid", fmi).items():
            (folder / name).write_text(text, encoding="utf-8")
        assert warnings(folder / f"fmi{fmi}.c", "-fsyntax-only" if once else "-O1") == ""
    assert warnings(folder / "instance.c", "-DAPART", "-O1") == ""


@pytest.mark.parametrize("fmi", [2, 3])
def test_faces_compile_without_warnings(tmp_path: Path, fmi: int) -> None:
    """The unit of a build that is the same for all models."""
    for name, text in native_target.face_files([], fmi).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert warnings(tmp_path / f"fmi{fmi}.c", "-DAPART", "-O1") == ""


@pytest.mark.parametrize("name", ["place", "told", "step", "draw"])
@pytest.mark.long
def test_a_sampled_method_may_have_the_name_of_a_function_of_the_runtime(
    written: Written, tmp_path: Path, name: str
) -> None:
    """place and told stand in instance.h, step in instance.c, draw in core.h."""
    body = f"""    n = Discrete(0.0, "1", "ticks")
    y = Output("1", "ticks")
    @sampled(every=2)
    def {name}(self) -> None:
        self.n += 1.0
    def outputs(self) -> None:
        self.y = self.n
"""
    strict(written("toy", body), tmp_path)
    one = make("toy", "native", bench=tmp_path)
    one.initialize()
    for k in range(4):
        one.step(k * 1e-3, 1e-3)
    assert one.get(["y"]) == [2.0]
    one.free()


@pytest.mark.long
def test_parts_compile_without_warnings(part: str, tmp_path: Path) -> None:
    strict(load_part(part), tmp_path, once=True)


@pytest.mark.parametrize("toy", ["lag", "linear", "noisy", "swing", "raiser"])
@pytest.mark.long
def test_toys_compile_without_warnings(toy: str, tmp_path: Path) -> None:
    strict(load_part(toy, TOYS), tmp_path)


@pytest.mark.long
def test_odd_parts_compile_without_warnings(written: Written, tmp_path: Path) -> None:
    strict(written("toy", ACCEPTED), tmp_path)
    strict(written("bare", '    y = Output("1")\n    def outputs(self):\n        self.y = 1.0\n'), tmp_path)
    strict(written("nothing", '    p = Parameter(1.0, "1")\n'), tmp_path)


def test_dependencies(written: Written) -> None:
    body = """\
    a = Input(0.0, "1")
    b = Input([0.0, 0.0], "1")
    c = Input(0.0, "1")
    d = Input(0.0, "1")
    e = Input(1.0, "1")
    q = Discrete(0.0, "1")
    direct = Output("1")
    through_local = Output("1")
    through_helper = Output("1")
    through_test = Output("1")
    through_loop = Output("1")
    after_return = Output("1")
    through_output = Output("1")
    none = Output("1")

    def helper(self, x):
        return x * self.other(x)

    def other(self, x):
        return x + self.c

    def outputs(self):
        k = [0.0, 0.0]
        k[0] = self.b[1]
        for i in range(2):
            self.through_local = self.through_local + k[i]
        self.direct = 2.0 * self.a
        self.through_helper = self.helper(self.q)
        self.through_test = 0.0
        if self.a > 0.0:
            self.through_test = 1.0
        for i in range(index(self.e)):
            self.through_loop = 1.0
        self.through_output = self.direct + 1.0
        self.none = self.q
        if self.d > 0.0:
            return
        self.after_return = 1.0
"""
    assert dependencies(PartCode(written("toy", body))) == {
        "direct": {"a"},
        "through_local": {"b"},
        "through_helper": {"c"},
        "through_test": {"a"},
        "through_loop": {"e"},
        "after_return": {"d"},
        "through_output": {"a"},
        "none": set(),
    }


def test_initial_dependencies(written: Written) -> None:
    body = """\
    a = Input(0.0, "1")
    b = Input(0.0, "1")
    p = Parameter(1.0, "1")
    r = Parameter(2.0, "1")
    seed = Parameter(1, int)
    white = Noise(0.0, "1", per="start")
    x = State(0.0, "1")
    v = State(0.0, "1")
    q = Discrete(0.0, "1")
    y = Output("1")
    z = Output("1")

    def start(self):
        self.q = self.p * self.b + self.noise.white
        self.v = 3.0 * self.r

    def flow(self):
        self.der.x = self.a - self.x
        self.der.v = 0.0

    def outputs(self):
        self.y = self.q
        self.z = self.v + self.der.x
"""
    source = PartCode(written("toy", body))
    found = initial_dependencies(source)
    assert found["y"] == {"p", "b", "white", "seed"}
    assert found["z"] == {"r", "v", "a", "x"}
    assert found["der.x"] == {"a", "x"}
    assert found["der.v"] == set()


@pytest.mark.parametrize("name", ["floated_gyro", "rebalance_analog"])
@pytest.mark.parametrize("kind", ["native", "native-fmi3"])
def test_initial_outputs_follow_nothing_that_is_not_declared(instance: Callable, name: str, kind: str) -> None:
    """Each parameter, input and state is changed by itself during initialization, arrays element by element."""
    one = instance(name, kind)
    known = [v for v in one.description.modelVariables if v.causality in ("parameter", "input") or v.initial == "exact"]
    known = [v for v in known if not v.name.startswith(("mount", "terms"))]  # few of their values are legal
    declared = {u.variable.name: {d.name for d in u.dependencies} for u in one.description.initialUnknowns}
    outputs = elements(v for v in one.description.modelVariables if v.causality == "output")
    fmu = one.fmu
    if not one.three:
        fmu.setupExperiment()
    fmu.enterInitializationMode()
    rng = np.random.default_rng(1)
    changed = 0
    real = elements(v for v in known if v.type in ("Real", "Float64") and v.causality != "parameter")
    one.set({n: rng.uniform(0.1, 0.2) for n in real})
    for n in elements(known):
        v = one.holding[n]
        before, now = one.get(outputs), one.get([n])[0]
        one.set({n: 1.0 - now if v.type == "Boolean" else 1.5 * now + (0.1 if n in real else 0.0)})
        for output, x, y in zip(outputs, before, one.get(outputs), strict=True):
            changed += x != y
            assert x == y or v.name in declared[one.holding[output].name], f"{output} follows {n}"
        one.set({n: now})
    assert changed >= 2


def test_dependencies_are_in_the_description(instance: Callable) -> None:
    description = instance("lag", "native", toy=True).description
    unknowns = {u.variable.name: {v.name for v in u.dependencies} for u in description.outputs}
    states = {"x", "v[1]", "v[2]"}
    assert unknowns["direct"] == states | {"u[1]", "u[2]"}  # by declared name: an array counts as one
    assert unknowns["y[1]"] == states
    assert {u.variable.name for u in description.initialUnknowns} == set(unknowns) | {f"der({s})" for s in states}
