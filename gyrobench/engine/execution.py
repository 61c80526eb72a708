"""Execution of a run on loaded FMUs: initialization, engine, checkpoints, to the end or to a failure."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gyrobench.engine.checkpoint import CheckpointManager, ResumeError
from gyrobench.engine.fmu_instance import FmuCallError, FmuInstance
from gyrobench.engine.program import Program
from gyrobench.engine.reference_engine import ReferenceEngine, RunState, initial_state, initialize
from gyrobench.engine.run_board import RunBoard
from gyrobench.engine.run_driver import EngineStopped, ProgressReport, Schedule, run_to_end
from gyrobench.system.binding import Bound
from gyrobench.system.fmu_variables import FAMILIES


@dataclass
class Job:
    """A run that is resolved and checked.

    starts: slot -> its parameters and start values, in the units of the FMU.  library: of the loop in C; None: the
    reference engine.  units: of the channels, SI.
    """

    program: Program
    starts: Mapping[str, list[tuple[Bound, Any]]]
    schedule: Schedule
    library: Path | None
    checkpoints: CheckpointManager | None = None
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass
class Ending:
    """End of a run.  state: None where it did not come to its first step.  problem: None for a whole run.

    remarks: on the FMUs, for the user.
    """

    state: RunState | None
    problem: FmuCallError | EngineStopped | ResumeError | None = None
    remarks: tuple[str, ...] = ()


def execute(
    job: Job,
    instances: Mapping[str, FmuInstance],
    board: RunBoard,
    progress: Callable[[ProgressReport], None] | None,
    stopped: Callable[[], bool],
) -> Ending:
    """Run a job on its FMUs, which are loaded; they have to be freed afterwards.

    Raises what is neither the fault of an FMU nor the wish of the user.
    """
    program, state, engine = job.program, None, None
    program.reset()
    status = board.status
    status.k, status.windows = -1, 0
    try:
        for slot in program.order:
            instances[slot].instantiate()
            instances[slot].set_start(job.starts[slot])
        initialize(program, instances, 0.0)
        state = initial_state(program, instances, 0.0)
        if job.checkpoints is not None:
            state = job.checkpoints.restore(state, program, instances)
        status.call = 0
        if board.keep is not None:
            board.keep(state.channel_rows, state.window_rows)
        status.windows = sum(map(len, state.window_rows))
        status.k = status.first = state.k
        engine = _engine(job, instances, board)
        run_to_end(engine, state, job.schedule, progress, stopped, job.checkpoints)
        return Ending(state)
    except (FmuCallError, EngineStopped, ResumeError) as error:
        if isinstance(error, FmuCallError) and error.time is not None:
            error = source_of_nan(error, program, instances)
        if job.checkpoints is not None and state is not None and isinstance(error, EngineStopped) and error.by_user:
            job.checkpoints.save_on_interrupt(state)
        return Ending(state, error)
    finally:
        status.call = 0
        if engine is not None:
            engine.close()


def source_of_nan(error: FmuCallError, program: Program, instances: Mapping[str, FmuInstance]) -> FmuCallError:
    """Return the error of the part whose output is no finite number, where another part could not take it.

    Sought from the part that failed back along the wires; the error itself where all that comes in is finite.
    """
    given = {}  # place in out -> slot, variable
    for p in program.parts:
        reals = [v for v in instances[p.slot].description.modelVariables if FAMILIES.get(v.type) == "Real"]
        names = {int(v.valueReference): v.name for v in reals if v.causality == "output"}
        for g in p.gets:
            each = [r for r, n in zip(g.references, g.sizes, strict=True) for _ in range(n)]
            given.update({g.at + j: (p.slot, names[r]) for j, r in enumerate(each) if r in names})
    given.update({to: given[source] for to, source in program.delays if source in given})
    incoming = {p.slot: [s for g in p.sets for s in g.source] for p in program.parts}
    slot, name, value, seen = error.slot, "", 0.0, {error.slot}
    while bad := [s for s in incoming[slot] if not math.isfinite(program.out[s]) and s in given]:
        if given[bad[0]][0] in seen:  # round a loop
            break
        (slot, name), value = given[bad[0]], float(program.out[bad[0]])
        seen.add(slot)
    if not name:
        return error
    said = [f"{error.slot} does not take it: {m.removeprefix(f'{error.slot}: ')}" for m in error.messages[:1]]
    return FmuCallError(slot, "doStep", f"its output {name} is {value:g}", error.time, said)


def _engine(job: Job, instances: Mapping[str, FmuInstance], board: RunBoard) -> Any:
    if job.library is not None:
        from gyrobench.engine.native_engine import NativeEngine

        return NativeEngine(job.program, instances, board, job.library)
    return ReferenceEngine(job.program, instances, board)
