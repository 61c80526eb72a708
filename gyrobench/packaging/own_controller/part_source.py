"""The part that a controller in a file of its own becomes: a model.py like every other, whose law is called."""

from __future__ import annotations

import re

from gyrobench.packaging.own_controller.declared_ports import Declarations, Declared

HEAD = '''\
"""{title}: made by gyrobench from its declarations."""

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.own_controller import {imports}
from gyrobench.component.math import vector

{law}


def law(inputs, state, parameters, dt):
    return LAW(inputs, state, parameters, dt)


class {cls}(Component):
    """{title}, called once in each sampling period.

    Ts = 0: at the end of each communication step, else at those of k Ts, k = 1, 2 ...; the outputs hold until the next
    call, and are 0 before the first.
    """

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    Ts = Parameter(0.0, "s", "sampling period, a whole multiple of the communication step; 0: each step", min=0.0)
{declarations}
    held = Discrete({zeros}, "1", "outputs of the last sample")
    clock = ControllerClock(Ts="Ts")

    @sampled(every=1)
    def tick(self) -> None:
        self.clock.tick()
        if self.clock_due > 0.5:
            answer = law({inputs}, {state}, {parameters}, self.clock_dt)
{answers}

    def outputs(self) -> None:
{outputs}
'''
CLASSES = {"input": "Input", "output": "Output", "parameter": "Parameter", "state": "Discrete"}
PYTHON = "LAW = PythonLaw({text!r}, {file!r}, {name!r}, {inputs!r}, {outputs!r}, {states!r}, {parameters!r})"


def class_name(stem: str) -> str:
    """Return the name of the class: ControllerMyPi of my_pi.c."""
    return "Controller" + "".join(word[:1].upper() + word[1:] for word in re.split(r"\W|_", stem))


def part_text(file: str, declared: Declarations, python: tuple[str, str] | None) -> str:
    """Return the text of model.py.

    file: name of the user's file.  python: text and name of the class; None for C, whose LAW the bench fills in when
    it has been compiled.
    """
    outputs, states = declared.of("output"), declared.of("state")
    law = "LAW = None"
    if python is not None:
        slots = {f"{k}s": [(d.name, d.n) for d in declared.of(k)] for k in CLASSES}
        law = PYTHON.format(text=python[0], file=file, name=python[1], **slots)
    ny = len(declared.shown("output"))
    targets = [f"self.held[{k}]" for k in range(ny)] + [f"self.{e}" for d in states for e in d.elements]
    held = [f"self.{e}" for d in outputs for e in d.elements]
    return HEAD.format(
        title=f"Controller of {file}",
        imports="ControllerClock, PythonLaw" if python is not None else "ControllerClock",
        law=law,
        cls=class_name(file.rsplit(".", 1)[0]),
        declarations="\n".join(f"    {_line(d)}" for d in declared.items),
        zeros=repr([0.0] * ny),
        **{f"{k}s" if k != "state" else k: _vector(declared.of(k)) for k in ("input", "state", "parameter")},
        answers="\n".join(f"            {t} = answer[{k}]" for k, t in enumerate(targets)),
        outputs="\n".join(f"        {o} = self.held[{k}]" for k, o in enumerate(held)),
    )


def _line(d: Declared) -> str:
    kind, doc = CLASSES[d.kind], d.doc
    if d.kind == "output":
        return f"{d.name} = Output({d.unit!r}, {doc!r}{f', ({d.n},)' if d.n else ''})"
    start = repr(list(d.start)) if d.n else repr(d.start[0])
    return f"{d.name} = {kind}({start}, {d.unit!r}, {doc!r})"


def _vector(items: list[Declared]) -> str:
    elements = [f"self.{e}" for d in items for e in d.elements] or ["0.0"]
    return f"vector([{', '.join(elements)}])"
