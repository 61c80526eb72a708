"""A controller in a file of its own, as a part: its sampling instants, and the call of a class in Python."""

from __future__ import annotations

import difflib
import math
import pickle
import traceback
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from gyrobench.component.composition import Block, ComponentError
from gyrobench.component.declarations import Discrete, Parameter
from gyrobench.component.math import fabs, floor

PLAIN = (bool, int, float, complex, str, bytes, type(None))  # values that only change by another assignment
Slots = Sequence[tuple[str, int]]  # name and elements (0: a number) of what is declared


class ControllerClock(Block):
    """Sampling instants at the ends of the communication steps k Ts, k = 1, 2 ...; Ts = 0: of each.

    The part calls `tick` in each internal step, which is one for each communication step.
    """

    Ts = Parameter(0.0, "s", "sampling period, a whole multiple of the communication step; 0: each step", min=0.0)
    due = Discrete(0.0, "1", "1 at a sampling instant")
    left = Discrete(1.0, "1", "communication steps until the next one")
    every = Discrete(1.0, "1", "communication steps in a sampling period")
    coupling = Discrete(0.0, "s", "communication step that `every` holds for")
    dt = Discrete(0.0, "s", "sampling period")

    def tick(self) -> None:
        if fabs(self.h - self.coupling) > 1e-9 * self.h:
            self.coupling = self.h
            self.every = 1.0
            self.dt = self.h
            if self.Ts > 0.0:
                self.every = floor(self.Ts / self.h + 0.5)
                self.dt = self.Ts
                self.refuse(
                    self.every < 0.5 or fabs(self.every * self.h - self.Ts) > 1e-6 * self.Ts,
                    "Ts = {Ts} s must be a whole multiple of the communication step, {coupling} s",
                )
            self.left = self.every
        self.left = self.left - 1.0
        self.due = 0.0
        if self.left < 0.5:
            self.left = self.every
            self.due = 1.0


