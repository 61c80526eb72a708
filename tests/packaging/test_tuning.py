"""Parameters set between steps: of every part, what follows is the run of a part that was started with them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

from gyrobench.bench import Bench, standard_folder
from gyrobench.component import Component
from gyrobench.component.declarations import element_names
from gyrobench.packaging import load_part
from gyrobench.packaging.instance import Instance, InstanceError, Plain, make
from gyrobench.packaging.reference import Reference, read_reference
from gyrobench.packaging.tuning import tuning

ROWS = 30  # of the reference run, before a change and after it


def tunable(cls: type[Component]) -> list[str]:
    """Return the declared names of the parameters that may be set between steps."""
    of = tuning(cls).tunable
    return list(dict.fromkeys(s.decl.name for s in cls.layout if s.reference in of))


def steps(one: Instance, r: Reference, rows: range, names: list[str]) -> list[list[float]]:
    found = []
    for k in rows:
        one.set({n: x[k] for n, x in r.inputs.items()})
        one.step(r.time[k], r.step)
        found.append(one.get(names))
    return found


def started(one: Instance, r: Reference, **parameters: float) -> Instance:
    one.set({**r.parameters, **parameters, **{n: x[0] for n, x in r.inputs.items()}})
    one.initialize(r.time[0])
    return one


def moved(one: Plain, step: Callable[[], Any]) -> dict[str, float]:
    """Set each tunable parameter of a part a little off, where neither that nor the next step is refused.

    step: takes it.  Returns what was set.
    """
    cls = type(one.part)
    done: dict[str, float] = {}
    for name in tunable(cls):
        at = element_names(name, cls.declarations[name].shape)
        present = one.get(at)
        for by in (1e-3, 1e-7, -1e-3):
            values = {n: x * (1.0 + by) if x or len(at) > 1 else by for n, x in zip(at, present, strict=True)}
            try:
                one.set(values)
            except InstanceError:
                assert one.get(at) == present  # refused, it is as it was
                continue
            before = one.get_state()
            try:
                step()
            except InstanceError:  # a period that is no multiple of the internal step, say
                one.set_state(before)
                one.set(dict(zip(at, present, strict=True)))
                continue
            one.set_state(before)
            done |= values
            break
    return done


def test_a_change_between_steps_is_a_start_with_the_new_values(part: str, instance: Callable[..., Any]) -> None:
    """In all that the part has, in the plain class; outputs of the native FMU, set all at once, bit for bit."""
    cls = load_part(part)
    r = read_reference(Bench(standard_folder()).part_folder(part) / "reference.csv")
    at = min(ROWS, len(r.time) // 2)
    later = range(at, min(at + ROWS, len(r.time)))
    everything = [s.name for s in cls.layout if s.section != "parameter"]
    changed = started(instance(part, "plain"), r)
    steps(changed, r, range(at), [])
    values = moved(changed, lambda: steps(changed, r, range(at, min(at + 6, len(r.time))), []))
    of = {n.partition("[")[0] for n in values}
    assert len(of) >= 0.6 * len(tunable(cls)) - 1, set(tunable(cls)) - of

    fresh = started(instance(part, "plain"), r, **values)
    derived = set(tuning(cls).derived)
    state = changed.part.get_state()
    own = fresh.part.get_state()
    made = [own["v"][s.reference] if s.reference in derived else x for s, x in zip(cls.layout, state["v"], strict=True)]
    fresh.part.set_state(state | {"v": made})
    assert steps(changed, r, later, everything) == steps(fresh, r, later, everything)

    outputs = [s.name for s in cls.layout if s.section == "output"]
    plain, native = (started(instance(part, target), r) for target in ("plain", "native"))
    for one in (plain, native):
        steps(one, r, range(at), [])
        one.set(values)
    assert steps(plain, r, later, outputs) == steps(native, r, later, outputs)


PART = """
    K = Parameter(2.0, "1", "gain", above=0.0)
    tau = Parameter(0.1, "s", "lag: kept, by the step it was made for", above=0.0)
    limit = Parameter(5.0, "V", "derived")
    first = Parameter(0.5, "V", "initial state")
    both = Parameter(1.0, "V", "initial state, and read later")
    mixed = Parameter(1.0, "1", "with an input, for good")
    idle = Parameter(1.0, "1", "read by nothing")
    n = Parameter(3, int, "number")
    on = Noise(0.0, "V", per="step")
    u = Input(0.0, "V")
    twice = Discrete(0.0, "V")
    offset = Discrete(0.0, "V")
    h_last = Discrete(0.0, "s")
    c = Discrete(0.0, "1")
    x = Discrete(0.0, "V")
    y = Output("V")
    def start(self):
        self.refuse(self.limit > 100.0 * self.K, "limit = {limit} V is too large")
        if self.limit > 1.0:
            self.twice = 2.0 * self.limit
        self.offset = self.mixed * self.u
        self.x = self.first + self.both
    @sampled(every=1)
    def tick(self):
        if self.h != self.h_last:
            self.c = self.h / self.tau
            self.h_last = self.h
        self.x = self.x + self.c * (self.K * self.u - self.x) + 1e-3 * self.both * self.n + self.noise.on
    def outputs(self):
        self.y = clip(self.x + self.offset, -self.twice, self.twice)
