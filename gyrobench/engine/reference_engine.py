"""The initialization that both engines share, and the reference engine, a loop in Python.

One communication step k, from t0 + k h to t0 + (k+1) h, for each part in execution order: set its inputs from the
buffer, doStep, get the outputs that others need.  After the parts: a row of the windows when the watched output
changed, a row of the channels at every n-th step, and the end when the done output is not 0.  The native engine
(engine.c) does the same operations in the same order on the same arrays; the records of both are equal bit for bit.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gyrobench.engine.fmu_instance import FmuInstance
from gyrobench.engine.program import PartProgram, Program, RecordRow, VariableGroup

Array = np.ndarray[Any, np.dtype[np.float64]]
TIMED_EVERY = 1009  # a prime, so that periodic work of the parts is sampled evenly
TIMED_FIRST = 504  # not step 0, which finds everything cold


@dataclass
class RunState:
    """State of a run: steps done, simulated time, rows recorded."""

    k: int = 0
    last: float = 0.0  # last value of the watched output
    finished: bool = False  # the done output became non-zero
    channel_rows: list[Array] = field(default_factory=list)  # blocks or single rows, [time, columns...]
    window_rows: list[Array] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)  # estimated time in each part
    timed: int = 0
    timed_seconds: dict[str, float] = field(default_factory=dict)


def gather(group: VariableGroup, out: Array) -> None:
    """Copy the sources of a set group into its values."""
    values = group.values
    for j, s in enumerate(group.source):
        values[j] = out[s] if group.kind == "Real" else int(out[s])
    for j, factor in group.scaled:
        values[j] *= factor


def read_outputs(instance: FmuInstance, groups: list[VariableGroup], out: Array) -> None:
    """Read get groups into ``out``."""
    for g in groups:
        instance.read(g)
        if g.kind != "Real":
            out[g.at : g.at + g.n] = g.values[:]


def write_inputs(instance: FmuInstance, groups: list[VariableGroup], out: Array) -> None:
    """Write set groups from ``out``."""
    for g in groups:
        gather(g, out)
        instance.write(g)


def propagate_initial_values(program: Program, instances: Mapping[str, FmuInstance]) -> None:
    """Propagate outputs to inputs in execution order until nothing changes (at most parts + 1 passes)."""
    for p in program.parts:
        read_outputs(instances[p.slot], p.gets, program.out)
    for _ in range(len(program.parts) + 1):
        before = program.out.tobytes()
        for p in program.parts:
            write_inputs(instances[p.slot], p.sets, program.out)
            read_outputs(instances[p.slot], p.gets, program.out)
        if program.out.tobytes() == before:
            return


def initialize(program: Program, instances: Mapping[str, FmuInstance], t0: float) -> None:
    """Initialize all parts, with their initial outputs propagated before and after the end of initialization.

    The parts are instantiated and have their parameters.
    """
    for p in program.parts:
        instances[p.slot].initialize(t0)
    propagate_initial_values(program, instances)
    for p in program.parts:
        instances[p.slot].exit_initialization()
    propagate_initial_values(program, instances)


def read_row(program: Program, instances: Mapping[str, FmuInstance], row: RecordRow, rare: str, t: float) -> Array:
    """Return a row [t, columns...]; ``rare`` names the groups to read first ("channel_gets" or "window_gets")."""
    for p in program.parts:
        groups: list[VariableGroup] = getattr(p, rare)
        if groups:
            read_outputs(instances[p.slot], groups, program.out)
    values = np.empty(1 + len(row.source))
    values[0] = t
    for j, (s, g) in enumerate(zip(row.source, row.gain, strict=True), 1):
        values[j] = program.out[s] if g == 1.0 else program.out[s] * g
    return values


def initial_state(program: Program, instances: Mapping[str, FmuInstance], t0: float) -> RunState:
    """Return the state of a run right after initialization, with the first row of the channels."""
    state = RunState()
    if program.watch >= 0:
        state.last = float(program.out[program.watch])
    if program.channel.names:
        state.channel_rows.append(read_row(program, instances, program.channel, "channel_gets", t0))
    for p in program.parts:
        state.timed_seconds[p.slot] = 0.0
    return state


def _step(p: PartProgram, instance: FmuInstance, out: Array, t: float, h: float) -> None:
    write_inputs(instance, p.sets, out)
    instance.do_step(t, h)
    read_outputs(instance, p.gets, out)


class ReferenceEngine:
    """The loop in Python on FMPy's API; runs every kind of instance."""

    name = "reference"

    def __init__(self, program: Program, instances: Mapping[str, FmuInstance]) -> None:
        self.program, self.instances = program, instances
        self.pairs = [(p, instances[p.slot]) for p in program.parts]

    def advance(self, state: RunState, k_end: int, t0: float, h: float, every: int) -> None:
        """Run steps until k_end or done; ``every`` steps a row of the channels.  Raises FmuCallError."""
        program, out = self.program, self.program.out
        clock = time.perf_counter
        for k in range(state.k, k_end):
            t = t0 + k * h
            if k % TIMED_EVERY == TIMED_FIRST:
                state.timed += 1
                for p, instance in self.pairs:
                    began = clock()
                    _step(p, instance, out, t, h)
                    state.timed_seconds[p.slot] += clock() - began
            else:
                for p, instance in self.pairs:
                    _step(p, instance, out, t, h)
            state.k = k + 1
            if program.watch >= 0 and out[program.watch] != state.last:
                state.last = float(out[program.watch])
                row = read_row(program, self.instances, program.window, "window_gets", t0 + (k + 1) * h)
                state.window_rows.append(row)
            if program.channel.names and (k + 1) % every == 0:
                row = read_row(program, self.instances, program.channel, "channel_gets", t0 + (k + 1) * h)
                state.channel_rows.append(row)
            if program.done >= 0 and out[program.done] != 0.0:
                state.finished = True
                return

    def close(self) -> None:
        """Do nothing: there is nothing to free."""
