"""FMUs of Windows give the bits of those of this platform: a part and systems, run by a small host in C under wine.

But for sin, cos and exp, which are those of each platform's C library: their last digit is not the same for every
argument.  It is for the float angles of a closed loop, some microradians, where the series of sin and cos has one term
that tells: systems whose tables rest give the same bits to the end.
The same host runs a library of this platform too, so what is compared under wine is known to work here.
"""

from __future__ import annotations

import shutil
import struct
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave

from gyrobench.exchange.system_fmu import export_fmu
from gyrobench.packaging import build
from gyrobench.packaging.compiler import PLATFORMS, command, this_platform
from gyrobench.packaging.native_target import header_folder
from gyrobench.system.system import System, load_system

HOST = Path(__file__).parents[1] / "foreign" / "host.c"
STEPS = 2000
QUICK = {"dwell": 0.2, "turns": 0.02, "table.index_rate": 1.0}


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
    host: list[str], fmu: Path, platform: str, references: list[int], step: float, folder: Path
) -> list[list[float]]:
    """Return the outputs after each step, from the library in an FMU."""
    description = read_model_description(str(fmu))
    name = f"{description.coSimulation.modelIdentifier}{PLATFORMS[platform][0]}"
    with zipfile.ZipFile(fmu) as archive:
        library = archive.extract(f"binaries/{platform}/{name}", folder)
    words = [*host, library, description.guid, str(STEPS), repr(step), *map(str, references)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.split("\n")[:-1]
    return [[struct.unpack(">d", bytes.fromhex(word.strip()))[0] for word in line.split()] for line in lines]


def by_fmpy(fmu: Path, references: list[int], step: float, folder: Path) -> list[list[float]]:
    """Return the same by FMPy, from the library of this platform."""
    description = read_model_description(str(fmu))
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    name = description.coSimulation.modelIdentifier
    one = FMU2Slave(guid=description.guid, unzipDirectory=str(folder), modelIdentifier=name, instanceName="one")
    one.instantiate()
    one.setupExperiment(startTime=0.0)
    one.enterInitializationMode()
    one.exitInitializationMode()
    rows = []
    for k in range(STEPS):
        one.doStep(k * step, step)
        rows.append(list(one.getReal(references)))
    one.freeInstance()
    return rows


def check(
    fmu: Path, platform: str, command_of_host: list[str], tmp_path: Path, step: float, last_digits: float = 0.0
) -> None:
    """last_digits: share of the values that may differ, by the last digit of the largest value of that output."""
    outputs = [v.valueReference for v in read_model_description(str(fmu)).modelVariables if v.causality == "output"]
    here = by_fmpy(fmu, outputs, step, tmp_path / "here")
    assert len(here) == STEPS and len({tuple(row) for row in here}) > STEPS // 2  # it moves
    there, expected = (
        np.array(run(command_of_host, fmu, platform, outputs, step, tmp_path / "there")),
        np.array(here),
    )
    assert there.shape == expected.shape
    assert np.count_nonzero(there != expected) <= last_digits * expected.size
    assert np.all(np.abs(there - expected) <= np.spacing(np.abs(expected).max(axis=0)))


@pytest.mark.parametrize("platform", [this_platform(), "win64"])
def test_a_part_gives_the_same_bits(platform: str, tmp_path: Path) -> None:
    """With all its noise: the logarithm in the tails of the normal numbers is the platform's own."""
    command_of_host = host(platform, tmp_path)
    platforms = tuple(dict.fromkeys([this_platform(), platform]))
    check(build("floated_gyro", out=tmp_path, platforms=platforms), platform, command_of_host, tmp_path, 1e-3)


@pytest.mark.parametrize("name", ["fixed_position", "stabilizer_sdf", "drift_compensation"])
def test_a_system_gives_the_same_bits_on_windows(name: str, tmp_path: Path) -> None:
    """A rebalance loop and a stabilizer with the noise of their gyros, and a compensator of drift (no sine at all)."""
    command_of_host = host("win64", tmp_path)
    system = load_system(name)
    export_fmu(system, tmp_path / "system.fmu", seed=5, platforms=(this_platform(), "win64"))
    check(tmp_path / "system.fmu", "win64", command_of_host, tmp_path, system.step)


def test_a_table_that_turns_differs_in_last_digits_on_windows(small: System, tmp_path: Path) -> None:
    command_of_host = host("win64", tmp_path)
    values = {**QUICK, "table.acceleration": 0.1}  # the turn lasts as long as the run
    export_fmu(small, tmp_path / "small.fmu", values=values, seed=5, platforms=(this_platform(), "win64"))
    check(tmp_path / "small.fmu", "win64", command_of_host, tmp_path, 1e-3, last_digits=0.002)
