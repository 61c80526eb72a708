"""The two engines' common part (initialization) and the reference engine, a loop in Python.

One macro step k, from t0 + k h to t0 + (k+1) h, for each part in execution order: set its inputs from the buffer,
doStep, get the outputs that others need.  After the parts: a row of the windows when the watched output changed, a
row of the channels at every n-th step, and the end when the done output is not 0.  The native engine (engine.c) does
the same operations in the same order on the same arrays; the records of both are equal bit for bit.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gyrobench.engine.fmu_instance import Slave
from gyrobench.engine.program import Group, PartProgram, Program, Row

Array = np.ndarray[Any, np.dtype[np.float64]]
TIMED_EVERY = 1009  # a prime, so that periodic work of the parts is sampled evenly
TIMED_FIRST = 504  # not step 0, which finds everything cold


@dataclass
class Progress:
    """Where a run stands: steps done, simulated time, and rows recorded."""

    k: int = 0
    last: float = 0.0  # last value of the watched output
    finished: bool = False  # the done output became non-zero
    channel_rows: list[Array] = field(default_factory=list)  # blocks or single rows, [time, columns...]
    window_rows: list[Array] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)  # estimated time in each part
    timed: int = 0
    timed_seconds: dict[str, float] = field(default_factory=dict)


def gather(group: Group, out: Array) -> None:
    """Copies the sources of a set group into its values."""
    values = group.values
    for j, s in enumerate(group.source):
        values[j] = out[s] if group.kind == "Real" else int(out[s])
    for j, factor in group.scaled:
        values[j] *= factor


def take(slave: Slave, groups: list[Group], out: Array) -> None:
    """Reads get groups into ``out``."""
    for g in groups:
        slave.read(g)
        if g.kind != "Real":
            out[g.at : g.at + g.n] = g.values[:]


def give(slave: Slave, groups: list[Group], out: Array) -> None:
    """Writes set groups from ``out``."""
    for g in groups:
        gather(g, out)
        slave.write(g)


def settle(program: Program, slaves: Mapping[str, Slave]) -> None:
    """Propagates outputs to inputs in execution order until nothing changes (at most parts + 1 passes)."""
    for p in program.parts:
        take(slaves[p.slot], p.gets, program.out)
    for _ in range(len(program.parts) + 1):
        before = program.out.tobytes()
        for p in program.parts:
            give(slaves[p.slot], p.sets, program.out)
            take(slaves[p.slot], p.gets, program.out)
        if program.out.tobytes() == before:
            return


def initialize(program: Program, slaves: Mapping[str, Slave], t0: float) -> None:
    """Initialization of all parts with their initial outputs propagated, before and after its end.

    The parts are instantiated and have their parameters.
    """
    for p in program.parts:
        slaves[p.slot].initialize(t0)
    settle(program, slaves)
    for p in program.parts:
        slaves[p.slot].exit_initialization()
    settle(program, slaves)


def read_row(program: Program, slaves: Mapping[str, Slave], row: Row, rare: str, t: float) -> Array:
    """A row [t, columns...]; ``rare`` names the groups to read first ("channel_gets" or "window_gets")."""
    for p in program.parts:
        groups: list[Group] = getattr(p, rare)
        if groups:
            take(slaves[p.slot], groups, program.out)
    found = np.empty(1 + len(row.source))
    found[0] = t
    for j, (s, g) in enumerate(zip(row.source, row.gain, strict=True), 1):
        found[j] = program.out[s] if g == 1.0 else program.out[s] * g
    return found


def start(program: Program, slaves: Mapping[str, Slave], t0: float) -> Progress:
    """The state of a run right after initialization, with the first row of the channels."""
    progress = Progress()
    if program.watch >= 0:
        progress.last = float(program.out[program.watch])
    if program.channel.names:
        progress.channel_rows.append(read_row(program, slaves, program.channel, "channel_gets", t0))
    for p in program.parts:
        progress.timed_seconds[p.slot] = 0.0
    return progress


def _step(p: PartProgram, slave: Slave, out: Array, t: float, h: float) -> None:
    give(slave, p.sets, out)
    slave.do_step(t, h)
    take(slave, p.gets, out)


class ReferenceEngine:
    """The loop in Python on FMPy's API; runs any slave."""

    name = "reference"

    def __init__(self, program: Program, slaves: Mapping[str, Slave]) -> None:
        self.program, self.slaves = program, slaves
        self.pairs = [(p, slaves[p.slot]) for p in program.parts]

    def advance(self, progress: Progress, k_end: int, t0: float, h: float, every: int) -> None:
        """Runs steps until k_end or done; ``every`` steps a row of the channels.  Raises FmuCallError."""
        program, out = self.program, self.program.out
        clock = time.perf_counter
        for k in range(progress.k, k_end):
            t = t0 + k * h
            if k % TIMED_EVERY == TIMED_FIRST:
                progress.timed += 1
                for p, slave in self.pairs:
                    began = clock()
                    _step(p, slave, out, t, h)
                    progress.timed_seconds[p.slot] += clock() - began
            else:
                for p, slave in self.pairs:
                    _step(p, slave, out, t, h)
            progress.k = k + 1
            if program.watch >= 0 and out[program.watch] != progress.last:
                progress.last = float(out[program.watch])
                row = read_row(program, self.slaves, program.window, "window_gets", t0 + (k + 1) * h)
                progress.window_rows.append(row)
            if program.channel.names and (k + 1) % every == 0:
                row = read_row(program, self.slaves, program.channel, "channel_gets", t0 + (k + 1) * h)
                progress.channel_rows.append(row)
            if program.done >= 0 and out[program.done] != 0.0:
                progress.finished = True
                return

    def close(self) -> None:
        """Nothing to free."""
