"""A system as an SSP archive, as one container FMU, as one native FMU or as a web page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from gyrobench.bench import Bench, UsageError
from gyrobench.commands import console
from gyrobench.packaging.compiler import PLATFORMS
from gyrobench.workflow.inputs import check_fmu_files, require_slots
from gyrobench.workflow.settings import load_system


def export(
    name: str,
    to: str,
    values: Mapping[str, str],
    parts: Mapping[str, str],
    maps: Mapping[str, Path],
    seed: int,
    out: Path | None,
    expose: Iterable[str] = (),
    fmi: int = 2,
    platforms: Iterable[str] = (),
) -> Path:
    """Write the system as "ssp", "container", "fmu" or "html"; return the file.

    expose: of all but "ssp".  fmi, platforms: of "fmu".
    """
    from gyrobench.exchange import container, html_page, ssp_export, system_fmu

    if to != "fmu" and (fmi != 2 or platforms):
        raise UsageError(f"--fmi and --platform belong to --to fmu, not to --to {to}")
    if to == "ssp" and expose:
        raise UsageError("--expose belongs to --to fmu, container and html: an SSP archive offers all that its FMUs do")
    if unknown := [p for p in platforms if p not in PLATFORMS]:
        raise UsageError(f"--platform {unknown[0]}: unknown platform; available: {', '.join(PLATFORMS)}")
    suffix, kind = {"ssp": (".ssp", "an SSP archive"), "html": (".html", "a page")}.get(to, (".fmu", "an FMU"))
    system = require_slots(load_system(name, values))
    path = out or Bench.find().products / f"{system.name}{suffix}"
    if path.suffix != suffix:
        raise UsageError(f"--out {path}: {kind} ends in {suffix}")
    check_fmu_files(parts)
    bench = Bench.find().folder
    if to == "fmu":
        notes = system_fmu.export_fmu(
            system, path, parts, maps, None, seed, bench, expose=expose, fmi=fmi, platforms=tuple(platforms)
        )
    elif to == "html":
        notes = html_page.export_page(system, path, parts, maps, None, seed, bench, expose)
    elif to == "container":
        notes = container.export_container(system, path, parts, maps, None, seed, bench, expose)
    else:
        notes = ssp_export.export_ssp(system, path, parts, maps, None, seed, bench)
    console.print_notes(notes)
    return path
