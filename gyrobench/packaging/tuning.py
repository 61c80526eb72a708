"""Which parameters of a part may be set between steps ("tunable" in FMI), and what of the start follows from them.

A value that ``start`` makes is *derived* where it is a discrete that nothing changes later and that follows from
parameters alone: it is made anew when one of them is set.  A parameter is tunable where the equations read it, or what
is derived from it, but

- not the size of a noise, the internal step, or what is no real number;
- not where a value follows from it that the start makes of inputs too and nothing changes later;
- not where it is read under a condition on a discrete that is changed there, and so may be kept from then on:
  ``if self.h != self.h_last`` before a coefficient is made.

What else the start makes is state.  So the run from there on is that of a part that was started with the new value and
has the same state.  Where ``start`` refuses for what inputs are, no parameter that it reads is tunable: it could not be
tried again.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, replace

from gyrobench.component import Component, Discrete, Input, Parameter, State
from gyrobench.component.composition import TIMES
from gyrobench.packaging.dependencies import (
    REFUSAL,
    Dependencies,
    flat_name,
    reached,
    read_names,
    written,
    written_names,
)
from gyrobench.packaging.source import Code, PartCode


@dataclass(frozen=True)
class Tuning:
    """Value references of a part.

    tunable: of the parameters that may be set between steps.  derived: of what the start makes of parameters alone,
    rising.
    """

    tunable: frozenset[int]
    derived: tuple[int, ...]


_known: dict[type[Component], Tuning] = {}


def tuning(cls: type[Component]) -> Tuning:
    """Return what may be set between steps; see the module.  Raises SubsetError."""
    if cls not in _known:
        _known[cls] = _tuning(cls)
    return _known[cls]


def _tuning(cls: type[Component]) -> Tuning:
    source = PartCode(cls)
    declared = cls.declarations
    sizes = {n.name for n in cls.noises}
    parameters = {n for n, d in declared.items() if isinstance(d, Parameter)}
    known = [*declared, *TIMES, *(f"noise.{n}" for n in sizes)]
    starts = [code for _, code in source.equations["start"]]
    reach = Dependencies(source, ["start"], known).reach
    made = set().union(*(written_names(code, source) for code in starts))
    pure, before = set(made), set[str]()
    while pure != before:  # what follows from a value that is not made of parameters alone is not either
        before = pure
        pure = {n for n in pure if reach.get(n, set()) <= parameters | pure}
    constant = {n for n in made if isinstance(declared.get(n), Discrete)} - written(source)
    derived = constant & pure
    fixed = sizes | {"seed", "step"} | {n for code in _kept(source) for n in read_names(code, source)}
    fixed = fixed.union(*(reach[n] for n in constant - pure))
    if not reach.get(REFUSAL, set()) <= parameters | pure:
        fixed = fixed.union(*(read_names(code, source) for code in starts))
        derived = set()
    later = [code for kind in ("flow", "outputs", "sampled") for _, code in source.equations[kind]]
    used = set().union(*(read_names(code, source) for code in later))
    used = used.union(*(reach[n] for n in derived & used))
    names = {n for n in used & parameters - fixed if declared[n].type is float}
    return Tuning(
        frozenset(s.reference for s in cls.layout if s.section == "parameter" and s.decl.name in names),
        tuple(s.reference for s in cls.layout if s.section == "discrete" and s.decl.name in derived),
    )


def _kept(source: PartCode) -> Iterator[Code]:
    """Yield the branches that decide by a discrete that they change whether they run again."""
    declared = source.cls.declarations

    def moves(name: str) -> bool:
        """Return whether a name may be another at any step, whatever the part has done."""
        running = name in TIMES and name != "h"
        return running or name.startswith(("der.", "noise.")) or isinstance(declared.get(name), Input | State)

    for kind in ("sampled", "flow", "outputs"):
        for _, equation in source.equations[kind]:
            for code in reached(equation, source):
                for n in code.nodes():
                    for test in _tests(n):
                        read = {flat_name(e, code, source) or "" for e in ast.walk(test)} - {""}
                        assert isinstance(n, ast.If)
                        body = ast.FunctionDef(code.node.name, code.node.args, n.body, [], lineno=n.lineno)
                        branch = replace(code, node=body)
                        if not any(map(moves, read)) and read & written_names(branch, source) & set(declared):
                            yield branch


def _tests(n: ast.AST) -> list[ast.expr]:
    """Return the conditions that must hold for the branch of an ``if``; none of other nodes."""
    if not isinstance(n, ast.If):
        return []
    return n.test.values if isinstance(n.test, ast.BoolOp) and isinstance(n.test.op, ast.And) else [n.test]
