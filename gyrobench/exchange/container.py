"""A system as one container FMU, through fmu-manipulation-toolbox (sequential: execution order of the bench)."""

from __future__ import annotations

import logging
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gyrobench.exchange.ssp_export import ExportError, prepare, recorded
from gyrobench.system.system import System


def export_container(
    system: System,
    path: Path,
    parts: Mapping[str, Path | str] | None = None,
    maps: Mapping[str, Path] | None = None,
    values: Mapping[str, Any] | None = None,
    seed: int = 1,
    bench: Path | None = None,
) -> list[str]:
    """Write a container FMU (FMI 2.0 co-simulation); return notes for the user.

    Its variables "slot.output" are those that a record needs: outputs, or locals where they are wired inside too.
    Its step is the system's, the values are built in.  Within a step the FMUs run in the execution order of the bench,
    each with the newest values; initial outputs are not propagated around cut loops (the toolbox logs this).
    Raises ExportError without the toolbox, or when a connection has a factor (a container only copies), and what a
    run would raise before it runs.
    """
    try:
        from fmu_manipulation_toolbox.assembly import AssemblyNode
    except ImportError:
        raise ExportError("container: needs fmu-manipulation-toolbox; pip install gyrobench[container]") from None
    assembly, starts, notes = prepare(system, parts, maps, values, seed, bench)
    scaled = sorted({c.wire for c in assembly.connections if c.gain != 1.0 or c.offset})
    if scaled:
        raise ExportError(
            f"container: a container FMU copies values and cannot apply the factors and offsets of "
            f"{', '.join(scaled)}; "
            "use a part in SI units, or export to SSP"
        )
    if late := sorted({c.wire for c in assembly.connections if c.delayed}):
        raise ExportError(f"container: a container FMU cannot carry the delay of {', '.join(late)}; export to SSP")
    wires = [c for c in assembly.connections if c.output.constant is None]
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="gyrobench-") as name:
        folder = Path(name)
        node = AssemblyNode(
            path.name,
            step_size=assembly.system.step,
            sequential=True,
            auto_link=False,
            auto_input=False,
            auto_output=False,
        )
        for slot in assembly.order.order:
            shutil.copyfile(assembly.paths[slot], folder / f"{slot}.fmu")
            node.add_fmu(f"{slot}.fmu")
        for c in wires:
            node.add_link(f"{c.source}.fmu", c.output.variable, f"{c.target}.fmu", c.input.variable)
        wired = {(c.source, c.output.variable) for c in wires}
        for port, (slot, bound) in recorded(assembly).items():
            if (slot, bound.variable) not in wired:  # a wired output is a local of that name by itself
                node.add_output(f"{slot}.fmu", bound.variable, port)
        for slot, chosen in starts.items():
            for bound, value in chosen:
                text = repr(value) if bound.kind == "Real" else str(value).lower() if bound.kind == "Boolean" else value
                node.add_start_value(f"{slot}.fmu", bound.variable, str(text))
        logger = logging.getLogger("fmu_manipulation_toolbox")
        level = logger.level
        logger.setLevel(logging.CRITICAL)
        try:
            node.make_fmu(folder)
        except Exception as error:
            raise ExportError(f"container: {type(error).__name__}: {getattr(error, 'reason', error)}") from None
        finally:
            logger.setLevel(level)
        shutil.move(folder / path.name, path)
    return notes
