"""Builds the foreign FMUs of the tests: ``name.c`` and ``name.xml`` to ``name.fmu``, with the system's C compiler."""

from __future__ import annotations

import subprocess
import zipfile
from pathlib import Path

HERE = Path(__file__).parent


def make(name: str, folder: Path) -> Path:
    """Compiles tests/foreign/<name>.c against FMPy's FMI headers and packs the FMU into ``folder``."""
    import fmpy

    from gyrobench.packaging import compiler

    command = compiler.command(compiler.this_platform())
    assert command is not None, "no C compiler"
    platform = compiler.this_platform()
    suffix = compiler.PLATFORMS[platform][0]
    library = folder / f"{name}{suffix}"
    headers = Path(fmpy.__file__).parent / "c-code"
    flags = ["-O2", "-std=c11", "-shared", "-fPIC", f"-I{headers}", f"-I{HERE}"]
    subprocess.run([*command, *flags, str(HERE / f"{name}.c"), "-o", str(library), "-lm"], check=True)
    path = folder / f"{name}.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(HERE / f"{name}.xml", "modelDescription.xml")
        archive.write(library, f"binaries/{platform}/{name}{suffix}")
    return path
