"""Folders of runs, named by the content of the run; a run does not overwrite another one."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench, UsageError, display_path
from gyrobench.engine import checkpoint
from gyrobench.files import LOCK, FolderLock
from gyrobench.record.record import Record
from gyrobench.record.run_document import FILE as RUN
from gyrobench.record.run_document import RecordError, read_run
from gyrobench.system.system import System

RECORD = (RUN, "record.parquet", "record.csv", "channels.parquet", "channels.csv", checkpoint.FILE)
REPORT = ("result.json", "report.html", "report.pdf")
MANIFEST, SIGNATURE = "manifest.json", "manifest.json.sig"


class NothingToResumeError(UsageError):
    """There is no run that could go on: none was begun, it is complete, or its parts cannot go on."""


def prepare_run_folder(
    session: Any,
    system: System,
    seed: int,
    step: float,
    maps: Mapping[str, Path],
    out: Path | None,
    force: bool,
    resume: bool = False,
    wanted: Collection[str] = REPORT,
) -> tuple[Path, checkpoint.CheckpointManager | None, FolderLock]:
    """Return where the run is saved, --out, else a folder named by what is run; the manager of its checkpoint; and the
    lock of the folder, to be released.

    The manager is None where ``resume`` finds the complete record of this run without the files ``wanted`` of its
    report, or with those of a process that was killed: the report is all that is left to do.

    With ``resume`` the manager continues from the checkpoint in that folder or in its :func:`incomplete_folder`, once
    it is known to belong to this run; a run that came to its end before its first checkpoint, killed or with an error,
    begins anew.  Raises NothingToResumeError, and UsageError when --out holds another run, unless ``force``,
    or files that do not belong to a run.
    """
    from gyrobench.system.parameters import resolve

    _, parameters, _ = resolve(session.assembly, system, seed, session.base)
    identity = {
        "system": system.name,
        "parts": {slot: {"sha256": digest} for slot, digest in sorted(session.hashes.items())},
        "parameters": parameters,
        "options": dict(system.values),
        "seed": seed,
        "step": step,
    }
    identity = json.loads(json.dumps(identity))
    coupling = [system.coupling] if system.coupling else []
    texts = {slot: file.read_text(encoding="utf-8") for slot, file in maps.items()}
    text = json.dumps([identity, texts, session.engine, *coupling], sort_keys=True)
    identity["coupling"] = system.coupling
    folder = out or Bench.find().out / system.name / hashlib.sha256(text.encode()).hexdigest()[:8]
    folder = Path(os.path.abspath(folder))  # wherever a part may go
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{display_path(folder)}: is a file; name a folder")
    lock = FolderLock(folder)
    try:
        if lock.abandoned:
            _sweep(folder)
            _sweep(incomplete_folder(folder))
        return folder, _manager(session, folder, identity, force, resume, wanted, lock.abandoned), lock
    except BaseException:
        lock.release()
        raise


def _manager(
    session: Any,
    folder: Path,
    identity: Mapping[str, Any],
    force: bool,
    resume: bool,
    wanted: Collection[str],
    abandoned: bool,
) -> checkpoint.CheckpointManager | None:
    """Prepare the folder of a run; return the manager of its checkpoint, None where only its report is missing.

    abandoned: by a process that was killed.
    """
    if not resume:
        prepare_folder(folder, identity, force)
        return checkpoint.CheckpointManager(partial_folder(folder))
    complete = has_complete_record(folder) and not (abandoned and _damaged(folder))
    if complete and (folder / checkpoint.FILE).is_file():  # killed between the end of the record and that of its run
        prepare_folder(folder, identity, False)
        checkpoint.remove_checkpoints((folder,))
    kept = [f for f in (folder, incomplete_folder(folder)) if (f / checkpoint.FILE).is_file()]
    if kept:
        if folder not in kept:
            prepare_folder(folder, identity, force)
        return checkpoint.CheckpointManager(partial_folder(folder), True, kept[0])
    if complete and (abandoned or not all((folder / name).is_file() for name in wanted)):
        prepare_folder(folder, identity, False)  # refuses another run
        return None
    obstacle = checkpoint.resume_obstacle(session.assembly.descriptions)
    if complete or obstacle or not (abandoned or (folder / RUN).is_file()):
        state = "the run is complete" if complete else "no checkpoint of a run with these parts and values"
        raise NothingToResumeError(
            "--resume: " + (obstacle or f"nothing to continue in {display_path(folder)}: {state}")
        )
    prepare_folder(folder, identity, force)
    manager = checkpoint.CheckpointManager(partial_folder(folder))
    manager.remark = f"{display_path(folder)}: the run before ended without a checkpoint; this one begins at t = 0"
    return manager


def _damaged(folder: Path) -> bool:
    """Return whether the record in a folder cannot be read."""
    try:
        Record.load(folder)
    except RecordError:
        return True
    return False


def _sweep(folder: Path) -> None:
    """Remove what a killed process left half written: temporary files, tables without the run.json they belong to."""
    for name in (*RECORD, *REPORT):
        for file in folder.glob(f"{name}*.part"):
            file.unlink(missing_ok=True)
        if name.startswith(("record.", "channels.")) and not (folder / RUN).is_file():
            (folder / name).unlink(missing_ok=True)


def prepare_folder(folder: Path, identity: Mapping[str, Any], force: bool) -> Path:
    """Make and return a folder for a run; one that holds the same run may be written again.  Raises UsageError."""
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{display_path(folder)}: is a file; name a folder")
    old = None
    if (folder / RUN).is_file():
        try:
            old = read_run(folder).as_dict()
        except RecordError:
            old = {}
    elif (folder / checkpoint.FILE).is_file():  # of a process that was killed
        try:
            old = checkpoint.read_job(folder)
        except checkpoint.ResumeError:
            old = {}
    elif folder.is_dir() and any(not p.name.startswith((checkpoint.FILE, LOCK)) for p in folder.iterdir()):
        raise UsageError(
            f"{display_path(folder)}: holds other files; name a new folder, for example {display_path(folder / 'run1')}"
        )
    if old is not None:
        changed = [k for k, v in identity.items() if not _covers(old.get(k), v)]
        if changed and not force:
            raise UsageError(
                f"{display_path(folder)}: holds another run (its {', '.join(changed)} differ); name another folder, "
                "or replace it: --force (force=True)"
            )
        for name in (*RECORD, *REPORT, MANIFEST, SIGNATURE) if changed else ():
            (folder / name).unlink(missing_ok=True)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _covers(old: Any, new: Any) -> bool:
    """Return whether ``old`` has all entries of ``new``, with the same values."""
    if isinstance(old, dict) and isinstance(new, dict):
        return all(_covers(old.get(k), v) for k, v in new.items())
    return bool(old == new) or (old is None and new == "")


def has_complete_record(folder: Path) -> bool:
    """Return whether the folder holds a complete record."""
    try:
        return read_run(folder).complete
    except RecordError:
        return False


def incomplete_folder(folder: Path) -> Path:
    """Return where a run that stopped is kept when the folder holds a complete record."""
    return folder.with_name(folder.name + "-incomplete")


def partial_folder(folder: Path) -> Path:
    """Return where a run that has not ended is kept: its folder, unless that holds a complete record."""
    return incomplete_folder(folder) if has_complete_record(folder) else folder


def short_names(runs: Iterable[Path]) -> list[str]:
    """Return short names of folders, all different.  Raises UsageError for a folder given twice."""
    folders = [f.resolve() for f in runs]
    for f in folders:
        if folders.count(f) > 1:
            raise UsageError(f"{f}: given twice")
    names = [f.name for f in folders]
    return [f.name if names.count(f.name) == 1 else str(Path(f.parent.name, f.name)) for f in folders]
