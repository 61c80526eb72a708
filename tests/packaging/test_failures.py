"""Refusals and failures: an error status and a message that says what, where, and what would be right.

The words are the same in the plain class and in every FMU.  The status is fmi2Error (3); the Python FMU's host,
pythonfmu 0.7.0, has fmi2Fatal (4) only, but goes on living: it can be reset and freed.
"""

from __future__ import annotations

import math
import re
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import pytest
from toybench import TOYS

from gyrobench.bench import Bench, standard_folder
from gyrobench.packaging import build, load_part
from gyrobench.packaging.instance import Fmu, InstanceError
from gyrobench.packaging.reference import read_reference

STATUS = {"plain": None, "native": 3, "native-fmi3": 3, "python": 4}


def refused(form: str, call: Callable[..., Any], *args: Any) -> str:
    with pytest.raises(InstanceError) as e:
        call(*args)
    assert e.value.status == STATUS[form]
    assert len(e.value.messages) == 1
    return str(e.value.messages[0])


def everywhere(instance: Callable, tell: Callable[[Any, str], str], part: str, toy: bool = True) -> str:
    """The message, which must be the same in the plain class and in every FMU."""
    told = {f: tell(instance(part, f, toy=toy), f) for f in STATUS}
    assert len(set(told.values())) == 1, told
    return told["plain"]


# --------------------------------------------------------------------------------- before the start
BAD = {
    ("tau", 0.0): "slot: parameter tau = 0 s must be > 0",
    ("tau", -1.0): "slot: parameter tau = -1 s must be > 0",
    ("tau", math.nan): "slot: parameter tau = nan s must be finite",
    ("limit", 100.5): "slot: parameter limit = 100.5 1 must be <= 100",
    ("limit", -1e-9): "slot: parameter limit = -1e-09 1 must be >= 0",
    ("part_of", 1.0): "slot: parameter part_of = 1 1 must be < 1",
    ("mix[2,1]", math.inf): "slot: parameter mix[2,1] = inf 1 must be finite",
    ("mix[2,1]", -math.inf): "slot: parameter mix[2,1] = -inf 1 must be finite",
    ("white", -0.1): "slot: parameter white = -0.1 1/sqrt(Hz) must be >= 0",
    ("k", 3): "slot: parameter k = 3 1 must be <= 2",
    ("step", 0.0): "slot: parameter step = 0 s must be > 0",
    ("u[2]", math.nan): "slot: input u[2] = nan 1 must be finite",
    ("x", math.inf): "slot: state x = inf 1 must be finite",
    ("wrong", 2.0): "slot: wrong = 2 is above 1 (100 %) (t = 0.5 s)",
}


@pytest.mark.parametrize(("name", "x"), BAD)
def test_impossible_values_at_initialization(instance: Callable, name: str, x: float) -> None:
    def tell(one: Any, form: str) -> str:
        one.set({name: x})
        return refused(form, one.initialize, 0.5)

    assert everywhere(instance, tell, "lag") == BAD[name, x]


def test_limits_themselves_are_possible(instance: Callable, form: str) -> None:
    one = instance("lag", form, toy=True)
    one.set({"limit": 100.0, "k": 2, "white": 0.0, "wrong": 1.0})
    one.initialize()
    one.step(0.0, 1e-3)


def test_after_a_refusal_reset_helps(instance: Callable, form: str) -> None:
    one = instance("lag", form, toy=True)
    for _ in range(3):
        one.set({"tau": -1.0})
        refused(form, one.initialize)
        one.reset()
    one.initialize()
    one.step(0.0, 1e-3)


def test_every_bound_of_every_part(part: str, form: str, instance: Callable) -> None:
    """The first value beyond each bound is refused by name, value and bound."""
    one = instance(part, form)
    seen = set()
    for s in load_part(part).layout:
        d = s.decl
        if s.section != "parameter" or d.name in seen:
            continue
        seen.add(d.name)
        beyond = {
            "min": (d.min, -math.inf, ">="),
            "max": (d.max, math.inf, "<="),
            "above": (d.above, None, ">"),
            "below": (d.below, None, "<"),
        }
        for limit, away, word in beyond.values():
            if limit is None:
                continue
            x = (
                limit
                if away is None
                else math.nextafter(limit, away)
                if d.type is float
                else limit + (away > 0) * 2 - 1
            )
            one.set({s.name: x})
            message = refused(form, one.initialize)
            assert message == f"slot: parameter {s.name} = {x:g} {d.unit} must be {word} {limit:g}"
            one.reset()


# ------------------------------------------------------------------------------------ while running
@pytest.mark.parametrize("x", [math.nan, math.inf, -math.inf])
def test_inputs_that_are_not_finite(instance: Callable, x: float) -> None:
    def tell(one: Any, form: str) -> str:
        one.initialize()
        one.step(0.0, 1e-3)
        one.set({"u[2]": x})
        return refused(form, one.step, 0.001, 1e-3)

    assert everywhere(instance, tell, "lag") == f"slot: input u[2] is {x:g} at t = 0.001 s"


