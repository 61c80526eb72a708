"""The native engine: the loop of :mod:`gyrobench.engine.reference_engine` in C (engine.c), on FMPy's instances.

The structures below mirror engine.c field by field.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from ctypes import POINTER, c_double, c_int32, c_int64, c_void_p
from typing import Any

import numpy as np

from gyrobench.engine.engine_library import engine_library
from gyrobench.engine.fmu_instance import STATUS, FmuCallError, LocalInstance
from gyrobench.engine.program import KINDS, Program, RecordRow, VariableGroup
from gyrobench.engine.reference_engine import RunState

BLOCK = 16384  # rows
MORE, DONE, FULL, FAILED = range(4)


class _Group(ctypes.Structure):
    _fields_ = (
        ("kind", c_int64),
        ("n", c_int64),
        ("call", c_void_p),
        ("references", c_void_p),
        ("values", c_void_p),
        ("out", c_void_p),
        ("source", c_void_p),
        ("n_scaled", c_int64),
        ("scaled", c_void_p),
        ("factor", c_void_p),
    )


class _Part(ctypes.Structure):
    _fields_ = (
        ("component", c_void_p),
        ("step", c_void_p),
        *((f"n_{g}", c_int64) for g in ("sets", "gets", "channel_gets", "window_gets")),
        *((g, POINTER(_Group)) for g in ("sets", "gets", "channel_gets", "window_gets")),
    )


class _Table(ctypes.Structure):
    _fields_ = (
        ("n", c_int64),
        ("rows", c_int64),
        ("capacity", c_int64),
        ("source", c_void_p),
        ("gain", c_void_p),
        ("block", c_void_p),
    )


class _Run(ctypes.Structure):
    _fields_ = (
        ("parts", POINTER(_Part)),
        ("n_parts", c_int64),
        ("out", c_void_p),
        ("t0", c_double),
        ("h", c_double),
        *((n, c_int64) for n in ("k", "every", "watch", "done")),
        ("last", c_double),
        ("channel", _Table),
        ("window", _Table),
        ("timed_seconds", c_void_p),
        *((n, c_int64) for n in ("timed", "failed_part", "failed_call", "failed_kind", "failed_status")),
    )


class NativeEngine:
    """The loop in C.  Every instance must be a LocalInstance.  Raises CompilerError where C cannot be compiled."""

    name = "native"

    def __init__(self, program: Program, instances: Mapping[str, LocalInstance]) -> None:
        self.library = engine_library()
        self.program = program
        self.instances = [instances[p.slot] for p in program.parts]
        self.keep: list[Any] = []
        self.run = _Run()
        parts = (_Part * len(program.parts))()
        for part, p, instance in zip(parts, program.parts, self.instances, strict=True):
            functions = instance.pointers()
            part.component = instance.component
            part.step = functions["DoStep"]
            for name in ("sets", "gets", "channel_gets", "window_gets"):
                groups: list[VariableGroup] = getattr(p, name)
                call = "Set" if name == "sets" else "Get"
                packed = (_Group * max(len(groups), 1))(*(self.group(g, functions[call + g.kind]) for g in groups))
                setattr(part, f"n_{name}", len(groups))
                setattr(part, name, ctypes.cast(packed, POINTER(_Group)))
                self.keep.append(packed)
        self.keep.append(parts)
        r = self.run
        r.parts, r.n_parts = ctypes.cast(parts, POINTER(_Part)), len(program.parts)
        r.out = program.out.ctypes.data
        r.watch, r.done = program.watch, program.done
        self.seconds = np.zeros(len(program.parts))
        r.timed_seconds = self.seconds.ctypes.data
        self.blocks = {
            "channel": self.table(r.channel, program.channel),
            "window": self.table(r.window, program.window),
        }

    def pointer(self, values: Any, kind: Any) -> int:
        array = (kind * max(len(values), 1))(*values)
        self.keep.append(array)
        return ctypes.addressof(array)

    def group(self, g: VariableGroup, call: int) -> _Group:
        self.keep.append(g)
        return _Group(
            KINDS.index(g.kind),
            g.n,
            call,
            ctypes.addressof(g.references),
            ctypes.addressof(g.values),
            self.program.out.ctypes.data + 8 * g.at,
            self.pointer(g.source, c_int32),
            len(g.scaled),
            self.pointer([j for j, _ in g.scaled], c_int32),
            self.pointer([f for _, f in g.scaled], c_double),
        )

    def table(self, table: _Table, row: RecordRow) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Allocate and return the block of a table of rows."""
        block = np.empty((BLOCK, 1 + len(row.source)))
        table.n, table.rows, table.capacity = len(row.source), 0, BLOCK
        table.source = self.pointer(row.source, c_int32)
        table.gain = self.pointer(row.gain, c_double)
        table.block = block.ctypes.data
        return block

    def drain(self, state: RunState) -> None:
        """Move the recorded rows into the state."""
        for name, rows in (("channel", state.channel_rows), ("window", state.window_rows)):
            table: _Table = getattr(self.run, name)
            if table.rows:
                rows.append(self.blocks[name][: table.rows].copy())
                table.rows = 0

    def advance(self, state: RunState, k_end: int, t0: float, h: float, every: int) -> None:
        """Run steps until k_end or done; ``every`` steps a row of the channels.  Raises FmuCallError."""
        r = self.run
        r.t0, r.h, r.k, r.every, r.last = t0, h, state.k, every, state.last
        r.timed = state.timed
        self.seconds[:] = [state.timed_seconds[p.slot] for p in self.program.parts]
        while True:
            code = self.library.gyrobench_run(ctypes.byref(r), c_int64(k_end))
            self.drain(state)
            if code != FULL:
                break
        state.k, state.last, state.timed = int(r.k), float(r.last), int(r.timed)
        for p, s in zip(self.program.parts, self.seconds, strict=True):
            state.timed_seconds[p.slot] = float(s)
        if code == DONE:
            state.finished = True
        if code == FAILED:
            instance = self.instances[r.failed_part]
            kind = KINDS[r.failed_kind]
            call = (f"set{kind}", "doStep", f"get{kind}")[r.failed_call]
            status = f"status {r.failed_status} ({STATUS[r.failed_status] if r.failed_status < 6 else 'unknown'})"
            raise FmuCallError(instance.slot, call, status, t0 + state.k * h, instance.messages())

    def close(self) -> None:
        """Release the arrays; the instances are freed by their owner."""
        self.keep.clear()
