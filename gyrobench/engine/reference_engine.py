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

import numpy as np

from gyrobench.arrays import Array
from gyrobench.engine.fmu_instance import FmuCallError, FmuInstance
from gyrobench.engine.program import PartProgram, Program, RecordRow, VariableGroup
from gyrobench.engine.run_board import RunBoard

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


def gather(group: VariableGroup, out: Array) -> bool:
    """Copy the sources of a set group into its values; return False for a number that the type does not hold."""
    numbers = group.numbers
    for j, s in enumerate(group.source):
        numbers[j] = out[s]
    for j, factor in group.scaled:
        numbers[j] *= factor
    for j, offset in group.shifted:
        numbers[j] += offset
    return group.doubles or _convert(group)


def _convert(group: VariableGroup) -> bool:
    values, low, high = group.values, group.type.lowest, group.type.highest
    if low is None or high is None:
        values[:] = group.numbers[:]
        return True
    for j, x in enumerate(group.numbers):
        if not low <= x <= high:
            return False
        values[j] = int(x)
    return True


def read_outputs(instance: FmuInstance, groups: list[VariableGroup], out: Array) -> None:
    """Read get groups into ``out``.  Raises FmuCallError for a number beyond the whole numbers of a double."""
    for g in groups:
        instance.read(g)
        if not g.doubles:
            low, high = g.type.lowest, g.type.highest
            if low is not None and high is not None and not all(low <= x <= high for x in g.values):
                raise FmuCallError(instance.slot, f"get{g.type.call}", g.type.refusal, None)
            out[g.at : g.at + g.n] = g.values[:]


def write_inputs(instance: FmuInstance, groups: list[VariableGroup], out: Array) -> None:
    """Write set groups from ``out``."""
    for g in groups:
        if not gather(g, out):
            raise FmuCallError(instance.slot, f"set{g.type.call}", g.type.refusal, None)
        instance.write(g)


def _delay(program: Program) -> None:
    """Copy the values that are delayed by a communication step."""
    for to, source in program.delays:
        program.out[to] = program.out[source]


def propagate_initial_values(program: Program, instances: Mapping[str, FmuInstance]) -> None:
    """Propagate outputs to inputs in execution order until nothing changes (at most parts + 1 passes)."""
    for p in program.parts:
        read_outputs(instances[p.slot], p.gets, program.out)
    for _ in range(len(program.parts) + 1):
        before = program.out.tobytes()
        _delay(program)
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
        read_outputs(instances[p.slot], p.holds, program.out)
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
    for j, (s, g, o) in enumerate(zip(row.source, row.gain, row.offset, strict=True), 1):
        values[j] = program.out[s] if g == 1.0 else program.out[s] * g
        if o != 0.0:
            values[j] += o
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

    def __init__(self, program: Program, instances: Mapping[str, FmuInstance], board: RunBoard) -> None:
        self.program, self.instances, self.board = program, instances, board
        self.pairs = [(p, instances[p.slot]) for p in program.parts]

    def advance(self, state: RunState, k_end: int, t0: float, h: float, every: int) -> None:
        """Run steps until k_end or done; ``every`` steps a row of the channels.  Raises FmuCallError."""
        try:
            self._advance(state, k_end, t0, h, every)
        except FmuCallError as error:
            if error.time is not None:
                raise
            raise FmuCallError(error.slot, error.call, error.status, t0 + state.k * h, error.messages) from None
        finally:
            self.board.status.call = 0
            self.board.drain(state.channel_rows, state.window_rows)

    def _advance(self, state: RunState, k_end: int, t0: float, h: float, every: int) -> None:
        program, out = self.program, self.program.out
        board, at = self.board, self.board.status
        clock = time.perf_counter
        for k in range(state.k, k_end):
            if board.full:
                board.drain(state.channel_rows, state.window_rows)
            t = t0 + k * h
            _delay(program)
            if k % TIMED_EVERY == TIMED_FIRST:
                state.timed += 1
                for p, instance in self.pairs:
                    began = clock()
                    _step(p, instance, out, t, h)
                    state.timed_seconds[p.slot] += clock() - began
            else:
                for p, instance in self.pairs:
                    _step(p, instance, out, t, h)
            at.k = state.k = k + 1
            if program.watch >= 0 and out[program.watch] != state.last:
                state.last = float(out[program.watch])
                row = read_row(program, self.instances, program.window, "window_gets", t0 + (k + 1) * h)
                board.window[at.window_rows] = row
                at.window_rows += 1
            if program.channel.names and (k + 1) % every == 0:
                row = read_row(program, self.instances, program.channel, "channel_gets", t0 + (k + 1) * h)
                board.channel[at.channel_rows] = row
                at.channel_rows += 1
            if program.done >= 0 and out[program.done] != 0.0:
                state.finished = True
                return

    def close(self) -> None:
        """Do nothing: there is nothing to free."""
