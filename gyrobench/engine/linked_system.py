"""The linked form of a system of native parts: the wires between them as C, on the memory of their instances.

An instance of a native FMU of the bench begins with the values of all its variables, double, in the order of the value
references (core.h, instance.c).  ``system.h`` has ``step_all``, which takes all parts through one communication step
in execution order: copy the inputs from the outputs of others, one assignment each, and doStep.  That is what the
engines do with calls for sets and gets, in the same order on the same instances; so states, records and checkpoints
are the same bit for bit, and a run may change from one form to the other between two steps.

A part looks at the end of each step whether its numbers are finite.  In the linked form the engine does after a block
of steps, by the flags that the processor raises where infinity or NaN come out of finite numbers (engine.c).  Where one
is raised, the block is gone through again from its first states with a look at each step, which finds part and time.

The library is small (0.1 s of the compiler) and kept in the cache by its content.  A run is linked where the library is
in the cache, or where the steps of the plan save the time of the compiler: about 10 ns a part and step.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gyrobench.engine.engine_library import SOURCE, library_path, make_library
from gyrobench.engine.program import PartProgram, Program, VariableGroup
from gyrobench.files import is_intact
from gyrobench.packaging import load_part
from gyrobench.packaging.fmu import native_guid

SAVED = 10e-9  # s, a part and step
COMPILATION = 0.15  # s

#: an output of this kind as the engines read it, a value as they set an input of this kind
READ = {"Real": "{}", "Integer": "whole_number({})", "Boolean": "({} != 0.0 ? 1.0 : 0.0)"}
WRITE = {"Real": "{}", "Integer": "(double)(int){}", "Boolean": "(double)(int){}"}

HELPER = """static inline double whole_number(double x) { /* as fmi2GetInteger rounds */
    const double i = (double)(int)x;
    return i == x ? i : (double)(int)floor(x + 0.5);
}"""


def places(program: Program) -> dict[int, str]:
    """Return the C expression of every value that is read in each step, by its place in ``out``."""
    found = {}
    for i, p in enumerate(program.parts):
        for g in p.gets:
            for j, reference in enumerate(g.references):
                found[g.at + j] = READ[g.type.name].format(f"v{i}[{reference}]")
    return found


def assignments(group: VariableGroup, part: int, source: Mapping[int, str]) -> list[str]:
    """Return the statements that set the inputs of a group."""
    factors = dict(group.scaled)
    lines = []
    for j, reference in enumerate(group.references):
        value = WRITE[group.type.name].format(source[group.source[j]])
        factor = f" * {factors[j]!r}" if j in factors else ""
        lines.append(f"v{part}[{reference}] = {value}{factor};")
    return lines


def checks_inputs(part: PartProgram) -> bool:
    """Return whether a part has to check its inputs: a factor may take one beyond what a double holds.

    In a block of quick steps that raises a flag of the processor like any other number that is not finite.
    """
    return any(g.scaled for g in part.sets)


def system_text(program: Program) -> str:
    """Return ``system.h``."""
    source = places(program)
    count = len(program.parts)
    pointers = [f"    double *const v{i} = (double *)instances[{i}];" for i in range(count)]
    pointers.append("    " + " ".join(f"(void)v{i};" for i in range(count)))
    steps = []
    for i, p in enumerate(program.parts):
        lines = [line for g in p.sets for line in assignments(g, i, source)]
        kind, last = ("step2_function", ", 1") if checks_inputs(p) else ("linked_function", "")
        slow = f"(({kind})r->parts[{i}].step)(instances[{i}], t, r->h{last})"
        step = f"quick ? ((linked_function)r->parts[{i}].quick_step)(instances[{i}], t, r->h) : {slow}"
        lines += [f"at->part = {i};", f"if (failed(r, {step})) return FAILED;", f"LAP({i});"]
        steps.append("\n".join([f"    /* {p.slot} */", *(f"    {line}" for line in lines)]))

    def reading(name: str, place: int) -> str:
        head = f"static inline double {name}(const run *r, void *const instances[]) {{"
        return "\n".join([head, *pointers, "    (void)r;", f"    return {source.get(place, '0.0')};", "}"])

    return "\n".join(
        [
            "/* The wires of a system: see linked_system.py. */",
            HELPER,
            "static inline int step_all(run *r, status *at, void *const instances[], double t, double *laps,",
            "                           int quick) {",
            "    (void)quick;",
            *pointers,
            "    at->call = CALL_STEP;",
            *steps,
            "    return MORE;\n}",
            "static void take_outputs(void *const instances[], double *out) {",
            *pointers,
            *(f"    out[{at}] = {value};" for at, value in source.items()),
            "}",
            reading("watched", program.watch),
            reading("done", program.done),
            "",
        ]
    )


def obstacle(program: Program, parts: Mapping[str, str], guids: Mapping[str, str], bench: Path | None) -> str:
    """Return why a system cannot be linked; empty where it can.

    parts: slot -> name, of the native parts of the bench.  guids: slot -> GUID of its FMU.
    """
    others = [p.slot for p in program.parts if p.slot not in parts]
    if others:
        return f"{', '.join(others)}: not a native part of this bench"
    if apart := [slot for slot, name in parts.items() if load_part(name, bench)._outside is not None]:
        return f"{', '.join(apart)}: a controller in C of your own, which is compiled apart"
    whole = {g.at + j for p in program.parts for g in p.gets if not g.doubles for j in range(g.n)}
    if rounded := [p.slot for p in program.parts for g in p.sets if not (g.doubles or whole.issuperset(g.source))]:
        return f"{', '.join(rounded)}: a wire from a real to a whole number, whose range is checked in calls only"
    if program.delays or program.constants or any(g.shifted for p in program.parts for g in p.sets):
        return "a wire has an offset, a constant or a delay"
    changed = [s for s, name in parts.items() if guids[s] != native_guid(name, load_part(name, bench))]
    return f"{', '.join(changed)}: the files of the part have changed since its FMU was built" if changed else ""


def linked_library(program: Program, steps: float | None) -> Path | None:
    """Return the library of a program; None where it is not in the cache and so many steps are not worth it.

    steps: None compiles it in any case.  Raises CompilerError.
    """
    engine = SOURCE.read_text(encoding="utf-8")
    source = "#define LINKED\n" + engine.replace('#include "system.h"\n', system_text(program))
    path = library_path("linked", source)
    if steps is not None and steps * len(program.parts) * SAVED < COMPILATION and not is_intact(path):
        return None
    return make_library(path, source)
