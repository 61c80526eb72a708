"""The native engine: the loop of :mod:`gyrobench.engine.reference_engine` in C (engine.c), on FMPy's instances.

The structures below mirror engine.c field by field.
"""

from __future__ import annotations

import contextlib
import ctypes
from collections.abc import Mapping
from ctypes import POINTER, c_double, c_int32, c_int64, c_void_p
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.engine.engine_library import open_library
from gyrobench.engine.fmu_instance import OUT_OF_RANGE, FmuCallError, FmuInstance, status_text
from gyrobench.engine.linked_system import checks_inputs
from gyrobench.engine.program import TYPES, Program, RecordRow, VariableGroup
from gyrobench.engine.reference_engine import RunState
from gyrobench.engine.run_board import BLOCK, CALLS, GET, SET, STEP, RunBoard, Status

MORE, DONE, FULL, FAILED = range(4)


class _Group(ctypes.Structure):
    _fields_ = (
        ("kind", c_int64),
        ("n_references", c_int64),
        ("n", c_int64),
        ("call", c_void_p),
        ("references", c_void_p),
        ("values", c_void_p),
        ("numbers", c_void_p),
        ("out", c_void_p),
        ("source", c_void_p),
        ("n_scaled", c_int64),
        ("scaled", c_void_p),
        ("factor", c_void_p),
        ("n_shifted", c_int64),
        ("shifted", c_void_p),
        ("offset", c_void_p),
    )


class _Part(ctypes.Structure):
    _fields_ = (
        ("component", c_void_p),
        ("step", c_void_p),
        ("fmi3", c_int64),
        *((f"n_{g}", c_int64) for g in ("sets", "gets", "channel_gets", "window_gets")),
        *((g, POINTER(_Group)) for g in ("sets", "gets", "channel_gets", "window_gets")),
        *((f, c_void_p) for f in ("quick_step", "finite", "get_state", "set_state", "free_state", "state")),
    )


class _Table(ctypes.Structure):
    _fields_ = (
        ("n", c_int64),
        ("capacity", c_int64),
        ("source", c_void_p),
        ("gain", c_void_p),
        ("offset", c_void_p),
        ("block", c_void_p),
    )


class _Run(ctypes.Structure):
    _fields_ = (
        ("at", POINTER(Status)),
        ("parts", POINTER(_Part)),
        ("n_parts", c_int64),
        ("out", c_void_p),
        ("t0", c_double),
        ("h", c_double),
        *((n, c_int64) for n in ("every", "watch", "done")),
        ("last", c_double),
        ("channel", _Table),
        ("window", _Table),
        ("timed_seconds", c_void_p),
        ("laps", c_void_p),
        ("instances", c_void_p),
        ("n_delays", c_int64),
        ("delayed", c_void_p),
        ("origin", c_void_p),
        *((n, c_int64) for n in ("timed", "failed_status", "repeated")),
    )


