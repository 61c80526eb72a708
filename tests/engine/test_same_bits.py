"""One table of digests of the records of all systems, which every platform and target gives.

All systems in Node too: ``python tests/benchmarks/same_bits.py``.
"""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import pytest
from bits import SEED, STEPS, digest, expected, first_steps, in_node, recorded, systems
from fmpy import read_model_description
from hosted import host, run

from gyrobench.exchange.system_fmu import export_fmu
from gyrobench.packaging.compiler import this_platform

#: tables that turn, angles of gimbals, a platform at sea, a gyro in a tumble with noise of all kinds, filters
IN_NODE = ("accelerometer_four", "gyrocompass", "platform_three_axis", "tumble_two_axis", "servo_polar")
IN_PYTHON = ("gyrocompass", "north_finder", "tumble_single_axis")


def test_the_table_has_all_systems() -> None:
    assert list(expected()) == systems()


@pytest.mark.parametrize("name", systems())
def test_the_record_has_the_bits_of_the_table(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert digest(recorded(first_steps(name, monkeypatch))) == expected()[name]


@pytest.mark.parametrize("name", IN_PYTHON)
@pytest.mark.long
def test_the_python_target_gives_them(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert digest(recorded(first_steps(name, monkeypatch), "reference", "python")) == expected()[name]


@pytest.mark.parametrize("name", IN_NODE)
@pytest.mark.long
def test_webassembly_gives_them(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    node = shutil.which("node")
    if node is None or importlib.util.find_spec("ziglang") is None:
        pytest.skip("node or ziglang is not installed: WebAssembly is not run")
    system = first_steps(name, monkeypatch)
    assert digest(in_node(system, node, list(recorded(system)), tmp_path)) == expected()[name]


@pytest.mark.parametrize("platform", [this_platform(), "win64"])
@pytest.mark.parametrize("name", ["gyrocompass", "tumble_two_axis"])
@pytest.mark.long
def test_the_one_fmu_gives_them(name: str, platform: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a host in C: here, and the library of Windows under wine."""
    command = host(platform, tmp_path)
    system = first_steps(name, monkeypatch)
    channels = list(recorded(system))
    export_fmu(system, tmp_path / "one.fmu", seed=SEED, platforms=(platform,))
    outputs = {v.name: v.valueReference for v in read_model_description(str(tmp_path / "one.fmu")).modelVariables}
    rows = run(
        command, tmp_path / "one.fmu", platform, [outputs[n] for n in channels], STEPS, system.step, tmp_path / "there"
    )
    assert digest({n: [row[k] for row in rows] for k, n in enumerate(channels)}) == expected()[name]
