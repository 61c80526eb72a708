"""FMUs in a small host in C: on this platform, or under wine."""

from __future__ import annotations

import shutil
import struct
import subprocess
import zipfile
from pathlib import Path

import pytest
from fmpy import read_model_description

from gyrobench.packaging.compiler import PLATFORMS, command
from gyrobench.packaging.native_target import header_folder

HOST = Path(__file__).parents[1] / "foreign" / "host.c"


def host(platform: str, folder: Path) -> list[str]:
    """Compile the host; return the command that runs it.  Skips where the platform cannot be had."""
    cc = command(platform)
    if cc is None:
        pytest.skip(f"no compiler for {platform} (gyrobench[cross])")
    wine = shutil.which("wine64") or shutil.which("wine")
    if platform == "win64" and wine is None:
        pytest.skip("wine is not installed: the FMUs of Windows are not run")
    file = folder / ("host.exe" if platform == "win64" else "host")
    libraries = [] if platform == "win64" else ["-ldl"]
    subprocess.run([*cc, "-O1", f"-I{header_folder()}", str(HOST), "-o", str(file), *libraries], check=True)
    return [wine, str(file)] if platform == "win64" and wine else [str(file)]


def run(
    host: list[str], fmu: Path, platform: str, references: list[int], steps: int, step: float, folder: Path
) -> list[list[float]]:
    """Return the outputs after each step, from the library in an FMU."""
    description = read_model_description(str(fmu))
    name = f"{description.coSimulation.modelIdentifier}{PLATFORMS[platform][0]}"
    with zipfile.ZipFile(fmu) as archive:
        library = archive.extract(f"binaries/{platform}/{name}", folder)
    words = [*host, library, description.guid, str(steps), repr(step), *map(str, references)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.split("\n")[:-1]
    return [[struct.unpack(">d", bytes.fromhex(word.strip()))[0] for word in line.split()] for line in lines]
