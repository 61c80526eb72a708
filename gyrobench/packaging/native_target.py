"""The native target: the part as one C file, readable beside its Python, and as a shared library."""

from __future__ import annotations

import importlib.util
import itertools
import math
from collections.abc import Iterable
from pathlib import Path

from gyrobench.component import Component, Scalar
from gyrobench.packaging import elementary_tables
from gyrobench.packaging.c_arrays import dimensions
from gyrobench.packaging.dependencies import followed, written
from gyrobench.packaging.own_controller.c_law import UNIT
from gyrobench.packaging.source import PartCode, member
from gyrobench.packaging.translation import Translation
from gyrobench.packaging.tuning import tuning

HERE = Path(__file__).parent
#: before and after model.c of a part with long loops; elsewhere vector code costs more than it saves (compiler.py)
VECTOR_CODE = (
    """#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC optimize("tree-loop-vectorize")
#endif""",
    """#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif""",
)
PER = {"start": 0, "step": 1, "second": 2}


def _struct(cls: type[Component]) -> str:
    """Return ``Vars``, the declarations in the order of the value references."""
    lines: list[str] = []
    done: set[tuple[str, str]] = set()
    inner: list[str] = []
    for s in cls.layout:
        if s.section == "derivative":
            if ("der", s.decl.name) not in done:
                done.add(("der", s.decl.name))
                inner.append(f"{member(s.decl.name)}{dimensions(s.decl.shape)}")
            continue
        if inner:
            lines.append(f"    struct {{ double {', '.join(inner)}; }} der;")
            inner = []
        if ("", s.decl.name) not in done:
            done.add(("", s.decl.name))
            comment = f"{s.decl.unit}, {s.decl.doc}".replace("*/", "* /")
            lines.append(f"    double {member(s.decl.name)}{dimensions(s.decl.shape)}; /* {comment} */")
    if inner:
        lines.append(f"    struct {{ double {', '.join(inner)}; }} der;")
    if cls.noises:
        drawn = ", ".join(f"{member(n.name)}{dimensions(n.sample_shape)}" for n in cls.noises)
        lines.append(f"    struct {{ double {drawn}; }} noise; /* samples */")
    lines.append("    double t, h, step_start, step_end, tick; /* times as in component.py; count of internal steps */")
    return "\n".join(["typedef struct {", *lines, "} Vars;"])


def _table(head: str, rows: list[str], empty: str) -> str:
    return f"{head} = {{\n" + ",\n".join(f"    {r}" for r in rows or [empty]) + "\n};"


def first_of(cls: type[Component], section: str) -> int:
    """Return the first value reference of a section, or where it would stand."""
    order = ("parameter", "input", "output", "state", "derivative", "discrete")
    return sum(1 for s in cls.layout if order.index(s.section) < order.index(section))


def _bounds(s: Scalar) -> list[str]:
    limits = (s.decl.min, s.decl.max, s.decl.above, s.decl.below)
    return [f"{{{s.reference}, {k}, {b!r}}}" for k, b in enumerate(limits) if b is not None]


def _runs(references: list[int]) -> list[tuple[int, int]]:
    """Return rising numbers as runs of consecutive ones: (first, count)."""
    runs: list[tuple[int, int]] = []
    for r in references:
        if runs and sum(runs[-1]) == r:
            runs[-1] = runs[-1][0], runs[-1][1] + 1
        else:
            runs.append((r, 1))
    return runs


