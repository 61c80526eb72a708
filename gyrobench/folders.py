"""Folders of runs: named by what is run; nobody's run is overwritten by another."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from gyrobench.bench import Bench, UsageError
from gyrobench.system.record import Record
from gyrobench.system.system import System

RECORD = ("run.json", "record.parquet", "record.csv", "channels.parquet", "channels.csv")
REPORT = ("result.json", "report.html", "report.pdf")


def run_folder(
    session: Any, system: System, seed: int, step: float, maps: Mapping[str, Path], out: Path | None, force: bool
) -> Path:
    """Where the run is saved: --out, else a folder named by what is run.

    Raises UsageError when --out holds another run, unless ``force``, or files that are none of a run.
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
    texts = {slot: file.read_text(encoding="utf-8") for slot, file in maps.items()}
    text = json.dumps([identity, texts, session.engine], sort_keys=True)
    folder = out or Bench.find().out / system.name / hashlib.sha256(text.encode()).hexdigest()[:8]
    return claim(folder, identity, force)


def claim(folder: Path, identity: Mapping[str, Any], force: bool) -> Path:
    """Makes a folder for a run; one that holds the same run may be written again.  Raises UsageError."""
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"--out {folder}: is a file; name a folder")
    old = None
    if (folder / "run.json").is_file():
        try:
            old = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        except ValueError:
            old = {}
    elif folder.is_dir() and any(folder.iterdir()):
        raise UsageError(f"--out {folder}: holds other files; name a new folder, for example {folder / 'run1'}")
    if old is not None:
        changed = [k for k, v in identity.items() if not _covers(old.get(k), v)]
        if changed and not force:
            raise UsageError(
                f"--out {folder}: holds another run (its {', '.join(changed)} differ); name another folder, "
                "or --force to replace it"
            )
        for name in (*RECORD, *REPORT) if changed else ():
            (folder / name).unlink(missing_ok=True)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _covers(old: Any, new: Any) -> bool:
    """Whether all that ``new`` says stands in ``old`` too."""
    if isinstance(old, dict) and isinstance(new, dict):
        return all(_covers(old.get(k), v) for k, v in new.items())
    return bool(old == new)


def keep(record: Record, folder: Path) -> Path:
    """Saves what a run left when it stopped, beside a whole record of the same run rather than over it."""
    if (folder / "run.json").exists() and Record.load(folder).complete:
        folder = folder.with_name(folder.name + "-incomplete")
    return record.save(folder)


def labels(runs: Iterable[Path]) -> list[str]:
    """Short names of folders, all different.  Raises UsageError for a folder given twice."""
    folders = [f.resolve() for f in runs]
    for f in folders:
        if folders.count(f) > 1:
            raise UsageError(f"{f}: given twice")
    names = [f.name for f in folders]
    return [f.name if names.count(f.name) == 1 else str(Path(f.parent.name, f.name)) for f in folders]