class NativeEngine:
    """The loop in C.

    library: file of the loop, on FMI calls or the linked form of the program, see
    :mod:`gyrobench.engine.engine_library` and :mod:`gyrobench.engine.linked_system`.
    """

    name = "native"

    def __init__(self, program: Program, instances: Mapping[str, FmuInstance], board: RunBoard, library: Path) -> None:
        self.library = open_library(library)
        self.linked = bool(ctypes.c_int.in_dll(self.library, "gyrobench_linked").value)
        self.program, self.board = program, board
        self.instances = [instances[p.slot] for p in program.parts]
        self.keep: list[Any] = []
        self.run = _Run()
        parts = (_Part * len(program.parts))()
        for part, p, instance in zip(parts, program.parts, self.instances, strict=True):
            part.component = instance.component
            part.step, part.fmi3 = instance.pointer("DoStep"), instance.fmi3
            if self.linked:
                if not checks_inputs(p):
                    part.step = instance.address("gyrobench_step")
                for function in ("quick_step", "finite"):
                    setattr(part, function, instance.address(f"gyrobench_{function}"))
                for function in ("get", "set", "free"):
                    address = instance.pointer(f"{function.capitalize()}{instance.state}")
                    setattr(part, f"{function}_state", address)
            for name in ("sets", "gets", "channel_gets", "window_gets"):
                groups: list[VariableGroup] = getattr(p, name)
                call = "Set" if name == "sets" else "Get"
                packed = (_Group * max(len(groups), 1))(
                    *(self.group(g, instance.pointer(call + g.type.call)) for g in groups)
                )
                setattr(part, f"n_{name}", len(groups))
                setattr(part, name, ctypes.cast(packed, POINTER(_Group)))
                self.keep.append(packed)
        self.keep.append(parts)
        r = self.run
        r.at = ctypes.pointer(board.status)
        r.parts, r.n_parts = ctypes.cast(parts, POINTER(_Part)), len(program.parts)
        r.out = program.out.ctypes.data
        r.watch, r.done = program.watch, program.done
        self.seconds = np.zeros(len(program.parts))
        r.timed_seconds = self.seconds.ctypes.data
        self.laps = np.zeros(len(program.parts))
        r.laps = self.laps.ctypes.data
        r.instances = self.pointer([i.component for i in self.instances], c_void_p)
        r.n_delays = len(program.delays)
        r.delayed = self.pointer([to for to, _ in program.delays], c_int32)
        r.origin = self.pointer([origin for _, origin in program.delays], c_int32)
        self.table(r.channel, program.channel, board.channel)
        self.table(r.window, program.window, board.window)

    def pointer(self, values: Any, kind: Any) -> int:
        array = (kind * max(len(values), 1))(*values)
        self.keep.append(array)
        return ctypes.addressof(array)

    def group(self, g: VariableGroup, call: int) -> _Group:
        self.keep.append(g)
        return _Group(
            g.code,
            g.n_references,
            g.n,
            call,
            ctypes.addressof(g.references),
            ctypes.addressof(g.values),
            ctypes.addressof(g.numbers),
            self.program.out.ctypes.data + 8 * g.at,
            self.pointer(g.source, c_int32),
            len(g.scaled),
            self.pointer([j for j, _ in g.scaled], c_int32),
            self.pointer([f for _, f in g.scaled], c_double),
            len(g.shifted),
            self.pointer([j for j, _ in g.shifted], c_int32),
            self.pointer([o for _, o in g.shifted], c_double),
        )

    def table(self, table: _Table, row: RecordRow, block: np.ndarray[Any, np.dtype[np.float64]]) -> None:
        """Fill in a table of rows."""
        table.n, table.capacity = len(row.source), BLOCK
        table.source = self.pointer(row.source, c_int32)
        table.gain = self.pointer(row.gain, c_double)
        table.offset = self.pointer(row.offset, c_double)
        table.block = block.ctypes.data

    def advance(self, state: RunState, k_end: int, t0: float, h: float, every: int) -> None:
        """Run steps until k_end or done; ``every`` steps a row of the channels.  Raises FmuCallError."""
        r, at = self.run, self.board.status
        r.t0, r.h, r.every, r.last = t0, h, every, state.last
        at.k, r.timed = state.k, state.timed
        self.seconds[:] = [state.timed_seconds[p.slot] for p in self.program.parts]
        while True:
            code = self.library.gyrobench_run(ctypes.byref(r), c_int64(k_end))
            call, at.call = at.call, 0
            self.board.drain(state.channel_rows, state.window_rows)
            if code != FULL:
                break
        state.k, state.last, state.timed = int(at.k), float(r.last), int(r.timed)
        for p, s in zip(self.program.parts, self.seconds, strict=True):
            state.timed_seconds[p.slot] = float(s)
        if code == DONE:
            state.finished = True
        if code == FAILED:
            instance, when = self.instances[at.part], t0 + state.k * h
            if self.linked:  # doStep tells why a step failed
                with contextlib.suppress(FmuCallError):
                    instance.do_step(when, h)
                at.call = 0
            if r.failed_status == OUT_OF_RANGE:
                kind = TYPES[call - (GET if call > STEP else SET)]
                raise FmuCallError(instance.slot, CALLS[call], kind.refusal, when)
            raise FmuCallError(instance.slot, CALLS[call], status_text(r.failed_status), when, instance.messages())

    def close(self) -> None:
        """Release the arrays; the instances are freed by their owner."""
        self.keep.clear()