class Inputs:
    """The argument of `step`: the inputs by name, numbers or lists."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names

    def __getattr__(self, name: str) -> Any:
        near = difflib.get_close_matches(name, self._names, n=1)
        hint = f"did you mean {near[0]}?" if near else f"there are: {', '.join(self._names) or 'none'}"
        raise AttributeError(f"no input '{name}' is declared; {hint}")


class PythonLaw:
    """One sample of a controller by a class of the user: ``step(self, inputs, dt)``.

    text, file, name: the file, its name in messages, the class.  Parameters and states are attributes of the object;
    what else it keeps must not change, since a run could not be taken up again, nor linearized: that is an error.
    Called with numbers in the order of the declarations; returns the outputs, then the states.  Raises ComponentError,
    with the line of the user's file.
    """

    def __init__(
        self, text: str, file: str, name: str, inputs: Slots, outputs: Slots, states: Slots, parameters: Slots
    ) -> None:
        self.file, self.inputs, self.outputs, self.states = file, inputs, outputs, states
        self.given = (*parameters, *states)
        space: dict[str, Any] = {"__name__": "controller", "__file__": file}
        self.guarded(exec, compile(text, file, "exec"), space)
        self.object = self.guarded(space[name])
        self.step = self.object.step
        self.owned = {n for n, _ in self.given}
        self.kept = self.others()
        self.arrays = self.mutable()

    def __call__(self, inputs: Any, state: Any, parameters: Any, dt: float) -> list[float]:
        box = Inputs([n for n, _ in self.inputs])
        vars(box).update(_named(self.inputs, inputs))
        vars(self.object).update(_named(self.given, [*_used(self.given, self.states, parameters), *state]))
        answer = self.guarded(self.step, box, dt)
        numbers = self.numbers("returns", self.outputs, self.by_order(answer))
        after = self.numbers("leaves", self.states, [getattr(self.object, n) for n, _ in self.states])
        if self.others() != self.kept or self.mutable() != self.arrays:
            self.refuse_hidden()
        return [*numbers, *after]

    def guarded(self, function: Callable[..., Any], *args: Any) -> Any:
        """Call code of the user; its exceptions become ComponentErrors with their line."""
        try:
            return function(*args)
        except Exception as error:
            lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == self.file]
            where = f"{self.file}:{lines[-1]}" if lines else self.file
            raise ComponentError(f"{where}: {type(error).__name__}: {error}") from None

    def by_order(self, answer: Any) -> list[Any]:
        """Return what `step` gives for each output."""
        names = [n for n, _ in self.outputs]
        declared = f"declared {'is' if len(names) == 1 else 'are'}: {', '.join(names)}"
        if isinstance(answer, Mapping):
            for name in answer:
                if name not in names:
                    near = difflib.get_close_matches(str(name), names, n=1)
                    raise ComponentError(
                        f"{self.file}: step() returns '{name}'; " + (f"did you mean {near[0]}?" if near else declared)
                    )
            if missing := [n for n in names if n not in answer]:
                raise ComponentError(f"{self.file}: step() does not return {', '.join(missing)}")
            return [answer[n] for n in names]
        several = isinstance(answer, tuple | list)
        values = list(answer) if several and (len(names) > 1 or self.outputs[0][1] == 0) else [answer]
        if answer is None or len(values) != len(names):
            given = "nothing" if answer is None else f"{len(values)} value{'s' * (len(values) != 1)}"
            raise ComponentError(f"{self.file}: step() returns {given} for {len(names)}; {declared}")
        return values

    def numbers(self, verb: str, slots: Slots, values: Sequence[Any]) -> list[float]:
        """Return values as a list of numbers; of the wrong size, or not finite, they raise ComponentError."""
        found: list[float] = []
        for (name, n), value in zip(slots, values, strict=True):
            try:
                elements = [float(x) for x in value] if n else [float(value)]
            except (TypeError, ValueError):
                expected = f"{n} numbers" if n else "a number"
                raise ComponentError(f"{self.file}: step() {verb} {name} = {value!r}: {expected} expected") from None
            if len(elements) != max(n, 1):
                raise ComponentError(f"{self.file}: step() {verb} {len(elements)} numbers for {name}[{n}]")
            for k, x in enumerate(elements):
                if not math.isfinite(x):
                    raise ComponentError(f"{self.file}: step() {verb} {name}{f'[{k + 1}]' if n else ''} = {x:g}")
            found += elements
        return found

    def others(self) -> dict[str, int]:
        """Return what the object keeps beside parameters and states: name -> which object it is."""
        return {
            n: hash(repr(x)) if isinstance(x, PLAIN) else id(x)
            for n, x in vars(self.object).items()
            if n not in self.owned
        }

    def mutable(self) -> bytes:
        """Return the content of the lists, arrays and objects among them; nothing of what cannot be written so."""
        found = [x for n, x in vars(self.object).items() if n not in self.owned and not isinstance(x, PLAIN)]
        try:
            return pickle.dumps(found) if found else b""
        except Exception:
            return b""

    def refuse_hidden(self) -> None:
        now = self.others()
        changed = [n for n in (*now, *self.kept) if now.get(n) != self.kept.get(n)]
        name = changed[0] if changed else next(n for n in now if not isinstance(getattr(self.object, n), PLAIN))
        raise ComponentError(
            f"{self.file}: step() changes self.{name}, which is not declared; write its line: @state {name} [1] what "
            "it is"
        )


def _used(given: Slots, states: Slots, parameters: Sequence[float]) -> list[float]:
    """Return the numbers of the parameters: an array without elements is handed over as one 0."""
    n = sum(max(k, 1) for _, k in given) - sum(max(k, 1) for _, k in states)
    return [float(x) for x in parameters][:n]


def _named(slots: Slots, numbers: Sequence[float]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    at = 0
    for name, n in slots:
        found[name] = [float(x) for x in numbers[at : at + n]] if n else float(numbers[at])
        at += max(n, 1)
    return found
