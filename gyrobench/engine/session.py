"""Runs of a system: its FMUs built or loaded, bound, checked and ordered once, then run, each run with its record.

    record = run(load_system("tumble_single_axis"), values={"latitude": "45.75deg"}, seed=3, out=Path("reports/out/x"))

A :class:`Session` is prepared once (unzip, load, bind, order) and runs many times with other values and seeds.
"""

from __future__ import annotations

import contextlib
import datetime
import shutil
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeAlias

from gyrobench.engine import preflight
from gyrobench.engine.beside import beside
from gyrobench.engine.checkpoint import CheckpointManager, ResumeError
from gyrobench.engine.execution import Ending, Job, execute
from gyrobench.engine.fmi3_instance import new_instance
from gyrobench.engine.fmu_instance import FmuCallError, FmuInstance
from gyrobench.engine.limits import limit_flags, limits_reached
from gyrobench.engine.program import build_program
from gyrobench.engine.reference_engine import RunState
from gyrobench.engine.run_board import RunBoard
from gyrobench.engine.run_driver import EngineStopped, Interrupts, ProgressReport, Schedule
from gyrobench.engine.run_errors import ParameterRefusedError, RunError, RunInterrupted
from gyrobench.files import sha256, temporary_folder, unzip_fmu
from gyrobench.record.record import Record, rows_to_columns
from gyrobench.record.run_document import LinearModels, PartInfo, PlanRow, RunDocument, package_versions
from gyrobench.system.parameters import Starts, defaults, resolve
from gyrobench.system.part_files import resolve_parts
from gyrobench.system.recorded_units import recorded_units
from gyrobench.system.setup_errors import setup_errors
from gyrobench.system.system import InvalidConfigurationError, System, load_system
from gyrobench.system.values import InvalidValueError
from gyrobench.system.wiring import Assembly, assemble

TIMEOUT = 60.0  # s
ENGINES = ("native", "linked", "reference")
LinearFound: TypeAlias = tuple[LinearModels, list[str]]  # and their warnings


