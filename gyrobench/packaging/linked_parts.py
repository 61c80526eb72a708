"""Several native parts in one C file: each part's model.c with the names that other parts have too made its own."""

from __future__ import annotations

import re
from collections.abc import Mapping

from gyrobench.component import Component
from gyrobench.packaging.native_target import c_source, runtime_files

DEFINED = re.compile(
    r"^(?:BY_PROCESSOR )?static (?:inline |NEVER_INLINE |COLD |OF_MATRIX )?\w+ \*?(\w+)\("  # functions
    r"|^static const .*?(\w+)\[\] = "  # tables
    r"|^\} (\w+);"  # structures
    r"|^typedef double (\w+)\[",
    re.MULTILINE,
)
MACRO = re.compile(r"^#define (\w+)", re.MULTILINE)


def c_name(part: str) -> str:
    """Return the name of a part as the end of C names."""
    return re.sub(r"\W", "_", part)


def linked_files(parts: Mapping[str, type[Component]]) -> dict[str, str]:
    """Return the files of parts that are compiled together, by name; ``parts.h`` includes all of them.

    parts: C name -> class.  What model.c and core.h define for the part ``gyro`` is called ``Part_gyro``,
    ``do_step_gyro`` and so on after ``parts.h``; what no part changes (functions.h) is there once.
    """
    files = runtime_files()
    blocks = []
    for name, cls in parts.items():
        model = c_source(cls, "")
        files[f"part_{name}.c"] = model
        text = files["core.h"] + files["integration.h"] + model
        names = list(dict.fromkeys(n for groups in DEFINED.findall(text) for n in groups if n))
        lines = [f"#define {n} {n}_{name}" for n in names]
        lines += [f'#include "part_{name}.c"', *(f"#undef {n}" for n in (*names, *MACRO.findall(model)))]
        blocks.append("\n".join(lines))
    files["parts.h"] = '#include "functions.h"\n\n' + "\n\n".join(blocks) + "\n"
    return files
