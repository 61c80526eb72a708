"""A system as an SSP archive or as one container FMU."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gyrobench.bench import Bench, UsageError
from gyrobench.commands import console
from gyrobench.commands.arguments import load_system
from gyrobench.workflow.inputs import check_fmu_files, require_slots


def export(
    name: str,
    to: str,
    values: Mapping[str, str],
    parts: Mapping[str, str],
    maps: Mapping[str, Path],
    seed: int,
    out: Path | None,
) -> Path:
    """Write the system as an SSP archive (to "ssp") or as one container FMU; return the file."""
    from gyrobench.exchange import container, ssp_export

    suffix = ".ssp" if to == "ssp" else ".fmu"
    system = require_slots(load_system(name, values))
    path = out or Bench.find().products / f"{system.name}{suffix}"
    if path.suffix != suffix:
        raise UsageError(f"--out {path}: a{'n SSP archive' if to == 'ssp' else ' container FMU'} ends in {suffix}")
    check_fmu_files(parts)
    write = ssp_export.export_ssp if to == "ssp" else container.export_container
    console.print_notes(write(system, path, parts, maps, None, seed, Bench.find().folder))
    return path
