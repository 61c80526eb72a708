"""Checkpoints of runs: a stopped run continues where it was; its record is bit-equal with that of an unbroken run.

``checkpoint.npz`` in the folder of the run holds the serialized state of every FMU, the buffer ``out`` of the engine,
the last watched value, the number of steps and the rows recorded so far: one file, written under a temporary name and
renamed, so that it is either complete or absent.  It is written when the user stops the run, after some seconds and
then about once a minute of wall time, for a process that is killed; it is removed when the run is complete.  A
checkpoint belongs to one job: parts, parameters, options, seed, step, order and wiring; it is not accepted for any
other.  Both engines write and read the same file.

Not covered: FMUs that cannot serialize their state.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import time
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench import reading
from gyrobench.arrays import Array
from gyrobench.bench import display_path
from gyrobench.engine.fmu_instance import FmuCallError, FmuInstance
from gyrobench.engine.program import Program
from gyrobench.engine.reference_engine import RunState, read_outputs
from gyrobench.errors import RESUMING, Advice, GyrobenchError
from gyrobench.files import write_whole

FILE = "checkpoint.npz"
FORMAT = 2
PERIOD = 60.0  # s of wall time between two checkpoints
FIRST = 5.0  # s of wall time until the first one
SHARE = 50.0  # and this many times what the last one took
MAX_LISTED = 5  # differences named in a message
NAMES = {
    "step": "step (s)",
    "stop": "end of the simulated time (s)",
    "every": "steps between two rows of the channels",
    "order": "order of execution",
    "wiring": "wires, mapping or recorded channels",
}


class ResumeError(GyrobenchError):
    """A run that cannot be continued; the text says why."""


def wiring(program: Program) -> str:
    """Return a digest of what goes where between the parts and into the record, unit factors included."""
    calls = [(*p.sets, *p.gets, *p.channel_gets, *p.window_gets) for p in program.parts]
    parts = [
        [[g.code, list(g.references), g.sizes, g.at, g.source, g.scaled, g.shifted] for g in groups] for groups in calls
    ]
    rows = [[r.names, r.source, r.gain, r.offset] for r in (program.channel, program.window)]
    text = json.dumps([parts, rows, program.watch, program.done, program.delays, program.constants])
    return hashlib.sha256(text.encode()).hexdigest()


def resume_obstacle(descriptions: Mapping[str, Any]) -> str:
    """Return why a run with FMUs of these model descriptions cannot be resumed; empty where it can."""
    stateless = [
        slot
        for slot, d in descriptions.items()
        if not (d.coSimulation.canGetAndSetFMUstate and d.coSimulation.canSerializeFMUstate)
    ]
    if stateless:
        return f"{', '.join(stateless)}: the FMU cannot save its state (canSerializeFMUstate is not true)"
    return ""


def read_job(folder: Path) -> dict[str, Any] | None:
    """Return the job of the checkpoint in a folder; None when there is none.  Raises ResumeError for a damaged file."""
    return dict(_read(folder / FILE)[0]["job"]) if (folder / FILE).is_file() else None


def _read(file: Path) -> tuple[dict[str, Any], dict[str, Array]]:
    try:
        with np.load(file, allow_pickle=False) as data:
            arrays = {name: data[name] for name in data.files}
        stored = json.loads(arrays.pop("head").tobytes().decode("utf-8"))
        if stored["format"] != FORMAT:
            raise ValueError(f"format {stored['format']}, this version reads {FORMAT}")
        head, verified = reading.opened(stored, FILE, ValueError)
        if not verified or head["arrays"] != _digests(arrays):
            raise ValueError("changed after it was saved")
        return head, arrays
    except (
        OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError,
        RuntimeError,
    ) as error:  # fmt: skip
        raise ResumeError(f"{file}: not a checkpoint that can be read: {error}") from None


def _digests(arrays: Mapping[str, Array]) -> dict[str, str]:
    """Return the SHA-256 of arrays with their types and shapes: numpy does not check the sums of the archive."""
    return {
        name: hashlib.sha256(f"{a.dtype.str} {a.shape} ".encode() + a.tobytes()).hexdigest()
        for name, a in arrays.items()
    }


def store(file: Path, head: Mapping[str, Any], arrays: Mapping[str, Array]) -> None:
    """Write a checkpoint: what is known of the run, and its arrays."""
    stored = reading.sealed({"format": FORMAT, **head, "arrays": _digests(arrays)})

    def save(path: Path) -> None:
        with path.open("wb") as f:
            everything: dict[str, Any] = {"head": np.frombuffer(json.dumps(stored).encode("utf-8"), np.uint8), **arrays}
            np.savez(f, **everything)

    write_whole(file, save)


def _joined(rows: list[Array], width: int) -> Array:
    """Return all rows as one array; the list then holds that one."""
    if not rows:
        return np.empty((0, width))
    if len(rows) > 1 or rows[0].ndim == 1:
        rows[:] = [np.concatenate([r if r.ndim == 2 else r[None, :] for r in rows])]
    return rows[0]


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """Return what differs between two jobs, a line each."""
    lines = []
    for key, now in new.items():
        was = old.get(key)
        if json.dumps(was, sort_keys=True) == json.dumps(now, sort_keys=True):
            continue
        if key == "parts":
            was = was or {}
            lines += [f"the part in slot {s} (its FMU)" for s in sorted({*was, *now}) if was.get(s) != now.get(s)]
        elif isinstance(now, dict) and isinstance(was, dict):
            names = [n for n in {**was, **now} if was.get(n) != now.get(n)]
            if "seed" in new and old.get("seed") != new["seed"]:  # reported by itself; the slots' seeds follow from it
                names = [n for n in names if not n.endswith(".seed")]
            lines += [f"{n}: {_shown(was.get(n))} there, {_shown(now.get(n))} here" for n in names]
        elif key == "wiring":
            lines.append(NAMES[key])
        else:
            lines.append(f"{NAMES.get(key, key)}: {_shown(was)} there, {_shown(now)} here")
    return lines


def _shown(value: Any) -> str:
    text = ", ".join(map(str, value)) if isinstance(value, list) else "none" if value is None else str(value)
    return text if len(text) <= 80 else text[:77] + "..."


class CheckpointManager:
    """The checkpoint of one run: reads, writes and removes it.

    folder: of the checkpoint.  resume: continue from the one in ``source`` (default: the folder).  stop_at: s of
    simulated time at which the run is interrupted as if by the user.  period: s of wall time between checkpoints.
    """

    def __init__(
        self,
        folder: Path,
        resume: bool = False,
        source: Path | None = None,
        stop_at: float | None = None,
        period: float | None = None,
    ) -> None:
        self.folder = Path(folder)
        self.resume = resume
        self.source = Path(source or folder)
        self.stop_at = stop_at
        self.period = PERIOD if period is None else period
        self.remark = ""  # for the user, before the run
        self.lost = ""  # why an interrupted run cannot go on
        self.resumed_at: list[float] = []  # s
        self.job: dict[str, Any] = {}
        self.head: dict[str, Any] = {}
        self.arrays: dict[str, Array] = {}
        self.due = self.began = time.monotonic()

    def check(self, job: Mapping[str, Any], program: Program, descriptions: Mapping[str, Any]) -> None:
        """Read the checkpoint when resuming, before anything runs.  Raises ResumeError when it is not of this job."""
        job = {**job, "order": program.order, "wiring": wiring(program)}
        self.job = json.loads(json.dumps(job))
        self.obstacle = resume_obstacle(descriptions)
        if not self.resume:
            return
        if self.obstacle:
            raise ResumeError(f"--resume: {self.obstacle}; run it again without --resume")
        file, where = self.source / FILE, display_path(self.source)
        if not file.is_file():
            raise ResumeError(f"--resume: no interrupted run to continue in {where} (there is no {FILE})")
        self.head, self.arrays = _read(file)
        changed = differences(self.head["job"], self.job)
        if changed:
            more = [f"and {len(changed) - MAX_LISTED} more"] if len(changed) > MAX_LISTED else []
            lines = "".join(f"\n  - {line}" for line in [*changed[:MAX_LISTED], *more])
            raise ResumeError(f"--resume: the interrupted run in {where} is another one; what differs:{lines}")

    def notes(self) -> list[str]:
        """Return notes for a run that starts anew although it could, or was to, be continued."""
        if self.remark:
            return [self.remark]
        if self.resume or not (self.source / FILE).is_file():
            return []
        return [
            f"this run starts anew; the interrupted one in {display_path(self.source)} could be continued with --resume"
        ]

    def restore(self, state: RunState, program: Program, instances: Mapping[str, FmuInstance]) -> RunState:
        """Return the state of the run as it was saved, after initialization; ``state`` itself when not resuming.

        The state of these instances is saved from now on.  Raises FmuCallError, and ResumeError for an FMU whose
        outputs are not those it had.
        """
        self.program, self.instances = program, instances
        self.due = time.monotonic() + min(self.period, FIRST)
        if not self.resume:
            return state
        out = self.program.out
        try:
            states = {slot: self.arrays[f"state.{slot}"].tobytes() for slot in self.program.order}
            saved = self.arrays["out"]
            restored = RunState(
                k=int(self.head["k"]),
                last=float(self.arrays["last"][0]),
                finished=bool(self.head["finished"]),
                channel_rows=[self.arrays["channel"]],
                window_rows=[self.arrays["window"]],
                timed=int(self.head["timed"]),
                timed_seconds=dict(self.head["timed_seconds"]),
            )
            self.resumed_at = [*self.head["resumed_at"], restored.k * float(self.job["step"])]
        except KeyError as error:
            raise ResumeError(f"{self.source / FILE}: not a checkpoint that can be read: {error} is missing") from None
        for p in self.program.parts:
            instance = self.instances[p.slot]
            instance.load_state(states[p.slot])
            read_outputs(instance, p.gets, out)
            if any(out[g.at : g.at + g.n].tobytes() != saved[g.at : g.at + g.n].tobytes() for g in p.gets):
                raise ResumeError(
                    f"--resume: {p.slot}: the outputs of the FMU are not those it had when its state was saved; "
                    "it does not save all of its state, so the run cannot be continued"
                )
        out[:] = saved
        return restored

    @property
    def is_there(self) -> bool:
        """Return True if there is a checkpoint to continue from."""
        return any((folder / FILE).is_file() for folder in (self.folder, self.source))

    def last_step(self, h: float) -> int | None:
        """Return the step after which the run is to stop; None for no such request."""
        return None if self.stop_at is None else max(0, round(self.stop_at / h))

    def save_if_due(self, state: RunState) -> None:
        """Write a checkpoint when one is due; called between two chunks."""
        if time.monotonic() >= self.due and not self.obstacle:
            began = time.monotonic()
            self.write(state)
            now = time.monotonic()
            self.due = now + max(self.period, SHARE * (now - began))

    def save_on_interrupt(self, state: RunState) -> None:
        """Write the checkpoint of a run that the user stopped, or keep the reason why there is none."""
        self.lost = self.obstacle or self.write(state)

    @property
    def going_on(self) -> tuple[Advice, ...]:
        """Return what continues an interrupted run, nothing where no checkpoint could be written."""
        return () if self.lost else (Advice("resume", f"{RESUMING} continues it"),)

    def write(self, state: RunState) -> str:
        """Write the checkpoint; return what prevents it, "" where nothing: the run itself is sound."""
        program = self.program
        head = {
            "job": self.job,
            "k": state.k,
            "finished": state.finished,
            "timed": state.timed,
            "timed_seconds": state.timed_seconds,
            "resumed_at": self.resumed_at,
        }
        arrays: dict[str, Any] = {
            "out": program.out,
            "last": np.array([state.last]),
            "channel": _joined(state.channel_rows, 1 + len(program.channel.names)),
            "window": _joined(state.window_rows, 1 + len(program.window.names)),
        }
        try:
            for slot, instance in self.instances.items():
                arrays[f"state.{slot}"] = np.frombuffer(instance.save_state(), np.uint8)
                instance.status.call = 0
            self.folder.mkdir(parents=True, exist_ok=True)
            store(self.folder / FILE, head, arrays)
        except (FmuCallError, OSError) as error:
            return str(error)
        return ""

    def remove(self) -> None:
        """Remove the checkpoint, and what a killed process left of one, once the record is complete and saved."""
        remove_checkpoints((self.folder, self.source))
        for folder in (self.folder, self.source):
            with contextlib.suppress(OSError):  # a folder of something else than the checkpoint stays
                folder.rmdir()


def remove_checkpoints(folders: Iterable[Path]) -> None:
    """Remove the checkpoints in folders."""
    for folder in folders:
        for file in folder.glob(f"{FILE}*"):
            file.unlink(missing_ok=True)