def c_source(cls: type[Component], guid: str) -> str:
    """Return model.c of a part.  Raises SubsetError where an equation leaves the subset."""
    source = PartCode(cls)
    layout = cls.layout
    counts = {s: sum(1 for x in layout if x.section == s) for s in {x.section for x in layout}}
    checked = [s for s in layout if s.section in ("parameter", "input", "state")]
    bounds = [b for s in checked for b in _bounds(s)]
    samples, tuned = len(layout), tuning(cls)
    param = {s.name: s.reference for s in layout if s.section == "parameter"}
    changing = written(source)
    names_followed = followed(source)
    follow = (
        None
        if names_followed is None
        else [str(s.reference) for n in names_followed for s in layout if s.decl.name == n]
    )
    discrete = [s for s in layout if s.section == "discrete" and not s.is_memory]
    watched = _runs([s.reference for s in discrete])
    stepped = _runs([s.reference for s in discrete if s.decl.name in changing])
    ports = [
        f"{{{param[n.name]}, {samples + stream}, {PER[n.per]}, {stream}, {math.prod(n.sample_shape)}}}"
        for stream, n in zip(cls.streams, cls.noises, strict=True)
        if n.per != "use"
    ]
    defines = {
        "MODEL_GUID": f'"{guid}"',
        "N_REFERENCES": len(layout),
        "U0": first_of(cls, "input"),
        "Y0": first_of(cls, "output"),
        "X0": first_of(cls, "state"),
        "DX0": first_of(cls, "derivative"),
        "N_U": counts.get("input", 0),
        "N_Y": counts.get("output", 0),
        "N_X": counts.get("state", 0),
        "N_PORTS": len(ports),
        "N_STREAMS": sum(math.prod(n.sample_shape) for n in cls.noises),
        "N_BOUNDS": len(bounds),
        "N_WATCHED": len(watched),
        "N_STEPPED": len(stepped),
        "N_FOLLOWED": -1 if follow is None else len(follow),
        "N_DERIVED": len(tuned.derived),
        "NONLINEAR": f"(p->n.v.{cls.nonlinear} != 0.0)" if isinstance(cls.nonlinear, str) else int(cls.nonlinear),
        "OF_MATRIX": "NEVER_INLINE" if cls.nonlinear else "COLD",  # of a linear part it is made once for each step
        "MIDPOINT": int(cls.integrator == "midpoint"),
        "RK4_SUBSTEPS": cls.rk4_substeps if cls.integrator == "rk4" else 0,
        "LARGEST_STEP(p, step)": "((p)->n.v.step)" if "step" in cls.declarations else "(step)",
    }
    may_be_set = [str(int(s.reference in tuned.tunable)) for s in layout if s.section == "parameter"]
    names = [f'"{s.name}"' for s in layout]
    units = [f'"{s.decl.unit}"' for s in layout]
    parts = [
        f"/* {cls.__name__} {cls.version}: generated from its model.py, line by line. */",
        _struct(cls),
        "\n".join(f"#define {k} {v}" for k, v in defines.items()),
        _table("static const double starts[]", [repr(s.start) for s in layout], "0.0"),
        _table("static const char *const names[]", names, '""'),
        _table("static const char *const unit_names[]", units, '""'),
        "/* kind of bound: 0 >=, 1 <=, 2 >, 3 <.  per: 0 start, 1 internal step, 2 second; first stream and number */",
        _table("static const struct { int reference, kind; double limit; } bounds[]", bounds, "{-1, 0, 0.0}"),
        _table("static const struct { int parameter, sample, per, stream, streams; } ports[]", ports, "{0}"),
        "/* discrete values but for memories, and those that steps change: first reference and number */",
        _table("static const struct { int from, n; } watched[]", [f"{{{a}, {n}}}" for a, n in watched], "{0, 0}"),
        _table("static const struct { int from, n; } stepped[]", [f"{{{a}, {n}}}" for a, n in stepped], "{0, 0}"),
        "/* what the outputs follow from, where that is inputs and discretes alone */",
        _table("static const int followed[]", follow or [], "0"),
        "/* which parameters may be set between steps; what the start makes of parameters alone */",
        _table("static const unsigned char tunable[]", [", ".join(may_be_set) or "0"], ""),
        _table("static const int derived[]", [", ".join(map(str, tuned.derived)) or "0"], ""),
        '#include "core.h"',
        Translation(source).text,
    ]
    if cls.long_loops:
        parts = [VECTOR_CODE[0], *parts, VECTOR_CODE[1]]
    return "\n\n".join(parts) + "\n"


def variables(cls: type[Component]) -> list[list[Scalar]]:
    """Return the variables of the FMI 3.0 face as their elements: those of an array, or one scalar."""
    return [list(v) for _, v in itertools.groupby(cls.layout, lambda s: (s.section, s.decl.name))]


def header_folder() -> Path:
    """Return the folder of the FMI headers of the installed FMPy."""
    spec = importlib.util.find_spec("fmpy")
    assert spec is not None and spec.origin is not None
    return Path(spec.origin).parent / "c-code"


def runtime_files() -> dict[str, str]:
    """Return what model.c includes, by name."""
    names = ("core.h", "integration.h", "functions.h", "noise.h", "elementary.h")
    files = {n: (HERE / n).read_text(encoding="utf-8") for n in names}
    return files | {"elementary_tables.h": elementary_tables.tables()}


def face_files(extents: Iterable[int], fmi: int) -> dict[str, str]:
    """Return the files beside model.c and what that includes, by name: instance.c, the FMI face and its headers.

    extents: of each value reference of FMI 2.0 the number of values of its variable in FMI 3.0: 1 for a scalar; of an
    array its size at the first element and 0 at the others.
    """
    headers = [f"fmi{fmi}Functions.h", f"fmi{fmi}FunctionTypes.h"]
    headers.append("fmi2TypesPlatform.h" if fmi == 2 else "fmi3PlatformTypes.h")
    return {
        "extents.h": f"static const int extents[] = {{{', '.join(map(str, extents)) or '0'}}};\n",
        **{n: (HERE / n).read_text(encoding="utf-8") for n in ("instance.h", "instance.c", f"fmi{fmi}.c")},
        **{h: (header_folder() / h).read_text(encoding="utf-8") for h in headers},
    }


def source_files(cls: type[Component], guid: str, fmi: int) -> dict[str, str]:
    """Return all files that a C compiler needs, by name; ``fmi2.c`` (or ``fmi3.c``) is the one to compile.

    A controller in C of the user's own has one more.
    """
    return {
        "model.c": c_source(cls, guid),
        **runtime_files(),
        **face_files((n for v in variables(cls) for n in (len(v), *[0] * (len(v) - 1))), fmi),
        **({} if cls._outside is None else {UNIT: cls._outside.unit}),
    }
