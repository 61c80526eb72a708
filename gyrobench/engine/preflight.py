"""Problems and remarks of foreign FMUs before a run: why it cannot be, and what is to be known of it.

Read are the libraries of the archive, ``fixedInternalStepSize``, ``canHandleVariableCommunicationStepSize`` with the
step of the default experiment, ``needsExecutionTool``, ``canBeInstantiatedOnlyOncePerProcess``, and inputs of types
that nothing here can feed.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from gyrobench.bench import suggest_names
from gyrobench.system.wiring import Assembly

CLOSE = 1e-6  # of a step, by which a multiple may be off


def binary_problem(path: Path, description: Any) -> str:
    """Return why the library of an FMU cannot be loaded on this platform; empty where it is there."""
    from fmpy import platform, platform_tuple, sharedLibraryExtension

    folder = platform_tuple if description.fmiVersion.startswith("3.") else platform  # where FMPy looks
    wanted = f"{description.coSimulation.modelIdentifier}{sharedLibraryExtension}"
    if Path(wanted).name != wanted or "\\" in wanted:
        return ""  # refused when it is loaded
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    if f"binaries/{folder}/{wanted}" in names:
        return ""
    libraries = [n.split("/") for n in names if n.startswith("binaries/") and n.endswith((".so", ".dll", ".dylib"))]
    if here := sorted(n[-1] for n in libraries if n[1] == folder):
        return f"its library for {folder} is {', '.join(here)}; by its modelIdentifier it would be {wanted}"
    others = ", ".join(sorted({n[1] for n in libraries})) or "none"
    sources = "; it has its sources: fmpy compile" if any(n.startswith("sources/") for n in names) else ""
    return f"it has no binary for {folder}; there are {others}{sources}"


def controller_problems(assembly: Assembly, names: Mapping[str, Any]) -> list[str]:
    """Let controllers of the user's own keep their values; return inputs of theirs that nothing is connected to.

    names: slot -> the part in it, as it is named.
    """
    from gyrobench.packaging.own_controller import is_controller

    wired, found = {(c.target, c.input.element) for c in assembly.connections}, []
    for slot in (s for s, name in names.items() if is_controller(name)):
        assembly.keeps.add(slot)
        binding = assembly.bindings[slot]
        known = [c.name for c in binding.socket.connectors if c.causality == "input"]
        unknown = [n for n in binding.inputs if n.split("[")[0] not in known and (slot, n) not in wired]
        found += [
            f"{slot}: {names[slot]} declares the input {n}, which nothing in this slot gives; {suggest_names(n, known)}"
            for n in dict.fromkeys(n.split("[")[0] for n in unknown)
        ]
    return found


def problems(assembly: Assembly, foreign: Iterable[str]) -> list[str]:
    """Return why FMUs cannot run here, whatever the step.  foreign: slots whose FMU is not of the bench."""
    found = []
    slots = list(foreign)
    for slot in slots:
        path, description = assembly.paths[slot], assembly.descriptions[slot]
        if problem := binary_problem(path, description):
            found.append(f"{slot}: {path.name}: {problem}")
        others = [s for s in slots if s > slot and assembly.descriptions[s].guid == description.guid]
        if others and description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
            found.append(
                f"{slot}, {', '.join(others)}: {path.name} can be instantiated once per process only, and all FMUs of "
                "a run are in one"
            )
    return found


def step_problems(assembly: Assembly, step: float) -> list[str]:
    """Return which FMUs work at steps of their own that the communication step is no multiple of."""
    found = []
    for slot, description in assembly.descriptions.items():
        own = description.coSimulation.fixedInternalStepSize
        if own is None or not float(own) > 0.0:
            continue
        times = step / float(own)
        if round(times) < 1 or abs(times - round(times)) > CLOSE * times:
            below = max(1, int(times)) * float(own)
            found.append(
                f"{slot}: {assembly.paths[slot].name} works at fixed steps of {float(own):g} s "
                f"(fixedInternalStepSize), of which the communication step of {step:g} s is no multiple; give --step "
                f"{below:g} or {below + float(own):g}"
            )
    return found


def remarks(assembly: Assembly, foreign: Iterable[str], step: float) -> list[str]:
    """Return what the user is to know of foreign FMUs before the run."""
    found = []
    for slot in foreign:
        path, description = assembly.paths[slot], assembly.descriptions[slot]
        if description.coSimulation.needsExecutionTool:
            tool = description.generationTool or "the tool that made it"
            found.append(f"{slot}: {path.name} needs a program on this machine (needsExecutionTool): {tool}")
        experiment = description.defaultExperiment
        preferred = experiment.stepSize if experiment is not None else None
        fixed = not description.coSimulation.canHandleVariableCommunicationStepSize
        if fixed and preferred and abs(float(preferred) / step - 1.0) > CLOSE:
            found.append(
                f"{slot}: {path.name} is made for one communication step, {float(preferred):g} s by its default "
                f"experiment; this run has {step:g} s"
            )
        unfed = [v.name for v in description.modelVariables if v.causality == "input" and v.type in ("Binary", "Clock")]
        if unfed:
            found.append(f"{slot}: inputs of types that are not connected, at their start: {', '.join(unfed[:6])}")
    return found
