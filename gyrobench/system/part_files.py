"""From "slot: part name or path" to the FMU files of a system."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gyrobench.bench import suggest_names
from gyrobench.files import missing
from gyrobench.system.system import InvalidConfigurationError, System


def resolve_parts(
    system: System,
    parts: Mapping[str, Path | str],
    target: str,
    bench: Path | None,
    notes: list[str],
    prebuilt: Mapping[str, Path] | None = None,
) -> tuple[dict[str, Path], dict[str, str]]:
    """Paths of the FMUs of all slots, and the target of those that were built (slot -> "native" | "python").

    Something that ends in .fmu is a file, in .c or .py a controller of the user's own; anything else is the name of a
    part of the bench, built if needed.
    Without a compiler the Python target is built, with a note.  prebuilt: part of the bench -> its FMU, which was built
    elsewhere.  Raises InvalidConfigurationError, BenchError and BuildError.
    """
    for slot in parts:
        system.place(slot, parts[slot], bench)
    unknown = [s for s in parts if s not in system.slots]
    if unknown:
        raise InvalidConfigurationError(
            system.name, [f"no slot '{s}'; {suggest_names(s, system.all_slots())}" for s in unknown]
        )
    paths: dict[str, Path] = {}
    built: dict[str, str] = {}
    for slot, declared in system.slots.items():
        part = parts.get(slot, declared.part)
        if str(part).endswith(".fmu"):
            paths[slot] = Path(part)
            if not paths[slot].is_file():
                raise InvalidConfigurationError(system.name, [f"{slot}: {part}: {missing(paths[slot])}"])
            continue
        if prebuilt and str(part) in prebuilt:
            paths[slot] = prebuilt[str(part)]
            built[slot] = "python" if paths[slot].stem.endswith("-python") else "native"
            continue
        from gyrobench.packaging import CompilerError, build
        from gyrobench.packaging.own_controller import is_controller

        if is_controller(part):
            paths[slot] = build(str(part), bench=bench)
            built[slot] = "python" if str(part).endswith(".py") else "native"
            continue
        try:
            paths[slot] = build(str(part), target=target, bench=bench)
            built[slot] = target
        except CompilerError as error:
            if target == "python":
                raise
            paths[slot] = build(str(part), target="python", bench=bench)
            built[slot] = "python"
            notes.append(f"{slot}: Python target (a thousand times slower): {error}")
    return paths, built


def has_port(part: str | Path, name: str, bench: Path | None) -> bool:
    """Return whether an FMU or a part of the bench has this input or output, a number or an array; False where there is
    no such part.
    """
    if str(part).endswith(".fmu"):
        from gyrobench.system.fmu_variables import read_description, variables

        if not Path(part).is_file():
            return False
        found = variables(read_description(Path(part)))
        return any(v.causality in ("input", "output") and n.split("[")[0] == name for n, v in found.items())
    from gyrobench.bench import BenchError
    from gyrobench.component import Input, Output
    from gyrobench.packaging import load_part

    try:
        return isinstance(load_part(str(part), bench).declarations.get(name), Input | Output)
    except BenchError:
        return False
