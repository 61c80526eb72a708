"""The parts as plain classes, and a small fixed-order co-simulation of them."""

from __future__ import annotations

import ctypes
import itertools
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from native_parts import native_files

from gyrobench.component import Component, ComponentError, Parameter
from gyrobench.component.vectors import copied
from gyrobench.packaging import load_part
from gyrobench.packaging.instance import Fmu, InstanceError
from gyrobench.system.values import flatten

BENCH = Path(__file__).resolve().parents[2]
DEG_H = 3.141592653589793 / 180.0 / 3600.0

Site = load_part("site", BENCH)
Sequencer = load_part("sequencer", BENCH)
TableRate = load_part("table_rate", BENCH)
FloatedGyro = load_part("floated_gyro", BENCH)
RebalanceAnalog = load_part("rebalance_analog", BENCH)
Sampler = load_part("sampler", BENCH)

QUIET = {"markov": 0.0, "white": 0.0, "pickoff": 0.0}  # floated_gyro without noise
NO_DRIFT = dict.fromkeys(("D_F", "D_I", "D_O", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS"), 0.0)


def record(part: Any, n: int, h: float, name: str = "drift") -> np.ndarray:
    """Return an output after each of n steps of h."""
    found = []
    for k in range(n):
        part.do_step(k * h, h)
        found.append(np.copy(getattr(part, name)))
    return np.array(found)


def run(part: Any, seconds: float, h: float = 1e-3) -> np.ndarray:
    """Return the rates after each step."""
    return record(part, round(seconds / h), h, "rate")


WIRES = [
    ("site.f", "table.f_local"),
    ("site.omega", "table.omega_local"),
    ("sequencer.mode", "table.mode"),
    ("sequencer.target", "table.target"),
    ("sequencer.face", "table.face"),
    ("table.omega", "gyro.omega"),
    ("table.alpha", "gyro.alpha"),
    ("table.f", "gyro.f"),
    ("gyro.u", "rebalance.u"),
    ("rebalance.i", "gyro.i"),
    ("table.angle_read", "sequencer.angle"),
    ("table.in_position", "sequencer.in_position"),
    ("table.angle_read", "sampler.angle"),
    ("sequencer.gate", "sampler.gate"),
    ("sequencer.window", "sampler.window"),
    ("sequencer.phase", "sampler.phase"),
    ("rebalance.i_read", "sampler.x"),
    ("rebalance.saturated", "sampler.flag"),
]
ROW = ["window_phase", "mean", "std", "n", "angle_start", "angle_end", "t_start", "t_end", "flagged"]


def plan(phases: list[dict[str, Any]], faces: list[Any]) -> dict[str, Any]:
    """Parameters of the sequencer from a list of phases (mode, target, settle, dwell, travel, window, face)."""
    column = {"mode": "modes", "target": "targets", "window": "windows", "face": "face_of"}
    out: dict[str, Any] = {"phases": len(phases)}
    for key in ("mode", "target", "settle", "dwell", "travel", "window", "face"):
        default = 1 if key == "face" else 0.0
        values = [p.get(key, default) for p in phases]
        out[column.get(key, key)] = values + [default] * (99 - len(values))
    flat = [[float(x) for row in f for x in row] for f in faces]
    out["faces"] = flat + [[1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0]] * (12 - len(flat))
    return out


class Native:
    """A part as its native FMU, driven as the plain class is and equal to it bit for bit: for long runs.

    Values are read and written in the memory of the instance, which begins with them in the order of the value
    references (:mod:`gyrobench.engine.linked_system`).  An initialization may be repeated, as that of a plain part.
    """

    def __init__(self, name: str, **parameters: Any) -> None:
        layout, files = load_part(name, BENCH).layout, native_files(name)
        fmu = Fmu(files.folder / f"{name}.fmu", name, like=files)
        step = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int)
        vars(self).update(
            _fmu=fmu,
            _places={s.decl.name: (s.reference, s.decl.shape) for s in reversed(layout) if s.section != "derivative"},
            _values=(ctypes.c_double * len(layout)).from_address(fmu.fmu.component),
            _component=fmu.fmu.component,
            _step=step(("fmi2DoStep", fmu.fmu.dll)),
            _input=next((s for s in layout if s.section == "input"), None),
            _initialized=False,
            _written=False,
        )
        self._call(fmu.set, {e: x for n, v in parameters.items() for e, x in flatten(n, v).items()})

    def _call(self, function: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        try:
            return function(*arguments, **named)
        except InstanceError as error:
            raise ComponentError(str(error)) from None

    def initialize(self, t0: float = 0.0) -> None:
        values, fmu = list(self._values), self._fmu.fmu
        if self._initialized:
            self._call(self._fmu.reset)
            self._values[:] = values  # as the first initialization and the test have left them
        for call, given in (
            (fmu.setupExperiment, {"startTime": t0}),
            (fmu.enterInitializationMode, {}),
            (fmu.exitInitializationMode, {}),
        ):
            self._call(self._fmu._call, "initialize", call, **given)
        vars(self).update(_initialized=True, _written=False)

    def set(self, name: str, x: float) -> None:
        self._call(self._fmu.set, {name: x})

    def get(self, name: str) -> float:
        if self._written and self._input:  # the instance does not know of what is written to its memory
            self.set(self._input.name, self._values[self._input.reference])
        vars(self)["_written"] = False
        x: float = self._call(self._fmu.get, [name])[0]
        return x

    def do_step(self, t: float, h: float) -> None:
        if self._step(self._component, t, h, 1):
            raise ComponentError("; ".join(self._fmu.messages))

    def __getattr__(self, name: str) -> Any:
        try:
            first, shape = vars(self)["_places"][name]
        except KeyError:
            raise AttributeError(name) from None
        values = self._values
        if not shape:
            return values[first]
        if len(shape) == 1:  # tuples: a copy that is written to would be lost
            return tuple(values[first : first + shape[0]])
        rows, columns = shape
        return tuple(tuple(values[first + k * columns : first + (k + 1) * columns]) for k in range(rows))

    def __setattr__(self, name: str, x: Any) -> None:
        first, shape = self._places[name]
        vars(self)["_written"] = True
        if not shape:
            self._values[first] = x
            return
        flat = list(itertools.chain(*x)) if len(shape) > 1 else x
        assert len(flat) == math.prod(shape)
        self._values[first : first + len(flat)] = list(flat)

    def __del__(self) -> None:
        self._fmu.free()


def given(part: type[Component] | str, **values: Any) -> Any:
    """Return a part with these values; a name stands for its native FMU, a value that is no parameter is set in it."""
    native = isinstance(part, str)
    known = (load_part(part, BENCH) if native else part).declarations
    inner = {n: x for n, x in values.items() if n in known and not isinstance(known[n], Parameter)}
    parameters = {n: x for n, x in values.items() if n not in inner}
    made = Native(part, **parameters) if native else part(**parameters)
    for name, x in inner.items():
        setattr(made, name, x)
    return made


def begun(part: type[Component] | str, **values: Any) -> Any:
    """Return a part with these values, initialized."""
    made = given(part, **values)
    made.initialize()
    return made


class Wired:
    """Parts stepped in the given order; each sees the newest outputs, or (``late``) those of the step before."""

    def __init__(
        self, parts: Mapping[str, Component | Native], order: list[str], wires: Any = None, late: bool = False
    ) -> None:
        self.parts, self.order, self.late = parts, order, late
        self.wires: dict[str, list[tuple[str, str, str]]] = {name: [] for name in parts}
        for source, sink in wires or WIRES:
            (a, out), (b, into) = source.split("."), sink.split(".")
            if a in parts and b in parts:
                self.wires[b].append((a, out, into))
        self.rows: list[dict[str, float]] = []
        for _ in range(len(parts) + 1):  # initial outputs reach everybody
            for name in order:
                self._pull(name)
                parts[name].initialize(0.0)
        self.t = 0.0
        self.k = 0

    def _pull(self, name: str, values: dict[tuple[str, str], Any] | None = None) -> None:
        for a, out, into in self.wires[name]:
            x = values[a, out] if values else getattr(self.parts[a], out)
            setattr(self.parts[name], into, x)  # a part copies what is assigned to an array

    def step(self, h: float) -> None:
        before = None
        if self.late:
            before = {(a, o): copied(getattr(self.parts[a], o)) for w in self.wires.values() for a, o, _ in w}
        count = self.parts["sampler"].count if "sampler" in self.parts else 0.0
        for name in self.order:
            self._pull(name, before)
            self.parts[name].do_step(self.k * h, h)
        self.k += 1
        self.t = self.k * h
        if "sampler" in self.parts and self.parts["sampler"].count > count:
            self.rows.append({key: getattr(self.parts["sampler"], key) for key in ROW})

    def run(self, h: float, most: float, rows: int | None = None) -> list[dict[str, float]]:
        """Steps until the plan is done, or the sampler has given so many rows; its rows."""
        while self.parts["sequencer"].done == 0.0 and len(self.rows) != rows:
            assert self.t < most, f"the plan is not done after {most} s"
            self.step(h)
        return self.rows
