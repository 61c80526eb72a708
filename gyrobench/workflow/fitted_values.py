"""Values that a result gives a part of the bench, as files for other tools: ``--fit-to PART``.

    PART.toml       for gyrobench run SYSTEM --set @PART.toml
    PART.json       values, standard uncertainties, units
    PART.h          the values as constants of C

All in SI.  Which parts a system has values for it says itself (System.fitted); of a drift record, the noise of a gyro.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.bench import UsageError
from gyrobench.files import write_whole
from gyrobench.record.record import Record
from gyrobench.result import Result
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.workflow.gyro_values import channels_of, write_gyro_values

Values = Mapping[str, tuple[Any, Any, str]]  # parameter -> value, standard uncertainty, unit


def refuse_unfitted(test: System | Suite, part: str) -> None:
    """Raise UsageError for a part that a test has no values for, before the work."""
    if isinstance(test, Suite):
        raise UsageError(f"--fit-to {part}: {test.name} is a suite; only its tests give values, one by one")
    if test.fitted and part not in test.fitted:
        raise UsageError(f"--fit-to {part}: {test.name} gives values for {', '.join(test.fitted)}")
    if not test.fitted:
        channels_of(part)


def write_fitted(system: System, result: Result, record: Record, part: str, folder: Path) -> list[Path]:
    """Write the values that a result gives a part into a folder; return the files.  Raises UsageError."""
    file = folder / f"{part}.toml"
    if part not in system.fitted:
        write_gyro_values(result, record, part, file)
        return [file]
    slot, values = system.values_for(part, result)
    run = record.run
    source = run.data.file if run.data else f"run of {run.system}, seed {run.seed}"
    about = f"{part} from {source}, SI"
    texts = {
        file: _toml(about, system.name, file.name, slot, values),
        folder / f"{part}.json": _json(about, result, values),
        folder / f"{part}.h": _header(about, part, values),
    }
    for path, text in texts.items():
        write_whole(path, text.encode())
    return list(texts)


def _toml(about: str, system: str, name: str, slot: str, values: Values) -> str:
    lines = [f"# {about}: gyrobench run {system} --set @{name}", f"[{slot}]"]
    for n, (value, u, unit) in values.items():
        lines += [f"# {unit}, u = {json.dumps(u)}", f"{n} = {json.dumps(value)}"]
    return "\n".join(lines) + "\n"


def _json(about: str, result: Result, values: Values) -> str:
    parameters = {n: {"value": v, "u": u, "unit": unit} for n, (v, u, unit) in values.items()}
    content = {"about": about, "instrument": result.instrument, "parameters": parameters}
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def _header(about: str, part: str, values: Values) -> str:
    """Return the values as constants of C, arrays row by row."""
    guard = f"{part.upper()}_H"
    safe = re.sub(r"[^ -~]", "?", about).replace("*/", "* /")
    lines = [f"/* {safe} */", f"#ifndef {guard}", f"#define {guard}", ""]
    for n, (value, _, unit) in values.items():
        shape = "".join(f"[{k}]" for k in np.shape(value))
        held = json.dumps(value).replace("[", "{").replace("]", "}")
        lines.append(f"static const double {part}_{n}{shape} = {held}; /* {unit} */")
    return "\n".join([*lines, "", f"#endif /* {guard} */"]) + "\n"