"""


def test_which_parameters_follow_from_the_equations(written: Callable[..., type[Component]]) -> None:
    """Fixed: what is kept (tau), acts at the start alone (first), stands for good with an input (mixed), acts nowhere
    (idle), is a number of pieces (n) or a size of noise (on)."""
    cls = written("tuned", PART)
    assert tunable(cls) == ["K", "limit", "both"]
    assert [cls.layout[k].name for k in tuning(cls).derived] == ["twice"]


@pytest.mark.parametrize("kind", ["plain", "python", "native", "native-fmi3"])
def test_what_is_derived_is_made_anew_and_a_refusal_changes_nothing(
    written: Callable[..., type[Component]], tmp_path: Path, kind: str
) -> None:
    written("tuned", PART)
    one = make("tuned", kind, "slot", tmp_path)
    one.set({"u": 1.0, "K": 1e3})
    one.initialize()
    for k in range(100):
        one.step(1e-3 * k, 1e-3)
    assert one.get(["y"]) == [10.0]  # 2 limit
    one.set({"limit": 3.0, "u": 2.0})
    assert one.get(["y", "twice", "u"]) == [6.0, 6.0, 2.0]
    one.set({"limit": 0.5})  # the start then leaves it as declared
    assert one.get(["y", "twice"]) == [0.0, 0.0]
    one.set({"limit": 4.0})
    for values, words in (
        ({"K": -1.0}, "slot: parameter K = -1 1 must be > 0"),
        ({"limit": 1e6, "u": 9.0}, "slot: limit = 1e+06 V is too large (t = 0.1 s)"),
        ({"tau": 1.0}, "slot: parameter tau is fixed once initialization has ended: reset first"),
    ):
        with pytest.raises(InstanceError) as refused:
            one.set(values)
        assert str(refused.value) == words
        assert one.get(["K", "limit", "u", "twice"]) == [1e3, 4.0, 2.0, 8.0]
    one.step(0.1, 1e-3)
    assert one.get(["y"]) == [8.0]
    one.free()


def test_a_part_that_refuses_by_its_inputs_keeps_what_its_start_reads(written: Callable[..., type[Component]]) -> None:
    asks = '        self.refuse(self.u * self.limit > 7.0, "moves")\n        if self.limit'
    cls = written("asking", PART.replace("        if self.limit", asks, 1))
    assert tunable(cls) == []  # K, limit, both, mixed are read at the start
    assert tuning(cls).derived == ()


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmpy_sets_them_between_steps(fmu: Callable[..., Path], fmi: int) -> None:
    """A drift of 1e-3 rad/s more from 0.5 s on: the float turns by H D / C more, J / C = 1 ms after the change."""
    path = fmu("floated_gyro", "native", fmi)
    d = fmpy.read_model_description(str(path))
    kinds = {v.name: v.variability for v in d.modelVariables if v.causality == "parameter"}
    assert kinds["D_F"] == kinds["H"] == kinds["D_I"] == "tunable"
    assert {kinds[n] for n in ("step", "seed", "white", "markov_tau", "terms")} == {"fixed"}
    series = np.array([(0.0, 0.0), (0.5, 0.0), (0.5, 1e-3), (1.0, 1e-3)], dtype=[("time", float), ("D_F", float)])
    quiet = {"white": 0.0, "markov": 0.0, "u_max": 1e9, "stop": 1.0, "pickoff": 0.0}
    found = fmpy.simulate_fmu(str(path), stop_time=1.0, output_interval=1e-3, input=series, start_values=quiet)
    start = {v.name: float(v.start) for v in d.modelVariables if v.name in ("H", "C", "K_sg")}
    rate = np.diff(found["u"])[[400, 700]] / 1e-3 / start["K_sg"]
    assert abs(rate[1] - rate[0]) == pytest.approx(start["H"] * 1e-3 / start["C"], rel=1e-6)


def test_descriptions_say_so(part: str, fmu: Callable[..., Path]) -> None:
    cls = load_part(part)
    d = fmpy.read_model_description(str(fmu(part, "native")), validate=False)
    said = {v.name for v in d.modelVariables if v.variability == "tunable"}
    assert said == {s.name for s in cls.layout if s.reference in tuning(cls).tunable}
