"""Runs of a system: its FMUs built or loaded, bound, checked and ordered once, then run, each run with its record.

    record = run(load_system("tumble_single_axis"), values={"latitude": "45.75deg"}, seed=3, out=Path("reports/out/x"))

A :class:`Session` is prepared once (unzip, load, bind, order) and runs many times with other values and seeds.
"""

from __future__ import annotations

import datetime
import functools
import shutil
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from gyrobench.engine.checkpoint import CheckpointManager
from gyrobench.engine.fmu_instance import FmuCallError, FmuInstance, LocalInstance
from gyrobench.engine.limits import limit_flags, limits_reached
from gyrobench.engine.program import build_program
from gyrobench.engine.reference_engine import ReferenceEngine, initial_state, initialize
from gyrobench.engine.run_driver import EngineStopped, ProgressReport, run_to_end
from gyrobench.errors import GyrobenchError
from gyrobench.files import sha256, temporary_folder, unzip_fmu
from gyrobench.record.record import Record, rows_to_columns
from gyrobench.record.run_document import LinearModels, PartInfo, PlanRow, RunDocument
from gyrobench.system.parameters import defaults, resolve
from gyrobench.system.part_files import resolve_parts
from gyrobench.system.recorded_units import recorded_units
from gyrobench.system.setup_errors import setup_errors
from gyrobench.system.system import InvalidConfigurationError, System, load_system
from gyrobench.system.values import InvalidValueError
from gyrobench.system.wiring import Assembly, assemble


class RunError(GyrobenchError):
    """A run that did not end as it should; ``record`` holds what was recorded until then (or None)."""

    exit_code = 3

    def __init__(self, message: str, record: Record | None = None) -> None:
        self.record = record
        kept = "" if record is None or record.folder is None else f"\nthe record until then is kept in {record.folder}"
        super().__init__(message + kept)


class RunInterrupted(RunError):
    """The user stopped the run."""


class ParameterRefusedError(RunError):
    """A part refuses its parameters, before the first step."""

    exit_code = 2