class Session:
    """A system with its FMUs unzipped and loaded, for one run or a thousand.

    parts: slot -> path of an FMU or name of a part (default: the slot's).  maps: slot -> mapping file.
    engine: "native" (FMI calls), "linked" (native parts of the bench: :mod:`gyrobench.engine.linked_system`),
    "reference" or None (native where it can, linked where it is worth it).  target: of the parts that are built,
    "native" or "python".  child: each run happens in a child process that loads the FMUs, see
    :mod:`gyrobench.engine.supervision`; else in this one, which a crash of an FMU ends: for workers whose death is
    seen.  timeout: s for one call of an FMU in a child.  prebuilt: part of the bench -> its FMU, where it was built
    elsewhere.
    Use as a context manager, or call :meth:`close`.
    Raises BenchError, BuildError, SocketMismatchError, WiringError, AlgebraicLoopError before anything is loaded.
    """

    def __init__(
        self,
        system: System | str,
        parts: Mapping[str, Path | str] | None = None,
        maps: Mapping[str, Path] | None = None,
        *,
        engine: str | None = None,
        target: str = "native",
        bench: Path | None = None,
        child: bool = False,
        timeout: float = TIMEOUT,
        prebuilt: Mapping[str, Path] | None = None,
    ) -> None:
        if engine not in (None, *ENGINES):
            raise InvalidValueError(f"engine '{engine}': one of {', '.join(ENGINES)}")
        self.system = load_system(system, bench) if isinstance(system, str) else system
        self.child, self.timeout = child, timeout
        self.notes: list[str] = []
        paths, self.built = resolve_parts(self.system, parts or {}, target, bench, self.notes, prebuilt)
        self.swaps = {slot: Path(part).stem for slot, part in (parts or {}).items()}
        self.swapped = sorted(self.swaps)
        self.warned: set[str] = set()
        self.bench = bench
        self.names = {s: str((parts or {}).get(s, self.system.slots[s].part)) for s in self.built}
        self.assembly: Assembly = assemble(self.system, paths, maps)
        self.notes += self.assembly.notes
        if found := preflight.controller_problems(self.assembly, self.names):
            raise InvalidConfigurationError(self.system.name, found)
        self.program = build_program(self.assembly)
        self.gains = [(c.gain, c.offset) for c in self.assembly.connections]
        self.base = defaults(self.assembly)
        self.hashes = {slot: sha256(p) for slot, p in paths.items()}
        self.foreign = [slot for slot in paths if slot not in self.built]
        self.notes += [f"{s}: {paths[s].name} is not of this bench: SHA-256 {self.hashes[s]}" for s in self.foreign]
        if found := preflight.problems(self.assembly, self.foreign):
            raise InvalidConfigurationError(self.system.name, found)
        self.engine = self._choose(engine)
        self.linkable = self.engine != "reference" and engine != "native" and not self._obstacle()
        self.steps = 0  # of all runs
        self.folder = temporary_folder()
        self.instances: dict[str, FmuInstance] = {}
        self.board: RunBoard | None = None
        try:
            for slot, path in paths.items():
                unzip_fmu(path, self.folder / slot)
            if not child:
                self._load()
        except BaseException as error:
            self.close()
            if isinstance(error, FmuCallError):
                raise RunError(str(error)) from None
            raise

    def _choose(self, engine: str | None) -> str:
        if engine == "reference":
            return engine
        from gyrobench.engine.engine_library import engine_library
        from gyrobench.packaging import CompilerError

        try:
            engine_library()
        except CompilerError as error:
            self.notes.append(f"reference engine (about a hundred times slower than native): {error}")
            return "reference"
        if engine == "linked" and (why := self._obstacle()):
            raise InvalidValueError(f"engine 'linked': {why}")
        return engine or "native"

    def _obstacle(self) -> str:
        from gyrobench.engine.linked_system import obstacle

        native = {slot: name for slot, name in self.names.items() if self.built[slot] == "native"}
        guids = {slot: d.guid for slot, d in self.assembly.descriptions.items()}
        return obstacle(self.program, native, guids, self.bench)

    def _library(self, system: System) -> tuple[Path | None, bool]:
        """Return the file of the loop in C, None for the reference engine, and whether it is that of the linked form:
        where that is asked for or, with the runs before, worth it.
        """
        from gyrobench.engine.engine_library import engine_library
        from gyrobench.engine.linked_system import linked_library
        from gyrobench.packaging import CompilerError

        if self.engine == "reference":
            return None, False
        if self.linkable:
            steps = self.steps + (system.stop or system.plan().duration()) / system.step
            try:
                if library := linked_library(self.program, None if self.engine == "linked" else steps):
                    return library, True
            except CompilerError:
                if self.engine == "linked":
                    raise
                self.linkable = False  # the loop on FMI calls was brought here, or is in the cache
        return engine_library(), False

    def _load(self) -> None:
        """Load the FMUs into this process."""
        self.board = RunBoard(self.program)
        for part, slot in enumerate(self.program.order):
            description = self.assembly.descriptions[slot]
            self.instances[slot] = new_instance(slot, description, self.folder / slot, self.board.status, part)

    def _execute(self, job: Job, progress: Callable[[ProgressReport], None] | None) -> Ending:
        if self.child:
            from gyrobench.engine.supervision import supervise

            fmus = {slot: (self.assembly.descriptions[slot], self.folder / slot) for slot in self.program.order}
            return supervise(job, fmus, self.folder, progress, self.timeout)
        assert self.board is not None
        try:
            with Interrupts() as interrupts:
                return execute(job, self.instances, self.board, progress, lambda: interrupts.pressed)
        finally:
            for instance in self.instances.values():
                instance.free()

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free all FMUs and remove the unzipped files."""
        for instance in self.instances.values():
            instance.close()
        self.instances = {}
        shutil.rmtree(self.folder, ignore_errors=True)

    def prepare(
        self, values: Mapping[str, Any] | None = None, seed: int = 1, step: float | None = None
    ) -> tuple[System, Starts, RunDocument]:
        """Return the system with further values, the start values of its parts and what is known before the run.

        Raises InvalidConfigurationError and InvalidValueError; warnings are logged.
        """
        system, starts, document, take = self._prepare(values, seed, step)
        if system.loops:
            take(self._linear(system, document.parameters))
        return system, starts, document

    def _prepare(
        self, values: Mapping[str, Any] | None, seed: int, step: float | None
    ) -> tuple[System, Starts, RunDocument, Callable[[LinearFound], None]]:
        """Return the same without the linear models, and what takes them when they are found."""
        system = self.system.with_values(values or {})
        if step is not None:
            system.step = float(step)
        if not 0.0 < system.step < float("inf"):
            raise InvalidValueError(f"step = {system.step} s: must be > 0")
        system.refuse()
        if found := preflight.step_problems(self.assembly, system.step):
            raise InvalidConfigurationError(system.name, found)
        starts, parameters, notes = resolve(self.assembly, system, seed, self.base)
        notes = [*preflight.remarks(self.assembly, self.foreign, system.step), *notes]
        if problems := system.check_parameters(parameters):
            raise InvalidConfigurationError(system.name, problems)
        errors = setup_errors(self.assembly, system, seed, self.base, parameters)
        self._warn(system, [f"simulated set-up error: {e.sentence()}" for e in errors])
        self._warn(system, [*notes, *system.warnings()])
        gains = [(c.gain, c.offset) for c in self.assembly.connections]
        if gains != self.gains:  # factors of wires follow the parts
            self.program, self.gains = build_program(self.assembly), gains
        document = self._document(system, seed, parameters, notes)
        if errors:
            document.setup_errors = errors

        def take(found: LinearFound) -> None:
            document.linear, warnings = found
            at = len(self.notes) + len(notes)
            document.notes[at:at] = warnings
            self._warn(system, warnings)

        return system, starts, document, take

    def run(
        self,
        values: Mapping[str, Any] | None = None,
        seed: int = 1,
        step: float | None = None,
        out: Path | None = None,
        progress: Callable[[ProgressReport], None] | None = None,
        checkpoints: CheckpointManager | None = None,
    ) -> Record:
        """Run from t = 0, or from where ``checkpoints`` resumes, to the end; return the record.  See :func:`run`."""
        system, starts, document, take = self._prepare(values, seed, step)
        schedule = Schedule.of(system)
        if checkpoints is not None:
            job = {k: getattr(document, k) for k in ("system", "seed", "step", "coupling", "options", "parameters")}
            parts = {slot: {"sha256": digest} for slot, digest in sorted(self.hashes.items())}
            job |= {"parts": parts, "stop": system.stop, "every": schedule.every}
            checkpoints.check(job, self.program, self.assembly.descriptions)
            if checkpoints.resume and self.foreign:
                own = f"{', '.join(self.foreign)}: the run goes on from what the FMU saves of its state"
                document.notes.append(f"{own} (one of PythonFMU: its registered variables alone)")
                self._warn(system, document.notes[-1:])
        library, document.linked = self._library(system)
        linear = beside(lambda: self._linear(system, document.parameters), take, progress)
        with linear if system.loops else contextlib.nullcontext(progress) as reported:
            ending = self._execute(Job(self.program, starts, schedule, library, checkpoints, document.units), reported)
        self._warn(system, ending.remarks)
        document.notes += ending.remarks
        problem = ending.problem
        if isinstance(problem, ResumeError):
            raise problem
        if ending.state is None:
            if isinstance(problem, FmuCallError) and problem.messages and "(Error)" in problem.status:
                raise ParameterRefusedError(str(problem))
            if not self.child:
                raise RunError(str(problem))
        return self._finish(ending.state or RunState(), system, document, out, problem, checkpoints)

    def _linear(self, system: System, parameters: Mapping[str, Any]) -> LinearFound:
        """Return the linear models for run.json, and their warnings."""
        from gyrobench.linear.crossovers import judged_loops
        from gyrobench.linear.linear_model import known_parts

        causes = [*(f"part {self.swaps[s]} in {s}" for s in self.swapped), *system.given]
        return judged_loops(self.assembly, system, parameters, known_parts(self.names, self.bench), causes)

    def _warn(self, system: System, texts: Iterable[str]) -> None:
        """Log each warning immediately, and once; the report repeats it."""
        import logging

        for text in texts:
            if text not in self.warned:
                self.warned.add(text)
                logging.getLogger("gyrobench").warning("%s: %s", system.name, text)

    def _finish(
        self,
        state: Any,
        system: System,
        document: RunDocument,
        out: Path | None,
        problem: Exception | None,
        checkpoints: CheckpointManager | None,
    ) -> Record:
        windows = system.windows
        names = list(windows.columns) if windows else []
        scale = state.k / state.timed if state.timed else 0.0
        document.timing = {slot: s * scale for slot, s in state.timed_seconds.items()}
        document.complete = problem is None
        document.steps = state.k
        self.steps += state.k
        document.stopped_at = state.k * system.step
        if checkpoints is not None and checkpoints.resumed_at:
            document.resumed_at = checkpoints.resumed_at
        channels = rows_to_columns(state.channel_rows, self.program.channel.names, time=True)
        text = str(problem)
        if isinstance(problem, FmuCallError):
            sockets = {slot: binding.socket for slot, binding in self.assembly.bindings.items()}
            reached = limits_reached(channels, limit_flags(self.program.channel.names, sockets))
            text += f"\n  {reached}" if reached else ""
        if problem is not None:
            document.problem = text
        record = Record(rows_to_columns(state.window_rows, names, time=False), channels, document)
        if out is not None:
            record.save(out)
        if isinstance(problem, EngineStopped) and problem.by_user:
            if checkpoints is None:
                raise RunInterrupted(str(problem), record)
            lost = f"; it cannot be resumed: {checkpoints.lost}" if checkpoints.lost else ""
            raise RunInterrupted(f"{problem}{lost}", record).advised(*checkpoints.going_on)
        if problem is not None:
            raise RunError(text, record)
        if checkpoints is not None and out is not None:
            checkpoints.remove()
        return record

    def _document(self, system: System, seed: int, parameters: dict[str, Any], notes: list[str]) -> RunDocument:
        """Return the content of run.json that is known before the end of the run."""
        parts = {
            slot: PartInfo(
                name=d.modelName,
                version=d.version or "",
                target=self.built.get(slot, "foreign"),
                fmi=d.fmiVersion,
                sha256=self.hashes[slot],
            )
            for slot, d in self.assembly.descriptions.items()
        }
        item = next((parts[s] for s in ("gyro", "imu", "accelerometer") if s in parts), None)  # what the test is about
        return RunDocument(
            system=system.name,
            title=system.title,
            instrument=system.instrument or (f"{item.name} {item.version}, simulated" if item else ""),
            spec=list(system.spec),
            date=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
            seed=seed,
            step=system.step,
            coupling=system.coupling,
            engine=self.engine,
            **self.assembly.order.as_dict(system.step),
            parts=parts,
            parameters=parameters,
            changed=[*(f"{s}: part" for s in self.swapped), *system.given],
            options=dict(system.values),
            units=recorded_units(self.assembly, {name: name for name in self.program.channel.names}),
            window_units=recorded_units(self.assembly, system.windows.columns if system.windows else {}),
            plan=[PlanRow(**row) for row in system.plan().rows()],
            versions=dict(package_versions()),
            notes=[*self.notes, *notes, *system.warnings()],
        )


def run(
    system: System | str,
    parts: Mapping[str, Path | str] | None = None,
    maps: Mapping[str, Path] | None = None,
    values: Mapping[str, Any] | None = None,
    seed: int = 1,
    engine: str | None = None,
    out: Path | None = None,
    step: float | None = None,
    progress: Callable[[ProgressReport], None] | None = None,
    target: str = "native",
    bench: Path | None = None,
    child: bool = False,
    timeout: float = TIMEOUT,
    resume: bool = False,
    stop_at: float | None = None,
) -> Record:
    """Run a system and return its record, saved in ``out`` (a folder) when given.

    values: options and "slot.parameter", numbers in SI or texts with units.  step: s, instead of the system's.
    seed: of all noise; each slot gets a seed of its own from it unless "slot.seed" is set.
    progress: called about five times a second with a :class:`ProgressReport`.
    resume: go on with the interrupted run in ``out``, see :mod:`gyrobench.engine.checkpoint`.
    stop_at: s of simulated time at which the run is interrupted as if by the user.
    Raises the errors of :class:`Session`, InvalidConfigurationError, ResumeError and InvalidValueError before anything
    runs, and RunError (with what was recorded, saved too) when an FMU fails, the plan does not end, or the user
    interrupts (RunInterrupted).
    """
    if out is None and (resume or stop_at is not None):
        raise InvalidValueError("resume and stop_at: name the folder of the run in out")
    checkpoints = CheckpointManager(out, resume, stop_at=stop_at) if out is not None else None
    with Session(
        system, parts, maps, engine=engine, target=target, bench=bench, child=child, timeout=timeout
    ) as session:
        return session.run(values, seed, step, out, progress, checkpoints)
