"""A system as an SSP archive, as one container FMU, as one native FMU, as a web page or as linear models."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from gyrobench.bench import Bench, UsageError
from gyrobench.commands import console
from gyrobench.commands.arguments import require_suffix
from gyrobench.packaging import load_part
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
    """Write the system as "ssp", "container", "fmu", "html" or "mat", of which a part may be too; return the file.

    expose: of all but "ssp" and "mat".  fmi, platforms: of "fmu".
    """
    from gyrobench.exchange import container, html_page, mat_model, ssp_export, system_fmu

    if to != "fmu" and (fmi != 2 or platforms):
        raise UsageError(f"--fmi and --platform belong to --to fmu, not to --to {to}")
    if to in ("ssp", "mat") and expose:
        offers = "an SSP archive offers all that its FMUs do" if to == "ssp" else "a linear model goes from excitations"
        raise UsageError(f"--expose belongs to --to fmu, container and html: {offers}")
    if unknown := [p for p in platforms if p not in PLATFORMS]:
        raise UsageError(f"--platform {unknown[0]}: unknown platform; available: {', '.join(PLATFORMS)}")
    kinds = {"ssp": (".ssp", "an SSP archive"), "html": (".html", "a page"), "mat": (".mat", "a MATLAB file")}
    suffix, kind = kinds.get(to, (".fmu", "an FMU"))
    require_suffix("--out", out, suffix, kind)
    home = Bench.find()
    part = name.removeprefix("components/")
    if to == "mat" and part in home.parts() and (part != name or name not in home.systems()):
        if parts:
            raise UsageError(f"--part: {part} is a part; it has no slots")
        path = out or home.products / f"{part}{suffix}"
        mat_model.export_part_mat(load_part(part, home.folder), part, path, values)
        return path
    system = require_slots(load_system(name, values))
    path = out or home.products / f"{system.name}{suffix}"
    check_fmu_files(parts)
    bench = home.folder
    if to == "fmu":
        notes = system_fmu.export_fmu(
            system, path, parts, maps, None, seed, bench, expose=expose, fmi=fmi, platforms=tuple(platforms)
        )
    elif to == "html":
        notes = html_page.export_page(system, path, parts, maps, None, seed, bench, expose)
    elif to == "mat":
        notes = mat_model.export_mat(system, path, parts, maps, seed, bench)
    elif to == "container":
        notes = container.export_container(system, path, parts, maps, None, seed, bench, expose)
    else:
        notes = ssp_export.export_ssp(system, path, parts, maps, None, seed, bench)
    console.print_notes(notes)
    return path
