"""Builds the foreign FMUs of the tests: ``name.c`` and ``name.xml`` to ``name.fmu``, with the system's C compiler."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).parents[1] / "foreign"


def make(name: str, folder: Path, *flags: str, identifier: str | None = None) -> Path:
    """Compiles tests/foreign/<name>.c against FMPy's FMI headers and packs the FMU into ``folder``.

    <name>.py is packed by pythonfmu.  flags: of the compiler.  identifier: the modelIdentifier of the description,
    where it is not the name.
    """
    import fmpy

    if (script := HERE / f"{name}.py").is_file():
        # not by import: a Python FMU that ran in this process has put its own copy of pythonfmu first on the path
        program = [sys.executable, "-m", "pythonfmu", "build", "-f", str(script), "-d", str(folder)]
        subprocess.run(program, check=True, stdout=subprocess.DEVNULL)
        return next(folder.glob(f"{name.title().replace('_', '')}.fmu"))

    from gyrobench.packaging import compiler

    command = compiler.command(compiler.this_platform())
    assert command is not None, "no C compiler"
    platform = compiler.this_platform()
    suffix = compiler.PLATFORMS[platform][0]
    library = folder / f"{name}{suffix}"
    headers = Path(fmpy.__file__).parent / "c-code"
    common = ["-O2", "-std=c11", "-shared", "-fPIC", f"-I{headers}", f"-I{HERE}"]
    subprocess.run([*command, *common, *flags, str(HERE / f"{name}.c"), "-o", str(library), "-lm"], check=True)
    path = folder / f"{name}.fmu"
    three = 'fmiVersion="3.0"' in (HERE / f"{name}.xml").read_text()
    binaries = fmpy.platform_tuple if three else platform
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        text = (HERE / f"{name}.xml").read_text(encoding="utf-8")
        named = text.replace(f'modelIdentifier="{name}"', f'modelIdentifier="{identifier or name}"')
        archive.writestr("modelDescription.xml", named)
        archive.write(library, f"binaries/{binaries}/{name}{suffix}")
    return path
