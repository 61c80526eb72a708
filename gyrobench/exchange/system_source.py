"""A system of native parts as one C component: model.c with all parts, their values, the wires, what is exposed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from gyrobench import packaging
from gyrobench.component.component import Component
from gyrobench.component.declarations import Scalar
from gyrobench.engine.linked_system import HELPER, READ, assignments, checks_inputs, places
from gyrobench.engine.program import Program
from gyrobench.packaging.linked_parts import c_name, linked_files
from gyrobench.packaging.native_target import face_files
from gyrobench.packaging.tuning import tuning

HERE = Path(packaging.__file__).parent
KINDS = {float: "Real", int: "Integer", bool: "Boolean"}


@dataclass(frozen=True)
class Exposed:
    """A variable of the system: its scalar (name, section, start, declaration), and what it stands for in the parts.

    ends: (slot, value reference); an output has one.
    """

    scalar: Scalar
    ends: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class SystemSource:
    """Content of the model.c of a system.

    parts: slot -> (name, class).  settings: (slot, value reference, value) of what is set in the parts.
    exposed: in the order of their value references: parameters, inputs, outputs.
    """

    name: str
    program: Program
    parts: Mapping[str, tuple[str, type[Component]]]
    settings: Sequence[tuple[str, int, float]]
    exposed: Sequence[Exposed]
    step: float

    def section(self, name: str) -> list[Exposed]:
        return [e for e in self.exposed if e.scalar.section == name]

    def tunable(self) -> frozenset[int]:
        """Return the value references of the parameters that may be set between steps, in all parts they belong to."""
        of = {slot: tuning(cls).tunable for slot, (_, cls) in self.parts.items()}
        named = self.section("parameter")
        return frozenset(e.scalar.reference for e in named if all(r in of[slot] for slot, r in e.ends))


def _function(head: str, lines: Sequence[str], count: int, used: bool = True) -> str:
    pointers = [f"    double *const v{i} = (double *)&parts->p{i};" for i in range(count)] if used else []
    unused = ["    " + " ".join(f"(void)v{i};" for i in range(count))] if used else []
    return "\n".join([f"static {head} {{", *pointers, *unused, *(f"    {line}" for line in lines), "}"])


def model_text(s: SystemSource, guid: str) -> str:
    """Return model.c."""
    slots = s.program.order
    at = {slot: i for i, slot in enumerate(slots)}
    part = {slot: c_name(s.parts[slot][0]) for slot in slots}
    count = len(slots)
    source = places(s.program)
    sections = {n: s.section(n) for n in ("parameter", "input", "output")}
    wires, reads, steps, inits, begins = [], [], [], [], []
    for i, p in enumerate(s.program.parts):
        sets = [line for g in p.sets for line in assignments(g, i, source)]
        wires += sets + [f"parts->p{i}.n.dirty = 1.0;"] * bool(sets)
        refresh = [f"refresh_{part[p.slot]}(&parts->p{i});"] * bool(p.gets)
        wires += refresh
        reads += refresh
        step = "do_step" if checks_inputs(p) else "linked_step"
        steps += [f"/* {p.slot} */", *sets, f"{step}_{part[p.slot]}(&parts->p{i}, t, h);"]
        steps += [f"if (parts->p{i}.failed) return {i};"]
        inits += [f"initialize_{part[p.slot]}(&parts->p{i}, t0);", f"if (parts->p{i}.failed) return;"]
        begins += [f'begin_{part[p.slot]}(&parts->p{i}, "{p.slot}");', f"parts->p{i}.n.v.t = t0;"]
    settings = [f"{{{at[slot]}, {reference}, {value!r}}}" for slot, reference, value in s.settings]
    failing = [f"if (parts->p{i}.failed) return parts->p{i}.message;" for i in range(count)]

    def setting(section: str) -> list[str]:
        return [f"v{at[slot]}[{r}] = x[{e.scalar.reference}];" for e in sections[section] for slot, r in e.ends]

    tunable = s.tunable()
    tunes = [line for slot in slots for line in _tuning(s, slot, at[slot], part[slot], tunable)]
    flags = ", ".join(str(int(e.scalar.reference in tunable)) for e in sections["parameter"]) or "0"
    getting = [
        f"x[{e.scalar.reference}] = {READ[KINDS[e.scalar.decl.type]].format(f'v{at[slot]}[{r}]')};"
        for e in sections["output"]
        for slot, r in e.ends
    ]
    taking = [f"out[{place}] = {value};" for place, value in source.items()]
    n_p, n_u, n_y = (len(sections[n]) for n in ("parameter", "input", "output"))
    names = ", ".join(f'"{e.scalar.name}"' for e in s.exposed) or '""'
    starts = ", ".join(repr(float(e.scalar.start)) for e in s.exposed) or "0.0"
    pick = [f"double *const v[] = {{{', '.join(f'v{i}' for i in range(count))}}};", "unsigned i;"]
    pick += ["for (i = 0; i < sizeof settings / sizeof *settings; i++)"]
    pick += ["    if (settings[i].slot >= 0) v[settings[i].slot][settings[i].reference] = settings[i].value;"]
    text = [
        f"/* The system {s.name}: all parts in one library, in execution order, with the wires between them. */",
        '#include "parts.h"',
        f"typedef struct {{ double x[{max(len(s.exposed), 1)}], t; }} Vars; /* parameters, inputs, outputs */",
        "typedef struct {\n"
        + "\n".join(f"    Part_{part[p]} p{i}; /* {p} */" for i, p in enumerate(slots))
        + "\n} Parts;",
        "\n".join(
            f"#define {k} {v}"
            for k, v in {
                "MODEL_GUID": f'"{guid}"',
                "N_REFERENCES": len(s.exposed),
                "U0": n_p,
                "N_U": n_u,
                "Y0": n_p + n_u,
                "N_Y": n_y,
                "N_SLOTS": count,
                "N_WIRED": max(source, default=0) + 1,
                "STEP": repr(s.step),
            }.items()
        ),
        f"static const double starts[] = {{{starts}}};",
        f"static const char *const names[] = {{{names}}};",
        f"static const unsigned char tunable[] = {{{flags}}}; /* which parameters may be set between steps */",
        "static const struct { int slot, reference; double value; } settings[] = {\n    "
        + ",\n    ".join(settings or ["{-1, 0, 0.0}"])
        + "\n};",
        HELPER,
        _function("void begin_parts(Parts *parts, double t0)", [*begins, *pick], count),
        _function("void set_parameters(Parts *parts, const double *x)", ["(void)x;", *setting("parameter")], count),
        _function(
            "COLD void tune_parts(Parts *parts, Parts *room, const double *x)", ["(void)room; (void)x;", *tunes], count
        ),
        _function("void set_inputs(Parts *parts, const double *x)", ["(void)x;", *setting("input")], count),
        _function("void get_outputs(Parts *parts, double *x)", ["(void)x;", *getting], count),
        _function("void take_wired(Parts *parts, double *out)", taking, count),
        _function("void read_all(Parts *parts)", reads, count, False),
        _function("void write_and_read_all(Parts *parts)", wires, count),
        _function("void initialize_parts(Parts *parts, double t0)", inits, count, False),
        _function("const char *reason(Parts *parts)", [*failing, "return NULL;"], count, False),
        "/* One step of all parts; the number of the one that failed, or -1. */\n"
        + _function("inline int step_parts(Parts *parts, double t, double h)", [*steps, "return -1;"], count),
        '#include "system_core.h"',
    ]
    return "\n\n".join(text) + "\n"


def _tuning(s: SystemSource, slot: str, i: int, part: str, tunable: frozenset[int]) -> list[str]:
    """Return the lines that set the tunable parameters of a part, where one has changed."""
    sets = [(f"v{i}[{r}]", f"x[{e.scalar.reference}]") for e in s.section("parameter")
            if e.scalar.reference in tunable for of, r in e.ends if of == slot]  # fmt: skip
    if not sets:
        return []
    changed = " || ".join(f"{a} != {b}" for a, b in sets)
    inner = [*(f"{a} = {b};" for a, b in sets), f"tune_{part}(&parts->p{i}, &room->p{i}.n);"]
    return [f"if ({changed}) {{ /* {slot} */", *(f"    {x}" for x in inner), "}", f"if (parts->p{i}.failed) return;"]


def source_files(s: SystemSource, guid: str, fmi: int) -> dict[str, str]:
    """Return all files that a C compiler needs, by name; ``fmi2.c`` (or ``fmi3.c``) is the one to compile."""
    return {
        **linked_files({c_name(name): cls for name, cls in s.parts.values()}),
        "model.c": model_text(s, guid),
        "system_core.h": (HERE / "system_core.h").read_text(encoding="utf-8"),
        **face_files([1] * len(s.exposed), fmi),
    }