class Session:
    """A system with its FMUs unzipped and loaded, for one run or a thousand.

    parts: slot -> path of an FMU or name of a part (default: the slot's).  maps: slot -> mapping file.
    engine: "native", "reference" or None (native where it can).  isolate: slots whose FMU runs in a child process.
    target: of the parts that are built, "native" or "python".  timeout: s for one call of an isolated FMU.
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
        isolate: Iterable[str] = (),
        target: str = "native",
        bench: Path | None = None,
        timeout: float = 10.0,
    ) -> None:
        if engine not in (None, "native", "reference"):
            raise InvalidValueError(f"engine '{engine}': one of native, reference")
        self.system = load_system(system, bench) if isinstance(system, str) else system
        self.isolate = tuple(isolate)
        for slot in self.isolate:
            if slot not in self.system.slots:
                raise InvalidValueError(f"isolate: no slot '{slot}'; slots: {', '.join(self.system.slots)}")
        self.notes: list[str] = []
        paths, self.built = resolve_parts(self.system, parts or {}, target, bench, self.notes)
        self.swaps = {slot: Path(part).stem for slot, part in (parts or {}).items()}
        self.swapped = sorted(self.swaps)
        self.warned: set[str] = set()
        self.bench = bench
        self.names = {s: str((parts or {}).get(s, self.system.slots[s].part)) for s in self.built}
        self.assembly: Assembly = assemble(self.system, paths, maps)
        self.notes += self.assembly.notes
        self.program = build_program(self.assembly)
        self.gains = [c.gain for c in self.assembly.connections]
        self.base = defaults(self.assembly)
        self.hashes = {slot: sha256(p) for slot, p in paths.items()}
        self.engine = self._choose(engine)
        self.folder = temporary_folder()
        self.instances: dict[str, FmuInstance] = {}
        try:
            for slot, path in paths.items():
                self.instances[slot] = self._load_instance(slot, path, timeout)
        except BaseException as error:
            self.close()
            if isinstance(error, FmuCallError):
                raise RunError(str(error)) from None
            raise

    def _choose(self, engine: str | None) -> str:
        if self.isolate:
            if engine == "native":
                self.notes.append("isolated FMUs run in the reference engine")
            return "reference"
        if engine == "reference":
            return engine
        from gyrobench.engine.engine_library import engine_library
        from gyrobench.packaging import CompilerError

        try:
            engine_library()
        except CompilerError as error:
            self.notes.append(f"reference engine (about a hundred times slower than native): {error}")
            return "reference"
        return "native"

    def _load_instance(self, slot: str, path: Path, timeout: float) -> FmuInstance:
        folder = self.folder / slot
        unzip_fmu(path, folder)
        if slot in self.isolate:
            from gyrobench.engine.isolated_instance import IsolatedInstance

            return IsolatedInstance(slot, folder, timeout)
        return LocalInstance(slot, self.assembly.descriptions[slot], folder)

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
        system = self.system.with_values(values or {})
        if step is not None:
            system.step = float(step)
        if not 0.0 < system.step < float("inf"):
            raise InvalidValueError(f"step = {system.step} s: must be > 0")
        system.refuse()
        starts, parameters, notes = resolve(self.assembly, system, seed, self.base)
        if problems := system.check_parameters(parameters):
            raise InvalidConfigurationError(system.name, problems)
        errors = setup_errors(self.assembly, system, seed, self.base, parameters)
        self._warn(system, [f"simulated set-up error: {e.sentence()}" for e in errors])
        self._warn(system, [*notes, *system.warnings()])
        if [c.gain for c in self.assembly.connections] != self.gains:  # factors of wires follow the parts
            self.program, self.gains = build_program(self.assembly), [c.gain for c in self.assembly.connections]
        linear = self._linear(system, parameters, notes) if system.loops else None
        document = self._document(system, seed, parameters, notes)
        if errors:
            document.setup_errors = errors
        if linear is not None:
            document.linear = linear
        every = max(1, round(system.channel_period / system.step))
        if checkpoints is not None:
            job = {k: getattr(document, k) for k in ("system", "seed", "step", "options", "parameters")}
            parts = {slot: {"sha256": digest} for slot, digest in sorted(self.hashes.items())}
            checkpoints.check(
                {**job, "parts": parts, "stop": system.stop, "every": every}, self.program, self.instances
            )
        self.program.out[:] = 0.0
        state = None
        engine: Any = None
        problem: Exception | None = None
        try:
            for slot in self.program.order:
                self.instances[slot].instantiate()
                self.instances[slot].set_start(starts[slot])
            initialize(self.program, self.instances, 0.0)
            state = initial_state(self.program, self.instances, 0.0)
            if checkpoints is not None:
                state = checkpoints.restore(state)
            if self.engine == "native":
                from gyrobench.engine.native_engine import NativeEngine

                engine = NativeEngine(self.program, self.instances)  # type: ignore[arg-type]
            else:
                engine = ReferenceEngine(self.program, self.instances)
            run_to_end(engine, state, system, every, progress, checkpoints)
        except (FmuCallError, EngineStopped) as error:
            problem = error
            if checkpoints is not None and state is not None and isinstance(error, EngineStopped) and error.by_user:
                checkpoints.save_on_interrupt(state)
        finally:
            if engine is not None:
                engine.close()
            for instance in self.instances.values():
                instance.free()
        if state is None:
            refused = isinstance(problem, FmuCallError) and problem.messages and "(Error)" in problem.status
            raise (ParameterRefusedError if refused else RunError)(str(problem))
        return self._finish(state, system, document, out, problem, checkpoints)

    def _linear(self, system: System, parameters: dict[str, Any], notes: list[str]) -> LinearModels:
        """Return the linear models for run.json; their warnings are logged immediately, and noted."""
        from gyrobench.linear.crossovers import missed_crossovers
        from gyrobench.linear.linear_model import LinearizationError, loops
        from gyrobench.packaging import load_part

        def part_of(slot: str) -> Any:
            if slot not in self.names:
                raise LinearizationError(
                    f"the FMU in slot {slot} is not one of this bench: its Jacobians are not known"
                )
            return load_part(self.names[slot], self.bench)

        models, warnings = loops(self.assembly, parameters, part_of, system.step)
        models.wanted = system.crossovers()
        if models.missing:
            asked = ", ".join(f"{loop} {f:.4g} Hz" for loop, f in models.wanted.items())
            unknown = f"; whether the loop crosses where it was asked to ({asked}) is not known before the run"
            warnings = [w + (unknown if asked else "") for w in warnings]
        else:
            causes = [*(f"part {self.swaps[s]} in {s}" for s in self.swapped), *system.given]
            models.warnings = warnings = [*warnings, *missed_crossovers(models, models.wanted, causes)]
        self._warn(system, warnings)
        notes += warnings
        return models

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
            raise RunInterrupted(
                f"{problem}; {checkpoints.resume_hint}" if checkpoints is not None else str(problem), record
            )
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
        item = next((parts[s] for s in ("gyro", "accelerometer") if s in parts), None)  # what the test is about
        return RunDocument(
            system=system.name,
            title=system.title,
            instrument=f"{item.name} {item.version}, simulated" if item else "",
            spec=list(system.spec),
            date=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
            seed=seed,
            step=system.step,
            engine=self.engine,
            isolated=list(self.isolate),
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
    isolate: Iterable[str] = (),
    progress: Callable[[ProgressReport], None] | None = None,
    target: str = "native",
    bench: Path | None = None,
    timeout: float = 10.0,
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
        system, parts, maps, engine=engine, isolate=isolate, target=target, bench=bench, timeout=timeout
    ) as session:
        return session.run(values, seed, step, out, progress, checkpoints)


@functools.cache
def package_versions() -> dict[str, str]:
    import platform
    from importlib.metadata import PackageNotFoundError, version

    """Return the versions of Python and of the packages that determine a result."""
    versions = {"python": platform.python_version()}
    for name in ("gyrobench", "fmpy", "numpy"):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return versions
