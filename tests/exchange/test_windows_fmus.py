"""FMUs of Windows give the bits of those of this platform: a part and systems, run by a small host in C under wine.

The same host runs a library of this platform too, so what is compared under wine is known to work here.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave
from hosted import host, run

from gyrobench.exchange.system_fmu import export_fmu
from gyrobench.packaging import build
from gyrobench.packaging.compiler import this_platform
from gyrobench.system.system import System, load_system

STEPS = 2000
QUICK = {"dwell": 0.2, "turns": 0.02, "table.index_rate": 1.0}


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


def check(fmu: Path, platform: str, command_of_host: list[str], tmp_path: Path, step: float) -> None:
    outputs = [v.valueReference for v in read_model_description(str(fmu)).modelVariables if v.causality == "output"]
    here = by_fmpy(fmu, outputs, step, tmp_path / "here")
    assert len(here) == STEPS and len({tuple(row) for row in here}) > STEPS // 2  # it moves
    there = run(command_of_host, fmu, platform, outputs, STEPS, step, tmp_path / "there")
    assert np.array(there).tobytes() == np.array(here).tobytes()


@pytest.mark.parametrize("platform", [this_platform(), "win64"])
def test_a_part_gives_the_same_bits(platform: str, tmp_path: Path) -> None:
    """With all its noise."""
    command_of_host = host(platform, tmp_path)
    platforms = tuple(dict.fromkeys([this_platform(), platform]))
    check(build("floated_gyro", out=tmp_path, platforms=platforms), platform, command_of_host, tmp_path, 1e-3)


@pytest.mark.parametrize("name", ["fixed_position", "stabilizer_sdf", "drift_compensation"])
def test_a_system_gives_the_same_bits_on_windows(name: str, tmp_path: Path) -> None:
    """A rebalance loop and a stabilizer with the noise of their gyros, and a compensator of drift."""
    command_of_host = host("win64", tmp_path)
    system = load_system(name)
    export_fmu(system, tmp_path / "system.fmu", seed=5, platforms=(this_platform(), "win64"))
    check(tmp_path / "system.fmu", "win64", command_of_host, tmp_path, system.step)


def test_a_table_that_turns_gives_the_same_bits_on_windows(small: System, tmp_path: Path) -> None:
    command_of_host = host("win64", tmp_path)
    values = {**QUICK, "table.acceleration": 0.1}  # the turn lasts as long as the run
    export_fmu(small, tmp_path / "small.fmu", values=values, seed=5, platforms=(this_platform(), "win64"))
    check(tmp_path / "small.fmu", "win64", command_of_host, tmp_path, 1e-3)