def test_inputs_of_every_part(part: str, form: str, instance: Callable) -> None:
    names = [s.name for s in load_part(part).layout if s.section == "input"]
    reference = read_reference(Bench(standard_folder()).part_folder(part) / "reference.csv")
    one = instance(part, form)
    for name in names[:3] + names[-1:]:
        one.reset()
        one.set(reference.parameters)
        one.set({n: x[0] for n, x in reference.inputs.items()})
        one.initialize()
        one.set({name: math.nan})
        assert refused(form, one.step, 0.0, 1e-3) == f"slot: input {name} is nan at t = 0 s"


def test_what_became_not_finite(instance: Callable) -> None:
    """A discrete that grows beyond all numbers: told by its name, and by the output that shows it first."""

    def tell(one: Any, form: str) -> str:
        one.initialize()
        one.set({"u": 3.0})
        one.step(0.0, 1e-3)
        return refused(form, one.step, 0.001, 1e-3)

    assert everywhere(instance, tell, "raiser") == "slot: output y is inf at t = 0.002 s"


def test_a_memory_is_looked_at_when_it_comes_out(instance: Callable) -> None:
    """A discrete array of more than 64 elements: what is stored there is no failure, what comes out is."""

    def tell(one: Any, form: str) -> str:
        one.initialize()
        for k, u in enumerate((5.0, 0.0)):
            one.set({"u": u})
            one.step(k * 1e-3, 1e-3)
        one.set({"u": 6.0})
        return refused(form, one.step, 0.002, 1e-3)

    assert everywhere(instance, tell, "raiser") == "slot: output y is inf at t = 0.003 s"


@pytest.mark.parametrize(
    ("u", "native", "python"),
    [  # log(-1) becomes NaN in C, and is found at the end of the step
        (1.0, "output y is nan at t = 0.001 s", "math domain error in tick at t = 0.001 s"),
        (2.0, "an index is 3, not in 0 to 2 (t = 0.001 s)", "list index out of range in tick at t = 0.001 s"),
    ],
)
def test_arithmetic_and_indices_fail(instance: Callable, u: float, native: str, python: str) -> None:
    for form in STATUS:
        one = instance("raiser", form, toy=True)
        one.initialize()
        one.set({"u": u})
        assert refused(form, one.step, 0.0, 1e-3) == f"slot: {native if form.startswith('native') else python}"


def test_own_refusal_while_running(instance: Callable) -> None:
    def tell(one: Any, form: str) -> str:
        one.set({"late": 0.0035})
        one.initialize()
        for k in range(3):
            one.step(k * 1e-3, 1e-3)
        return refused(form, one.step, 0.003, 1e-3)

    assert everywhere(instance, tell, "lag") == "slot: after 0.0035 s (t = 0.004 s)"


@pytest.mark.parametrize("h", [0.0, -1e-3, math.nan, math.inf])
def test_steps_that_are_none(instance: Callable, h: float) -> None:
    def tell(one: Any, form: str) -> str:
        one.initialize()
        return refused(form, one.step, 0.0, h)

    assert everywhere(instance, tell, "lag") == f"slot: a step must be positive and finite, not {h:g} s"


def test_a_step_before_initialization(instance: Callable) -> None:
    def tell(one: Any, form: str) -> str:
        return refused(form, one.step, 0.0, 1e-3)

    assert everywhere(instance, tell, "lag") == "slot: a step before initialization has succeeded"


@pytest.mark.parametrize("kind", STATUS)
def test_parameters_are_fixed(instance: Callable, kind: str) -> None:
    """Those that act at the start alone; which others are, and which are not: test_tuning.py."""
    one = instance("estimator_lti", kind)
    one.initialize()
    for name, value in (("x0[1]", 0.0), ("Ts", one.get(["Ts"])[0])):
        told = refused(kind, one.set, {name: 2.0})
        shown = "x0" if kind == "native-fmi3" and name != "Ts" else name  # an array is set as a whole
        assert told == f"slot: parameter {shown} is fixed once initialization has ended: reset first"
        assert one.get([name]) == [value]
    one.step(0.0, 1e-3)  # a wrong call changes nothing


# --------------------------------------------------------------------------------------- wrong calls
def test_value_references(instance: Callable) -> None:
    for form in ("native", "python", "native-fmi3"):
        one = instance("lag", form, toy=True)
        getter = one.fmu.getFloat64 if one.three else one.fmu.getReal
        setter = one.fmu.setFloat64 if one.three else one.fmu.setReal
        for call in (lambda g=getter: g([4711]), lambda s=setter: s([4711], [1.0])):
            message = refused(form, one._call, "reference", call)
            assert message == "slot: no variable has the value reference 4711"


def test_strings(instance: Callable) -> None:
    for form in ("native", "python"):
        one = instance("lag", form, toy=True)
        for call in (lambda f=one.fmu: f.getString([0]), lambda f=one.fmu: f.setString([0], ["a"])):
            assert refused(form, one._call, "string", call) == "slot: this FMU has no string variables"


