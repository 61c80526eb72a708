"""The parts as plain classes, and a small fixed-order co-simulation of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gyrobench.component import Component
from gyrobench.component.vectors import copied
from gyrobench.packaging import load_part
from gyrobench.packaging.instance import make
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
    """A part as its native FMU, driven as the plain class is: ``set``, ``do_step``, numbers as attributes.

    For long runs: five times as fast.
    """

    def __init__(self, name: str, **parameters: Any) -> None:
        self._fmu = make(name, "native", bench=BENCH)
        self._fmu.set({e: x for n, v in parameters.items() for e, x in flatten(n, v).items()})

    def initialize(self) -> None:
        self._fmu.initialize()

    def set(self, name: str, x: float) -> None:
        self._fmu.set({name: x})

    def get(self, name: str) -> float:
        return self._fmu.get([name])[0]

    def do_step(self, t: float, h: float) -> None:
        self._fmu.step(t, h)

    def __getattr__(self, name: str) -> float:
        return self.get(name)

    def __del__(self) -> None:
        self._fmu.free()


class Wired:
    """Parts stepped in the given order; each sees the newest outputs, or (``late``) those of the step before."""

    def __init__(self, parts: dict[str, Component], order: list[str], wires: Any = None, late: bool = False) -> None:
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