def test_wrong_guid(fmu: Callable) -> None:
    """Native FMUs refuse it; pythonfmu 0.7.0 does not look at it."""
    for fmi, text in ((2, "the GUID is not this FMU's"), (3, "the instantiation token is not this FMU's")):
        one = Fmu(fmu("lag", "native", fmi, toy=True))
        one.description.guid = "{00000000-0000-0000-0000-000000000000}"
        with pytest.raises(InstanceError, match=text):
            Fmu(fmu("lag", "native", fmi, toy=True), like=one)
        one.free()


def test_model_exchange_is_refused(fmu: Callable) -> None:
    one = Fmu(fmu("lag", "native", toy=True))
    from fmpy import fmi2

    c = one.fmu.fmi2Instantiate(
        b"a", fmi2.fmi2ModelExchange, one.description.guid.encode(), b"", fmi2.byref(one.callbacks), 0, 0
    )
    assert not c
    assert one.messages == ["only co-simulation is offered"]
    one.free()


# ----------------------------------------------------------------------------------- the Python FMU
@pytest.mark.parametrize("logging", [True, False])
def test_a_fault_shows_its_traceback(instance: Callable, monkeypatch: pytest.MonkeyPatch, logging: bool) -> None:
    """An exception that is no refusal comes with the original traceback, even if logging is off."""
    one = instance("raiser", "python", toy=True, logging=logging)
    one.initialize()
    library = next(m for n, m in sys.modules.items() if n.startswith("gb_raiser") and n.endswith(".model"))

    def fault(self: Any, x: float) -> float:
        raise RuntimeError("a fault of the program: 100 % surprising")

    monkeypatch.setattr(library.Raiser, "fault", fault)
    one.set({"u": 4.0})
    message = refused("python", one.step, 0.0, 1e-3)
    assert message.startswith("slot: Traceback (most recent call last):")
    assert re.search(r"model\.py\", line \d+, in tick", message)
    assert message.rstrip().endswith("RuntimeError: a fault of the program: 100 % surprising")
    one.reset()
    monkeypatch.undo()
    one.initialize()
    one.step(0.0, 1e-3)


@pytest.mark.long
def test_versions_and_parts_do_not_clash(tmp_path: Path) -> None:
    """Two parts and two versions of one part in one process, interleaved."""
    paths = []
    for version, factor in (("1.0.0", 2.0), ("2.0.0", 3.0)):
        folder = tmp_path / version / "components" / "twin"
        folder.mkdir(parents=True)
        (folder / "model.py").write_text(
            textwrap.dedent(
                f'''
                from __future__ import annotations
                from gyrobench.component import Component, Input, Output
                K = {factor}
                class Twin(Component):
                    """A twin."""
                    version = "{version}"
                    u = Input(1.0, "1", "input")
                    y = Output("1", "output")
                    def outputs(self):
                        self.y = K * self.u
                '''
            )
        )
        out = tmp_path / version
        paths.append(build("twin", "python", out=out, bench=out))
    paths.append(build("lag", "python", out=tmp_path, bench=TOYS))
    many = [Fmu(p, f"i{k}") for k, p in enumerate([*paths, *paths])]
    for one in many:
        one.initialize()
        one.step(0.0, 1e-3)
    assert [one.get(["y"])[0] for one in many if "y" in one.variables] == [2.0, 3.0, 2.0, 3.0]
    for one in many:
        one.free()


@pytest.mark.long
def test_foreign_masters_see_the_messages(fmu: Callable, tmp_path: Path) -> None:
    """FMPy's own simulation, in a process of its own: it ends with the message, not with a crash."""
    program = """
        import sys, fmpy
        try:
            start = {sys.argv[2]: sys.argv[3]}
            fmpy.simulate_fmu(sys.argv[1], stop_time=0.01, output_interval=1e-3, start_values=start)
        except Exception as e:
            print("caught", e)
    """
    for target, status in (("native", 3), ("python", 4)):
        for name, x, text in (("tau", "-1", "tau = -1 s must be > 0"), ("wrong", "2", "is above 1 (100 %)")):
            args = [sys.executable, "-c", textwrap.dedent(program), str(fmu("lag", target, toy=True)), name, x]
            done = subprocess.run(args, capture_output=True, text=True, cwd=tmp_path, timeout=60, check=False)
            assert done.returncode == 0, done.stderr
            assert text in done.stdout
            assert f"failed with status {status}" in done.stdout


def test_fmpy_simulates(part: str, target: str, fmu: Callable, unzipped: Callable) -> None:
    """FMPy's defaults run every part (unzipped: with nothing but the file, see the test above)."""
    folder = unzipped(fmu(part, target)).folder
    result = fmpy.simulate_fmu(str(folder), stop_time=0.02, output_interval=1e-3)
    assert len(result) == 21
    for name in result.dtype.names:
        assert all(math.isfinite(x) for x in result[name])
